"""The second stage of a run: what the sensors read, emulated or recorded.

For the files of a [log], `planned` makes the first stage, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sinssim.errors import InputError
from sinssim.scenario.planned_motion import check_times
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.aiding_sensor import Vehicle
from sinssim.simulation.truth_stage import RecordedMotion, Truth
from sinssim.system.short_repr import short_repr

if TYPE_CHECKING:
    from sinssim.data import Array, ImuData
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.sensor_readings import Readings, TrueErrors
    from sinssim.simulation.recorded_filter_run import Prepared
    from sinssim.strapdown.frames.vertical_channel import HeightReadings


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
        from sinssim.sensors.sets.sensor_readings import Readings, read

        truth, imu = self.truth, self.scenario.imu
        assert isinstance(truth, Truth)
        readings = self.readings
        if all(sensor is None for sensor in (readings.accelerometers, readings.attitude, readings.single)):
            return Readings(perfect_increments(truth.block, truth.ideal, imu))
        return read(truth.block, truth.ideal, imu, self.scenario.seed, self.errors)[0]


def sense(scenario: Scenario, truth: Truth) -> Sensed:
    """Emulate the inertial sensors of a simulated run.

    Returns:
        What the sensors read, which holds the readings of perfect sensors as well.
    """
    from sinssim.sensors.sets.sensor_readings import draw_true_errors, read

    errors = draw_true_errors(scenario.imu, scenario.seed, scenario.compensation)
    perfect, readings = read(truth.block, truth.ideal, scenario.imu, scenario.seed, errors)
    sensed = Sensed(scenario, truth, readings, errors)
    vars(sensed)["perfect"] = perfect
    return sensed


@dataclass(frozen=True)
class Plan:
    """A scenario with recorded sensors whose files have been read.

    Attributes:
        scenario: the scenario; what follows from the files is written out.
        about_filter: lines that explain the filter's default states.
        motion: what is known of the motion.
    """

    scenario: Scenario
    about_filter: Sequence[str]
    motion: RecordedMotion


def planned(scenario: Scenario, *, recorded: bool) -> Plan:
    """Read the files of a scenario with [log], and check what follows from them.

    Args:
        recorded: whether the run is written to a run directory.
    """
    from sinssim.scenario import filter_model as filter_states
    from sinssim.scenario.run_memory import check_memory
    from sinssim.simulation.recorded_filter_run import prepare

    prepared = prepare(scenario)
    lines = () if scenario.filter is None else filter_states.choice(scenario, prepared.moved)
    check_times(prepared.scenario)
    if scenario.filter is not None:
        check_memory(prepared.scenario, recorded=recorded, of_log=prepared.log.rates)
    return Plan(prepared.scenario, lines, RecordedMotion(prepared, prepared.log.reference))


def sense_recorded(scenario: Scenario, motion: RecordedMotion) -> Sensed:
    """Return what recorded sensors read, compensated by the errors that the scenario gives as numbers.

    Args:
        motion: what is known of the motion, with the recording.
    """
    from sinssim.sensors.sets.sensor_readings import Readings

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
