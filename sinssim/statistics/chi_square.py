"""Mean normalised squares over runs (ANEES, NIS) and their χ² bands.

The normalised squared errors of N independent runs with n degrees of freedom each add up to χ² with N n degrees of
freedom if the filter states its covariances rightly (Y. Bar-Shalom, X. R. Li and T. Kirubarajan, Estimation with
Applications to Tracking and Navigation, 2001, section 5.4). The mean per degree of freedom is expected to be 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sinssim.arguments import doubles, number
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.system.short_repr import short_repr


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
    """The least probable of several mean normalised squares.

    Attributes:
        place: its index.
        probability: of a value as unlikely in any of them, for a correct filter, at most (Bonferroni).
        limit: value that a correct filter exceeds in any of them with the probability `level`.
        level: that probability.
        tests: number of values that count.
    """

    place: int
    probability: float
    limit: float
    level: float
    tests: int


def extreme(values: Any, freedom: Any, two_sided: Any, level: float) -> Extreme | None:
    """Return the least probable of several mean normalised squares per degree of freedom.

    Args:
        values: (K,), whether they depend on each other or not; NaN does not count.
        freedom: degrees of freedom of each, (K,).
        two_sided: whether a small value of each is unlikely, too, (K,).
        level: probability that a correct filter exceeds the limit in any of them.

    Returns:
        The value with the least probability; None if none counts.
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
