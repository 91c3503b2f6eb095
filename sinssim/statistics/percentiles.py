"""Percentiles over runs with confidence bands, such as CEP and R95, and the spread of an error.

The number B of N independent runs below the true percentile ξ of the share p is binomial, B(N, p), whatever the
distribution of the errors. The order statistics x₍₁₎ ≤ … ≤ x₍N₎ therefore bound ξ with the probabilities

    P(x₍ₗ₎ > ξ) = P(B < l),   P(x₍ᵤ₎ < ξ) = P(B ≥ u)                                                              (2)

(H. A. David and H. N. Nagaraja, Order Statistics, 3rd ed., 2003, section 7.1). No normality is assumed. Each end of a
band has half of the probability that remains. It lies between two neighbouring order statistics, at the place where the
probabilities (2), interpolated linearly, have that value (R. Beran and P. Hall, Interpolated nonparametric prediction
intervals and confidence intervals, J. R. Statist. Soc. B 55, 1993); without interpolation the band of R95 of 200 runs
would hold 96.7 % instead of 95 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from sinssim.arguments import doubles, number
from sinssim.data import Array, short_repr
from sinssim.errors import InputError

CEP_SHARE, R95_SHARE = 0.5, 0.95
"""Shares of the runs within CEP, the circular error probable, and within R95."""


@short_repr
@dataclass(frozen=True)
class Percentile:
    """A percentile over runs.

    Attributes:
        share: share of the runs below it, 0…1.
        value: estimate; a number or (K,), infinite where too many runs failed.
        low, high: ends of its confidence band, of the same shape; infinite where too many runs failed or where there
            are too few runs for an end.
        confidence: probability that the band holds the true percentile.
        runs: number of runs that count, of the same shape.
    """

    share: float
    value: Array
    low: Array
    high: Array
    confidence: float
    runs: Array


def percentile(values: Any, share: float, confidence: float = 0.95) -> Percentile:
    """Return a percentile over runs with its confidence band.

    The estimate is the median-unbiased one, whatever the distribution (R. J. Hyndman and Y. Fan, Sample quantiles in
    statistical packages, The American Statistician 50, 1996, definition 8; numpy's "median_unbiased").

    Args:
        values: one error of each run, (N,), or its course over K epochs, (N, K). The error of a failed run is
            infinite. NaN does not count, for example after the end of a shorter run.
        share: share of the runs, between 0 and 1.
        confidence: probability that the band contains the true percentile.

    Returns:
        The percentile, of the shape () or (K,); NaN where no run counts.

    Raises:
        InputError: values is not an array of one or two axes, or a share is not between 0 and 1.
    """
    array = doubles("values", values)
    if array.ndim > 2 or not len(array):
        raise InputError(f"values has the shape {array.shape}; give (N,) or (N, K) with at least one run.")
    share, confidence = _checked_share("share", share), _checked_share("confidence", confidence)
    columns = np.sort(array.reshape(len(array), -1), axis=0)  # NaN comes last
    counts = len(columns) - np.isnan(columns).sum(axis=0)
    estimates = np.empty((3, columns.shape[1]))
    for n in np.unique(counts):
        there = counts == n
        estimates[:, there] = _of_sorted(columns[:n, there], share, confidence)
    shape = array.shape[1:]
    value, low, high = (row.reshape(shape) for row in estimates)
    return Percentile(share, value, low, high, confidence, counts.astype(np.float64).reshape(shape))


def cep(values: Any, confidence: float = 0.95) -> Percentile:
    """Return CEP, the circular error probable: the radius within which half of the runs are.

    Args:
        values: horizontal (radial) errors, as for `percentile`.
        confidence: as for `percentile`.

    Returns:
        The 50th percentile over the runs, with its band.

    Raises:
        InputError: as for `percentile`.
    """
    return percentile(values, CEP_SHARE, confidence)


def r95(values: Any, confidence: float = 0.95) -> Percentile:
    """Return R95: the radius within which 95 % of the runs are.

    Args:
        values: horizontal (radial) errors, as for `percentile`.
        confidence: as for `percentile`.

    Returns:
        The 95th percentile over the runs, with its band.

    Raises:
        InputError: as for `percentile`.
    """
    return percentile(values, R95_SHARE, confidence)


def runs_for_band(share: float, confidence: float = 0.95) -> int:
    """Return the least number of runs whose band of a percentile has two finite ends.

    Args:
        share: share of the percentile, between 0 and 1.
        confidence: probability of the band.

    Returns:
        The least N with pᴺ and (1 − p)ᴺ at most half of 1 − confidence: 6 for CEP and 72 for R95 at 95 %.

    Raises:
        InputError: a share is not between 0 and 1.
    """
    share, confidence = _checked_share("share", share), _checked_share("confidence", confidence)
    return math.ceil(math.log(0.5 * (1.0 - confidence)) / math.log(max(share, 1.0 - share)) - 1e-12)


def _checked_share(name: str, value: float) -> float:
    share = number(name, value)
    if not 0.0 < share < 1.0:
        raise InputError(f"{name} = {share:g} must be between 0 and 1, for example 0.95.")
    return share


def _of_sorted(columns: Array, share: float, confidence: float) -> Array:
    """Return estimate and band of sorted columns, (3, K)."""
    n, k = columns.shape
    if not n:
        return np.full((3, k), np.nan)
    open_ended = np.concatenate([np.full((1, k), -np.inf), columns, np.full((1, k), np.inf)])
    place = min(max((n + 1.0 / 3.0) * share + 1.0 / 3.0, 1.0), float(n))  # definition 8, counted from 1
    return np.array([_between(open_ended, at) for at in (place, *_ends(n, share, confidence))])


def _between(rows: Array, place: float) -> Array:
    """Interpolate between two rows; an infinite one of the two counts alone."""
    whole = int(place)
    if place == whole:
        return np.asarray(rows[whole])
    below, above = rows[whole], rows[whole + 1]
    with np.errstate(invalid="ignore"):  # infinite errors
        value = below + (place - whole) * (above - below)
    values: Array = np.where(np.isinf(above), above, np.where(np.isinf(below), below, value))
    return values


@lru_cache(maxsize=1024)
def _ends(n: int, share: float, confidence: float) -> tuple[float, float]:
    """Return the places of the band's ends among x₍₁₎ … x₍N₎; 0 or N + 1 if the runs give no bound there."""
    from scipy.stats import binom

    tail = 0.5 * (1.0 - confidence)
    ranks = np.arange(n + 2)
    too_high, too_low = binom.cdf(ranks - 1, n, share), binom.sf(ranks - 1, n, share)  # (2)
    low = int(np.searchsorted(too_high, tail, side="right")) - 1  # the largest l with P(B < l) ≤ tail
    high = n + 1 - (int(np.searchsorted(too_low[::-1], tail, side="right")) - 1)  # the smallest u with P(B ≥ u) ≤ tail
    part = (tail - too_high[low]) / (too_high[low + 1] - too_high[low]) if low else 0.0
    other = (tail - too_low[high]) / (too_low[high - 1] - too_low[high]) if high <= n else 0.0
    return low + float(part), high - float(other)


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation over runs.

    Attributes:
        mean: mean over the runs.
        sigma: root of the sample variance about the mean, Σ(x − x̄)²/(N − 1).
        standard_error: of sigma, σ/√(2N), for errors of a normal distribution.
        runs: number N of runs that count.
    """

    mean: Array
    sigma: Array
    standard_error: Array
    runs: Array


def spread(values: Any) -> Spread:
    """Return mean and standard deviation over runs.

    Args:
        values: errors of N runs, (N, …). A value that is not finite does not count: σ describes the successful runs;
            state the number of failed runs with it.

    Returns:
        Arrays of the shape (…); NaN where fewer than two runs count.

    Raises:
        InputError: values is not an array of numbers.
    """
    array = doubles("values", values)
    if not len(array):
        raise InputError(f"values has the shape {array.shape}; give (N, …) with at least one run.")
    finite = np.isfinite(array)
    count = finite.sum(axis=0).astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(finite, array, 0.0).sum(axis=0) / count
        squares = np.where(finite, array - mean, 0.0) ** 2
        sigma = np.sqrt(squares.sum(axis=0) / np.where(count > 1.0, count - 1.0, np.nan))
        return Spread(np.asarray(mean), np.asarray(sigma), np.asarray(sigma / np.sqrt(2.0 * count)), np.asarray(count))
