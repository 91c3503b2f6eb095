"""Exact specific force at points on lever arms."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.truth.motions.vibrating import Vibrating
from sinssim.truth.trajectory import Trajectory


def velocity_increments(trajectory: Trajectory, position: ArrayLike, rate_hz: float) -> tuple[Array, Array]:
    """Return the integrals of the specific force at points on lever arms.

    Args:
        trajectory: motion of the vehicle's reference point.
        position: position of each point from the reference point, in the trajectory's axes, (K, 3) m.

    Returns:
        Edges of the intervals (N+1,) s and the integrals in the trajectory's axes, (N, K, 3) m/s.

    Raises:
        InputError: the positions have a wrong shape or are not finite, or as for `Trajectory.increments`.
    """
    places = np.asarray(position, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or not len(places) or not np.isfinite(places).all():
        raise InputError(f"accelerometers need (K, 3) finite positions, K ≥ 1; got an array of shape {places.shape}.")
    each = [Vibrating(trajectory, lever_arm=place).increments(rate_hz) for place in places]
    return each[0].time, np.stack([imu.dvel for imu in each], axis=1)
