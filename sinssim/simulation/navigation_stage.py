"""The later stages of a run: the solutions of every algorithm of its scenario, and that of its filter.

Special systems change the setup before the algorithms navigate: a known gravity field (navigation.gravity_degree), a
rotating IMU ([imu.rotation]), an alignment at rest ([navigation.alignment]), and a gimballed platform (the algorithm
"platform"). `SPECIAL` lists them.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sinssim.alignment.alignment_budget import expected_errors
from sinssim.alignment.initial_conditions import aligned_state, alignment_samples
from sinssim.data import Array, ImuData, NavSolution, NavState, short_repr
from sinssim.earth.ellipsoids import Ellipsoid, ellipsoid_by_name
from sinssim.errors import InputError, RunError, SinssimError
from sinssim.estimation import SHIPPED
from sinssim.progress import Progress, silent
from sinssim.scenario import Scenario
from sinssim.scenario.navigation_section import initial_state_with_errors
from sinssim.sensors.imu.rotation_encoder import encoders_of, turned_in
from sinssim.sensors.sensor_set_readings import Readings, TrueErrors
from sinssim.simulation.truth_and_sensors import RecordedMotion, Sensed, Truth
from sinssim.strapdown.attitude import PLATFORM
from sinssim.strapdown.mechanization import BARO_TIME_CONSTANT, Mechanization
from sinssim.strapdown.navigation_error import NavError, diverged, unknown_error
from sinssim.system.process import thread_pool

if TYPE_CHECKING:
    from sinssim.estimation.filter_start import Start
    from sinssim.logs.reference_solution import Reference
    from sinssim.simulation.truth_comparison import Aided
    from sinssim.strapdown.frames.vertical_channel import HeightReadings


Engine = Callable[["Setup", "ImuData", "Mechanization"], "NavSolution"]
"""Navigates by a mechanization on increments, with attitude, start and height of a setup."""


@dataclass(frozen=True)
class Setup:
    """What the algorithms of a run navigate with."""

    scenario: Scenario  # the scenario
    truth: Truth | RecordedMotion  # the true motion, or what is known of a recorded one
    errors: TrueErrors | None  # the true errors of the sensors, None if they are not known
    imu: ImuData  # increments
    attitude: Array | None  # measured q_ib of a set with an attitude sensor, (N+1, 4), else None
    initial: NavState  # state that navigation starts from
    height: Array | HeightReadings | None  # height reference of the vertical channel
    engine: Engine  # navigates


def in_known_field(setup: Setup) -> Setup:
    """Compensate the increments for the known part of the gravity field, if the navigator knows more than normal
    gravity."""
    from sinssim.scenario.true_motion import known_field

    field = known_field(setup.scenario)
    if field is None:
        return setup
    from sinssim.strapdown.navigate import navigate_in_field

    inner = setup.engine

    def engine(setup_of_run: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
        return navigate_in_field(imu, field, of.earth, lambda felt: inner(setup_of_run, felt, of))

    return replace(setup, engine=engine)


def after_alignment(setup: Setup) -> Setup:
    """With [navigation.alignment], align on the first increments, and navigate on the rest."""
    section = setup.scenario.navigation
    if section.alignment is None:
        return setup
    ellipsoid = ellipsoid_by_name(section.ellipsoid_over(setup.truth.ellipsoid.name))
    count, initial = align_itself(setup.scenario, setup.imu, setup.initial, ellipsoid)
    height = setup.height[count:] if isinstance(setup.height, np.ndarray) else setup.height
    return replace(setup, imu=without_alignment(setup.imu, count), initial=initial, height=height)


def align_itself(scenario: Scenario, imu: ImuData, place: NavState, ellipsoid: Ellipsoid) -> tuple[int, NavState]:
    """Align on the first increments of a run at a latitude, longitude and height on the navigator's ellipsoid; the
    place's attitude and velocity are not used. Return the number of samples that the alignment takes, and the state
    after them."""
    section = scenario.navigation.alignment
    assert section is not None
    key = "navigation.alignment.duration_s"
    count = alignment_samples(imu.time, section.duration_s, key)
    session = type(imu)(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    try:
        state, _ = aligned_state(
            session, place, section.method, expected_errors(scenario.imu), scenario.navigation.gravity, ellipsoid
        )
    except SinssimError as error:
        raise InputError(
            f'{key} = {section.duration_s:g}, method = "{section.method}": the alignment ends at '
            f"{session.time[-1]:.6g} s of the run without a result: {error}"
        ) from error
    return count, state


def without_alignment(imu: ImuData, count: int) -> ImuData:
    """Return the increments after the alignment."""
    flags = None if imu.flags is None else imu.flags[count:]
    return type(imu)(imu.time[count:], imu.dtheta[count:], imu.dvel[count:], flags)


def on_platform(setup: Setup) -> Setup:
    """Let the algorithm "platform", if there is one, navigate by a platform's own loop, which needs the true motion."""
    if PLATFORM not in setup.scenario.navigation.algorithms:
        return setup
    inner = setup.engine

    def engine(setup_of_run: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
        return _navigate(setup_of_run, of) if of.algorithm == PLATFORM else inner(setup_of_run, imu, of)

    return replace(setup, engine=engine)


def _navigate(setup: Setup, of: Mechanization) -> NavSolution:
    from sinssim.strapdown.gimballed_platform import inertial_forces, navigate_platform
    from sinssim.truth.true_gravity_disturbance import Disturbed

    time, errors, truth = setup.imu.time, setup.errors, setup.truth
    if errors is None or not isinstance(truth, Truth):
        raise InputError(
            f"{PLATFORM} computes its own loop from the errors of its sensors: give errors, the true errors of the run."
        )
    trajectory = truth.trajectory
    state = truth.state if len(time) == len(truth.time) else trajectory.state(time)
    felt = trajectory.disturbance_ned(time, state) if isinstance(trajectory, Disturbed) else None
    forces = inertial_forces(time, state, trajectory.gravity, trajectory.ellipsoid, felt)
    return navigate_platform(
        time, forces, setup.initial, errors.imu, errors.platform, setup.scenario.seed, of, height=setup.height
    )


def turned(setup: Setup) -> Setup:
    """Turn the initial state into the rotating IMU, if it rotates, and the solutions out of it by the readings of its
    encoders."""
    if setup.scenario.imu.rotation is None or not isinstance(setup.truth, Truth):
        return setup
    block, time = setup.truth.block, setup.imu.time
    encoders = encoders_of(block, None if setup.errors is None else setup.errors.encoders, time)
    assert encoders is not None  # the block turns
    inner = setup.engine

    def engine(setup_of_run: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
        return encoders.turned_out(inner(setup_of_run, imu, of))

    return replace(setup, initial=turned_in(setup.initial, block, float(time[0])), engine=engine)


SPECIAL = (in_known_field, turned, after_alignment, on_platform)
"""What changes the setup of a special system, in order: an alignment begins in the turned axes of a rotating IMU, whose
encoders turn out what is navigated in a known field. The engine of each calls those before it."""


@short_repr
@dataclass(frozen=True)
class Navigated:
    """The inertial solutions of a run.

    Solutions and errors are computed when they are first wanted, the same bits each time; see `light`.

    Attributes:
        scenario: the scenario.
        sensed: what the sensors read.
    """

    scenario: Scenario
    sensed: Sensed

    @property
    def truth(self) -> Truth | RecordedMotion:
        """The true motion, or what is known of a recorded one."""
        return self.sensed.truth

    @property
    def time(self) -> Array:
        """Edges of the IMU's intervals, (N+1,) s."""
        return self.truth.time

    @cached_property
    def _solved(self) -> tuple[dict[str, NavSolution], dict[str, RunError]]:
        return _solved(self.scenario, self.sensed)

    @property
    def solutions(self) -> dict[str, NavSolution]:
        """Navigation solutions by algorithm, for those that have one."""
        return self._solved[0]

    @property
    def lacking(self) -> dict[str, RunError]:
        """Errors of algorithms and navigators without a solution."""
        return self._solved[1]

    @cached_property
    def failures(self) -> dict[str, RunError]:
        """Errors of algorithms whose solution is missing, incomplete or not finite."""
        return {**self.lacking, **(diverged(self.errors) if isinstance(self.truth, Truth) else {})}

    @cached_property
    def axes(self) -> str:
        """Axes in which errors are compared, one of `sinssim.strapdown.frames.AXES`."""
        return self.truth.axes(self.scenario.navigation.frame)

    @cached_property
    def errors(self) -> dict[str, NavError]:
        """Errors of the solutions by algorithm; differences from the reference of recorded sensors."""
        with thread_pool(os.cpu_count()) as pool:
            nav_errors = pool.map(lambda solution: self.truth.error_of(solution, self.axes), self.solutions.values())
            return dict(zip(self.solutions, nav_errors, strict=True))

    def light(self) -> Navigated:
        """Return the same without what can be computed again."""
        sensed = self.sensed
        run = Navigated(self.scenario, replace(sensed, truth=replace(sensed.truth)))
        if self.scenario.navigator or self.scenario.filters:  # nothing is started or filtered a second time
            vars(run)["_solved"] = self._solved
        return run

    def compared_with(self, reference: Reference | None) -> Navigated:
        """Return the same solutions of recorded sensors with the errors against a reference."""
        assert isinstance(self.truth, RecordedMotion)
        truth = replace(self.truth, reference=reference)
        run = Navigated(self.scenario, replace(self.sensed, truth=truth))
        vars(run)["_solved"] = self._solved
        return run


def before_navigation(scenario: Scenario, sensed: Sensed) -> Navigated:
    """Return a run whose sensors have been read, without a solution."""
    run = Navigated(scenario, sensed)
    vars(run)["_solved"] = ({}, {})
    return run


def navigate(scenario: Scenario, sensed: Sensed) -> Navigated:
    """Navigate by every algorithm of a scenario.

    Returns:
        The run so far, which holds its solutions.

    Raises:
        InputError: as for `solve`.
        RunError: no algorithm has a solution.
    """
    run = Navigated(scenario, sensed)
    vars(run)["_solved"] = _solved(scenario, sensed)
    return run


def _solved(scenario: Scenario, sensed: Sensed) -> tuple[dict[str, NavSolution], dict[str, RunError]]:
    s = sensed
    solutions, failures = solve(scenario, s.truth, s.imu, s.readings.attitude, s.height, s.errors)
    for further in scenario.filters:
        try:
            solutions = {**solutions, further.name: _by_filter(scenario, further.name, sensed)}
        except RunError as error:
            failures = {**failures, further.name: error}
    return solutions, failures


def _by_filter(scenario: Scenario, name: str, sensed: Sensed) -> NavSolution:
    """Return the solution of a filter beside that of [filter], whose states are written out."""
    from sinssim.scenario.filter_model import with_first
    from sinssim.simulation.truth_comparison import FilterSolution

    alone = with_first(scenario, name)
    assert alone.filter is not None  # as there are others
    if isinstance(motion := sensed.truth, RecordedMotion):
        sensed = replace(sensed, truth=replace(motion, prepared=replace(motion.prepared, scenario=alone)))
    if alone.filter.kind in SHIPPED:
        aided = aid(alone, sensed, history=False)
        estimate, seconds = aided.estimate, aided.seconds
        fields = {**vars(estimate.solution), "aided": aided, "sigma": estimate.sigma[:, :9]}
    else:
        from sinssim.simulation.project_filter import filtered_by_project

        began = time.thread_time()
        solution, sigma = filtered_by_project(alone, sensed, first_state(alone, sensed.truth))
        seconds = time.thread_time() - began
        fields = {**vars(solution), "sigma": sigma}
    fields |= {"algorithm": name, "kind": alone.filter.kind, "seconds": seconds}
    return FilterSolution(**fields)


def what_if(navigated: Navigated, algorithm: str, imu: ImuData, scenario: Scenario | None = None) -> NavError | None:
    """Return the errors of one algorithm of a run, in its axes, if its sensors had read something else, by default in
    the run's own scenario; None if there is no solution."""
    sensed = replace(navigated.sensed, readings=Readings(imu), errors=None)
    try:
        return navigate(by_one(scenario or navigated.scenario, algorithm), sensed).errors[algorithm]
    except RunError:
        return None


def by_one(scenario: Scenario, name: str) -> Scenario:
    """Return a scenario that navigates by one of its algorithms, navigators of others or further filters alone."""
    others = {key: tuple(of for of in getattr(scenario, key) if of.name == name) for key in ("navigator", "filters")}
    algorithms: tuple[str, ...] = (name,)
    if any(others.values()):  # a filter navigates by the first algorithm
        algorithms = scenario.navigation.algorithms[:1] if others["filters"] else ()
    navigation = scenario.navigation.model_copy(update={"algorithms": algorithms})
    return scenario.model_copy(update={"navigation": navigation, **others})


def solve(
    scenario: Scenario,
    truth: Truth | RecordedMotion,
    imu: ImuData,
    attitude: Array | None,
    height: Array | HeightReadings | None,
    errors: TrueErrors | None = None,
) -> tuple[dict[str, NavSolution], dict[str, RunError]]:
    """Navigate by every algorithm in parallel, as the kernels release the interpreter's lock, and by other navigators.
    The initial state comes from the true motion, or what is known of a recorded one. `attitude` is the measured q_ib of
    a set with an attitude sensor, (N+1, 4), `height` the reference as in `Sensed.height`; a platform needs the true
    errors of the sensors. Return the solutions of the successful algorithms, with the vehicle's attitude, and the
    errors of the others. One at least is successful, unless a filter goes on with recorded sensors."""
    section, axes = scenario.navigation, truth.axes(scenario.navigation.frame)
    initial = initial_state_with_errors(truth.first, section.initial_error, truth.ellipsoid, scenario.seed, axes)
    setup = Setup(scenario, truth, errors, imu, attitude, initial, height, _strapdown)
    for change in SPECIAL:
        setup = change(setup)
    if section.vertical == "free":
        setup = replace(setup, height=None)

    def by(algorithm: str) -> NavSolution | RunError:
        of = section.mechanization(algorithm, truth.ellipsoid.name)
        if setup.height is None:
            of = replace(of, vertical="free", baro_time_constant=BARO_TIME_CONSTANT)
        try:
            return setup.engine(setup, setup.imu, of)
        except RunError as error:
            return error

    if len(section.algorithms) <= 1 and threading.current_thread() is not threading.main_thread():
        # a run of an ensemble: Ctrl-C does not wait for this thread
        results: dict[str, NavSolution | RunError] = {name: by(name) for name in section.algorithms}
    else:
        with thread_pool(os.cpu_count()) as pool:
            results = dict(zip(section.algorithms, pool.map(by, section.algorithms), strict=True))
    if scenario.navigator:
        from sinssim.simulation.foreign_navigator import foreign_solutions

        results |= foreign_solutions(scenario, truth, imu, setup.imu, setup.initial)
    failures = {name: result for name, result in results.items() if isinstance(result, RunError)}
    goes_on = isinstance(truth, RecordedMotion) and scenario.filter is not None  # without them: a long log of a phone
    if len(failures) == len(results) and not goes_on and not scenario.filters:
        raise next(iter(failures.values()))
    return {name: result for name, result in results.items() if not isinstance(result, RunError)}, failures


def _strapdown(setup: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
    """Navigate by a strapdown algorithm."""
    from sinssim.strapdown.measured_attitude import navigate_set

    return navigate_set(imu, setup.attitude, setup.initial, of, setup.height)


def aid(scenario: Scenario, sensed: Sensed, progress: Progress = silent, *, history: bool = True) -> Aided:
    """Run the filter of a scenario, whose states are written out, from the initial state of its inertial solutions.
    Return the aided solution with its errors, or its differences from the reference of recorded sensors. The history is
    for smoothing and observability; the progress is what a diagnosis tries and the fraction done."""
    began = time.thread_time()
    if isinstance(sensed.truth, RecordedMotion):
        aided = _aid_recorded(scenario, sensed, sensed.truth, progress, history)
        return replace(aided, seconds=time.thread_time() - began)

    from sinssim.simulation.aided_run import aid_run

    assert sensed.errors is not None  # those of simulated sensors are known
    aided = aid_run(
        scenario,
        sensed.truth.trajectory,
        sensed.imu,
        first_state(scenario, sensed.truth),
        sensed.errors,
        monitored=sensed.readings.monitored,
        history=history,
        progress=progress,
    )
    return replace(aided, seconds=time.thread_time() - began)


def first_state(scenario: Scenario, truth: Truth | RecordedMotion) -> NavState:
    """Return the state that the filter of a run starts from, with the initial errors of the scenario."""
    axes = truth.axes(scenario.navigation.frame) if isinstance(truth, Truth) else "north"
    error = scenario.navigation.initial_error
    return initial_state_with_errors(truth.first, error, truth.ellipsoid, scenario.seed, axes)


def recorded_start(scenario: Scenario, sensed: Sensed) -> Start:
    """Return the start of the filter on recorded sensors."""
    from sinssim.estimation.filter_start import Start

    return Start(sensed.imu, first_state(scenario, sensed.truth), None)


def _aid_recorded(
    scenario: Scenario, sensed: Sensed, motion: RecordedMotion, progress: Progress, history: bool
) -> Aided:
    """Run the filter; without a reference it is compared with its own smoothed solution, which has no error then."""
    from sinssim.simulation.recorded_filter_run import aid_recorded, all_readings, as_reference, compare_recorded

    prepared, start = motion.prepared, recorded_start(scenario, sensed)
    estimate = aid_recorded(prepared, sensed.imu, start, history=history, progress=progress)
    reference = motion.reference
    if reference is None and estimate.smoothed is not None:
        reference = as_reference("the smoothed solution", estimate.smoothed.solution)
    aided = compare_recorded(estimate, all_readings(prepared), reference, float(motion.time[-1]))
    if motion.reference is None and (smoothed_error := aided.smoothed_error) is not None:
        # it would be zero, up to rounding
        aided = replace(aided, smoothed_error=unknown_error(smoothed_error.time))
    return aided


def best_reference(motion: RecordedMotion, aided: Aided | None, solutions: dict[str, NavSolution]) -> Reference | None:
    """Return what the inertial solutions of recorded sensors are compared with, the best that is known: the recorded
    reference, or else the smoothed solution, the aided one, if there is a filter, or the first of several; None for
    nothing."""
    from sinssim.simulation.recorded_filter_run import as_reference

    if motion.reference is not None:
        return motion.reference
    if aided is not None and len(aided.estimate.time) > 1:
        smoothed = aided.estimate.smoothed
        name = "the aided solution" if smoothed is None else "the smoothed solution"
        return as_reference(name, (smoothed or aided.estimate).solution)
    if len(solutions) > 1:
        name, solution = next(iter(solutions.items()))
        return as_reference(f"the solution {name}", solution)
    return None
