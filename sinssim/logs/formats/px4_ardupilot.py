"""Logs of autopilots: PX4 ULog (pyulog), and ArduPilot's DataFlash: .bin, its text .log, the text of mavlogdump.

PX4: vehicle_imu or sensor_combined, sensor_gps, the estimator's position and attitude. Times are microseconds since the
start of the autopilot. UTC of the receiver's messages gives them a date, as good as the delay of those messages.

ArduPilot: every log describes its own messages by FMT messages (ArduPilot, libraries/AP_Logger/LogStructure.h). Used
are IMU (with the number of the unit in I, or as IMU, IMU2, IMU3), GPS and GPA. Times are microseconds since the start
of the autopilot; logs of 2014 and before have milliseconds (`_RENAMED`). Fixes have the time of the receiver, and the
smallest delay of their arrival puts it on that clock.
"""

from __future__ import annotations

import contextlib
import io
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats import Format, library, refused
from sinssim.logs.gps_time import WEEK, gps_from_unix
from sinssim.logs.numeric_columns import cut_row
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.files import read_bytes, user_file
from sinssim.units import DEG

MAGIC = b"\x55\x4c\x6f\x67\x01\x12\x35"
AXES = ("forward", "right", "down")
ULOG_QUALITY = {
    0: "no fix",
    1: "no fix",
    2: "2D",
    3: "3D",
    4: "differential",
    5: "float",
    6: "fixed",
    8: "extrapolated",
}
"""Meaning of fix_type of sensor_gps."""
_TOPICS = [
    "vehicle_imu", "sensor_combined", "sensor_gps", "vehicle_gps_position", "vehicle_attitude",
    "vehicle_local_position",
]  # fmt: skip
_HEADER = 3  # bytes: size and type of a message
_RADIUS = 6371000.0  # m, of PX4's map projection


class _OnlyForward(io.BufferedReader):
    """A file that ends where its reader turns back.

    pyulog seeks back by the length that a damaged message claims, also where the file ends before: from there it reads
    the same messages for ever. Every message begins with a header of 3 bytes. No reading of a sound file takes a header
    from before the last one; the last one itself is read again where the definitions end.
    """

    _last = -1

    def read(self, size: int | None = -1, /) -> bytes:
        """Return the next bytes; none for a header before the last one."""
        if size == _HEADER:
            place = self.tell()
            if place < self._last:
                return b""
            self._last = place
        return super().read(size)


def read_ulog(path: Path) -> Streams:
    """Read inertial readings, fixes, and the estimator's solution."""
    module = library("pyulog", "pyulog", str(path))
    printed = io.StringIO()  # pyulog prints what it finds damaged
    try:
        with contextlib.redirect_stdout(printed), user_file(path).open("rb", buffering=0) as raw:
            log = module.ULog(_OnlyForward(raw), _TOPICS)
    except Exception as error:  # pyulog raises various errors for a damaged file
        raise refused(path, "a PX4 ULog", error) from error
    topics: dict[str, list[dict[str, Any]]] = {}
    for data in sorted(log.data_list, key=lambda topic: int(topic.multi_id)):
        if len(data.data.get("timestamp", ())):
            topics.setdefault(data.name, []).append(data.data)
    try:
        inertial = _ulog_inertial(topics)
        fixes = {
            "gnss" if k == 0 else f"gnss_{k}": _ulog_fixes(topic)
            for k, topic in enumerate(topics.get("sensor_gps") or topics.get("vehicle_gps_position") or [])
        }
        solutions = _solution(topics)
    except KeyError as error:
        raise InputError(
            f"{path}: a topic lacks the field {error}; the log is of an unknown version of PX4."
        ) from error
    if not (inertial or fixes):
        names = ", ".join(sorted(topics)) or "none of them"
        raise InputError(f"{path} holds neither vehicle_imu, sensor_combined nor sensor_gps; it has {names}.")
    clock, shift = _clock(topics)
    for streams in (inertial, fixes, solutions):
        for topic in streams.values():
            topic.time[:] += shift
    dropped = sum(int(d.duration) for d in getattr(log, "dropouts", []))
    notes = [f"The logger dropped messages for {dropped} ms."] if dropped else []
    if "corrupt" in printed.getvalue():
        notes.append("The file is damaged; what could be read was read.")
    return Streams(path, "ulog", clock, inertial, fixes, solutions, notes=tuple(notes))


