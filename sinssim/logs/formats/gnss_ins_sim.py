"""Folder of CSV files of gnss-ins-sim (Aceinna), read and written: time, ref_*, gyro-0, accel-0, gps_time, gps-0.

The units are in the headings: "gyro_x (deg/s)". Body axes forward-right-down. Layout: gnss_ins_sim/sim/sim_data.py of
gnss-ins-sim. Of several runs of its errors the first is read.

A row of gnss-ins-sim is an instant: its rates lead from the state of this row to the state of the next one (path_gen in
pathgen.py computes the rates first and then moves; FreeIntegration takes row i − 1 for the step from i − 1 to i). A row
of a written folder is therefore the start of an interval.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.registry import Format
from sinssim.logs.formats.run_export import Content, Export
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.logs.text.column_names import SPELLED
from sinssim.logs.text.numeric_columns import check_finite, columns_of, read_numbers, rounded, write_columns
from sinssim.system.user_file import open_text
from sinssim.units import DEG

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
    time = _read_table(path / "time.csv", 1, notes)[:, 0]
    gyro, accel = _read_table(path / "gyro-0.csv", 3, notes), _read_table(path / "accel-0.csv", 3, notes)
    if not len(time) == len(gyro) == len(accel):
        raise InputError(
            f"{path}: time.csv, gyro-0.csv and accel-0.csv have {len(time)}, {len(gyro)} and {len(accel)} rows; they "
            "belong to the same instants."
        )
    fixes = {}
    if (path / "gps-0.csv").is_file() and (path / "gps_time.csv").is_file():
        at, place = _read_table(path / "gps_time.csv", 1, notes)[:, 0], _read_table(path / "gps-0.csv", 6, notes)
        if len(at) != len(place):
            raise InputError(f"{path}: gps_time.csv has {len(at)} rows, gps-0.csv {len(place)}.")
        fixes["gnss"] = FixStream(at, place[:, 0], place[:, 1], place[:, 2], "ellipsoid", velocity_ned=place[:, 3:])
    imu = InertialStream(time, gyro, accel, axes=("forward", "right", "down"))
    clock = Clock("machine", None, "seconds of the simulation")
    return Streams(path, "gnss-ins-sim", clock, {"imu": imu}, fixes, notes=tuple(notes))


def _read_table(path: Path, width: int, notes: list[str]) -> Array:
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


_LLA = ("lat (deg)", "lon (deg)", "alt (m)")
_XYZ = ("x", "y", "z")


def write(content: Content, place: Path) -> list[str]:
    """Write the folder."""
    imu, truth = content.imu, content.motion
    assert imu.interval is not None
    start = imu.time - imu.interval[:, 0]
    rows = np.searchsorted(truth.time, start - 1e-6)
    if len(truth) <= rows.max() or np.abs(truth.time[rows] - start).max() > 1e-6:
        raise InputError("the truth is not known at the times of the data; gnss-ins-sim needs both.")
    _write_table(place / "time.csv", ("time (sec)",), rounded(start))
    gyro, accel = imu.gyro / imu.interval[:, :1] / DEG, imu.accel / imu.interval[:, 1:]
    _write_table(place / "gyro-0.csv", [f"gyro_{a} (deg/s)" for a in _XYZ], gyro)
    _write_table(place / "accel-0.csv", [f"accel_{a} (m/s^2)" for a in _XYZ], accel)
    _write_truth(truth, rows, place)
    sentences = [
        f"gyro-0.csv, accel-0.csv: {content.imu_name} data as mean rates over the interval that begins at time.csv.",
        "ref_pos.csv, ref_vel.csv (north-east-down), ref_att_euler.csv (yaw, pitch, roll): the truth at time.csv.",
    ]
    if "ideal" in content.run.inertial:
        ideal = content.run.increments("ideal")
        assert ideal.interval is not None
        _write_table(
            place / "ref_gyro.csv", [f"ref_gyro_{a} (deg/s)" for a in _XYZ], ideal.gyro / ideal.interval[:, :1] / DEG
        )
        _write_table(
            place / "ref_accel.csv", [f"ref_accel_{a} (m/s^2)" for a in _XYZ], ideal.accel / ideal.interval[:, 1:]
        )
    for receiver, fixes in list(content.fixes.items())[:1]:
        _write_fixes(fixes, place)
        sentences.append(f"gps-0.csv, gps_time.csv: fixes of {receiver}, of its antenna.")
    return [*sentences, "Body axes forward-right-down, as its default frame. Times are the run's own."]


def _write_table(path: Path, heads: list[str] | tuple[str, ...], *parts: Array) -> None:
    write_columns(path, columns_of(*parts), header=",".join(heads) + "\n", delimiter=",")


def _write_truth(truth: SolutionStream, rows: NDArray[np.intp], place: Path) -> None:
    assert truth.velocity_ned is not None
    assert truth.q_nb is not None
    position = truth.latitude[rows] / DEG, truth.longitude[rows] / DEG, truth.height[rows]
    _write_table(place / "ref_pos.csv", [f"ref_pos_{name}" for name in _LLA], *position)
    _write_table(place / "ref_vel.csv", [f"ref_vel_{a} (m/s)" for a in _XYZ], truth.velocity_ned[rows])
    roll, pitch, heading = rotation.euler_from_quaternion(truth.q_nb[rows])
    angles = np.column_stack((heading, pitch, roll)) / DEG
    _write_table(place / "ref_att_euler.csv", ("ref_Yaw (deg)", "ref_Pitch (deg)", "ref_Roll (deg)"), angles)


def _write_fixes(f: FixStream, place: Path) -> None:
    velocity = f.velocity_ned if f.velocity_ned is not None else np.full((len(f), 3), np.nan)
    heads = [f"gps_{name}" for name in _LLA] + [f"gps_v{a} (m/s)" for a in "NED"]
    _write_table(place / "gps-0.csv", heads, f.latitude / DEG, f.longitude / DEG, f.height, velocity)
    _write_table(place / "gps_time.csv", ("gps_time (sec)",), rounded(f.time))
    _write_table(place / "gps_visibility.csv", ("gps_visibility",), np.ones(len(f)))


FORMAT = Format(recognises, read, files_of)
EXPORT = Export("", "run", write)
