"""Size effect and delay of the accelerometers, and the null shift of laser gyros: what is the same in every run.

An accelerometer at r from the block's reference point, its sensitive axis along e, measures in addition to the force
there

    (1) e · [ω̇ × r + ω × (ω × r)]    (size effect)

and one whose readings lag the gyros' by δ gives V(t_k − δ) − V(t_(k−1) − δ), V being the integral of its force. Both
need what lies between the samples: a cubic spline through the integrals at the edges. A laser gyro takes its null shift
for a rotation. All that follows in the emulator differs from run to run; this does not, so that an ensemble needs it
once.
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu.errors import ImuErrors

_FEWEST = 4  # samples that a cubic spline needs


def what_is_felt(ideal: ImuData, errors: ImuErrors) -> ImuData:
    """Return the inputs of a block's sensors, stage 1 of `emulate`: the same in every run.

    Args:
        ideal: ideal increments at the block's reference point.
        errors: the block's errors; arms, delay, null shift and temperature are used.

    Returns:
        The increments; the ideal ones themselves if none of these errors is present.

    Raises:
        InputError: as `at_the_elements`.
    """
    felt = at_the_elements(ideal, errors.arms, errors.delay)
    if errors.null_shift is None:
        return felt
    interval = np.diff(ideal.time)
    warmth = errors.warm_up.temperature(ideal.time[:-1] + 0.5 * interval - ideal.time[0])
    return ImuData(ideal.time, ideal.dtheta + (errors.null_shift.bias(warmth) * interval)[:, None], felt.dvel)


def at_the_elements(ideal: ImuData, arms: Array, delay: float) -> ImuData:
    """Return the ideal increments of the accelerometers where and when they measure.

    Args:
        ideal: ideal increments at the block's reference point.
        arms: places of the forward, the right and the down accelerometer, (3, 3) m, a row each.
        delay: time by which their readings lag the gyros', s: they give f(t − delay) for t; negative if they lead.

    Returns:
        The increments; the gyros' are the ones given.

    Raises:
        InputError: a delay longer than an interval, or fewer samples than it takes to see between them.
    """
    if not np.any(arms) and not delay:
        return ideal
    if len(ideal) < _FEWEST:
        raise InputError(
            f"accelerometers with arms or a delay need at least {_FEWEST} samples to see between; here are "
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
                # ∫ω̇ dt is the difference over the interval; the products of rates by Simpson's rule
                pull = [np.cross(w, np.cross(w, arm))[:, i] for w in (edges[:-1], middles, edges[1:])]
                turning = np.cross(np.diff(edges, axis=0), arm)[:, i]
                dvel[:, i] += turning + (pull[0] + 4.0 * pull[1] + pull[2]) * interval / 6.0  # (1)
    if delay:
        if abs(delay) > interval.min() * (1.0 + 1e-9):  # the intervals of a table differ by rounding
            raise InputError(
                f"the accelerometers' readings lag the gyros' by {delay:g} s, more than one interval of "
                f"{interval.min():g} s."
            )
        # before the first or after the last edge the spline is continued
        dvel = np.diff(CubicSpline(time, _integral(dvel))(time - delay), axis=0)
    return ImuData(time, ideal.dtheta, dvel)


def _integral(increments: Array) -> Array:
    return np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)])
