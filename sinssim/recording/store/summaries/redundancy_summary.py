"""Summary of a redundant set's monitoring: numbers for `summary.json`, and sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.formatting import number_text
from sinssim.recording.store.summary import error_numbers
from sinssim.sensors.sets.geometry import dilution

if TYPE_CHECKING:
    from sinssim.sensors.sets.monitor import Alarm, Monitored
    from sinssim.sensors.sets.sensor_set import Redundant
    from sinssim.strapdown.nav_error import NavError

NAMES = {"gyro": "gyro", "accel": "accelerometer"}
UNITS = {"gyro": ("deg_h", "deg/h", units.DEG_H), "accel": ("ug", "µg", units.UG)}
"""Unit of a fault: in a key, in words, and its size in SI."""


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


def redundancy_sentences(numbers: Mapping[str, Any], algorithms: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield the results of the monitoring in words.

    Args:
        numbers: result of `redundancy_numbers`.
        algorithms: errors of the algorithms, of which the first is compared.

    Yields:
        Sentences.
    """
    if numbers["monitoring"] == "none":
        yield "The sensors of the redundant set are not monitored: all of them are always used."
        return
    quiet = True
    for kind, name in NAMES.items():
        for alarm in numbers[kind]["alarms"]:
            quiet = False
            over = f"by sums over {alarm['window_s']:g} s"
            if alarm["window_s"] == numbers[kind]["windows_s"][0]:
                over = "by a single sample"
            if alarm["sensor"] is None:
                why = "" if numbers["monitoring"] == "detect" else ", but the faulty sensor could not be identified"
                yield (
                    f"A fault of the {name}s was detected at {alarm['detected_s']:.8g} s {over}{why}; the last test "
                    f"over the threshold was at {alarm['last_s']:.8g} s."
                )
                continue
            when = "at once" if alarm["excluded_s"] == alarm["detected_s"] else f"at {alarm['excluded_s']:.8g} s"
            yield (
                f"A fault of {name} {alarm['sensor']} was detected at {alarm['detected_s']:.8g} s {over}; the sensor "
                f"was isolated and excluded {when}."
            )
    if quiet:
        yield "The monitoring of the redundant set found no fault."
    without = numbers.get("without_monitoring")
    if without and algorithms:
        name, own = next(iter(algorithms.items()))
        end, most = own["final_horizontal_error_m"], own["max_horizontal_error_m"]
        if end is not None and without["final_horizontal_error_m"] is not None:
            alone = (without[f"{when}_horizontal_error_m"] for when in ("final", "max"))
            own_end, own_most, end, most = (number_text(value, 4) for value in (end, most, *alone))
            yield (
                f"Horizontal error of {name} with monitoring: {own_end} m at the end, {own_most} m at most; without "
                f"monitoring: {end} m at the end, {most} m at most."
            )


def window_names(windows: Array) -> list[str]:
    """Return the names of the windows of a test.

    Args:
        windows: their lengths, s, of which the first is one sample.

    Returns:
        "sample", "1 s", ….
    """
    return ["sample", *(f"{window:.6g} s" for window in windows[1:])]
