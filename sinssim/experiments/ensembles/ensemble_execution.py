"""Computes the errors of the runs of an ensemble at its epochs, and of aided runs what the filter states about them.

A run is computed by the same functions, on the same numbers, as by `sinssim run`, and has the same bits.
"""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import RunError, SinssimError
from sinssim.experiments.ensembles.batch_navigation import compute_as_batch, why_not_batch
from sinssim.experiments.ensembles.ensemble_errors import (
    WITHIN,
    OnRun,
    RunErrors,
    check_finite,
    empty,
    rows_at,
    store_errors,
)
from sinssim.experiments.ensembles.ensemble_plan import ALL, Member, Plan, member
from sinssim.simulation.navigation_stage import by_one, navigate
from sinssim.simulation.sensed_stage import sense
from sinssim.simulation.truth_stage import Truth

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.experiments.ensembles.ensemble_plan import TruthCache
    from sinssim.simulation.sensed_stage import Sensed
    from sinssim.simulation.truth_comparison import Aided


def errors_of_runs(plan: Plan, runs: range, truths: TruthCache, on_run: OnRun | None = None) -> RunErrors:
    """Compute some runs of an ensemble and return their errors at its epochs.

    Inertial runs on one motion are computed together where the batch serves them, and one by one otherwise. A run that
    fails has the reason in `failure`, and its errors are NaN.
    """
    errors = empty(len(runs), len(plan.epochs), plan.keys, tuple(plan.blocks), plan.sensors)
    members = [member(plan.scenario, number) for number in runs]
    for row, (number, run) in enumerate(zip(runs, members, strict=True)):
        errors.number[row], errors.seed[row] = number, run.seed
        for key, value in run.values.items():
            errors.values[key][row] = value
    left = list(range(len(runs)))
    if why_not_batch(plan, truths) is None:
        left = compute_as_batch(plan, members, truths, errors, on_run)
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
            on_run()
    return errors


def errors_of_run(plan: Plan, run: Member, truths: TruthCache, errors: RunErrors, row: int) -> None:
    """Compute one run, and fill in its row."""
    from sinssim.scenario.route_pole import check_route, check_route_flown

    scenario = run.scenario
    if run.values:
        check_route(scenario)
    truth = truths.of(scenario)
    check_route_flown(scenario, truth.time, truth.state)
    sensed = sense(scenario, truth)
    errors.end[row] = truth.time[-1]
    if plan.filtered:
        compute_filtered(plan, sensed, errors, row)
        return
    solution = navigate(by_one(scenario, plan.solution), sensed).solutions[plan.solution]
    epochs, rows = rows_at(plan.epochs, solution.time)
    error = truth.error_of(solution, truth.axes(scenario.navigation.frame), rows)
    check_finite(error)
    store_errors(errors, row, error, epochs)


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


_ROW_S = 1.0
"""A covariance is kept each second: epochs are at whole seconds, or samples in a run of less than 500 s."""
DIVERGED = "the filter diverged"
"""Beginning of the failure of a run whose filter diverged."""
_DEPENDENT = 1e-9
"""Eigenvalue of the correlation matrix of a block below which a combination of its states counts as known."""


def compute_filtered(plan: Plan, sensed: Sensed, errors: RunErrors, row: int) -> None:
    """Run the filter of a run, and fill in its row."""
    from sinssim.scenario.filter_model import with_states
    from sinssim.scenario.navigation_section import initial_state_with_errors
    from sinssim.simulation.aided_run import aid_run

    truth, scenario = sensed.truth, with_states(sensed.scenario)
    assert isinstance(truth, Truth)  # an ensemble is simulated
    assert sensed.errors is not None
    trajectory, start = truth.trajectory, truth.first
    initial = initial_state_with_errors(start, scenario.navigation.initial_error, trajectory.ellipsoid, scenario.seed)
    step = float(np.diff(plan.epochs).min(initial=np.inf))
    aided = aid_run(
        scenario, trajectory, sensed.imu, initial, sensed.errors, monitored=sensed.readings.monitored,
        history=False, row_s=_ROW_S if step >= _ROW_S - WITHIN else 0.0,
    )  # fmt: skip
    estimate = aided.estimate
    if estimate.divergence is not None:
        reason = estimate.divergence.reason.rstrip(".")
        raise RunError(f"{DIVERGED} at t = {estimate.divergence.time:.2f} s: {reason}.")
    epochs, rows = rows_at(plan.epochs, estimate.time)
    error = aided.error_at(rows)
    check_finite(error)
    store_errors(errors, row, error, epochs)
    assert errors.sigma is not None
    errors.sigma[row, epochs] = estimate.sigma[rows[:-1], :9]
    _store_nees(aided, errors, row, epochs, rows[:-1])
    _store_nis(plan, estimate, errors, row)


def _store_nees(aided: Aided, errors: RunErrors, row: int, epochs: NDArray[np.intp], rows: NDArray[np.intp]) -> None:
    """Fill in the NEES at the last stored covariance at or before each epoch."""
    estimate = aided.estimate
    if not len(estimate.rows):
        return
    place = np.searchsorted(estimate.rows, rows, side="right") - 1
    epochs, place = epochs[place >= 0], place[place >= 0]
    actual, covariance = aided.state_errors_at(estimate.rows[place]), estimate.covariance[place]
    slices = estimate.model.slices
    for name in errors.nees:
        part = slices.get(name, slice(0, estimate.model.size) if name == ALL else slice(0, 0))
        if part.stop == part.start:
            continue  # a run whose varied keys give its filter other states
        square, freedom = normalised(actual[:, part], covariance[:, part, part])
        errors.nees[name][row, epochs], errors.nees_freedom[name][row, epochs] = square, freedom


def normalised(errors: Array, covariance: Array) -> tuple[Array, Array]:
    """Return normalised squared errors xᵀP⁻¹x of errors, (K, n), and the rank of their covariance P, (K,) each.

    States that are known exactly, and combinations of states that depend on others, do not count: an alignment at rest
    leaves a tilt and an accelerometer bias that are one error, not two. NaN where P has no positive variance.
    """
    scale = np.sqrt(np.maximum(np.einsum("kii->ki", covariance), 0.0))
    scale[scale == 0.0] = np.inf
    root, vectors = np.linalg.eigh(covariance / (scale[:, :, None] * scale[:, None, :]))
    counts = root > _DEPENDENT
    along = np.einsum("kij,ki->kj", vectors, errors / scale)
    square = np.sum(np.where(counts, along**2 / np.where(counts, root, 1.0), 0.0), axis=1)
    freedom = counts.sum(axis=1).astype(np.float64)
    return np.where(freedom > 0.0, square, np.nan), np.where(freedom > 0.0, freedom, np.nan)


def _store_nis(plan: Plan, estimate: Estimate, errors: RunErrors, row: int) -> None:
    """Fill in the sums of the normalised squared innovations between epochs; rejected readings count, too."""
    for name in plan.sensors:
        square, freedom = np.zeros((2, len(plan.epochs)))
        for innovations in estimate.innovations:
            if innovations.sensor != name:
                continue
            there = np.isfinite(innovations.nis)
            at = np.searchsorted(plan.epochs, innovations.time[there] - WITHIN)
            at = np.minimum(at, len(plan.epochs) - 1)
            square += np.bincount(at, innovations.nis[there], len(plan.epochs))
            freedom += np.bincount(at, minlength=len(plan.epochs)) * float(innovations.value.shape[1])
        errors.nis[name][row], errors.nis_freedom[name][row] = square, freedom
