"""Judges requirements by the runs of an ensemble, once or while runs are added."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.ensembles.run_errors import COMPONENTS
from sinssim.scenario.sections.ensemble import MOST_RUNS
from sinssim.statistics.requirements.requirement import Requirement
from sinssim.statistics.requirements.verdict import (
    CONFIDENCE,
    Tally,
    Verdict,
    columns_of,
    errors_of,
    joined,
    tally,
    verdict_of,
)

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.plan import Plan
    from sinssim.experiments.ensembles.result import EnsembleResult

LOOKS = 5
"""Most looks at an ensemble that runs until its requirements are decided; the number of runs doubles from one to the
next, so that the last one has 16 times the first number."""


def looks_of(runs: int) -> tuple[int, ...]:
    """Return the numbers of runs after which an ensemble is judged that runs until its requirements are decided.

    Returns:
        At most `LOOKS` numbers, each twice the one before.
    """
    return tuple(sorted({min(runs * 2**look, MOST_RUNS) for look in range(LOOKS)}))


def check_kept(plan: Plan, require: Iterable[Requirement], times: Iterable[float] = ()) -> None:
    """Raise InputError if a time that is asked for, s, is not among the epochs of an ensemble that is continued."""
    elapsed = plan.epochs - plan.start
    asked = [(f"requirement {one.text!r}", one.time) for one in require if one.when == "at"]
    for who, time in (*asked, *((f"times (--at): {time:g} s", time) for time in times)):
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
    """Judge a requirement by the runs of an ensemble.

    A failed run counts as infinitely far off. A run that has ended, or whose filter has not begun, does not count. At
    the end, every run counts with its own end.

    Args:
        runs: number of runs that are judged, the first ones; by default all.

    Raises:
        InputError: the time of the requirement is not an epoch.
    """
    rows = np.ones(len(result), np.bool_) if runs is None else result.errors.number < runs
    failed, elapsed = result.failed[rows], result.elapsed
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
        errors = errors_of([result.errors.column(COMPONENTS[p], some)[rows] for p in columns_of(requirement)])
        tallies.append(_tally(requirement, elapsed[some], errors, failed))
    aiding = result.plan.scenario.aiding
    outages = () if aiding is None or not result.plan.filtered else aiding.outages
    instants = np.concatenate([elapsed[some] for some in epochs])
    return verdict_of(requirement, instants, joined(tallies), error, outages)


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
        return all(one is not None and one.verdict != "undecided" for one in self.verdicts)

    def so_far(self, result: EnsembleResult) -> tuple[Verdict, ...]:
        """Judge the runs of an ensemble that stopped early; no look is counted.

        Returns:
            The verdicts that had been reached, and those of these runs on the other requirements.
        """
        error = (1.0 - CONFIDENCE) / (LOOKS if self.several else 1)
        return tuple(
            judge(result, one, None, error) if before is None or before.verdict == "undecided" else before
            for one, before in zip(self._require, self.verdicts, strict=True)
        )

    def look(self, result: EnsembleResult, runs: int) -> None:
        """Judge the requirements that are not decided.

        Several looks judge their number of runs alone, so that a continued ensemble looks as a new one does; a single
        look judges all runs of the directory.
        """
        error = (1.0 - CONFIDENCE) / (LOOKS if self.several else 1)
        self.done.append(runs if self.several else len(result))
        for place, (one, before) in enumerate(zip(self._require, self.verdicts, strict=True)):
            if before is None or before.verdict == "undecided":
                self.verdicts[place] = judge(result, one, runs if self.several else None, error)
