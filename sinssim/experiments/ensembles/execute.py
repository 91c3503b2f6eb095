"""Computes the errors of the runs of an ensemble at its epochs: `errors_of_runs`, the only place that does.

A run is computed by the same functions, on the same numbers, as by `sinssim run`, and has the same bits.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sinssim.errors import SinssimError
from sinssim.experiments.ensembles.members import Member, member
from sinssim.experiments.ensembles.run_errors import RunErrors, check_finite, empty, fill_in, rows_at
from sinssim.experiments.ensembles.together import alone_because, fill_in_together
from sinssim.simulation.navigation import by_one, navigate
from sinssim.simulation.sensed import sense

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.plan import Plan
    from sinssim.experiments.ensembles.truth import TruthCache


OnRun = Callable[[int], None]
"""Called with the number of further runs that are finished; it may raise to abandon the others."""


def errors_of_runs(plan: Plan, runs: range, truths: TruthCache, on_run: OnRun | None = None) -> RunErrors:
    """Compute some runs of an ensemble and return their errors at its epochs.

    Inertial runs on one motion are computed together where the batch serves them, and one by one otherwise. A run that
    fails has the reason in `failure`, and its errors are NaN.
    """
    errors = empty(len(runs), len(plan.epochs), plan.keys, tuple(plan.blocks), plan.sensors)
    members = [member(plan.scenario, number) for number in runs]
    for row, (number, one) in enumerate(zip(runs, members, strict=True)):
        errors.number[row], errors.seed[row] = number, one.seed
        for key, value in one.values.items():
            errors.values[key][row] = value
    left = list(range(len(runs)))
    if alone_because(plan, truths) is None:
        left = fill_in_together(plan, members, truths, errors, on_run)
    for row in left:
        try:
            errors_of_run(plan, members[row], truths, errors, row)
        except SinssimError as error:
            _fail(errors, row, str(error))
        except MemoryError:  # no property of the run: another machine, or fewer runs at a time, would do
            raise
        except Exception as error:  # whatever went wrong in one of a thousand runs is a result to report
            _fail(errors, row, _unexpected(error))
        if on_run is not None:
            on_run(1)
    return errors


def errors_of_run(plan: Plan, one: Member, truths: TruthCache, errors: RunErrors, row: int) -> None:
    """Compute one run, and fill in its row."""
    from sinssim.scenario.route import check_route, check_route_flown

    scenario = one.scenario
    if one.values:
        check_route(scenario)
    truth = truths.of(scenario)
    check_route_flown(scenario, truth.time, truth.state)
    sensed = sense(scenario, truth)
    errors.end[row] = truth.time[-1]
    if plan.filtered:
        from sinssim.experiments.ensembles.filtered import fill_in_filtered

        fill_in_filtered(plan, sensed, errors, row)
        return
    solution = navigate(by_one(scenario, plan.solution), sensed).solutions[plan.solution]
    epochs, rows = rows_at(plan.epochs, solution.time)
    error = truth.error_of(solution, truth.axes(scenario.navigation.frame), rows)
    check_finite(error)
    fill_in(errors, row, error, epochs)


def _unexpected(error: Exception) -> str:
    """Return the kind of an error that nobody foresaw, with its text, or where it arose if it has none."""
    if str(error).strip():
        return f"{type(error).__name__}: {error}"
    at = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} without a message in {Path(at.filename).name}, line {at.lineno}."


def _fail(errors: RunErrors, row: int, text: str) -> None:
    """Mark a run as failed."""
    errors.failure[row] = text or "it failed without a message."
    errors.final[row] = np.nan
    for name in errors.names:
        errors.column(name)[row] = np.nan
