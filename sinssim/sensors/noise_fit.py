"""Identification: the coefficients of the noise terms from one record, with honest confidence bands.

The increments' cosine coefficients z_k (see `noise_terms`) are independent normal numbers of variance

    v_k = Σ_i c_i² p_i(k),   c = Q, N, B, K and, if need be, σ_b

on top of a ramp of known shape and unknown size R, and of the two ends of the quantisation. So the likelihood of the
whole record is that of a table of some 250 bands: sums of z_k² over neighbouring k, none summed at low frequencies. Its
maximum over c_i² ≥ 0 is found by Fisher's scoring, each step of which is a weighted least-squares fit with non-negative
unknowns; ramp and ends are eliminated as in restricted maximum likelihood (Patterson and Thompson, Biometrika 58,
1971), so that they do not take their degrees of freedom from the noise. Nothing estimates better: overlapping Allan
variances hold the same information, less its independence.

The band of a coefficient is every value at which the likelihood, all other coefficients refitted, is within
exp(−χ²/2) of its maximum, χ² the 95 % point with one degree of freedom. Terms are then dropped one by one, the least
missed first, as long as the likelihood stays within the same factor: a term that the record is described without is not
observable in it, and gets an upper limit and no value.

Three things are not left to chance:

- What a bias does within a sample shows near half the sampling frequency only, and depends on how the sensor, or its
  model, takes the mean. There, bands weigh the less the more of their power is drift's.
- A record that the terms do not describe (vibration, filters, temperature) shows in the misfit of the bands. Those that
  are far off are left out, and named. All others are taken to be uncertain by the same relative amount, as large as
  makes the misfit what it should be: all frequencies count alike, and all confidence bands widen.
- Drift within one sample looks like white noise: a random walk below that is not told from it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sinssim.checks import first_not_finite
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.sensors.noise_terms import (
    FEW,
    FLICKER,
    QUANTISATION,
    RANDOM_WALK,
    RATE_WALK,
    NoiseTerm,
    end_effects,
    gauss_markov,
    ramp_coefficients,
)

FEWEST_SAMPLES = 256
"""Samples below which no term can be told from another."""
PROBABILITY = 0.95
"""Of the confidence bands."""

_WIDTH = 1.04  # of a band, ratio of its last to its first frequency
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_LIMIT = 3.841458820694124  # χ² with one degree of freedom, 95 %
_STEPS = 200  # of the scoring, at most
_WIDE = 9.0  # twice the loss of the logarithm of the likelihood beyond which a walk counts for nothing
_MIXED = 16  # walks for which a ramp's distribution is computed
_QUICKEST = 100.0  # samples in the shortest correlation time that is looked for
_TIMES = 25  # correlation times that are tried
_CLOSE = 1e-5  # of the logarithm of the likelihood
_DETECTED = 10.0  # twice the gain in the logarithm of the likelihood for which a Gauss-Markov term is taken in
_POSSIBLE = 5.0  # for which it is mentioned; without such a bias one record of twenty gains as much
_FAR = 4.0  # standard deviations at which a band is left out
_BY_CHANCE = 5.5  # that no band reaches where nothing is to be left out
_MOST_ASIDE = 0.4  # of the bands, more are not left out
_ROUNDS = 40  # of leaving bands out, at most
_DOUBTFUL = 4.0  # standard deviations of the misfit above what it should be


@dataclass(frozen=True)
class Estimate:
    """One coefficient.

    Attributes:
        value: most likely value, SI; None if the record is described as well without the term.
        low, high: 95 % band, SI.
    """

    value: float | None
    low: float
    high: float


@dataclass(frozen=True)
class NoiseFit:
    """What the record of one channel says about its sensor's noise.

    Attributes:
        estimates: by symbol, Q [rad], N [rad/√s], B [rad/s], K [rad/s/√s], R [rad/s²], and sigma_b [rad/s] if there is
            such a term; the same with m/s for rad for accelerometers.
        likely: the same coefficients as numbers, 0 for those that have no value: what is drawn.
        correlation_time: τ_b of the Gauss-Markov term, s, None without.
        correlation_band: its 95 % band, s, if it comes from the record.
        interval: T, s.
        count: increments in the record.
        mean: mean rate, rad/s or m/s².
        misfit: relative uncertainty of the spectrum that makes up for what the terms do not describe, 0 if they do.
        aside: ranges of frequencies that the terms do not describe and that were left out, Hz.
        exchangeable: symbols of terms that are there although zero is in their band: others may stand in for them.
        possible: σ_b [rad/s or m/s²] and τ_b [s] of a Gauss-Markov bias that the record hints at, but does not show.
    """

    estimates: dict[str, Estimate]
    likely: dict[str, float]
    correlation_time: float | None
    correlation_band: tuple[float, float] | None
    interval: float
    count: int
    mean: float
    misfit: float
    aside: tuple[tuple[float, float], ...]
    exchangeable: tuple[str, ...]
    possible: tuple[float, float] | None

    @property
    def terms(self) -> list[tuple[NoiseTerm, float]]:
        """The noise terms with their most likely coefficients, the ramp left out."""
        terms = [QUANTISATION, RANDOM_WALK, FLICKER, RATE_WALK]
        if self.correlation_time is not None:
            terms.append(gauss_markov(self.correlation_time))
        return [(term, self.likely[term.symbol]) for term in terms]

    def allan_deviation(self, tau: Array, symbol: str | None = None) -> Array:
        """Return the Allan deviation of the fit.

        Args:
            tau: averaging times, (M,) s.
            symbol: of one term; all together if not given.

        Returns:
            (M,) rad/s or m/s².
        """
        tau = np.asarray(tau, dtype=np.float64)
        parts = {term.symbol: c**2 * term.allan_variance(tau) for term, c in self.terms}
        parts["R"] = 0.5 * (self.likely["R"] * tau) ** 2
        return np.asarray(np.sqrt(parts[symbol] if symbol is not None else sum(parts.values())))


def fit_noise(increments: Array, interval: float, correlation_time: float | None = None) -> NoiseFit:
    """Identify the noise of one channel of a sensor at rest.

    Args:
        increments: integrals of the rate over equal intervals, (N,) rad or m/s.
        interval: T, s.
        correlation_time: τ_b of a first-order Gauss-Markov bias, s, if there is one and its time is known: it is then
            the last term to be done without. If not given, such a term is looked for, and taken in if the record calls
            for it.

    Returns:
        The coefficients and their bands.

    Raises:
        InputError: too few samples, one that is not finite, all of them alike, or a correlation time that is not
            positive.
    """
    bad = first_not_finite(increments)
    if bad is not None:
        raise InputError(f"sample {bad} is {increments[bad]}, not a finite number.")
    if len(increments) < FEWEST_SAMPLES:
        raise InputError(
            f"{len(increments)} samples are too few to tell noise terms apart; at least {FEWEST_SAMPLES} are needed."
        )
    if correlation_time is not None and not correlation_time > 0.0:
        raise InputError(f"a correlation time of {correlation_time!r} s cannot be; it must be above 0.")
    mean = float(np.mean(increments))
    if is_constant(increments):
        raise InputError(f"all {len(increments)} samples are {mean:.6g}: a constant channel has no noise to identify.")
    table = _Table(increments - mean, interval, float(np.max(np.abs(increments))))
    terms = [QUANTISATION, RANDOM_WALK, FLICKER, RATE_WALK]
    if correlation_time is not None:
        terms.append(gauss_markov(correlation_time))
    fit = _calibrated(table, terms)
    times = [] if correlation_time is None else [correlation_time]
    possible = None
    if correlation_time is None and not table.rounded:
        time, sigma, gain = _search(fit.whole)
        if gain > _DETECTED:
            other = _calibrated(table, [*terms, gauss_markov(time)])
            white = fit.model.index("N")
            # One that takes the white noise's place is no bias but the sensor's bandwidth.
            if white in _needed(other.model, ()) or white not in _needed(fit.model, ()):
                fit, times = other, _times(other.model, time)
        elif gain > _POSSIBLE:
            possible = (sigma, time)
    return _result(fit, times, mean / interval, possible)


def is_constant(increments: Array) -> bool:
    """Return whether a channel's increments are all the same but for the rounding of numbers in a computer."""
    return float(np.ptp(increments)) <= _rounding(len(increments)) * float(np.max(np.abs(increments)))


