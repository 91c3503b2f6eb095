"""An IMU that rotates in the vehicle, [imu.rotation], beside one with the same errors that does not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from sinssim.experiments.run.part import Part
from sinssim.simulation.navigation import Navigated, what_if
from sinssim.simulation.truth import Truth
from sinssim.strapdown.error_numbers import NO_NUMBERS, error_numbers

if TYPE_CHECKING:
    from sinssim.sensors.imu.encoder import Encoders
    from sinssim.strapdown.nav_error import NavError


@dataclass(frozen=True)
class Rotation(Part):
    """The rotation of a run's IMU."""

    name = "rotation"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the run's IMU rotates."""
        return run.scenario.imu.rotation is not None and isinstance(run.truth, Truth)

    @cached_property
    def encoders(self) -> Encoders:
        """The encoders of the rotating IMU."""
        from sinssim.sensors.imu.encoder import encoders_of

        truth, errors = self.run.truth, self.run.sensed.errors
        assert isinstance(truth, Truth)
        found = encoders_of(truth.block, None if errors is None else errors.encoders, truth.time)
        assert found is not None  # the block turns
        return found

    @cached_property
    def without_rotation(self) -> NavError | None:
        """Errors of the first algorithm with a solution if the IMU, with the same errors, did not rotate.

        None if there is no solution.
        """
        from sinssim.sensors.imu.emulate import digital
        from sinssim.sensors.sets.reading import read

        truth, scenario = self.run.truth, self.run.scenario
        assert isinstance(truth, Truth)
        imu = scenario.imu.model_copy(update={"rotation": None})
        ideal = digital(truth.trajectory.increments(imu.rate_hz))
        readings = read(truth.trajectory, ideal, imu, scenario.seed, self.run.sensed.errors)[1]
        still = scenario.model_copy(update={"imu": imu})
        return what_if(self.run, next(iter(self.run.solutions)), readings.compensated or readings.imu, still)

    def numbers(self) -> Mapping[str, Any]:
        """Return the errors without the rotation, for `summary.json`."""
        return rotation_numbers(self.without_rotation)


def rotation_numbers(without: NavError | None) -> dict[str, Any]:
    """Return the entry of a rotating IMU.

    Args:
        without: errors of the first algorithm without the rotation; None without a solution.

    Returns:
        `without_rotation`, as the entries of algorithms.
    """
    return {"without_rotation": NO_NUMBERS if without is None else error_numbers(without)}
