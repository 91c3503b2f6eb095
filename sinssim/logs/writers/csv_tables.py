"""Folder of CSV files: the solution or truth, inertial readings, fixes; readable again as the format "columns"."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.logs.recorded_streams import FixStream, SolutionStream
from sinssim.logs.text.numeric_columns import columns_of, rounded, write_columns
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG

SUFFIX = ""
HOLDS = "run"

_POSITION = ["latitude_deg", "longitude_deg", "height_m"]
_VELOCITY = ["velocity_n_mps", "velocity_e_mps", "velocity_d_mps"]


def write(content: Content, place: Path) -> list[str]:
    """Write one file for each stream."""
    name = f"{content.solution_name}.csv"
    _write_solution(content.solution, place / name)
    said = [
        f"{name}: {content.solution_name}; latitude, longitude in degrees, height above the ellipsoid, velocity "
        "north-east-down, quaternion (scalar first) and roll, pitch, heading of forward-right-down axes."
    ]
    if content.imu_name is not None:
        imu = content.imu
        names = [f"dtheta_{axis}_rad" for axis in "xyz"] + [f"dvel_{axis}_mps" for axis in "xyz"]
        columns = columns_of(imu.time, imu.gyro, imu.accel)
        write_columns(place / "imu.csv", columns, header=_header(["time_s", *names]), delimiter=",")
        said.append(f"imu.csv: {content.imu_name} data, increments over the interval that ends at the time.")
    for receiver, fixes in content.fixes.items():
        _write_fixes(fixes, place / f"{receiver}.csv")
        arm = ", ".join(f"{value:g}" for value in content.run.lever_arm(receiver))
        said.append(f"{receiver}.csv: fixes of the antenna, which is at {arm} m (forward, right, down) of the IMU.")
    return [*said, "time_s is the run's own time."]


def _header(names: list[str]) -> str:
    return ",".join(names) + "\n"


def _write_solution(s: SolutionStream, path: Path) -> None:
    names = ["time_s", *_POSITION]
    parts = [rounded(s.time), s.latitude / DEG, s.longitude / DEG, s.height]
    if s.velocity_ned is not None:
        names += _VELOCITY
        parts.append(s.velocity_ned)
    if s.q_nb is not None:
        names += ["q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z", "roll_deg", "pitch_deg", "heading_deg"]
        parts += [s.q_nb, np.column_stack(rotation.euler_from_quaternion(s.q_nb)) / DEG]
    write_columns(path, columns_of(*parts), header=_header(names), delimiter=",")


def _write_fixes(f: FixStream, path: Path) -> None:
    names = ["time_s", *_POSITION]
    parts = [rounded(f.time), f.latitude / DEG, f.longitude / DEG, f.height]
    if f.position_sigma is not None:
        names += ["sigma_n_m", "sigma_e_m", "sigma_d_m"]
        parts.append(f.position_sigma)
    if f.velocity_ned is not None:
        names += _VELOCITY
        parts.append(f.velocity_ned)
    if f.velocity_sigma is not None:
        names += ["sigma_vn_mps", "sigma_ve_mps", "sigma_vd_mps"]
        parts.append(f.velocity_sigma)
    write_columns(path, columns_of(*parts), header=_header(names), delimiter=",")
