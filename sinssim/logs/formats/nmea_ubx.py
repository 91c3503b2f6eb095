"""Messages of receivers: NMEA 0183 (pynmeagps) with $GPCHC of CHC inertial receivers, and u-blox UBX (pyubx2).

NMEA, read and written: GGA or GNS, RMC, VTG, GST, ZDA, HDT. Times are UTC of the day; RMC and ZDA give the date. The
height is that above mean sea level plus the geoid's separation where the sentence has it, so that it is above the
ellipsoid. Written are GGA and RMC for each instant, and HDT where there is an attitude. The geoid is that of
`geoid_along`; height and separation of GGA add up to the height above the ellipsoid.

$GPCHC (CGI-410, CGI-610): week, seconds, heading, pitch, roll [°], gyros x, y, z [°/s], accelerometers x, y, z [g],
latitude, longitude [°], height [m], velocity east, north, up, speed [m/s], satellites, status, age, warning. Axes
right, forward, up. Layout: CHC protocol "GPCHC" of the CGI-610 user guide.

UBX: NAV-PVT with NAV-HPPOSLLH, NAV-COV and NAV-RELPOSNED of the same instant. Times are GPS time: iTOW gives the second
of the week, the date of NAV-PVT the week. Layout: u-blox interface descriptions, UBX-18010854 and later.
"""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.gravity_disturbance import GEOID_WORDS, geoid_along
from sinssim.errors import InputError
from sinssim.logs.formats import Format, library
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.gps_time import DAY, WEEK, gps_from_date, gps_from_unix, unix_from_gps, unrolled
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.files import open_file, read_text
from sinssim.units import DEG, G0, KNOT

NMEA_QUALITY = {
    0: "no fix", 1: "single", 2: "differential", 3: "PPS", 4: "fixed", 5: "float", 6: "dead reckoning", 7: "manual",
    8: "simulated",
}  # fmt: skip
"""Meaning of the quality of GGA."""
_FIELDS = ("latitude", "longitude", "height", "speed", "course", "s_n", "s_e", "s_d", "quality", "heading", "day")


def recognises_nmea(path: Path, head: bytes) -> bool:
    """Return whether the first lines begin with $ and an address of five letters, and no UBX is between them."""
    if b"\xb5\x62" in head or b"$GPCHC," in head or b"$GICHC," in head:
        return False
    for line in head.splitlines()[:20]:
        if line[:1] == b"$" and line[1:6].isalnum() and line[1:6].isupper() and line[6:7] == b",":
            return True
    return False


def read_nmea(path: Path) -> Streams:
    """Read the fixes, one for each instant."""
    parse = library("pynmeagps", "pynmeagps", str(path)).NMEAReader.parse
    epochs = _Epochs()
    bad: list[int] = []
    first = ""
    with open_file(path) as file:
        for number, line in enumerate(file, start=1):
            if line[:1] != b"$" or line[3:6] not in _READERS:
                continue
            try:
                epochs.add(line[3:6], parse(line.strip() + b"\r\n"))
            except Exception as error:  # pynmeagps raises various errors for a damaged sentence
                bad.append(number)
                first = first or str(error).rstrip(".")[:120]
    rows = epochs.placed()
    if not rows:
        why = f" Line {bad[0]}: {first}." if bad else ""
        raise InputError(f"{path} holds no position: GGA, GNS or RMC sentences with a fix are needed.{why}")
    notes = [f"{len(bad)} damaged sentences were left out, the first in line {bad[0]}: {first}."] if bad else []
    clock, time = _nmea_times(rows)
    fields = {name: np.array([row[name] for row in rows]) for name in _FIELDS if name != "day"}
    stream, more = _fixes(time, fields, separated=all(row["separated"] for row in rows))
    if not clock.note.startswith("UTC"):
        notes.append("No sentence gives the date.")
    return Streams(path, "nmea", clock, fixes={"gnss": stream}, notes=(*notes, *more))


