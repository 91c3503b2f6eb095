"""Checks of increments before anything is computed from them: shapes, finite numbers, the order of time."""

from __future__ import annotations

import math

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError

_BLOCK = 65536  # rows looked at together, so that no temporary is as long as the data


def first_not_finite(array: Array) -> int | None:
    """Find a NaN or an infinity.

    Args:
        array: (N, …).

    Returns:
        The first row that holds one, None if there is none.
    """
    for start in range(0, len(array), _BLOCK):
        block = array[start : start + _BLOCK]
        with np.errstate(invalid="ignore", over="ignore"):  # +∞ and −∞ in one block, or sums beyond the range
            total = float(np.sum(block))
        if not math.isfinite(total) and not np.all(np.isfinite(block)):
            finite = np.isfinite(block).reshape(len(block), -1).all(axis=1)
            return start + int(np.argmin(finite))
    return None


def checked_increments(imu: ImuData) -> tuple[Array, Array, Array]:
    """Check increments, and return them as contiguous arrays of doubles.

    Args:
        imu: the increments.

    Returns:
        Edges of the intervals, (N+1,) s, angle increments, (N, 3) rad, velocity increments, (N, 3) m/s.

    Raises:
        InputError: arrays that do not belong together, a sample that is not a finite number, times that do not
            increase; the message names the sample and its time.
    """
    time, dtheta, dvel = (np.ascontiguousarray(a, dtype=np.float64) for a in (imu.time, imu.dtheta, imu.dvel))
    n = len(dtheta)
    if n < 1 or dtheta.shape != (n, 3) or dvel.shape != (n, 3) or time.shape != (n + 1,):
        raise InputError(
            f"IMU data of shapes time {time.shape}, dtheta {dtheta.shape}, dvel {dvel.shape} do not belong together: "
            "N intervals (N ≥ 1) have N+1 edges in time and (N, 3) values in dtheta and dvel."
        )
    for name, array, unit in (("time", time, "s"), ("dtheta", dtheta, "rad"), ("dvel", dvel, "m/s")):
        row = first_not_finite(array)
        if row is not None:
            raise InputError(
                f"imu.{name}[{row}] = {array[row]} {unit} is not a finite number"
                + ("." if name == "time" else f" (interval ending at t = {time[row + 1]:.6f} s).")
                + " Gaps in a log must be closed before it is used: every increment is needed."
            )
    for start in range(0, n, _BLOCK):
        steps = np.diff(time[start : start + _BLOCK + 1])
        if not np.min(steps) > 0.0:
            row = start + int(np.argmin(steps > 0.0))
            raise InputError(
                f"imu.time must increase: time[{row}] = {time[row]:.9g} s is followed by time[{row + 1}] = "
                f"{time[row + 1]:.9g} s."
            )
    return time, dtheta, dvel
