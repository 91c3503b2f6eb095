"""IMU file of KF-GINS (Wuhan University): increments along forward, right, down.

Text, blanks between the columns: seconds of the GPS week at the end of the interval, Δθ about x, y, z [rad], Δv along
x, y, z [m/s]. Further columns (odometer) are left out. Layout: src/fileio/imufileloader.h of KF-GINS.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim.logs.gps_time import WEEK, unrolled
from sinssim.logs.recorded_streams import Clock, InertialStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, head_numbers, read_numbers

WIDTHS = (7, 8)


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first rows are a time that grows by less than a second, and increments."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] not in WIDTHS or not np.isfinite(rows).all():
        return False
    steps = np.diff(rows[:, 0])
    if not len(steps) or not (steps > 0.0).all():
        return False
    force = float(np.median(np.linalg.norm(rows[1:, 4:7], axis=1) / steps))  # increments: gravity over the interval
    return bool(
        (rows[:, 0] >= 0.0).all()
        and (rows[:, 0] <= WEEK + 86400).all()
        and (steps <= 1.0).all()
        and (np.abs(rows[:, 1:4]) < 1.0).all()
        and 2.0 < force < 100.0  # m/s²
    )


def read(path: Path) -> Streams:
    """Read the increments."""
    notes: list[str] = []
    rows = read_numbers(path, WIDTHS, notes)
    check_finite(path, rows[:, :7], "time or increment")
    stream = InertialStream(
        time=unrolled(rows[:, 0], WEEK),
        gyro=rows[:, 1:4],
        accel=rows[:, 4:7],
        kind="increments",
        axes=("forward", "right", "down"),
    )
    clock = Clock("gps", None, "seconds of the GPS week; the file does not give the week")
    return Streams(path, "kf-gins-imu", clock, inertial={"imu": stream}, notes=tuple(notes))
