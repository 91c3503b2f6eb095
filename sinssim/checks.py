"""Checks of input and output arrays: shapes, finite numbers, increasing times."""

from __future__ import annotations

import math

import numpy as np

from sinssim.arguments import doubles, number, vector
from sinssim.data import Array, ImuData, NavState
from sinssim.errors import InputError, shortened

GAP = 5.0
"""Ratio to the typical interval above which an interval counts as a gap with missing samples."""

_BLOCK = 65536  # rows per block, to avoid a temporary as long as the data


def first_not_finite(array: Array) -> int | None:
    """Find a NaN or an infinity.

    Args:
        array: (N, …).

    Returns:
        The first such row, None if there is none.
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

    Returns:
        Edges of the intervals, (N+1,) s, angle increments, (N, 3) rad, velocity increments, (N, 3) m/s.

    Raises:
        InputError: the arrays do not belong together, a sample is not finite, the times do not increase, or samples are
            missing; the message gives the sample and its time.
    """
    if not isinstance(imu, ImuData):
        raise InputError(f"imu must be ImuData(time, dtheta, dvel), not {shortened(repr(imu))}.")
    time, dtheta, dvel = (doubles(f"imu.{name}", getattr(imu, name)) for name in ("time", "dtheta", "dvel"))
    n = len(dtheta)
    if n < 1 or dtheta.shape != (n, 3) or dvel.shape != (n, 3) or time.shape != (n + 1,):
        raise InputError(
            f"IMU data of shapes time {time.shape}, dtheta {dtheta.shape}, dvel {dvel.shape} do not belong together: "
            "N intervals (N ≥ 1) have N+1 edges in time and (N, 3) values in dtheta and dvel."
        )
    check_finite("imu.time", time, "s")
    check_finite("imu.dtheta", dtheta, "rad", time)
    check_finite("imu.dvel", dvel, "m/s", time)
    check_increasing("imu.time", time)
    gap = longest_gap(time)
    if gap is not None:
        row, typical = gap
        raise InputError(
            f"imu.time: samples are missing for {time[row + 1] - time[row]:.6g} s from time[{row}] = "
            f"{time[row]:.9g} s on; usual intervals are {typical:.6g} s. The motion in the gap "
            "is unknown: use the part before or after the gap, or fill the gap."
        )
    return time, dtheta, dvel


def checked_imu(imu: ImuData) -> ImuData:
    """Check increments, and return them with contiguous arrays of doubles.

    Returns:
        The increments; the same object if its arrays already have this form.

    Raises:
        InputError: as for `checked_increments`.
    """
    time, dtheta, dvel = checked_increments(imu)
    if time is imu.time and dtheta is imu.dtheta and dvel is imu.dvel:
        return imu
    return ImuData(time, dtheta, dvel, imu.flags)


def longest_gap(time: Array) -> tuple[int, float] | None:
    """Find where samples are missing.

    Args:
        time: edges of intervals, increasing, (N+1,) s.

    Returns:
        Number of the longest interval and the typical length, s; None if no interval is longer than `GAP` typical ones.
    """
    steps = np.diff(time)
    longest = int(np.argmax(steps))
    if steps[longest] <= GAP * np.min(steps):
        return None
    typical = float(np.median(steps))
    return (longest, typical) if steps[longest] > GAP * typical else None


def check_finite(name: str, array: Array, unit: str, ends: Array | None = None) -> None:
    """Raise if an array holds a NaN or an infinity.

    Args:
        array: (N, …).
        ends: edges of the intervals of its rows, (N+1,) s, if the rows are intervals.

    Raises:
        InputError: the message gives the first such row and its interval.
    """
    row = first_not_finite(array)
    if row is not None:
        raise InputError(
            f"{name}[{row}] = {array[row]} {unit} is not a finite number"
            + ("." if ends is None else f" (interval ending at t = {ends[row + 1]:.6f} s).")
            + " Fill the gaps of a log before using it: every sample is needed."
        )


def check_increasing(name: str, time: Array) -> None:
    """Raise if times do not increase.

    Args:
        time: (N+1,) s, finite.

    Raises:
        InputError: the message gives the first time that is not later than the previous one.
    """
    for start in range(0, len(time) - 1, _BLOCK):
        steps = np.diff(time[start : start + _BLOCK + 1])
        if not np.min(steps) > 0.0:
            row = start + int(np.argmin(steps > 0.0))
            raise InputError(
                f"{name} must increase: time[{row}] = {time[row]:.9g} s is followed by time[{row + 1}] = "
                f"{time[row + 1]:.9g} s."
            )


def checked_initial(initial: NavState) -> tuple[float, float, float, Array, Array]:
    """Check the initial state of navigation.

    Returns:
        Latitude and longitude, rad, height, m, velocity, (3,) m/s, and attitude, (4,), of unit norm.

    Raises:
        InputError: a value has a wrong shape or is out of range; the message gives its name.
    """
    if not isinstance(initial, NavState):
        raise InputError(
            "initial must be NavState(latitude, longitude, height, velocity_ned, q_nb), not "
            f"{shortened(repr(initial))}."
        )
    values = {
        name: number(f"initial.{name}", getattr(initial, name), "rad for angles, m for height")
        for name in ("latitude", "longitude", "height")
    }
    velocity = vector("initial.velocity_ned", initial.velocity_ned, 3, "m/s")
    q = doubles("initial.q_nb", initial.q_nb)
    if q.shape != (4,) or not np.all(np.isfinite(q)) or abs(np.linalg.norm(q) - 1.0) > 1e-6:
        raise InputError(f"initial.q_nb = {q} must be a unit quaternion of four finite numbers, scalar first.")
    if abs(values["latitude"]) > math.pi / 2:
        raise InputError(f"initial.latitude = {values['latitude']} rad lies outside ±π/2; radians are expected.")
    return values["latitude"], values["longitude"], values["height"], velocity, q / np.linalg.norm(q)


def not_finite_in(height: Array, velocity: Array, q_nb: Array) -> tuple[str, int] | None:
    """Find where a solution diverges.

    Args:
        height: (N+1,) m.
        velocity: (N+1, 3) m/s.
        q_nb: (N+1, 4).

    Returns:
        The quantity and the first row at which it is not finite, None if there is no such row.
    """
    for name, array in (("height", height), ("velocity", velocity), ("attitude", q_nb)):
        row = first_not_finite(array)
        if row is not None:
            return name, row
    return None
