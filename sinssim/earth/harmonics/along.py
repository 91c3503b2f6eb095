"""The disturbance of gravity along a path: evaluated at knots, a spline between them, with its error measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.earth.harmonics.field import DisturbingField

TOLERANCE = 1e-8
"""Largest error of the spline where it is measured, m/s²: 0.001 mGal."""
_COARSEST, _FINEST = 4.0, 0.03125
"""Largest and smallest interval between knots, s."""
_FEWEST = 8
"""Intervals at least."""


@dataclass(frozen=True, eq=False)
class DisturbanceAlong:
    """Disturbance of gravity as a function of time, a cubic spline over equal intervals.

    Attributes:
        start, step: first knot and interval, s.
        panels: coefficients by power of the time since the interval's knot, (K, 4, 3), Earth-fixed axes, m/s².
        error: largest difference from the field between the knots of the spline before the last halving, m/s²; that of
            this spline is about a sixteenth of it.
        evaluations: number of points at which the field was evaluated.
    """

    start: float
    step: float
    panels: Array
    error: float
    evaluations: int

    def at(self, t: Array) -> Array:
        """Return the disturbance in Earth-fixed axes.

        Args:
            t: instants, (N,) s.

        Returns:
            δg, (N, 3) m/s².
        """
        panel = np.clip(((t - self.start) / self.step).astype(np.intp), 0, len(self.panels) - 1)
        u = (t - self.start - panel * self.step)[:, None]
        c = self.panels[panel]
        return np.asarray(c[:, 0] + u * (c[:, 1] + u * (c[:, 2] + u * c[:, 3])))


def _panels(time: Array, values: Array) -> Array:
    from scipy.interpolate import CubicSpline

    return np.ascontiguousarray(np.moveaxis(CubicSpline(time, values).c[::-1], 0, 1))


def disturbance_along(
    field: DisturbingField, path: Callable[[Array], Array], start: float, end: float, tolerance: float = TOLERANCE
) -> DisturbanceAlong:
    """Return the disturbance of gravity along a path.

    Knots lie at most 4 s and an eighth of the way apart. The interval is halved until the spline through the old knots
    meets the field at all the new ones within the tolerance; the new ones become knots, too.

    Args:
        path: returns Earth-fixed positions at instants, (N,) s → (N, 3) m.
        start, end: first and last instant, s.
        tolerance: largest error between knots, m/s².
    """
    count = max(_FEWEST, int(np.ceil((end - start) / _COARSEST)))
    time = np.linspace(start, end, count + 1)
    values = field.potential_and_gradient(path(time))[1]
    while True:
        before = DisturbanceAlong(start, (end - start) / count, _panels(time, values), 0.0, 0)
        between = 0.5 * (time[1:] + time[:-1])
        found = field.potential_and_gradient(path(between))[1]
        error = float(np.abs(before.at(between) - found).max())
        both = np.empty((2 * count + 1, 3))
        both[::2], both[1::2] = values, found
        count *= 2
        time, values = np.linspace(start, end, count + 1), both
        if error <= tolerance or (end - start) / count < _FINEST:
            return DisturbanceAlong(start, (end - start) / count, _panels(time, values), error, count + 1)
