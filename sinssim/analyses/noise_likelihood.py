"""The likelihood of a record for given noise terms, and its maximum.

The record's cosine coefficients z_k (see `allan_deviation`) are taken one by one at low frequencies, then over bands
whose width is 4 % of their frequency, in which the terms hardly change: some 250 sums of squares for millions of
samples. The coefficients z of a band b are n_b independent normal numbers, plus three shapes (ramp and ends) of unknown
sizes u, with the variance

    v_b = Σ_i c_i² p_i(b),   c = Q, N, B, K and, if need be, σ_b                        (1)

With the sum P_b of z² and the products s_b of the shapes, the sizes and their covariance are

    u = C Σ_b (s·z)_b w_b/(n_b v_b),   C⁻¹ = Σ_b s_b w_b/(n_b v_b)                     (2)

and the restricted likelihood, which accounts for the degrees of freedom of u (Patterson and Thompson, Biometrika 58,
1971), is

    ℓ = −½ Σ_b w_b [ln v_b + P_b(u)/(n_b v_b)] + ½ ln det C                           (3)

where P_b(u) is P_b without ramp and ends. The maximum over c_i² ≥ 0 is found by Fisher scoring; each step is a weighted
least-squares fit with non-negative unknowns.

The weight w_b is the number n_b of coefficients, or less for a band that the terms describe less well:

- The behaviour of a bias within a sample matters only near half the sampling frequency and depends on how the sensor or
  its model averages. There, the weight of a band decreases with the fraction of its power due to drift.
- Vibration, filters and temperature, which the terms do not describe, cause a misfit of the bands. Bands with a large
  misfit are excluded. All others get a common relative uncertainty, chosen so that the misfit has its expected value.
  All frequencies then count equally, and all confidence bands widen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.allan_deviation import FEW, NoiseTerm, end_effects, ramp_coefficients
from sinssim.data import Array

_WIDTH = 1.04  # ratio of a band's last to its first frequency
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def rounding(count: int) -> float:
    """Return the relative rounding error of an increment: times of a record of n intervals are rounded to n ε T."""
    return 4.0 * float(np.finfo(np.float64).eps) * count


class Bands:
    """A record as bands of its cosine coefficients, from the departures of its increments from their mean, (n,).

    The last bits of `largest`, the largest increment, limit those of the departures.
    """

    count: int  # increments used; a few at the end may be dropped for a fast transform
    interval: float  # T, s
    edges: NDArray[np.int64]  # first coefficient of each band, and the one after the last, (b+1,)
    number: Array  # coefficients in each band, (b,)
    power: Array  # sum of z² over each band
    shapes_z: Array  # sums of ramp or end effect times z, (3, b)
    shapes: Array  # sums of products of ramp and end effects, (3, 3, b)
    ramp: float  # subtracted from z, SI
    fourth: float  # fourth cumulant of a single rounding error, if all white noise of the angle were such errors, SI
    floor: float  # power of floating-point rounding errors, including those of times
    rounded: bool  # whether the record has no more power than that

    def __init__(self, departures: Array, interval: float, largest: float) -> None:
        from scipy.fft import dct, prev_fast_len

        self.count = prev_fast_len(len(departures), real=True)
        self.interval = interval
        self._basis = _basis(self.count, interval)
        self.edges, self.shapes = self._basis.edges, self._basis.products
        self.number = np.diff(self.edges).astype(np.float64)
        self._z = dct(departures[: self.count], norm="ortho")
        self.ramp = 0.0
        # The ramp for pure rate random walk: the rise between the ends.
        ramp = self._basis.ramp
        weights = np.arange(self.count, dtype=np.float64) ** 2 * ramp
        self.take_off(np.array([float(weights @ self._z / (weights @ ramp)), 0.0, 0.0]))
        self.floor = (rounding(self.count) * largest) ** 2
        self.rounded = float(self.power.sum()) < self.count * self.floor
        second = np.diff(departures)  # rounding errors of the angle q₂ − 2q₁ + q₀: 1 + 2⁴ + 1 fourth cumulants
        squares = second**2
        self.fourth = float(np.mean(squares**2) - 3.0 * np.mean(squares) ** 2) / 18.0

    def take_off(self, sizes: Array) -> None:
        """Subtract approximate ramp and end effects (even, odd coefficients), (3,), which reduces rounding errors."""
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
        """Return a term's mean power in each band, (b,), by Gauss quadrature over wide bands."""
        low, high = self.edges[:-1], self.edges[1:]
        middle, half = 0.5 * (low + high - 1), 0.5 * (high - low) * (high - low > 1)
        k = middle[:, None] + half[:, None] * _NODES
        return np.asarray(term.power(k, self.count, self.interval) @ _WEIGHTS / 2.0)


@dataclass(frozen=True)
class _Basis:
    """Edges of the bands, the shapes of ramp and ends, and the sums of their products over the bands."""

    edges: NDArray[np.int64]
    ramp: Array
    ends: Array
    products: Array


