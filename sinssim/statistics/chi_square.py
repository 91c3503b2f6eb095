"""χ² bands of mean normalised squares (ANEES, NIS), weighted sums of χ² variables, and tests of redundant systems.

The normalised squared errors of N independent runs with n degrees of freedom each add up to χ² with N n degrees of
freedom if the filter states its covariances rightly (Y. Bar-Shalom, X. R. Li and T. Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, section 5.4). The mean per degree of freedom is expected to be 1.

A sum of squares of correlated normal numbers is distributed as Q = Σ λᵢ χ²ᵢ, λ the eigenvalues of their covariance. Its
tail is that of Lugannani and Rice's saddlepoint approximation (Kuonen, Biometrika 86, 1999, 929): with the cumulant
function K(t) = −½ Σ ln(1 − 2λᵢt) and the root t of K'(t) = q,

    P(Q > q) = 1 − Φ(w + ln(v/w)/w),   w = sgn(t) √(2(tq − K(t))),   v = t √K''(t).                              (1)

Its relative error is a few percent at any probability (12 % for a single λ at 1e-12). A χ² distribution with the same
mean and variance is not enough in the tail, which the largest λ governs: for λ = 1, 0.5, 0.2 and 0.05, each twice, it
gives 4.2e-5 for 1.2e-4, and 1.4e-10 for 5.4e-9.

Redundant systems. The systems navigate the same motion with independent errors of the covariance C(t). The difference d
of the outputs of two of them has the covariance 2C, so that without a fault

    (2) s = dᵀ (2C)⁻¹ d

has a χ² distribution with as many degrees of freedom as the output has components, at every instant. Above the
threshold with a given probability of false alarm, one of the two is faulty. An additional error e of one system makes
the distribution non-central with

    (3) λ = eᵀ (2C)⁻¹ e.

Two systems detect a fault. Three identify the faulty one by majority: both differences with it are above the threshold,
and that of the other two is not. The mid-value of three outputs, component by component, is never that of the faulty
system alone once its error exceeds those of the others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sinssim.arguments import doubles, number
from sinssim.data import Array, short_repr
from sinssim.errors import InputError


@short_repr
@dataclass(frozen=True)
class Band:
    """Band of a mean normalised square per degree of freedom, whose expectation is 1.

    Attributes:
        low, high: ends of the band; NaN without a degree of freedom.
        confidence: probability of a value within it, for a correct filter.
    """

    low: Array
    high: Array
    confidence: float


def mean_square_band(freedom: Any, confidence: float = 0.95) -> Band:
    """Return the band of a mean normalised square per degree of freedom.

    Args:
        freedom: degrees of freedom in all: runs times states (NEES), or runs times measured components (NIS); any
            shape, not negative.
        confidence: probability of the band.

    Returns:
        The two-sided band, with equal tails.

    Raises:
        InputError: freedom is negative, or confidence is not between 0 and 1.
    """
    from scipy.stats import chi2

    count = doubles("freedom", freedom).reshape(np.shape(freedom))
    if np.any(count < 0.0):
        raise InputError(f"freedom = {float(np.min(count)):g} must not be negative.")
    tail = 0.5 * (1.0 - number("confidence", confidence, low=1e-12, high=1.0 - 1e-12))
    some = np.where(count > 0.0, count, np.nan)
    return Band(np.asarray(chi2.ppf(tail, some) / some), np.asarray(chi2.isf(tail, some) / some), confidence)


@short_repr
@dataclass(frozen=True)
class Extreme:
    """The least probable of several mean normalised squares."""

    place: int  # its index
    probability: float  # of a value as unlikely in any of them, for a correct filter, at most (Bonferroni)
    limit: float  # value that a correct filter exceeds in any of them with the probability `level`
    level: float  # that probability
    tests: int  # number of values that count


def extreme(values: Any, freedom: Any, two_sided: Any, level: float) -> Extreme | None:
    """Return the least probable of several mean normalised squares per degree of freedom, (K,); None if none counts.

    They may depend on each other; NaN does not count. A small value of those that are `two_sided` is unlikely, too. A
    correct filter exceeds the limit in any of them with the probability `level`.
    """
    from scipy.stats import chi2

    x, n, both = np.asarray(values, float), np.asarray(freedom, float), np.asarray(two_sided, bool)
    there = np.isfinite(x) & (n > 0.0)
    tests = int(there.sum())
    if not tests:
        return None
    with np.errstate(invalid="ignore"):
        upper, lower = chi2.sf(x * n, n), chi2.cdf(x * n, n)
        single = np.where(there, np.where(both, np.minimum(2.0 * np.minimum(upper, lower), 1.0), upper), np.inf)
        # where probabilities are too small for a number, the one farthest from its expectation, in units of its σ
        far = np.where(there, np.abs(x - 1.0) * np.sqrt(0.5 * n), 0.0)
    place = int(np.lexsort((-far, single))[0])
    tail = level / tests / (2.0 if both[place] else 1.0)
    limit = chi2.ppf(tail, n[place]) if both[place] and x[place] < 1.0 else chi2.isf(tail, n[place])
    return Extreme(place, min(tests * float(single[place]), 1.0), float(limit / n[place]), level, tests)


def share_inside(values: Any, band: Band) -> float:
    """Return the share of epochs at which a mean normalised square lies in its band.

    Args:
        values: (K,); NaN does not count.
        band: its band, of one value or of K.

    Returns:
        0…1; NaN if no epoch counts. Neighbouring epochs are correlated: the share of a correct filter varies about the
        band's confidence.

    Raises:
        InputError: values is not an array of numbers.
    """
    array = doubles("values", values)
    there = np.isfinite(array) & np.isfinite(band.low)
    inside = there & (array >= band.low) & (array <= band.high)
    return float(inside.sum() / there.sum()) if there.any() else float("nan")


_NEAR = 1e-4
"""|w| below which (1) loses its digits: there the tail is interpolated, it is within 1e-4 of ½."""


def upper_tail(weights: Array, value: float) -> float:
    """Return the probability that a weighted sum of χ² variables of one degree of freedom exceeds a value."""
    if value <= 0.0:
        return 1.0
    if not math.isfinite(value):
        return 0.0
    w = weights / weights.max()
    q = value / weights.max()

    def excess(t: float) -> float:
        return float(_slope(w, t) - q)

    low, high = -1.0, 0.5
    while excess(low) > 0.0:
        low *= 2.0
    gap = 0.25
    while excess(high - gap) < 0.0:  # the slope has a pole at ½
        gap *= 0.5
    return _tail(w, float(scipy.optimize.brentq(excess, low, high - gap, xtol=1e-14, rtol=1e-14)))


def quantile(weights: Array, tail: float) -> float:
    """Return the value that a weighted sum of χ² variables of one degree of freedom exceeds with a probability."""
    w = weights / weights.max()
    low, gap = -1.0, 0.25
    while _tail(w, low) < tail:
        low *= 2.0
    while _tail(w, 0.5 - gap) > tail:
        gap *= 0.5
    t = float(scipy.optimize.brentq(lambda t: _tail(w, t) - tail, low, 0.5 - gap, xtol=1e-14, rtol=1e-14))
    return _slope(w, t) * float(weights.max())


def _slope(w: Array, t: float) -> float:
    """Return K'(t)."""
    return float(np.sum(w / (1.0 - 2.0 * w * t)))


