"""A drive in closed form, and recordings of it as text files, for the tests of recorded sensors."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, ImuData
from sinssim.truth.curve import Curve

LATITUDE, LONGITUDE, HEIGHT = 0.7, -1.8, 1600.0
REST_S = 12.0


def drive(seconds: float, *, rest: float = REST_S, roll: float = 0.02, pitch: float = -0.03) -> Curve:
    """Return a car that stands, then winds through curves at up to 12 m/s."""
    fine = np.arange(0.0, seconds + 0.005, 0.01)
    run = np.clip(fine - rest, 0.0, None)
    start = 1.0 - np.exp(-((run / 6.0) ** 3))  # velocity and acceleration begin smoothly
    speed = 12.0 * start * (1.0 + 0.15 * np.sin(0.2 * run))
    heading = 0.6 + 0.9 * start * np.sin(0.11 * run) + 0.004 * run
    velocity = np.column_stack((speed * np.cos(heading), speed * np.sin(heading), np.zeros(len(fine))))
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * 0.01
    ned = np.vstack((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    r1, r2 = earth.radii(LATITUDE)
    latitude = LATITUDE + ned[:, 0] / (float(r1) + HEIGHT)
    longitude = LONGITUDE + ned[:, 1] / ((float(r2) + HEIGHT) * np.cos(LATITUDE))
    knots = slice(None, None, 10)
    place = earth.geodetic_to_ecef(latitude[knots], longitude[knots], np.full(len(fine[knots]), HEIGHT))
    leaning = roll * np.ones(len(heading)), pitch * np.ones(len(heading))
    q_nb = rotation.quaternion_from_euler(*leaning, heading)[knots]
    return Curve(fine[knots], place, rotation.multiply(earth.q_en(latitude[knots], longitude[knots]), q_nb))


def write_csv(path: Path, names: str, columns: Array) -> Path:
    """Write columns with all digits."""
    rows = "\n".join(",".join(map(repr, row)) for row in np.asarray(columns).tolist())
    path.write_text(f"{names}\n{rows}\n".replace("nan", ""))
    return path


def write_reference(path: Path, truth: Curve, rate_hz: float, shift: float = 0.0) -> Path:
    """Write true position, velocity and attitude."""
    time = np.arange(truth.start, truth.end - 1e-9, 1.0 / rate_hz)
    state = truth.state(time)
    roll, pitch, heading = rotation.euler_from_quaternion(state.q_nb)
    columns = np.column_stack(
        (
            time + shift, np.degrees(state.latitude), np.degrees(state.longitude), state.height, state.velocity_ned,
            np.degrees(roll), np.degrees(pitch), np.degrees(heading),
        )
    )  # fmt: skip
    return write_csv(path, "t_s,lat,lon,h,vn,ve,vd,roll,pitch,heading", columns)


REFERENCE = {
    "time": "t_s",
    "latitude": {"column": "lat", "unit": "deg"},
    "longitude": {"column": "lon", "unit": "deg"},
    "height": {"column": "h", "unit": "m"},
    "velocity": {"columns": ["vn", "ve", "vd"], "unit": "m/s"},
}
ATTITUDE = {key: {"column": key, "unit": "deg"} for key in ("roll", "pitch", "heading")}
FIXES = {
    **REFERENCE,
    "position_sigma_m": [0.5, 0.5, 1.0],
    "velocity_sigma_mps": [0.05, 0.05, 0.05],
}


def write_increments(path: Path, imu: ImuData) -> Path:
    """Write increments in degrees and g·s, with axes right, forward, up, and times in milliseconds."""
    dtheta, dvel = np.degrees(imu.dtheta[:, [1, 0, 2]] * (1, 1, -1)), imu.dvel[:, [1, 0, 2]] * (1, 1, -1) / 9.80665
    return write_csv(path, "t_ms,gx,gy,gz,ax,ay,az", np.column_stack((1e3 * imu.time[1:], dtheta, dvel)))


INCREMENTS = {
    "kind": "increments",
    "time": "t_ms",
    "axes": ["right", "forward", "up"],
    "gyro": {"columns": ["gx", "gy", "gz"], "unit": "deg"},
    "accel": {"columns": ["ax", "ay", "az"], "unit": "g*s"},
}


def write_rates(path: Path, truth: Curve, time: Array) -> Path:
    """Write instantaneous rates in degrees per second and g at given instants."""
    gyro, accel = truth.rates(time)
    return write_csv(path, "t_s,gx,gy,gz,ax,ay,az", np.column_stack((time, np.degrees(gyro), accel / 9.80665)))


RATES = {
    "kind": "rates",
    "time": "t_s",
    "gyro": {"columns": ["gx", "gy", "gz"], "unit": "deg/s"},
    "accel": {"columns": ["ax", "ay", "az"], "unit": "g"},
}