def _rounding(count: int) -> float:
    """Return what an increment may be off by, relative: times of a record of n intervals are rounded to n ε T."""
    return 4.0 * float(np.finfo(np.float64).eps) * count


class _Table:
    """A record as bands of its cosine coefficients.

    Attributes:
        number: coefficients in each band, (b,).
        power: sum of z² over each band.
        shapes_z: sums of ramp or end effect times z, (3, b).
        shapes: sums of products of ramp and end effects, (3, 3, b).
        ramp: what has been taken off z, SI.
        fourth: fourth cumulant of a single rounding error, were all white noise of the angle such errors, SI.
        floor: power that the rounding of numbers in a computer, those of times among them, may have.
        rounded: whether there is no more than that.
    """

    def __init__(self, departures: Array, interval: float, largest: float) -> None:
        from scipy.fft import dct, prev_fast_len

        self.count = prev_fast_len(len(departures), real=True)
        self.interval = interval
        self._basis = _basis(self.count, interval)
        self.edges, self.shapes = self._basis.edges, self._basis.products
        self.number = np.diff(self.edges).astype(np.float64)
        self._z = dct(departures[: self.count], norm="ortho")
        self.ramp = 0.0
        # The ramp as if all noise were rate random walk: the rise between the ends.
        ramp = self._basis.ramp
        weights = np.arange(self.count, dtype=np.float64) ** 2 * ramp
        self.take_off(np.array([float(weights @ self._z / (weights @ ramp)), 0.0, 0.0]))
        self.floor = (_rounding(self.count) * largest) ** 2
        self.rounded = float(self.power.sum()) < self.count * self.floor
        second = np.diff(departures)  # q₂ − 2q₁ + q₀ of rounding errors q: 1 + 2⁴ + 1 fourth cumulants
        squares = second**2
        self.fourth = float(np.mean(squares**2) - 3.0 * np.mean(squares) ** 2) / 18.0

    def take_off(self, sizes: Array) -> None:
        """Take ramp and end effects off the coefficients; done once their sizes are known nearly, this saves digits.

        Args:
            sizes: of the ramp, and of the end effects in even and odd coefficients, (3,).
        """
        z, basis = self._z, self._basis
        z -= float(sizes[0]) * basis.ramp
        z[0::2] -= float(sizes[1]) * basis.ends[0::2]
        z[1::2] -= float(sizes[2]) * basis.ends[1::2]
        self.ramp += float(sizes[0])
        starts = self.edges[:-1]
        self.power = np.add.reduceat(z**2, starts)
        both = basis.ends * z
        odd = both.copy()
        odd[0::2] = 0.0
        odd_sum = np.add.reduceat(odd, starts)
        self.shapes_z = np.stack(
            [np.add.reduceat(basis.ramp * z, starts), np.add.reduceat(both, starts) - odd_sum, odd_sum]
        )

    @property
    def angle(self) -> Array:
        """2πfT in the middle of each band."""
        return np.asarray(0.5 * np.pi * (self.edges[1:] + self.edges[:-1] - 1) / self.count)

    def column(self, term: NoiseTerm) -> Array:
        """Return a term's mean power in each band, (b,)."""
        low, high = self.edges[:-1], self.edges[1:]
        middle, half = 0.5 * (low + high - 1), 0.5 * (high - low) * (high - low > 1)
        k = middle[:, None] + half[:, None] * _NODES
        return np.asarray(term.power(k, self.count, self.interval) @ _WEIGHTS / 2.0)


