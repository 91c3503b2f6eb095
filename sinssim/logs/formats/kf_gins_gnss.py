"""GNSS file of KF-GINS (Wuhan University): positions of the antenna with standard deviations.

Text, blanks between the columns: seconds of the GPS week, latitude, longitude [°], height above the ellipsoid [m],
σ north, east, down [m]. With 13 columns, as its loader reads them: velocity north, east, down [m/s] follows the height,
then σ of the position, then σ of the velocity. Layout: src/fileio/gnssfileloader.h of KF-GINS.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim.logs.gps_time import WEEK, unrolled
from sinssim.logs.recorded_streams import Clock, FixStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, head_numbers, read_numbers
from sinssim.units import DEG

WIDTHS = (7, 13)


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first rows are a time, a place and positive standard deviations."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] not in WIDTHS or not np.isfinite(rows).all():
        return False
    sigma = rows[:, 4:7] if rows.shape[1] == 7 else rows[:, 7:13]
    return bool(
        (rows[:, 0] >= 0.0).all()
        and (rows[:, 0] <= WEEK + 86400).all()
        and (np.diff(rows[:, 0]) > 0.0).all()
        and (np.abs(rows[:, 1]) <= 90.0).all()
        and (np.abs(rows[:, 2]) <= 360.0).all()
        and (np.abs(rows[:, 3]) < 1e6).all()
        and (sigma > 0.0).all()
        and np.ptp(rows[:, 1]) < 0.1
    )


def read(path: Path) -> Streams:
    """Read the fixes."""
    notes: list[str] = []
    rows = read_numbers(path, WIDTHS, notes)
    check_finite(path, rows[:, :4], "time or position")
    wide = rows.shape[1] == 13
    stream = FixStream(
        time=unrolled(rows[:, 0], WEEK),
        latitude=rows[:, 1] * DEG,
        longitude=rows[:, 2] * DEG,
        height=rows[:, 3],
        datum="ellipsoid",
        position_sigma=rows[:, 7:10] if wide else rows[:, 4:7],
        velocity_ned=rows[:, 4:7] if wide else None,
        velocity_sigma=rows[:, 10:13] if wide else None,
    )
    clock = Clock("gps", None, "seconds of the GPS week; the file does not give the week")
    return Streams(path, "kf-gins-gnss", clock, fixes={"gnss": stream}, notes=tuple(notes))
