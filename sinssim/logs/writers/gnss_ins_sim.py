"""Folder of CSV files as gnss-ins-sim (Aceinna) saves and loads them: ref_*.csv, gyro-0.csv, accel-0.csv, gps-0.csv.

A row of gnss-ins-sim is an instant: its rates lead from the state of this row to the state of the next one (path_gen in
pathgen.py computes the rates first and then moves; FreeIntegration takes row i − 1 for the step from i − 1 to i). A row
of this folder is therefore the start of an interval.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import FixStream, SolutionStream
from sinssim.logs.text.numeric_columns import columns_of, rounded, write_columns
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG

SUFFIX = ""
HOLDS = "run"
_LLA = ("lat (deg)", "lon (deg)", "alt (m)")
_XYZ = ("x", "y", "z")


def write(content: Content, place: Path) -> list[str]:
    """Write the folder.

    Raises:
        InputError: truth and readings have different instants.
    """
    imu, truth = content.imu, content.motion
    assert imu.interval is not None
    start = imu.time - imu.interval[:, 0]
    rows = np.searchsorted(truth.time, start - 1e-6)
    if len(truth) <= rows.max() or np.abs(truth.time[rows] - start).max() > 1e-6:
        raise InputError("the truth is not known at the times of the data; gnss-ins-sim needs both.")
    _table(place / "time.csv", ("time (sec)",), rounded(start))
    gyro, accel = imu.gyro / imu.interval[:, :1] / DEG, imu.accel / imu.interval[:, 1:]
    _table(place / "gyro-0.csv", [f"gyro_{a} (deg/s)" for a in _XYZ], gyro)
    _table(place / "accel-0.csv", [f"accel_{a} (m/s^2)" for a in _XYZ], accel)
    _write_truth(truth, rows, place)
    said = [
        f"gyro-0.csv, accel-0.csv: {content.imu_name} data as mean rates over the interval that begins at time.csv.",
        "ref_pos.csv, ref_vel.csv (north-east-down), ref_att_euler.csv (yaw, pitch, roll): the truth at time.csv.",
    ]
    if "ideal" in content.run.inertial:
        ideal = content.run.increments("ideal")
        assert ideal.interval is not None
        _table(
            place / "ref_gyro.csv", [f"ref_gyro_{a} (deg/s)" for a in _XYZ], ideal.gyro / ideal.interval[:, :1] / DEG
        )
        _table(place / "ref_accel.csv", [f"ref_accel_{a} (m/s^2)" for a in _XYZ], ideal.accel / ideal.interval[:, 1:])
    for receiver, fixes in list(content.fixes.items())[:1]:
        _write_fixes(fixes, place)
        said.append(f"gps-0.csv, gps_time.csv: fixes of {receiver}, of its antenna.")
    return [*said, "Body axes forward-right-down, as its default frame. Times are the run's own."]


def _table(path: Path, heads: list[str] | tuple[str, ...], *parts: Array) -> None:
    write_columns(path, columns_of(*parts), header=",".join(heads) + "\n", delimiter=",")


def _write_truth(truth: SolutionStream, rows: NDArray[np.intp], place: Path) -> None:
    assert truth.velocity_ned is not None
    assert truth.q_nb is not None
    position = truth.latitude[rows] / DEG, truth.longitude[rows] / DEG, truth.height[rows]
    _table(place / "ref_pos.csv", [f"ref_pos_{name}" for name in _LLA], *position)
    _table(place / "ref_vel.csv", [f"ref_vel_{a} (m/s)" for a in _XYZ], truth.velocity_ned[rows])
    roll, pitch, heading = rotation.euler_from_quaternion(truth.q_nb[rows])
    angles = np.column_stack((heading, pitch, roll)) / DEG
    _table(place / "ref_att_euler.csv", ("ref_Yaw (deg)", "ref_Pitch (deg)", "ref_Roll (deg)"), angles)


def _write_fixes(f: FixStream, place: Path) -> None:
    velocity = f.velocity_ned if f.velocity_ned is not None else np.full((len(f), 3), np.nan)
    heads = [f"gps_{name}" for name in _LLA] + [f"gps_v{a} (m/s)" for a in "NED"]
    _table(place / "gps-0.csv", heads, f.latitude / DEG, f.longitude / DEG, f.height, velocity)
    _table(place / "gps_time.csv", ("gps_time (sec)",), rounded(f.time))
    _table(place / "gps_visibility.csv", ("gps_visibility",), np.ones(len(f)))
