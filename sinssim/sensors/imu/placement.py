"""Size effect and delay of the accelerometers, and null shift of laser gyros, which are the same in every run.

An accelerometer at r from the block's reference point, with its sensitive axis along e, measures in addition to the
force at that point

    (1) e · [ω̇ × r + ω × (ω × r)]    (size effect)

An accelerometer whose readings lag the gyros' by δ measures V(t_k − δ) − V(t_(k−1) − δ), where V is the integral of its
force. Both effects need values between the samples, which a cubic spline through the integrals at the edges provides.
The null shift of a laser gyro appears as a rotation. The later stages of the emulator differ from run to run; this one
does not, so that an ensemble computes it once.
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu.errors import ImuErrors

_FEWEST = 4  # number of samples that a cubic spline needs


def what_is_felt(ideal: ImuData, errors: ImuErrors) -> ImuData:
    """Return the inputs of a block's sensors, stage 1 of `emulate`, which are the same in every run.

    Args:
        ideal: ideal increments at the block's reference point.
        errors: the block's errors; arms, delay, null shift and temperature are used.

    Returns:
        The increments; the ideal ones themselves if all of these errors are zero.

    Raises:
        InputError: as for `at_the_elements`.
    """
    felt = at_the_elements(ideal, errors.arms, errors.delay)
    if errors.null_shift is None:
        return felt
    interval = np.diff(ideal.time)
    warmth = errors.warm_up.temperature(ideal.time[:-1] + 0.5 * interval - ideal.time[0])
    return ImuData(ideal.time, ideal.dtheta + (errors.null_shift.bias(warmth) * interval)[:, None], felt.dvel)


def at_the_elements(ideal: ImuData, arms: Array, delay: float) -> ImuData:
    """Return the ideal increments of the accelerometers at their own places and times.

    Args:
        ideal: ideal increments at the block's reference point.
        arms: places of the forward, the right and the down accelerometer, (3, 3) m, one row each.
        delay: lag of their readings behind the gyros', s: the reading for t is f(t − delay); negative for a lead.

    Returns:
        The increments; those of the gyros are unchanged.

    Raises:
        InputError: the delay exceeds an interval, or there are too few samples for interpolation.
    """
    if not np.any(arms) and not delay:
        return ideal
    if len(ideal) < _FEWEST:
        raise InputError(
            f"accelerometers with arms or a delay need at least {_FEWEST} samples for interpolation; here are "
            f"{len(ideal)}."
        )
    from scipy.interpolate import CubicSpline

    time, interval = ideal.time, np.diff(ideal.time)
    dvel = ideal.dvel
    if np.any(arms):
        rate = CubicSpline(time, _integral(ideal.dtheta)).derivative()
        edges, middles = rate(time), rate(time[:-1] + 0.5 * interval)
        dvel = dvel.copy()
        for i, arm in enumerate(arms):
            if np.any(arm):
                # ∫ω̇ dt is the difference over the interval; the products of rates are integrated by Simpson's rule
                pull = [np.cross(w, np.cross(w, arm))[:, i] for w in (edges[:-1], middles, edges[1:])]
                turning = np.cross(np.diff(edges, axis=0), arm)[:, i]
                dvel[:, i] += turning + (pull[0] + 4.0 * pull[1] + pull[2]) * interval / 6.0  # (1)
    if delay:
        if abs(delay) > interval.min() * (1.0 + 1e-9):  # the intervals may differ by rounding
            raise InputError(
                f"the accelerometer data lag the gyro data by {delay:g} s, more than one interval of "
                f"{interval.min():g} s."
            )
        # the spline is extrapolated before the first and after the last edge
        dvel = np.diff(CubicSpline(time, _integral(dvel))(time - delay), axis=0)
    return ImuData(time, ideal.dtheta, dvel)


def _integral(increments: Array) -> Array:
    return np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)])
