"""Applanix SBET: 17 doubles per record, little-endian; wander angle 0, so that x, y, z of the velocity are N, E, D."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.errors import InputError
from sinssim.logs.gps_time import week_and_seconds
from sinssim.logs.writers.run_export import Content

SUFFIX = ".sbet"
HOLDS = "solution"


def write(content: Content, place: Path) -> list[str]:
    """Write the file.

    Raises:
        InputError: the stream has no velocity or attitude.
    """
    s = content.solution
    if s.velocity_ned is None or s.q_nb is None:
        raise InputError(f"SBET has velocity and attitude; {content.solution_name} lacks them.")
    week, start = week_and_seconds(content.start_gps_s)
    rows = np.zeros((len(s), 17), dtype="<f8")
    rows[:, 0] = start + s.time
    rows[:, 1], rows[:, 2], rows[:, 3] = s.latitude, s.longitude, s.height
    rows[:, 4:7] = s.velocity_ned
    rows[:, 7:10] = np.column_stack(rotation.euler_from_quaternion(s.q_nb))
    said = ["Accelerations and angular rates (records 12 to 17) are 0."]
    if content.imu_name is not None:
        imu = content.imu
        assert imu.interval is not None
        at = np.searchsorted(imu.time, s.time - 1e-9).clip(max=len(imu) - 1)
        rows[:, 11:14] = imu.accel[at] / imu.interval[at, 1:]
        rows[:, 14:17] = imu.gyro[at] / imu.interval[at, :1]
        said = [f"Specific force and inertial rate are the {content.imu_name} data, means over the last interval."]
    place.write_bytes(rows.tobytes())
    return [
        f"{content.solution_name}: latitude, longitude [rad], height above the ellipsoid, velocity north, east, down "
        "(wander angle 0), roll, pitch, heading [rad] of forward-right-down axes.",
        *said,
        f"Times are seconds of the GPS week {week}; the run's time 0 is {start}.",
    ]