def _tail(w: Array, t: float) -> float:
    """Return (1) as a function of the saddlepoint t."""
    part = 1.0 - 2.0 * w * t
    slope, bend = float(np.sum(w / part)), 2.0 * float(np.sum((w / part) ** 2))
    root = 2.0 * (t * slope + 0.5 * float(np.sum(np.log(part))))
    size = math.copysign(math.sqrt(max(root, 0.0)), t)
    if abs(size) < _NEAR:
        # the limit for t → 0: w + ln(v/w)/w → the skewness over 6
        skew = 8.0 * float(np.sum((w / part) ** 3)) / bend**1.5
        return float(scipy.special.ndtr(-(size + skew / 6.0)))
    return float(scipy.special.ndtr(-(size + math.log(t * math.sqrt(bend) / size) / size)))


def root_mean_square_band(value: Array, count: Any, error: float) -> tuple[Array, Array]:
    """Return the ends of the band of a root mean square of `count` normal errors, which holds σ but for an `error`.

    N s²/σ² ~ χ² with N degrees of freedom.
    """
    from scipy.stats import chi2

    low = value * np.sqrt(count / chi2.ppf(1.0 - 0.5 * error, count))
    return low, value * np.sqrt(count / chi2.ppf(0.5 * error, count))


@short_repr
@dataclass(frozen=True)
class ComparedSystems:
    """The comparison of teams of systems."""

    pairs: tuple[tuple[int, int], ...]  # numbers of the two systems of each pair
    statistic: Array  # s of (2), (T, P, E) for T teams, P pairs and E instants; 0 where C is singular
    threshold: float  # with the given probability of false alarm of one test

    @property
    def alarms(self) -> NDArray[np.bool_]:
        """Whether each pair is above the threshold, (T, P, E)."""
        return np.asarray(self.statistic > self.threshold)

    @property
    def detected(self) -> NDArray[np.bool_]:
        """Whether any pair is, (T, E)."""
        return np.asarray(self.alarms.any(axis=1))

    @property
    def identified(self) -> NDArray[np.int64]:
        """Number of the system that majority finds faulty, −1 for none, (T, E)."""
        systems = 1 + max(max(pair) for pair in self.pairs)
        faulty = np.full(self.detected.shape, -1)
        if systems < 3:
            return faulty
        alarms = self.alarms
        for system in range(systems):
            involved = np.array([system in pair for pair in self.pairs])
            faulty[alarms[:, involved].all(axis=1) & ~alarms[:, ~involved].any(axis=1)] = system
        return faulty