def _seconds(topic: dict[str, Any]) -> Array:
    """Return the stamps of the samples where the topic has them, else those of the messages, (N,) s."""
    stamps = topic.get("timestamp_sample")
    if stamps is None or not np.any(stamps):
        stamps = topic["timestamp"]
    return np.asarray(stamps, dtype=np.float64) * 1e-6


def _vector(topic: dict[str, Any], name: str, count: int = 3) -> Array:
    return np.column_stack([np.asarray(topic[f"{name}[{i}]"], dtype=np.float64) for i in range(count)])


def _ulog_inertial(topics: dict[str, list[dict[str, Any]]]) -> dict[str, InertialStream]:
    """Return increments of vehicle_imu, or rates of sensor_combined."""
    streams = {}
    for k, topic in enumerate(topics.get("vehicle_imu", [])):
        dt = [np.asarray(topic[f"delta_{what}_dt"], dtype=np.float64) for what in ("angle", "velocity")]
        size = 1e-6 if np.median(dt[0]) > 1.0 else 1.0  # older logs have seconds
        streams["imu" if k == 0 else f"imu_{k}"] = InertialStream(
            _seconds(topic), _vector(topic, "delta_angle"), _vector(topic, "delta_velocity"), "increments",
            np.column_stack(dt) * size, AXES,
        )  # fmt: skip
    if not streams:
        for k, topic in enumerate(topics.get("sensor_combined", [])):
            streams["imu" if k == 0 else f"imu_{k}"] = InertialStream(
                _seconds(topic), _vector(topic, "gyro_rad"), _vector(topic, "accelerometer_m_s2"), "rates", axes=AXES
            )
    return streams


def _ulog_fixes(gps: dict[str, Any]) -> FixStream:
    """Return the fixes of a receiver; older logs have whole numbers of 1e-7° and mm."""

    def column(name: str, old: str, size: float) -> Array:
        values = gps[name] if name in gps else np.asarray(gps[old], dtype=np.float64) * size
        return np.asarray(values, dtype=np.float64)

    eph, epv, speed = (np.asarray(gps[name], dtype=np.float64) for name in ("eph", "epv", "s_variance_m_s"))
    velocity = [np.asarray(gps[f"vel_{axis}_m_s"], dtype=np.float64) for axis in "ned"]
    return FixStream(
        time=_seconds(gps),
        latitude=column("latitude_deg", "lat", 1e-7) * DEG,
        longitude=column("longitude_deg", "lon", 1e-7) * DEG,
        height=column("altitude_ellipsoid_m", "alt_ellipsoid", 1e-3),
        datum="ellipsoid",
        position_sigma=np.column_stack((eph, eph, epv)),
        velocity_ned=np.column_stack(velocity),
        velocity_sigma=np.column_stack((speed, speed, speed)),
        quality=np.asarray(gps["fix_type"], dtype=np.int64),
        quality_words=ULOG_QUALITY,
    )


def _solution(topics: dict[str, list[dict[str, Any]]]) -> dict[str, SolutionStream]:
    """Return the estimator's position and velocity, with its attitude at the same instants."""
    if "vehicle_local_position" not in topics:
        return {}
    topic = topics["vehicle_local_position"][0]
    x, y, z, ref_lat, ref_lon, ref_alt = (
        np.asarray(topic[name], dtype=np.float64) for name in ("x", "y", "z", "ref_lat", "ref_lon", "ref_alt")
    )
    known = np.isfinite(ref_lat) & np.isfinite(ref_lon) & (np.asarray(topic["xy_global"]) > 0) & np.isfinite(x + y)
    if not known.any():
        return {}
    latitude, longitude = _unprojected(x[known], y[known], ref_lat[known] * DEG, ref_lon[known] * DEG)
    time = _seconds(topic)[known]
    velocity = np.column_stack([np.asarray(topic[f"v{axis}"], dtype=np.float64)[known] for axis in "xyz"])
    q_nb = None
    if "vehicle_attitude" in topics:
        attitude = topics["vehicle_attitude"][0]
        q_nb = _attitude_at(_seconds(attitude), _vector(attitude, "q", 4), time)
    stream = SolutionStream(time, latitude, longitude, ref_alt[known] - z[known], "mean sea level", velocity, q_nb)
    return {"solution": stream}


def _unprojected(x: Array, y: Array, latitude: Array, longitude: Array) -> tuple[Array, Array]:
    """Return the places of PX4's local positions: azimuthal equidistant on a sphere (geo.cpp of PX4)."""
    c = np.hypot(x, y) / _RADIUS
    share = np.where(c > 0.0, np.sin(c) / np.where(c > 0.0, c, 1.0), 1.0)
    north, east = x / _RADIUS * share, y / _RADIUS * share
    sin0, cos0 = np.sin(latitude), np.cos(latitude)
    return (
        np.arcsin((np.cos(c) * sin0 + north * cos0).clip(-1.0, 1.0)),
        longitude + np.arctan2(east, cos0 * np.cos(c) - north * sin0),
    )


