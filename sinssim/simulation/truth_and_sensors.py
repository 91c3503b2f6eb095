"""The first stages of a run: the true motion, or what is known of a recorded one, and what the sensors read."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, ImuData, NavSolution, NavState, rows_of, short_repr, solution_of
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError
from sinssim.progress import Progress
from sinssim.scenario import Scenario
from sinssim.scenario import filter_model as filter_states
from sinssim.scenario.planned_limits import check_times
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.aiding_sensor import Vehicle
from sinssim.strapdown.navigation_error import NavError, axes_along, axes_of, navigation_error, unknown_error
from sinssim.truth.flight.guidance import Guided
from sinssim.truth.sampling import FlightEvent
from sinssim.truth.trajectory import Trajectory

if TYPE_CHECKING:
    from sinssim.logs.reference_solution import Reference
    from sinssim.sensors.sensor_set_readings import Readings, TrueErrors
    from sinssim.simulation.recorded_filter_run import Prepared
    from sinssim.strapdown.frames.vertical_channel import HeightReadings


@short_repr
@dataclass(frozen=True)
class Truth:
    """The true motion of a simulated run.

    States and increments are computed when they are first wanted, the same bits each time; a copy by
    `dataclasses.replace` does not hold them.

    Attributes:
        trajectory: the motion of the vehicle at the block's place, in the axes of the block's mounting.
        block: the motion that the sensors feel: that of the rotating IMU with [imu.rotation], else `trajectory`.
        rate_hz: rate of the IMU.
        time: edges of its intervals, (N+1,) s.
        guided: how a flight came to follow its navigator; None for a motion that does not.
    """

    trajectory: Trajectory
    block: Trajectory
    rate_hz: float
    time: Array
    guided: Guided | None = None

    @classmethod
    def along(
        cls, trajectory: Trajectory, block: Trajectory, rate_hz: float, ideal: ImuData, state: NavState | None = None,
        guided: Guided | None = None,
    ) -> Truth:  # fmt: skip
        """Return the truth along a motion, which holds what has been computed of it: ideal increments along `block`, in
        the steps of `digital`, and true states at their edges, if they are known."""
        truth = cls(trajectory, block, rate_hz, ideal.time, guided)
        vars(truth).update({"ideal": ideal} if state is None else {"ideal": ideal, "state": state})
        return truth

    @cached_property
    def ideal(self) -> ImuData:
        """Ideal increments of the block, in the steps of `digital`."""
        from sinssim.sensors.imu.emulation import digital

        return replace(digital(self.block.increments(self.rate_hz)), time=self.time)

    @cached_property
    def state(self) -> NavState:
        """True states of the vehicle at `time`."""
        return self.trajectory.state(self.time)

    @property
    def first(self) -> NavState:
        """The state of the vehicle at the beginning, scalars."""
        return self.trajectory.state(self.time[0])

    @property
    def ellipsoid(self) -> Ellipsoid:
        """Reference ellipsoid of the motion."""
        return self.trajectory.ellipsoid

    def axes(self, frame: str) -> str:
        """Return the axes in which errors of a frame are compared, one of `sinssim.strapdown.frames.AXES`."""
        return axes_along(frame, self.trajectory.state, self.trajectory.start, self.trajectory.end)

    def error_of(self, solution: NavSolution, axes: str, rows: NDArray[np.intp] | None = None) -> NavError:
        """Return the errors of a solution in given axes, at all of its rows or at some.

        The states of all rows are computed first: a single row may have other last bits than in an array.
        """
        # an algorithm that takes several samples at once has fewer rows, and a navigator of others any instants
        there = self.state if np.array_equal(solution.time, self.time) else self.trajectory.state(solution.time)
        if rows is not None:
            there = rows_of(there, rows)
            solution = solution_of(solution.time[rows], rows_of(solution, rows), solution.algorithm)
        return navigation_error(there, solution, self.ellipsoid, axes)


def truth_along(trajectory: Trajectory, scenario: Scenario, guided: Guided | None = None) -> Truth:
    """Return the truth of a simulated run along the motion of its vehicle. `trajectory`: the motion of the vehicle at
    the block's place; `guided`: how a flight came to follow its navigator."""
    from sinssim.scenario.true_motion import block_of
    from sinssim.sensors.imu.emulation import digital

    block, rate_hz = block_of(trajectory, scenario.imu), scenario.imu.rate_hz
    ideal = digital(block.increments(rate_hz))
    return Truth.along(trajectory, block, rate_hz, ideal, trajectory.state(ideal.time), guided)


