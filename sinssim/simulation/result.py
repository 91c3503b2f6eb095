"""The result of a run: `Run`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sinssim.algorithms import PLATFORM
from sinssim.result import Result
from sinssim.system.short_repr import html_table
from sinssim.system.threads import thread_pool

if TYPE_CHECKING:
    from sinssim.data import Array, ImuData, NavSolution, NavState
    from sinssim.errors import RunError
    from sinssim.estimation.from_scenario.recorded_run import JudgedOutages, Prepared
    from sinssim.estimation.from_scenario.truth_comparison import Aided
    from sinssim.logs.reference import Reference
    from sinssim.platform.error_equations import ErrorsByCause
    from sinssim.platform.navigate import PlatformSolution
    from sinssim.recording.sensor_comparison import SensorComparison
    from sinssim.scenario import Scenario
    from sinssim.sensors.imu.encoder import Encoders
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

_AIDED = ("aided", "backward", "smoothed")
_SHOWN = ("horizontal_error_m", "velocity_error_mps", "attitude_error_arcsec")


@dataclass(eq=False, repr=False)
class Run(Result):
    """The result of a run, filled stage by stage.

    Attributes of later stages are missing until these have run; see `has`. A finished run has all of them. `forget`
    frees the values that the properties can compute again.

    Attributes:
        scenario: the scenario; the states of its filter are written out.
        recorded: whether the run is written to a run directory.
        about_filter: lines that explain the filter's default states.
        trajectory: the true motion of the vehicle at the block's place, in the axes of its mounting.
        time: edges of the IMU's intervals, (N+1,) s.
        readings: readings of the sensors.
        compensated: compensated increments; the measured ones without a calibration.
        failures: errors of algorithms whose solution is missing or incomplete.
        aided: the aided solution with its errors, of a scenario with a filter.
        one_component: the run in a vertical plane, of a scenario with [one_component].
        prepared: the recorded sensors of a scenario with [log]; such a run has no `trajectory`.
        outages: the errors of injected outages of a run on recorded sensors; None without any.
        reference: reference for the inertial solutions: a recorded reference, or the best solution of the run.
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
    outages: JudgedOutages | None = field(init=False, default=None)
    summary: dict[str, Any] = field(init=False, default_factory=dict)
    directory: Path | None = field(init=False, default=None)

    def __repr__(self) -> str:
        state = self.summary.get("status", "not finished")
        parts = [str(state), *([f"{self.time[0]:g} … {self.time[-1]:g} s"] if self.has("time") else [])]
        parts += [", ".join(self.summary.get("algorithms", ()))] if self.summary.get("algorithms") else []
        parts += ["with a filter"] if self.aided is not None else []
        return f"Run({self.scenario.name}: {'; '.join(parts)})"

    def _repr_html_(self) -> str:
        of_filter = self.summary.get("filter") or {}
        solutions = {**self.summary.get("algorithms", {}), **{k: of_filter[k] for k in _AIDED if k in of_filter}}
        rows = [
            (name, *(f"{one.get(f'{kind}_{what}', float('nan')):.4g}" for what in _SHOWN for kind in ("final", "max")))
            for name, one in solutions.items()
            if isinstance(one.get(f"final_{_SHOWN[0]}"), float)
        ]
        heads = ("solution", "horizontal error at the end, m", "largest", "velocity error at the end, m/s", "largest",
                 "attitude error at the end, arcsec", "largest")  # fmt: skip
        return html_table(repr(self), rows, heads if rows else ())

    @cached_property
    def truth(self) -> NavState:
        """True states at `time`."""
        return self.trajectory.state(self.time)

    @cached_property
    def block(self) -> Trajectory:
        """The motion of the sensors: that of the rotating IMU with [imu.rotation], else `trajectory`."""
        from sinssim.scenario.true_motion import block_of

        return block_of(self.trajectory, self.scenario.imu)

    @cached_property
    def ideal(self) -> ImuData:
        """Ideal increments, in the steps of `digital`."""
        from sinssim.sensors.imu.emulate import digital

        return replace(digital(self.block.increments(self.scenario.imu.rate_hz)), time=self.time)

    @cached_property
    def perfect(self) -> Readings:
        """Measurements of the same sensors without errors."""
        from sinssim.sensors.sets.reading import Readings, read

        if all(one is None for one in (self.readings.accelerometers, self.readings.attitude, self.readings.single)):
            return Readings(self.ideal)
        return read(self.block, self.ideal, self.scenario.imu, self.scenario.seed, self.true_errors)[0]

    @cached_property
    def sensed(self) -> Sequence[SensorComparison]:
        """Measurements by kind of sensor, as drawn in the report and the views; only of a recorded run."""
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
        from sinssim.sensors.sets.reading import unmonitored
        from sinssim.sensors.sets.sensor_set import Redundant
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

    @cached_property
    def encoders(self) -> Encoders | None:
        """The encoders of a block that turns; None for another."""
        from sinssim.sensors.imu.encoder import encoders_of

        return encoders_of(self.block, self.true_errors.encoders, self.time)

    @cached_property
    def without_rotation(self) -> NavError | None:
        """Errors of the first algorithm with a solution if the block, with the same errors, did not turn.

        None without [imu.rotation], or if there is no solution.
        """
        from sinssim.errors import RunError
        from sinssim.sensors.imu.emulate import digital
        from sinssim.sensors.sets.reading import read
        from sinssim.simulation.navigation import height_reference, solve
        from sinssim.strapdown.nav_error import navigation_error

        if self.scenario.imu.rotation is None:
            return None
        imu_section = self.scenario.imu.model_copy(update={"rotation": None})
        alone = self.scenario.navigation.model_copy(update={"algorithms": tuple(self.solutions)[:1]})
        scenario = self.scenario.model_copy(update={"imu": imu_section, "navigation": alone})
        ideal = digital(self.trajectory.increments(imu_section.rate_hz))
        readings = read(self.trajectory, ideal, imu_section, scenario.seed, self.true_errors)[1]
        imu = readings.compensated or readings.imu
        height = height_reference(self.scenario, self.trajectory, self.truth.height)
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
        """Errors of `strapdown` beside a platform if its gyros had no errors that depend on the sensed rate.

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
        imu = emulate(rectified(self.trajectory, self.ideal, errors), errors, self.scenario.seed, rounded=True)
        alone = self.scenario.navigation.model_copy(update={"algorithms": (self.strapdown[0],)})
        scenario = self.scenario.model_copy(update={"navigation": alone})
        height = height_reference(self.scenario, self.trajectory, self.truth.height)
        try:
            (solution,) = solve(scenario, self.trajectory, imu, None, height)[0].values()
        except RunError:
            return None
        truth = self.truth if len(solution.time) == len(self.time) else self.trajectory.state(solution.time)
        return navigation_error(truth, solution, self.trajectory.ellipsoid, self.axes)

    @cached_property
    def platform_errors_by_cause(self) -> ErrorsByCause | None:
        """Position errors of a platform's solution by cause, from the linear error equations; None without one."""
        from sinssim.platform.error_equations import errors_by_cause
        from sinssim.platform.force import inertial_forces
        from sinssim.truth.gravity.disturbed import Disturbed

        solution, own = self.platform, self.true_errors.platform
        if solution is None or own is None:
            return None
        true = self.trajectory
        felt = true.disturbance_ned(self.time, self.truth) if isinstance(true, Disturbed) else None
        forces = inertial_forces(self.time, self.truth, true.gravity, true.ellipsoid, felt)
        return errors_by_cause(self.truth, forces, solution, own, true.ellipsoid)

    def forget(self) -> None:
        """Free what can be computed again; the next access computes it, with the same bits."""
        computed = ("truth", "ideal", "perfect", "sensed", "solutions", "errors", "platform_errors_by_cause")
        for name in (*computed, "without_monitoring", "without_errors_of_turns", "without_rotation"):
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
