"""What a plan shows before the run: the map, height and speed over time, the legs and the aircraft's ceiling."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.charts import Axis, Chart, Charts, Line, Mark, Remark, over
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.errors import InputError
from sinssim.experiments.run.motion_exhibits import mark_of_many
from sinssim.recording.track_map import Track, track_map
from sinssim.scenario.plan_summary import named_places
from sinssim.truth.flight.flight_plan import PlannedPath, planned_path
from sinssim.units import DEG, fixed

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