class _Epochs:
    """Gathers the sentences of each instant."""

    def __init__(self) -> None:
        self._all: list[dict[str, Any]] = []

    def add(self, kind: bytes, message: Any) -> None:
        """Take the numbers of a sentence."""
        _READERS[kind](self, message)

    def placed(self) -> list[dict[str, Any]]:
        """Return the instants with a position."""
        return [epoch for epoch in self._all if math.isfinite(epoch["latitude"]) and math.isfinite(epoch["longitude"])]

    def _at(self, time: Any) -> dict[str, Any]:
        """Return the record of an instant; a new one if the time changed."""
        if not isinstance(time, dt.time):
            raise ValueError("the time is missing")
        seconds = time.hour * 3600 + time.minute * 60 + time.second + 1e-6 * time.microsecond
        if not self._all or self._all[-1]["seconds"] != seconds:
            epoch: dict[str, Any] = dict.fromkeys(_FIELDS, math.nan)
            self._all.append({**epoch, "seconds": seconds, "separated": True, "quality": -1})
        return self._all[-1]

    def _position(self, m: Any) -> dict[str, Any]:
        epoch = self._at(m.time)
        epoch["latitude"], epoch["longitude"] = _number(m.lat), _number(m.lon)
        return epoch

    def gga(self, m: Any) -> None:
        quality = int(m.quality)
        if not 1 <= quality <= 9:  # 0 is no fix; it is one digit, and anything else is damaged
            return
        epoch = self._position(m)
        self._height(epoch, m)
        epoch["quality"] = quality

    def gns(self, m: Any) -> None:
        if not str(m.posMode).strip("N"):
            return
        self._height(self._position(m), m)

    def _height(self, epoch: dict[str, Any], m: Any) -> None:
        above, separation = _number(m.alt), _number(m.sep)
        epoch["separated"] = math.isfinite(separation)
        epoch["height"] = above + (separation if math.isfinite(separation) else 0.0)

    def rmc(self, m: Any) -> None:
        if m.status != "A":
            return
        epoch = self._at(m.time)
        if not math.isfinite(epoch["latitude"]):
            epoch["latitude"], epoch["longitude"] = _number(m.lat), _number(m.lon)
        epoch["speed"], epoch["course"] = _number(m.spd) * KNOT, _number(m.cog)
        if isinstance(m.date, dt.date):
            epoch["day"] = m.date.toordinal()

    def vtg(self, m: Any) -> None:
        if self._all and not math.isfinite(self._all[-1]["speed"]):
            self._all[-1]["speed"], self._all[-1]["course"] = _number(m.sogn) * KNOT, _number(m.cogt)

    def gst(self, m: Any) -> None:
        epoch = self._at(m.time)
        epoch["s_n"], epoch["s_e"], epoch["s_d"] = _number(m.stdLat), _number(m.stdLong), _number(m.stdAlt)

    def zda(self, m: Any) -> None:
        self._at(m.time)["day"] = dt.date(int(m.year), int(m.month), int(m.day)).toordinal()

    def hdt(self, m: Any) -> None:
        if self._all:
            self._all[-1]["heading"] = _number(m.headingT)


_READERS: dict[bytes, Any] = {
    b"GGA": _Epochs.gga, b"GNS": _Epochs.gns, b"RMC": _Epochs.rmc, b"VTG": _Epochs.vtg, b"GST": _Epochs.gst,
    b"ZDA": _Epochs.zda, b"HDT": _Epochs.hdt,
}  # fmt: skip


def _number(value: Any) -> float:
    return math.nan if value is None or value == "" else float(value)


def _nmea_times(rows: list[dict[str, Any]]) -> tuple[Clock, Array]:
    """Return the clock, and the times of the instants."""
    seconds = np.array([row["seconds"] for row in rows])
    counted = unrolled(seconds, DAY)
    days = np.array([row["day"] for row in rows])
    known = np.flatnonzero(np.isfinite(days))
    if not len(known):
        return Clock("utc", None, "seconds of a day in UTC; the file does not give the day"), counted
    # An instant without a date has the day of the nearest dated instant before it, or of the first one after it.
    before = known[np.clip(np.searchsorted(known, np.arange(len(rows)), side="right") - 1, 0, None)]
    turns = np.round((counted - seconds) / DAY)
    midnight = (days[before] - dt.date(1970, 1, 1).toordinal() + turns - turns[before]) * DAY
    leap = gps_from_unix(midnight + seconds) - (midnight + seconds)
    origin = int(midnight[0] + leap[0])  # seconds are added last, to keep their digits
    return Clock("utc", origin, "UTC with date, leap seconds removed"), midnight + leap - origin + seconds


