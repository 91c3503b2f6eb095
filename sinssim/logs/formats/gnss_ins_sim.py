"""Folder of CSV files of gnss-ins-sim (Aceinna): time.csv, gyro-0.csv, accel-0.csv, gps_time.csv, gps-0.csv.

The units are in the headings: "gyro_x (deg/s)". Body axes forward-right-down. Layout: gnss_ins_sim/sim/sim_data.py of
gnss-ins-sim. Of several runs of its errors the first is read.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, Streams
from sinssim.logs.text.column_names import SPELLED
from sinssim.logs.text.numeric_columns import check_finite, read_numbers
from sinssim.system.user_file import open_text

_NAMES = ("time", "gps_time", "gyro-*", "accel-*", "gps-*", "mag-*", "ref_*", "algo_time")


def recognises(path: Path, head: bytes) -> bool:
    """Return whether it is a folder with times, gyros and accelerometers."""
    return path.is_dir() and all((path / name).is_file() for name in ("time.csv", "gyro-0.csv", "accel-0.csv"))


def files_of(folder: Path) -> list[Path]:
    """Return the files of this format in a folder."""
    return [file for name in _NAMES for file in folder.glob(f"{name}.csv")]


def read(path: Path) -> Streams:
    """Read the readings and the fixes."""
    notes: list[str] = []
    time = _table(path / "time.csv", 1, notes)[:, 0]
    gyro, accel = _table(path / "gyro-0.csv", 3, notes), _table(path / "accel-0.csv", 3, notes)
    if not len(time) == len(gyro) == len(accel):
        raise InputError(
            f"{path}: time.csv, gyro-0.csv and accel-0.csv have {len(time)}, {len(gyro)} and {len(accel)} rows; they "
            "belong to the same instants."
        )
    fixes = {}
    if (path / "gps-0.csv").is_file() and (path / "gps_time.csv").is_file():
        at, place = _table(path / "gps_time.csv", 1, notes)[:, 0], _table(path / "gps-0.csv", 6, notes)
        if len(at) != len(place):
            raise InputError(f"{path}: gps_time.csv has {len(at)} rows, gps-0.csv {len(place)}.")
        fixes["gnss"] = FixStream(at, place[:, 0], place[:, 1], place[:, 2], "ellipsoid", velocity_ned=place[:, 3:])
    imu = InertialStream(time, gyro, accel, axes=("forward", "right", "down"))
    clock = Clock("machine", None, "seconds of the simulation")
    return Streams(path, "gnss-ins-sim", clock, {"imu": imu}, fixes, notes=tuple(notes))


def _table(path: Path, width: int, notes: list[str]) -> Array:
    """Return the columns of a file in SI units, by its heading."""
    with open_text(path, encoding="utf-8", errors="replace") as file:
        heads = file.readline().split(",")
    units = [match[1] if (match := re.search(r"\(([^)]*)\)\s*$", head.strip())) else "" for head in heads]
    if len(units) != width or any(unit not in SPELLED for unit in units):
        raise InputError(
            f"{path}, line 1: {width} names with units are needed, such as 'gyro_x (deg/s)'; it has {heads!r}."
        )
    values = read_numbers(path, (width,), notes, delimiter=",", skip=1)
    check_finite(path, values, "number")
    return np.asarray(values * np.array([SPELLED[unit] for unit in units]))