@lru_cache(maxsize=1)
def _basis(count: int, interval: float) -> _Basis:
    """Return the basis common to all channels of a log."""
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


_STEPS = 200  # maximum number of scoring steps
_CLOSE = 1e-5  # tolerance of the log-likelihood


class Likelihood:
    """The likelihood of a record for p terms, at its maximum and elsewhere.

    The search begins at c² = `start`, (p,), or by the record's power; the maximum is `top`, at c² = `best`, (p,).
    `columns` are the mean power of each term in each band, (p, b), and `weight` the degrees of freedom of each band,
    (b,): the number of its coefficients, or fewer.
    """

    def __init__(
        self, bands: Bands, terms: Sequence[NoiseTerm], columns: Array, weight: Array, start: Array | None = None
    ) -> None:
        self.bands, self.terms, self.columns, self.weight = bands, list(terms), columns, weight
        self.best, self.top = self.solve({}, start=start)

    def index(self, symbol: str) -> int:
        """Return the number of the term with a symbol."""
        return [term.symbol for term in self.terms].index(symbol)

    def variance(self, squares: Array) -> Array:
        """Return the variance v of every band's coefficients, (b,), for given c², (p,)."""
        return np.asarray(squares @ self.columns + self.bands.floor)  # (1)

    def weighed(self, weight: Array) -> Likelihood:
        """Return the likelihood with other weights, (b,)."""
        return Likelihood(self.bands, self.terms, self.columns, weight)

    def extended(self, term: NoiseTerm) -> Likelihood:
        """Return the likelihood with an additional term."""
        columns = np.concatenate([self.columns, self.bands.column(term)[None]])
        return Likelihood(self.bands, [*self.terms, term], columns, self.weight, np.append(self.best, 0.0))

    def ramp_and_ends(self, v: Array) -> tuple[Array, Array]:
        """Return the sizes of ramp and ends by generalised least squares, (3,), and their covariance, (3, 3)."""
        w = self.weight / self.bands.number / v
        covariance = np.asarray(np.linalg.inv(self.bands.shapes @ w), dtype=np.float64)
        return covariance @ (self.bands.shapes_z @ w), covariance  # (2)

    def eliminated(self, v: Array) -> tuple[Array, Array, float]:
        """Eliminate ramp and ends, given the variances.

        Returned are the remaining power in each band, the expected power absorbed by the fit, and the logarithm of the
        determinant of their covariance.
        """
        bands = self.bands
        size, covariance = self.ramp_and_ends(v)
        power = bands.power - 2.0 * size @ bands.shapes_z + np.einsum("i,ijb,j->b", size, bands.shapes, size)
        taken = np.einsum("ij,ijb->b", covariance, bands.shapes)
        return np.maximum(power, 0.0), taken, float(np.linalg.slogdet(covariance)[1])

    def evaluate(self, v: Array) -> tuple[Array, float]:
        """Return the mean power of every band for scoring, and the restricted log-likelihood, for variances v, (b,).

        The power is without ramp and ends, and corrected for the noise that these absorb.
        """
        power, taken, determinant = self.eliminated(v)
        terms = self.weight * (np.log(v) + power / (self.bands.number * v))
        return (power + taken) / self.bands.number, -0.5 * (float(terms.sum()) - determinant)  # (3)

    def solve(self, fixed_squares: Mapping[int, float], start: Array | None = None) -> tuple[Array, float]:
        """Maximise the likelihood over c² ≥ 0; return c², (p,), and the log-likelihood."""
        bands = self.bands
        free = [i for i in range(len(self.terms)) if i not in fixed_squares]
        squares = np.zeros(len(self.terms)) if start is None else start.copy()
        squares[list(fixed_squares)] = list(fixed_squares.values())
        fixed = squares[list(fixed_squares)] @ self.columns[list(fixed_squares)] + bands.floor
        v = self.variance(squares)
        if start is None:  # smoothed power of the record
            few = np.ones(9)
            v = np.convolve(bands.power, few, "same") / np.convolve(bands.number, few, "same") + bands.floor
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
            if top < before:  # no step increases it: this is the maximum, to rounding
                return squares, before
            squares = trial
            if top - before < _CLOSE:
                break
        return squares, top

    def loss(self, fixed_squares: Mapping[int, float]) -> float:
        """Return twice the loss of the log-likelihood with c² of some terms held fixed, by their numbers."""
        return 2.0 * (self.top - self.solve(fixed_squares, start=self.best)[1])