def _attitude_at(time: Array, q: Array, wanted: Array) -> Array:
    """Return attitudes between samples, along the shortest rotation."""
    if len(time) < 2:
        return np.repeat(rotation.normalize(q), len(wanted), axis=0)
    after = np.searchsorted(time, wanted).clip(1, len(time) - 1)
    before = after - 1
    step = np.maximum(time[after] - time[before], 1e-9)
    share = ((wanted - time[before]) / step).clip(0.0, 1.0)[:, np.newaxis]
    q = rotation.normalize(q)
    turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(q[before]), q[after]))
    return rotation.multiply(q[before], rotation.quaternion_from_rotation_vector(share * turn))


def _clock(topics: dict[str, list[dict[str, Any]]]) -> tuple[Clock, float]:
    """Return the clock, and what makes the times count from its origin, s."""
    for gps in topics.get("sensor_gps") or topics.get("vehicle_gps_position") or []:
        utc = np.asarray(gps.get("time_utc_usec", ()), dtype=np.float64) * 1e-6
        dated = utc > 1e9
        if dated.any():
            seconds = np.asarray(gps["timestamp"], dtype=np.float64)[dated] * 1e-6
            offset = float(np.median(gps_from_unix(utc[dated]) - seconds))
            origin = int(np.floor(offset))
            note = "the autopilot's clock, set to GPS time by the receiver's UTC (median)"
            return Clock("machine", origin, note), offset - origin
    return Clock("machine", None, "seconds since the start of the autopilot"), 0.0


ULOG = Format(lambda _, head: head.startswith(MAGIC), read_ulog)


ARDUPILOT_QUALITY = {0: "no receiver", 1: "no fix", 2: "2D", 3: "single", 4: "differential", 5: "float", 6: "fixed",
                     7: "static", 8: "PPP"}  # fmt: skip
"""Meaning of GPS.Status."""
_3D = 3
_SYNC = b"\xa3\x95"
_FMT = 128
_FMT_SIZE = 89
_NUMBERS = {"b": "i1", "B": "u1", "M": "u1", "h": "<i2", "H": "<u2", "c": "<i2", "C": "<u2", "i": "<i4", "I": "<u4",
            "e": "<i4", "E": "<u4", "L": "<i4", "q": "<i8", "Q": "<u8", "f": "<f4", "d": "<f8", "g": "<f2", "n": "S4",
            "N": "S16", "Z": "S64", "a": "V64"}  # fmt: skip
"""Types of the fields by the letters of a message's format."""
_SCALES = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
_RENAMED = {
    "IMU": {"TimeMS": ("TimeUS", 1e3)},
    "GPS": {"TimeMS": ("GMS", 1.0), "Week": ("GWk", 1.0), "T": ("TimeUS", 1e3)},
}
"""Columns of logs before ArduCopter 3.3 and ArduPlane 3.3: their present name, and the factor to its unit."""
_WANTED = re.compile(r"(?:IMU[23]?|GPS2?|GPA)$")
_DUMPED = re.compile(rb"^(?:\S+ \S+: )?([A-Z][A-Z0-9]{2,3}) \{(.*)\}\s*$")

Messages = dict[str, dict[str, Array]]
"""Columns of the messages by their names."""


def recognises_ardupilot(path: Path, head: bytes) -> bool:
    """Return whether a file begins with a FMT message, or with a line of mavlogdump."""
    if head.startswith((_SYNC + bytes((_FMT,)), b"FMT,")):
        return True
    return any(_DUMPED.match(line) and b" : " in line for line in head.splitlines()[:3])


