"""Size effect and delay of accelerometers, null shift of laser gyros, and rectification of motion within a sample.

An accelerometer at r from the block's reference point, with its sensitive axis along e, measures in addition to the
force at that point

    (1) e · [ω̇ × r + ω × (ω × r)]    (size effect)

An accelerometer whose readings lag the gyros' by δ measures V(t_k − δ) − V(t_(k−1) − δ), where V is the integral of its
force. Both effects need values between the samples, which a cubic spline through the integrals at the edges provides.
The null shift of a laser gyro appears as a rotation. The later stages of the emulator differ from run to run; this one
does not, so that an ensemble computes it once.

The response of a sensor is non-linear at every instant, but the emulator (stage 3 of `emulate`) applies it to the mean
over an interval. Let

    n_i(x) = ½κ|x_i| + K₂x_i² + K₃x_i³ + Σ_j C_ij x_i u_j

be the departure of the response from a straight line, x = (I + M)u the input along the sensitive axes, and bars means
over the interval. The mean of n(x) differs from n(x̄) by a bias due to vibration: K₂σ² for a vibration of standard
deviation σ that is fast compared with the samples (vibration rectification), ½ C_ij a_i a_j cos φ for two synchronous
vibrations (vibro-pendulous error; IEEE Std 1293, K₂, K_ip and K_io), 3K₃x̄σ² in addition to a steady x̄. The bias
enters as an additional input r, so that all later stages act on it too. Its size is such that the emulator obtains the
right reading:

    (2) r + n(x̄ + r) = mean n(x)

Likewise an accelerometer at its own place r_i senses the block's rotation at every instant, whereas the emulator (stage
1) uses the rotation interpolated between the samples. Rotations of the amplitude φ at Ω cause −½(φΩ)² r_i along the
arm, however fast they are. The exact force replaces the interpolated one:

    (3) ∫ω̇ dt × r_i + ∫ω × (ω × r_i) dt,    ∫ω̇ dt the difference of ω over the interval
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.truth.sampling import integrate_samples
from sinssim.truth.trajectory import Trajectory

_FEWEST = 4  # number of samples that a cubic spline needs


def what_is_felt(ideal: ImuData, errors: ImuErrors) -> ImuData:
    """Return the inputs of a block's sensors, stage 1 of `emulate`, which are the same in every run, from the ideal
    increments at its reference point and its arms, delay, null shift and temperature: the ideal ones themselves if all
    of these errors are zero."""
    felt = at_the_elements(ideal, errors.arms, errors.delay)
    if errors.null_shift is None:
        return felt
    interval = np.diff(ideal.time)
    warmth = errors.warm_up.temperature(ideal.time[:-1] + 0.5 * interval - ideal.time[0])
    return ImuData(ideal.time, ideal.dtheta + (errors.null_shift.bias(warmth) * interval)[:, None], felt.dvel)


def at_the_elements(ideal: ImuData, arms: Array, delay: float) -> ImuData:
    """Return the ideal increments of the accelerometers at their own places and times; those of the gyros are
    unchanged. The arms are the places of the forward, the right and the down accelerometer, (3, 3) m, one row each; the
    delay is the lag of their readings behind the gyros', s: the reading for t is f(t − delay); negative for a lead."""
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


# A cube contains three times a frequency, whereas a motion's `fastest` allows for products of two. But even panels six
# times as long as those for rounding leave an error of at most 6e-6 of the rectification (and 1 % of that by the corner
# of |x|).
_FASTEST = 1.5 / 6.0


def rectified(trajectory: Trajectory, ideal: ImuData, errors: ImuErrors) -> ImuData:
    """Add the effects of motion within the samples: rectification by non-linear responses, and the size effect.

    Args:
        trajectory: the true motion; if it lacks its highest frequency (`fastest`, rad/s), it is assumed to be slow
            compared with the samples.
        errors: the sensor block's errors.

    Returns:
        Increments that replace the ideal ones in the emulator; the ideal ones themselves without vibration, or without
        non-linear terms and arms.
    """
    fastest = float(getattr(trajectory, "fastest", 0.0))
    bends = (*errors.gyro.acting, *errors.accel.acting)
    bent, armed = any(term.slopes is None for term, _ in bends), bool(np.any(errors.arms))
    if not fastest or not (bent or armed):
        return ideal

    def felt(t: Array) -> Array:
        omega, force = trajectory.rates(t)
        since, inputs = t - ideal.time[0], (("gyro", omega), ("accel", force)) if bent else ()
        parts = [_bend(name, errors, x, force, since) for name, x in inputs]
        if armed:
            pulls = [np.cross(omega, np.cross(omega, arm))[:, i] for i, arm in enumerate(errors.arms)]
            parts.append(np.stack(pulls, axis=1))
        return np.concatenate(parts, axis=1)

    breaks = getattr(trajectory, "breaks", ())
    sums = integrate_samples(felt, ideal.time, _FASTEST * fastest, breaks, 6 * bent + 3 * armed)
    dtheta, dvel = ideal.dtheta, ideal.dvel
    if bent:
        interval = np.diff(ideal.time)[:, None]
        means, force = sums[:, :6] / interval, ideal.dvel / interval
        middle = 0.5 * (ideal.time[1:] + ideal.time[:-1]) - ideal.time[0]
        dtheta = dtheta + _input("gyro", errors, means[:, :3], ideal.dtheta / interval, force, middle) * interval
        dvel = dvel + _input("accel", errors, means[:, 3:], force, force, middle) * interval
    if armed:
        turned = np.diff(trajectory.rates(ideal.time)[0], axis=0)
        exact = (
            np.stack([np.cross(turned, arm)[:, i] for i, arm in enumerate(errors.arms)], axis=1) + sums[:, -3:]
        )  # (3)
        dvel = dvel + exact - (at_the_elements(ideal, errors.arms, 0.0).dvel - ideal.dvel)
    return ImuData(ideal.time, dtheta, dvel)


def _bend(name: str, errors: ImuErrors, u: Array, force: Array, time: Array) -> Array:
    """Return the part of the readings of a triad that is not linear in the inputs, n(x), (N, 3)."""
    terms, warmth = getattr(errors, name).acting, errors.warm_up.temperature(time)
    x = sum((term.effect(value, u, force, warmth, time) for term, value in terms if term.acts_on == "axis"), u)
    bent = (term.effect(value, u, force, warmth, time, sensed=x) for term, value in terms if term.slopes is None)
    return sum(bent, np.zeros_like(u))


def _input(name: str, errors: ImuErrors, mean_of_bent: Array, mean: Array, force: Array, time: Array) -> Array:
    """Return the additional input r of (2) in the block's axes, (N, 3)."""
    triad: TriadErrors = getattr(errors, name)
    untilt = np.linalg.inv(np.eye(3) + triad.misalignment).T  # convert x back to u
    extra = np.zeros_like(mean)
    for _ in range(3):  # each iteration reduces the error by n′, about 1e-4
        extra = (mean_of_bent - _bend(name, errors, mean + extra, force, time)) @ untilt  # (2)
    return np.asarray(extra)
