"""Effects of motion within a sample: rectification of vibration, and size effect of the accelerometers.

A sensor's response is non-linear at every instant; the emulator (stage 3 of `emulate`) applies it to the mean over an
interval. With

    n_i(x) = ½κ|x_i| + K₂x_i² + K₃x_i³ + Σ_j C_ij x_i u_j

the response's departure from a straight line, x = (I + M)u what is felt along the sensitive axes and bars for means
over the interval, the mean of n(x) is more than n(x̄). The rest is what vibration leaves as a bias: K₂σ² for one of
standard deviation σ that is fast against the samples (vibration rectification), ½ C_ij a_i a_j cos φ for two in step
(vibro-pendulous error; IEEE Std 1293, K₂, K_ip and K_io), 3K₃x̄σ² on top of a steady x̄. It enters as additional input r,
so that all later stages act on it too, by so much that the emulator makes the right reading of it:

    (1) r + n(x̄ + r) = mean n(x)

Likewise an accelerometer at its own place r_i feels the block's rotation at every instant, and the emulator (stage 1)
only what a curve through the samples shows of it. Turns of the amplitude φ at Ω leave −½(φΩ)² r_i along the arm,
however fast they are. The exact force takes the place of the curve's:

    (2) ∫ω̇ dt × r_i + ∫ω × (ω × r_i) dt,    ∫ω̇ dt the difference of ω over the interval
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.sensors.imu.errors import ImuErrors, TriadErrors
from sinssim.sensors.imu.placement import at_the_elements
from sinssim.sensors.imu.terms import FIELDS, SLOTS, non_linearity
from sinssim.truth.motions.quadrature import integrate_samples
from sinssim.truth.trajectory import Trajectory

# A cube holds three times a frequency where a motion's `fastest` allows for products of two; but panels six times as
# long as those for rounding still leave no more than 6e-6 of what is rectified (and 1 % of what a corner, |x|, does).
_FASTEST = 1.5 / 6.0


def rectified(trajectory: Trajectory, ideal: ImuData, errors: ImuErrors) -> ImuData:
    """Add the effects of motion within the samples: rectification by non-linear responses, and the size effect.

    Args:
        trajectory: the true motion; without its highest frequency (`fastest`, rad/s) it is taken to be slow compared
            with the samples.
        ideal: its increments.
        errors: the sensor block's errors.

    Returns:
        Increments to emulate in place of the ideal ones; the ideal ones themselves without vibration, or without
        non-linear terms and arms.
    """
    fastest = float(getattr(trajectory, "fastest", 0.0))
    bent, armed = _bends(errors.gyro) or _bends(errors.accel), bool(np.any(errors.arms))
    if not fastest or not (bent or armed):
        return ideal

    def felt(t: Array) -> Array:
        omega, force = trajectory.rates(t)
        parts = [_bend(omega, errors.gyro), _bend(force, errors.accel)] if bent else []
        if armed:
            pulls = [np.cross(omega, np.cross(omega, arm))[:, i] for i, arm in enumerate(errors.arms)]
            parts.append(np.stack(pulls, axis=1))
        return np.concatenate(parts, axis=1)

    breaks = getattr(trajectory, "breaks", ())
    sums = integrate_samples(felt, ideal.time, _FASTEST * fastest, breaks, 6 * bent + 3 * armed)
    dtheta, dvel = ideal.dtheta, ideal.dvel
    if bent:
        interval = np.diff(ideal.time)[:, None]
        means = sums[:, :6] / interval
        dtheta = dtheta + _input(means[:, :3], ideal.dtheta / interval, errors.gyro) * interval
        dvel = dvel + _input(means[:, 3:], ideal.dvel / interval, errors.accel) * interval
    if armed:
        turned = np.diff(trajectory.rates(ideal.time)[0], axis=0)
        exact = (
            np.stack([np.cross(turned, arm)[:, i] for i, arm in enumerate(errors.arms)], axis=1) + sums[:, -3:]
        )  # (2)
        dvel = dvel + exact - (at_the_elements(ideal, errors.arms, 0.0).dvel - ideal.dvel)
    return ImuData(ideal.time, dtheta, dvel)


def _bends(triad: TriadErrors) -> bool:
    return any(np.any(getattr(triad, name)) for name in SLOTS if FIELDS[name].stage == "BENT")


def _bend(u: Array, triad: TriadErrors) -> Array:
    """Return the response's departure from a straight line, n(x), (N, 3)."""
    x = u + u @ triad.misalignment.T
    bent = non_linearity(x, x, triad.asymmetry, triad.quadratic, triad.cubic)
    return np.asarray(bent + x * (u @ triad.cross_axis.T))


def _input(mean_of_bent: Array, mean: Array, triad: TriadErrors) -> Array:
    """Return the additional input r of (1) in the block's axes, (N, 3)."""
    untilt = np.linalg.inv(np.eye(3) + triad.misalignment).T  # x back to u
    extra = np.zeros_like(mean)
    for _ in range(3):  # each comes nearer by n′, some 1e-4
        extra = (mean_of_bent - _bend(mean + extra, triad)) @ untilt  # (1)
    return np.asarray(extra)
