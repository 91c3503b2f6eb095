"""A redundant set of sensors, whose monitoring excludes faulty ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.experiments.run.part import Part
from sinssim.sensors.sets.geometry import dilution
from sinssim.sensors.sets.sensor_set import Redundant
from sinssim.simulation.navigation import Navigated, what_if
from sinssim.strapdown.error_numbers import error_numbers

if TYPE_CHECKING:
    from sinssim.sensors.sets.monitor import Alarm, Monitored
    from sinssim.strapdown.nav_error import NavError

UNITS = {"gyro": ("deg_h", "deg/h", units.DEG_H), "accel": ("ug", "µg", units.UG)}
"""Unit of a fault: in a key, in words, and its size in SI."""


@dataclass(frozen=True)
class Redundancy(Part):
    """The monitoring of a run's redundant set."""

    name = "redundancy"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the run has a redundant set."""
        return isinstance(run.scenario.imu.sensor_set, Redundant)

    @cached_property
    def without_monitoring(self) -> NavError | None:
        """Errors of the first algorithm with a solution if the set's faulty sensors had been used to the end.

        None if no sensor was excluded, because the solution is then the same, or if there is no solution with them.
        """
        from sinssim.sensors.sets.reading import unmonitored

        of, readings = self.run.scenario.imu.sensor_set, self.run.sensed.readings
        assert isinstance(of, Redundant)
        if not any(kind.excluded for kind in readings.monitored):
            return None
        return what_if(self.run, next(iter(self.run.solutions)), unmonitored(readings, of.axes))

    def numbers(self) -> Mapping[str, Any]:
        """Return the results of the monitoring, for `summary.json`."""
        of = self.run.scenario.imu.sensor_set
        assert isinstance(of, Redundant)
        return redundancy_numbers(of, self.run.sensed.readings.monitored, self.without_monitoring)


def redundancy_numbers(section: Redundant, found: Sequence[Monitored], without: NavError | None) -> dict[str, Any]:
    """Return the results of the monitoring.

    Args:
        section: the redundant set.
        found: gyros and accelerometers; empty without monitoring.
        without: errors of the first algorithm without monitoring, None if they are the same.

    Returns:
        Numbers for `summary.json`.
    """
    axes = section.axes
    numbers: dict[str, Any] = {
        "monitoring": section.mode,
        "sensors": len(axes),
        "trace_of_covariance": dilution(axes),
        "least_trace": 9.0 / len(axes),
    }
    if found:
        numbers["false_alarm_probability"] = section.false_alarm_probability
        numbers["missed_detection_probability"] = section.missed_detection_probability
    for one in found:
        key, _, unit = UNITS[one.kind]
        tests = int(np.isfinite(one.statistic).sum())
        numbers[one.kind] = {
            "windows_s": one.windows.tolist(),
            "tests": tests,
            "false_alarms_expected_at_most": tests * section.false_alarm_probability,
            f"smallest_fault_{key}": (one.smallest / unit).tolist(),
            "alarms": [_alarm(alarm) for alarm in one.alarms],
            "used_at_end": (1 + np.flatnonzero(one.used[-1])).tolist(),
        }
    if without is not None:
        numbers["without_monitoring"] = error_numbers(without)
    return numbers


def _alarm(alarm: Alarm) -> dict[str, Any]:
    return {
        "detected_s": alarm.detected,
        "window_s": float(alarm.window),
        "statistic": alarm.statistic,
        "threshold": alarm.threshold,
        "last_s": alarm.last,
        "excluded_s": alarm.isolated,
        "sensor": alarm.sensor,
    }
