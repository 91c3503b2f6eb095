"""What a phone in a car writes: acceleration without gravity, gravity and gyros, each with stamps of its own."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.units import G0
from tests.analyses.inspection import worlds

START = 1_770_000_000
"""Unix time of the world's time 0."""
RATE_HZ = 50.0
_PULL = 0.05  # 1/s
_TURN = np.diag((1.0, -1.0, -1.0))  # x forward, y left, z up


@cache
def split() -> tuple[Array, Array, Array, Array]:
    """Return times, gyros, accelerometers, and the gravity that the phone's filter finds, m/s²; all (N, 3).

    The filter turns gravity with the gyros, pulls it toward the accelerometers, and keeps its magnitude.
    """
    unit = worlds.readings(RATE_HZ)
    gyro, accel = unit.gyro @ _TURN, unit.accel @ _TURN
    gravity = np.empty_like(accel)
    now = accel[0]
    for k, (w, s) in enumerate(zip(gyro, accel, strict=True)):
        w_x_now = (w[1] * now[2] - w[2] * now[1], w[2] * now[0] - w[0] * now[2], w[0] * now[1] - w[1] * now[0])
        now = now + (_PULL * (s - now) - w_x_now) / RATE_HZ
        now = gravity[k] = now * (G0 / float(np.sqrt(now @ now)))
    return unit.time, gyro, accel, gravity


def record(
    folder: Path, gravity_sign: float = 1.0, sign: float = 1.0, unit: float = 1.0, of_gravity: float | None = None
) -> None:
    """Write Gyroscope.csv, Accelerometer.csv and Gravity.csv.

    Args:
        folder: of the files.
        gravity_sign: 1 if gravity has the direction of the specific force at rest, up; -1 for down.
        sign: of the acceleration relative to gravity.
        unit: of the acceleration, m/s².
        of_gravity: unit of gravity, m/s²; the same by default.
    """
    time, gyro, accel, gravity = split()
    _write(folder / "Gyroscope.csv", time + 0.0007, gyro)
    _write(folder / "Accelerometer.csv", time, gravity_sign * sign * (accel - gravity) / unit)
    _write(
        folder / "Gravity.csv",
        time[::2] + 0.003,
        gravity_sign * (gravity[::2] + _slope()[::2] * 0.003) / (of_gravity or unit),
    )


def _slope() -> Array:
    time, _, _, gravity = split()
    return np.asarray(np.gradient(gravity, time, axis=0))


def _write(path: Path, time: Array, values: Array) -> None:
    stamps = [f"{START * 10**9 + round(1e9 * t)}" for t in time]
    rows = [f"{s},{t:.6f},{z:.6f},{y:.6f},{x:.6f}" for s, t, (x, y, z) in zip(stamps, time, values, strict=True)]
    path.write_text("time,seconds_elapsed,z,y,x\n" + "\n".join(rows) + "\n")


def record_places(folder: Path) -> None:
    """Write Location.csv, one fix a second."""
    seen = worlds.fixes(rate_hz=1.0)
    assert seen.velocity_ned is not None
    north, east = seen.velocity_ned[:, 0], seen.velocity_ned[:, 1]
    columns = np.column_stack(
        [
            seen.time, np.full(len(seen), 3.0), np.full(len(seen), 0.3), np.hypot(north, east),
            np.degrees(np.arctan2(east, north)) % 360.0, seen.height, np.degrees(seen.longitude),
            np.degrees(seen.latitude),
        ]
    )  # fmt: skip
    lines = ["time,seconds_elapsed,horizontalAccuracy,speedAccuracy,speed,bearing,altitude,longitude,latitude"]
    for row in columns:
        lines.append(f"{START * 10**9 + round(1e9 * row[0])}," + ",".join(f"{value:.9f}" for value in row))
    (folder / "Location.csv").write_text("\n".join(lines) + "\n")
