"""First-order Gauss-Markov process on any sequence of intervals."""

from __future__ import annotations

import math

import numpy as np

from sinssim.data import Array
from sinssim.jit import strict_kernel


@strict_kernel
def gauss_markov(interval: Array, correlation_time: float, white: Array) -> Array:
    """Turn white noise into a stationary process of the same variance with an exponential autocorrelation.

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
