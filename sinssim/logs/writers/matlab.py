"""MATLAB .mat (version 5): structures of the truth, every solution, imu, fixes; SI units in the names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.errors import InputError
from sinssim.logs.gps_time import week_and_seconds
from sinssim.logs.recorded_streams import FixStream, InertialStream, SolutionStream
from sinssim.logs.writers.run_export import Content

SUFFIX = ".mat"
HOLDS = "run"
_LARGEST = 2**31 - 1  # bytes of one variable in version 5


def write(content: Content, place: Path) -> list[str]:
    """Write the file.

    Args:
        content: what is written; all solutions of the run go in.
    """
    from scipy.io import savemat

    week, seconds = week_and_seconds(content.start_gps_s)
    found: dict[str, Any] = {"start": {"gps_week": float(week), "gps_seconds_of_week": float(seconds)}}
    for name in content.run.solutions:
        found[_name(name)] = _solution(content.run.solution(name))
    if content.imu_name is not None:
        found["imu"] = _imu(content.imu)
    for name, fixes in content.fixes.items():
        found[_name(name)] = {**_fixes(fixes), "lever_arm_m": np.array(content.run.lever_arm(name))}
    largest = max(value.nbytes for part in found.values() for value in part.values() if isinstance(value, np.ndarray))
    if largest > _LARGEST:
        raise InputError(f"a column of this run has {largest / 1e9:.1f} GB; a .mat file of version 5 holds 2 GB each.")
    savemat(place, found, oned_as="column", do_compression=True)
    names = ", ".join(found)
    return [
        f"Structures: {names}. Angles in rad, heights above the ellipsoid, velocity north-east-down, quaternions "
        "scalar first, body axes forward-right-down.",
        f"imu holds the {content.imu_name} data, increments over the interval that ends at time_s."
        if content.imu_name is not None
        else "The run has no inertial data with three gyros.",
        f"time_s is the run's own time; its 0 is second {seconds} of the GPS week {week}.",
    ]


def _name(name: str) -> str:
    """Return a name that MATLAB accepts."""
    return "".join(c if c.isalnum() else "_" for c in name)


def _solution(s: SolutionStream) -> dict[str, Any]:
    found: dict[str, Any] = {
        "time_s": s.time, "latitude_rad": s.latitude, "longitude_rad": s.longitude, "height_m": s.height,
    }  # fmt: skip
    if s.velocity_ned is not None:
        found["velocity_ned_mps"] = s.velocity_ned
    if s.q_nb is not None:
        roll, pitch, heading = rotation.euler_from_quaternion(s.q_nb)
        found |= {"q_nb": s.q_nb, "roll_rad": roll, "pitch_rad": pitch, "heading_rad": heading}
    return found


def _imu(imu: InertialStream) -> dict[str, Any]:
    return {"time_s": imu.time, "dtheta_rad": imu.gyro, "dvel_mps": imu.accel}


def _fixes(f: FixStream) -> dict[str, Any]:
    found: dict[str, Any] = {
        "time_s": f.time, "latitude_rad": f.latitude, "longitude_rad": f.longitude, "height_m": f.height,
    }  # fmt: skip
    more = {
        "sigma_ned_m": f.position_sigma,
        "velocity_ned_mps": f.velocity_ned,
        "velocity_sigma_ned_mps": f.velocity_sigma,
    }
    return found | {name: value for name, value in more.items() if value is not None}
