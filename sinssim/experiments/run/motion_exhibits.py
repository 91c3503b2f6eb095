"""The motion of a run: its map, facts, height, speed and attitude over time, legs and events; its plan before it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation
from sinssim.charts import PAIR, Axis, Chart, Charts, Line, Mark, Remark, Rule, over
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import ELLIPSOIDS, Ellipsoid
from sinssim.errors import InputError
from sinssim.exhibits import Column, Item, Section, Table
from sinssim.recording import style
from sinssim.recording.track_map import NOTE, Spread, Track, degrees, track_map
from sinssim.scenario import Scenario
from sinssim.scenario.plan_summary import field_words, given, leg_words, named_places, route_words, values_of
from sinssim.truth.flight.flight_plan import PlannedPath, planned_path
from sinssim.truth.sampling import Channel
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ALTITUDE_SCALE, DEG, duration_words, fixed, suiting

if TYPE_CHECKING:
    from sinssim.simulation.truth_and_sensors import Truth


def motion_exhibits(scenario: Scenario, truth: Truth, further: Sequence[Item] = ()) -> Iterator[Item]:
    """Yield plots over time of the true motion, further items, its legs and events."""
    trajectory = truth.trajectory
    legs, events = _legs(scenario, trajectory)
    marks = [mark_of_many(begin, str(i + 1)) for i, (_, _, begin, _) in enumerate(legs)]
    airspeed = trajectory.channels.get("airspeed_mps")
    yield from motion_charts(truth.time, truth.state, marks, scenario.output.angles, airspeed)
    yield from further
    if legs:
        heads = (Column("leg", words=True), Column("", words=True), Column("", words=True))
        rows = [
            (str(i + 1), name, what, f"{begin:.1f}", "–" if end is None else f"{end:.1f}")
            for i, (name, what, begin, end) in enumerate(legs)
        ]
        table = Table((*heads, Column("from", fixed("s")), Column("to", fixed("s"))), rows)
        yield Section(f"Legs{' as flown' if scenario.flight else ''}", [table])
    if events:
        columns = (Column("time", fixed("s")), Column("", words=True))
        yield Section("Events", [Table(columns, [(f"{time:.1f}", text) for time, text in events])])


def mark_of_many(at: float, text: str = "") -> Rule:
    """Return one of many marks on a plot over time."""
    return Rule(at=at, upright=True, text=text, color="grid", weight="hair")


def solution_tracks(solutions: Mapping[str, NavSolution]) -> list[Track]:
    """Return the tracks of solutions in their colours."""
    paint = style.colors(list(solutions))
    return [Track.of(name, s.time, s, color) for (name, s), color in zip(solutions.items(), paint, strict=True)]


def motion_map(
    scenario: Scenario,
    ellipsoid: Ellipsoid,
    motion: Track,
    solutions: Sequence[Track],
    places: Sequence[tuple[str, float, float]] = (),
    spread: Spread | None = None,
    planned: Sequence[tuple[Array, Array]] = (),
) -> Charts:
    """Return the map with the true track, those of the solutions with the `spread` of one of them, the parts of the
    `planned` path, and places with a name, latitude and longitude."""
    motion = replace(motion, color=style.tint(style.COLORS["truth"]) if solutions else "truth")
    outages = () if scenario.aiding is None else scenario.aiding.outages
    note = NOTE.format("true")
    places = [*named_places(scenario), *places]
    return track_map(
        [motion, *solutions], ellipsoid, outages=outages, places=places, spread=spread, planned=planned, note=note
    )


def motion_facts(scenario: Scenario, truth: Truth) -> Table:
    """Return what a motion is in a few numbers, and its source."""
    trajectory, state = truth.trajectory, truth.state
    roll, pitch, _ = (angle / DEG for angle in rotation.euler_from_quaternion(state.q_nb))
    speed, (unit, size) = ground_speed(state), suiting(ALTITUDE_SCALE, state.height)
    facts = [
        ("duration", duration_words(float(truth.time[-1] - truth.time[0]))),
        ("distance over ground (∫ ground speed dt)", distance_text(truth.time, speed)),
        ("start", place_text(state, 0)),
        ("end", place_text(state, -1)),
        ("height above the ellipsoid", between_text(state.height / size, 1 if size == 1.0 else 3, unit)),
        ("ground speed", between_text(speed, 1, "m/s")),
        ("vertical speed, up", between_text(-state.velocity_ned[:, 2], 1, "m/s")),
        ("roll", between_text(roll, 1, "°")),
        ("pitch", between_text(pitch, 1, "°")),
        ("gravity, ellipsoid", f"{trajectory.gravity}, {trajectory.ellipsoid.name}"),
        *_source(scenario),
    ]
    return facts_table("true motion of the sensor block", facts)


def facts_table(head: str, facts: Sequence[tuple[str, str]]) -> Table:
    """Return a table of names and texts."""
    return Table((Column(head, words=True), Column("", words=True)), facts)


def ground_speed(state: NavState) -> Array:
    """Return the horizontal speed, (N,) m/s."""
    return np.hypot(state.velocity_ned[:, 0], state.velocity_ned[:, 1])


def distance_text(time: Array, speed: Array) -> str:
    """Write the distance over ground, from the ground speed, (N,) m/s, at times, (N,) s."""
    distance = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
    return f"{distance / 1e3:.3f} km"


def motion_charts(
    time: Array, state: NavState, marks: Sequence[Rule], angles: str | None, airspeed: Channel | None = None
) -> Iterator[Charts]:
    """Yield height, speed and attitude at (N,) s; `angles` is the range of the heading, or "continuous"."""
    roll, pitch, heading = rotation.euler_from_quaternion(state.q_nb)
    x, degrees_ = over((float(time[0]), float(time[-1]))), fixed("deg", DEG)
    above, speeds = Axis(units=ALTITUDE_SCALE, least=1e-3), Axis(units=fixed("m/s"), least=1e-3)
    ground = [Line(label="ground speed", x=time, y=ground_speed(state), color="y")]
    if airspeed is not None and airspeed.values.ndim == 1 and len(airspeed.time) > 1:
        ground.append(Line(label="true airspeed", x=airspeed.time, y=airspeed.values, color="x", dash="--"))
    leaning = Axis(units=degrees_, least=1e-3 * DEG)
    if np.abs(roll).max() > np.radians(120.0):
        leaning = replace(leaning, low=-np.pi, high=np.pi, ticks=tuple(np.radians((-180.0, -90.0, 0.0, 90.0, 180.0))))
    shown, counted = rotation.shown_heading(angles, heading), angles == "continuous"
    least = rotation.HEADING_RANGES["0..360" if counted else angles or "0..360"]
    turns = Axis(units=degrees_, least=1e-3 * DEG)
    if not counted:
        quarters = tuple(float(v) for v in least + 0.5 * np.pi * np.arange(5))
        turns = Axis(units=degrees_, low=quarters[0], high=quarters[-1], ticks=quarters)

    def chart(key: str, title: str, y: Axis, *lines: Line) -> Chart:
        return Chart(key=f"flight/{key}", title=title, x=x, y=y, marks=(*marks, *lines))

    yield Charts("motion", (
        (chart("height", "Height above the ellipsoid", above, Line(label="height", x=time, y=state.height, color="y")),
         chart("speed", "Speed", speeds, *ground)),
        (chart("roll_pitch", "Roll and pitch", leaning,
               Line(label="roll", x=time, y=roll, color="x", turn=2.0 * np.pi),
               Line(label="pitch", x=time, y=pitch, color="z")),
         chart("heading", "Heading", turns,
               Line(label="heading", x=time, y=shown, color="y", turn=0.0 if counted else 2.0 * np.pi))),
    ), (PAIR[0], 2.0 * PAIR[1]))  # fmt: skip
    climb = Line(label="vertical speed", x=time, y=-state.velocity_ned[:, 2], color="z")
    yield Charts("climb", ((chart("vertical_speed", "Vertical speed, up", speeds, climb),),), PAIR, on=("recording",))


def _source(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Describe the source of the true motion."""
    flight = scenario.flight
    if flight is not None:
        yield "flown by JSBSim, aircraft", flight.aircraft
        yield "wind", flight.wind.words()
        if flight.atmosphere is not None:
            yield "atmosphere", flight.atmosphere.words()
        yield "turbulence", values_of(flight.turbulence) if flight.turbulence else "none"
    if scenario.track is not None:
        yield "planned route" if scenario.track.waypoints else "recorded track", scenario.track.what
    for name in ("parked", "great_circle", "motion", "drive", "voyage", "rocket", "turntable"):
        section = getattr(scenario, name)
        if section is not None:
            legs = f"{len(section.legs)} legs, see below; " if hasattr(section, "legs") else ""
            yield name.replace("_", " "), legs + given(section, "legs")
    if scenario.drop is not None:
        yield "drop", given(scenario.drop)
    for vibration in scenario.vibration:
        yield "vibration", given(vibration)
    if scenario.isolator is not None:
        yield "isolator", values_of(scenario.isolator)
    if scenario.gravity is not None:
        yield "gravity field", field_words(scenario)


