"""Compares an aided solution with the truth: navigation errors, and errors of the estimated parameters.

The true values of the sensors' parameters are computed at the filter's epochs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, ImuData, NavSolution, blocks, rows_of, short_repr, solution_of
from sinssim.estimation import ErrorModel, Estimate, nominal_errors, state_errors
from sinssim.estimation.error_dynamics import remaining
from sinssim.estimation.state_model import FLICKER, GRAVITY, INERTIAL, NAVIGATION, crossing_time, values_of
from sinssim.sensors.aiding_sensor import AidingReadings
from sinssim.sensors.fault_detection import combine
from sinssim.sensors.flicker import smoothed_over
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.redundant_set_errors import combined_errors
from sinssim.sensors.sensor_set_readings import TrueErrors
from sinssim.sensors.sensor_set_section import Redundant, SensorSet
from sinssim.sensors.single_sensors import APART
from sinssim.strapdown.navigation_error import NavError, navigation_error
from sinssim.truth.trajectory import Trajectory

_STATES = tuple(dict.fromkeys(("bias", "scale", "misalignment", "bias_temperature",
                               *(of.field for of in INERTIAL.values()))))  # fmt: skip
"""The parameters that a calibration changes; of a redundant set the first three have states."""


class InertialParameters:
    """True parameters of the inertial sensors of one run, less the calibrated part."""

    def __init__(
        self,
        errors: TrueErrors,
        edges: Array,
        seed: int,
        section: SensorSet | None = None,
        used: tuple[Array, Array] | None = None,
    ) -> None:
        """Store the errors of a run, whose seed determines the noises that drive the drifts, by default of three gyros
        and three accelerometers, for the edges of the IMU's intervals, (N+1,) s. Of a redundant set `used` says whether
        each gyro and each accelerometer is in use, (N, m) each; by default all are."""
        self._edges, self._seed, self._used = edges, seed, used
        self._left = _remaining(errors.imu, errors.calibration)
        self._axes = section.axes if isinstance(section, Redundant) else None
        known = errors.single_calibrations or (None,) * len(errors.single_sensors)
        self._blocks = tuple(map(_remaining, errors.single_sensors, known))

    def at(self, *times: Array, model: ErrorModel | None = None) -> list[dict[str, Array]]:
        """Return the parameters by block of the filter at each of some times, (K,) s each, of the filter, of the
        smoother and so on: biases and instabilities, (3,) or (K, 3); scale factors, (3,), and misalignments, (6,). The
        sum of the processes of flicker stands in the first of them, and the others are zero; the model tells flicker of
        a block of its own from that in the bias. Each error is emulated once for all times, and what is emulated is not
        kept."""
        triads = {"gyro": self._left.gyro, "accelerometer": self._left.accel}
        sums = {} if model is None else model.sums
        # the filter treats faster changes of flicker as noise
        before = [crossing_time(triad) if triad.flicker else 0.0 for triad in triads.values()]
        after = [0.0, 0.0]
        for k, (name, triad) in enumerate(triads.items()):
            if f"{name} {FLICKER}" in sums:
                before[k] = after[k] = 0.5 * smoothed_over(triad.flicker, triad.random_walk)
        drifts = self._means(("rate_walk", "ramp", "bias_temperature"), times, (1.0, 1.0))
        instabilities = self._means(("instability", "correlation_time"), times, (0.0, 0.0))
        flicker = self._means(("flicker",), times, before, after)
        parameters: list[dict[str, Array]] = []
        for i in range(len(times)):
            values: dict[str, Array] = {}
            constant = self._constant(times[i])
            for k, (name, triad) in enumerate(triads.items()):
                bias = constant[k][0] + drifts[k][i]
                if processes := sums.get(f"{name} {FLICKER}"):
                    values |= dict.fromkeys(processes, np.zeros(3)) | {processes[0]: flicker[k][i]}
                elif triad.flicker:
                    bias = bias + flicker[k][i]
                values[f"{name} bias"] = bias
                values[f"{name} scale"] = constant[k][1]
                values[f"{name} misalignment"] = constant[k][2][..., ~np.eye(3, dtype=bool)]
                values[f"{name} instability"] = instabilities[k][i]
                further = ((block, of) for block, of in INERTIAL.items() if block.startswith(f"{name} "))
                values |= {
                    block: values_of(of, getattr(triad, of.field)) for block, of in further if block not in values
                }
            parameters.append(values)
        return parameters

    def _constant(self, times: Array) -> list[tuple[Array, Array, Array]]:
        """Return bias, scale factor and misalignment of gyros and accelerometers; in a row for each time, (K, …), if
        the combination of a redundant set changes."""
        if self._axes is None or self._used is None:
            every = self._left if self._axes is None else combined_errors(self._blocks, self._axes)
            return [(triad.bias, triad.scale, triad.misalignment) for triad in (every.gyro, every.accel)]
        last = np.searchsorted(self._edges, times - 1e-9).clip(1, len(self._edges) - 1) - 1
        rows = np.concatenate([entry[last] for entry in self._used], axis=1)
        kinds, which = np.unique(rows, axis=0, return_inverse=True)
        count = len(self._axes)
        imu_errors = [combined_errors(self._blocks, self._axes, (entry[:count], entry[count:])) for entry in kinds]

        def rows_of(triads: list[TriadErrors]) -> tuple[Array, Array, Array]:
            bias, scale, tilt = (np.array([getattr(entry, name) for entry in triads])[which] for name in _STATES[:3])
            return bias, scale, tilt

        return [rows_of([entry.gyro for entry in imu_errors]), rows_of([entry.accel for entry in imu_errors])]

    def _means(
        self, fields: tuple[str, ...], times: Sequence[Array], before: Sequence[float], after: Sequence[float] = (0, 0)
    ) -> tuple[list[Array], list[Array]]:
        """Return the contribution of some errors to rates and specific forces, (K, 3) for each of the times, or zeros,
        (3,), if there are none.

        It is the mean over some seconds before and after each epoch, which are given for each triad; over one sample at
        least.
        """
        triads = self._left.gyro, self._left.accel
        if not any(np.any(getattr(t, f)) for t in triads for f in fields if f != "correlation_time"):
            return [np.zeros(3)] * len(times), [np.zeros(3)] * len(times)
        edges, drift = self._edges, self._emulated(fields)

        def means(increments: Array, before: float, after: float) -> list[Array]:
            sums, window_means = np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)]), []
            for time in times:
                here = np.searchsorted(edges, time - 1e-9).clip(1, len(edges) - 1)
                last = np.searchsorted(edges, edges[here] + after - 1e-9).clip(here, len(edges) - 1)
                first = np.searchsorted(edges, edges[here] - before - 1e-9).clip(0, here - 1)
                window_means.append((sums[last] - sums[first]) / (edges[last] - edges[first])[:, np.newaxis])
            return window_means

        return means(drift.dtheta, before[0], after[0]), means(drift.dvel, before[1], after[1])

    def _emulated(self, fields: tuple[str, ...]) -> ImuData:
        """Return the contribution of some errors to the increments.

        The emulator runs on zero motion with these errors alone. Its draws of a term do not depend on which other terms
        are switched on.
        """

        def alone(triad: TriadErrors) -> TriadErrors:
            return TriadErrors(**{field: getattr(triad, field) for field in fields})

        none = np.zeros((len(self._edges) - 1, 3))
        read = [
            emulate(
                ImuData(self._edges, none, none),
                ImuErrors(alone(block.gyro), alone(block.accel), warm_up=block.warm_up),
                self._seed + number * APART,
            )
            for number, block in enumerate(self._blocks or (self._left,))
        ]
        if self._axes is None:
            return read[0]
        count, used = len(self._axes), self._used or (None, None)
        singles = (
            np.hstack([getattr(increments, name) for increments in read])[:, :count] for name in ("dtheta", "dvel")
        )
        dtheta, dvel = (combine(rows, self._axes, selection) for rows, selection in zip(singles, used, strict=True))
        return ImuData(self._edges, dtheta, dvel)


def _remaining(true: ImuErrors, known: ImuErrors | None) -> ImuErrors:
    """Return the errors less the calibrated part of those that can be states."""
    if known is None:
        return true
    return replace(true, gyro=_less(true.gyro, known.gyro), accel=_less(true.accel, known.accel))


def _less(true: TriadErrors, known: TriadErrors) -> TriadErrors:
    return replace(true, **{field: getattr(true, field) - getattr(known, field) for field in _STATES})


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
        seconds: processor time that it took, s.
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
    seconds: float = field(default=0.0, kw_only=True)

    @property
    def error(self) -> NavError:
        """Errors of the aided solution, K rows; computed anew at each access, as they are large."""
        return self.error_at(slice(None))

    def error_at(self, rows: Rows) -> NavError:
        """Return the errors of the aided solution at some of the filter's epochs. The truth is computed block by block,
        always the same blocks, so that the same row has the same bits."""
        errors = self._errors_at(rows, _KINDS)
        return NavError(self.estimate.solution.time[rows], *(errors[name] for name in _KINDS))

    def _errors_at(self, rows: Rows, kinds: Sequence[str]) -> dict[str, Array]:
        """Return some kinds of navigation errors at R of the filter's epochs, (R, 3) each."""
        solution = self.estimate.solution
        count = len(solution.time)
        number = np.arange(*rows.indices(count)) if isinstance(rows, slice) else rows % count
        errors = {name: np.empty((len(number), 3)) for name in kinds}
        for block in blocks(count):
            inside = np.flatnonzero((number >= block.start) & (number < block.stop))
            if not len(inside):
                continue
            block_solution = solution_of(solution.time[block], rows_of(solution, block), solution.algorithm)
            error = self._error_of(block_solution)
            for name, values in errors.items():
                values[inside] = getattr(error, name)[number[inside] - block.start]
        return errors

    def _error_of(self, solution: NavSolution) -> NavError:
        """Return the errors of some rows of a solution."""
        there = self.trajectory.state(solution.time)
        return navigation_error(there, solution, self.trajectory.ellipsoid, self.estimate.model.axes)

    @property
    def true_parameters_known(self) -> bool:
        """Whether the true values of the sensors' parameters are known, as they are in a simulation."""
        return True

    def error_blocks(self) -> Iterator[NavError]:
        """Yield the errors of the aided solution, one block of rows after the other."""
        yield from map(self.error_at, blocks(len(self.estimate.time)))

    def block_error(self, block: str, rows: Rows = slice(None)) -> Array:
        """Return the actual errors in the states of one block at some of the filter's epochs, (R, size), as those of
        `state_errors`; a parameter without a true value counts as zero."""
        if (kind := {"position": "position_ned", "velocity": "velocity_ned"}.get(block, block)) in _KINDS:
            return self._errors_at(rows, (kind,))[kind]
        return self._parameter_errors(rows)[block]

    def _parameter_errors(self, rows: Rows) -> dict[str, Array]:
        """Return the actual errors in the parameters' states at R of the filter's epochs, by block."""
        true = {name: value[rows] if value.ndim > 1 else value for name, value in self.parameters.items()}
        known = {name: value[rows] for name, value in self.estimate.parameters.items()}
        return remaining(self.estimate.model, true, known)

    def state_errors_at(self, rows: Rows) -> Array:
        """Return the actual errors in the filter's own states at R of its epochs, (R, n)."""
        error = self.error_at(rows)
        errors = self._parameter_errors(rows)
        of_blocks = (errors[block.name] for block in self.estimate.model.blocks[len(NAVIGATION) :])
        return np.hstack([error.position_ned, error.velocity_ned, error.attitude, *of_blocks])

    @property
    def state_errors(self) -> Array:
        """Actual errors in the filter's own states, (K, n); computed anew at each access, as it is large."""
        return self.state_errors_at(slice(None))