@short_repr
@dataclass(frozen=True)
class RecordedMotion:
    """What is known of the motion of recorded sensors: where navigation starts, and a reference if there is one.

    Attributes:
        prepared: scenario and data of the recording.
        reference: what solutions are compared with; None for nothing.
    """

    prepared: Prepared
    reference: Reference | None

    ellipsoid = WGS84
    """Reference ellipsoid of recorded data."""

    @property
    def time(self) -> Array:
        """Edges of the IMU's intervals, (N+1,) s."""
        return self.prepared.log.imu.time

    @property
    def first(self) -> NavState:
        """The state that navigation starts from, scalars."""
        return self.prepared.start.state

    @property
    def events(self) -> tuple[FlightEvent, ...]:
        """Beginning and end of each injected outage."""
        return tuple(
            FlightEvent(at, f"GNSS {word}")
            for begin, end in self.prepared.log.outages
            for at, word in ((begin, "withheld"), (end, "available again"))
        )

    def axes(self, frame: str) -> str:
        """Return the axes in which errors of a frame are compared, one of `sinssim.strapdown.frames.AXES`."""
        return axes_of(frame, self.first.latitude)

    def error_of(self, solution: NavSolution, axes: str) -> NavError:
        """Return the differences of a solution from the reference, NaN without one; `axes` are the reference's."""
        if self.reference is None:
            return unknown_error(solution.time)
        return self.reference.error_of(solution)


@short_repr
@dataclass(frozen=True)
class Sensed:
    """What the inertial sensors of a run read, and the heights beside them.

    Attributes:
        scenario: the scenario.
        truth: the true motion, or what is known of a recorded one.
        readings: readings of the sensors.
        errors: their true errors in this run, None for recorded sensors.
        heights: recorded readings of a barometer for the loop of the vertical channel, None without any.
    """

    scenario: Scenario
    truth: Truth | RecordedMotion
    readings: Readings
    errors: TrueErrors | None
    heights: HeightReadings | None = None

    @property
    def measured(self) -> ImuData:
        """Measured increments.

        Angle increments are NaN for sets that measure the attitude, and come from differences of accelerometers for
        sets of six accelerometers.
        """
        return self.readings.imu

    @property
    def imu(self) -> ImuData:
        """Increments that are navigated on: the compensated ones; the measured ones without a calibration."""
        return self.readings.compensated or self.readings.imu

    @property
    def height(self) -> Array | HeightReadings | None:
        """Height reference of the vertical channel: a barometer's readings for its loop, else the true heights, m.

        None for recorded sensors without a barometer, and for a simulated one without a reading, which leaves the
        channel free.
        """
        scenario, truth = self.scenario, self.truth
        if not isinstance(truth, Truth):
            return self.heights
        altimeter = None if scenario.aiding is None else scenario.aiding.sensor(Barometer)
        if scenario.navigation.vertical != "baro-loop" or altimeter is None:
            return truth.state.height
        from sinssim.strapdown.frames.vertical_channel import HeightReadings

        readings = altimeter.read(Vehicle(truth.trajectory, scenario.seed))[0].measurements
        if len(readings.time):
            return HeightReadings(readings.arrival, readings.value[:, 0], 1.0 / altimeter.rate_hz)
        if scenario.filter is not None:  # its remarks report that there was no reading
            return None
        raise InputError(
            'navigation.vertical = "baro-loop" has no height reference: the outages of [aiding.baro] cover the whole '
            "run."
        )

    @cached_property
    def perfect(self) -> Readings:
        """Readings of the same sensors without errors, of a simulated run."""
        from sinssim.sensors.imu.emulation import perfect_increments
        from sinssim.sensors.sensor_set_readings import Readings, read

        truth, imu = self.truth, self.scenario.imu
        assert isinstance(truth, Truth)
        readings = self.readings
        if all(sensor is None for sensor in (readings.accelerometers, readings.attitude, readings.single)):
            return Readings(perfect_increments(truth.block, truth.ideal, imu))
        return read(truth.block, truth.ideal, imu, self.scenario.seed, self.errors)[0]


