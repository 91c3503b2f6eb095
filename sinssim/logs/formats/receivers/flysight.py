"""FlySight 2: TRACK.CSV with fixes, SENSOR.CSV with gyros and accelerometers; lines $COL and $UNIT describe the rows.

The sensors' times are seconds since the start of the device; a row $TIME gives the GPS week and the seconds of the
week of such a time. Fixes are dated in UTC, with heights above mean sea level. Layout: FlySight documentation, "CSV
files", and the lines $COL and $UNIT of the file.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import WEEK
from sinssim.logs.streams import Clock, FixStream, InertialStream, Streams
from sinssim.logs.text.cut_rows import cut_rows
from sinssim.logs.text.dates import date_seconds
from sinssim.system.user_file import open_text
from sinssim.units import DEG, G0

_IMU = ("time", "wx", "wy", "wz", "ax", "ay", "az")
_GNSS = ("lat", "lon", "hMSL", "velN", "velE", "velD", "hAcc", "vAcc", "sAcc")
_UNITS = {"deg/s": DEG, "g": G0, "s": 1.0, "deg": DEG, "m": 1.0, "m/s": 1.0}


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first line is that of a FlySight file."""
    return head.lstrip(b"\xef\xbb\xbf").startswith(b"$FLYS")


def read(path: Path) -> Streams:
    """Read the fixes, or the gyros and accelerometers."""
    cut = cut_rows(path, ",", _first_row(path))
    rows: dict[str, list[list[str]]] = {}
    columns: dict[str, list[str]] = {}
    units: dict[str, list[str]] = {}
    with open_text(path, encoding="latin-1", newline="") as file:
        for number, fields in enumerate(csv.reader(file), start=1):
            if fields[:1] in (["$COL"], ["$UNIT"]) and len(fields) > 2:
                (columns if fields[0] == "$COL" else units)[fields[1]] = fields[2:]
            elif fields and (kind := fields[0].removeprefix("$")) in columns and number != cut.last:
                if len(fields) != len(columns[kind]) + 1:
                    width = len(columns[kind]) + 1
                    raise InputError(f"{path}, line {number}: it has {len(fields)} fields; {width} are described.")
                rows.setdefault(kind, []).append(fields[1:])

    def of(kind: str, name: str) -> Array:
        if name not in columns[kind]:
            raise InputError(f"{path}: $COL,{kind} has no column {name}.")
        k = columns[kind].index(name)
        unit = dict(enumerate(units.get(kind, ()))).get(k, "")
        try:
            return np.array([float(row[k]) for row in rows[kind]]) * _UNITS.get(unit, 1.0)
        except ValueError as error:
            raise InputError(f"{path}: the column {name} of {kind}: {error}.") from error

    if "GNSS" in rows:
        texts = [row[columns["GNSS"].index("time")] for row in rows["GNSS"]]
        time, dated = date_seconds(texts)
        place = {name: of("GNSS", name) for name in _GNSS}
        sigma = np.column_stack([place["hAcc"], place["hAcc"], place["vAcc"]])
        velocity = np.column_stack([place["velN"], place["velE"], place["velD"]])
        speed_sigma = np.repeat(place["sAcc"][:, None], 3, axis=1)
        at = place["lat"], place["lon"], place["hMSL"]
        fixes = FixStream(time, *at, "mean sea level", sigma, velocity, speed_sigma)
        clock = dated or Clock("utc", None, "times of day in UTC")
        return Streams(path, "flysight", clock, fixes={"gnss": fixes}, notes=cut.notes)
    if "IMU" not in rows:
        raise InputError(f"{path} has neither rows $GNSS nor rows $IMU.")
    own = np.column_stack([of("IMU", name) for name in _IMU])
    clock, time = Clock("machine", None, "seconds since the start of the device"), own[:, 0]
    if "TIME" in rows:
        ahead = float(np.median(of("TIME", "week") * WEEK + of("TIME", "tow") - of("TIME", "time")))
        origin = int(np.floor(ahead + time[0]))
        clock, time = (
            Clock("gps", origin, "clock of the device, set by its rows of GPS time (median)"),
            time + (ahead - origin),
        )
    return Streams(
        path, "flysight", clock, inertial={"imu": InertialStream(time, own[:, 1:4], own[:, 4:])}, notes=cut.notes
    )


def _first_row(path: Path) -> int:
    """Return the number of lines before the rows."""
    with open_text(path, encoding="latin-1") as file:
        return next((k for k, line in enumerate(file, start=1) if line.strip() == "$DATA"), 0)
