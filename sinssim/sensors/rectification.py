"""What a bent response makes of motion within the samples: the rectification of vibration.

A sensor bends what it feels at every instant; the emulator (stage 3 of `emulate`) bends the mean over an interval. With

    n_i(x) = ½κ|x_i| + K₂x_i² + K₃x_i³ + Σ_j C_ij x_i u_j

the response's departure from a straight line, x = (I + M)u what is felt along the sensitive axes and bars for means
over the interval, the mean of n(x) is more than n(x̄). The rest is what vibration leaves as a bias: K₂σ² for one of
standard deviation σ that is fast against the samples (vibration rectification), ½ C_ij a_i a_j cos φ for two in step
(vibro-pendulous error; IEEE Std 1293, K₂, K_ip and K_io), 3K₃x̄σ² on top of a steady x̄. It enters as additional input r,
so that all later stages act on it too, by so much that the emulator makes the right reading of it:

    (1) r + n(x̄ + r) = mean n(x)
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors
from sinssim.truth.quadrature import integrate_samples
from sinssim.truth.trajectory import Trajectory

# A cube holds three times a frequency where a motion's `fastest` allows for products of two; but panels four times as
# long as those for rounding still leave no more than 1e-8 of what is rectified (and 1 % of what a corner, |x|, does).
_FASTEST = 1.5 / 4.0


def rectified(trajectory: Trajectory, ideal: ImuData, errors: ImuErrors) -> ImuData:
    """Add to ideal increments what bent responses make of motion within the samples.

    Args:
        trajectory: the true motion; one that does not say how fast it vibrates (`fastest`, rad/s) is taken to be slow
            against the samples.
        ideal: its increments.
        errors: the sensor block's errors.

    Returns:
        Increments to emulate in place of the ideal ones; the ideal ones themselves if nothing is bent or vibrates.
    """
    fastest = float(getattr(trajectory, "fastest", 0.0))
    if not fastest or not (_bends(errors.gyro) or _bends(errors.accel)):
        return ideal

    def bent(omega: Array, force: Array) -> Array:
        return np.concatenate([_bend(omega, errors.gyro), _bend(force, errors.accel)], axis=1)

    interval = np.diff(ideal.time)[:, None]
    breaks = getattr(trajectory, "breaks", ())
    both = integrate_samples(lambda t: bent(*trajectory.rates(t)), ideal.time, _FASTEST * fastest, breaks) / interval
    return ImuData(
        ideal.time,
        ideal.dtheta + _input(both[:, :3], ideal.dtheta / interval, errors.gyro) * interval,
        ideal.dvel + _input(both[:, 3:], ideal.dvel / interval, errors.accel) * interval,
    )


def _bends(triad: TriadErrors) -> bool:
    return any(np.any(term) for term in (triad.asymmetry, triad.quadratic, triad.cubic, triad.cross_axis))


def _bend(u: Array, triad: TriadErrors) -> Array:
    """Return the response's departure from a straight line, n(x), (N, 3)."""
    x = u + u @ triad.misalignment.T
    bent = 0.5 * triad.asymmetry * np.abs(x) + (triad.quadratic + triad.cubic * x) * x**2 + x * (u @ triad.cross_axis.T)
    return np.asarray(bent)


def _input(mean_of_bent: Array, mean: Array, triad: TriadErrors) -> Array:
    """Return the additional input r of (1) in the block's axes, (N, 3)."""
    untilt = np.linalg.inv(np.eye(3) + triad.misalignment).T  # x back to u
    extra = np.zeros_like(mean)
    for _ in range(3):  # each comes nearer by n′, some 1e-4
        extra = (mean_of_bent - _bend(mean + extra, triad)) @ untilt  # (1)
    return np.asarray(extra)
