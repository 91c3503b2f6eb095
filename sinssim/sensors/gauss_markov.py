"""First-order Gauss-Markov process: its values at instants and its means over intervals."""

from __future__ import annotations

import math

import numpy as np

from sinssim.data import Array
from sinssim.jit import strict_inline, strict_kernel

_SERIES = 0.02  # T/τ below which the truncated power series are exact to rounding


@strict_kernel
def gauss_markov(interval: Array, correlation_time: float, white: Array) -> Array:
    """Convert white noise to a stationary process of the same variance with an exponential autocorrelation.

    The step is exact for any interval: b ← d b + √(1 − d²) w with d = exp(−T/τ) (Brown and Hwang, Introduction to
    Random Signals and Applied Kalman Filtering, section 5.3). The first value has the stationary variance.

    Args:
        interval: lengths of the intervals, (N,) s.
        correlation_time: τ, s.
        white: independent normal numbers with the process's standard deviation, (N+1,).

    Returns:
        The process at the edges of the intervals, (N+1,).
    """
    process = np.empty_like(white)
    value = white[0]
    process[0] = value
    for k in range(len(interval)):
        decay = math.exp(-interval[k] / correlation_time)
        fresh = math.sqrt(-math.expm1(-2.0 * interval[k] / correlation_time))
        value = decay * value + fresh * white[k + 1]
        process[k + 1] = value
    return process


@strict_inline
def lost(x: float) -> float:
    """Return 1 − e^−x, x ≥ 0, to rounding without a library's exponential, by 1 − e^−2x = (1 − e^−x)(1 + e^−x)."""
    halvings = 0
    while x > _SERIES:
        x *= 0.5
        halvings += 1
    y = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0))))))
    for _ in range(halvings):
        y *= 2.0 - y
    return y


@strict_inline
def mean_step(x: float) -> tuple[float, float, float, float]:
    """Return the coefficients of a recursion whose outputs are distributed as the process's means over intervals.

    The means m_k of a process of variance 1 over equal intervals T = xτ have the variance V = 2(x − 1 + d)/x² and the
    covariances C d^(j−1) with C = (1 − d)²/x², d = e^−x. One normal number ν_k per step suffices for these:

        m_k = e s_(k−1) + g ν_k,   s_k = d s_(k−1) + q ν_k,   q = √(1 − d²),   s_0 normal of variance 1,

    if e² + g² = V and e (d e + q g) = C. With d = cos φ, q = sin φ, e = √V cos θ, g = √V sin θ the second condition
    reads cos φ + cos(2θ − φ) = 2C/V.

    Args:
        x: T/τ, length of the interval over correlation time.
    """
    fresh = lost(x)  # 1 − d
    d = 1.0 - fresh
    q = math.sqrt(fresh * (1.0 + d))
    if x < _SERIES:
        v = 1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0)))))
    else:
        v = 2.0 * (x - fresh) / (x * x)
    share = fresh / x  # C = share²
    delta = ((1.0 + d) * v - 2.0 * share * share) / v  # 1 − cos(2θ − φ)
    sine = math.sqrt(delta * (2.0 - delta))
    below = 0.5 * (fresh + d * delta + q * sine)  # sin²θ = (1 − cos 2θ)/2
    return d, q, math.sqrt(v * (1.0 - below)), math.sqrt(v * below)
