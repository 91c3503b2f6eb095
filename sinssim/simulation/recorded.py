"""Who makes the first two stages of a run on recorded sensors: the files of its [log]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.errors import InputError
from sinssim.scenario.duration import check_times
from sinssim.simulation.sensed import Sensed
from sinssim.simulation.truth import RecordedMotion

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.simulation.aided.recorded_run import Prepared
    from sinssim.strapdown.frames.vertical import HeightReadings


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

    Raises:
        InputError: a file or the scenario cannot be used, or the filter needs more memory than there is.
    """
    from sinssim.scenario.filter import filter_states
    from sinssim.scenario.filter.memory import check_memory
    from sinssim.simulation.aided.recorded_run import prepare

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

    Raises:
        InputError: the vertical channel needs heights that are not recorded.
    """
    from sinssim.sensors.sets.reading import Readings

    imu = motion.prepared.log.imu
    readings = Readings(imu)
    if scenario.compensation is not None:
        from sinssim.alignment.budget import expected_errors
        from sinssim.sensors.imu.compensation import compensate

        readings = replace(readings, compensated=compensate(imu, expected_errors(scenario.imu).mean))
    heights = _heights(motion.prepared) if scenario.navigation.vertical == "baro-loop" else None
    return Sensed(scenario, motion, readings, None, heights)


def _heights(prepared: Prepared) -> HeightReadings:
    """Return the recorded readings of a barometer, for the loop of the vertical channel."""
    from sinssim.strapdown.frames.vertical import HeightReadings

    for readings in prepared.log.sensed:
        m = readings.measurements
        if m.kind == "baro-height" and len(m) > 1:
            return HeightReadings(m.arrival, m.value[:, 0], float(np.median(np.diff(m.time))))
    raise InputError(
        'navigation.vertical = "baro-loop" needs heights: add an entry of [[log.others]] with kind = "baro-height", or '
        'choose vertical = "free".'
    )
