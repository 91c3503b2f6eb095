"""The first stage of a run: the true motion, or what is known of a recorded one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import NavSolution
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.strapdown.navigation_error import NavError, navigation_error
from sinssim.strapdown.solution_coordinates import axes_along, axes_of
from sinssim.system.short_repr import short_repr
from sinssim.truth.sampling import FlightEvent

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sinssim.data import Array, ImuData, NavState
    from sinssim.logs.reference_solution import Reference
    from sinssim.scenario import Scenario
    from sinssim.simulation.recorded_filter_run import Prepared
    from sinssim.truth.trajectory import Trajectory

_ROWS = ("time", "latitude", "longitude", "height", "velocity_ned", "q_nb", "defect")
"""Attributes of a solution that have a value in each row."""


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
    """

    trajectory: Trajectory
    block: Trajectory
    rate_hz: float
    time: Array

    @classmethod
    def along(
        cls, trajectory: Trajectory, block: Trajectory, rate_hz: float, ideal: ImuData, state: NavState | None = None
    ) -> Truth:
        """Return the truth along a motion, which holds what has been computed of it.

        Args:
            ideal: ideal increments along `block`, in the steps of `digital`.
            state: true states at their edges, if they are known.
        """
        truth = cls(trajectory, block, rate_hz, ideal.time)
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
        """Return the axes in which errors are compared, one of `sinssim.frames.AXES`, of a navigation frame."""
        return axes_along(frame, self.trajectory.state, self.trajectory.start, self.trajectory.end)

    def error_of(self, solution: NavSolution, axes: str, rows: NDArray[np.intp] | None = None) -> NavError:
        """Return the errors of a solution in given axes, at all of its rows or at some.

        The states of all rows are computed first: a single row may have other last bits than in an array.
        """
        # the solution of an algorithm that takes several samples at once has fewer rows
        there = self.state if len(solution.time) == len(self.time) else self.trajectory.state(solution.time)
        if rows is not None:
            there = replace(there, **{name: value[rows] for name, value in vars(there).items()})
            kept = {name: getattr(solution, name)[rows] for name in _ROWS}
            solution = NavSolution(**kept, algorithm=solution.algorithm, events=())
        return navigation_error(there, solution, self.ellipsoid, axes)


def truth_along(trajectory: Trajectory, scenario: Scenario) -> Truth:
    """Return the truth of a simulated run along the motion of its vehicle.

    Args:
        trajectory: the motion of the vehicle at the block's place.
    """
    from sinssim.scenario.true_motion import block_of
    from sinssim.sensors.imu.emulation import digital

    block, rate_hz = block_of(trajectory, scenario.imu), scenario.imu.rate_hz
    ideal = digital(block.increments(rate_hz))
    return Truth.along(trajectory, block, rate_hz, ideal, trajectory.state(ideal.time))


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
        """Return the axes in which errors are compared, one of `sinssim.frames.AXES`, of a navigation frame."""
        return axes_of(frame, self.first.latitude)

    def error_of(self, solution: NavSolution, axes: str) -> NavError:
        """Return the differences of a solution from the reference, NaN without one; `axes` are the reference's."""
        if self.reference is None:
            return NavError(solution.time, *(np.full((len(solution.time), 3), np.nan) for _ in range(3)))
        return self.reference.error_of(solution)