@dataclass(frozen=True)
class FilterSolution(NavSolution):
    """The solution of a filter of [[filters]]."""

    aided: Aided | None = None  # it with its estimate and errors; None for the filter of a project
    sigma: Array | None = None  # 1σ of position, velocity and attitude, (N+1, 9), None for a filter that states none
    kind: str = ""  # kind of the filter
    seconds: float = 0.0  # processor time that it took, s


def compare_with_truth(
    trajectory: Trajectory,
    inertial: InertialParameters,
    edges: Array,
    sensed: tuple[AidingReadings, ...],
    estimated: Estimate,
    block: Trajectory | None = None,
    gravity: Callable[[Array], Array] | None = None,
) -> Aided:
    """Compare an estimate with the truth: the motion, the readings of the aiding sensors with their true errors, and
    the motion of a block that turns in the vehicle, which the filter's history is about. `edges` are those of the IMU's
    intervals, (N+1,) s; `gravity` returns the disturbance that the navigator does not know at instants, (K,) s: north,
    east, down, (K, 3) m/s²."""
    further = {"smoothed": estimated.smoothed, "backward": estimated.backward}
    solutions = {name: estimate for name, estimate in further.items() if estimate is not None}
    true = inertial.at(estimated.time, *(e.time for e in solutions.values()), model=estimated.model)
    if GRAVITY in estimated.model.slices:
        for at, values in zip((estimated.time, *(e.time for e in solutions.values())), true, strict=True):
            values[GRAVITY] = np.zeros((len(at), 3)) if gravity is None else gravity(at)
    parameters = _true_parameters(true[0], sensed, estimated.time, estimated.model)
    errors: dict[str, NavError] = {}
    states: dict[str, Array] = {}
    for (name, estimate), own_true in zip(solutions.items(), true[1:], strict=True):
        there = trajectory.state(estimate.time)
        true_parameters = _true_parameters(own_true, sensed, estimate.time, estimated.model)
        errors[name] = navigation_error(there, estimate.solution, trajectory.ellipsoid, estimated.model.axes)
        states[name] = state_errors(estimated.model, estimate, there, true_parameters, trajectory.ellipsoid)
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
