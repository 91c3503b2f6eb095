"""Weights of the bands of a record that the noise terms do not describe completely.

- The behaviour of a bias within a sample matters only near half the sampling frequency and depends on how the sensor or
  its model averages. There, the weight of a band decreases with the fraction of its power due to drift.
- Vibration, filters and temperature, which the terms do not describe, cause a misfit of the bands. Bands with a large
  misfit are excluded. All others get a common relative uncertainty, chosen so that the misfit has its expected value.
  All frequencies then count equally, and all confidence bands widen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.noise_identification.bands import Bands
from sinssim.analyses.noise_identification.likelihood import Likelihood
from sinssim.analyses.noise_identification.terms import NoiseTerm
from sinssim.data import Array

_FAR = 4.0  # standard deviations beyond which a band is excluded
_BY_CHANCE = 5.5  # standard deviations that no band reaches if none is excluded
_MOST_ASIDE = 0.4  # largest excluded fraction of the bands
_ROUNDS = 40  # maximum number of rounds of exclusion
_DOUBTFUL = 4.0  # excess of the misfit over its expectation, in standard deviations


@dataclass(frozen=True)
class Weighed:
    """A likelihood with weighted bands.

    Attributes:
        model: the likelihood.
        whole: the likelihood before bands were excluded.
        misfit: relative uncertainty given to its spectrum.
        aside: excluded bands, (b,).
    """

    model: Likelihood
    whole: Likelihood
    misfit: float
    aside: NDArray[np.bool_]


def weigh(bands: Bands, terms: Sequence[NoiseTerm]) -> Weighed:
    """Fit, and weight the bands by their agreement with the terms.

    Args:
        bands: the record; its ramp is subtracted.
    """
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
    """Return the deviation of each band from the fit, in standard deviations.

    Args:
        weight: degrees of freedom ν of the bands, (b,).

    Returns:
        Signed roots of the deviance ν(r − 1 − ln r), where r is the ratio of the band's power to the fit's, (b,).
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
