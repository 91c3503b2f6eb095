"""The verdict of an ensemble on a requirement (met, not met, or undecided at 95 % confidence), and first exceedance.

A circle's requirement says that at least the share p of all runs lies within the limit. Of N runs, k do, and the exact
binomial interval of the share (Clopper and Pearson, Biometrika 26, 1934, 404) decides: met if it lies above p, not met
if it lies below. No distribution of the errors is assumed. A component's requirement concerns a root mean square σ,
whose interval follows from N s²/σ² ~ χ² with N degrees of freedom, for normal errors.

Throughout a run, the requirement is met if it is met at every instant, each at 95 %. It is not met if it is not met at
one instant, with the probability of error divided by the number of instants.

Several looks at an ensemble that grows until the requirement is decided err more often than one look. Each of L looks
is then given a probability of error of 5 %/L, so that all of them err with at most 5 % (Bonferroni).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.formatting import number_text
from sinssim.statistics.chi_square import root_mean_square_band
from sinssim.statistics.percentiles import percentile
from sinssim.statistics.requirements import CIRCLES, COMPONENTS, SHARES, Requirement


@dataclass(frozen=True)
class Exceeded:
    """The first time at which a limit is exceeded."""

    time: float  # the time, s since the start
    fixes_end: float | None = None
    """Time of the last fix before it, if it lies in an outage, s since the start; None otherwise."""

    @property
    def text(self) -> str:
        """In words: "exceeded from 1319 s, 119 s after the fixes end"."""
        shown = float(round(self.time) if self.time >= 100.0 else f"{self.time:.3g}")
        text = f"exceeded from {shown:.10g} s" if shown else "exceeded from the start"
        if self.fixes_end is None:
            return text
        return f"{text}, {max(shown - self.fixes_end, 0.0):.4g} s after the fixes end"

    @property
    def after_fixes_end(self) -> float | None:
        """How long after the last fix it is, s; None outside an outage."""
        return None if self.fixes_end is None else self.time - self.fixes_end


def first_exceeded(
    requirement: Requirement, time: Array, values: Array, outages: Sequence[tuple[float, float]] = ()
) -> Exceeded | None:
    """Return since when a requirement over the whole run is exceeded; None if it is not, or holds at one time only.

    Values at the instants `time`, (E,) s since the start, are in SI, NaN where unknown; the first time is on the
    straight line between two instants. Outages without fixes have beginning and end, s since the start, and may
    overlap.
    """
    above = np.flatnonzero(values > requirement.limit)
    if requirement.when != "run" or not len(above):
        return None
    first = int(above[0])
    at, value = float(time[first]), float(values[first])
    if first > 0 and np.isfinite(value) and np.isfinite(values[first - 1]):
        before = float(values[first - 1])
        at -= (at - float(time[first - 1])) * (value - requirement.limit) / (value - before)
    ended = [begin for begin, end in outages if begin <= at <= end]
    while ended and (earlier := [begin for begin, end in outages if begin < min(ended) <= end]):
        ended = earlier
    return Exceeded(at, min(ended, default=None))


CONFIDENCE = 0.95
Counts = NDArray[np.signedinteger[Any]]
Word = Literal["met", "not met", "undecided"]


@dataclass(frozen=True)
class VerdictInUnit:
    """A verdict in the unit of the requirement, as files have it."""

    requirement: str  # the requirement as it was written
    verdict: Word  # "met" or "not met"; of an ensemble with 95 % confidence, or "undecided"
    value: float
    limit: float  # value, limit: quantity and limit in the `unit`
    unit: str
    time_s: float  # instant of the value, s since the start
    more_runs: int | None = 0  # about how many more runs would decide; 0 if decided, None if they cannot be counted
    exceeded_from_s: float | None = None
    """Since when the limit is exceeded, throughout a run, s since the start; None if it is not."""
    after_fixes_end_s: float | None = None  # how long after the last fix this is, s; None outside an outage

    @property
    def text(self) -> str:
        """The value, and since when the limit is exceeded, in words; "" if no run has a solution."""
        if math.isnan(self.value):
            return ""
        value = f"{number_text(self.value)} {self.unit}" if math.isfinite(self.value) else "∞"
        text = f"{value} at {self.time_s:g} s"
        if self.exceeded_from_s is None:
            return text
        after = self.after_fixes_end_s
        return f"{text}, {Exceeded(self.exceeded_from_s, None if after is None else self.exceeded_from_s - after).text}"


@dataclass(frozen=True)
class Verdict:
    """The verdict of N runs, or without scatter of a covariance."""

    requirement: Requirement  # the requirement
    verdict: Word  # "met", "not met" or "undecided"
    value: float  # quantity of these runs, SI; of the instant nearest to the limit, throughout a run
    time: float  # that instant, s since the start
    runs: int  # N
    more_runs: int | None
    """About how many more runs decide if the further ones are like these; 0 if decided, None if more runs than can be
    counted.
    """
    exceeded: Exceeded | None = None
    """Since when the quantity of these runs exceeds the limit, throughout a run; None if it does not."""

    @classmethod
    def certain(cls, requirement: Requirement, value: float, time: float, exceeded: Exceeded | None) -> Verdict:
        """Return the verdict on a value that has no scatter, SI."""
        return cls(requirement, "met" if value <= requirement.limit else "not met", value, time, 0, 0, exceeded)

    @property
    def in_unit(self) -> VerdictInUnit:
        """The verdict in the unit of its requirement."""
        requirement, since, size = self.requirement, self.exceeded, self.requirement.unit_size
        return VerdictInUnit(
            requirement.text, self.verdict, self.value / size, requirement.limit / size, requirement.unit, self.time,
            self.more_runs, None if since is None else since.time, None if since is None else since.after_fixes_end,
        )  # fmt: skip


def columns_of(requirement: Requirement) -> tuple[int, ...]:
    """Return the places of the errors that a requirement concerns: 0 and 1 for a circle, else one of `COMPONENTS`."""
    return (0, 1) if requirement.quantity in CIRCLES else (COMPONENTS.index(requirement.quantity),)


def errors_of(errors: Sequence[Array]) -> Array:
    """Return the horizontal distance, or the component, (N, E), of the errors of `columns_of`, (N, E) SI each."""
    return np.asarray(np.hypot(*errors) if len(errors) > 1 else errors[0])


@dataclass(frozen=True)
class Tally:
    """What a requirement needs to know of the errors of N runs at E instants; several are joined by `joined`."""

    value: Array  # percentile, or root mean square, of the runs that count, (E,) SI; NaN where none counts
    count: Counts  # number of runs that count, (E,)
    inside: Counts  # number of runs within the limit, (E,)
    runs: int  # N


def joined(tallies: Sequence[Tally]) -> Tally:
    """Return the tally of all instants of several ones, of the same runs, in the order of the instants."""
    value, count, inside = (
        np.concatenate([getattr(part, name) for part in tallies]) for name in ("value", "count", "inside")
    )
    return Tally(value, count, inside, tallies[0].runs)


def tally(requirement: Requirement, time: Array, errors: Array, counts: NDArray[np.bool_] | None = None) -> Tally:
    """Count how the errors of an ensemble lie to a requirement.

    They are of each run at the instants `time`, (E,) s since the start, in SI, (N, E): the horizontal distance for cep,
    r95 and rate, else the component; NaN or infinite for a failed run, which counts as infinitely far off. A run need
    not count at each instant, (N, E): a shorter one does not after its end.
    """
    instants, values = np.asarray(time, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if values.ndim != 2 or values.shape[1:] != instants.shape or not len(values) or not len(instants):
        raise InputError(
            f"errors have the shape {values.shape}; N runs at {len(instants)} times need (N, {len(instants)})."
        )
    counted = np.ones(values.shape, np.bool_) if counts is None else counts
    distance = np.where(np.isfinite(values), np.abs(values), np.inf)
    distance[~counted] = np.nan
    if requirement.quantity == "rate":
        distance = distance / instants
    count, inside = counted.sum(axis=0), np.count_nonzero(distance <= requirement.limit, axis=0)
    value = np.full(len(instants), np.nan)
    some = count > 0
    if requirement.quantity in SHARES:  # the R95 and CEP that are shown
        value[some] = percentile(distance[:, some], SHARES[requirement.quantity]).value
    else:
        value[some] = np.sqrt(np.nanmean(distance[:, some] ** 2, axis=0))
    return Tally(value, count, inside, len(values))


def verdict_of(
    requirement: Requirement,
    time: Array,
    tallied: Tally,
    error: float = 1.0 - CONFIDENCE,
    outages: Sequence[tuple[float, float]] = (),
) -> Verdict:
    """Judge a requirement by a tally at the instants `time`, (E,) s since the start, with outages."""
    there = tallied.count > 0
    time, runs = time[there], tallied.runs
    if not len(time):
        return Verdict(requirement, "undecided", float("nan"), float("nan"), runs, None)
    value, count, inside = tallied.value[there], tallied.count[there], tallied.inside[there]
    low, high, need = _limits(requirement, value, count, inside, error)
    if len(time) > 1:  # "not met" anywhere needs a smaller probability of error
        low = _limits(requirement, value, count, inside, error / len(time))[0]
    refuted = low > requirement.limit
    exceeded = first_exceeded(requirement, time, value, outages)
    worst = int(np.argmax(value))
    if refuted.any():
        worst = int(np.argmax(np.where(refuted, value, -np.inf)))
        return Verdict(requirement, "not met", float(value[worst]), float(time[worst]), runs, 0, exceeded)
    if (high <= requirement.limit).all():
        return Verdict(requirement, "met", float(value[worst]), float(time[worst]), runs, 0)
    open_ones = high > requirement.limit
    most = float(np.max((need / (count / runs))[open_ones]))
    more = None if not np.isfinite(most) else max(int(np.ceil(most)) - runs, 1)
    return Verdict(requirement, "undecided", float(value[worst]), float(time[worst]), runs, more, exceeded)


def _limits(
    requirement: Requirement, value: Array, count: Counts, inside: Counts, error: float
) -> tuple[Array, Array, Array]:
    """Return lower and upper limit of a quantity as far as they concern the requirement's, and runs needed."""
    if requirement.quantity in SHARES:
        return _share(SHARES[requirement.quantity], count, inside, error)
    return _mean_square(requirement.limit, value, count, error)


