"""TUM trajectory: time [s], position x, y, z [m], quaternion x, y, z, w; blanks between the columns.

Layout: the benchmark of the Technical University of Munich. The axes are taken as those of ROS (REP 103): position
east, north, up from an origin that the file does not give, attitude from forward-left-up to east-north-up.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.stamps import clock_of, split_first
from sinssim.logs.local_level import q_nb_from_enu_flu
from sinssim.logs.recorded_streams import SolutionStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, head_numbers, read_numbers


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first rows have eight numbers, the last four of norm 1."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] != 8 or not np.isfinite(rows).all():
        return False
    return bool((np.abs(np.linalg.norm(rows[:, 4:], axis=1) - 1.0) < 0.01).all() and (np.diff(rows[:, 0]) > 0.0).all())


def unit(path: Path, q: Array) -> Array:
    """Return quaternions with norm 1.

    Args:
        q: (N, 4).

    Raises:
        InputError: a norm is not 1; the message names the row.
    """
    norm = np.linalg.norm(q, axis=1)
    bad = ~(np.abs(norm - 1.0) < 0.01)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(f"{path}, row {row + 1}: the quaternion has the norm {norm[row]:.4g}, not 1.")
    return np.asarray(q / norm[:, np.newaxis])


def local_solution(time: Array, position: Array, q: Array | None, velocity: Array | None) -> SolutionStream:
    """Return a solution in local axes.

    Args:
        time: (N,) s.
        position: east, north, up, (N, 3) m.
        q: from forward-left-up to east-north-up, scalar first, (N, 4).
        velocity: east, north, up, (N, 3) m/s.
    """
    nowhere = np.full(len(time), np.nan)
    return SolutionStream(
        time=time,
        latitude=nowhere,
        longitude=nowhere,
        height=nowhere,
        velocity_ned=None if velocity is None else velocity[:, (1, 0, 2)] * np.array([1.0, 1.0, -1.0]),
        q_nb=None if q is None else rotation.normalize(q_nb_from_enu_flu(q)),
        local_enu=position,
    )


def read(path: Path) -> Streams:
    """Read the trajectory."""
    notes = ["Axes taken as east-north-up and forward-left-up; the file does not define them."]
    rows = read_numbers(path, (8,), notes)
    check_finite(path, rows, "number")
    clock, time = clock_of(split_first(path), "seconds")
    stream = local_solution(time, rows[:, 1:4], unit(path, rows[:, 4:])[:, (3, 0, 1, 2)], None)
    return Streams(path, "tum", clock, solutions={"solution": stream}, notes=tuple(notes))
