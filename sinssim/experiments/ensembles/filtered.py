"""The errors of an aided run at the epochs of an ensemble, with what its filter states about them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import RunError
from sinssim.experiments.ensembles.plan import ALL, Plan
from sinssim.experiments.ensembles.run_errors import WITHIN, RunErrors, check_finite, fill_in, rows_at
from sinssim.simulation.truth import Truth

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.simulation.sensed import Sensed

_ROW_S = 1.0
"""A covariance is kept each second: epochs are at whole seconds, or samples in a run of less than 500 s."""
DIVERGED = "the filter diverged"
"""Beginning of the failure of a run whose filter diverged."""
_DEPENDENT = 1e-9
"""Eigenvalue of the correlation matrix of a block below which a combination of its states counts as known."""


def fill_in_filtered(plan: Plan, sensed: Sensed, errors: RunErrors, row: int) -> None:
    """Run the filter of a run, and fill in its row."""
    from sinssim.scenario.filter.filter_states import with_states
    from sinssim.scenario.initial_error import initial_state_with_errors
    from sinssim.simulation.aided.aided_run import aid_run

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
    fill_in(errors, row, error, epochs)
    assert errors.sigma is not None
    errors.sigma[row, epochs] = estimate.sigma[rows[:-1], :9]
    _fill_in_nees(aided, errors, row, epochs, rows[:-1])
    _fill_in_nis(plan, estimate, errors, row)


def _fill_in_nees(aided: Aided, errors: RunErrors, row: int, epochs: NDArray[np.intp], rows: NDArray[np.intp]) -> None:
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
    """Return normalised squared errors and their degrees of freedom.

    States that are known exactly, and combinations of states that depend on others, do not count: an alignment at rest
    leaves a tilt and an accelerometer bias that are one error, not two.

    Args:
        errors: (K, n).
        covariance: P, (K, n, n).

    Returns:
        xᵀP⁻¹x and the rank of P, (K,) each; NaN where P has no positive variance.
    """
    scale = np.sqrt(np.maximum(np.einsum("kii->ki", covariance), 0.0))
    scale[scale == 0.0] = np.inf
    root, vectors = np.linalg.eigh(covariance / (scale[:, :, None] * scale[:, None, :]))
    counts = root > _DEPENDENT
    along = np.einsum("kij,ki->kj", vectors, errors / scale)
    square = np.sum(np.where(counts, along**2 / np.where(counts, root, 1.0), 0.0), axis=1)
    freedom = counts.sum(axis=1).astype(np.float64)
    return np.where(freedom > 0.0, square, np.nan), np.where(freedom > 0.0, freedom, np.nan)


def _fill_in_nis(plan: Plan, estimate: Estimate, errors: RunErrors, row: int) -> None:
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
