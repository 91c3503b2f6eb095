"""What is shown before a run.

Of a plan the map, height and speed over time, the legs and the aircraft's ceiling; of a grade of sensors its terms, and
the position error that each causes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.charts import Axis, Chart, Charts, Line, Mark, Remark, over
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.errors import InputError
from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.experiments.run.motion_exhibits import mark_of_many
from sinssim.recording.track_map import Track, track_map
from sinssim.scenario.notes import keys_without_effect
from sinssim.scenario.plan_summary import named_places
from sinssim.sensors.error_propagation import ASSUMPTIONS, Expectation
from sinssim.sensors.imu.grades import find_grade, grade_name
from sinssim.truth.flight.flight_plan import PlannedPath, planned_path
from sinssim.units import DEG, NAUTICAL_MILE, fixed

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

_POINTS = 2000
_STANDS = 1.0  # extent below which a motion is a place [m]
_LETTER, _GAP = 0.017, 0.02  # width of a letter and gap beside a name, parts of the time axis


def plan_of(scenario: Scenario) -> PlannedPath:
    """Return the planned motion of a scenario: of a flight by dead reckoning, of any other motion the true one."""
    if scenario.flight is not None:
        return planned_path(scenario.flight)
    if scenario.log is not None or scenario.one_component is not None:
        what = "recorded sensors" if scenario.log is not None else "a motion in a vertical plane"
        raise InputError(f"the scenario {scenario.name} has {what}: there is no plan to draw; leave out --plot.")
    from sinssim.scenario.true_motion import fly

    motion = fly(scenario)
    time = np.linspace(motion.start, motion.end, _POINTS)
    state = motion.state(time)
    speed = np.hypot(state.velocity_ned[:, 0], state.velocity_ned[:, 1])
    legs, begun = [], dict[str, float]()
    for event in motion.events:
        if event.text.endswith(" begins"):
            begun[event.text.removesuffix(" begins")] = event.time
        elif event.text.endswith(" ends") and (name := event.text.removesuffix(" ends")) in begun:
            number, _, kind = name.removeprefix("leg ").partition(" ")
            legs.append((f"{number} {kind.strip('()')}", begun[name], event.time))
    values = (time, np.unwrap(state.longitude), state.latitude, state.height, speed)
    at, lon, lat, height, over = (value.tolist() for value in values)
    return PlannedPath(at, lat, lon, height, over, legs, [])


def plan_charts(scenario: Scenario) -> Charts:
    """Return the charts of a scenario's plan: its map, and height and speed over time."""
    path = plan_of(scenario)
    of_legs = scenario.flight is not None
    title = f"{scenario.name}: {'plan by dead reckoning' if of_legs else 'planned motion'}"
    row = (_map(scenario, path), _heights(path), _speeds(path, of_legs=of_legs))
    return Charts("plan", (row,), (14.0, 4.8), title=title, widths=(1.1, 1.0, 1.0))


def _map(scenario: Scenario, path: PlannedPath) -> Chart:
    """Return the map with the numbers of the legs in the middle of each, and the waypoints."""
    time, latitude, longitude = (np.array(values) for values in (path.time, path.latitude, path.longitude))
    legs = [(name.split()[0], 0.5 * (begin + end)) for name, begin, end in path.legs]
    dense = np.union1d(time, [middle for _, middle in legs])
    track = Track("plan", dense, np.interp(dense, time, latitude), np.interp(dense, time, longitude), "truth")
    (chart,) = track_map([track], ELLIPSOIDS[scenario.truth.ellipsoid], places=named_places(scenario), legs=legs)
    marks: tuple[Mark, ...] = chart.marks
    if max(np.ptp(latitude), np.ptp(longitude)) * 6.4e6 < _STANDS:
        words = f"at rest at {latitude[0] / DEG:.5f}°, {longitude[0] / DEG:.5f}°"
        marks = (*marks, Remark(x=0.0, y=0.0, text=words))
    return replace(chart, title="Map", marks=marks)


def _heights(path: PlannedPath) -> Chart:
    """Return height over time, the ceiling, and the names of the legs where they have room."""
    time, height = np.array(path.time), np.array(path.height)
    lines = [Line(label="height", x=time, y=height, color="truth")]
    if path.ceiling:
        label = "ceiling of the aircraft at the planned airspeed"
        lines.append(Line(label=label, x=time, y=np.array(path.ceiling), color="limit", weight="thin", dash="--"))
    low, high = (end(float(end(line.y)) for line in lines[: None if end is max else 1]) for end in (min, max))
    span, lasts = max(high - low, 10.0), float(time[-1] - time[0])
    marks: list[Mark] = []
    free = -np.inf
    for name, begin, end in path.legs if len(path.legs) > 1 else ():
        marks.append(mark_of_many(begin))
        words = name if end - begin > lasts * (_LETTER * len(name) + _GAP) else name.split()[0]
        if begin > free:
            marks.append(Remark(x=begin, y=high + 0.16 * span, text=words, soft=True))
            free = begin + lasts * (_LETTER * len(words) + 0.5 * _GAP)
    y = Axis(units=fixed("m"), low=low - 0.08 * span, high=high + 0.25 * span)
    times = over((float(time[0]), float(time[-1])))
    title = "Height above the ellipsoid"
    chart = Chart(key="plan/height", title=title, x=times, y=y, marks=(*marks, *lines), legend="none")
    return replace(chart, legend="below") if path.ceiling else chart