@dataclass(frozen=True)
class _Basis:
    edges: NDArray[np.int64]
    ramp: Array
    ends: Array
    products: Array


@lru_cache(maxsize=1)
def _basis(count: int, interval: float) -> _Basis:
    """Return what all channels of a log have in common."""
    edges = list(range(1, min(FEW, count)))
    edge = float(FEW)
    while edge < count:
        edges.append(int(edge))
        edge = max(edge * _WIDTH, edge + 1.0)
    bands = np.array([*edges, count], dtype=np.int64)
    ramp, ends = ramp_coefficients(count, interval), end_effects(count)
    odd = ends.copy()
    odd[0::2] = 0.0
    products = np.zeros((3, 3, len(bands) - 1))
    products[0, 0] = np.add.reduceat(ramp**2, bands[:-1])
    products[0, 2] = products[2, 0] = np.add.reduceat(ramp * odd, bands[:-1])
    products[2, 2] = np.add.reduceat(odd**2, bands[:-1])
    products[1, 1] = np.add.reduceat(ends**2, bands[:-1]) - products[2, 2]
    return _Basis(bands, ramp, ends, products)


def _non_negative(normal: Array, right: Array) -> Array:
    """Solve a least-squares problem with non-negative unknowns, given its normal equations, by trying every subset.

    Five unknowns have 32 subsets; the best feasible one is the solution, with no iteration that could go astray.
    """
    count = len(right)
    if count == 0:
        return np.zeros(0)
    size = np.sqrt(np.diag(normal))
    # the small part lets two terms be alike that the record cannot tell apart
    normal, right = normal / np.outer(size, size) + 1e-12 * np.eye(count), right / size
    chosen = (np.arange(1, 2**count)[:, None] >> np.arange(count)) & 1 == 1
    matrices = np.where(chosen[:, :, None] & chosen[:, None, :], normal, np.eye(count))
    solutions = np.linalg.solve(matrices, np.where(chosen, right, 0.0)[:, :, None])[:, :, 0]
    gain = np.where(np.all(solutions >= 0.0, axis=1), solutions @ right, 0.0)
    best = int(np.argmax(gain))
    return np.asarray(solutions[best] / size if gain[best] > 0.0 else np.zeros(count))


