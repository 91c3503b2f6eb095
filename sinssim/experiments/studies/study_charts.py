"""The charts and tables of a study by subject, and the names of their rows and lines."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sinssim.charts import TIME, Axis, Band, Bars, Chart, Charts, Dots, Line, Mark, Rule, Weight, in_rows
from sinssim.data import Array
from sinssim.experiments.studies import position_claims as law
from sinssim.experiments.studies.study_results import ErrorGrowth, Heading, Order, Row, StudyResult
from sinssim.experiments.studies.study_schema import Part, Study
from sinssim.recording.style import COLORS, colors, css
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.attitude import family
from sinssim.units import ARCSEC, DEG, fixed

Label = Callable[[Row], str]

_DIMENSIONS = ("algorithm", "frame", "curvature", "gravity", "ellipsoid", "sensors", "variant")
_SHOWN_HZ = 50.0
_FIXED = r"(gyro|accel)_(bias_(deg_h|ug)|scale_ppm|misalignment_arcsec)"  # errors that are given, not drawn
_RATES_FOR_LINES = 3  # number of rates from which errors are drawn over the rate


def varying(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return the dimensions in which rows differ, apart from motion and rate: names of the attributes of `Row`."""
    return tuple(d for d in _DIMENSIONS if len({getattr(row, d) for row in rows}) > 1)


def labeller(rows: Sequence[Row], pace: bool = False) -> Label:
    """Return a function that labels rows of one motion by their differences, with the `pace` if it is wanted."""
    dimensions = varying(rows)
    several = pace and len({row.pace for row in rows}) > 1

    def label(row: Row) -> str:
        parts = [str(getattr(row, d)) for d in dimensions] + ([f"{row.pace} Hz"] if several else [])
        return " · ".join(parts) or row.algorithm

    return label


def over_rates(part: Part) -> bool:
    """Return whether a part is best drawn as lines over the rate."""
    return len(part.rates_hz) >= _RATES_FOR_LINES and not part.schedules_hz


def line_labeller(part: Part, rows: Sequence[Row]) -> Label:
    """Return a function that names lines: a schedule has its own name, the plain rates of an engine share one."""
    return labeller(rows, pace=bool(part.schedules_hz))


def at_one_rate(rows: Sequence[Row]) -> list[Row]:
    """Return the rows whose errors are drawn over time: schedules, and plain rates at the one nearest to 50 Hz."""
    scheduled = [row for row in rows if row.schedule_hz]
    if scheduled or not rows:
        return scheduled
    rate = min((row.rate_hz for row in rows), key=lambda hz: abs(math.log(hz / _SHOWN_HZ)))
    return [row for row in rows if row.rate_hz == rate]


def one_draw(part: Part, study: Study) -> str:
    """State in a few sentences that a part compares sensors by one draw of their errors; "" for a part with one sensor
    set or without random errors."""
    if len(part.sensors) * len(part.variants) < 2 or all(_is_certain(study.block(name)) for name in part.sensors):
        return ""
    return (
        f"The sensors are compared on one draw of their errors (seed {study.seed}). A single run may be several times "
        "better or worse than its 1σ, and another seed may reverse the order of two sets of sensors. Engines "
        "that share a draw can be compared; for the sensors run other seeds, or `sinssim sensors GRADE` for the 1σ."
    )


def _is_certain(block: Imu) -> bool:
    """Return whether a block has no random errors: no grade, and nothing given but errors of fixed size."""
    given = block.model_fields_set - {"grade", "rate_hz", "sensor_set"}
    return block.grade == "ideal" and all(re.fullmatch(_FIXED, name) for name in given)


Paint = Mapping[str, str]
"""CSS colour of each line by its name."""

