"""Everything that one run computes: `Run`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sinssim.data import Array, ImuData, NavSolution, NavState
    from sinssim.errors import RunError
    from sinssim.estimation.from_scenario.truth_comparison import Aided
    from sinssim.recording.sensor_comparison import SensorComparison
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.reading import Readings
    from sinssim.sensors.sets.true_errors import TrueErrors
    from sinssim.strapdown.nav_error import NavError
    from sinssim.truth.trajectory import Trajectory


@dataclass(eq=False, repr=False)
class Run:
    """Everything that one run computes, filled stage by stage.

    What no stage has computed yet is not there: `has` tells. A finished run has everything.

    Attributes:
        scenario: what is run; the states of its filter are written out.
        about_filter: which states the filter has by default, and why; lines.
        trajectory: the true motion.
        truth: true states at the IMU's interval edges, `time`.
        ideal: ideal increments.
        readings: everything that the sensors read.
        perfect: what they would have read without errors.
        compensated: measured increments freed of what the calibration knows, the measured ones without a calibration.
        sensed: what the sensors read by kinds of sensors, as report and view draw it, of a run that is recorded.
        solutions: navigation solutions by algorithm; of those that have one.
        errors: their errors by algorithm.
        failures: why algorithms have no solution, or none without an end.
        aided: the aided solution and all about it, of a scenario with a filter.
        summary: what `summary.json` holds.
        directory: the run directory, None if nothing was recorded.
    """

    scenario: Scenario
    about_filter: Sequence[str] = field(init=False, default=())
    trajectory: Trajectory = field(init=False)
    truth: NavState = field(init=False)
    ideal: ImuData = field(init=False)
    readings: Readings = field(init=False)
    perfect: Readings = field(init=False)
    compensated: ImuData = field(init=False)
    sensed: Sequence[SensorComparison] = field(init=False, default=())
    solutions: dict[str, NavSolution] = field(init=False, default_factory=dict)
    errors: dict[str, NavError] = field(init=False, default_factory=dict)
    failures: dict[str, RunError] = field(init=False, default_factory=dict)
    aided: Aided | None = field(init=False, default=None)
    summary: dict[str, Any] = field(init=False, default_factory=dict)
    directory: Path | None = field(init=False, default=None)

    @cached_property
    def true_errors(self) -> TrueErrors:
        """The true errors of the sensors in this run, drawn once."""
        from sinssim.sensors.sets.true_errors import draw_true_errors

        return draw_true_errors(self.scenario.imu, self.scenario.seed, self.scenario.compensation)

    @property
    def measured(self) -> ImuData:
        """Measured increments.

        Those of angle are NaN where sensors measure the attitude instead, and come from the differences of
        accelerometers where there are six.
        """
        return self.readings.imu

    @property
    def time(self) -> Array:
        """Edges of the IMU's intervals, (N+1,) s."""
        return self.ideal.time

    def has(self, *names: str) -> bool:
        """Return whether stages have computed something.

        Args:
            *names: of attributes, for example "truth".

        Returns:
            Whether all of them are there.
        """
        return all(name in vars(self) for name in names)


RunResult = Run
"""What `run` returns: a finished `Run`."""
