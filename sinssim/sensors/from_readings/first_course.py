"""The first course of a vehicle that is good enough for its heading, from velocities of satellites."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array

USUAL = 3.0
"""Speed at which a velocity with a 1σ of 0.05 m/s, as data sheets state it, gives the course to 1°, m/s."""
WORST = np.radians(10.0)
"""1σ of a course that is still used if no speed gives a better one: what the filter assumes of such a heading."""
_ROWS = 3
"""Velocities in a row that must be as fast: a single one may be an outlier."""


def first_course(time: Array, velocity: Array, sigma: Array, least: float | None = None) -> tuple[int, float] | None:
    """Return when a vehicle first moves fast enough for its course, and the 1σ of the course then.

    Args:
        time: (M,) s.
        velocity: north, east, and anything, (M, k) m/s.
        sigma: 1σ of a component, (M,) m/s.
        least: speed from which the course is used, m/s; by default `USUAL`, or if that is not reached, the speed at
            which the 1σ of the course is `WORST`.

    Returns:
        Row, and 1σ, rad; None if the vehicle does not move so fast.
    """
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    limits = [np.full(len(time), USUAL), sigma / np.tan(WORST)] if least is None else [np.full(len(time), least)]
    for limit in limits:
        fast = speed >= limit
        rows = np.flatnonzero(np.all([fast[k : len(fast) - _ROWS + 1 + k] for k in range(_ROWS)], axis=0))
        if len(time) >= _ROWS and len(rows):
            k = int(rows[0])
            return k, float(np.arctan2(sigma[k], speed[k]))
    return None
