"""Identical samples for every algorithm: those of a lower rate are sums of those of the highest."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData


def first_seconds(imu: ImuData, duration: float) -> ImuData:
    """Return the beginning of some increments.

    Args:
        imu: increments, N intervals.
        duration: how much to keep, s.

    Returns:
        The intervals that end within it.
    """
    count = int(np.searchsorted(imu.time, imu.time[0] + duration + 1e-9, side="right")) - 1
    return ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])


def sums(rows: Array, ratio: int) -> Array:
    """Return the increments of a lower rate: each is the sum of `ratio` consecutive ones.

    A gyro or accelerometer that is read less often counts the same pulses. So noise, quantisation and everything
    else in the samples is the same at every rate, and only the algorithm sees less of the motion within them.

    Args:
        rows: increments, (N, k).
        ratio: how many are summed.

    Returns:
        (N // ratio, k); a rest at the end is dropped.
    """
    if ratio == 1:
        return rows
    count = len(rows) // ratio
    return np.asarray(rows[: count * ratio].reshape(count, ratio, -1).sum(axis=1))
