"""Overlapping Allan deviation and its confidence band.

    σ²(τ) = ⟨(θ_{k+2m} − 2θ_{k+m} + θ_k)²⟩ / (2τ²),   τ = mT

with θ the accumulated angle (or velocity) at the edges of intervals of length T (IEEE Std 952-2020, annex C). The
squares overlap and are far from independent. The estimate is approximately distributed as σ²(τ) χ²_ν/ν, with equivalent
degrees of freedom ν that match its variance. The variance follows from the noise, for any mixture of terms (the method
of Greenhall and Riley, Uncertainty of stability variances based on finite differences, 35th PTTI meeting, 2003, for a
single power law).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.noise_identification.terms import NoiseTerm
from sinssim.arguments import POSITIVE, doubles, number
from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.system.short_repr import short_repr

PER_DECADE = 10
"""Maximum number of averaging times per decade."""
_BLOCK = 32768  # squares at a time, so that they stay in the processor's cache
_LAGS = 1500  # number of lags at which a long covariance is sampled
_REACH = 12  # averaging times after which the covariance of second differences is neglected


@short_repr
@dataclass(frozen=True)
class AllanDeviation:
    """Overlapping Allan deviation of one channel.

    Attributes:
        interval: T, s.
        count: number of increments in the record.
        samples: m, increments in an averaging time, (M,).
        deviation: σ(τ), rad/s or m/s², (M,).
    """

    interval: float
    count: int
    samples: NDArray[np.int64]
    deviation: Array

    @property
    def tau(self) -> Array:
        """Averaging times τ = mT, (M,) s."""
        return np.asarray(self.samples * self.interval)


def allan_deviation(
    increments: Array, interval: float, samples: Sequence[int] | NDArray[np.int64] | None = None
) -> AllanDeviation:
    """Compute the overlapping Allan deviation of a rate from its integrals over equal intervals.

    Args:
        increments: (N,) rad or m/s; their mean has no effect and is removed for precision.
        interval: T, s.
        samples: averaging times in intervals, each with 2m ≤ N; by default ten per decade up to a third of the record.

    Returns:
        The Allan deviation, in rad/s or m/s².

    Raises:
        InputError: the increments are not a row of finite numbers, the interval is not positive, or an averaging time
            does not fit twice into the record.
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
    """Return averaging times in intervals, evenly spaced on a logarithmic scale.

    Args:
        count: N, number of increments.

    Returns:
        Increasing whole numbers from 1 to N/3.
    """
    longest = max(1, count // 3)
    steps = int(np.ceil(PER_DECADE * np.log10(longest))) + 1
    return np.unique(np.rint(np.geomspace(1.0, longest, max(steps, 1))).astype(np.int64))


def degrees_of_freedom(
    count: int,
    interval: float,
    samples: NDArray[np.int64],
    terms: Sequence[tuple[NoiseTerm, float]],
    ramp: float = 0.0,
) -> Array:
    """Return the equivalent degrees of freedom of overlapping Allan variances.

    With the second differences z, their covariance s and their number M, the variance of the mean square is (2/M) Σ_j
    (1 − |j|/M) s_j². A ramp, which gives z the mean μ, adds 4μ²/M Σ_j (1 − |j|/M) s_j. The result is ν = 2 (s_0 + μ²)²
    over this variance.

    Args:
        count: N, number of increments in the record.
        interval: T, s.
        samples: m, increments in each averaging time, (M,).
        terms: the noise: terms and their coefficients, SI.
        ramp: R, rad/s² or m/s³.

    Returns:
        ν, (M,); infinite without noise.
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
    """Return lags 0 … last and the weights of a sum over both signs; for a long sum only some, by the trapezoid
    rule."""
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
    """Return the confidence band of the expected Allan deviation.

    Args:
        deviation: computed σ(τ), (M,).
        freedom: equivalent degrees of freedom ν, (M,).
        probability: probability that the band contains the expected deviation.

    Returns:
        Lower and upper end, (M,): σ √(ν/χ²) at both ends of the distribution of χ² with ν degrees of freedom.
    """
    from scipy.stats import chi2

    tail = 0.5 * (1.0 - probability)
    safe = np.where(np.isfinite(freedom), freedom, 1.0)
    low = deviation * np.where(np.isfinite(freedom), np.sqrt(safe / chi2.ppf(1.0 - tail, safe)), 1.0)
    high = deviation * np.where(np.isfinite(freedom), np.sqrt(safe / chi2.ppf(tail, safe)), 1.0)
    return low, high
