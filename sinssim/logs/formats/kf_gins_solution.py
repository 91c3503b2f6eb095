"""Solution of KF-GINS (Wuhan University), also the form of the truth that comes with its data.

Text, blanks between the columns: GPS week, seconds of the week, latitude, longitude [°], height above the ellipsoid
[m], velocity north, east, down [m/s], roll, pitch, heading [°] of forward-right-down axes. KF-GINS itself writes 0
for the week. Layout: writeNavResult in src/kf_gins.cpp of KF-GINS.

Its standard deviations are in KF_GINS_STD.txt beside it: seconds of the week, then 21 of its states, the first nine
position and velocity north, east, down [m, m/s], and the angles about north, east, down by which the attitude is wrong
[°]. They are taken if the file has a row for every row of the solution. Layout: writeSTD in the same source, which the
README describes as roll, pitch, yaw; the states are those of insPropagation in src/kf-gins/gi_engine.cpp.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import WEEK, unrolled
from sinssim.logs.recorded_streams import Clock, SolutionStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, head_numbers, read_numbers
from sinssim.units import DEG

WIDTHS = (11,)
STD_FILE = "KF_GINS_STD.txt"
_STD_WIDTHS = (22,)


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first rows are a week, seconds, a place, a velocity and angles."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] not in WIDTHS or not np.isfinite(rows).all():
        return False
    week, seconds, latitude, longitude = rows[:, :4].T
    return bool(
        (week == np.floor(week)).all()
        and ((week >= 0.0) & (week < 10000.0)).all()
        and ((seconds >= 0.0) & (seconds <= WEEK + 86400)).all()
        and (np.diff(unrolled(seconds, WEEK)) > 0.0).all()
        and (np.abs(latitude) <= 90.0).all()
        and (np.abs(longitude) <= 360.0).all()
        and (np.abs(rows[:, 8:11]) <= 360.0).all()
    )


def read(path: Path) -> Streams:
    """Read the solution."""
    notes: list[str] = []
    rows = read_numbers(path, WIDTHS, notes)
    check_finite(path, rows, "time, position, velocity or angle")
    week = rows[:, 0]
    if (week != np.floor(week)).any() or (week < 0.0).any() or (week > 1e4).any():
        row = int(np.argmax((week != np.floor(week)) | (week < 0.0) | (week > 1e4)))
        raise InputError(f"{path}, row {row + 1}: {week[row]:g} is not a GPS week; the first column is the week, or 0.")
    known = bool((week > 0.0).all())
    time = rows[:, 1] + (week - week[0]) * WEEK if known else unrolled(rows[:, 1], WEEK)
    sigma = _sigma(path, rows[:, 1], notes)
    stream = SolutionStream(
        time=time,
        latitude=rows[:, 2] * DEG,
        longitude=rows[:, 3] * DEG,
        height=rows[:, 4],
        datum="ellipsoid",
        velocity_ned=rows[:, 5:8],
        q_nb=rotation.quaternion_from_euler(*(rows[:, 8:11] * DEG).T),
        position_sigma=None if sigma is None else sigma[:, 0:3],
        velocity_sigma=None if sigma is None else sigma[:, 3:6],
        attitude_sigma=None if sigma is None else _heading_alone(sigma[:, 8] * DEG),
    )
    note = f"seconds of the GPS week {int(week[0])}" if known else "seconds of the GPS week; the file gives week 0"
    clock = Clock("gps", int(week[0]) * WEEK if known else None, note)
    return Streams(path, "kf-gins-solution", clock, solutions={"solution": stream}, notes=tuple(notes))


def _sigma(path: Path, seconds: Array, notes: list[str]) -> Array | None:
    """Return the standard deviations beside a solution as they are written, (N, 21), and add what there is to say."""
    beside = path.with_name(STD_FILE)
    if not beside.is_file():
        return None
    rows = read_numbers(beside, _STD_WIDTHS, notes)
    if len(rows) != len(seconds) or not np.array_equal(rows[:, 0], seconds):
        notes.append(f"{STD_FILE} in the same folder is not used: it has other times and belongs to another solution.")
        return None
    notes.append(f"The σ are those of {STD_FILE} in the same folder.")
    return rows[:, 1:]


def _heading_alone(heading: Array) -> Array:
    """Return σ of roll, pitch and heading, (N, 3); those of roll and pitch are not given."""
    return np.column_stack((np.full((len(heading), 2), np.nan), heading))