def _fixes(time: Array, f: dict[str, Array], separated: bool) -> tuple[FixStream, list[str]]:
    """Return the stream, and notes."""
    velocity = None
    notes = []
    if np.isfinite(f["speed"]).any():
        course = np.where(np.isfinite(f["course"]), f["course"], 0.0) * DEG  # at rest a receiver gives no course
        velocity = np.column_stack(
            (f["speed"] * np.cos(course), f["speed"] * np.sin(course), np.full(len(time), math.nan))
        )
        notes.append("The velocity is speed and course over ground: the file has no vertical velocity.")
    if not separated:
        notes.append("The geoid's separation is missing in some sentences: heights are above mean sea level there.")
    sigma = np.column_stack((f["s_n"], f["s_e"], f["s_d"]))
    known = (f["quality"] >= 0).any()
    stream = FixStream(
        time=time,
        latitude=f["latitude"] * DEG,
        longitude=f["longitude"] * DEG,
        height=f["height"],
        datum="ellipsoid" if separated else "mean sea level",
        position_sigma=sigma if np.isfinite(sigma).any() else None,
        velocity_ned=velocity,
        quality=f["quality"].astype(np.int64) if known else None,
        quality_words=NMEA_QUALITY if known else {},
        heading=f["heading"] * DEG if np.isfinite(f["heading"]).any() else None,
    )
    return stream, notes


MOST_HZ = 10.0
"""Instants a second that are written if no rate is given."""


def nmea_instants(content: Content) -> Iterator[tuple[float, str]]:
    """Yield the instants of the run, s, with their sentences."""
    s = content.solution
    unix = unix_from_gps(content.start_gps_s + s.time)
    heading = None if s.q_nb is None else rotation.euler_from_quaternion(s.q_nb)[2] / DEG
    quality = 1 if content.solution_name in content.run.fixes else 8
    geoid = np.round(geoid_along(s.latitude, s.longitude), 4)
    for k in range(len(s)):
        ms = round(float(unix[k]) * 1e3)
        date = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(milliseconds=ms)
        clock = f"{date:%H%M%S}.{ms % 1000:03d}"
        where = f"{_angle(s.latitude[k] / DEG, 2, 'NS')},{_angle(s.longitude[k] / DEG, 3, 'EW')}"
        height = f"{s.height[k] - geoid[k]:.4f},M,{geoid[k]:.4f},M,,"
        text = _sentence(f"GNGGA,{clock},{where},{quality},00,,{height}")
        course = ","
        if s.velocity_ned is not None:
            north, east = float(s.velocity_ned[k, 0]), float(s.velocity_ned[k, 1])
            course = f"{math.hypot(north, east) / KNOT:.4f},{math.degrees(math.atan2(east, north)) % 360.0:.4f}"
        text += _sentence(f"GNRMC,{clock},A,{where},{course},{date:%d%m%y},,,{'A' if quality == 1 else 'S'},V")
        if heading is not None:
            text += _sentence(f"GNHDT,{heading[k]:.4f},T")
        yield float(s.time[k]), text


def write_nmea(content: Content, place: Path) -> list[str]:
    """Write the file, at most 10 instants a second if no rate is given."""
    content = content.with_rate(MOST_HZ)
    with place.open("w", encoding="ascii", newline="") as file:
        file.writelines(text for _, text in nmea_instants(content))
    s = content.solution
    return [
        f"{content.solution_name}: GGA and RMC{' and HDT' if s.q_nb is not None else ''}, {len(s)} instants.",
        f"Heights are above mean sea level, with the geoid's separation beside them. {GEOID_WORDS}",
        "Times are UTC.",
    ]


def _angle(degrees: float, digits: int, signs: str) -> str:
    """Return a latitude or longitude as degrees and minutes, "5000.1234567,N"."""
    degrees = (degrees + 180.0) % 360.0 - 180.0 if signs == "EW" else degrees
    whole, units = divmod(round(abs(degrees) * 60.0 * 1e7), 60 * 10**7)
    return f"{whole:0{digits}d}{units // 10**7:02d}.{units % 10**7:07d},{signs[bool(degrees < 0.0)]}"


def _sentence(body: str) -> str:
    return f"${body}*{reduce(lambda a, b: a ^ b, body.encode()):02X}\r\n"


_CHC_ADDRESSES = ("$GPCHC", "$GICHC")
_CHC_FIELDS = 18
"""Numbers of a sentence that are used: from the week to the speed."""