def compare_systems(outputs: Any, covariance: Any, false_alarm: float) -> ComparedSystems:
    """Compare the systems of teams with each other.

    The outputs of n ≥ 2 systems in T teams at E instants have k components, (T, n, E, k); their errors would do. The
    covariance is that of one system without a fault, (E, k, k); `false_alarm` is the probability of one test.
    """
    values = doubles("outputs", outputs)
    if values.ndim != 4 or values.shape[1] < 2:
        raise InputError(
            f"outputs has the shape {values.shape}; it must be teams × systems × instants × components with two "
            "systems or more."
        )
    inverse = _inverse(covariance, values.shape[2:])
    pairs = tuple(combinations(range(values.shape[1]), 2))
    differences = np.stack([values[:, i] - values[:, j] for i, j in pairs], axis=1)
    statistic = np.einsum("tpei,eij,tpej->tpe", differences, inverse, differences)
    return ComparedSystems(pairs, statistic, _threshold(false_alarm, values.shape[3]))


def detection_probability(effect: Any, covariance: Any, false_alarm: float) -> Array:
    """Return P{χ²(λ) > threshold} with λ of (3), (E,): that a test of two systems finds a fault of one of them.

    The effect is the error of its output by the fault alone, (E, k); the covariance as for `compare_systems`.
    """
    from scipy.special import chndtr

    values = doubles("effect", effect)
    if values.ndim != 2:
        raise InputError(f"effect has the shape {values.shape}; it must be instants × components.")
    noncentrality = np.einsum("ei,eij,ej->e", values, _inverse(covariance, values.shape), values)
    limit = _threshold(false_alarm, values.shape[1])
    return np.asarray(1.0 - chndtr(limit, values.shape[1], noncentrality))


def mid_value(outputs: Any) -> Array:
    """Return the median of three or more systems by component, (T, E, k), from outputs as for `compare_systems`."""
    return np.asarray(np.median(doubles("outputs", outputs), axis=1))


def _threshold(false_alarm: float, freedom: int) -> float:
    from scipy.special import chdtri

    probability = number("false_alarm", false_alarm)
    if not 0.0 < probability < 1.0:
        raise InputError(f"false_alarm = {probability:g} must be a probability between 0 and 1.")
    return float(chdtri(freedom, probability))


def _inverse(covariance: Any, shape: tuple[int, ...]) -> Array:
    """Return (2C)⁻¹, zero where C is singular, (E, k, k)."""
    matrix = doubles("covariance", covariance)
    if matrix.shape != (*shape, shape[-1]):
        raise InputError(f"covariance has the shape {matrix.shape}; the outputs need {(*shape, shape[-1])}.")
    inverse = np.zeros_like(matrix)
    regular = np.linalg.cond(matrix) < _SINGULAR
    inverse[regular] = np.linalg.inv(2.0 * matrix[regular])
    return inverse


_SINGULAR = 1e12
"""Condition number of a covariance above which there is no test: at the start, where the systems have no errors yet."""
