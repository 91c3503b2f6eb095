"""The confidence bands of the noise terms of one record.

A value is in the band of a coefficient if, with all other coefficients refitted, twice the log-likelihood decreases by
less than `LIMIT`, the 95 % point of χ² with one degree of freedom.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sinssim.analyses.allan_deviation import (
    gauss_markov_term,
)
from sinssim.analyses.noise_likelihood import Likelihood

PROBABILITY = 0.95
"""Probability of the confidence bands."""
LIMIT = 3.841458820694124
"""95 % point of χ² with one degree of freedom."""
_WIDE = 9.0  # twice the loss of log-likelihood beyond which a walk is negligible
_MIXED = 16  # number of walks for which a ramp's distribution is computed


def coefficient_bands(model: Likelihood, times: Sequence[float]) -> dict[str, tuple[float, float]]:
    """Return the 95 % bands of all terms' coefficients by symbol, SI.

    The bands include `times`: none, the known correlation time, or those of `correlation_times`, s. With such times,
    the last term of the model is the Gauss-Markov bias.
    """
    limits: dict[str, tuple[float, float]] = {}
    inner = Likelihood(model.bands, model.terms[:-1], model.columns[:-1], model.weight) if len(times) > 1 else model
    for time in times or [0.0]:
        other = inner.extended(gauss_markov_term(time)) if len(times) > 1 else model
        limit = LIMIT - 2.0 * (model.top - other.top)
        if limit <= 0.0:
            continue
        for i, term in enumerate(model.terms):
            low, high = _band(other, i, limit * (_uniformity(other) if term.symbol == "Q" else 1.0))
            before = limits.get(term.symbol, (low, high))
            limits[term.symbol] = (min(low, before[0]), max(high, before[1]))
    return limits


def _band(model: Likelihood, i: int, limit: float = LIMIT) -> tuple[float, float]:
    """Return the band of c of one term within which twice the log-likelihood decreases by less than a limit."""
    from scipy.optimize import brentq

    best = float(model.best[i])

    def outside(log_square: float) -> float:
        return model.loss({i: math.exp(log_square)}) - limit

    # Initial value for a term that is not visible: one with as much power as all the noise.
    v = model.variance(model.best)
    unit = best if best > 0.0 else float(np.min(v / model.columns[i]))
    low, high = 0.0, math.log(unit)
    step = 0.1 if best > 0.0 else 1.0
    if best == 0.0:
        while outside(high) > 0.0:
            high -= step
    inner = high
    while outside(high + step) < 0.0:
        high, step = high + step, 2.0 * step
    end = math.exp(brentq(outside, max(inner, high), high + step, xtol=1e-3))
    if best > 0.0 and model.loss({i: 0.0}) > limit:
        step = 0.1
        while outside(inner - step) < 0.0:
            inner, step = inner - step, 2.0 * step
        low = math.exp(brentq(outside, inner - step, inner, xtol=1e-3))
    return math.sqrt(low), math.sqrt(end)


def _uniformity(model: Likelihood) -> float:
    """Return the ratio of the variance of Q² to that for normally distributed rounding errors.

    For independent errors with the fourth cumulant κ₄, the inverse of Fisher's information changes by κ₄/n in its
    element of Q² only: the variance for uniform errors, κ₄ = −1.2 Q⁴, is smaller than for normal ones.
    """
    i = model.index("Q")
    active = [j for j in range(len(model.terms)) if model.best[j] > 0.0]
    if i not in active:
        return 1.0
    v = model.variance(model.best)
    scaled = model.columns[active] * model.best[active, None] / v
    information = 0.5 * (scaled * model.weight) @ scaled.T
    variance = float(np.linalg.inv(information)[active.index(i), active.index(i)])
    fourth = min(max(model.bands.fourth / float(model.best[i]) ** 2, -1.2), 0.0)
    return 1.0 + fourth / (model.bands.count * variance)


def ramp_band(model: Likelihood) -> tuple[float, float, float]:
    """Return the most likely ramp and its 95 % band, relative to the ramp already subtracted from the record.

    For given noise, the ramp is normally distributed. The noise near its frequency is known from a few coefficients
    only. The band is therefore that of a mixture of normal distributions over the rate random walk, weighted by the
    restricted likelihood of K, just as a t-distribution is a mixture of normal distributions over their variance.
    """
    from scipy.optimize import brentq
    from scipy.special import ndtr

    walk = model.index("K")
    low, high = _band(model, walk, _WIDE)
    nodes, weights = np.polynomial.legendre.leggauss(_MIXED)
    sizes, sigmas, shares = np.empty(_MIXED), np.empty(_MIXED), np.empty(_MIXED)
    for j, k in enumerate(0.5 * (low + high) + 0.5 * (high - low) * nodes):
        squares, top = model.solve({walk: float(k) ** 2}, start=model.best)
        v = model.variance(squares)
        estimate, covariance = model.ramp_and_ends(v)
        sizes[j], sigmas[j] = estimate[0], math.sqrt(covariance[0, 0])
        shares[j] = weights[j] * math.exp(top - model.top)
    shares /= shares.sum()

    def below(ramp: float) -> float:
        return float(shares @ ndtr((ramp - sizes) / sigmas))

    tail = 0.5 * (1.0 - PROBABILITY)
    least, most = float(np.min(sizes - 8.0 * sigmas)), float(np.max(sizes + 8.0 * sigmas))
    ends = [
        brentq(lambda x, p=p: below(x) - p, least, most, xtol=1e-3 * float(sigmas.min())) for p in (tail, 1.0 - tail)
    ]
    size = float(model.ramp_and_ends(model.variance(model.best))[0][0])
    return size, ends[0], ends[1]


def correlation_times(model: Likelihood, likeliest: float) -> list[float]:
    """Return the likeliest correlation time, s, and five others across its 95 % band.

    The other coefficients' bands are taken over them; the model's last term is the Gauss-Markov bias.
    """
    from scipy.optimize import brentq

    inner = Likelihood(model.bands, model.terms[:-1], model.columns[:-1], model.weight)

    def outside(log_time: float) -> float:
        return 2.0 * (model.top - inner.extended(gauss_markov_term(math.exp(log_time))).top) - LIMIT

    x = math.log(likeliest)
    ends = []
    for sign, farthest in ((-1.0, math.log(model.bands.interval)), (1.0, x + math.log(1e3))):
        step = 0.2
        while abs(step) < abs(farthest - x) and outside(x + sign * step) < 0.0:
            step *= 1.6
        end = x + sign * step
        ends.append(brentq(outside, x, end, xtol=0.02) if outside(x) < 0.0 < outside(end) else end)
    return [likeliest, *(math.exp(end) for end in np.linspace(ends[0], ends[1], 5))]
