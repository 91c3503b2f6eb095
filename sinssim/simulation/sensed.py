"""The second stage of a run: what the sensors read."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from sinssim.errors import InputError
from sinssim.sensors.aiding.baro import Barometer
from sinssim.sensors.aiding.base.sensor import Vehicle
from sinssim.simulation.truth import RecordedMotion, Truth
from sinssim.system.short_repr import short_repr

if TYPE_CHECKING:
    from sinssim.data import Array, ImuData
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.reading import Readings
    from sinssim.sensors.sets.true_errors import TrueErrors
    from sinssim.strapdown.frames.vertical import HeightReadings


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

        Raises:
            InputError: the simulated barometer has no reading, and there is no filter to report it.
        """
        scenario, truth = self.scenario, self.truth
        if not isinstance(truth, Truth):
            return self.heights
        altimeter = None if scenario.aiding is None else scenario.aiding.sensor(Barometer)
        if scenario.navigation.vertical != "baro-loop" or altimeter is None:
            return truth.state.height
        from sinssim.strapdown.frames.vertical import HeightReadings

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
        from sinssim.sensors.rates import perfect_increments
        from sinssim.sensors.sets.reading import Readings, read

        truth, imu = self.truth, self.scenario.imu
        assert isinstance(truth, Truth)
        own = self.readings
        if all(one is None for one in (own.accelerometers, own.attitude, own.single)):
            return Readings(perfect_increments(truth.block, truth.ideal, imu))
        return read(truth.block, truth.ideal, imu, self.scenario.seed, self.errors)[0]


def sense(scenario: Scenario, truth: Truth) -> Sensed:
    """Emulate the inertial sensors of a simulated run.

    Returns:
        What the sensors read, which holds the readings of perfect sensors as well.

    Raises:
        InputError: the motion is too short for the sensors.
    """
    from sinssim.sensors.sets.reading import read
    from sinssim.sensors.sets.true_errors import draw_true_errors

    errors = draw_true_errors(scenario.imu, scenario.seed, scenario.compensation)
    perfect, readings = read(truth.block, truth.ideal, scenario.imu, scenario.seed, errors)
    found = Sensed(scenario, truth, readings, errors)
    vars(found)["perfect"] = perfect
    return found