def read_ardupilot(path: Path) -> Streams:
    """Read the readings of all units and receivers."""
    data = read_bytes(path)
    notes: list[str] = []
    if data.startswith(_SYNC):
        messages = _binary(path, data, notes)
    else:
        messages = _text(path, data, notes)
    messages = {name: _present_names(name, message) for name, message in messages.items()}
    inertial = _ardupilot_inertial(messages)
    fixes, origin = _ardupilot_fixes(messages)
    if not (inertial or fixes):
        raise InputError(
            f"{path} holds neither IMU messages with a time nor GPS messages with a fix: {_listed(messages) or 'none'}."
        )
    untimed = [name for name, message in messages.items() if "TimeUS" not in message]
    if untimed:
        notes.append(
            f"Messages without a time of the autopilot are left out: {_listed({k: messages[k] for k in untimed})}."
        )
    if len(inertial) > 1:
        notes.append(f"There are {len(inertial)} IMUs: {', '.join(inertial)}.")
    note = "time since the start of the autopilot" + ("" if origin is None else ", by the receiver's GPS time")
    return Streams(path, "ardupilot", Clock("machine", origin, note), inertial, fixes, notes=tuple(notes))


def _present_names(name: str, message: dict[str, Array]) -> dict[str, Array]:
    """Return the columns of a message by their present names."""
    former = _RENAMED.get(name.rstrip("23"), {})
    if "TimeUS" in message:
        return message
    given = {key: former.get(key, (key, 1.0)) for key in message}
    return {new: message[key] * factor for key, (new, factor) in given.items()}


def _listed(messages: Messages) -> str:
    """Return what messages hold."""
    return "; ".join(f"{len(next(iter(m.values())))} {name} with {', '.join(m)}" for name, m in messages.items())


def _binary(path: Path, data: bytes, notes: list[str]) -> Messages:
    """Return the wanted messages of a binary log."""
    sizes = {_FMT: _FMT_SIZE}
    layouts: dict[int, tuple[str, str, list[str]]] = {}
    bodies: dict[int, list[bytes]] = {}
    at = skipped = 0
    first = -1
    while at + 3 <= len(data):
        size = sizes.get(data[at + 2], 0) if data[at : at + 2] == _SYNC else 0
        if not size or at + size > len(data):
            first = at if first < 0 else first
            following = data.find(_SYNC, at + 1)
            following = len(data) if following < 0 else following
            skipped, at = skipped + following - at, following
            continue
        kind = data[at + 2]
        if kind == _FMT:
            number_of_kind, length, name, letters, columns = struct.unpack("<BB4s16s64s", data[at + 3 : at + _FMT_SIZE])
            texts = [part.split(b"\0")[0].decode("latin-1") for part in (name, letters, columns)]
            layouts[number_of_kind] = texts[0], texts[1], texts[2].split(",")
            if number_of_kind != _FMT:  # whose size is known, whatever a damaged file says
                sizes[number_of_kind] = length
        elif kind in layouts and _WANTED.match(layouts[kind][0]):
            bodies.setdefault(kind, []).append(data[at + 3 : at + size])
        at += size
    if skipped:
        notes.append(f"{skipped} bytes that are no message are left out, the first at byte {first}.")
    messages: Messages = {}
    for kind, parts in bodies.items():
        name, letters, columns = layouts[kind]
        odd = len(letters) != len(set(columns)) or len(columns) != len(letters) or not all(columns)
        if odd or set(letters) - set(_NUMBERS):
            raise InputError(f"{path}: the message {name} has the unknown format {letters!r} {','.join(columns)!r}.")
        dtype = np.dtype([(column, _NUMBERS[letter]) for column, letter in zip(columns, letters, strict=True)])
        if dtype.itemsize != len(parts[0]):
            raise InputError(
                f"{path}: the message {name} has {len(parts[0])} bytes; its format needs {dtype.itemsize}."
            )
        rows = np.frombuffer(b"".join(parts), dtype=dtype)
        messages[name] = {
            column: rows[column].astype(np.float64) * _SCALES.get(letter, 1.0)
            for column, letter in zip(columns, letters, strict=True)
            if letter not in "nNZa"
        }
    return messages


def _text(path: Path, data: bytes, notes: list[str]) -> Messages:
    """Return the wanted messages of a log as text, or of what mavlogdump prints."""
    names: dict[str, list[str]] = {}
    rows: dict[str, list[list[str]]] = {}
    lines = data.splitlines()
    for number, line in enumerate(lines, start=1):
        dumped = _DUMPED.match(line)
        if dumped is not None:
            name = dumped[1].decode()
            if not _WANTED.match(name):
                continue
            pairs = [pair.partition(" : ") for pair in dumped[2].decode("latin-1").split(", ")]
            fields, columns = [value for _, _, value in pairs], [key.strip() for key, _, _ in pairs]
            names.setdefault(name, columns)
        else:
            fields = [field.strip() for field in line.decode("latin-1").split(",")]
            name = fields.pop(0)
            if name == "FMT" and len(fields) > 4:
                names[fields[2]] = fields[4:]
                continue
            if not _WANTED.match(name) or name not in names:
                continue
        if number == len(lines) and len(fields) < len(names[name]):
            notes.append(cut_row(path.name, number, "last", len(fields), len(names[name])))
            continue
        if len(fields) != len(names[name]):
            raise InputError(
                f"{path}, line {number}: {name} has {len(fields)} fields; its format names {len(names[name])}."
            )
        rows.setdefault(name, []).append(fields)
        try:
            [float(field) for field in fields]
        except ValueError as error:
            raise InputError(f"{path}, line {number}: {name}: {error}.") from error
    return {
        name: dict(zip(names[name], np.array(many, dtype=np.float64).T, strict=True)) for name, many in rows.items()
    }


