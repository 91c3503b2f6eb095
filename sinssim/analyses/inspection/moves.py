"""Whether a vehicle moves, as the fixes show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.inspection.velocity_match import Seen
from sinssim.data import Array

SLOWEST = 0.1
"""Speed from which a vehicle moves, m/s: twice the noise of a velocity that receivers' data sheets state, 0.05 m/s."""
_SIGMAS = 3.0
_MEAN_S = 16.0
"""Longest time over which velocities of fixes are averaged to tell motion from noise, s: as long as a stop lasts."""


@dataclass(frozen=True)
class Moves:
    """The motion that fixes show.

    Attributes:
        time: on the unit's clock, (M,) s.
        speed: horizontal speed, averaged, (M,) m/s.
        limit: speed from which it is no noise, m/s.
    """

    time: Array
    speed: Array
    limit: float

    def at(self, begin: Array, end: Array) -> NDArray[np.bool_]:
        """Return whether the vehicle moves between instants, (W,); not where there are no fixes."""
        middle = 0.5 * (begin + end)
        known = (middle >= self.time[0]) & (middle <= self.time[-1])
        return np.asarray(known & (np.interp(middle, self.time, self.speed) > self.limit))


def motion_of(fixes: Seen, offset: float) -> Moves:
    """Return the motion that fixes show.

    Args:
        offset: the unit's clock minus that of the fixes, s.

    Returns:
        The speed, averaged over as many fixes as it takes to tell `SLOWEST` from their noise, which is that of the
        third differences.
    """
    from scipy.ndimage import uniform_filter1d

    velocity = fixes.relative - np.sum(fixes.relative * fixes.up, axis=1)[:, None] * fixes.up
    step = float(np.median(np.diff(fixes.time)))
    # white noise of unit variance has third differences of variance 20, and a median of |x| of 0.6745
    noise = float(np.median(np.abs(np.diff(velocity, n=3, axis=0)))) / (0.6745 * np.sqrt(20.0))
    count = int(np.clip(np.ceil((_SIGMAS * noise / SLOWEST) ** 2), 1, max(_MEAN_S / step, 1.0)))
    mean = uniform_filter1d(velocity, count, axis=0, mode="nearest")
    limit = max(SLOWEST, _SIGMAS * noise / np.sqrt(count))
    return Moves(fixes.time + offset, np.linalg.norm(mean, axis=1), float(limit))
