"""What σ of a single sensor's summed readings includes: every error that a scenario's [imu] states.

Over a window of length T that starts at t₀, one sensor's sum of increments has the variance

    s² = N²T + Q²/6 + 2σ_b²τ(T − τ(1 − e^(−T/τ))) + B² T² var + K²(t₀T² + T³/3) + Σ_k (σ_k Δφ_k)²

The first terms are noise: random walk N, two roundings to the quantum Q, instability, flicker (with the variance of a
mean of flicker) and rate random walk. The last ones are the errors that are constant in a run: each is the product of a
number drawn with σ_k and of a known input Δφ_k, for example T for the bias, the accumulated angle along the sensitive
axis for the scale factor, and those along two axes perpendicular to it for the misalignment. They follow from the
least-squares estimate of the motion, because the true motion is not known to the monitor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sinssim.data import Array
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.imu.terms import CORRELATION_TIME
from sinssim.sensors.noise.flicker import variance_of_mean
from sinssim.sensors.sets.combination import axes_of_values
from sinssim.sensors.sets.geometry import along

_ROUNDING = 1e-12
"""1σ of the arithmetic's rounding, relative to the largest increment; without any error it is all there is."""


@dataclass(frozen=True)
class Inputs:
    """What acts on the sensors of one kind, as the set itself estimates it.

    Attributes:
        start: time of the edges since the first one, (N+1,) s.
        own: increments of what the sensors measure, (N, 3) rad or m/s.
        force: velocity increments, (N, 3) m/s.
    """

    start: Array
    own: Array
    force: Array


def accumulated_inputs(imu: Imu, kind: str, directions: Array, inputs: Inputs) -> tuple[Array, Array]:
    """Return the inputs of the errors that are constant in a run, and their 1σ.

    Args:
        kind: "gyro" or "accel".
        directions: sensitive axes, (m, 3).

    Returns:
        Accumulated inputs, (N+1, B), and coefficients, (K, m, B): the K-th error of sensor i over a window is normal
        with the standard deviation |Σ_b coefficients_kib Δ inputs_b|.
    """
    found: list[Array] = []
    features: list[tuple[int, Array]] = []
    for term, sigma in getattr(imu.sigma, kind).acting:
        for columns, coefficients in _features(term, imu, directions, inputs):
            same = [n for n, other in enumerate(found) if np.array_equal(other, columns)]
            found += [] if same else [columns]
            features.append((same[0] if same else len(found) - 1, float(np.max(sigma)) * coefficients))
    ends = np.cumsum([0, *(columns.shape[1] for columns in found)])
    place = [slice(*pair) for pair in pairwise(ends)]
    base = np.zeros((len(inputs.start), ends[-1]))
    for columns, where in zip(found, place, strict=True):
        np.cumsum(columns, axis=0, out=base[1:, where])
    matrix = np.zeros((len(features), len(directions), ends[-1]))
    for number, (which, coefficients) in enumerate(features):
        matrix[number, :, place[which]] = coefficients
    return base, matrix


def _features(term: ErrorTerm, imu: Imu, directions: Array, inputs: Inputs) -> Iterator[tuple[Array, Array]]:
    """Yield the inputs of each value that one sensor has of an error: increments (N, c), and factors (m, c)."""
    assert term.multiplies is not None
    dt = np.diff(inputs.start)[:, np.newaxis]
    middle = inputs.start[:-1, np.newaxis] + 0.5 * dt
    warmth = imu.warm_up.temperature(middle)
    for axes in axes_of_values(directions, term.size):
        if term.slopes is None:
            own, across, force = along(inputs.own, directions), along(inputs.own, axes), along(inputs.force, axes)
            yield dt * term.multiplies(own / dt, across / dt, force / dt, warmth, middle), np.eye(len(axes))
            continue
        motions = (dt, inputs.own, inputs.own, inputs.force)
        towards = (np.ones((len(axes), 1)), directions, axes, axes)
        for slope, factor, motion, rows in zip(
            term.slopes, term.factors(warmth, middle), motions, towards, strict=True
        ):
            if slope:
                yield factor * motion, rows


def noise_variance(imu: Imu, kind: str, counts: Array, largest: float) -> Array:
    """Return the variance of the noise of one sensor's readings, summed over windows.

    Args:
        kind: "gyro" or "accel".
        counts: samples of each window, (W,).
        largest: largest increment of a sensor, rad or m/s, for the rounding of the arithmetic.

    Returns:
        Variance of a window at the start, and its growth per second of a later start, (W, 2).
    """
    own: TriadErrors = getattr(imu.sigma, kind)
    span = counts / imu.rate_hz
    variance = own.random_walk**2 * span + own.quantum**2 / 6.0
    tau = own.correlation_time or CORRELATION_TIME
    variance = variance + 2.0 * own.instability**2 * tau * (span + tau * np.expm1(-span / tau))
    variance = variance + own.flicker**2 * span**2 * variance_of_mean(counts)
    variance = variance + own.rate_walk**2 * span**3 / 3.0
    variance = variance + (_ROUNDING * max(largest, 1e-30)) ** 2 * counts
    return np.column_stack((variance, own.rate_walk**2 * span**2))
