"""Noise of inertial sensors made in plain NumPy, each term exactly as it is defined, with nothing of the package.

Increments are integrals of the rate over intervals of length `interval`. Everything is exact in distribution: the
integrals of the walk and of the Gauss-Markov process are drawn jointly with the process at the edges, the flicker from
its covariance (circulant embedding).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def random_walk(rng: np.random.Generator, count: int, interval: float, coefficient: float) -> Array:
    """White noise of the rate: increments of variance N²T."""
    return coefficient * np.sqrt(interval) * rng.standard_normal(count)


def quantised(rng: np.random.Generator, increments: Array, pulse: float) -> Array:
    """The accumulated angle rounded to whole pulses, from a random start in the first one."""
    angle = rng.random() * pulse + np.concatenate([[0.0], np.cumsum(increments)])
    return np.diff(np.floor(angle / pulse)) * pulse


def rounding(rng: np.random.Generator, count: int, interval: float, coefficient: float) -> Array:
    """What independent rounding errors of the angle, uniform with the standard deviation Q, make of the increments."""
    return np.diff(np.sqrt(12.0) * coefficient * (rng.random(count + 1) - 0.5))


def rate_walk(rng: np.random.Generator, count: int, interval: float, coefficient: float) -> Array:
    """Integrals of a Wiener process: the trapezoid of its values at the edges, and what the bridge between them adds.

    The integral of a Brownian bridge over T has the variance T³/12.
    """
    edges = np.concatenate([[0.0], np.cumsum(np.sqrt(interval) * rng.standard_normal(count))])
    bridge = np.sqrt(interval**3 / 12.0) * rng.standard_normal(count)
    return coefficient * (0.5 * interval * (edges[1:] + edges[:-1]) + bridge)


def gauss_markov(
    rng: np.random.Generator, count: int, interval: float, coefficient: float, correlation_time: float
) -> Array:
    """Integrals of a stationary Ornstein-Uhlenbeck process, by the joint normal law of its step and its integral."""
    x = interval / correlation_time
    decay, t = np.exp(-x), correlation_time
    # of the process's noise over a step and of its integral, for unit stationary variance
    step = -np.expm1(-2.0 * x)
    both = t * np.expm1(-x) ** 2
    integral = t**2 * (2.0 * x - 3.0 + 4.0 * decay - decay**2) if x > 1e-2 else 2.0 / 3.0 * t**2 * x**3 * (1 - 0.75 * x)
    w = rng.standard_normal((2, count))
    noise = np.sqrt(step) * w[0]
    from scipy.signal import lfilter

    first = rng.standard_normal()
    after, _ = lfilter([1.0], [1.0, -decay], noise, zi=[decay * first])
    before = np.concatenate([[first], after[:-1]])
    own = both / np.sqrt(step) * w[0] + np.sqrt(integral - both**2 / step) * w[1]
    return coefficient * (-t * np.expm1(-x) * before + own)


def flicker(rng: np.random.Generator, count: int, interval: float, coefficient: float) -> Array:
    """Means of 1/f noise, S(f) = B²/(2πf) on both sides, times the interval; its own mean is left undetermined.

    The covariance of such noise is −(B²/π) ln|t| up to an infinite constant; that of means over intervals is the second
    difference of its double integral. A constant changes the mean of a record only.
    """
    j = np.arange(0.0, 1000.0)
    double = np.zeros(len(j) + 1)
    k = np.arange(1.0, len(j) + 1.0)
    double[1:] = -(0.5 * k**2 * np.log(k) - 0.75 * k**2)
    lags = np.empty(count + 1)
    near = min(len(j), count + 1)
    lags[:near] = (double[1:] - 2.0 * double[:-1] + np.concatenate([[double[1]], double[:-2]]))[:near]
    far = np.arange(near, count + 1.0)
    lags[near:] = -np.log(far) + 1.0 / (12.0 * far**2)
    spectrum = np.fft.rfft(np.concatenate([lags, lags[-2:0:-1]])).real
    spectrum[0] = 0.0
    assert spectrum[1:].min() > 0.0
    size = 2 * count
    white = rng.standard_normal(len(spectrum)) + 1j * rng.standard_normal(len(spectrum))
    white[-1] = np.sqrt(2.0) * white[-1].real
    return coefficient * interval / np.sqrt(np.pi) * np.fft.irfft(white * np.sqrt(0.5 * size * spectrum), size)[:count]


def ramp(count: int, interval: float, coefficient: float) -> Array:
    """Integrals of the rate R t."""
    return coefficient * interval**2 * (np.arange(count) + 0.5)


def everything(rng: np.random.Generator, count: int, interval: float, truth: dict[str, float]) -> Array:
    """All terms that are named in `truth`: Q, N, B, K, R, sigma_b (with tau_b)."""
    total = np.zeros(count)
    for symbol, make in (("Q", rounding), ("N", random_walk), ("B", flicker), ("K", rate_walk)):
        if truth.get(symbol, 0.0):
            total += make(rng, count, interval, truth[symbol])
    if truth.get("R", 0.0):
        total += ramp(count, interval, truth["R"])
    if truth.get("sigma_b", 0.0):
        total += gauss_markov(rng, count, interval, truth["sigma_b"], truth["tau_b"])
    return total
