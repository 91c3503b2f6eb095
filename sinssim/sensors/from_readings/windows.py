"""Means and variances of inertial readings over windows of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError


@dataclass(frozen=True)
class Windows:
    """Means and variances of rates and specific forces over windows.

    Attributes:
        begin, end: of each window, (W,) s.
        mean: gyros, then accelerometers, (W, 6) rad/s and m/s².
        variance: of the readings about their mean, (W, 6).
        change: mean of the second half less that of the first, (W, 6).
    """

    begin: Array
    end: Array
    mean: Array
    variance: Array
    change: Array


def windows_of(imu: ImuData, length_s: float, step_s: float) -> Windows:
    """Return means and variances over overlapping windows.

    Args:
        length_s: length of a window, s.
        step_s: time from the end of one to the end of the next, s.

    Raises:
        InputError: the data are shorter than a window, or a window has fewer than 8 samples.
    """
    steps = np.diff(imu.time)
    interval = float(np.mean(steps))
    count, step = round(length_s / interval), max(round(step_s / interval), 1)
    if count < 8 or count > len(steps):
        raise InputError(
            f"a window of {length_s:g} s needs at least 8 samples and no more than there are: the data have "
            f"{len(steps)} samples of {interval:.3g} s."
        )
    rate = np.concatenate([imu.dtheta, imu.dvel], axis=1) / steps[:, None]
    offset = rate.mean(axis=0)
    rate -= offset
    none = np.zeros((1, 6))
    sums = np.concatenate([none, np.cumsum(rate, axis=0)])
    squares = np.concatenate([none, np.cumsum(rate * rate, axis=0)])
    last = np.arange(count, len(steps) + 1, step)
    mean = (sums[last] - sums[last - count]) / count
    variance = (squares[last] - squares[last - count]) / count - mean * mean
    half = count // 2
    change = (sums[last] - sums[last - half] - (sums[last - count + half] - sums[last - count])) / half
    return Windows(imu.time[last - count], imu.time[last], mean + offset, np.maximum(variance, 0.0), change)