class _Model:
    """The likelihood of a table under some terms.

    Attributes:
        terms: p noise terms.
        columns: mean power of each term in each band, (p, b).
        weight: degrees of freedom that a band counts for, (b,); the number of its coefficients, or fewer.
        best: c² at the maximum of the likelihood, (p,).
        top: the logarithm of the likelihood there.
    """

    def __init__(
        self, table: _Table, terms: Sequence[NoiseTerm], columns: Array, weight: Array, start: Array | None = None
    ) -> None:
        self.table, self.terms, self.columns, self.weight = table, list(terms), columns, weight
        self.best, self.top = self.solve({}, start=start)

    def index(self, symbol: str) -> int:
        """Return which of the terms has a symbol."""
        return [term.symbol for term in self.terms].index(symbol)

    def variance(self, squares: Array) -> Array:
        """Return v of every band."""
        return np.asarray(squares @ self.columns + self.table.floor)

    def weighed(self, weight: Array) -> _Model:
        """Return the same terms with other weights."""
        return _Model(self.table, self.terms, self.columns, weight)

    def extended(self, term: NoiseTerm) -> _Model:
        """Return the same weights with one more term."""
        columns = np.concatenate([self.columns, self.table.column(term)[None]])
        return _Model(self.table, [*self.terms, term], columns, self.weight, np.append(self.best, 0.0))

    def ramp_and_ends(self, v: Array) -> tuple[Array, Array]:
        """Return the sizes of ramp and ends by generalised least squares, (3,), and their covariance, (3, 3)."""
        w = self.weight / self.table.number / v
        covariance = np.asarray(np.linalg.inv(self.table.shapes @ w), dtype=np.float64)
        return covariance @ (self.table.shapes_z @ w), covariance

    def eliminated(self, v: Array) -> tuple[Array, Array, float]:
        """Take ramp and ends off, given the variances.

        Returns:
            The remaining power in each band; the part of it that the fit took, expected; the logarithm of the
            determinant of their covariance.
        """
        t = self.table
        size, covariance = self.ramp_and_ends(v)
        power = t.power - 2.0 * size @ t.shapes_z + np.einsum("i,ijb,j->b", size, t.shapes, size)
        taken = np.einsum("ij,ijb->b", covariance, t.shapes)
        return np.maximum(power, 0.0), taken, float(np.linalg.slogdet(covariance)[1])

    def evaluate(self, v: Array) -> tuple[Array, float]:
        """Return each band's power without ramp and ends, and the logarithm of the restricted likelihood."""
        power, taken, determinant = self.eliminated(v)
        terms = self.weight * (np.log(v) + power / (self.table.number * v))
        return (power + taken) / self.table.number, -0.5 * (float(terms.sum()) - determinant)

    def solve(self, held: Mapping[int, float], start: Array | None = None) -> tuple[Array, float]:
        """Maximise the likelihood over c² ≥ 0.

        Args:
            held: terms that are held, and their c².
            start: c² to begin with.

        Returns:
            c², (p,), and the logarithm of the likelihood.
        """
        t = self.table
        free = [i for i in range(len(self.terms)) if i not in held]
        squares = np.zeros(len(self.terms)) if start is None else start.copy()
        squares[list(held)] = list(held.values())
        fixed = squares[list(held)] @ self.columns[list(held)] + t.floor
        v = self.variance(squares)
        if start is None:  # the record's own power, smoothed
            few = np.ones(9)
            v = np.convolve(t.power, few, "same") / np.convolve(t.number, few, "same") + t.floor
        power, top = self.evaluate(v)
        if start is None:
            top = -math.inf
        for _ in range(_STEPS):
            scaled = self.columns[free] / v
            right = scaled @ (self.weight * (power - fixed) / v)
            wanted = squares.copy()
            wanted[free] = _non_negative((scaled * self.weight) @ scaled.T, right)
            before, part = top, 1.0
            while True:
                trial = squares + part * (wanted - squares) if math.isfinite(before) else wanted
                v = self.variance(trial)
                power, top = self.evaluate(v)
                if top >= before or part < 1e-3:
                    break
                part *= 0.5
            if top < before:  # no step leads up: this is the top, to rounding
                return squares, before
            squares = trial
            if top - before < _CLOSE:
                break
        return squares, top

    def loss(self, held: Mapping[int, float]) -> float:
        """Return twice the loss in the logarithm of the likelihood when c² of some terms are held."""
        return 2.0 * (self.top - self.solve(held, start=self.best)[1])

    def departures(self, weight: Array) -> Array:
        """Return how far each band lies from the fit, in standard deviations.

        Args:
            weight: degrees of freedom ν of the bands, (b,).

        Returns:
            Signed roots of the deviance ν(r − 1 − ln r), r the band's power over the fit's, (b,).
        """
        v = self.variance(self.best)
        power, taken, _ = self.eliminated(v)
        ratio = np.maximum((power + taken) / (self.table.number * v), 1e-300)
        deviance = weight * (ratio - 1.0 - np.log(ratio))
        return np.asarray(np.sign(ratio - 1.0) * np.sqrt(np.maximum(deviance, 0.0)))

    def misfit(self) -> float:
        """Return by how many standard deviations the deviance of all bands is above its expectation."""
        from scipy.special import digamma, polygamma

        weight = self.weight[self.weight > 0.0]
        half = 0.5 * weight
        deviance = float(np.sum(self.departures(self.weight) ** 2)) + np.count_nonzero(self.best)
        # of ν(r − 1 − ln r), νr being distributed as χ² with ν degrees of freedom
        expected = float(np.sum(weight * (np.log(half) - digamma(half))))
        variance = float(np.sum(weight**2 * (polygamma(1, half) - 1.0 / half)))
        return (deviance - expected) / math.sqrt(variance)


