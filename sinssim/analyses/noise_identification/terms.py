"""The noise terms of an inertial sensor with coefficients of one: Allan variance, spectrum, covariance.

Terms and coefficients are those of IEEE Std 952-2020, annex C, for gyros, and of IEEE Std 1293 for accelerometers:

    | symbol  | what                         | Allan variance σ²(τ)          | rate's two-sided spectrum S(f)          |
    | ------- | ---------------------------- | ----------------------------- | --------------------------------------- |
    | Q       | quantisation                 | 3Q²/τ²                        | Q² (2 sin πfT)²/T                       |
    | N       | angle, velocity random walk  | N²/τ                          | N²                                      |
    | B       | bias instability, flicker    | (2 ln 2/π) B² = (0.664 B)²    | B²/(2πf)                                |
    | K       | rate random walk             | K²τ/3                         | K²/(2πf)²                               |
    | R       | rate ramp                    | R²τ²/2                        | – (not a noise)                         |
    | sigma_b | first-order Gauss-Markov bias| see `gauss_markov_term`       | 2σ_b²τ_b/(1 + (2πfτ_b)²)                |

A sensor's output is increments over intervals of length T. Their discrete cosine transform of type II has practically
independent coefficients, at the frequencies f = k/(2nT), k = 1 … n-1. They are exactly independent for N and for a
random walk of the bias (the transform's vectors are eigenvectors of the second difference with free ends), and have
correlations below 0.12 for B. The two ends of the quantisation and the ramp do not fit this scheme and have their own
shapes, `end_effects` and `ramp_coefficients`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sinssim.data import Array

FEW = 64
"""Number of coefficients for which a term's departure from its spectrum (by the record's ends) is computed one by
one."""


@dataclass(frozen=True)
class NoiseTerm:
    """A noise term with a coefficient of one.

    Attributes:
        symbol: symbol as in the table above.
        name: name in words.
        allan_variance: Allan variance of the rate at averaging times τ, (M,) s.
        power: expected square of the k-th cosine coefficient of n increments over T; arguments k (any shape, 1 … n-1),
            n, T [s].
        covariance: generalised covariance of the accumulated angle at lags (any shape) s, up to a parabola, which
            second differences remove; arguments lag, and T [s] for the quantisation, which contributes at lag 0 only.
    """

    symbol: str
    name: str
    allan_variance: Callable[[Array], Array]
    power: Callable[[Array, int, float], Array]
    covariance: Callable[[Array, float], Array]


def _angle(k: Array, count: int) -> Array:
    """Return 2πfT of the k-th coefficient."""
    return np.asarray(np.pi * k / count)


def _odd(k: Array) -> Array:
    """Return 1 for odd k, 0 for even k; ½ from FEW on, where k represents its neighbours, too."""
    return np.where(k < FEW, np.rint(k) % 2.0, 0.5)


def _quantisation_power(k: Array, count: int, interval: float) -> Array:
    return np.asarray(4.0 * np.sin(0.5 * _angle(k, count)) ** 2)


def _white_power(k: Array, count: int, interval: float) -> Array:
    return np.full_like(k, interval, dtype=np.float64)


def _flicker_power(k: Array, count: int, interval: float) -> Array:
    from scipy.special import sici, zeta

    w = _angle(k, count)
    part = w / (2.0 * np.pi)
    # B²/(2πf) averaged over the interval and folded: Σ_m (sin(w/2) / (w/2 + πm))² / |w + 2πm|, Hurwitz's zeta
    folded = 4.0 * np.sin(0.5 * w) ** 2 * (zeta(3.0, part) + zeta(3.0, 1.0 - part)) / (2.0 * np.pi) ** 3
    # (2/L)∫∫ cos(kπt/L) cos(kπs/L) (−ln|t − s|) dt ds = (2L/kπ)(Si(kπ) − (1 − (−1)^k)/kπ), L/k without the ends
    exact = 2.0 / np.pi * (sici(np.pi * k)[0] - 2.0 * _odd(k) / (np.pi * k))
    ends = np.where(k < FEW, exact, 1.0 - 2.0 / (np.pi**2 * k))
    return np.asarray(interval**2 * folded * ends)


def _walk_power(k: Array, count: int, interval: float) -> Array:
    w = _angle(k, count)
    # second differences of an integrated walk: variance ⅔K²T³, covariance of neighbours ⅙K²T³
    return np.asarray(interval**3 * (2.0 + np.cos(w)) / (12.0 * np.sin(0.5 * w) ** 2))


QUANTISATION = NoiseTerm(
    "Q",
    "quantisation",
    lambda tau: 3.0 / tau**2,
    _quantisation_power,
    lambda lag, interval: (np.abs(lag) < 0.5 * interval).astype(np.float64),
)
RANDOM_WALK = NoiseTerm(
    "N", "random walk", lambda tau: 1.0 / tau, _white_power, lambda lag, interval: -0.5 * np.abs(lag)
)
FLICKER = NoiseTerm(
    "B",
    "bias instability (flicker)",
    lambda tau: np.full_like(tau, 2.0 * math.log(2.0) / np.pi),
    _flicker_power,
    lambda lag, interval: lag**2 * np.log(np.maximum(np.abs(lag), 1e-300)) / (2.0 * np.pi),
)
RATE_WALK = NoiseTerm(
    "K", "rate random walk", lambda tau: tau / 3.0, _walk_power, lambda lag, interval: np.abs(lag) ** 3 / 12.0
)


def gauss_markov_term(correlation_time: float) -> NoiseTerm:
    """Return the term of a stationary first-order Gauss-Markov bias.

    Its Allan variance is σ_b² (2τ_b/τ) [1 − (τ_b/2τ)(3 − 4 exp(−τ/τ_b) + exp(−2τ/τ_b))] (IEEE Std 952, annex C,
    exponentially correlated noise): a rate random walk K = σ_b √(2/τ_b) far below τ_b, 0.617 σ_b at its top
    τ = 1.89 τ_b, a random walk N = σ_b √(2τ_b) far above.

    Args:
        correlation_time: τ_b, s.

    Returns:
        The term; its coefficient is σ_b.
    """
    tau_b = correlation_time

    def allan_variance(tau: Array) -> Array:
        x = np.asarray(tau, dtype=np.float64) / tau_b
        # 2x − 3 + 4e⁻ˣ − e⁻²ˣ without cancellation at small x
        bracket = np.where(x < 1e-3, 2.0 * x**3 / 3.0 - x**4 / 2.0, 2.0 * x + 4.0 * np.expm1(-x) - np.expm1(-2.0 * x))
        return np.asarray(bracket / x**2)

    def power(k: Array, count: int, interval: float) -> Array:
        w, x, length = _angle(k, count), interval / tau_b, count * interval
        # integrals over intervals: variance v, covariances c, ce⁻ˣ, ce⁻²ˣ …, summed over all lags
        series = 1.0 - x / 3.0 + x**2 / 12.0 - x**3 / 60.0
        v = interval**2 * (series if x < 0.01 else 2.0 * (x + math.expm1(-x)) / x**2)
        c, e = (tau_b * math.expm1(-x)) ** 2, math.exp(-x)
        stationary = v + 2.0 * c * (np.cos(w) - e) / ((1.0 - e) ** 2 + 4.0 * e * np.sin(0.5 * w) ** 2)
        # the double integral of exp(−|t − s|/τ_b) with the transform's cosine, relative to that without the ends
        decay = math.exp(-length / tau_b)
        sign = np.where(k < FEW, 1.0 + (2.0 * _odd(k) - 1.0) * decay, 1.0)
        ends = 1.0 - 2.0 * tau_b / length * sign / (1.0 + (np.pi * k * tau_b / length) ** 2)
        return np.asarray(stationary * ends)

    def covariance(lag: Array, interval: float) -> Array:
        x = np.abs(lag) / tau_b
        # −τ_b²(e⁻ˣ + x) without its constant; its second derivative is −exp(−|lag|/τ_b)
        return np.asarray(-(tau_b**2) * np.where(x < 1e-3, 0.5 * x**2 - x**3 / 6.0, np.expm1(-x) + x))

    return NoiseTerm("sigma_b", "Gauss-Markov bias", allan_variance, power, covariance)


def ramp_coefficients(count: int, interval: float) -> Array:
    """Return the cosine coefficients of the increments of a ramp with R = 1.

    Args:
        interval: T, s.

    Returns:
        (n,) s², zero at k = 0, which is the mean, and at all even k.
    """
    k = np.arange(1, count, 2)
    half = 0.5 * np.pi * k / count
    coefficients = np.zeros(count)
    # Σ_j (j + ½) cos(πk(j + ½)/n) = −cos(πk/2n) / (2 sin²(πk/2n)) for odd k
    coefficients[1::2] = -math.sqrt(2.0 / count) * interval**2 * np.cos(half) / (2.0 * np.sin(half) ** 2)
    return coefficients


def end_effects(count: int) -> Array:
    """Return the cosine coefficients of the difference, or the sum, of unit steps of the angle at the first and last
    edge.

    The rounding errors of the accumulated angle at the two ends of a record add to the spectrum of quantisation: two
    numbers that look like white noise.

    Returns:
        (n,): the even ones belong to the difference of the errors at both ends, the odd ones to their sum.
    """
    return np.asarray(math.sqrt(2.0 / count) * np.cos(0.5 * np.pi * np.arange(count) / count))
