"""Takes the errors of one run at the epochs of an ensemble."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import RunError
from sinssim.experiments.ensembles.run_errors import VECTORS, RunErrors
from sinssim.strapdown.nav_error import NavError

WITHIN = 1e-6
"""s: an instant of a solution that is later than an epoch by less counts as the epoch."""


def rows_at(epochs: Array, time: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the epochs, (K,) s, that a solution at instants `time`, (N,) s, reaches, and its rows there.

    These are numbers of the epochs, (k,), and the last row at or before each, with the last of all, (k + 1,).
    """
    reached = np.flatnonzero((epochs >= time[0] - WITHIN) & (epochs <= time[-1] + WITHIN))
    rows = np.searchsorted(time, epochs[reached] + WITHIN, side="right") - 1
    return reached, np.append(rows, len(time) - 1)


def fill_in(errors: RunErrors, row: int, error: NavError, epochs: NDArray[np.intp]) -> None:
    """Fill in a run's errors."""
    for number, name in enumerate(VECTORS):
        values = getattr(error, name)
        getattr(errors, name)[row, epochs] = values[:-1]
        errors.final[row, 3 * number : 3 * number + 3] = values[-1]


def check_finite(error: NavError) -> None:
    """Raise for errors that are not finite."""
    finite = np.all([np.isfinite(getattr(error, name)).all(axis=1) for name in VECTORS], axis=0)
    if not finite.all():
        time = float(error.time[int(np.argmin(finite))])
        raise RunError(f"its errors are not finite at t = {time:.2f} s: it diverged.", time=time)
