"""What accelerometers anywhere on the vehicle feel along their axes, exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.truth.trajectory import Trajectory
from sinssim.truth.vibration import Vibrating


def accelerometer_increments(
    trajectory: Trajectory, position: ArrayLike, direction: ArrayLike, rate_hz: float
) -> tuple[Array, Array]:
    """Return the ideal velocity increments of single accelerometers on lever arms.

    Args:
        trajectory: motion of the vehicle's reference point.
        position: of each accelerometer from the reference point, in the trajectory's axes, (K, 3) m.
        direction: of its sensitive axis, unit vectors, (K, 3).
        rate_hz: samples per second.

    Returns:
        Edges of the intervals (N+1,) s and the integrals of the specific force along each axis, (N, K) m/s.

    Raises:
        InputError: positions and directions of different number, or what `Trajectory.increments` refuses.
    """
    places, axes = np.asarray(position, dtype=np.float64), np.asarray(direction, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or axes.shape != places.shape or not len(places):
        raise InputError(
            f"accelerometers need (K, 3) positions and as many directions, K ≥ 1; got arrays of shapes {places.shape} "
            f"and {axes.shape}."
        )
    columns = []
    for place, axis in zip(places, axes, strict=True):
        imu = Vibrating(trajectory, lever_arm=place).increments(rate_hz)
        columns.append(imu.dvel @ axis)
    return imu.time, np.stack(columns, axis=1)
