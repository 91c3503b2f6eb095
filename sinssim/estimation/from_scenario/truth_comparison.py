"""Compares an aided solution with the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution
from sinssim.estimation import ErrorModel, Estimate, nominal_errors, state_errors
from sinssim.estimation.from_scenario.true_parameters import InertialParameters
from sinssim.estimation.nominal import rows_of, solution_of
from sinssim.sensors.aiding.base.sensor import AidingReadings
from sinssim.strapdown.nav_error import NavError, navigation_error

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

_BLOCK = 65536
"""Number of rows that are compared with the truth at once."""

Rows = slice | NDArray[np.intp]


@dataclass(frozen=True)
class Aided:
    """An aided solution with its true errors.

    Attributes:
        sensed: readings of the aiding sensors.
        estimate: result of the filter.
        parameters: true values of the sensors' parameters by block, (size,) or (K, size) each.
        error: of the aided solution, K rows.
        smoothed_error: of the smoothed solution, if there is one.
        smoothed_state_errors: its actual errors in the filter's own states, if there is one.
        nominal_errors: actual errors of the nominal motion that the filter's model is linearised about,
            `Estimate.history`, (R, n).
        end: end of the run, s; the filter may have ended before.
    """

    sensed: tuple[AidingReadings, ...]
    estimate: Estimate
    parameters: dict[str, Array]
    error: NavError
    smoothed_error: NavError | None
    smoothed_state_errors: Array | None
    nominal_errors: Array
    end: float

    def block_error(self, block: str, rows: Rows = slice(None)) -> Array:
        """Return the actual errors in the states of one block; a parameter without a true value counts as zero.

        Args:
            block: its name.
            rows: R of the filter's epochs; all if not given.

        Returns:
            (R, size): solution minus truth for navigation, true value minus estimate for parameters.
        """
        navigation = {"position": "position_ned", "velocity": "velocity_ned", "attitude": "attitude"}
        if block in navigation:
            return np.asarray(getattr(self.error, navigation[block])[rows])
        true = self.parameters.get(block, np.zeros(1))
        return np.asarray((true[rows] if true.ndim > 1 else true) - self.estimate.parameters[block][rows])

    def state_errors_at(self, rows: Rows) -> Array:
        """Return the actual errors in the filter's own states at R of its epochs, (R, n)."""
        return np.hstack([self.block_error(block.name, rows) for block in self.estimate.model.blocks])

    @property
    def state_errors(self) -> Array:
        """Actual errors in the filter's own states, (K, n); computed anew at each access, as it is large."""
        return self.state_errors_at(slice(None))


def compare_with_truth(
    trajectory: Trajectory,
    inertial: InertialParameters,
    edges: Array,
    sensed: tuple[AidingReadings, ...],
    estimated: Estimate,
) -> Aided:
    """Compare an estimate with the truth.

    Args:
        trajectory: the true motion.
        inertial: true errors of the inertial sensors.
        edges: edges of the IMU's intervals, (N+1,) s.
        sensed: readings of the aiding sensors, with their true errors.
        estimated: result of the filter.

    Returns:
        The aided solution with its errors.
    """
    parameters = _true_parameters(inertial, sensed, estimated.time, estimated.model)
    error = _error_of(trajectory, estimated.solution)
    smoothed_error = smoothed_errors = None
    if (smoothed := estimated.smoothed) is not None:
        there = trajectory.state(smoothed.time)
        own = _true_parameters(inertial, sensed, smoothed.time, estimated.model)
        smoothed_error = navigation_error(there, smoothed.solution, trajectory.ellipsoid)
        smoothed_errors = state_errors(estimated.model, smoothed, there, own, trajectory.ellipsoid)
    nominal = np.zeros((0, estimated.model.size))
    if (history := estimated.history) is not None:
        rows = estimated.rows
        kept = {name: value[rows] if value.ndim > 1 else value for name, value in parameters.items()}
        there = trajectory.state(history.time)
        nominal = nominal_errors(estimated.model, history, there, kept, trajectory.ellipsoid)
    return Aided(sensed, estimated, parameters, error, smoothed_error, smoothed_errors, nominal, float(edges[-1]))


def _error_of(trajectory: Trajectory, solution: NavSolution) -> NavError:
    """Return the errors of a solution; the truth is computed part by part to save memory."""
    parts = []
    for start in range(0, max(len(solution.time), 1), _BLOCK):
        s = slice(start, start + _BLOCK)
        own = solution_of(solution.time[s], rows_of(solution, s), solution.algorithm)
        parts.append(navigation_error(trajectory.state(own.time), own, trajectory.ellipsoid))
    names = ("position_ned", "velocity_ned", "attitude")
    return NavError(solution.time, *(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _true_parameters(
    inertial: InertialParameters, sensed: tuple[AidingReadings, ...], time: Array, model: ErrorModel
) -> dict[str, Array]:
    """Return the true values of the parameters of all sensors at some instants, by block."""
    true = inertial.at(time)
    for sensor in sensed:
        for name, value in sensor.parameters.items():
            if value.ndim > 1:
                value = np.column_stack([np.interp(time, sensor.time, column) for column in value.T])
            true[name] = value
    return {name: value for name, value in true.items() if name in model.slices}
