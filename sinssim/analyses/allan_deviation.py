"""Noise terms of an inertial sensor, and the overlapping Allan deviation with its confidence band.

    σ²(τ) = ⟨(θ_{k+2m} − 2θ_{k+m} + θ_k)²⟩ / (2τ²),   τ = mT

with θ the accumulated angle (or velocity) at the edges of intervals of length T (IEEE Std 952-2020, annex C). The
squares overlap and are far from independent. The estimate is approximately distributed as σ²(τ) χ²_ν/ν, with equivalent
degrees of freedom ν that match its variance. The variance follows from the noise, for any mixture of terms (the method
of Greenhall and Riley, Uncertainty of stability variances based on finite differences, 35th PTTI meeting, 2003, for a
single power law).

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
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sinssim.arguments import POSITIVE, doubles, number
from sinssim.data import Array, short_repr
from sinssim.errors import InputError, shortened

FEW = 64
"""Number of coefficients for which a term's departure from its spectrum (by the record's ends) is computed one by
one."""


@dataclass(frozen=True)
class NoiseTerm:
    """A noise term with a coefficient of one."""

    symbol: str  # symbol as in the table above
    name: str  # name in words
    allan_variance: Callable[[Array], Array]  # Allan variance of the rate at averaging times τ, (M,) s
    power: Callable[[Array, int, float], Array]
    """Expected square of the k-th cosine coefficient of n increments over T; arguments k (any shape, 1 … n-1), n, T
    [s].
    """
    covariance: Callable[[Array, float], Array]
    """Generalised covariance of the accumulated angle at lags (any shape) s, up to a parabola, which second differences
    remove; arguments lag, and T [s] for the quantisation, which contributes at lag 0 only.
    """


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
    """Return the term of a stationary first-order Gauss-Markov bias with τ_b, s; its coefficient is σ_b.

    Its Allan variance is σ_b² (2τ_b/τ) [1 − (τ_b/2τ)(3 − 4 exp(−τ/τ_b) + exp(−2τ/τ_b))] (IEEE Std 952, annex C,
    exponentially correlated noise): a rate random walk K = σ_b √(2/τ_b) far below τ_b, 0.617 σ_b at its top τ = 1.89
    τ_b, a random walk N = σ_b √(2τ_b) far above.
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
        # −τ_b²(e⁻ˣ + x) without its constant; its second derivative is −exp(−|lag|/τ_b). Second differences remove x²
        series = x**2 * (1.0 / 2.0 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0)))
        return np.asarray(-(tau_b**2) * np.where(x < 1e-3, series, np.expm1(-x) + x))

    return NoiseTerm("sigma_b", "Gauss-Markov bias", allan_variance, power, covariance)


def ramp_coefficients(count: int, interval: float) -> Array:
    """Return the cosine coefficients of n increments of a ramp with R = 1, (n,) s²; those of even k are zero."""
    k = np.arange(1, count, 2)
    half = 0.5 * np.pi * k / count
    coefficients = np.zeros(count)
    # Σ_j (j + ½) cos(πk(j + ½)/n) = −cos(πk/2n) / (2 sin²(πk/2n)) for odd k
    coefficients[1::2] = -math.sqrt(2.0 / count) * interval**2 * np.cos(half) / (2.0 * np.sin(half) ** 2)
    return coefficients


def end_effects(count: int) -> Array:
    """Return the cosine coefficients of unit steps of the angle at the first and the last edge.

    The rounding errors of the accumulated angle at the two ends of a record add to the spectrum of quantisation: two
    numbers that look like white noise. The even coefficients of (n,) belong to their difference, the odd ones to their
    sum.
    """
    return np.asarray(math.sqrt(2.0 / count) * np.cos(0.5 * np.pi * np.arange(count) / count))


PER_DECADE = 10
"""Maximum number of averaging times per decade."""
_BLOCK = 32768  # squares at a time, so that they stay in the processor's cache
_LAGS = 1500  # number of lags at which a long covariance is sampled
_REACH = 12  # averaging times after which the covariance of second differences is neglected


@short_repr
@dataclass(frozen=True)
class AllanDeviation:
    """Overlapping Allan deviation of one channel."""

    interval: float  # T, s
    count: int  # number of increments in the record
    samples: NDArray[np.int64]  # m, increments in an averaging time, (M,)
    deviation: Array  # σ(τ), rad/s or m/s², (M,)

    @property
    def tau(self) -> Array:
        """Averaging times τ = mT, (M,) s."""
        return np.asarray(self.samples * self.interval)


def allan_deviation(
    increments: Array, interval: float, samples: Sequence[int] | NDArray[np.int64] | None = None
) -> AllanDeviation:
    """Compute the overlapping Allan deviation of a rate, rad/s or m/s², from its integrals over equal intervals, s.

    The mean of the increments, (N,) rad or m/s, has no effect and is removed for precision. `samples` are averaging
    times in intervals, each with 2m ≤ N; by default ten per decade up to a third of the record.
    """
    increments = doubles("increments", increments)
    interval = number("interval", interval, "s", low=POSITIVE)
    count = len(increments)
    if increments.ndim != 1 or count < 2 or not np.all(np.isfinite(increments)):
        raise InputError(f"increments of shape {increments.shape} must be a row of two or more finite numbers.")
    if samples is not None:
        wanted = doubles("samples", samples)
        if wanted.ndim != 1 or not np.all((wanted >= 1) & (2 * wanted <= count) & (wanted == np.floor(wanted))):
            raise InputError(f"samples = {shortened(str(samples))} must be whole numbers from 1 to {count // 2}.")
    chosen = averaging_samples(count) if samples is None else wanted.astype(np.int64)
    angle = np.concatenate([[0.0], np.cumsum(increments - np.mean(increments))])
    deviation = np.empty(len(chosen))
    for i, m in enumerate(chosen.tolist()):
        total, last = 0.0, count + 1 - 2 * m
        for start in range(0, last, _BLOCK):
            stop = min(start + _BLOCK, last)
            second = angle[start + m : stop + m] * -2.0
            second += angle[start:stop]
            second += angle[start + 2 * m : stop + 2 * m]
            total += float(second @ second)
        deviation[i] = np.sqrt(0.5 * total / last) / (m * interval)
    return AllanDeviation(interval, count, chosen, deviation)


