"""Identifies the coefficients of the noise terms from one record, with confidence bands.

The likelihood of the whole record (`noise_likelihood`) is maximised over the coefficients. Maximum likelihood is
asymptotically efficient; overlapping Allan variances contain the same information in correlated form. Terms are dropped
one by one, the least significant first, as long as the loss of likelihood stays within that of the bands. A dropped
term is not observable in the record and has an upper limit but no value.

A value is in the band of a coefficient if, with all other coefficients refitted, twice the log-likelihood decreases by
less than `LIMIT`, the 95 % point of χ² with one degree of freedom.

Drift within one sample looks like white noise; a smaller random walk cannot be distinguished from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.allan_deviation import (
    FLICKER,
    QUANTISATION,
    RANDOM_WALK,
    RATE_WALK,
    NoiseTerm,
    gauss_markov_term,
)
from sinssim.analyses.noise_likelihood import Bands, Likelihood, Weighed, rounding, weigh
from sinssim.arguments import POSITIVE, doubles, first_not_finite, number
from sinssim.data import Array
from sinssim.errors import InputError

FEWEST_SAMPLES = 256
"""Number of samples below which the terms cannot be distinguished."""

PROBABILITY = 0.95
"""Probability of the confidence bands."""
LIMIT = 3.841458820694124
"""95 % point of χ² with one degree of freedom."""
_WIDE = 9.0  # twice the loss of log-likelihood beyond which a walk is negligible
_MIXED = 16  # number of walks for which a ramp's distribution is computed

_SMALLEST, _LARGEST = 1e-50, 1e50  # range of the spread of samples in any unit; beyond it, their squares overflow
_SHORTEST = 1e-9  # s, and its inverse the longest: no sensor's interval lies outside, where powers of it overflow
_LONGEST = 1e6  # in records; a bias with a longer correlation time is a constant or a walk
_QUICKEST = 100.0  # samples in the shortest correlation time that is searched for
_TIMES = 25  # number of correlation times that are tried
_DETECTED = 10.0  # twice the gain in log-likelihood for which a Gauss-Markov term is included
_SPIKE = 10.0  # in standard deviations; normal noise reaches six in a hundred million samples
_ENOUGH = 100_000  # samples that determine a standard deviation well enough
_POSSIBLE = 5.0  # the same for a remark; without such a bias one record in twenty gains as much


@dataclass(frozen=True)
class TermEstimate:
    """One coefficient."""

    value: float | None  # most likely value, SI; None if the record does not require the term
    low: float
    high: float  # low, high: 95 % band, SI


@dataclass(frozen=True)
class NoiseFit:
    """The noise terms identified from the record of one channel."""

    estimates: dict[str, TermEstimate]
    """By symbol, Q [rad], N [rad/√s], B [rad/s], K [rad/s/√s], R [rad/s²], and sigma_b [rad/s] if there is such a term;
    the same with m/s for rad for accelerometers.
    """
    likely: dict[str, float]  # the coefficients as numbers for drawing, 0 for those without a value
    correlation_time: float | None  # τ_b of the Gauss-Markov term, s; None without the term
    correlation_band: tuple[float, float] | None  # its 95 % band, s, if it was estimated from the record
    interval: float  # T, s
    count: int  # increments in the record
    mean: float  # mean rate, rad/s or m/s²
    misfit: float
    """Relative uncertainty of the spectrum that accounts for its departure from the terms; 0 if they describe it."""
    aside: tuple[tuple[float, float], ...]  # excluded ranges of frequencies, which the terms do not describe, Hz
    exchangeable: tuple[str, ...]
    """Symbols of terms that are included although zero is in their band; other terms could replace them."""
    possible: tuple[float, float] | None
    """Σ_b [rad/s or m/s²] and τ_b [s] of a Gauss-Markov bias that is possible but not significant."""

    @property
    def terms(self) -> list[tuple[NoiseTerm, float]]:
        """The noise terms with their most likely coefficients, without the ramp."""
        terms = [QUANTISATION, RANDOM_WALK, FLICKER, RATE_WALK]
        if self.correlation_time is not None:
            terms.append(gauss_markov_term(self.correlation_time))
        return [(term, self.likely[term.symbol]) for term in terms]

    def allan_deviation(self, tau: Array, symbol: str | None = None) -> Array:
        """Return the Allan deviation of the fit, (M,) rad/s or m/s², by one term or the sum of all, at τ, (M,) s."""
        tau = np.asarray(tau, dtype=np.float64)
        parts = {term.symbol: c**2 * term.allan_variance(tau) for term, c in self.terms}
        parts["R"] = 0.5 * (self.likely["R"] * tau) ** 2
        return np.asarray(np.sqrt(parts[symbol] if symbol is not None else sum(parts.values())))


def fit_noise(increments: Array, interval: float, correlation_time: float | None = None) -> NoiseFit:
    """Identify the noise of one channel of a sensor at rest, from integrals over equal intervals, (N,) rad or m/s.

    `correlation_time` is τ_b of a first-order Gauss-Markov bias, s, if it is known to exist; this term is then the last
    to be dropped. If not given, such a term is searched for and included if significant.
    """
    increments = doubles("increments", increments)
    interval = number("interval", interval, "s", low=_SHORTEST, high=1.0 / _SHORTEST)
    if correlation_time is not None:
        correlation_time = number("correlation_time", correlation_time, "s", low=POSITIVE)
    if increments.ndim != 1:
        raise InputError(f"increments of one channel must have the shape (N,), not {increments.shape}.")
    bad = first_not_finite(increments)
    if bad is not None:
        raise InputError(f"sample {bad} is {increments[bad]}, not a finite number.")
    if len(increments) < FEWEST_SAMPLES:
        raise InputError(
            f"{len(increments)} samples are too few to distinguish noise terms; at least {FEWEST_SAMPLES} are needed."
        )
    length = len(increments) * interval
    if correlation_time is not None and not interval <= correlation_time <= _LONGEST * length:
        raise InputError(
            f"a correlation time of {correlation_time:g} s cannot be identified; it must be at least the interval, "
            f"{interval:g} s, and at most a million times the record, {_LONGEST * length:g} s."
        )
    mean = float(np.mean(increments))
    if is_constant(increments):
        raise InputError(f"all {len(increments)} samples are {mean:.6g}: a constant channel has no noise to identify.")
    spread = float(np.ptp(increments))
    if not _SMALLEST < spread < _LARGEST:
        raise InputError(
            f"samples that differ by up to {spread:.3g} rad or m/s are impossible for a sensor; use SI units."
        )
    bands = Bands(increments - mean, interval, float(np.max(np.abs(increments))))
    terms = [QUANTISATION, RANDOM_WALK, FLICKER, RATE_WALK]
    if correlation_time is not None:
        terms.append(gauss_markov_term(correlation_time))
    fit = weigh(bands, terms)
    times = [] if correlation_time is None else [correlation_time]
    possible = None
    if correlation_time is None and not bands.rounded:
        time, sigma, gain = _search(fit.whole)
        if gain > _DETECTED:
            other = weigh(bands, [*terms, gauss_markov_term(time)])
            white = fit.model.index("N")
            # A term that replaces the white noise is not a bias but the sensor's bandwidth.
            if white in _needed(other.model, ()) or white not in _needed(fit.model, ()):
                fit, times = other, correlation_times(other.model, time)
        elif gain > _POSSIBLE:
            possible = (sigma, time)
    return _result(fit, times, mean / interval, possible)


def is_constant(increments: Array) -> bool:
    """Return whether a channel's increments are all equal except for floating-point rounding."""
    return float(np.ptp(increments)) <= rounding(len(increments)) * float(np.max(np.abs(increments)))