def read_chc(path: Path) -> Streams:
    """Read the readings and the solution."""
    rows: list[list[float]] = []
    damaged: list[int] = []
    for number, line in enumerate(read_text(path, encoding="latin-1").splitlines(), start=1):
        body, star, check = line.strip().partition("*")
        if body[:6] not in _CHC_ADDRESSES:
            continue
        try:
            if star and reduce(lambda a, b: a ^ b, body[1:].encode("latin-1")) != int(check[:2], 16):
                raise ValueError("checksum")
            values = [float(field) for field in body.split(",")[1 : _CHC_FIELDS + 1]]
            if len(values) < _CHC_FIELDS or not all(map(math.isfinite, values)):
                raise ValueError("fields")
            rows.append(values)
        except ValueError:
            damaged.append(number)
    if len(rows) < 2:
        raise InputError(f"{path} has {len(rows)} undamaged GPCHC sentences; at least two are needed.")
    r = np.array(rows)
    week = int(r[:, 0].min())
    time = (r[:, 0] - week) * WEEK + r[:, 1]
    axes = "right", "forward", "up"
    imu = InertialStream(time, r[:, 5:8] * DEG, r[:, 8:11] * G0, axes=axes)
    solved = (r[:, 11] != 0.0) | (r[:, 12] != 0.0)
    s = r[solved]
    solutions = {}
    if len(s):
        q_nb = rotation.quaternion_from_euler(s[:, 4] * DEG, s[:, 3] * DEG, s[:, 2] * DEG)
        velocity = s[:, (15, 14, 16)] * (1.0, 1.0, -1.0)
        solutions["solution"] = SolutionStream(
            time[solved], s[:, 11] * DEG, s[:, 12] * DEG, s[:, 13], velocity_ned=velocity, q_nb=q_nb
        )
    notes = (f"{len(damaged)} damaged sentences were left out, the first in line {damaged[0]}.",) if damaged else ()
    clock = Clock("gps", week * WEEK if week else None, f"seconds of the GPS week {week}")
    return Streams(path, "chc", clock, {"imu": imu}, {}, solutions, notes=notes)


NMEA = Format(recognises_nmea, read_nmea)
CHC = Format(
    lambda _, head: any(line[:6].decode("latin-1") in _CHC_ADDRESSES for line in head.splitlines()[:20]), read_chc
)
NMEA_EXPORT = Export(".nmea", "solution", write_nmea)


UBX_QUALITY = {
    0: "no fix",
    1: "dead reckoning",
    2: "2D",
    3: "3D",
    4: "GNSS and dead reckoning",
    13: "float",
    14: "fixed",
}
"""Meaning of the quality: fixType, or 12 + carrSoln of a solution with carrier phase."""
_KINDS = ("NAV-PVT", "NAV-HPPOSLLH", "NAV-COV", "NAV-RELPOSNED")


def recognises_ubx(path: Path, head: bytes) -> bool:
    """Return whether a UBX frame with a right checksum is in the head."""
    at = head.find(b"\xb5\x62")
    while at >= 0:
        length = int.from_bytes(head[at + 4 : at + 6], "little")
        frame = head[at + 2 : at + 6 + length]
        if len(frame) == 4 + length and head[at + 6 + length : at + 8 + length] == _checksum(frame):
            return True
        at = head.find(b"\xb5\x62", at + 1)
    return head[:2] == b"\xb5\x62"


def _checksum(frame: bytes) -> bytes:
    a = b = 0
    for byte in frame:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return bytes((a, b))


