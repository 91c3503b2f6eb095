"""NMEA 0183 by pynmeagps: GGA or GNS, RMC, VTG, GST, ZDA, HDT.

Times are UTC of the day; RMC and ZDA give the date. The height is that above mean sea level plus the geoid's separation
where the sentence has it, so that it is above the ellipsoid.
"""

from __future__ import annotations

import datetime
import math
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.registry import library
from sinssim.logs.gps_time import DAY, gps_from_unix, unrolled
from sinssim.logs.recorded_streams import Clock, FixStream, Streams
from sinssim.system.user_file import open_file
from sinssim.units import DEG, KNOT

QUALITY = {
    0: "no fix", 1: "single", 2: "differential", 3: "PPS", 4: "fixed", 5: "float", 6: "dead reckoning", 7: "manual",
    8: "simulated",
}  # fmt: skip
"""Meaning of the quality of GGA."""
_FIELDS = ("latitude", "longitude", "height", "speed", "course", "s_n", "s_e", "s_d", "quality", "heading", "day")


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first lines begin with $ and an address of five letters, and no UBX is between them."""
    if b"\xb5\x62" in head or b"$GPCHC," in head or b"$GICHC," in head:
        return False
    for line in head.splitlines()[:20]:
        if line[:1] == b"$" and line[1:6].isalnum() and line[1:6].isupper() and line[6:7] == b",":
            return True
    return False


def read(path: Path) -> Streams:
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
    kept = epochs.kept()
    if not kept:
        why = f" Line {bad[0]}: {first}." if bad else ""
        raise InputError(f"{path} holds no position: GGA, GNS or RMC sentences with a fix are needed.{why}")
    notes = [f"{len(bad)} damaged sentences were left out, the first in line {bad[0]}: {first}."] if bad else []
    clock, time = _times(kept)
    fields = {name: np.array([one[name] for one in kept]) for name in _FIELDS if name != "day"}
    stream, more = _fixes(time, fields, separated=all(one["separated"] for one in kept))
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

    def kept(self) -> list[dict[str, Any]]:
        """Return the instants with a position."""
        return [one for one in self._all if math.isfinite(one["latitude"]) and math.isfinite(one["longitude"])]

    def _at(self, time: Any) -> dict[str, Any]:
        """Return the record of an instant; a new one if the time changed."""
        if not isinstance(time, datetime.time):
            raise ValueError("the time is missing")
        seconds = time.hour * 3600 + time.minute * 60 + time.second + 1e-6 * time.microsecond
        if not self._all or self._all[-1]["seconds"] != seconds:
            one: dict[str, Any] = dict.fromkeys(_FIELDS, math.nan)
            self._all.append({**one, "seconds": seconds, "separated": True, "quality": -1})
        return self._all[-1]

    def _position(self, m: Any) -> dict[str, Any]:
        one = self._at(m.time)
        one["latitude"], one["longitude"] = _number(m.lat), _number(m.lon)
        return one

    def gga(self, m: Any) -> None:
        quality = int(m.quality)
        if not 1 <= quality <= 9:  # 0 is no fix; it is one digit, and anything else is damaged
            return
        one = self._position(m)
        self._height(one, m)
        one["quality"] = quality

    def gns(self, m: Any) -> None:
        if not str(m.posMode).strip("N"):
            return
        self._height(self._position(m), m)

    def _height(self, one: dict[str, Any], m: Any) -> None:
        above, separation = _number(m.alt), _number(m.sep)
        one["separated"] = math.isfinite(separation)
        one["height"] = above + (separation if math.isfinite(separation) else 0.0)

    def rmc(self, m: Any) -> None:
        if m.status != "A":
            return
        one = self._at(m.time)
        if not math.isfinite(one["latitude"]):
            one["latitude"], one["longitude"] = _number(m.lat), _number(m.lon)
        one["speed"], one["course"] = _number(m.spd) * KNOT, _number(m.cog)
        if isinstance(m.date, datetime.date):
            one["day"] = m.date.toordinal()

    def vtg(self, m: Any) -> None:
        if self._all and not math.isfinite(self._all[-1]["speed"]):
            self._all[-1]["speed"], self._all[-1]["course"] = _number(m.sogn) * KNOT, _number(m.cogt)

    def gst(self, m: Any) -> None:
        one = self._at(m.time)
        one["s_n"], one["s_e"], one["s_d"] = _number(m.stdLat), _number(m.stdLong), _number(m.stdAlt)

    def zda(self, m: Any) -> None:
        self._at(m.time)["day"] = datetime.date(int(m.year), int(m.month), int(m.day)).toordinal()

    def hdt(self, m: Any) -> None:
        if self._all:
            self._all[-1]["heading"] = _number(m.headingT)


_READERS: dict[bytes, Any] = {
    b"GGA": _Epochs.gga, b"GNS": _Epochs.gns, b"RMC": _Epochs.rmc, b"VTG": _Epochs.vtg, b"GST": _Epochs.gst,
    b"ZDA": _Epochs.zda, b"HDT": _Epochs.hdt,
}  # fmt: skip


def _number(value: Any) -> float:
    return math.nan if value is None or value == "" else float(value)


def _times(kept: list[dict[str, Any]]) -> tuple[Clock, Array]:
    """Return the clock, and the times of the instants."""
    seconds = np.array([one["seconds"] for one in kept])
    counted = unrolled(seconds, DAY)
    days = np.array([one["day"] for one in kept])
    known = np.flatnonzero(np.isfinite(days))
    if not len(known):
        return Clock("utc", None, "seconds of a day in UTC; the file does not give the day"), counted
    # An instant without a date has the day of the nearest dated instant before it, or of the first one after it.
    before = known[np.clip(np.searchsorted(known, np.arange(len(kept)), side="right") - 1, 0, None)]
    turns = np.round((counted - seconds) / DAY)
    midnight = (days[before] - datetime.date(1970, 1, 1).toordinal() + turns - turns[before]) * DAY
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
        quality_words=QUALITY if known else {},
        heading=f["heading"] * DEG if np.isfinite(f["heading"]).any() else None,
    )
    return stream, notes
