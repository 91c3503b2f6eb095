"""FlySight 2: TRACK.CSV with fixes, SENSOR.CSV with gyros and accelerometers; lines $COL and $UNIT describe the rows.

The sensors' times are seconds since the start of the device; a row $TIME gives the GPS week and the seconds of the
week of such a time. Fixes are dated in UTC, with heights above mean sea level. Layout: FlySight documentation, "CSV
files", and the lines $COL and $UNIT of the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import WEEK, date_seconds
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, Streams
from sinssim.logs.text.column_names import SPELLED
from sinssim.logs.text.rows import cut_rows, text_rows, uneven
from sinssim.system.user_file import open_text

_IMU = ("time", "wx", "wy", "wz", "ax", "ay", "az")
_GNSS = ("lat", "lon", "hMSL", "velN", "velE", "velD", "hAcc", "vAcc", "sAcc")


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first line is that of a FlySight file."""
    return head.lstrip(b"\xef\xbb\xbf").startswith(b"$FLYS")


def read(path: Path) -> Streams:
    """Read the fixes, or the gyros and accelerometers."""
    cut = cut_rows(path, ",", _first_row(path))
    rows: dict[str, list[list[str]]] = {}
    columns: dict[str, list[str]] = {}
    units: dict[str, list[str]] = {}
    for number, fields in text_rows(path, ",", 0, cut, comments=False):
        if fields[0] in ("$COL", "$UNIT") and len(fields) > 2:
            (columns if fields[0] == "$COL" else units)[fields[1]] = fields[2:]
        elif (kind := fields[0].removeprefix("$")) in columns:
            if len(fields) != len(columns[kind]) + 1:
                raise uneven(path, number, len(fields), str(len(columns[kind]) + 1), ",", ", as $COL says")
            rows.setdefault(kind, []).append(fields[1:])

    def of(kind: str, name: str) -> Array:
        if name not in columns[kind]:
            raise InputError(f"{path}: $COL,{kind} has no column {name}.")
        k = columns[kind].index(name)
        unit = dict(enumerate(units.get(kind, ()))).get(k, "")
        try:
            return np.array([float(row[k]) for row in rows[kind]]) * SPELLED.get(unit, 1.0)
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