def _ardupilot_inertial(messages: Messages) -> dict[str, InertialStream]:
    """Return the readings of each unit, forward, right, down."""
    streams: dict[str, InertialStream] = {}
    keys = [*("GyrX", "GyrY", "GyrZ"), *("AccX", "AccY", "AccZ")]
    for name in ("IMU", "IMU2", "IMU3"):
        message = messages.get(name)
        if message is None or not {"TimeUS", *keys} <= set(message):
            continue
        rows = np.column_stack([message["TimeUS"] * 1e-6, *(message[key] for key in keys)])
        units = message.get("I", np.full(len(rows), float(name[3:] or 1) - 1.0))
        for unit in np.unique(units):
            of_unit = rows[units == unit]
            axes = "forward", "right", "down"
            streams[f"imu{int(unit)}"] = InertialStream(of_unit[:, 0], of_unit[:, 1:4], of_unit[:, 4:], axes=axes)
    return streams


def _ardupilot_fixes(messages: Messages) -> tuple[dict[str, FixStream], int | None]:
    """Return the fixes of each receiver, and the GPS time of the start of the autopilot."""
    streams: dict[str, FixStream] = {}
    origin: int | None = None
    for name in ("GPS", "GPS2"):
        message = messages.get(name)
        if message is None or not {"TimeUS", "Status", "Lat", "Lng", "Alt", "Spd", "GCrs", "GMS", "GWk"} <= set(
            message
        ):
            continue
        units = message.get("I", np.full(len(message["TimeUS"]), float(name[3:] or 1) - 1.0))
        for unit in np.unique(units):
            chosen = (units == unit) & (message["Status"] >= _3D) & (message["GWk"] > 0.0)
            chosen &= np.append(True, np.diff(message["GMS"]) != 0.0) | ("I" in message)
            if not chosen.any():
                continue
            of_receiver = {key: values[chosen] for key, values in message.items()}
            received = of_receiver["TimeUS"] * 1e-6
            measured = of_receiver["GWk"] * WEEK + of_receiver["GMS"] * 1e-3
            start = float(np.max(measured - received))  # the fix that arrived soonest
            origin = round(start) if origin is None else origin
            streams[f"gps{int(unit)}"] = _stream(of_receiver, measured - origin, messages.get("GPA"), unit)
    return streams, origin


def _stream(gps: dict[str, Array], time: Array, accuracy: dict[str, Array] | None, unit: float) -> FixStream:
    speed, course = gps["Spd"], gps["GCrs"] * DEG
    down = gps.get("VZ", np.full(len(speed), np.nan))
    sigma = velocity_sigma = None
    if accuracy is not None and {"HAcc", "VAcc", "SAcc"} <= set(accuracy):
        of = accuracy["I"] == unit if "I" in accuracy else np.ones(len(accuracy["TimeUS"]), dtype=bool)
        row = np.searchsorted(accuracy["TimeUS"][of], gps["TimeUS"]) if of.any() else None
        if row is not None:
            row = np.minimum(row, int(of.sum()) - 1)
            across, vertical, fast = (accuracy[key][of][row] for key in ("HAcc", "VAcc", "SAcc"))
            sigma = np.column_stack([across, across, vertical])
            velocity_sigma = np.column_stack([fast, fast, fast])
    quality = gps["Status"].astype(np.int64)
    return FixStream(
        time,
        gps["Lat"] * DEG,
        gps["Lng"] * DEG,
        gps["Alt"],
        "mean sea level",
        sigma,
        np.column_stack([speed * np.cos(course), speed * np.sin(course), down]),
        velocity_sigma,
        quality,
        {code: ARDUPILOT_QUALITY.get(code, f"code {code}") for code in sorted(set(quality.tolist()))},
    )


ARDUPILOT = Format(recognises_ardupilot, read_ardupilot)