def _non_negative(normal: Array, right: Array) -> Array:
    """Solve a least-squares problem with non-negative unknowns, given its normal equations.

    If not all are positive, all subsets are tried: five unknowns have 32, and the best feasible one is the solution. No
    iteration that could fail is needed.
    """
    count = len(right)
    if count == 0:
        return np.zeros(0)
    size = np.sqrt(np.diag(normal))
    # the small addition handles two terms that the record cannot distinguish
    normal, right = normal / np.outer(size, size) + 1e-12 * np.eye(count), right / size
    solution = np.linalg.solve(normal, right)
    if np.all(solution >= 0.0):
        return np.asarray(solution / size)
    chosen = (np.arange(1, 2**count)[:, None] >> np.arange(count)) & 1 == 1
    matrices = np.where(chosen[:, :, None] & chosen[:, None, :], normal, np.eye(count))
    solutions = np.linalg.solve(matrices, np.where(chosen, right, 0.0)[:, :, None])[:, :, 0]
    gain = np.where(np.all(solutions >= 0.0, axis=1), solutions @ right, 0.0)
    best = int(np.argmax(gain))
    return np.asarray(solutions[best] / size if gain[best] > 0.0 else np.zeros(count))


_FAR = 4.0  # standard deviations beyond which a band is excluded
_BY_CHANCE = 5.5  # standard deviations that no band reaches if none is excluded
_MOST_ASIDE = 0.4  # largest excluded fraction of the bands
_ROUNDS = 40  # maximum number of rounds of exclusion
_DOUBTFUL = 4.0  # excess of the misfit over its expectation, in standard deviations


@dataclass(frozen=True)
class Weighed:
    """A likelihood with weighted bands."""

    model: Likelihood  # the likelihood
    whole: Likelihood  # the likelihood before bands were excluded
    misfit: float  # relative uncertainty given to its spectrum
    aside: NDArray[np.bool_]  # excluded bands, (b,)


def weigh(bands: Bands, terms: Sequence[NoiseTerm]) -> Weighed:
    """Fit, and weight the bands by their agreement with the terms; the ramp of `bands` is subtracted."""
    columns = np.stack([bands.column(term) for term in terms])
    model = Likelihood(bands, terms, columns, bands.number)
    bands.take_off(model.ramp_and_ends(model.variance(model.best))[0])
    model = Likelihood(bands, terms, columns, bands.number)
    drift = [i for i, term in enumerate(terms) if term.symbol not in ("Q", "N")]
    share = model.best[drift] @ model.columns[drift] / model.variance(model.best)
    # Different ways of averaging over a sample differ by about ⅙(1 − cos 2πfT) of the drift's power.
    unsure = share * (1.0 - np.cos(bands.angle)) / 6.0
    number = bands.number / (1.0 + 0.5 * bands.number * unsure**2)
    aside = np.zeros(len(number), dtype=np.bool_)
    model, misfit = _uniform_misfit(model, number)
    whole = model
    if misfit == 0.0 and np.max(np.abs(_departures(model, number))) < _BY_CHANCE:
        return Weighed(model, whole, misfit, aside)
    for _ in range(_ROUNDS):
        far = np.abs(_departures(model, number / (1.0 + 0.5 * number * misfit**2))) > _FAR
        if np.array_equal(far, aside) or np.mean(far) > _MOST_ASIDE:
            break
        aside = far
        model, misfit = _uniform_misfit(model, np.where(aside, 0.0, number))
    return Weighed(model, whole, misfit, aside)


def _uniform_misfit(model: Likelihood, weight: Array) -> tuple[Likelihood, float]:
    """Fit with a common relative uncertainty of the bands' powers, chosen so that the misfit is as expected."""
    plain = model.weighed(weight)
    if model.bands.rounded or _misfit(plain) < _DOUBTFUL:
        return plain, 0.0

    def uncertain(relative: float) -> Likelihood:
        return model.weighed(weight / (1.0 + 0.5 * weight * relative**2))

    low, high = 0.0, 0.01
    while _misfit(uncertain(high)) > 0.0 and high < 10.0:
        low, high = high, 2.0 * high
    for _ in range(5):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _misfit(uncertain(middle)) > 0.0 else (low, middle)
    return uncertain(high), high


def _departures(model: Likelihood, weight: Array) -> Array:
    """Return the deviation of each band from the fit, in standard deviations, (b,), for degrees of freedom ν, (b,).

    They are signed roots of the deviance ν(r − 1 − ln r), where r is the ratio of the band's power to the fit's.
    """
    v = model.variance(model.best)
    power, taken, _ = model.eliminated(v)
    ratio = np.maximum((power + taken) / (model.bands.number * v), 1e-300)
    deviance = weight * (ratio - 1.0 - np.log(ratio))
    return np.asarray(np.sign(ratio - 1.0) * np.sqrt(np.maximum(deviance, 0.0)))


def _misfit(model: Likelihood) -> float:
    """Return the excess of the deviance of all bands over its expectation, in standard deviations."""
    from scipy.special import digamma, polygamma

    weight = model.weight[model.weight > 0.0]
    half = 0.5 * weight
    deviance = float(np.sum(_departures(model, model.weight) ** 2)) + np.count_nonzero(model.best)
    # mean and variance of ν(r − 1 − ln r), where νr is distributed as χ² with ν degrees of freedom
    expected = float(np.sum(weight * (np.log(half) - digamma(half))))
    variance = float(np.sum(weight**2 * (polygamma(1, half) - 1.0 / half)))
    return (deviance - expected) / math.sqrt(variance)
