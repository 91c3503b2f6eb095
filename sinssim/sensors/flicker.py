"""Flicker noise, the bias instability B of IEEE Std 952: a spectrum B²/(2πf), an Allan deviation of √(2 ln 2/π) B.

The model is a weighted sum of ten first-order processes with logarithmically spaced time constants, all driven by one
white noise ν. In the limit of many processes such a sum has the spectrum 1/f (Kasdin, Discrete simulation of colored
noise and stochastic processes and 1/f^α power law noise generation, Proceedings of the IEEE 83, 1995):

    x_m ← (1 − r_m) x_m + ν,    c = B (w₀ ν + Σ w_m x_m)

where c are the means over successive intervals. Flicker noise is self-similar, so the rates r_m are per sample,
independent of the interval: the longest time constant is 4·10⁶ samples. The weights and the fastest rate were fitted to
a flat Allan deviation. It is flat within 0.2 % from 1 to 2.5·10⁶ samples, seven hours at 100 Hz; then it falls, by 0.5
% at 3·10⁶ and 1.5 % at 4·10⁶ samples.

A filter needs states that are driven independently. Stationary first-order Gauss-Markov processes of one variance, with
correlation times τ_k in a constant ratio r, have in sum the spectrum 1/f between their inverse times (Keshner, 1/f
noise, Proceedings of the IEEE 70, 1982). The two-sided spectrum of one is 2σ²τ/(1 + (2πfτ)²), and over all ln τ its
integral is σ²/(2f), so that B²/(2πf) takes

    σ² = (B²/π) ln r,   with a ripple of ± 2/cosh(π²/ln r), 5.5 % for one process in a decade                      (1)
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array

RATES = (
    0.627007, 0.166908, 0.0332484, 0.00624162, 0.0011587, 0.000214654, 3.97503e-5, 7.36058e-6, 1.36294e-6, 2.52373e-7,
)  # fmt: skip
"""r_m, fraction of each process that decays per sample."""

WEIGHTS = (
    0.558835, 0.220411, 0.0990852, 0.0423077, 0.0182976, 0.00787056, 0.00338052, 0.00147849, 0.000621447, 0.00045356,
)  # fmt: skip
"""w_m."""

DIRECT = -0.0852224
"""w₀."""


def _stationary() -> np.ndarray:
    """Return L with L Lᵀ the covariance of the x_m, 1/(1 − d_m d_n) with d = 1 − r, in closed form.

    The rows are the values at d_m of the orthonormal Takenaka-Malmquist functions with poles at the d_n, which vanish
    for n > m (Heuberger, Van den Hof and Wahlberg, Modelling and Identification with Rational Orthogonal Basis
    Functions, 2005, section 2.6).
    """
    count = len(RATES)
    matrix = np.zeros((count, count))

    def kept(m: int, n: int) -> float:
        return RATES[m] + RATES[n] - RATES[m] * RATES[n]  # 1 − d_m d_n

    for m in range(count):
        product = 1.0
        for n in range(m + 1):
            matrix[m, n] = product * kept(n, n) ** 0.5 / kept(m, n)
            product *= (RATES[n] - RATES[m]) / kept(m, n)
    return matrix


STATIONARY = _stationary()
"""Matrix from ten independent normal numbers to the x_m of stationary noise, (10, 10)."""


def covariance(lag: Array) -> Array:
    """Return the autocovariance of flicker noise with B = 1 at distances in samples, Σ w_m d_m^lag Σ cov(x_m, x_n) w_n,
    (...), without the contribution of w₀. Beyond the first few samples a distance need not be an integer."""
    weights, kept = np.array(WEIGHTS), 1.0 - np.array(RATES)
    shares = weights * (STATIONARY @ STATIONARY.T @ weights)
    return np.asarray(np.moveaxis(np.power.outer(kept, np.asarray(lag, dtype=np.float64)), 0, -1) @ shares)


def variance_of_mean(count: ArrayLike) -> Array:
    """Return the variance of the mean of n ≥ 1 consecutive samples of flicker noise with B = 1: (C₀ + 2 Σ (1 − l/n)
    C_l)/n over the lags l < n, with the covariances C_l in closed form, (...)."""
    weights, rates = np.array(WEIGHTS), np.array(RATES)
    shares = weights * (STATIONARY @ STATIONARY.T @ weights + DIRECT)  # C_l = Σ shares d^l for l ≥ 1
    n = np.asarray(count, dtype=np.float64)[..., None]
    # Σ (n − l) d^l = d (n − (1 − d^n)/r)/r, r = 1 − d
    lagged = (1.0 - rates) * (n + np.expm1(n * np.log1p(-rates)) / rates) / rates @ shares
    alone = shares.sum() + DIRECT * (DIRECT + weights.sum())
    return np.asarray(alone / n[..., 0] + 2.0 * lagged / n[..., 0] ** 2)


_WHITE = 0.05
"""Variance of the flicker that a sum of processes treats as white noise, relative to that of the sensor's own."""

_SHORTEST = 0.1
"""Least correlation time of a process, s: the interval in which filters predict."""

SAMPLES_PER_SECOND = 100.0
"""Assumed number of samples, which the memory of flicker noise is counted in; with ten times fewer the 1σ at the start
is at most 1.2 times larger."""

_OF_MEAN = math.exp(1.5 - np.euler_gamma)
"""Time over which the mean of 1/f noise has the variance of its processes above a correlation time, relative to it."""


def shortest_time(b: float, white: float) -> float:
    """Return the correlation time, s, from which flicker B beside white noise N needs processes.

    What is faster is white noise of the density 2 B² τ/π.
    """
    return max(_WHITE * white**2 * math.pi / (2.0 * b**2), _SHORTEST)


def smoothed_over(b: float, white: float) -> float:
    """Return the averaging time, s, after which flicker has the variance of its processes."""
    return _OF_MEAN * shortest_time(b, white)


def processes(b: float, white: float, duration: float, count: int | None = None) -> tuple[Array, Array, float]:
    """Return Gauss-Markov processes whose sum is flicker noise: (1) from `shortest_time` to the duration of a run.

    The last one is slower. It has the variance of all that is left in the memory of the noise, and a correlation time
    with which it changes over a run as they do.

    Args:
        b: B, rad/s or m/s².
        white: N of the sensor, rad/√s or m/s/√s.
        duration: of the run, s.
        count: number of processes, 2 or more; default: one for each decade, and the last.

    Returns:
        1σ and correlation time of each, (m,) and (m,) s, and the density of the faster rest, as N.
    """
    first, unit = shortest_time(b, white), b**2 / math.pi
    ratio = max(duration / first, 10.0)
    within = math.ceil(math.log10(ratio) - 1e-9) if count is None else count - 1
    step = ratio ** (1.0 / within)
    variance = np.full(within + 1, unit * math.log(step))
    times = first * step ** (np.arange(within + 1) + 0.5)
    left = b**2 * float(variance_of_mean(smoothed_over(b, white) * SAMPLES_PER_SECOND)) - variance[:-1].sum()
    variance[-1] = max(left, unit)
    times[-1] = first * ratio * variance[-1] / unit
    return np.sqrt(variance), times, math.sqrt(2.0 * unit * first)