@dataclass(frozen=True)
class _Calibrated:
    """A model whose bands weigh what they should.

    Attributes:
        model: the model.
        whole: the same before any band was left out.
        misfit: relative uncertainty that its spectrum has been given.
        aside: bands that are left out, (b,).
    """

    model: _Model
    whole: _Model
    misfit: float
    aside: NDArray[np.bool_]


def _calibrated(table: _Table, terms: Sequence[NoiseTerm]) -> _Calibrated:
    """Fit, and weigh the bands by what is known of the terms' spectra."""
    columns = np.stack([table.column(term) for term in terms])
    model = _Model(table, terms, columns, table.number)
    table.take_off(model.ramp_and_ends(model.variance(model.best))[0])
    model = _Model(table, terms, columns, table.number)
    drift = [i for i, term in enumerate(terms) if term.symbol not in ("Q", "N")]
    share = model.best[drift] @ model.columns[drift] / model.variance(model.best)
    # One way to take the mean over a sample differs from another by about ⅙(1 − cos 2πfT) of the drift's power.
    unsure = share * (1.0 - np.cos(table.angle)) / 6.0
    number = table.number / (1.0 + 0.5 * table.number * unsure**2)
    aside = np.zeros(len(number), dtype=np.bool_)
    model, misfit = _uniform_misfit(model, number)
    whole = model
    if misfit == 0.0 and np.max(np.abs(model.departures(number))) < _BY_CHANCE:
        return _Calibrated(model, whole, misfit, aside)
    for _ in range(_ROUNDS):
        far = np.abs(model.departures(number / (1.0 + 0.5 * number * misfit**2))) > _FAR
        if np.array_equal(far, aside) or np.mean(far) > _MOST_ASIDE:
            break
        aside = far
        model, misfit = _uniform_misfit(model, np.where(aside, 0.0, number))
    return _Calibrated(model, whole, misfit, aside)