def _share(share: float, count: Counts, inside: Counts, error: float) -> tuple[Array, Array, Array]:
    from scipy.special import ndtri
    from scipy.stats import beta

    lowest = np.where(inside > 0, beta.ppf(0.5 * error, np.maximum(inside, 1), count - inside + 1), 0.0)
    highest = np.where(inside < count, beta.ppf(1.0 - 0.5 * error, inside + 1, np.maximum(count - inside, 1)), 1.0)
    # the percentile is at most the limit where the share within the limit is at least p
    high = np.where(lowest >= share, 0.0, np.inf)
    low = np.where(highest < share, np.inf, 0.0)
    off = np.abs(inside / count - share)
    with np.errstate(divide="ignore"):
        need = ndtri(0.5 * error) ** 2 * share * (1.0 - share) / off**2
    least = np.log(0.5 * error) / np.log(share)  # runs, all of which lie inside
    return low, high, np.where(inside == count, least, np.maximum(need, least))


def _mean_square(limit: float, value: Array, count: Counts, error: float) -> tuple[Array, Array, Array]:
    from scipy.special import ndtri

    low, high = root_mean_square_band(value, count, error)
    with np.errstate(divide="ignore"):
        need = 0.5 * (ndtri(0.5 * error) / (value / limit - 1.0)) ** 2
    return low, high, need
