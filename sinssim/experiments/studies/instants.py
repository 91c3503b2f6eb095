"""The times of a navigation at which a study computes errors, those that it keeps for plots, and the errors' drifts."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import NavSolution
from sinssim.statistics.rates import mean_rate, rate_uncertainty
from sinssim.strapdown.nav_error import NavError
from sinssim.units import ARCSEC, UG

Rows = NDArray[np.intp]

_EVALUATED = 4096  # evenly spread instants for statistics
_KEPT = 512  # of these, kept for plots over time
_EARLY = 128  # further instants for plots, evenly spread over the logarithm of time


class Instants(NamedTuple):
    """Rows of a solution.

    Attributes:
        taken: rows at which errors are computed, in order.
        even: which of these are evenly spread, for statistics.
        kept: which of these are kept for plots over time.
    """

    taken: Rows
    even: Rows
    kept: Rows


def instants(count: int) -> Instants:
    """Return the rows at which errors are taken."""
    even = _spread(count, _EVALUATED)
    early = np.geomspace(1, max(count - 1, 1), min(count - 1, _EARLY)).round().astype(np.intp)
    taken = np.union1d(even, early)
    at = np.searchsorted(taken, even)
    return Instants(taken, at, np.union1d(at[_spread(len(at), _KEPT)], np.searchsorted(taken, early)))


def rows_of(solution: NavSolution, rows: Rows) -> NavSolution:
    """Return some rows of a solution."""
    names = ["time", "latitude", "longitude", "height", "velocity_ned", "q_nb", "defect"]
    names += ["azimuth"] if solution.azimuth is not None else []
    return replace(solution, events=(), **{name: getattr(solution, name)[rows] for name in names})


def drifts(error: NavError, rows: Rows) -> dict[str, float]:
    """Return the slopes of velocity and attitude errors and their standard errors, as `results.Row` names them.

    Lines through the origin are fitted to the evenly spread `rows`; slopes do not depend on the duration of the motion.
    """
    time = error.time[rows] - error.time[0]
    found = {}
    for name, unit, values, scale in (
        ("velocity_drift", "ug", error.speed, UG),
        ("attitude_drift", "arcsec_h", error.angle, ARCSEC / 3600.0),
    ):
        found[f"{name}_{unit}"] = float(mean_rate(time, values[rows])) / scale
        found[f"{name}_uncertainty_{unit}"] = float(rate_uncertainty(time, values[rows])) / scale
    return found


def _spread(count: int, most: int) -> Rows:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))