def sense(scenario: Scenario, truth: Truth) -> Sensed:
    """Emulate the inertial sensors of a simulated run, and the readings of perfect sensors as well."""
    from sinssim.sensors.sensor_set_readings import draw_true_errors, read

    errors = draw_true_errors(scenario.imu, scenario.seed, scenario.compensation)
    perfect, readings = read(truth.block, truth.ideal, scenario.imu, scenario.seed, errors)
    sensed = Sensed(scenario, truth, readings, errors)
    vars(sensed)["perfect"] = perfect
    return sensed


@dataclass(frozen=True)
class Plan:
    """A scenario with recorded sensors whose files have been read."""

    scenario: Scenario  # the scenario; what follows from the files is written out
    about_filter: Sequence[str]  # lines that explain the filter's default states
    motion: RecordedMotion  # what is known of the motion


def planned(scenario: Scenario, *, recorded: bool) -> Plan:
    """Read the files of a scenario with [log], and check what follows from them; `recorded` says whether the run is
    written to a run directory."""
    from sinssim.scenario.run_memory import check_memory
    from sinssim.simulation.recorded_filter_run import prepare

    prepared = prepare(scenario)
    lines = () if scenario.filter is None else filter_states.choice(scenario, prepared.moved)
    check_times(prepared.scenario)
    if scenario.filter is not None:
        check_memory(prepared.scenario, recorded=recorded, of_log=prepared.log.rates)
    return Plan(prepared.scenario, lines, RecordedMotion(prepared, prepared.log.reference))


def sense_recorded(scenario: Scenario, motion: RecordedMotion) -> Sensed:
    """Return what recorded sensors read, compensated by the errors that the scenario gives as numbers. `motion`: what
    is known of the motion, with the recording."""
    from sinssim.sensors.sensor_set_readings import Readings

    imu = motion.prepared.log.imu
    readings = Readings(imu)
    if scenario.compensation is not None:
        from sinssim.alignment.alignment_budget import expected_errors
        from sinssim.sensors.imu.compensation import compensate

        readings = replace(readings, compensated=compensate(imu, expected_errors(scenario.imu).mean))
    heights = _heights(motion.prepared) if scenario.navigation.vertical == "baro-loop" else None
    return Sensed(scenario, motion, readings, None, heights)


def _heights(prepared: Prepared) -> HeightReadings:
    """Return the recorded readings of a barometer, for the loop of the vertical channel."""
    from sinssim.strapdown.frames.vertical_channel import HeightReadings

    for readings in prepared.log.sensed:
        m = readings.measurements
        if m.kind == "baro-height" and len(m) > 1:
            return HeightReadings(m.arrival, m.value[:, 0], float(np.median(np.diff(m.time))))
    raise InputError(
        'navigation.vertical = "baro-loop" needs heights: add an entry of [[log.others]] with kind = "baro-height", or '
        'choose vertical = "free".'
    )


STAGES = {
    "flight": "Flying",
    "truth": "Fitting the true motion",
    "imu": "Sensing",
    "navigate": "Navigating",
    "budget": "Sources of the phases",
    "filter": "Filtering",
    "record": "Recording",
}
"""The stages of a run in order, and the text of the bar of each."""


class Stages:
    """Reports the stages of a run and measures the duration of each."""

    def __init__(self, progress: Progress) -> None:
        """Start the clock."""
        self.report = progress
        self._seconds = dict.fromkeys(STAGES, 0.0)
        self._begin = time.perf_counter()

    def within(self, stage: str) -> Progress:
        """Return a function of the present work within a stage and the fraction done. `stage`: one of `STAGES`."""
        return lambda what, fraction: self.report(f"{stage}: {what}", fraction)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Measure a stage, or a further part of it."""
        begin = time.perf_counter()
        if not self._seconds[stage]:
            self.report(stage, 0.0)
        try:
            yield
        finally:
            self._seconds[stage] += time.perf_counter() - begin
        self.report(stage, 1.0)

    def timing(self) -> dict[str, float]:
        """Return the wall-clock time of each stage and of all of them together, s."""
        total = time.perf_counter() - self._begin
        return {f"{stage}_s": round(s, 4) for stage, s in (*self._seconds.items(), ("total", total))}
