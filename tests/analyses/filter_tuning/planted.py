"""A straight flight with planted noises, and a log with a planted installation, which a filter is tuned by."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.scenario import Scenario
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.curve import Curve
from tests.logs.drive import FIXES, INCREMENTS, drive, write_csv, write_increments

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


ARM, LATE, AGE = (0.8, -0.4, 0.0), 0.12, 0.08
"""Lever arm of the antenna, m; by how much the stamps of all fixes are too late, and the age of the velocities, s."""


def written_log(folder: Path, seconds: float = 90.0, seed: int = 1) -> Path:
    """Write the log of a car whose antenna and receiver are not as its scenario says, and return the scenario."""
    truth, rng = drive(seconds), np.random.default_rng(seed)
    unit = Imu(grade="mems-tactical", rate_hz=50.0)
    write_increments(folder / "imu.csv", emulate(truth.increments(50.0), unit, seed=seed))
    time = np.arange(1.0, seconds - 1.0, 0.5)
    where, velocity = antenna(truth, time - LATE)[0], antenna(truth, time - LATE - AGE)[1]
    place = where + rng.standard_normal((len(time), 3)) * (0.1 / 6.4e6, 0.1 / 4.9e6, 0.2)
    velocity = velocity + 0.05 * rng.standard_normal((len(time), 3))
    columns = (time, np.degrees(place[:, 0]), np.degrees(place[:, 1]), place[:, 2], velocity)
    write_csv(folder / "fixes.csv", "t_s,lat,lon,h,vn,ve,vd", np.column_stack(columns))
    fixes = {**FIXES, "position_sigma_m": [0.1, 0.1, 0.2], "file": "fixes.csv"}
    state = truth.state(0.0)
    roll, pitch, heading = np.degrees(rotation.euler_from_quaternion(state.q_nb))
    contents = {
        "name": "planted",
        "log": {
            "imu": {"file": "imu.csv", **INCREMENTS}, "gnss": fixes,
            "start": {"roll_deg": float(roll), "pitch_deg": float(pitch), "heading_deg": float(heading)},
        },
        "imu": {"grade": "mems-tactical", "rate_hz": 50.0},
        "filter": {"rate_hz": 2.0},
    }  # fmt: skip
    file = folder / "log.toml"
    file.write_text(Scenario.model_validate(contents).to_toml(), encoding="utf-8")
    return file


def antenna(truth: Curve, time: Array) -> tuple[Array, Array]:
    """Return latitude, longitude and height of the antenna, and its velocity."""
    state, rate = truth.state(time), truth.rates(time)[0]
    c = rotation.dcm_from_quaternion(state.q_nb)
    off, turning = c @ np.array(ARM), np.einsum("kij,kj->ki", c, np.cross(rate, ARM))
    r1, r2 = earth.radii(state.latitude)
    place = (
        state.latitude + off[:, 0] / (r1 + state.height),
        state.longitude + off[:, 1] / ((r2 + state.height) * np.cos(state.latitude)),
        state.height - off[:, 2],
    )
    return np.column_stack(place), state.velocity_ned + turning


MOUNTED = (0.0, 2.0, -3.0)
"""Roll, pitch and yaw of the block in the car of `written_mounted`, degrees."""

_SWAY, _RATE = 4e-3, 50.0
"""1σ of the angles by which the car points beside its way, rad, new ten times a second; samples per second."""


def written_mounted(folder: Path, seconds: float = 90.0, seed: int = 1) -> Path:
    """Write the log of a car whose block is not mounted as its scenario says, and return the scenario.

    The car sways about its way, as the 1σ of its wheels' velocities says at 12 m/s.
    """
    straight, rng = drive(seconds, roll=0.0, pitch=0.0), np.random.default_rng(seed)
    knots = np.arange(0.0, seconds + 0.05, 0.1)
    state = straight.state(knots)
    sway = _SWAY * rng.standard_normal((2, len(knots))) * np.minimum(np.linalg.norm(state.velocity_ned, axis=1), 1.0)
    q_vb = rotation.quaternion_from_euler(*np.radians(MOUNTED))
    heading = rotation.euler_from_quaternion(state.q_nb)[2]
    q_nb = rotation.multiply(rotation.quaternion_from_euler(0.0 * heading, sway[0], heading + sway[1]), q_vb)
    place = earth.geodetic_to_ecef(state.latitude, state.longitude, state.height)
    truth = Curve(knots, place, rotation.multiply(earth.q_en(state.latitude, state.longitude), q_nb))
    unit = Imu(grade="mems-tactical", rate_hz=_RATE)
    write_increments(folder / "imu.csv", emulate(truth.increments(_RATE), unit, seed=seed))
    time = np.arange(1.0, seconds - 1.0, 0.5)
    there = truth.state(time)
    noise = rng.standard_normal((2, len(time), 3))
    place = np.column_stack((there.latitude, there.longitude, there.height))
    place += noise[0] * (0.1 / 6.4e6, 0.1 / 4.9e6, 0.2)
    velocity = there.velocity_ned + 0.05 * noise[1]
    columns = (time, np.degrees(place[:, 0]), np.degrees(place[:, 1]), place[:, 2], velocity)
    write_csv(folder / "fixes.csv", "t_s,lat,lon,h,vn,ve,vd", np.column_stack(columns))
    across = 12.0 * _SWAY
    contents = {
        "name": "mounted",
        "log": {
            "imu": {"file": "imu.csv", **INCREMENTS},
            "gnss": {**FIXES, "position_sigma_m": [0.1, 0.1, 0.2], "file": "fixes.csv"},
        },
        "imu": {"grade": "mems-tactical", "rate_hz": _RATE},
        "aiding": {"land_vehicle": {"sigma_lateral_mps": across, "sigma_vertical_mps": across}},
        "filter": {"rate_hz": 10.0},
    }  # fmt: skip
    file = folder / "mounted.toml"
    file.write_text(Scenario.model_validate(contents).to_toml(), encoding="utf-8")
    return file