def _speeds(path: PlannedPath, *, of_legs: bool) -> Chart:
    """Return the ground speed over time."""
    time, speed = np.array(path.time), np.array(path.speed)
    y = Axis(units=fixed("m/s"), low=0.0, high=max(1.0, 1.15 * float(speed.max())))
    times = over((float(time[0]), float(time[-1])))
    title = f"Ground speed{', mean of each leg' if of_legs else ''}"
    marks = (Line(label="ground speed", x=time, y=speed, color="aided"),)
    return Chart(key="plan/speed", title=title, x=times, y=y, marks=marks, legend="none")


CIRCULAR = 0.8326
"""Ratio of the radius that holds half of all errors to their rms, √(ln 2), for equal normal north and east errors."""
_LINEAR = 5e5
"""Position error beyond which the linear theory does not hold, m."""


def expectation_numbers(expectation: Expectation) -> dict[str, Any]:
    """Return the expectation as plain numbers with units in the names."""
    e = expectation
    grade = find_grade(e.imu.grade)
    return {
        "grade": e.imu.grade,
        "description": grade.description,
        "source": grade.source,
        "latitude_deg": e.latitude / DEG,
        "duration_s": e.duration,
        "terms": [vars(term) for term in e.terms],
        "contributions": [{"term": c.term, "assumes": c.assumes, "position_m": c.position} for c in e.contributions],
        "root_sum_square_m": e.total,
        "root_sum_square_nmi": e.total / NAUTICAL_MILE,
        "circular_error_probable_nmi": CIRCULAR * e.total / NAUTICAL_MILE if e.drawn else None,
        "unaided_height_from_accelerometer_bias_m": e.height,
        "linear": e.total < _LINEAR,
    }


def expectation_exhibits(expectation: Expectation) -> Iterator[Item]:
    """Yield the error terms, and the position error that each causes."""
    e = expectation
    grade = find_grade(e.imu.grade)
    yield Sentence(f"{grade_name(e.imu.grade)}: {grade.description}")
    yield Sentence(f"Source: {grade.source}\n")
    if not e.terms:
        yield Sentence("The sensors have no errors.")
        return
    heads = (Column("term", words=True), Column("value"), Column("", words=True), Column("SI"), Column("", words=True),
             Column("is", words=True))  # fmt: skip
    terms = [(t.name, _number(t.value), t.unit, f"{t.si:.4g}", t.si_unit.removeprefix("1"), t.meaning) for t in e.terms]
    yield Table(heads, terms, title="Value (1σ)")
    hours = e.duration / 3600.0
    columns = (Column("m (1σ)"), Column("nmi"), Column("from", words=True), Column("vehicle", words=True))
    causes = [(*_position(c.position), c.term, c.assumes) for c in e.contributions]
    title = f"Horizontal position error that each alone causes in {hours:g} h, latitude {e.latitude / DEG:g}°"
    yield Table(columns, [*causes, (*_position(e.total), "total", "")], title=title)
    assumed = dict.fromkeys(c.assumes for c in e.contributions)
    yield Sentence("Vehicle: " + "; ".join(f"{name}, {ASSUMPTIONS[name]}" for name in assumed) + ".")
    yield Sentence("All together: root of the sum of squares.")
    if e.total > _LINEAR:
        yield Sentence(f"The linear theory is not valid beyond {_LINEAR / 1e3:g} km: the position is lost.")
    elif e.total and e.drawn:
        yield Sentence(
            f"Half of all runs end within {CIRCULAR * e.total / NAUTICAL_MILE / hours:.2f} nmi per hour, which is "
            "called the class of a unit."
        )
    yield from map(Sentence, keys_without_effect(e.imu, e.duration))
    if e.height:
        away = f"{_digits(e.height)} m" if e.height < _LINEAR else f"more than {_LINEAR / 1e3:g} km"
        yield Sentence(
            f"Height is not included: unaided, its error grows to {away} in {hours:g} h for the bias of the down "
            "accelerometer alone."
        )


def _number(value: float) -> str:
    """Write four digits, without a power of ten where it is not customary."""
    return f"{value:.0f}" if 1e4 <= value < 1e7 else f"{value:.4g}"


def _position(error: float) -> tuple[str, str]:
    """Write a position error in metres and nautical miles."""
    beyond = "> " if error > _LINEAR else ""
    error = min(error, _LINEAR)
    return beyond + _digits(error), beyond + _digits(error / NAUTICAL_MILE)


def _digits(value: float) -> str:
    """Write a number with three or four significant digits and no more."""
    rounded = float(f"{value:.4g}")
    decimals = sum(rounded < limit for limit in (100.0, 10.0, 1.0))
    return f"{rounded:,.{decimals}f}"