def _uniform_misfit(model: _Model, weight: Array) -> tuple[_Model, float]:
    """Fit with the relative uncertainty of all bands' powers that makes the misfit what it should be."""
    plain = model.weighed(weight)
    if model.table.rounded or plain.misfit() < _DOUBTFUL:
        return plain, 0.0

    def uncertain(relative: float) -> _Model:
        return model.weighed(weight / (1.0 + 0.5 * weight * relative**2))

    low, high = 0.0, 0.01
    while uncertain(high).misfit() > 0.0 and high < 10.0:
        low, high = high, 2.0 * high
    for _ in range(5):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if uncertain(middle).misfit() > 0.0 else (low, middle)
    return uncertain(high), high


def _search(model: _Model) -> tuple[float, float, float]:
    """Look for a Gauss-Markov bias beside the terms of a model.

    Returns:
        Its correlation time, its σ_b, and twice the gain in the logarithm of the likelihood.
    """
    from scipy.optimize import minimize_scalar

    table = model.table
    length = table.count * table.interval

    def gain(log_time: float) -> float:
        return 2.0 * (model.extended(gauss_markov(math.exp(log_time))).top - model.top)

    grid = np.linspace(math.log(_QUICKEST * table.interval), math.log(0.5 * length), _TIMES)
    gains = [gain(x) for x in grid]
    i = int(np.argmax(gains))
    if i == 0 or gains[i] < _POSSIBLE:  # at the first, something quicker than a bias is to be described
        return 0.0, 0.0, 0.0
    around = (grid[i - 1], grid[min(i + 1, _TIMES - 1)])
    top = minimize_scalar(lambda x: -gain(x), bounds=around, method="bounded", options={"xatol": 1e-3})
    time = math.exp(top.x)
    return time, math.sqrt(model.extended(gauss_markov(time)).best[-1]), -float(top.fun)


def _times(model: _Model, found: float) -> list[float]:
    """Return correlation times across their own 95 % band, which the other coefficients' bands have to allow for."""
    from scipy.optimize import brentq

    inner = _Model(model.table, model.terms[:-1], model.columns[:-1], model.weight)

    def outside(log_time: float) -> float:
        return 2.0 * (model.top - inner.extended(gauss_markov(math.exp(log_time))).top) - _LIMIT

    x = math.log(found)
    ends = []
    for sign, farthest in ((-1.0, math.log(model.table.interval)), (1.0, x + math.log(1e3))):
        step = 0.2
        while abs(step) < abs(farthest - x) and outside(x + sign * step) < 0.0:
            step *= 1.6
        end = x + sign * step
        ends.append(brentq(outside, x, end, xtol=0.02) if outside(x) < 0.0 < outside(end) else end)
    return [found, *(math.exp(end) for end in np.linspace(ends[0], ends[1], 5))]


def _band(model: _Model, i: int, limit: float = _LIMIT) -> tuple[float, float]:
    """Return the band of c of one term in which twice the logarithm of the likelihood loses less than a limit."""
    from scipy.optimize import brentq

    best = float(model.best[i])

    def outside(log_square: float) -> float:
        return model.loss({i: math.exp(log_square)}) - limit

    # A value that would show as clearly as all the noise there is, to begin with for a term that is not seen.
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


