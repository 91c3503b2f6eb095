"""The evidence of a filter's innovations for one model against another, and the spans in which readings were refused.

With a linear model and normal noise the innovations give the probability density of the readings themselves,

    −2 ln p(z) = Σ (νᵀS⁻¹ν + ln det S) + const                        (Bar-Shalom, Li and Kirubarajan, section 11.2)

A hypothesis with a further state of some prior σ is compared with the filter's own model by the ratio of both, the
Bayes factor. If the own model is right, the expectation of the factor is 1, so that by Markov's inequality it exceeds
n/α for any of n hypotheses with a probability of at most α. Neither a distribution of the estimate nor the number of
readings enters. A size that is fitted instead, such as a factor of σ, is judged by its χ² with one degree of freedom
(Wilks), at α/n as well. Refused readings count with the gate's bound.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from sinssim.estimation.explanation import Refusals
from sinssim.estimation.result import Innovations

FALSE_ALARM = 0.01
"""Probability that any hypothesis is named for a filter whose own model is right."""

FEWEST = 8
"""Fewest readings that are compared."""


def refusals(innovations: Innovations) -> Iterator[Refusals]:
    """Yield the spans in which the gate refused one reading after the other.

    A gate that refuses the share α of correct readings refuses m in a row somewhere among N with a probability of at
    most N αᵐ. Spans of which that is below `FALSE_ALARM` are named.
    """
    tested = np.flatnonzero(np.isfinite(innovations.nis))
    if not len(tested) or not math.isfinite(innovations.bound):
        return
    share = float(scipy.special.chdtrc(innovations.value.shape[1], innovations.bound))
    if not 0.0 < share < 1.0:
        return
    least = max(math.ceil(math.log(FALSE_ALARM / len(tested)) / math.log(share)), 2)
    refused = ~innovations.accepted[tested]
    edges = np.flatnonzero(np.diff(refused.astype(np.int8), prepend=0, append=0))
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if end - begin >= least:
            rows = tested[begin:end]
            off = tuple(float(value) for value in -np.mean(innovations.value[rows], axis=0))
            first, last = innovations.time[rows[[0, -1]]]
            yield Refusals(innovations.sensor, float(first), float(last), end - begin, off)


def gain(own: Sequence[Innovations], other: Sequence[Innovations]) -> float:
    """Return twice the logarithm of the ratio of two models' evidence, over the readings that both were tested on.

    Args:
        other: those of the same readings under a hypothesis.

    Returns:
        2 ln (p(z | hypothesis) / p(z | own)); positive if the hypothesis explains the readings better.
    """
    total = 0.0
    for a, b in zip(own, other, strict=True):
        if len(a.nis) != len(b.nis):
            return -math.inf
        both = np.flatnonzero(np.isfinite(a.nis) & np.isfinite(b.nis))
        total += _deviance(a, both) - _deviance(b, both)
    return total


def _deviance(innovations: Innovations, rows: NDArray[np.intp]) -> float:
    """Return Σ (νᵀS⁻¹ν + ln det S) over some readings."""
    total = 0.0
    for part in np.array_split(rows, max(1, len(rows) // 16384)):
        if len(part):
            total += float(np.sum(np.linalg.slogdet(innovations.covariance_at(part))[1]))
    return total + float(np.sum(np.minimum(innovations.nis[rows], innovations.bound)))


def needed_gain(hypotheses: int, fitted: bool) -> float:
    """Return the gain from which a hypothesis is named.

    Args:
        fitted: whether one size is fitted to the readings, instead of having a prior σ.

    Returns:
        The least 2 ln of the ratio.
    """
    return (
        float(scipy.special.chdtri(1, FALSE_ALARM / hypotheses)) if fitted else 2.0 * math.log(hypotheses / FALSE_ALARM)
    )


def size_of_innovations(innovations: Innovations) -> float:
    """Return how much larger the innovations are than the filter assumes, by the median of their NIS.

    Returns:
        Factor of their σ, 1 if the filter is right; not a number with too few readings. Half of the readings may be
        outliers.
    """
    nis = innovations.nis[np.isfinite(innovations.nis)]
    if len(nis) < FEWEST:
        return math.nan
    return math.sqrt(float(np.median(nis)) / float(scipy.special.chdtri(innovations.value.shape[1], 0.5)))
