"""The section of a run's report about a redundant set: tests, exclusions, errors with and without monitoring."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.experiments.run.parts.redundancy import UNITS
from sinssim.experiments.run.store.summaries.redundancy_summary import NAMES, window_names
from sinssim.formatting import capital, number_text, signed
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line, Mark
from sinssim.recording.scales import ticks
from sinssim.scales import ANGLES, LENGTHS, suiting
from sinssim.scenario.summary import redundant_words
from sinssim.sensors.imu.terms import of_triad
from sinssim.sensors.sets.geometry import dilution
from sinssim.sensors.sets.sensor_set import Redundant

if TYPE_CHECKING:
    from sinssim.experiments.run.parts.redundancy import Redundancy
    from sinssim.sensors.imu.errors import ImuErrors
    from sinssim.sensors.imu.imu import Imu
    from sinssim.sensors.sets.monitor import Monitored
    from sinssim.sensors.sets.reading import Readings

_DIGITS = 4
_SHOWN = 2.0  # the axis of the statistics ends at so many thresholds


def redundancy_section(section: Redundant, readings: Readings) -> Iterator[str]:
    """Yield the report's section on the monitoring of a redundant set.

    Args:
        section: the sensor set.
        readings: what its sensors read.

    Yields:
        HTML.
    """
    yield from _about(section)
    found, time = readings.monitored, readings.imu.time
    if not found:
        yield "<p>The sensors are not monitored: all of them are always used.</p>"
        return
    yield _alarms(found)
    drawn = "".join(_statistic(one, time) for one in found)
    yield f'<div class="pair">{drawn}</div>'
    yield (
        '<p class="note">Statistic pᵀC⁻¹p of the parity vector p at the end of each window, with the covariance C of '
        "the stated 1σ of all errors; without a fault it has a χ² distribution. Above the threshold a fault is "
        f"detected. Values above {_SHOWN:g} thresholds are clipped. After an exclusion the other sensors are "
        "tested, with one degree of freedom fewer.</p>"
    )
    yield from _tests(found, section)


def _about(section: Redundant) -> Iterator[str]:
    axes = section.axes
    rows = [
        (
            str(number),
            *(signed(float(value), 6) if value else "0" for value in row),
            f"{np.degrees(np.arccos(np.clip(row[2], -1, 1))):.2f}",
        )
        for number, row in enumerate(axes, start=1)
    ]
    trace, least = dilution(axes), 9.0 / len(axes)
    worth = (
        "the least that is possible with this number of sensors"
        if trace < least * (1.0 + 1e-9)
        else f"the least possible with this number of sensors is 9/m = {least:.4g}"
    )
    yield (
        f"<p>{words(capital(redundant_words(section)))}. Each measures the component along its direction; the rate and "
        "the specific force of the block are the least-squares estimate from the sensors in use. With all of them, the "
        f"variances of the three components add up to tr (HᵀH)⁻¹ = {trace:.4g} of the variance of one sensor, {worth}; "
        "for three orthogonal sensors the sum is 3.</p>"
    )
    yield table(("sensor", "forward", "right", "down", "from the down axis [deg]"), rows)


def _alarms(found: Sequence[Monitored]) -> str:
    """Return a table of the faults that were found."""
    rows = []
    for one in found:
        names = dict(zip(one.windows.tolist(), window_names(one.windows), strict=True))
        for alarm in one.alarms:
            which = f"{NAMES[one.kind]} {alarm.sensor}" if alarm.sensor else f"one of the {NAMES[one.kind]}s"
            rows.append(
                (
                    which, f"{alarm.detected:.3f}", names[float(alarm.window)], number_text(alarm.statistic, 4),
                    number_text(alarm.threshold, 4),
                    "not isolated" if alarm.isolated is None else f"{alarm.isolated:.3f}",
                )
            )  # fmt: skip
    if not rows:
        return "<p>No fault was detected.</p>"
    heads = ("faulty sensor", "detected at [s]", "window", "statistic", "threshold", "isolated and excluded at [s]")
    return table(heads, rows)


def _statistic(one: Monitored, edges: Array) -> str:
    """Draw the statistics of one kind of sensor and their threshold."""
    names, time, span = window_names(one.windows), edges[1:], (float(edges[0]), float(edges[-1]))
    paint = [style.css(color) for color in style.colors([f"window {name}" for name in names])]
    lines = [
        Line(name, time, row, color, 1.2)
        for name, row, color in zip(names, one.statistic, paint, strict=True)
        if np.isfinite(row).any()
    ]
    limit = Line("threshold", time, one.threshold, style.css(style.COLORS["refused"]), 2.0, "7 4", reference=True)
    marks = [
        Mark(alarm.isolated or alarm.detected, f"{alarm.sensor} excluded" if alarm.sensor else "fault detected")
        for alarm in one.alarms
    ]
    high = _SHOWN * float(np.nanmax(one.threshold))
    _, step = ticks(0.0, high, 5)
    axis = (0.0, float(step * np.ceil(high / step)), float(step))
    title = f"{capital(NAMES[one.kind])}s: test statistic"
    return f"<div>{plot.plot(title, '', [*lines, limit], span, marks=marks, axis=axis)}</div>"


def _tests(found: Sequence[Monitored], section: Redundant) -> Iterator[str]:
    """Yield the smallest faults that the tests find, and what is expected of them."""
    blocks = []
    for one in found:
        _, unit, size = UNITS[one.kind]
        rows = []
        for name, least in zip(window_names(one.windows), one.smallest / size, strict=True):
            if not np.isnan(least).any():
                low, high = (number_text(float(value), 3) for value in (least.min(), least.max()))
                rows.append((name, low if low == high else f"{low} to {high}"))
        tests = int(np.isfinite(one.statistic).sum())
        expected = number_text(tests * section.false_alarm_probability, 2)
        blocks.append(
            f"<div><h3>{capital(NAMES[one.kind])}s</h3>{table(('window', f'smallest detectable bias [{unit}]'), rows)}"
            f'<p class="note">{tests:,} tests; of such tests without a fault, at most {expected} false alarms are '
            "expected.</p></div>"
        )
    yield f'<div class="pair">{"".join(blocks)}</div>'
    yield (
        f'<p class="note">Each test raises a false alarm with the probability {section.false_alarm_probability:g}. '
        "The smallest detectable bias is a step of the output of one sensor that lasts for the window and that a test "
        f"at the start of the run misses with the probability {section.missed_detection_probability:g}. The 1σ of the "
        "errors include noise, turn-on biases, scale factors, misalignments and all other errors stated in [imu], so "
        "they are not faults.</p>"
    )


def with_and_without(part: Redundancy) -> Iterator[str]:
    """Yield the errors with and without monitoring, if they differ.

    Args:
        part: the monitoring of a run.

    Yields:
        HTML.
    """
    run, without = part.run, part.without_monitoring
    if without is None or not run.errors:
        return
    span = (float(run.time[0]), float(run.time[-1]))
    name, own = next(iter(run.errors.items()))
    unit, size = suiting(LENGTHS, without.horizontal, own.horizontal)
    pink, blue = (style.css(style.COLORS[key]) for key in ("refused", "aided"))
    marks = [Mark(alarm.isolated or 0.0, "") for one in run.sensed.readings.monitored for alarm in one.excluded]
    marks.sort(key=lambda mark: mark.time)

    def both(title: str, unit: str, size: float, values: Sequence[np.ndarray]) -> str:
        lines = [
            Line("without monitoring", without.time, values[0], pink, 2.5, size=size),
            Line("with monitoring", own.time, values[1], blue, 1.5, size=size),
        ]
        return f"<div>{plot.plot(title, unit, lines, span, marks=marks)}</div>"

    yield f"<h3>With and without monitoring: {words(name)}</h3>"
    horizontal = both("Horizontal error", unit, size, (without.horizontal, own.horizontal))
    unit, size = suiting(ANGLES, without.angle, own.angle)
    attitude = both("Attitude error", unit, size, (without.angle, own.angle))
    yield f'<div class="pair">{horizontal}{attitude}</div>'
    yield (
        '<p class="note">The same flight and the same measurements; without monitoring the faulty sensors are used to '
        "the end. Dotted: exclusions.</p>"
    )


def single_errors(blocks: Sequence[ImuErrors], section: Imu, kind: str) -> str:
    """Return a table of the errors of single sensors.

    Args:
        blocks: errors of the sensors in threes.
        section: the [imu] section, whose sensor set is redundant.
        kind: "gyro" or "accel".

    Returns:
        HTML.
    """
    assert isinstance(section.sensor_set, Redundant)
    count = len(section.sensor_set.axes)
    rows = []
    for term in of_triad(kind):
        values = np.concatenate([getattr(getattr(block, kind), term.field).reshape(-1) for block in blocks]) if (
            term.drawn and term.size == 3
        ) else None  # fmt: skip
        if term.drawn and term.field == "misalignment":
            tilts = [np.linalg.norm(getattr(block, kind).misalignment, axis=1) for block in blocks]
            values = np.concatenate(tilts)
        if values is None or not (values.any() or term.field in ("bias", "scale", "misalignment")):
            continue
        label = "tilt of the axis" if term.field == "misalignment" else term.label
        sigma = float(np.max(section.stated(term)[1])) / term.unit
        cells = (signed(float(value) / term.unit, _DIGITS) for value in values[:count])
        rows.append((label, term.written_unit, *cells, f"{sigma:.6g}"))
    heads = ("", "unit", *(str(number) for number in range(1, count + 1)), "1σ")
    return table(heads, rows, 2)
