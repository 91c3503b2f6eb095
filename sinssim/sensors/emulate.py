"""From ideal increments to measured ones.

Per triad, over an interval of length T, in this order (equation (2) on increments, with what stands on top of it):

    Δβ̃ = (1 + k)(x + K₂x² + K₃x³) T + (ω₀ + b(t)) T + N √T ν,   x = (I + M) Δβ / T,
    then Δβ̃ ← differences of round(Σ Δβ̃ / Q) Q

with the scale-factor errors k, the non-linearity K₂, K₃, the misalignment M of the sensitive axes, the turn-on bias ω₀,
the bias instability b(t), the random walk N, white noise ν of unit variance, and the pulse weight Q. The non-linearity
acts on the interval's mean rate x: what it rectifies of vibration faster than the samples is not in it.
"""

from __future__ import annotations

import numpy as np

from sinssim.checks import checked_increments
from sinssim.data import Array, ImuData
from sinssim.scenario.imu import ImuSection
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw, term_generator


def emulate(ideal: ImuData, spec: ImuSection | ImuErrors, seed: int = 0) -> ImuData:
    """Return what a sensor block with errors gives in place of the ideal increments.

    Args:
        ideal: error-free increments.
        spec: the [imu] section of a scenario, from which this run's errors are drawn, or the errors themselves.
        seed: the run's seed. Every axis of every term has a generator of its own, so that the draws of one term
            do not depend on which others are switched on.

    Returns:
        Measured increments on the same times; where nothing is wrong, the ideal arrays themselves.

    Raises:
        InputError: an array has the wrong shape, a sample is not finite, or the times are not in order.
    """
    checked_increments(ideal)
    errors = draw(spec, seed) if isinstance(spec, ImuSection) else spec
    interval = np.diff(ideal.time)
    return ImuData(
        ideal.time,
        _measure(ideal.dtheta, interval, errors.gyro, "gyro", seed),
        _measure(ideal.dvel, interval, errors.accel, "accel", seed),
    )


def _measure(ideal: Array, interval: Array, errors: TriadErrors, triad: str, seed: int) -> Array:
    if not (
        np.any(errors.bias)
        or np.any(errors.scale)
        or np.any(errors.misalignment)
        or np.any(errors.quadratic)
        or np.any(errors.cubic)
        or errors.random_walk
        or errors.quantum
        or errors.instability
    ):
        return ideal
    measured = np.empty_like(ideal)
    for i in range(3):
        # The whole axis at once in one contiguous column; no matrix product, whose rounding depends on the machine.
        axis = ideal[:, i].copy()
        for j in range(3):
            if errors.misalignment[i, j]:
                axis += errors.misalignment[i, j] * ideal[:, j]
        if errors.quadratic[i] or errors.cubic[i]:
            mean = axis / interval
            axis += mean * (errors.quadratic[i] + errors.cubic[i] * mean) * axis
        axis *= 1.0 + errors.scale[i]
        axis += errors.bias[i] * interval  # (2)
        if errors.instability:
            axis += _instability(interval, errors, term_generator(seed, f"{triad} instability", i))
        if errors.random_walk:
            white = term_generator(seed, f"{triad} random walk", i).standard_normal(len(interval))
            axis += errors.random_walk * np.sqrt(interval) * white
        if errors.quantum:
            # Whole pulses of the accumulated sum: the remainder stays in the counter, so nothing is lost.
            axis = np.diff(np.rint(np.cumsum(axis) / errors.quantum), prepend=0.0) * errors.quantum
        measured[:, i] = axis
    return measured


def _instability(interval: Array, errors: TriadErrors, generator: np.random.Generator) -> Array:
    """Return the integral of a stationary first-order Gauss-Markov bias over each interval, (N,)."""
    from sinssim.sensors.gauss_markov import gauss_markov

    bias = gauss_markov(
        interval,
        errors.correlation_time,
        errors.instability * generator.standard_normal(len(interval) + 1),
    )
    # Trapezoid: the expected integral between two known values of the process, to (T/τ)²/12 of itself.
    return 0.5 * (bias[:-1] + bias[1:]) * interval