_MARKERS = {"1": "o", "1p": "P", "2": "s", "3": "^", "4": "D"}
_SHAPES = "os^Dv"
_FLOOR = 1e-16  # smaller numbers are drawn as this one, because a logarithmic axis has no zero
_NANOMETRE = 1e-9  # rounding error of a position
_COLUMNS = 3  # panels side by side; with more, their text would be too small to read
_ROOM = 0.04  # of the length of a logarithmic axis, beyond the least and the largest number
_ATTITUDE = ("max_attitude_error_arcsec", "largest attitude error", "″", ARCSEC)
_POSITION = ("max_horizontal_error_m", "largest horizontal error", "m", 1.0)
_DEFECT = ("max_defect", "largest defect of norm or orthogonality", "", 1.0)
_LIMIT = 18.0 * ARCSEC
_SECONDS = Axis(label="time", units=fixed("s"), log=True)
_FORMS: tuple[tuple[str, Weight, Weight], ...] = (
    ("euler", "wide", "bold"), ("functional-iteration", "line", "line"), ("two-quaternions", "line", "line"),
    ("quaternion", "line", "line"),
)  # fmt: skip
"""Colour and weights of the lines of the heading and of its error, form by form."""
_LEAST_ARCSEC = 1e-10  # smaller errors are drawn as this one
_SLOPE_HALF = 1.08  # a local power is the slope between the instants t/1.08 and 1.08 t


def palette(comparison: StudyResult) -> dict[str, str]:
    """Return the colours of a study's lines; a name has the same colour in all charts."""
    names: dict[str, None] = {}
    for part in comparison.study.parts:
        rows = comparison.of_part(part.title)
        names |= dict.fromkeys(map(line_labeller(part, rows), rows))
    return {name: css(color) for name, color in zip(names, colors(list(names)), strict=True)}


def colors_of(algorithms: Sequence[str]) -> list[str]:
    """Return the colour of each algorithm, "#rrggbb", which is the same everywhere."""
    return [css(colors([algorithm])[0]) for algorithm in algorithms]