def _legs(
    scenario: Scenario, trajectory: Trajectory
) -> tuple[list[tuple[str, str, float, float | None]], list[tuple[float, str]]]:
    """Return the legs that began (type, settings, beginning, end), and all other events."""
    events = [(event.time, event.text) for event in trajectory.events]
    legs: list[tuple[str, str, float, float | None]] = []
    for i, leg in enumerate(getattr(scenario.source, "legs", ()), start=1):
        times = {}
        for edge in ("begins", "ends"):
            event = next((e for e in events if e[1] == f"leg {i} ({leg.type}) {edge}"), None)
            if event is not None:
                times[edge] = event[0]
                events.remove(event)
        if "begins" in times:
            settings = "; ".join(part for part in (leg_words(leg), *route_words(leg)) if part)
            legs.append((leg.type, settings, times["begins"], times.get("ends")))
    return legs, events


def place_text(truth: NavState, row: int) -> str:
    lat, lon, height = (float(v[row]) for v in (truth.latitude, truth.longitude, truth.height))
    height = round(height, 1) + 0.0  # no negative zero
    return f"{degrees(lat / DEG, 'NS', 5)} {degrees(lon / DEG, 'EW', 5)}, {height:.1f}\u00a0m"


def between_text(values: Array, places: int, unit: str) -> str:
    rounded = (round(float(v), places) + 0.0 for v in (values.min(), values.max()))  # + 0.0: no negative zero
    low, high = (f"{v:.{places}f}".replace("-", "−") for v in rounded)
    blank = "" if unit == "°" else " "
    return f"{low}{blank}{unit}" if low == high else f"{low} … {high}{blank}{unit}"


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
