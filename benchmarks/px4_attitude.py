"""Judges two attitudes of a small aircraft's flight: that of its autopilot, and that of sinssim's filter.

    python -m benchmarks.px4_attitude FOLDER

FOLDER holds IMU.txt, GPSraw.txt, MAG.txt, NTUN.txt and ATT.txt of the PX4 flight in priseborough/InertialNav. Neither
attitude is taken for the truth. Each is asked how well it explains three things that no filter has touched:

- velocity: over windows, the specific force turned by the attitude, with gravity, is the change of the velocity;
- airspeed: the velocity over ground is the airspeed along the nose and a constant wind;
- magnetometer: the readings are a constant field, turned by the attitude, and a constant offset of the sensor.

The filter uses gyros, accelerometers and the receiver, neither airspeed nor magnetometer.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import interp1d
from scipy.spatial.transform import Rotation, Slerp

import sinssim
from sinssim.data import Array

BEGIN_S, END_S = 20.0, 99.0
"""In flight: before, the aircraft is carried and launched by hand."""
LATE_S = 0.267
"""The receiver's stamps are late by this much: `sinssim inspect`."""
WINDOW_S = 8.0
GRAVITY = 9.807

SCENARIO = """
name = "px4"
description = "A small aircraft with a consumer unit"
[log.imu]
file = "IMU.txt"
format = "text"
delimiter = "whitespace"
kind = "rates"
time = 2
time_unit = "ms"
gyro = { columns = [3, 4, 5], unit = "rad/s" }
accel = { columns = [6, 7, 8], unit = "m/s^2" }
[log.gnss]
file = "GPSraw.txt"
format = "text"
delimiter = "whitespace"
time = 1
time_unit = "ms"
time_offset_s = -0.267
latitude = { column = 2, unit = "deg" }
longitude = { column = 3, unit = "deg" }
height = { column = 4, unit = "m" }
velocity = { columns = [5, 6, 7], unit = "m/s" }
position_sigma_m = [2.0, 2.0, 4.0]
velocity_sigma_mps = [0.3, 0.3, 0.5]
[imu]
grade = "consumer"
[filter]
smooth = true
vibration_noise = 0.5
"""


def attitudes(folder: Path, scratch: Path) -> dict[str, Slerp]:
    """Return the attitude of the autopilot and the smoothed one of the filter, as functions of time."""
    path = scratch / "px4.toml"
    path.write_text(SCENARIO.replace('file = "', f'file = "{folder.resolve()}/'))
    run = sinssim.run(sinssim.load_scenario(str(path)))
    assert run.aided is not None
    assert run.aided.estimate.smoothed is not None
    own = run.aided.estimate.smoothed.solution
    given = np.loadtxt(folder / "ATT.txt")
    angles = np.radians(given[:, [4, 3, 2]])
    return {
        "autopilot": Slerp(1e-3 * given[:, 1], Rotation.from_euler("ZYX", angles)),
        "smoothed": Slerp(own.time, Rotation.from_quat(own.q_nb, scalar_first=True)),
    }


def _fixes(folder: Path) -> tuple[Array, Array]:
    table = np.loadtxt(folder / "GPSraw.txt")
    time = 1e-3 * table[:, 0] - LATE_S
    inside = (time > BEGIN_S) & (time < END_S)
    return time[inside], table[inside, 4:7]


def by_velocity(folder: Path, attitude: Slerp) -> float:
    """Return the rms by which changes of the velocity over windows differ, m/s per component."""
    table = np.loadtxt(folder / "IMU.txt")
    time = 1e-3 * table[:, 1]
    rows = (time > BEGIN_S - 1.0) & (time < END_S + 0.5)
    time, force = time[rows], attitude(time[rows]).apply(table[rows, 5:8])
    force[:, 2] += GRAVITY
    steps = 0.5 * (force[1:] + force[:-1]) * np.diff(time)[:, None]
    gained = interp1d(time, np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), axis=0)
    at, velocity = _fixes(folder)
    off = velocity - gained(at)
    windows = [off[(at >= b) & (at < b + WINDOW_S)] for b in np.arange(BEGIN_S, END_S - WINDOW_S, 0.5 * WINDOW_S)]
    return float(np.sqrt(np.mean(np.concatenate([(w - w.mean(axis=0)) ** 2 for w in windows]))))


def by_airspeed(folder: Path, attitude: Slerp) -> float:
    """Return the rms by which the horizontal velocity differs from airspeed along the nose and a wind, m/s."""
    table = np.loadtxt(folder / "NTUN.txt")
    at, velocity = _fixes(folder)
    ahead = np.interp(at, 1e-3 * table[:, 1], table[:, 7])[:, None] * attitude(at).apply([1.0, 0.0, 0.0])
    model = np.zeros((2 * len(at), 3))  # scale of the airspeed, wind north and east
    model[:, 0], model[0::2, 1], model[1::2, 2] = ahead[:, :2].ravel(), 1.0, 1.0
    seen = velocity[:, :2].ravel()
    return float(np.sqrt(np.mean((seen - model @ np.linalg.lstsq(model, seen, rcond=None)[0]) ** 2)))


def by_magnetometer(folder: Path, attitude: Slerp, begin: float = BEGIN_S) -> tuple[float, float]:
    """Return the rms by which the field differs from a constant one, gauss per component, and its inclination, °."""
    table = np.loadtxt(folder / "MAG.txt")
    at = np.arange(begin, END_S, 0.05)
    seen = interp1d(1e-3 * table[:, 1], table[:, 2:5], axis=0)(at)
    model = np.zeros((3 * len(at), 6))
    model[:, :3] = attitude(at).inv().as_matrix().reshape(-1, 3)
    model[:, 3:] = np.tile(np.eye(3), (len(at), 1))
    field = np.linalg.lstsq(model, seen.ravel(), rcond=None)[0]
    inclination = float(np.degrees(np.arctan2(field[2], np.hypot(field[0], field[1]))))
    return float(np.sqrt(np.mean((seen.ravel() - model @ field) ** 2))), inclination


def main() -> None:
    """Print the table."""
    import tempfile

    folder = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as scratch:
        for name, attitude in attitudes(folder, Path(scratch)).items():
            field, inclination = by_magnetometer(folder, attitude)
            late, _ = by_magnetometer(folder, attitude, 60.0)
            print(
                f"{name:10} velocity {by_velocity(folder, attitude):.2f} m/s, airspeed "
                f"{by_airspeed(folder, attitude):.2f} m/s, magnetometer {1e3 * field:.0f} mG (after 60 s "
                f"{1e3 * late:.0f} mG), inclination {inclination:.1f}°"
            )


if __name__ == "__main__":
    main()