def _search(model: Likelihood) -> tuple[float, float, float]:
    """Return correlation time, σ_b and twice the gain in log-likelihood of a Gauss-Markov bias beside the terms."""
    from scipy.optimize import minimize_scalar

    bands = model.bands
    length = bands.count * bands.interval

    def gain(log_time: float) -> float:
        return 2.0 * (model.extended(gauss_markov_term(math.exp(log_time))).top - model.top)

    grid = np.linspace(math.log(_QUICKEST * bands.interval), math.log(0.5 * length), _TIMES)
    gains = [gain(x) for x in grid]
    i = int(np.argmax(gains))
    if i == 0 or gains[i] < _POSSIBLE:  # a maximum at the first time means a process faster than a bias
        return 0.0, 0.0, 0.0
    around = (grid[i - 1], grid[min(i + 1, _TIMES - 1)])
    top = minimize_scalar(lambda x: -gain(x), bounds=around, method="bounded", options={"xatol": 1e-3})
    time = math.exp(top.x)
    return time, math.sqrt(model.extended(gauss_markov_term(time)).best[-1]), -float(top.fun)


def _needed(model: Likelihood, last: Sequence[str]) -> set[int]:
    """Return the terms that the record requires; the others are removed one by one, the least significant first."""
    stay, top = set(range(len(model.terms))), model.top
    while len(stay) > 1:
        losses = {}
        for i in stay:
            fixed = {j: 0.0 for j in range(len(model.terms)) if j not in stay or j == i}
            losses[i] = 2.0 * (top - model.solve(fixed, start=model.best)[1])
        dispensable = [i for i in stay if losses[i] < LIMIT]
        if not dispensable:
            break
        drop = min(dispensable, key=lambda i: (model.terms[i].symbol in last, losses[i]))
        stay.remove(drop)
        top -= 0.5 * losses[drop]
    return stay


