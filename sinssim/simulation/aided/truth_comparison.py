"""Compares an aided solution with the truth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution
from sinssim.estimation import ErrorModel, Estimate, nominal_errors, state_errors
from sinssim.estimation.model import NAVIGATION
from sinssim.estimation.nominal import rows_of, solution_of
from sinssim.sensors.aiding.base.sensor import AidingReadings
from sinssim.simulation.aided.true_parameters import InertialParameters
from sinssim.strapdown.nav_error import NavError, navigation_error
from sinssim.system.short_repr import short_repr

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

BLOCK = 16384
"""Number of rows that are compared with the truth at once."""

_KINDS = ("position_ned", "velocity_ned", "attitude")

Rows = slice | NDArray[np.intp]


@short_repr
@dataclass(frozen=True)
class Aided:
    """An aided solution with its true errors.

    Attributes:
        sensed: readings of the aiding sensors.
        estimate: result of the filter.
        parameters: true values of the sensors' parameters by block, (size,) or (K, size) each.
        trajectory: the true motion.
        smoothed_error: of the smoothed solution, if there is one.
        smoothed_state_errors: its actual errors in the filter's own states, if there is one.
        nominal_errors: actual errors of the nominal motion that the filter's model is linearised about,
            `Estimate.history`, (R, n).
        end: end of the run, s; the filter may have ended before.
        backward_error: of the backward solution, if there is one.
        backward_state_errors: its actual errors in the filter's own states, if there is one.
    """

    sensed: tuple[AidingReadings, ...]
    estimate: Estimate
    parameters: dict[str, Array]
    trajectory: Trajectory
    smoothed_error: NavError | None
    smoothed_state_errors: Array | None
    nominal_errors: Array
    end: float
    backward_error: NavError | None = None
    backward_state_errors: Array | None = None

    @property
    def error(self) -> NavError:
        """Errors of the aided solution, K rows; computed anew at each access, as they are large."""
        return self.error_at(slice(None))

    def error_at(self, rows: Rows) -> NavError:
        """Return the errors of the aided solution at some of the filter's epochs.

        The truth is computed block by block, always the same blocks, so that the same row has the same bits.

        Args:
            rows: R of the filter's epochs.
        """
        found = self._errors_at(rows, _KINDS)
        return NavError(self.estimate.solution.time[rows], *(found[name] for name in _KINDS))

    def _errors_at(self, rows: Rows, kinds: Sequence[str]) -> dict[str, Array]:
        """Return some kinds of navigation errors at R of the filter's epochs, (R, 3) each."""
        solution = self.estimate.solution
        count = len(solution.time)
        number = np.arange(*rows.indices(count)) if isinstance(rows, slice) else rows % count
        found = {name: np.empty((len(number), 3)) for name in kinds}
        for start in range(0, len(solution.time), BLOCK):
            inside = np.flatnonzero((number >= start) & (number < start + BLOCK))
            if not len(inside):
                continue
            block = slice(start, start + BLOCK)
            own = solution_of(solution.time[block], rows_of(solution, block), solution.algorithm)
            error = self._error_of(own)
            for name, values in found.items():
                values[inside] = getattr(error, name)[number[inside] - start]
        return found

    def _error_of(self, own: NavSolution) -> NavError:
        """Return the errors of some rows of a solution."""
        there = self.trajectory.state(own.time)
        return navigation_error(there, own, self.trajectory.ellipsoid, self.estimate.model.axes)

    @property
    def true_parameters_known(self) -> bool:
        """Whether the true values of the sensors' parameters are known, as they are in a simulation."""
        return True

    def error_blocks(self) -> Iterator[NavError]:
        """Yield the errors of the aided solution, one block of rows after the other."""
        for start in range(0, len(self.estimate.time), BLOCK):
            yield self.error_at(slice(start, start + BLOCK))

    def block_error(self, block: str, rows: Rows = slice(None)) -> Array:
        """Return the actual errors in the states of one block; a parameter without a true value counts as zero.

        Args:
            rows: R of the filter's epochs; all if not given.

        Returns:
            (R, size): solution minus truth for navigation, true value minus estimate for parameters.
        """
        if (kind := {"position": "position_ned", "velocity": "velocity_ned"}.get(block, block)) in _KINDS:
            return self._errors_at(rows, (kind,))[kind]
        true = self.parameters.get(block, np.zeros(1))
        return np.asarray((true[rows] if true.ndim > 1 else true) - self.estimate.parameters[block][rows])

    def state_errors_at(self, rows: Rows) -> Array:
        """Return the actual errors in the filter's own states at R of its epochs, (R, n)."""
        error = self.error_at(rows)
        blocks = self.estimate.model.blocks[len(NAVIGATION) :]
        own = (self.block_error(block.name, rows) for block in blocks)
        return np.hstack([error.position_ned, error.velocity_ned, error.attitude, *own])

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
    block: Trajectory | None = None,
) -> Aided:
    """Compare an estimate with the truth.

    Args:
        edges: edges of the IMU's intervals, (N+1,) s.
        sensed: readings of the aiding sensors, with their true errors.
        block: the motion of a block that turns in the vehicle, which the filter's history is about.
    """
    further = {"smoothed": estimated.smoothed, "backward": estimated.backward}
    solutions = {name: one for name, one in further.items() if one is not None}
    true = inertial.at(estimated.time, *(one.time for one in solutions.values()))
    parameters = _true_parameters(true[0], sensed, estimated.time, estimated.model)
    errors: dict[str, NavError] = {}
    states: dict[str, Array] = {}
    for (name, one), own_true in zip(solutions.items(), true[1:], strict=True):
        there = trajectory.state(one.time)
        own = _true_parameters(own_true, sensed, one.time, estimated.model)
        errors[name] = navigation_error(there, one.solution, trajectory.ellipsoid, estimated.model.axes)
        states[name] = state_errors(estimated.model, one, there, own, trajectory.ellipsoid)
    nominal = np.zeros((0, estimated.model.size))
    if (history := estimated.history) is not None:
        rows = estimated.rows
        kept = {name: value[rows] if value.ndim > 1 else value for name, value in parameters.items()}
        there = (block or trajectory).state(history.time)
        nominal = nominal_errors(estimated.model, history, there, kept, trajectory.ellipsoid)
    return Aided(
        sensed, estimated, parameters, trajectory, errors.get("smoothed"), states.get("smoothed"), nominal,
        float(edges[-1]), errors.get("backward"), states.get("backward"),
    )  # fmt: skip


def _true_parameters(
    inertial: dict[str, Array], sensed: tuple[AidingReadings, ...], time: Array, model: ErrorModel
) -> dict[str, Array]:
    """Return the true values of the parameters of all sensors at some instants, by block of the filter."""
    true = {name: value for name, value in inertial.items() if name in model.slices}
    for sensor in sensed:
        for name, value in sensor.parameters.items():
            if name not in model.slices:
                continue
            if value.ndim > 1:
                value = np.column_stack([np.interp(time, sensor.time, column) for column in value.T])
            true[name] = value
    return true
