"""The third stage of a run: the solutions of every algorithm of its scenario, and their errors."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from sinssim.data import Array, ImuData, NavSolution
from sinssim.errors import RunError
from sinssim.frames import BARO_TIME_CONSTANT
from sinssim.scenario.initial_error import initial_state_with_errors
from sinssim.sensors.sets.reading import Readings
from sinssim.simulation.setup import Setup
from sinssim.simulation.special.known_gravity import in_known_field
from sinssim.simulation.special.own_alignment import after_alignment
from sinssim.simulation.special.platform import on_platform
from sinssim.simulation.special.rotation import turned
from sinssim.simulation.truth import RecordedMotion, Truth
from sinssim.strapdown.error_numbers import diverged
from sinssim.system.short_repr import short_repr
from sinssim.system.threads import thread_pool

if TYPE_CHECKING:
    from sinssim.logs.reference import Reference
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.true_errors import TrueErrors
    from sinssim.simulation.sensed import Sensed
    from sinssim.strapdown.frames.vertical import HeightReadings
    from sinssim.strapdown.mechanization import Mechanization
    from sinssim.strapdown.nav_error import NavError

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

    @cached_property
    def failures(self) -> dict[str, RunError]:
        """Errors of algorithms whose solution is missing, incomplete or not finite."""
        return {**self._solved[1], **(diverged(self.errors) if isinstance(self.truth, Truth) else {})}

    @cached_property
    def axes(self) -> str:
        """Axes in which errors are compared, one of `sinssim.frames.AXES`."""
        return self.truth.axes(self.scenario.navigation.frame)

    @cached_property
    def errors(self) -> dict[str, NavError]:
        """Errors of the solutions by algorithm; differences from the reference of recorded sensors."""
        with thread_pool(os.cpu_count()) as pool:
            found = pool.map(lambda solution: self.truth.error_of(solution, self.axes), self.solutions.values())
            return dict(zip(self.solutions, found, strict=True))

    def light(self) -> Navigated:
        """Return the same without what can be computed again."""
        sensed = self.sensed
        return Navigated(self.scenario, replace(sensed, truth=replace(sensed.truth)))

    def compared_with(self, reference: Reference | None) -> Navigated:
        """Return the same solutions of recorded sensors with the errors against a reference."""
        assert isinstance(self.truth, RecordedMotion)
        truth = replace(self.truth, reference=reference)
        found = Navigated(self.scenario, replace(self.sensed, truth=truth))
        vars(found)["_solved"] = self._solved
        return found


def before_navigation(scenario: Scenario, sensed: Sensed) -> Navigated:
    """Return a run whose sensors have been read, without a solution."""
    found = Navigated(scenario, sensed)
    vars(found)["_solved"] = ({}, {})
    return found


def navigate(scenario: Scenario, sensed: Sensed) -> Navigated:
    """Navigate by every algorithm of a scenario.

    Returns:
        The run so far, which holds its solutions.

    Raises:
        InputError: as for `solve`.
        RunError: no algorithm has a solution.
    """
    found = Navigated(scenario, sensed)
    vars(found)["_solved"] = _solved(scenario, sensed)
    return found


def _solved(scenario: Scenario, sensed: Sensed) -> tuple[dict[str, NavSolution], dict[str, RunError]]:
    s = sensed
    return solve(scenario, s.truth, s.imu, s.readings.attitude, s.height, s.errors)


def what_if(navigated: Navigated, algorithm: str, imu: ImuData, scenario: Scenario | None = None) -> NavError | None:
    """Return the errors of one algorithm of a run if its sensors had read something else.

    Args:
        scenario: the scenario of the other run, by default that of the run.

    Returns:
        The errors in the axes of the run; None if there is no solution.
    """
    sensed = replace(navigated.sensed, readings=Readings(imu), errors=None)
    try:
        return navigate(by_one(scenario or navigated.scenario, algorithm), sensed).errors[algorithm]
    except RunError:
        return None


def by_one(scenario: Scenario, algorithm: str) -> Scenario:
    """Return a scenario that navigates by one of its algorithms alone."""
    navigation = scenario.navigation.model_copy(update={"algorithms": (algorithm,)})
    return scenario.model_copy(update={"navigation": navigation})


def solve(
    scenario: Scenario,
    truth: Truth | RecordedMotion,
    imu: ImuData,
    attitude: Array | None,
    height: Array | HeightReadings | None,
    errors: TrueErrors | None = None,
) -> tuple[dict[str, NavSolution], dict[str, RunError]]:
    """Navigate by every algorithm in parallel, as the kernels release the interpreter's lock.

    Args:
        truth: the true motion, or what is known of a recorded one, for the initial state.
        attitude: measured q_ib of a set with an attitude sensor, (N+1, 4).
        height: height reference, see `Sensed.height`.
        errors: the true errors of the sensors, which a platform needs.

    Returns:
        The solutions of the successful algorithms, with the vehicle's attitude, and the errors of the others.

    Raises:
        InputError: the data or the engine do not admit an option, a platform has no errors, or the navigator's own
            alignment fails.
        RunError: no algorithm has a solution.
    """
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

    with thread_pool(os.cpu_count()) as pool:
        results = dict(zip(section.algorithms, pool.map(by, section.algorithms), strict=True))
    failures = {name: result for name, result in results.items() if isinstance(result, RunError)}
    if len(failures) == len(results):
        raise next(iter(failures.values()))
    return {name: result for name, result in results.items() if not isinstance(result, RunError)}, failures


def _strapdown(setup: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
    """Navigate by a strapdown algorithm."""
    from sinssim.strapdown.measured_attitude import navigate_set

    return navigate_set(imu, setup.attitude, setup.initial, of, setup.height)