def _ramp_band(model: _Model) -> tuple[float, float, float]:
    """Return the most likely ramp and its 95 % band, less the table's own ramp.

    Given the noise, the ramp is a normal number. How much noise there is near its frequency is known from a few
    coefficients only: the band is that of normal distributions mixed over the rate random walk, each with the
    restricted likelihood of its K, as a t-distribution is that of normal ones mixed over their variance.
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
        found, covariance = model.ramp_and_ends(v)
        sizes[j], sigmas[j] = found[0], math.sqrt(covariance[0, 0])
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


def _needed(model: _Model, last: Sequence[str]) -> set[int]:
    """Return the terms without which the record is not described; the others are dropped, the least missed first.

    Args:
        model: all terms.
        last: symbols of terms that go only after all others that can.

    Returns:
        Numbers of the terms that stay.
    """
    stay, top = set(range(len(model.terms))), model.top
    while len(stay) > 1:
        losses = {}
        for i in stay:
            held = {j: 0.0 for j in range(len(model.terms)) if j not in stay or j == i}
            losses[i] = 2.0 * (top - model.solve(held, start=model.best)[1])
        dispensable = [i for i in stay if losses[i] < _LIMIT]
        if not dispensable:
            break
        drop = min(dispensable, key=lambda i: (model.terms[i].symbol in last, losses[i]))
        stay.remove(drop)
        top -= 0.5 * losses[drop]
    return stay


def _result(fit: _Calibrated, times: Sequence[float], mean: float, possible: tuple[float, float] | None) -> NoiseFit:
    model, table = fit.model, fit.model.table
    stay = set() if table.rounded else _needed(model, ("N", "sigma_b") if len(times) == 1 else ("N",))
    squares, _ = model.solve({i: 0.0 for i in range(len(model.terms)) if i not in stay}, start=model.best)
    likely = {term.symbol: math.sqrt(c) for term, c in zip(model.terms, squares, strict=True)}
    bands = _bands(model, times)
    # What drift adds to white noise by how it passes within a sample, at most; the rounding of numbers in a computer.
    inside = 0.5 * likely["K"] * table.interval + 0.7 * likely["B"] * math.sqrt(table.interval)
    if times:
        inside += likely["sigma_b"] * math.sqrt(0.5 / times[0]) * table.interval
    if likely["N"] < inside:
        bands["N"] = (0.0, max(bands["N"][1], inside))
        stay -= {model.index("N")}
        likely["N"] = 0.0
    estimates = {}
    for i, term in enumerate(model.terms):
        low, high = bands[term.symbol]
        value = likely[term.symbol] if i in stay else None
        # The band is that of all terms, the value that of those which stay.
        estimates[term.symbol] = (
            Estimate(None, low, high) if value is None else Estimate(value, min(low, value), max(high, value))
        )
    ramp, low, high = (table.ramp + r for r in _ramp_band(model))
    seen = low > 0.0 or high < 0.0
    estimates["R"] = Estimate(ramp if seen else None, low, high)
    likely["R"] = ramp if seen else 0.0
    return NoiseFit(
        estimates,
        likely,
        times[0] if times else None,
        (min(times), max(times)) if len(times) > 1 else None,
        table.interval,
        table.count,
        mean,
        fit.misfit,
        _ranges(table, fit.aside),
        tuple(sorted(model.terms[i].symbol for i in stay if bands[model.terms[i].symbol][0] == 0.0)),
        possible,
    )


def _ranges(table: _Table, aside: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """Return bands that are left out as ranges of frequency, Hz, neighbours joined."""
    steps = np.flatnonzero(np.diff(np.concatenate([[0], aside.astype(np.int8), [0]])))
    hertz = table.edges / (2.0 * table.count * table.interval)
    return tuple((float(hertz[a]), float(hertz[b])) for a, b in zip(steps[0::2], steps[1::2], strict=True))


def _bands(model: _Model, times: Sequence[float]) -> dict[str, tuple[float, float]]:
    """Return the 95 % bands of all terms' coefficients."""
    bands: dict[str, tuple[float, float]] = {}
    inner = _Model(model.table, model.terms[:-1], model.columns[:-1], model.weight) if len(times) > 1 else model
    for time in times or [0.0]:
        other = inner.extended(gauss_markov(time)) if len(times) > 1 else model
        limit = _LIMIT - 2.0 * (model.top - other.top)
        if limit <= 0.0:
            continue
        for i, term in enumerate(model.terms):
            low, high = _band(other, i, limit * (_uniformity(other) if term.symbol == "Q" else 1.0))
            before = bands.get(term.symbol, (low, high))
            bands[term.symbol] = (min(low, before[0]), max(high, before[1]))
    return bands


def _uniformity(model: _Model) -> float:
    """Return the variance of Q² over what it would be if the rounding errors were normal numbers.

    For independent errors with the fourth cumulant κ₄, the inverse of Fisher's information gains κ₄/n in its element of
    Q² and nowhere else: uniform errors, κ₄ = −1.2 Q⁴, are known better than normal ones.
    """
    i = model.index("Q")
    active = [j for j in range(len(model.terms)) if model.best[j] > 0.0]
    if i not in active:
        return 1.0
    v = model.variance(model.best)
    scaled = model.columns[active] * model.best[active, None] / v
    information = 0.5 * (scaled * model.weight) @ scaled.T
    variance = float(np.linalg.inv(information)[active.index(i), active.index(i)])
    fourth = min(max(model.table.fourth / float(model.best[i]) ** 2, -1.2), 0.0)
    return 1.0 + fourth / (model.table.count * variance)
