"""The verdict of an ensemble of runs on a requirement: met, not met, or undecided at 95 % confidence.

A circle's requirement says that at least the share p of all runs lies within the limit. Of N runs, k do, and the exact
binomial interval of the share (Clopper and Pearson, Biometrika 26, 1934, 404) decides: met if it lies above p, not met
if it lies below. No distribution of the errors is assumed. A component's requirement concerns a root mean square σ,
whose interval follows from N s²/σ² ~ χ² with N degrees of freedom, for normal errors.

Throughout a run, the requirement is met if it is met at every instant, each at 95 %. It is not met if it is not met at
one instant, with the probability of error divided by the number of instants.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.requirements.requirement import COMPONENTS, SHARES, Requirement

CONFIDENCE = 0.95
_TWO_SIDED = 1.959963984540054
"""Normal number that is exceeded in magnitude with a probability of 5 %."""


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


def verdict(requirement: Requirement, time: Array, errors: Array) -> Verdict:
    """Judge a requirement by the errors of an ensemble of runs.

    Args:
        requirement: the requirement.
        time: instants, (E,) s since the start.
        errors: of each run at these instants, SI: horizontal distance for cep, r95 and rate, else the component; NaN or
            infinite for a failed run, which counts as infinitely far off; (N, E).

    Returns:
        The verdict at a confidence of 95 %.

    Raises:
        InputError: the shapes do not fit, there is no run, or the time of the requirement is not among the instants.
    """
    instants, found = np.asarray(time, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if found.ndim != 2 or found.shape[1:] != instants.shape or not len(found) or not len(instants):
        raise InputError(
            f"errors have the shape {found.shape}; N runs at {len(instants)} instants need ({'N'}, {len(instants)})."
        )
    columns = _columns(requirement, instants)
    distance = np.where(np.isfinite(found[:, columns]), np.abs(found[:, columns]), np.inf)
    if requirement.quantity == "rate":
        distance = distance / instants[columns]
    judge = _share if requirement.quantity in SHARES else _mean_square
    value, low, high, need = judge(requirement, distance, 1.0 - CONFIDENCE)
    if len(columns) > 1:  # "not met" anywhere needs a smaller probability of error
        strict = judge(requirement, distance, (1.0 - CONFIDENCE) / len(columns))
        refuted = strict[1] > requirement.limit
    else:
        refuted = low > requirement.limit
    worst = int(np.argmax(value))
    if refuted.any():
        worst = int(np.argmax(np.where(refuted, value, -np.inf)))
        return Verdict(requirement, "not met", float(value[worst]), float(instants[columns[worst]]), len(found), 0)
    if (high <= requirement.limit).all():
        return Verdict(requirement, "met", float(value[worst]), float(instants[columns[worst]]), len(found), 0)
    open_ones = high > requirement.limit
    most = float(np.max(need[open_ones]))
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
    from scipy.stats import beta

    share, count = SHARES[requirement.quantity], len(distance)
    inside = np.count_nonzero(distance <= requirement.limit, axis=0)
    lowest = np.where(inside > 0, beta.ppf(0.5 * error, np.maximum(inside, 1), count - inside + 1), 0.0)
    highest = np.where(inside < count, beta.ppf(1.0 - 0.5 * error, inside + 1, np.maximum(count - inside, 1)), 1.0)
    # the percentile is at most the limit where the share within the limit is at least p
    high = np.where(lowest >= share, 0.0, np.inf)
    low = np.where(highest < share, np.inf, 0.0)
    rank = min(int(np.ceil(share * count)), count) - 1
    value = np.sort(distance, axis=0)[rank]
    off = np.abs(inside / count - share)
    with np.errstate(divide="ignore"):
        need = _TWO_SIDED**2 * share * (1.0 - share) / off**2
    return value, low, high, np.maximum(need, np.log(0.5 * error) / np.log(share))  # even if all lie inside


def _mean_square(requirement: Requirement, distance: Array, error: float) -> tuple[Array, Array, Array, Array]:
    from scipy.stats import chi2

    count = len(distance)
    value = np.sqrt(np.mean(distance**2, axis=0))
    low = value * np.sqrt(count / chi2.ppf(1.0 - 0.5 * error, count))
    high = value * np.sqrt(count / chi2.ppf(0.5 * error, count))
    with np.errstate(divide="ignore"):
        need = 0.5 * (_TWO_SIDED / (value / requirement.limit - 1.0)) ** 2
    return value, low, high, need