def finished(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of the cases that did not fail."""
    return [row for row in rows if row.status == "done"]


def _look(name: str, color: str) -> dict[str, Any]:
    """Return the look of a line: marker by order, dashed and hollow if corrected after each step."""
    order = re.search(r"-(\d+p?)", name)
    corrected = name.endswith(("-ortho", "-norm"))
    marker = _MARKERS.get(order[1] if order else "", "*" if family(name) in COLORS else "o")
    return {"color": color, "marker": marker, "dash": "--" if corrected else "", "hollow": corrected}


def _spaced(rates: Sequence[float]) -> tuple[float, ...]:
    """Return the rates that have a tick: those that do not crowd."""
    shown = [rates[0]]
    for rate in rates[1:]:
        if np.log(rate / shown[-1]) > 0.08 * np.log(rates[-1] / rates[0]):
            shown.append(rate)
    return tuple(shown)


def _beyond(values: Sequence[float]) -> dict[str, Any]:
    """Return the ends of a logarithmic axis, with room for the marks; none without positive values."""
    values = [value for value in values if 0.0 < value < np.inf]
    if not values:
        return {}
    margin = max((max(values) / min(values)) ** _ROOM, 1.05)
    return {"low": min(values) / margin, "high": max(values) * margin}


def against_rate(rows: Sequence[Row], label: Label, paint: Paint) -> Charts:
    """Return errors over the sample rate: a column for each motion, a line for each algorithm or varied choice."""
    return _lines("rate", rows, label, paint, (_ATTITUDE, _POSITION))


def against_cost(rows: Sequence[Row], label: Label, paint: Paint) -> Charts:
    """Return errors over the processor time per second of motion, see `against_rate`."""
    return _lines("cost", rows, label, paint, (_ATTITUDE,))


def defect_against_rate(rows: Sequence[Row], label: Label, paint: Paint) -> Charts:
    """Return the loss of norm or orthogonality over the sample rate, see `against_rate`."""
    return _lines("defect", [row for row in rows if row.max_defect > 0.0], label, paint, (_DEFECT,))


def _lines(
    key: str, rows: Sequence[Row], label: Label, paint: Paint, quantities: Sequence[tuple[str, str, str, float]]
) -> Charts:
    motions = list(dict.fromkeys(row.motion for row in rows))
    names = list(dict.fromkeys(label(row) for row in rows))
    done = sorted(finished(rows), key=lambda row: row.rate_hz)
    if key == "cost":
        spent = _beyond([row.rate_hz * row.ns_per_step * 1e-9 for row in done])
        x = Axis(label="processor time per second of motion", units=fixed("µs", 1e-6), log=True, **spent)
    else:
        rates = sorted({row.rate_hz for row in rows})
        ticks = _spaced(rates) if rates else ()
        x = Axis(label="sample rate", units=fixed("Hz"), log=True, ticks=ticks, **_beyond(rates))
    lines: list[tuple[tuple[Chart, ...], ...]] = []
    for number, (quantity, title, unit, size) in enumerate(quantities):
        compared = quantity == _ATTITUDE[0] and len({row.algorithm for row in rows}) > 1
        values = [max(getattr(row, quantity), _FLOOR) * size for row in done] + [_LIMIT] * compared
        charts = []
        for column, motion in enumerate(motions):
            marks: list[Mark] = []
            for name in names:
                line = [row for row in done if row.motion == motion and label(row) == name]
                at = [row.rate_hz * (row.ns_per_step * 1e-9 if key == "cost" else 1.0) for row in line]
                y = np.array([max(getattr(row, quantity), _FLOOR) * size for row in line])
                marks.append(Line(label=name, x=np.array(at), y=y, **_look(name, paint[name])))
            if compared:
                marks.append(Rule(at=_LIMIT, dash=":", text="" if column else "0.3′"))
            first = column % _COLUMNS == 0
            y_axis = Axis(label=title if first else "", units=fixed(unit if first else "", size), log=True,
                          **_beyond(values))  # fmt: skip
            charts.append(Chart(key=f"{key}/{quantity}/{column}", title="" if number else motion, x=x, y=y_axis,
                                marks=tuple(marks)))  # fmt: skip
        lines.append(in_rows(charts, _COLUMNS))
    ordered = tuple(row for band in zip(*lines, strict=True) for row in band)
    columns = min(len(motions), _COLUMNS)
    size_of = (max(3.3 * columns, 6.0) + 2.2, max(3.2 * len(ordered), 0.6 + 0.165 * len(names)))
    return Charts(key, ordered, size_of, legend="right")


def bars(rows: Sequence[Row], label: Label, line: Label, paint: Paint) -> Charts:
    """Return errors as bars, for comparisons at one rate, with a label and the name of the line over time whose colour
    each shares."""
    done = finished(rows)
    names = list(dict.fromkeys(label(row) for row in rows))
    charts = []
    for number, motion in enumerate(dict.fromkeys(row.motion for row in done)):
        here = [row for row in done if row.motion == motion]
        values = np.array([max(row.max_horizontal_error_m, _FLOOR) for row in here])
        low, high = np.floor(np.log10(values.min()) - 0.3), np.ceil(np.log10(values.max()))
        mark = Bars(places=np.array([float(names.index(label(row))) for row in here]), values=values,
                    color=[paint[line(row)] for row in here], texts=tuple(map(_short, values)))  # fmt: skip
        x = Axis(label="largest horizontal error", units=fixed("m"), log=True, low=float(10.0**low),
                 high=float(10.0 ** (high + 0.18 * (high - low))))  # fmt: skip
        y = Axis(names=tuple(names), grid=False)
        charts.append(Chart(key=f"bars/{number}", title=motion, x=x, y=y, marks=(mark,)))
    lines = in_rows(charts, _COLUMNS)
    size = (max(7.5, 2.4 + 3.2 * len(lines[0])), len(lines) * (1.0 + 0.24 * len(names)) + 0.4)
    return Charts("bars", lines, size, share="y")


def _short(value: float) -> str:
    if not 1e-3 <= value < 1e7:
        return f"{value:.1e}"
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"


def panels_of(comparison: StudyResult, part: Part, rows: Sequence[Row]) -> dict[str, list[tuple[str, ErrorGrowth]]]:
    """Return names of lines and the growth of their errors, at one rate, by motion."""
    label, done = line_labeller(part, rows), finished(rows)
    panels: dict[str, list[tuple[str, ErrorGrowth]]] = {row.motion: [] for row in done}
    for row in at_one_rate(done):
        panels[row.motion].append((label(row), comparison.history(row)))
    return panels


def growth(panels: Mapping[str, Sequence[tuple[str, ErrorGrowth]]], paint: Paint) -> Charts:
    """Return the horizontal error over time by motion and name of the line, both logarithmic, so that a power of time
    is a straight line."""
    every = [np.maximum(history.horizontal[1:], _NANOMETRE) for drawn in panels.values() for _, history in drawn]
    ends = _beyond([float(end) for v in every for end in (v.min(), v.max())])
    charts = []
    for number, (motion, drawn) in enumerate(panels.items()):
        first = number % _COLUMNS == 0
        y = Axis(label="horizontal error" if first else "", units=fixed("m" if first else ""), log=True, **ends)
        marks = tuple(
            Line(label=name, x=history.time[1:] - history.time[0], y=np.maximum(history.horizontal[1:], _NANOMETRE),
                 color=paint[name])
            for name, history in drawn
        )  # fmt: skip
        charts.append(Chart(key=f"grow/{number}", title=motion, x=_SECONDS, y=y, marks=marks))
    lines = in_rows(charts, _COLUMNS)
    names = dict.fromkeys(name for drawn in panels.values() for name, _ in drawn)
    size = (max(3.3 * len(lines[0]), 5.5) + 2.6, max(3.0 * len(lines), 0.6 + 0.165 * len(names)))
    return Charts("grow", lines, size, legend="right")


def costs(comparison: StudyResult) -> Charts:
    """Return the cost of one step of each algorithm, frame and schedule: operations, and processor time."""
    measured = list(comparison.costs.values())
    several = [key for key in ("frame", "pace") if len({getattr(cost, key) for cost in measured}) > 1]
    names = tuple(" · ".join([cost.algorithm, *(getattr(cost, key) for key in several)]) for cost in measured)
    charts = []
    for title, unit, size, values in (
        ("floating-point operations per step", "", 1.0, [cost.operations.total for cost in measured]),
        ("processor time per step", "ns", 1e-9, [cost.ns_per_step for cost in measured]),
    ):
        mark = Bars(places=np.arange(float(len(names))), values=np.array(values) * size,
                    color=colors_of([cost.algorithm for cost in measured]),
                    texts=tuple(f"{value:.0f}" for value in values))  # fmt: skip
        x = Axis(label=title, units=fixed(unit, size), low=0.0, high=1.12 * max(values, default=1.0) * size)
        charts.append(Chart(key=f"costs/{unit}", x=x, y=Axis(names=names, grid=False), marks=(mark,)))
    return Charts("costs", (tuple(charts),), (8.5, 0.9 + 0.24 * len(names)), share="y")


def orders(fits: Sequence[Order]) -> Charts:
    """Return fitted orders of convergence of the attitude: a row for each algorithm, a mark for each motion."""
    names = tuple(dict.fromkeys(order.algorithm for order in fits))
    motions = list(dict.fromkeys(order.motion for order in fits))
    marks = []
    for number, motion in enumerate(motions):
        here = [order for order in fits if order.motion == motion]
        places, slopes, apart = np.array([(names.index(o.algorithm), o.order, o.uncertainty) for o in here]).T
        marks.append(Dots(
            label=motion if len(motions) > 1 else "", x=slopes, y=places, error=apart, size=5.8,
            color=colors_of([order.algorithm for order in here]), marker=_SHAPES[number % len(_SHAPES)],
        ))  # fmt: skip
    top = max((order.order for order in fits), default=4.0)
    x = Axis(label="order of convergence of the attitude: error ~ intervalᵖ, p", low=0.0, high=top + 0.7,
             ticks=tuple(map(float, range(int(np.ceil(top)) + 2))))  # fmt: skip
    chart = Chart(key="orders", x=x, y=Axis(names=names), marks=tuple(marks), legend="right")
    return Charts("orders", ((chart,),), (7.5, 1.1 + 0.24 * len(names)))


def turning(headings: Sequence[Heading]) -> Charts:
    """Return the heading of one part in each form over time, and its error, a column for each motion at one rate."""
    rows: tuple[list[Chart], list[Chart]] = ([], [])
    for column, motion in enumerate(dict.fromkeys(heading.motion for heading in headings)):
        here = [heading for heading in headings if heading.motion == motion]
        marks: tuple[list[Mark], list[Mark]] = ([], [])
        for heading, (name, broad, narrow) in zip(here, _FORMS, strict=True):
            time, unwrapped = heading.time - heading.time[0], heading.form.endswith("unwrapped")
            apart = np.mod(heading.heading - heading.truth + np.pi, 2.0 * np.pi) - np.pi
            error = np.maximum(np.abs(apart), _LEAST_ARCSEC * ARCSEC)
            look: dict[str, Any] = {"x": time, "color": name, "dash": "--" if unwrapped else ""}
            marks[0].append(Line(label=heading.form, y=heading.heading, weight=broad, **look))
            marks[1].append(Line(y=error, weight=narrow, **look))
        marks[1].append(Rule(at=_LIMIT, dash=":", text="0.3′"))
        first = column == 0
        angle = Axis(label="heading" if first else "", units=fixed("°" if first else "", DEG))
        ends = _beyond([_LIMIT, *(float(end) for line in marks[1] if isinstance(line, Line)
                                  for end in (line.y.min(), line.y.max()))])  # fmt: skip
        error_axis = Axis(label="error of the heading" if first else "", units=fixed("″" if first else "", ARCSEC),
                          log=True, **ends)  # fmt: skip
        title = f"{motion}, {here[0].rate_hz:g} Hz"
        rows[0].append(Chart(key=f"heading/{column}", title=title, x=TIME, y=angle, marks=tuple(marks[0])))
        rows[1].append(Chart(key=f"error/{column}", x=TIME, y=error_axis, marks=tuple(marks[1])))
    return Charts("turning", (tuple(rows[0]), tuple(rows[1])), (3.8 * len(rows[0]) + 2.6, 5.4), legend="right",
                  on=("page",))  # fmt: skip


def power_of_time(blocks: Mapping[str, tuple[ErrorGrowth, float]]) -> Charts:
    """Return the error of blocks without gyros, by name with the arm of the cube, m, over time, both logarithmic, and
    its local power of time."""
    above, below, last = list[Mark](), list[Mark](), law.SCHULER_PERIOD
    for (name, (history, arm)), color in zip(blocks.items(), colors(list(blocks)), strict=True):
        time, error = law.linear_part(history, arm)
        if len(time) < 2:
            continue
        last = max(last, float(time[-1]))
        above.append(Line(label=name, x=time, y=error, color=color))
        inside = time[(time > _SLOPE_HALF * time[0]) & (time < time[-1] / _SLOPE_HALF)]
        below.append(Line(x=inside, y=_slope(time, error, inside), color=color))
    at = np.geomspace(5.0, last, 400)
    below.append(Line(label="closed form", x=at, y=law.local_power(at), color="ink", weight="thin", dash="--"))
    for start, end, power, within in ((5.0, law.EARLY, 4.0, 0.1), (law.SCHULER_PERIOD, last, 2.0, 0.2)):
        low, high = (np.full(2, power + sign * within) for sign in (-1.0, 1.0))
        below.append(Band(x=np.array([start, end]), low=low, high=high, color="bound"))
    x = Axis(label="time", units=fixed("s"), log=True, low=5.0, high=1.05 * last)
    charts = []
    for key, marks, instants, y in (
        ("error", above, ("1000 s", "Schuler period"), Axis(label="horizontal error", units=fixed("m"), log=True)),
        ("power", below, ("", ""), Axis(label="power of time", low=1.0, high=5.0)),
    ):
        rules = [Rule(at=instant, upright=True, text=word, dash=":")
                 for instant, word in zip((law.EARLY, law.SCHULER_PERIOD), instants, strict=True)]  # fmt: skip
        charts.append((Chart(key=key, x=x, y=y, marks=(*marks, *rules)),))
    return Charts("power", tuple(charts), (8.5, 6.2), share="x", heights=(1.5, 1.0), legend="right")


def _slope(time: Array, error: Array, inside: Array) -> Array:
    """Return the local power of time at some instants."""
    x, y, half = np.log(time), np.log(error), np.log(_SLOPE_HALF)
    before, after = (np.interp(np.log(inside) + step, x, y) for step in (-half, half))
    return np.asarray((after - before) / (2.0 * half))


_BLOCK = "six-accelerometers-"


def at_highest_rate(headings: Sequence[Heading]) -> list[Heading]:
    """Return headings of one part, each motion at its highest rate."""
    highest = {
        motion: max(h.rate_hz for h in headings if h.motion == motion) for motion in {h.motion for h in headings}
    }
    return [heading for heading in headings if heading.rate_hz == highest[heading.motion]]


def gyro_free_blocks(comparison: StudyResult, part: Part) -> dict[str, tuple[ErrorGrowth, float]]:
    """Return growth of the errors and arm, m, of each block without gyros of a part, by name."""
    blocks = {}
    for row in comparison.of_part(part.title):
        growth = comparison.history_or_none(row)
        if row.variant.startswith(_BLOCK) and row.sensors != "ideal" and growth is not None:
            arm = row.variant.removeprefix(_BLOCK)
            several = len(part.motions) > 1
            blocks[f"{row.motion + ', ' if several else ''}{row.sensors}, arms of {arm}"] = (
                growth, float(arm.removesuffix("m"))
            )  # fmt: skip
    return blocks


_PANELS, _LINES, _LEGEND = 6, 12, 8
"""Of the recording: most panels, lines of a panel, and names in a legend; a page beside it has all colours."""
_POINTS = 400
_LEAST = 1e-12  # smaller errors, m or arcsec, are drawn as this one


def growth_over_time(comparison: StudyResult, paint: Paint) -> tuple[list[tuple[str, str, float, bool]], list[Charts]]:
    """Return the growth of the errors for the recording, of the attitude where rates are compared, else horizontal: of
    each panel entity, title, end of the motion and whether there is room for a legend; and their charts."""
    panels, drawn = list[tuple[str, str, float, bool]](), list[Chart]()
    for number, part in enumerate(comparison.study.parts, start=1):
        rows = comparison.of_part(part.title)
        for motion in dict.fromkeys(row.motion for row in finished(rows)):
            shown = at_one_rate([row for row in finished(rows) if row.motion == motion])
            if len(shown) > _LINES:
                shown = [row for row in shown if not row.algorithm.endswith(("-ortho", "-norm"))][: 2 * _LINES]
            label, histories = line_labeller(part, rows), [comparison.history(row) for row in shown]
            end = float(min(history.time[-1] for history in histories))
            time = np.linspace(histories[0].time[0], end, _POINTS)
            quantity, unit, size = ("attitude", "″", ARCSEC) if over_rates(part) else ("horizontal", "m", 1.0)
            marks = []
            for row, history in zip(shown, histories, strict=True):
                error = size * np.maximum(np.interp(time, history.time, getattr(history, quantity)), _LEAST)
                error[0] = np.nan  # the error at the start is zero and has no logarithm
                marks.append(Line(label=label(row), x=time, y=error, color=paint[label(row)]))
            key = f"growth/{number}/{motion.replace(' ', '_').replace(',', '')}"
            title = f"{motion}{f', {shown[0].rate_hz:g} Hz' if part.rates_hz else ''}: {quantity}, log₁₀ {unit}"
            y = Axis(label=f"{quantity} error", units=fixed(unit, size), log=True)
            drawn.append(Chart(key=key, title=title, y=y, marks=tuple(marks)))
            panels.append((f"comparison/{key}", title, end, len(shown) <= _LEGEND))
    charts = [Charts("growth", ((chart,),), (6.0, 3.0), on=("recording",)) for chart in drawn]
    return panels[:_PANELS], charts