def read_ubx(path: Path) -> Streams:
    """Read the fixes, one for each NAV-PVT."""
    module = library("pyubx2", "pyubx2", str(path))
    messages: dict[str, dict[int, Any]] = {kind: {} for kind in _KINDS}
    bad = 0

    def note(error: Exception) -> None:
        nonlocal bad
        bad += "checksum" in str(error)  # other errors are stray bytes, which are no message

    with open_file(path) as file:
        reader = module.UBXReader(file, protfilter=2, quitonerror=1, errorhandler=note)
        while True:
            try:
                raw, message = reader.read()
            except Exception:  # pyubx2 raises various errors for a damaged message, and goes on after it
                bad += 1
                if bad > 10000:
                    break
                continue
            if raw is None:
                break
            if message is not None and message.identity in messages:
                messages[message.identity][len(messages[message.identity])] = message
    fixes = [m for m in messages["NAV-PVT"].values() if m.fixType in (1, 2, 3, 4) and not getattr(m, "invalidLlh", 0)]
    if not fixes:
        count = len(messages["NAV-PVT"])
        raise InputError(
            f"{path} holds no position: it has {count} NAV-PVT messages{', none with a fix' if count else ''}, "
            f"{bad} damaged messages."
        )
    others = {k: {m.iTOW: m for m in messages[k].values()} for k in _KINDS[1:]}
    clock, time = _ubx_times(path, fixes)
    stream = _stream(fixes, time, others)
    notes = ["σ are the receiver's hAcc, vAcc and sAcc, the same for north and east."]
    if bad:
        notes.append(f"{bad} damaged messages were left out.")
    return Streams(path, "ubx", clock, fixes={"gnss": stream}, notes=tuple(notes))


def _ubx_times(path: Path, fixes: list[Any]) -> tuple[Clock, np.ndarray[Any, np.dtype[np.float64]]]:
    """Return the clock and the GPS times of the fixes."""
    seconds = unrolled(np.array([m.iTOW for m in fixes]) * 1e-3, WEEK)
    dated = [(k, m) for k, m in enumerate(fixes) if m.validDate and m.validTime]
    if not dated:
        return Clock("gps", None, "seconds of the GPS week; no message has a valid date"), seconds
    k, m = dated[0]
    try:
        date = datetime(m.year, m.month, m.day, m.hour, m.min, min(m.second, 59), tzinfo=UTC)
    except ValueError as error:
        raise InputError(f"{path}: NAV-PVT at iTOW {m.iTOW} ms gives a date that does not exist: {error}.") from error
    week = round((gps_from_date(date) + m.nano * 1e-9 - float(seconds[k])) / WEEK)
    return Clock("gps", week * WEEK, f"seconds of the GPS week {week}"), seconds


def _stream(
    fixes: list[Any], time: np.ndarray[Any, np.dtype[np.float64]], others: dict[str, dict[int, Any]]
) -> FixStream:
    """Return the fixes; high precision, covariance and heading from the messages of the same iTOW."""
    precise = [others["NAV-HPPOSLLH"].get(m.iTOW, m) for m in fixes]
    precise = [m if getattr(p, "invalidLlh", 0) else p for p, m in zip(precise, fixes, strict=True)]
    place = np.array([(p.lat, p.lon, p.height * 1e-3) for p in precise])
    sigma = np.array([(p.hAcc, p.hAcc, p.vAcc) for p in precise]) * 1e-3
    covariance = np.full((len(fixes), 3, 3), math.nan)
    for k, m in enumerate(fixes):
        c = others["NAV-COV"].get(m.iTOW)
        if c is not None and c.posCovValid:
            nn, ne, nd, ee, ed, dd = (getattr(c, f"posCov{axes}") for axes in ("NN", "NE", "ND", "EE", "ED", "DD"))
            covariance[k] = ((nn, ne, nd), (ne, ee, ed), (nd, ed, dd))
    heading = np.full((len(fixes), 2), math.nan)
    for k, m in enumerate(fixes):
        r = others["NAV-RELPOSNED"].get(m.iTOW)
        if r is not None and getattr(r, "relPosHeadingValid", False):
            heading[k] = r.relPosHeading * DEG, r.accHeading * DEG
    carrier = np.array([12 + m.carrSoln if m.carrSoln else m.fixType for m in fixes])
    turned = bool(np.isfinite(heading).any())
    return FixStream(
        time=time,
        latitude=place[:, 0] * DEG,
        longitude=place[:, 1] * DEG,
        height=place[:, 2],
        datum="ellipsoid",
        position_sigma=sigma,
        velocity_ned=np.array([(m.velN, m.velE, m.velD) for m in fixes]) * 1e-3,
        velocity_sigma=np.array([(m.sAcc,) * 3 for m in fixes]) * 1e-3,
        quality=carrier.astype(np.int64),
        quality_words=UBX_QUALITY,
        heading=heading[:, 0] if turned else None,
        heading_sigma=heading[:, 1] if turned else None,
        covariance=covariance if np.isfinite(covariance).any() else None,
    )


UBX = Format(recognises_ubx, read_ubx)
