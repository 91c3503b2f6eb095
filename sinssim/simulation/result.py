"""The result of a run: `Run`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sinssim.algorithms import PLATFORM
from sinssim.system.threads import thread_pool

if TYPE_CHECKING:
    from sinssim.data import Array, ImuData, NavSolution, NavState
    from sinssim.errors import RunError
    from sinssim.estimation.from_scenario.recorded_run import Prepared
    from sinssim.estimation.from_scenario.truth_comparison import Aided
    from sinssim.logs.reference import Reference
    from sinssim.platform.error_equations import ErrorsByCause
    from sinssim.platform.navigate import PlatformSolution
    from sinssim.recording.sensor_comparison import SensorComparison
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.reading import Readings
    from sinssim.sensors.sets.true_errors import TrueErrors
    from sinssim.simulation.one_component import OneComponentResult
    from sinssim.strapdown.nav_error import NavError
    from sinssim.truth.trajectory import Trajectory


_MADE_OF = {
    "truth": "time", "ideal": "time", "perfect": "readings", "sensed": "readings", "solutions": "failures",
    "errors": "failures",
}  # fmt: skip
"""Sources of the computed properties."""


@dataclass(eq=False, repr=False)
class Run:
    """The result of a run, filled stage by stage.

    Attributes of later stages are missing until these have run; see `has`. A finished run has all of them. `forget`
    frees the values that the properties can compute again.

    Attributes:
        scenario: the scenario; the states of its filter are written out.
        recorded: whether the run is written to a run directory.
        about_filter: lines that explain the filter's default states.
        trajectory: the true motion.
        time: edges of the IMU's intervals, (N+1,) s.
        readings: readings of the sensors.
        compensated: compensated increments; the measured ones without a calibration.
        failures: errors of algorithms whose solution is missing or incomplete.
        aided: the aided solution with its errors, of a scenario with a filter.
        one_component: the run in a vertical plane, of a scenario with [one_component].
        prepared: the recorded sensors of a scenario with [log]; such a run has no `trajectory`.
        reference: what its inertial solutions are compared with: a recorded reference, or its best solution.
        summary: contents of `summary.json`.
        directory: the run directory, None if nothing was recorded.
    """

    scenario: Scenario
    recorded: bool = False
    about_filter: Sequence[str] = field(init=False, default=())
    trajectory: Trajectory = field(init=False)
    time: Array = field(init=False)
    readings: Readings = field(init=False)
    compensated: ImuData = field(init=False)
    failures: dict[str, RunError] = field(init=False)
    aided: Aided | None = field(init=False, default=None)
    one_component: OneComponentResult | None = field(init=False, default=None)
    prepared: Prepared | None = field(init=False, default=None)
    reference: Reference | None = field(init=False, default=None)
    summary: dict[str, Any] = field(init=False, default_factory=dict)
    directory: Path | None = field(init=False, default=None)

    @cached_property
    def truth(self) -> NavState:
        """True states at `time`."""
        return self.trajectory.state(self.time)

    @cached_property
    def ideal(self) -> ImuData:
        """Ideal increments."""
        return replace(self.trajectory.increments(self.scenario.imu.rate_hz), time=self.time)

    @cached_property
    def perfect(self) -> Readings:
        """What the sensors would have read without errors."""
        from sinssim.sensors.sets.reading import Readings, read

        if all(one is None for one in (self.readings.accelerometers, self.readings.attitude, self.readings.single)):
            return Readings(self.ideal)
        return read(self.trajectory, self.ideal, self.scenario.imu, self.scenario.seed, self.true_errors)[0]

    @cached_property
    def sensed(self) -> Sequence[SensorComparison]:
        """What the sensors read by kinds of sensors, as report and view draw it, of a run that is recorded."""
        from sinssim.recording.sensor_comparison import compare_sensors

        if not (self.recorded and self.has("compensated")):
            return ()
        compensated = None if self.compensated is self.measured else self.compensated
        return tuple(compare_sensors(self.readings, self.perfect, self.ideal, compensated))

    @cached_property
    def solutions(self) -> dict[str, NavSolution]:
        """Navigation solutions by algorithm, for those that have one."""
        from sinssim.simulation.navigation import height_reference, solve

        height = height_reference(self.scenario, self.trajectory, self.truth.height)
        imu, attitude = self.compensated, self.readings.attitude
        return solve(self.scenario, self.trajectory, imu, attitude, height, self.true_errors, self.truth)[0]

    @cached_property
    def axes(self) -> str:
        """Axes in which errors are compared, one of `sinssim.frames.AXES`."""
        from sinssim.strapdown.polar import axes_along

        trajectory = self.trajectory
        return axes_along(self.scenario.navigation.frame, trajectory.state, trajectory.start, trajectory.end)

    @cached_property
    def errors(self) -> dict[str, NavError]:
        """Errors of the solutions by algorithm."""
        from sinssim.strapdown.nav_error import navigation_error

        def error_of(solution: NavSolution) -> NavError:
            # the solution of an algorithm that takes several samples at once has fewer rows
            truth = self.truth if len(solution.time) == len(self.time) else self.trajectory.state(solution.time)
            return navigation_error(truth, solution, self.trajectory.ellipsoid, self.axes)

        with thread_pool(os.cpu_count()) as pool:
            return dict(zip(self.solutions, pool.map(error_of, self.solutions.values()), strict=True))

    @cached_property
    def without_monitoring(self) -> NavError | None:
        """Errors of the first algorithm with a solution if a redundant set's faulty sensors had been used to the end.

        None if no sensor was excluded, because the solution is then the same, or if there is no solution with them.
        """
        from sinssim.errors import RunError
        from sinssim.scenario.sections.within_imu.sensor_set import Redundant
        from sinssim.sensors.sets.reading import unmonitored
        from sinssim.simulation.navigation import height_reference, solve
        from sinssim.strapdown.nav_error import navigation_error

        section = self.scenario.imu.sensor_set
        if not (isinstance(section, Redundant) and any(kind.excluded for kind in self.readings.monitored)):
            return None
        alone = self.scenario.navigation.model_copy(update={"algorithms": tuple(self.solutions)[:1]})
        height = height_reference(self.scenario, self.trajectory, self.truth.height)
        imu = unmonitored(self.readings, section.axes)
        scenario = self.scenario.model_copy(update={"navigation": alone})
        try:
            (solution,) = solve(scenario, self.trajectory, imu, None, height)[0].values()
        except RunError:
            return None
        truth = self.truth if len(solution.time) == len(self.time) else self.trajectory.state(solution.time)
        return navigation_error(truth, solution, self.trajectory.ellipsoid, self.axes)

    @property
    def platform(self) -> PlatformSolution | None:
        """The solution of a platform's navigator, with the platform itself; None without a platform or its solution."""
        from sinssim.platform.navigate import PlatformSolution

        found = self.solutions.get(PLATFORM)
        return found if isinstance(found, PlatformSolution) else None

    @property
    def strapdown(self) -> tuple[str, NavError] | None:
        """The first strapdown algorithm with a solution, and its errors; None without one."""
        return next(((name, error) for name, error in self.errors.items() if name != PLATFORM), None)

    @cached_property
    def without_errors_of_turns(self) -> NavError | None:
        """Errors of `strapdown` beside a platform if its gyros had no errors that act on what they sense.

        These are scale factor, misalignment and non-linearity, which a platform does not have. None without a platform
        or such a solution.
        """
        from sinssim.errors import RunError
        from sinssim.sensors.imu.emulate import emulate
        from sinssim.sensors.imu.rectification import rectified
        from sinssim.sensors.sets.platform import without_errors_of_turns
        from sinssim.simulation.navigation import height_reference, solve
        from sinssim.strapdown.nav_error import navigation_error

        if self.true_errors.platform is None or self.strapdown is None:
            return None
        errors = without_errors_of_turns(self.true_errors.imu)
        imu = emulate(rectified(self.trajectory, self.ideal, errors), errors, self.scenario.seed)
        alone = self.scenario.navigation.model_copy(update={"algorithms": (self.strapdown[0],)})
        scenario = self.scenario.model_copy(update={"navigation": alone})
        height = height_reference(self.scenario, self.trajectory, self.truth.height)
        try:
            (solution,) = solve(scenario, self.trajectory, imu, None, height)[0].values()
        except RunError:
            return None
        truth = self.truth if len(solution.time) == len(self.time) else self.trajectory.state(solution.time)
        return navigation_error(truth, solution, self.trajectory.ellipsoid)

    @cached_property
    def platform_errors_by_cause(self) -> ErrorsByCause | None:
        """Position errors of a platform's solution by cause, from the linear error equations; None without one."""
        from sinssim.platform.error_equations import errors_by_cause
        from sinssim.platform.force import inertial_forces

        solution, own = self.platform, self.true_errors.platform
        if solution is None or own is None:
            return None
        true = self.trajectory
        forces = inertial_forces(self.time, self.truth, true.gravity, true.ellipsoid)
        return errors_by_cause(self.truth, forces, solution, own, true.ellipsoid)

    def forget(self) -> None:
        """Free what can be computed again; the next access computes it, with the same bits."""
        computed = ("truth", "ideal", "perfect", "sensed", "solutions", "errors", "platform_errors_by_cause")
        for name in (*computed, "without_monitoring", "without_errors_of_turns"):
            vars(self).pop(name, None)

    @cached_property
    def true_errors(self) -> TrueErrors:
        """The true errors of the sensors in this run, drawn once."""
        from sinssim.sensors.sets.true_errors import draw_true_errors

        return draw_true_errors(self.scenario.imu, self.scenario.seed, self.scenario.compensation)

    @property
    def measured(self) -> ImuData:
        """Measured increments.

        Angle increments are NaN for sets that measure the attitude, and come from differences of accelerometers for
        sets of six accelerometers.
        """
        return self.readings.imu

    def has(self, *names: str) -> bool:
        """Return whether attributes have been computed.

        Args:
            *names: names of attributes, for example "truth".

        Returns:
            Whether all of them exist.
        """
        return all(_MADE_OF.get(name, name) in vars(self) for name in names)


RunResult = Run
"""The return type of `run`: a finished `Run`."""
