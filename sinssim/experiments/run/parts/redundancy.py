"""A redundant set of sensors, whose monitoring excludes faulty ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NotRequired, TypedDict

import numpy as np

from sinssim import units
from sinssim.charts import PAIR, Axis, Chart, Charts, Line, Rule, over
from sinssim.data import Array
from sinssim.exhibits import Beside, Column, Item, Section, Sentence, Table
from sinssim.experiments.run.run_result import Part, side_by_side
from sinssim.experiments.run.summary_types import ErrorNumbers, Number
from sinssim.recording.streams import Stream, error_stream
from sinssim.scenario.plan_summary import redundant_words
from sinssim.sensors.fault_detection import Alarm, Monitored
from sinssim.sensors.sensor_set_readings import unmonitored
from sinssim.sensors.sensor_set_section import Redundant, dilution
from sinssim.simulation.navigation_stage import Navigated, what_if
from sinssim.strapdown.navigation_error import NavError, error_numbers
from sinssim.truth.sampling import FlightEvent
from sinssim.units import capital, fixed, number_text, signed

UNITS = {"gyro": ("deg_h", "deg/h", units.DEG_H), "accel": ("ug", "µg", units.UG)}
"""Unit of a fault: in a key, in words, and its size in SI."""
NAMES = {"gyro": "gyro", "accel": "accelerometer"}
_SHOWN = 2.0
"""The axis of the statistics ends at so many thresholds."""


class AlarmNumbers(TypedDict):
    """A fault that was detected; the sensor and its exclusion are None if it was not isolated."""

    detected_s: float
    window_s: float
    statistic: float
    threshold: float
    last_s: float
    excluded_s: Number
    sensor: int | None


class MonitoringNumbers(TypedDict):
    """The tests of the sensors of one kind, the smallest faults that they find, and their alarms."""

    windows_s: list[float]
    tests: int
    false_alarms_expected_at_most: float
    smallest_fault_deg_h: NotRequired[list[list[Number]]]
    smallest_fault_ug: NotRequired[list[list[Number]]]
    alarms: list[AlarmNumbers]
    used_at_end: list[int]


class RedundancyNumbers(TypedDict):
    """A redundant set of sensors: its geometry, its monitoring, and the errors without it."""

    monitoring: str
    sensors: int
    trace_of_covariance: float
    least_trace: float
    false_alarm_probability: NotRequired[float]
    missed_detection_probability: NotRequired[float]
    gyro: NotRequired[MonitoringNumbers]
    accel: NotRequired[MonitoringNumbers]
    without_monitoring: NotRequired[ErrorNumbers]


@dataclass(frozen=True)
class Redundancy(Part[RedundancyNumbers]):
    """The monitoring of a run's redundant set."""

    name, title, place = "redundancy", "Monitoring of the redundant sensors", "sensors"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the run has a redundant set."""
        return isinstance(run.scenario.imu.sensor_set, Redundant)

    @cached_property
    def without_monitoring(self) -> NavError | None:
        """Errors of the first algorithm with a solution if the set's faulty sensors had been used to the end.

        None if no sensor was excluded, because the solution is then the same, or if there is no solution with them.
        """
        of, readings = self.run.scenario.imu.sensor_set, self.run.sensed.readings
        assert isinstance(of, Redundant)
        if not self.run.solutions or not any(kind.excluded for kind in readings.monitored):
            return None
        return what_if(self.run, next(iter(self.run.solutions)), unmonitored(readings, of.axes))

    def numbers(self) -> RedundancyNumbers:
        """Return the results of the monitoring, for `summary.json`."""
        of = self.run.scenario.imu.sensor_set
        assert isinstance(of, Redundant)
        return redundancy_numbers(of, self.run.sensed.readings.monitored, self.without_monitoring)

    def streams(self) -> Iterator[Stream]:
        """Yield the errors without monitoring, if they are others."""
        if self.without_monitoring is not None:
            yield error_stream("without_monitoring", self.without_monitoring.at, self.without_monitoring.time)

    def events(self) -> Iterator[FlightEvent]:
        """Yield the detection of each fault, and the exclusion of its sensor."""
        for sensors in self.run.sensed.readings.monitored:
            name = NAMES[sensors.kind]
            for alarm in sensors.alarms:
                if alarm.sensor is None or alarm.isolated is None:
                    yield FlightEvent(alarm.detected, f"fault of the {name}s detected, not isolated")
                    continue
                if alarm.isolated > alarm.detected:
                    yield FlightEvent(alarm.detected, f"fault of the {name}s detected")
                yield FlightEvent(alarm.isolated, f"{name} {alarm.sensor} excluded")

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the faults that were detected, and the errors with and without monitoring."""
        yield from map(Sentence, sentences(self.entry, algorithms))

    def exhibits(self) -> Iterator[Item]:
        """Yield the directions, the faults, the tests, and the errors with and without monitoring."""
        of, readings = self.run.scenario.imu.sensor_set, self.run.sensed.readings
        assert isinstance(of, Redundant)
        monitored, time = readings.monitored, readings.imu.time
        yield from about(of)
        if not monitored:
            yield Sentence("The sensors are not monitored: all of them are always used.")
            return
        yield alarms(monitored)
        yield Charts("redundancy_statistics", (tuple(statistic(sensors, time) for sensors in monitored),), PAIR)
        yield Charts("redundancy_used", (tuple(used(sensors, time) for sensors in monitored),), PAIR, on=("recording",))
        yield Sentence(
            "Statistic pᵀC⁻¹p of the parity vector p at the end of each window, with the covariance C of the stated 1σ "
            "of all errors; without a fault it has a χ² distribution. Above the threshold a fault is detected. Values "
            f"above {_SHOWN:g} thresholds are clipped. After an exclusion the other sensors are tested, with one "
            "degree of freedom fewer.", "note",
        )  # fmt: skip
        yield from tests(monitored, of)
        if (without := self.without_monitoring) is None or not self.run.errors:
            return
        name, error = next(iter(self.run.errors.items()))
        excluded = sorted(alarm.isolated or 0.0 for sensors in monitored for alarm in sensors.excluded)
        marks = tuple(Rule(at=at, upright=True, dash=":") for at in excluded)
        both = side_by_side(
            "redundancy",
            {"without monitoring": (without, "refused", "bold"), "with monitoring": (error, "aided", "line")},
            (float(self.run.time[0]), float(self.run.time[-1])), marks, name,
        )  # fmt: skip
        note = (
            "The same flight and the same measurements; without monitoring the faulty sensors are used to the end. "
            "Dotted: exclusions."
        )
        yield Section(f"With and without monitoring: {name}", [both, Sentence(note, "note")])


