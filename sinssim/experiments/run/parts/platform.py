"""A gimballed platform beside the same sensors strapped down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.algorithms import PLATFORM
from sinssim.data import ImuData
from sinssim.experiments.run.part import Part
from sinssim.simulation.navigation import Navigated, what_if
from sinssim.simulation.truth import Truth
from sinssim.strapdown.error_numbers import error_numbers

if TYPE_CHECKING:
    from sinssim.sensors.sets.platform import PlatformErrors
    from sinssim.strapdown.nav_error import NavError
    from sinssim.strapdown.platform.error_equations import ErrorsByCause
    from sinssim.strapdown.platform.navigate import PlatformSolution

_TURNING = 10.0 * units.DEG / 60.0  # rate above which the vehicle is said to turn, rad/s


@dataclass(frozen=True)
class OnPlatform(Part):
    """The platform of a run whose navigator has a solution."""

    name = "platform"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the run has a solution on a platform."""
        return run.sensed.errors is not None and run.sensed.errors.platform is not None and PLATFORM in run.solutions

    @property
    def solution(self) -> PlatformSolution:
        """The solution of the platform's navigator, with the platform itself."""
        from sinssim.strapdown.platform.navigate import PlatformSolution

        found = self.run.solutions[PLATFORM]
        assert isinstance(found, PlatformSolution)
        return found

    @property
    def true_increments(self) -> ImuData:
        """Ideal increments of the same sensors strapped down."""
        assert isinstance(self.run.truth, Truth)
        return self.run.truth.ideal

    @property
    def errors(self) -> NavError:
        """Errors of the solution."""
        return self.run.errors[PLATFORM]

    @property
    def strapdown(self) -> tuple[str, NavError] | None:
        """The first strapdown algorithm with a solution, and its errors; None without one."""
        return next(((name, error) for name, error in self.run.errors.items() if name != PLATFORM), None)

    @cached_property
    def without_errors_of_turns(self) -> NavError | None:
        """Errors of `strapdown` if its gyros had no errors that depend on the sensed rate.

        These are scale factor, misalignment and non-linearity, which a platform does not have. None without such a
        solution.
        """
        from sinssim.sensors.imu.emulate import emulate
        from sinssim.sensors.imu.rectification import rectified
        from sinssim.sensors.sets.platform import without_errors_of_turns

        truth, true = self.run.truth, self.run.sensed.errors
        if self.strapdown is None:
            return None
        assert isinstance(truth, Truth)
        assert true is not None
        errors = without_errors_of_turns(true.imu)
        imu = emulate(rectified(truth.trajectory, truth.ideal, errors), errors, self.run.scenario.seed, rounded=True)
        return what_if(self.run, self.strapdown[0], imu)

    @cached_property
    def errors_by_cause(self) -> ErrorsByCause:
        """Position errors of the solution by cause, from the linear error equations."""
        from sinssim.strapdown.platform.error_equations import errors_by_cause
        from sinssim.strapdown.platform.force import inertial_forces
        from sinssim.truth.gravity.disturbed import Disturbed

        truth, true = self.run.truth, self.run.sensed.errors
        assert isinstance(truth, Truth)
        assert true is not None
        assert true.platform is not None
        motion = truth.trajectory
        felt = motion.disturbance_ned(truth.time, truth.state) if isinstance(motion, Disturbed) else None
        forces = inertial_forces(truth.time, truth.state, motion.gravity, motion.ellipsoid, felt)
        return errors_by_cause(truth.state, forces, self.solution, true.platform, motion.ellipsoid)

    def numbers(self) -> Mapping[str, Any]:
        """Return the results of the platform, for `summary.json`."""
        true = self.run.sensed.errors
        assert true is not None
        assert true.platform is not None
        return platform_numbers(
            self.solution, true.platform, self.true_increments, self.strapdown, self.without_errors_of_turns,
            self.errors_by_cause, self.errors,
        )  # fmt: skip


def platform_numbers(
    solution: PlatformSolution,
    errors: PlatformErrors,
    ideal: ImuData,
    strapdown: tuple[str, NavError] | None,
    without: NavError | None,
    by_cause: ErrorsByCause | None,
    simulated: NavError,
) -> dict[str, Any]:
    """Return the results of a platform.

    Args:
        solution: of its navigator.
        errors: of its torquers and pick-offs.
        ideal: ideal increments of the same sensors strapped down.
        strapdown: the first strapdown algorithm and its errors, None without one.
        without: errors of that algorithm if its gyros had no errors that act in turns only.
        by_cause: errors of the platform by cause.
        simulated: its errors in the simulation.

    Returns:
        Numbers for `summary.json`.
    """
    rate = ideal.dtheta / np.diff(ideal.time)[:, np.newaxis]
    speed = np.linalg.norm(rate, axis=1)
    turning = speed > _TURNING
    numbers: dict[str, Any] = {
        "torquer_scale_ppm": (errors.torquer_scale / units.PPM).tolist(),
        "pickoff_arcsec": (errors.pickoff / units.ARCSEC).tolist(),
        "max_commanded_rate_deg_h": float(np.linalg.norm(solution.commanded, axis=1).max() / units.DEG_H),
        "max_rate_of_the_vehicle_deg_s": float(speed.max() / units.DEG),
        "turned_deg": float((speed * np.diff(ideal.time))[turning].sum() / units.DEG),
    }
    if by_cause is not None:
        numbers["final_horizontal_error_by_cause_m"] = {
            name.replace(" ", "_"): float(np.hypot(*rows[-1])) for name, rows in by_cause.position.items()
        }
        numbers["largest_difference_from_error_equations_m"] = by_cause.apart(simulated)
    if strapdown is not None and without is not None:
        name, own = strapdown
        rows = min(len(own.time), len(without.time))
        apart = np.linalg.norm(own.position_ned[:rows, :2] - without.position_ned[:rows, :2], axis=1)
        numbers["strapdown"] = {
            "algorithm": name,
            "without_errors_of_turns": error_numbers(without),
            "final_distance_m": float(apart[-1]),
            "max_distance_m": float(apart.max()),
        }
    return numbers