def averaging_samples(count: int) -> NDArray[np.int64]:
    """Return averaging times in intervals, spaced evenly in the logarithm from 1 to a third of `count` increments."""
    longest = max(1, count // 3)
    steps = int(np.ceil(PER_DECADE * np.log10(longest))) + 1
    return np.unique(np.rint(np.geomspace(1.0, longest, max(steps, 1))).astype(np.int64))


def degrees_of_freedom(
    count: int, interval: float, samples: NDArray[np.int64], terms: Sequence[tuple[NoiseTerm, float]], ramp: float = 0.0
) -> Array:
    """Return the equivalent degrees of freedom ν of overlapping Allan variances, (M,); infinite without noise.

    With the second differences z, their covariance s and their number M, the variance of the mean square is (2/M) Σ_j
    (1 − |j|/M) s_j². A ramp R, which gives z the mean μ, adds 4μ²/M Σ_j (1 − |j|/M) s_j. The result is ν = 2 (s_0 +
    μ²)² over this variance. `count` is the number N of increments over `interval`, T, in the record, `samples` are m of
    each averaging time, (M,), and `terms` the noise with its coefficients, SI.
    """
    freedom = np.empty(len(samples))
    smooth = [(term, c) for term, c in terms if c > 0.0 and term.symbol != "Q"]
    quantum = next((c for term, c in terms if term.symbol == "Q"), 0.0)
    for i, m in enumerate(samples.tolist()):
        number = count + 1 - 2 * m
        last = min(number - 1, _REACH * m)
        lags, weights = _lags(m, last)
        taper = 1.0 - lags / number
        s = np.zeros_like(lags)
        for term, coefficient in smooth:
            s += coefficient**2 * _second_difference_covariance(term, lags * interval, m * interval, interval)
        s0 = s[0]
        squares = float(np.sum(weights * taper * s**2))
        plain = float(np.sum(weights * taper * s))
        # the rounding errors are correlated at five lags only
        for lag, size in ((0, 6.0), (m, -4.0), (2 * m, 1.0)):
            if quantum > 0.0 and lag < number:
                there = float(np.interp(lag, lags, s))
                part = (1.0 if lag == 0 else 2.0) * (1.0 - lag / number)
                squares += part * (2.0 * there * size * quantum**2 + (size * quantum**2) ** 2)
                plain += part * size * quantum**2
        s0 += 6.0 * quantum**2
        mean = ramp * (m * interval) ** 2
        spread = 2.0 * squares + 4.0 * mean**2 * max(plain, 0.0)
        freedom[i] = 2.0 * number * (s0 + mean**2) ** 2 / spread if spread > 0.0 else np.inf
    return freedom


def _lags(m: int, last: int) -> tuple[Array, Array]:
    """Return lags 0 … last and the weights of a sum over both signs, a long one of some by the trapezoid rule."""
    if last <= _LAGS:
        weights = np.full(last + 1, 2.0)
        weights[0] = 1.0
        return np.arange(last + 1.0), weights
    # at lags m and 2m the covariance has kinks; beyond it is small and smooth
    nodes = [0, *(kink for kink in (m, 2 * m) if kink < last), last]
    lags = np.unique(np.concatenate([np.linspace(a, b, _LAGS // 3) for a, b in pairwise(nodes)]))
    steps = np.diff(lags)
    return lags, np.concatenate([[0.0], steps]) + np.concatenate([steps, [0.0]])


def _second_difference_covariance(term: NoiseTerm, lag: Array, tau: float, interval: float) -> Array:
    g = term.covariance
    return np.asarray(
        6.0 * g(lag, interval)
        - 4.0 * (g(lag - tau, interval) + g(lag + tau, interval))
        + (g(lag - 2.0 * tau, interval) + g(lag + 2.0 * tau, interval))
    )


def confidence_band(deviation: Array, freedom: Array, probability: float = 0.95) -> tuple[Array, Array]:
    """Return lower and upper end of the confidence band of the expected Allan deviation, (M,) each.

    They are σ √(ν/χ²) at both ends of the distribution of χ² with ν degrees of freedom.
    """
    from scipy.stats import chi2

    tail = 0.5 * (1.0 - probability)
    safe = np.where(np.isfinite(freedom), freedom, 1.0)
    low = deviation * np.where(np.isfinite(freedom), np.sqrt(safe / chi2.ppf(1.0 - tail, safe)), 1.0)
    high = deviation * np.where(np.isfinite(freedom), np.sqrt(safe / chi2.ppf(tail, safe)), 1.0)
    return low, high
