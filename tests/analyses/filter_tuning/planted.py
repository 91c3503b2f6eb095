"""A straight flight with planted noises, which a filter is tuned by."""

from __future__ import annotations

from pathlib import Path

_TEXT = """
name = "planted"
seed = {seed}

[great_circle]
latitude_deg = 48.0
course_deg = 60.0
speed_mps = 60.0
altitude_m = 500.0
duration_s = {duration}

[imu]
grade = "mems-industrial"
rate_hz = 20.0
accel_vrw_mps_sqrt_h = 0.5
gyro_arw_deg_sqrt_h = 3.0

[navigation.initial_error]
velocity_sigma_mps = 0.1
tilt_sigma_arcmin = 10.0
heading_sigma_arcmin = 30.0

[aiding.gnss]
rate_hz = 2.0
position_sigma_m = 1.5
height_sigma_m = 3.0
velocity_sigma_mps = 0.05

[filter]
rate_hz = 2.0
"""

PLANTED = {
    "imu.accel_vrw_mps_sqrt_h": 0.5, "imu.gyro_arw_deg_sqrt_h": 3.0, "aiding.gnss.position_sigma_m": 1.5,
    "aiding.gnss.height_sigma_m": 3.0, "aiding.gnss.velocity_sigma_mps": 0.05,
}  # fmt: skip
"""Keys with the values that the data have."""


def written(folder: Path, duration: float = 200.0, seed: int = 1) -> Path:
    """Write the scenario for a duration, s, and return its file."""
    file = folder / "planted.toml"
    file.write_text(_TEXT.format(duration=duration, seed=seed), encoding="utf-8")
    return file