def _result(fit: Weighed, times: Sequence[float], mean: float, possible: tuple[float, float] | None) -> NoiseFit:
    model, bands = fit.model, fit.model.bands
    stay = set() if bands.rounded else _needed(model, ("N", "sigma_b") if len(times) == 1 else ("N",))
    squares, _ = model.solve({i: 0.0 for i in range(len(model.terms)) if i not in stay}, start=model.best)
    likely = {term.symbol: math.sqrt(c) for term, c in zip(model.terms, squares, strict=True)}
    limits = coefficient_bands(model, times)
    # Largest contribution of drift within a sample to white noise; floating-point rounding.
    inside = 0.5 * likely["K"] * bands.interval + 0.7 * likely["B"] * math.sqrt(bands.interval)
    if times:
        inside += likely["sigma_b"] * math.sqrt(0.5 / times[0]) * bands.interval
    if likely["N"] < inside:
        limits["N"] = (0.0, max(limits["N"][1], inside))
        stay -= {model.index("N")}
        likely["N"] = 0.0
    estimates = {}
    for i, term in enumerate(model.terms):
        low, high = limits[term.symbol]
        value = likely[term.symbol] if i in stay else None
        # The band is from the fit of all terms, the value from that of the remaining terms.
        estimates[term.symbol] = (
            TermEstimate(None, low, high) if value is None else TermEstimate(value, min(low, value), max(high, value))
        )
    ramp, low, high = (bands.ramp + r for r in ramp_band(model))
    seen = low > 0.0 or high < 0.0
    estimates["R"] = TermEstimate(ramp if seen else None, low, high)
    likely["R"] = ramp if seen else 0.0
    return NoiseFit(
        estimates,
        likely,
        times[0] if times else None,
        (min(times), max(times)) if len(times) > 1 else None,
        bands.interval,
        bands.count,
        mean,
        fit.misfit,
        _ranges(bands, fit.aside),
        tuple(sorted(model.terms[i].symbol for i in stay if limits[model.terms[i].symbol][0] == 0.0)),
        possible,
    )


def _ranges(bands: Bands, aside: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """Return excluded bands as ranges of frequency, Hz, with neighbours joined."""
    steps = np.flatnonzero(np.diff(np.concatenate([[0], aside.astype(np.int8), [0]])))
    hertz = bands.edges / (2.0 * bands.count * bands.interval)
    return tuple((float(hertz[a]), float(hertz[b])) for a, b in zip(steps[0::2], steps[1::2], strict=True))


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


def spike_of(increments: Array, time: Array) -> tuple[float, float] | None:
    """Return time and size of the largest spike, if noise does not explain it."""
    second = np.abs(np.diff(increments, 2))
    # the median is insensitive to a few samples; for a normal number it is 0.6745 standard deviations
    sigma = float(np.median(second[:: 1 + len(second) // _ENOUGH])) / 0.6745
    k = int(np.argmax(second))
    if not second[k] > _SPIKE * sigma > 0.0:
        return None
    return float(time[k + 2]), float(second[k]) / sigma
