"""The verdict of an ensemble of runs on a requirement: met, not met, or undecided at 95 % confidence.

A circle's requirement says that at least the share p of all runs lies within the limit. Of N runs, k do, and the exact
binomial interval of the share (Clopper and Pearson, Biometrika 26, 1934, 404) decides: met if it lies above p, not met
if it lies below. No distribution of the errors is assumed. A component's requirement concerns a root mean square σ,
whose interval follows from N s²/σ² ~ χ² with N degrees of freedom, for normal errors.

Throughout a run, the requirement is met if it is met at every instant, each at 95 %. It is not met if it is not met at
one instant, with the probability of error divided by the number of instants.

Who looks several times while runs are added, and stops once it is decided, errs more often than who looks once. Each of
L looks is then given a probability of error of 5 %/L, so that all together err with at most 5 % (Bonferroni).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.requirements.requirement import COMPONENTS, SHARES, Requirement
from sinssim.statistics.order_statistics import percentile

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Verdict:
    """The verdict of N runs.

    Attributes:
        requirement: the requirement.
        verdict: "met", "not met" or "undecided".
        value: quantity of these runs, SI; of the instant nearest to the limit, throughout a run.
        time: that instant, s since the start.
        runs: N.
        more_runs: about how many more runs decide if the further ones are like these; 0 if decided, None if more runs
            than can be counted.
    """

    requirement: Requirement
    verdict: Literal["met", "not met", "undecided"]
    value: float
    time: float
    runs: int
    more_runs: int | None


def errors_of(requirement: Requirement, errors: Array) -> Array:
    """Return the errors that a requirement judges.

    Args:
        requirement: the requirement.
        errors: position, velocity (north, east, down) and attitude errors of N runs at E instants, (N, E, 9) SI.

    Returns:
        The horizontal distance, or the component, (N, E).
    """
    if requirement.quantity in SHARES:
        return np.asarray(np.hypot(errors[:, :, 0], errors[:, :, 1]))
    return np.asarray(errors[:, :, COMPONENTS.index(requirement.quantity)])


def verdict(
    requirement: Requirement,
    time: Array,
    errors: Array,
    counts: NDArray[np.bool_] | None = None,
    error: float = 1.0 - CONFIDENCE,
) -> Verdict:
    """Judge a requirement by the errors of an ensemble of runs.

    Args:
        requirement: the requirement.
        time: instants, (E,) s since the start.
        errors: of each run at these instants, SI: horizontal distance for cep, r95 and rate, else the component; NaN or
            infinite for a failed run, which counts as infinitely far off; (N, E).
        counts: whether a run counts at an instant, (N, E); by default each does. A shorter run does not after its end.
        error: probability of error, 5 %, or less if several looks share it.

    Returns:
        The verdict at a confidence of 1 - error. Instants at which no run counts are left out; if none is left, it is
        undecided, and the value is NaN.

    Raises:
        InputError: the shapes do not fit, there is no run, or the time of the requirement is not among the instants.
    """
    instants, found = np.asarray(time, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if found.ndim != 2 or found.shape[1:] != instants.shape or not len(found) or not len(instants):
        raise InputError(
            f"errors have the shape {found.shape}; N runs at {len(instants)} instants need ({'N'}, {len(instants)})."
        )
    columns = _columns(requirement, instants)
    counted = np.ones((len(found), len(columns)), np.bool_) if counts is None else counts[:, columns]
    columns, counted = columns[counted.any(axis=0)], counted[:, counted.any(axis=0)]
    if not len(columns):
        return Verdict(requirement, "undecided", float("nan"), float("nan"), len(found), None)
    distance = np.where(np.isfinite(found[:, columns]), np.abs(found[:, columns]), np.inf)
    distance[~counted] = np.nan
    if requirement.quantity == "rate":
        distance = distance / instants[columns]
    judge = _share if requirement.quantity in SHARES else _mean_square
    value, low, high, need = judge(requirement, distance, error)
    if len(columns) > 1:  # "not met" anywhere needs a smaller probability of error
        low = judge(requirement, distance, error / len(columns))[1]
    refuted = low > requirement.limit
    worst = int(np.argmax(value))
    if refuted.any():
        worst = int(np.argmax(np.where(refuted, value, -np.inf)))
        return Verdict(requirement, "not met", float(value[worst]), float(instants[columns[worst]]), len(found), 0)
    if (high <= requirement.limit).all():
        return Verdict(requirement, "met", float(value[worst]), float(instants[columns[worst]]), len(found), 0)
    open_ones = high > requirement.limit
    most = float(np.max((need / counted.mean(axis=0))[open_ones]))
    more = None if not np.isfinite(most) else max(int(np.ceil(most)) - len(found), 1)
    return Verdict(requirement, "undecided", float(value[worst]), float(instants[columns[worst]]), len(found), more)


def _columns(requirement: Requirement, instants: Array) -> NDArray[np.intp]:
    if requirement.when == "run":
        return np.arange(len(instants))
    if requirement.when == "end":
        return np.array([len(instants) - 1])
    column = int(np.argmin(np.abs(instants - requirement.time)))
    if abs(float(instants[column]) - requirement.time) > 1e-6:
        raise InputError(
            f"requirement {requirement.text!r}: the runs have no errors at {requirement.time:g} s; the nearest instant "
            f"is {instants[column]:g} s."
        )
    return np.array([column])


def _share(requirement: Requirement, distance: Array, error: float) -> tuple[Array, Array, Array, Array]:
    """Return percentile, lower and upper limit of it as far as they concern the requirement's, and runs needed."""
    from scipy.special import ndtri
    from scipy.stats import beta

    share, count = SHARES[requirement.quantity], np.count_nonzero(~np.isnan(distance), axis=0)
    inside = np.count_nonzero(distance <= requirement.limit, axis=0)
    lowest = np.where(inside > 0, beta.ppf(0.5 * error, np.maximum(inside, 1), count - inside + 1), 0.0)
    highest = np.where(inside < count, beta.ppf(1.0 - 0.5 * error, inside + 1, np.maximum(count - inside, 1)), 1.0)
    # the percentile is at most the limit where the share within the limit is at least p
    high = np.where(lowest >= share, 0.0, np.inf)
    low = np.where(highest < share, np.inf, 0.0)
    value = percentile(distance, share).value  # the R95 and CEP that are shown
    off = np.abs(inside / count - share)
    with np.errstate(divide="ignore"):
        need = ndtri(0.5 * error) ** 2 * share * (1.0 - share) / off**2
    least = np.log(0.5 * error) / np.log(share)  # runs, all of which lie inside
    return value, low, high, np.where(inside == count, least, np.maximum(need, least))


def _mean_square(requirement: Requirement, distance: Array, error: float) -> tuple[Array, Array, Array, Array]:
    from scipy.special import ndtri
    from scipy.stats import chi2

    count = np.count_nonzero(~np.isnan(distance), axis=0)
    value = np.sqrt(np.nanmean(distance**2, axis=0))
    low = value * np.sqrt(count / chi2.ppf(1.0 - 0.5 * error, count))
    high = value * np.sqrt(count / chi2.ppf(0.5 * error, count))
    with np.errstate(divide="ignore"):
        need = 0.5 * (ndtri(0.5 * error) / (value / requirement.limit - 1.0)) ** 2
    return value, low, high, need