def sentences(numbers: RedundancyNumbers, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[str]:
    """Yield the results of the monitoring in words, beside the errors of the first algorithm."""
    if numbers["monitoring"] == "none":
        yield "The sensors of the redundant set are not monitored: all of them are always used."
        return
    quiet = True
    for monitored, name in ((numbers["gyro"], NAMES["gyro"]), (numbers["accel"], NAMES["accel"])):
        for alarm in monitored["alarms"]:
            quiet = False
            over = f"by sums over {alarm['window_s']:g} s"
            if alarm["window_s"] == monitored["windows_s"][0]:
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
        name, errors = next(iter(algorithms.items()))
        end, most = errors["final_horizontal_error_m"], errors["max_horizontal_error_m"]
        if end is not None and without["final_horizontal_error_m"] is not None:
            alone = (without[f"{when}_horizontal_error_m"] for when in ("final", "max"))
            with_end, with_most, free_end, free_most = (number_text(v, 4) for v in (end, most, *alone))
            yield (
                f"Horizontal error of {name} with monitoring: {with_end} m at the end, {with_most} m at most; without "
                f"monitoring: {free_end} m at the end, {free_most} m at most."
            )


def about(section: Redundant) -> Iterator[Item]:
    """Yield what the set consists of."""
    axes = section.axes
    trace, least = dilution(axes), 9.0 / len(axes)
    worth = (
        "the least that is possible with this number of sensors"
        if trace < least * (1.0 + 1e-9)
        else f"the least possible with this number of sensors is 9/m = {least:.4g}"
    )
    yield Sentence(
        f"{capital(redundant_words(section))}. Each measures the component along its direction; the rate and the "
        "specific force of the block are the least-squares estimate from the sensors in use. With all of them, the "
        f"variances of the three components add up to tr (HᵀH)⁻¹ = {trace:.4g} of the variance of one sensor, {worth}; "
        "for three orthogonal sensors the sum is 3."
    )
    heads = (*map(Column, ("forward", "right", "down")), Column("from the down axis", fixed("deg")))
    yield Table((Column("sensor", words=True), *heads), [
        [str(number), *(signed(float(value), 6) if value else "0" for value in row),
         f"{np.degrees(np.arccos(np.clip(row[2], -1, 1))):.2f}"]
        for number, row in enumerate(axes, start=1)
    ])  # fmt: skip


def alarms(monitored: Sequence[Monitored]) -> Item:
    """Return the faults that were found."""
    rows = []
    for sensors in monitored:
        names = dict(zip(sensors.windows.tolist(), window_names(sensors.windows), strict=True))
        for alarm in sensors.alarms:
            which = f"{NAMES[sensors.kind]} {alarm.sensor}" if alarm.sensor else f"one of the {NAMES[sensors.kind]}s"
            end = "not isolated" if alarm.isolated is None else f"{alarm.isolated:.3f}"
            rows.append([which, f"{alarm.detected:.3f}", names[float(alarm.window)], number_text(alarm.statistic, 4),
                         number_text(alarm.threshold, 4), end])  # fmt: skip
    if not rows:
        return Sentence("No fault was detected.")
    heads = (Column("detected at", fixed("s")), *map(Column, ("window", "statistic", "threshold")),
             Column("isolated and excluded at", fixed("s")))  # fmt: skip
    return Table((Column("faulty sensor", words=True), *heads), rows)


def statistic(monitored: Monitored, edges: Array) -> Chart:
    """Return the statistics of one kind of sensor and their threshold."""
    lines = [
        Line(label=name, x=edges[1:], y=row, weight="thin")
        for name, row in zip(window_names(monitored.windows), monitored.statistic, strict=True)
        if np.isfinite(row).any()
    ]
    limit = Line(label="threshold", x=edges[1:], y=monitored.threshold, color="refused", weight="bold", dash="--")
    marks = [
        Rule(at=alarm.isolated or alarm.detected, upright=True, dash=":",
             text=f"{alarm.sensor} excluded" if alarm.sensor else "fault detected")
        for alarm in monitored.alarms
    ]  # fmt: skip
    y = Axis(low=0.0, high=_SHOWN * float(np.nanmax(monitored.threshold)))
    title = f"{capital(NAMES[monitored.kind])}s: test statistic"
    span = (float(edges[0]), float(edges[-1]))
    return Chart(
        key=f"redundancy/{monitored.kind}/statistic", title=title, x=over(span), y=y, marks=(*lines, limit, *marks)
    )


def used(monitored: Monitored, edges: Array) -> Chart:
    """Return which sensors of one kind are in use."""
    count = monitored.used.shape[1]
    marks = tuple(
        Line(label=str(k + 1), x=edges[1:], y=np.where(monitored.used[:, k], k + 1.0, np.nan), weight="bold")
        for k in range(count)
    )
    title = f"{capital(NAMES[monitored.kind])}s in use"
    y = Axis(low=0.0, high=count + 1.0)
    return Chart(key=f"redundancy/{monitored.kind}/used", title=title, x=over((float(edges[0]), float(edges[-1]))), y=y,
                 marks=marks)  # fmt: skip


def tests(monitored: Sequence[Monitored], section: Redundant) -> Iterator[Item]:
    """Yield the smallest faults that the tests find, and what is expected of them."""
    blocks: list[Item] = []
    for sensors in monitored:
        _, unit, size = UNITS[sensors.kind]
        rows = []
        for name, least in zip(window_names(sensors.windows), sensors.smallest / size, strict=True):
            if not np.isnan(least).any():
                low, high = (number_text(float(value), 3) for value in (least.min(), least.max()))
                rows.append((name, low if low == high else f"{low} to {high}"))
        count = int(np.isfinite(sensors.statistic).sum())
        expected = number_text(count * section.false_alarm_probability, 2)
        note = f"{count:,} tests; of such tests without a fault, at most {expected} false alarms are expected."
        columns = (Column("window", words=True), Column("smallest detectable bias", fixed(unit)))
        blocks.append(Section(f"{capital(NAMES[sensors.kind])}s", [Table(columns, rows, note=note)]))
    yield Beside(blocks)
    yield Sentence(
        f"Each test raises a false alarm with the probability {section.false_alarm_probability:g}. "
        "The smallest detectable bias is a step of the output of one sensor that lasts for the window and that a test "
        f"at the start of the run misses with the probability {section.missed_detection_probability:g}. The 1σ of the "
        "errors include noise, turn-on biases, scale factors, misalignments and all other errors stated in [imu], so "
        "they are not faults.", "note",
    )  # fmt: skip


def window_names(windows: Array) -> list[str]:
    """Return the names of the windows of a test, s, of which the first is one sample: "sample", "1 s", …."""
    return ["sample", *(f"{window:.6g} s" for window in windows[1:])]


def redundancy_numbers(
    section: Redundant, monitored: Sequence[Monitored], without: NavError | None
) -> RedundancyNumbers:
    """Return the entry of a redundant set, with the errors of an algorithm `without` monitoring, if they differ."""
    axes = section.axes
    numbers: RedundancyNumbers = {
        "monitoring": section.mode,
        "sensors": len(axes),
        "trace_of_covariance": dilution(axes),
        "least_trace": 9.0 / len(axes),
    }
    if monitored:
        numbers["false_alarm_probability"] = section.false_alarm_probability
        numbers["missed_detection_probability"] = section.missed_detection_probability
    for sensors in monitored:
        kind: Literal["gyro", "accel"] = "gyro" if sensors.kind == "gyro" else "accel"
        numbers[kind] = _monitoring(sensors, section.false_alarm_probability)
    if without is not None:
        numbers["without_monitoring"] = error_numbers(without)
    return numbers


def _monitoring(sensors: Monitored, false_alarm: float) -> MonitoringNumbers:
    key, _, unit = UNITS[sensors.kind]
    tests = int(np.isfinite(sensors.statistic).sum())
    return {
        "windows_s": sensors.windows.tolist(),
        "tests": tests,
        "false_alarms_expected_at_most": tests * false_alarm,
        f"smallest_fault_{key}": (sensors.smallest / unit).tolist(),  # type: ignore[misc]
        "alarms": [_alarm(alarm) for alarm in sensors.alarms],
        "used_at_end": (1 + np.flatnonzero(sensors.used[-1])).tolist(),
    }


def _alarm(alarm: Alarm) -> AlarmNumbers:
    return {
        "detected_s": alarm.detected,
        "window_s": float(alarm.window),
        "statistic": alarm.statistic,
        "threshold": alarm.threshold,
        "last_s": alarm.last,
        "excluded_s": alarm.isolated,
        "sensor": alarm.sensor,
    }
