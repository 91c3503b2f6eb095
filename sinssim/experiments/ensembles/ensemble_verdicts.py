"""The verdicts of an ensemble on requirements: which errors count, how often it is looked at, and their words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS
from sinssim.scenario.ensemble_section import MOST_RUNS
from sinssim.simulation.total_system_error import path_column
from sinssim.statistics.chi_square import root_mean_square_band
from sinssim.statistics.circular_error import to_nmi_h
from sinssim.statistics.percentiles import percentile
from sinssim.statistics.requirements import (
    BY_PATH,
    CONFIDENCE,
    MISS,
    SHARES,
    Quantity,
    Requirement,
    Tally,
    Verdict,
    columns_of,
    errors_of,
    joined,
    tally,
    verdict_of,
)
from sinssim.statistics.requirements import COMPONENTS as QUANTITIES
from sinssim.units import number_text, two_digits

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.ensemble_plan import Plan
    from sinssim.experiments.ensembles.ensemble_result import EnsembleResult


LOOKS = 5
"""Most looks at an ensemble that runs until its requirements are decided; the number of runs doubles from one to the
next, so that the last one has 16 times the first number."""


def looks_of(runs: int) -> tuple[int, ...]:
    """Return the numbers of runs after which an ensemble is judged that runs until its requirements are decided."""
    return tuple(sorted({min(runs * 2**look, MOST_RUNS) for look in range(LOOKS)}))


def check_kept(plan: Plan, require: Iterable[Requirement], times: Iterable[float] = ()) -> None:
    """Raise InputError if a time that is asked for, s, is not among the epochs of an ensemble that is continued."""
    elapsed = plan.epochs - plan.start
    wanted = [
        (f"requirement {requirement.text!r}", requirement.time) for requirement in require if requirement.when == "at"
    ]
    for who, time in (*wanted, *((f"times (--at): {time:g} s", time) for time in times)):
        if np.abs(elapsed - time).min() > 1e-6:
            after = int(np.searchsorted(elapsed, time))
            raise InputError(
                f"{who}: the ensemble keeps no errors at {time:g} s, and its files cannot be changed; its nearest "
                f"epochs are {elapsed[after - 1]:.10g} s and {elapsed[after]:.10g} s. Give one of these times, or "
                "begin another ensemble with -o."
            )


def judge(
    result: EnsembleResult, requirement: Requirement, runs: int | None = None, error: float = 1.0 - CONFIDENCE
) -> Verdict:
    """Judge a requirement by the runs of an ensemble, by default all, else a number of `runs`, the first ones.

    A failed run counts as infinitely far off. A run that has ended, or whose filter has not begun, does not count. At
    the end, every run counts with its own end.
    """
    rows = np.ones(len(result), np.bool_) if runs is None else result.errors.number < runs
    failed, elapsed = result.failed[rows], result.elapsed
    by_path = _path_column(result, requirement)
    if by_path and requirement.when == "end":
        errors = _at_end(result.errors.column(by_path))[rows]
        return verdict_of(requirement, elapsed[-1:], _tally(requirement, elapsed[-1:], errors, failed), error)
    if requirement.when == "end":
        errors = errors_of([result.errors.final[rows, place, None] for place in columns_of(requirement)])
        if requirement.quantity == "rate":  # of each run by its own time
            lasts = np.where(failed, elapsed[-1], result.errors.end[rows] - result.plan.start)
            errors = errors * (elapsed[-1] / lasts)[:, None]
        return verdict_of(requirement, elapsed[-1:], _tally(requirement, elapsed[-1:], errors, failed), error)
    epochs = result.errors.spans()
    if requirement.when == "at":
        column = int(np.argmin(np.abs(elapsed - requirement.time)))
        epochs = [slice(column, column + 1)]
    tallies = []
    for some in epochs:
        names = [by_path] if by_path else [COMPONENTS[place] for place in columns_of(requirement)]
        errors = errors_of([result.errors.column(name, some)[rows] for name in names])
        tallies.append(_tally(requirement, elapsed[some], errors, failed))
    aiding = result.plan.scenario.aiding
    outages = () if aiding is None or not result.plan.filtered else aiding.outages
    instants = np.concatenate([elapsed[some] for some in epochs])
    return verdict_of(requirement, instants, joined(tallies), error, outages)


def _path_column(result: EnsembleResult, quantity: Requirement | Quantity) -> str:
    """Return the column of a quantity by the planned path, "" for another one."""
    if quantity.quantity not in (*BY_PATH, MISS):
        return ""
    assert result.plan.scenario.flight is not None  # it was checked before the runs
    return path_column(result.plan.scenario.flight, quantity)


def _at_end(values: Array) -> Array:
    """Return the last known value of each run, (N, 1), of values at the epochs, (N, K)."""
    last = values.shape[1] - 1 - np.argmax(np.isfinite(values[:, ::-1]), axis=1)
    return np.take_along_axis(values, last[:, None], axis=1)


def _tally(requirement: Requirement, instants: Array, errors: Array, failed: NDArray[np.bool_]) -> Tally:
    works = np.isfinite(errors) & ~failed[:, None]
    reached = works.any(axis=0) if not failed.all() else np.ones(len(instants), np.bool_)
    counts = (works | failed[:, None]) & reached
    return tally(requirement, instants, np.where(failed[:, None], np.inf, errors), counts)


class Looks:
    """The looks at an ensemble; a verdict that is reached stands."""

    def __init__(self, require: Sequence[Requirement], first: int, until_decided: bool) -> None:
        """Begin without a look at a `first` number of runs, the only one unless the ensemble runs `until_decided`."""
        self.numbers = looks_of(first) if until_decided else (first,)
        self.done: list[int] = []
        self.verdicts: list[Verdict | None] = [None] * len(require)
        self._require, self.several = tuple(require), until_decided

    @property
    def decided(self) -> bool:
        """Whether all requirements are met or not met."""
        return all(verdict is not None and verdict.verdict != "undecided" for verdict in self.verdicts)

    def so_far(self, result: EnsembleResult) -> tuple[Verdict, ...]:
        """Return the verdicts that had been reached before an ensemble stopped early, and else those of its runs."""
        error = (1.0 - CONFIDENCE) / (LOOKS if self.several else 1)
        return tuple(
            judge(result, requirement, None, error) if before is None or before.verdict == "undecided" else before
            for requirement, before in zip(self._require, self.verdicts, strict=True)
        )

    def look(self, result: EnsembleResult, runs: int) -> None:
        """Judge the requirements that are not decided.

        Several looks judge their number of runs alone, so that a continued ensemble looks as a new one does; a single
        look judges all runs of the directory.
        """
        error = (1.0 - CONFIDENCE) / (LOOKS if self.several else 1)
        self.done.append(runs if self.several else len(result))
        for place, (requirement, before) in enumerate(zip(self._require, self.verdicts, strict=True)):
            if before is None or before.verdict == "undecided":
                self.verdicts[place] = judge(result, requirement, runs if self.several else None, error)


_WORDS = {"met": "met, with 95 % confidence", "not met": "NOT MET, with 95 % confidence", "undecided": "undecided"}


def verdict_text(verdict: Verdict) -> str:
    """Return the value behind a verdict, its limit, and about how many more runs decide."""
    requirement, unit = verdict.requirement, verdict.in_unit
    if math.isnan(unit.value):
        return f"No run has a solution {requirement.instant}."
    value = f"{number_text(unit.value)} {unit.unit}" if math.isfinite(unit.value) else "∞ (failed runs)"
    at = "at the end" if requirement.when == "end" else f"at {verdict.time:g} s"
    it = "the largest value" if requirement.when == "run" else "it"
    text = f"In {verdict.runs} runs {it} is {value} {at}; the limit is {unit.limit:g} {unit.unit}."
    if verdict.exceeded is not None:
        text += f" It is {verdict.exceeded.text}."
    if verdict.verdict != "undecided":
        return text
    if verdict.more_runs is None:
        return f"{text} The value lies at the limit: the necessary number of runs cannot be predicted."
    return f"{text} About {two_digits(verdict.more_runs)} more runs are needed for a decision if they are similar."


def looks_text(result: EnsembleResult) -> str:
    """Return how often an ensemble was looked at, and the probability of error; "" if it did not run until decided."""
    if not result.looks:
        return ""
    *first, last = map(str, result.looks)
    numbers = f"{', '.join(first)} and {last}" if first else last
    limit = ""
    if any(verdict.verdict == "undecided" for verdict in result.verdicts):
        limit = (
            f" {last} runs are the most for this --runs; a further series of tests has its own probability of error of "
            "5 %."
        )
    return (
        f"Tested after {numbers} runs. Each of at most {LOOKS} tests errs with at most {5 / LOOKS:g} %, all together "
        f"with at most 5 %.{limit}"
    )


def requirement_lines(result: EnsembleResult) -> list[str]:
    """Return the verdicts as lines for the console."""
    lines = [
        f"{verdict.requirement.text}: {_WORDS[verdict.verdict]}. {verdict_text(verdict)}" for verdict in result.verdicts
    ]
    return [*lines, *filter(None, [looks_text(result)])]


@dataclass(frozen=True)
class Estimate:
    """A quantity of the runs of an ensemble, SI, rates in nmi/h; what it does not have is None.

    The band has 95 % confidence: of a circle by order statistics, of a root mean square by χ² for normal errors. A
    component at an instant has its σ and its mean, too; the largest value throughout a run has the value alone.
    """

    value: float
    low: float | None = None
    high: float | None = None
    sigma: float | None = None
    mean: float | None = None


def estimate(result: EnsembleResult, quantity: Quantity) -> Estimate:
    """Return a quantity of an ensemble; an instant is that of the nearest epoch.

    A failed run is infinitely far off in a circle, and does not count in a component.
    """
    return (_circle if quantity.quantity in SHARES else _component)(result, quantity)


def _epochs(result: EnsembleResult, quantity: Quantity) -> slice:
    """Return the columns of the epochs that count, before the end of the run."""
    if quantity.when == "run":
        return slice(0, len(result.elapsed))
    row = int(np.argmin(np.abs(result.elapsed - quantity.time)))
    return slice(row, row + 1)


def _circle(result: EnsembleResult, quantity: Quantity) -> Estimate:
    """Return a percentile with its band."""
    by_path = _path_column(result, quantity)
    if by_path and quantity.when == "end":
        errors = np.abs(_at_end(result.errors.column(by_path)))
    elif by_path:
        errors = np.abs(result.errors.column(by_path, _epochs(result, quantity)))
    elif quantity.when == "end":
        errors = to_nmi_h(result.end_rates) if quantity.quantity == "rate" else result.final_horizontal
        errors = errors[:, None]
    else:
        columns = _epochs(result, quantity)
        errors = result.horizontal_at(columns)
        if quantity.quantity == "rate":
            errors = to_nmi_h(errors / result.elapsed[columns])
    if by_path:
        errors = np.where(result.failed[:, None], np.inf, errors)
        errors = errors[:, np.isfinite(errors).any(axis=0)]
        if not errors.size:
            return Estimate(math.nan)
    circle = percentile(errors, SHARES[quantity.quantity])
    if quantity.when == "run":
        return Estimate(_largest(circle.value))
    return Estimate(float(circle.value[0]), max(float(circle.low[0]), 0.0), float(circle.high[0]))


def _component(result: EnsembleResult, quantity: Quantity) -> Estimate:
    """Return the root mean square of a component."""
    k, worked = QUANTITIES.index(quantity.quantity), ~result.failed
    if quantity.when == "end":
        errors = result.errors.final[worked, k][:, None]
    else:
        errors = result.errors.column(COMPONENTS[k], _epochs(result, quantity))[worked]
    errors = errors[:, np.isfinite(errors).any(axis=0)]
    if not errors.size:
        return Estimate(math.nan)
    count = np.count_nonzero(np.isfinite(errors), axis=0)
    rms = np.sqrt(np.nanmean(errors**2, axis=0))
    if quantity.when == "run":
        return Estimate(_largest(rms))
    low, high = root_mean_square_band(rms, count, 0.05)
    finite = errors[np.isfinite(errors[:, 0]), 0]
    sigma = float(np.std(finite, ddof=1)) if len(finite) > 1 else math.nan
    mean = float(np.mean(finite))
    # the heading error is the rotation vector's component about down, with the other sign
    return Estimate(
        float(rms[0]), float(low[0]), float(high[0]), sigma, -mean if quantity.quantity == "heading" else mean
    )


def _largest(values: Array) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else float(np.max(values))
