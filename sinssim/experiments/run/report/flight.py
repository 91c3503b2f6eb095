"""The section of a run's report about the true motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, NavState
from sinssim.experiments.run.report.track import Places, Track, degrees, draw_map
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line, Mark
from sinssim.recording.scales import thinned
from sinssim.scales import duration_words
from sinssim.scenario.summary import field_words, given, leg_words, named_places, route_words, values_of

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.simulation.truth import Truth
    from sinssim.truth.channel import Channel
    from sinssim.truth.trajectory import Trajectory


MAP = "<!-- map -->"
"""Stands for the map in the section: it is drawn when the filter's track is known."""
_MAP_ROWS = 16384
_BY_LEGS = ("drive", "voyage")


def flight_section(scenario: Scenario, truth: Truth, further: Iterable[str] = ()) -> Iterator[str]:
    """Return the section about the true motion: map, facts, plots over time, legs and events."""
    trajectory = truth.trajectory
    yield _map_and_facts(scenario, truth)
    legs, events = _legs(scenario, trajectory)
    marks = [Mark(begin, str(i + 1), faint=True) for i, (_, _, begin, _) in enumerate(legs)]
    airspeed = trajectory.channels.get("airspeed_mps")
    yield from motion_plots(truth.time, truth.state, marks, scenario.output.angles, airspeed)
    yield from further
    if legs:
        yield f'<h3>Legs{" as flown" if scenario.flight else ""}</h3><div class="events">'
        lines = [
            (
                str(i + 1),
                f'<td class="name">{words(name)}</td>',
                f'<td class="text">{words(what)}</td>',
                f"<td>{begin:.1f}</td>",
                "<td>–</td>" if end is None else f"<td>{end:.1f}</td>",
            )
            for i, (name, what, begin, end) in enumerate(legs)
        ]
        yield table(("leg", "", "", "from [s]", "to [s]"), lines) + "</div>"
    if events:
        yield "<h3>Events</h3>" + table(
            ("time [s]", ""), [(f"<td>{t:.1f}</td>", f'<td class="text">{words(x)}</td>') for t, x in events]
        )


def map_of(scenario: Scenario, truth: Truth, solutions: Mapping[str, Track]) -> Callable[[Mapping[str, Track]], str]:
    """Return what draws the map, with as many points of the tracks as it shows.

    Returns:
        A function of further tracks, such as that of the filter, that returns SVG for the place of `MAP`.
    """
    k, s = thinned(len(truth.time), _MAP_ROWS), truth.state
    state = NavState(s.latitude[k], s.longitude[k], s.height[k], s.velocity_ned[k], s.q_nb[k])
    time, ellipsoid = truth.time[k], truth.ellipsoid
    own = {name: _thin(solution) for name, solution in solutions.items()}
    outages = () if scenario.aiding is None else scenario.aiding.outages
    places = named_places(scenario)

    def chart(more: Mapping[str, Track]) -> str:
        tracks = {**own, **{name: _thin(track) for name, track in more.items()}}
        green = style.COLORS["truth"]
        colors = [style.css(style.tint(green) if tracks else green), *map(style.css, style.colors(list(tracks)))]
        return draw_map(time, state, tracks, colors, ellipsoid, outages=outages, places=places)

    return chart


def _thin(track: Track) -> Track:
    k = thinned(len(track.time), _MAP_ROWS)
    return Places(track.time[k], track.latitude[k], track.longitude[k])


def _map_and_facts(scenario: Scenario, motion: Truth) -> str:
    """Return the map of the tracks, and the table of the motion's facts beside it."""
    time, truth, trajectory = motion.time, motion.state, motion.trajectory
    velocity = truth.velocity_ned
    roll, pitch, _ = (angle / units.DEG for angle in rotation.euler_from_quaternion(truth.q_nb))
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    distance = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
    facts = [
        ("duration", duration_words(float(time[-1] - time[0]))),
        ("distance over ground (∫ ground speed dt)", f"{distance / 1e3:.3f} km"),
        ("start", place_text(truth, 0)),
        ("end", place_text(truth, -1)),
        ("height above the ellipsoid", between_text(truth.height, 1, "m")),
        ("ground speed", between_text(speed, 1, "m/s")),
        ("vertical speed, up", between_text(-velocity[:, 2], 1, "m/s")),
        ("roll", between_text(roll, 1, "°")),
        ("pitch", between_text(pitch, 1, "°")),
        ("gravity, ellipsoid", f"{trajectory.gravity}, {trajectory.ellipsoid.name}"),
    ]
    facts += [(kind, words(text)) for kind, text in _source(scenario)]
    listed = table(
        ("true motion of the sensor block", ""), [(words(k), f'<td class="text">{v}</td>') for k, v in facts]
    )
    return (
        f'<div class="pair"><div>{MAP}<p class="note">Azimuthal equidistant projection about the middle of '
        "the true track, where the axes point east and north. Dotted: meridians and parallels.</p></div>"
        f"<div>{listed}</div></div>"
    )


def motion_plots(
    time: Array, truth: NavState, marks: Sequence[Mark], angles: str | None, airspeed: Channel | None = None
) -> Iterator[str]:
    """Yield height, speed and attitude over time.

    Args:
        time: (N,) s.
        angles: range of the heading, or "continuous"; None for 0…360°.
        airspeed: logged airspeed, if there is one.
    """
    velocity = truth.velocity_ned
    roll, pitch, heading = rotation.euler_from_quaternion(truth.q_nb)
    roll, pitch = roll / units.DEG, pitch / units.DEG
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    orange, green, blue = map(style.css, style.colors(("x", "y", "z")))
    span = (float(time[0]), float(time[-1]))
    speeds = [Line("ground speed", time, speed, green)]
    if airspeed is not None and airspeed.values.ndim == 1 and len(airspeed.time) > 1:
        speeds.append(Line("true airspeed", airspeed.time, airspeed.values, orange, 1.5, "6 6"))
    attitude = [Line("roll", time, roll, orange, turn=360.0), Line("pitch", time, pitch, blue)]
    yield '<div class="pair">'
    height = Line("height", time, truth.height, green)
    yield plot.plot("Height above the ellipsoid", "m", [height], span, marks=marks, least=1e-3)
    yield plot.plot("Speed", "m/s", speeds, span, marks=marks, least=1e-3)
    around = (-180.0, 180.0, 90.0) if np.abs(roll).max() > 120.0 else None
    yield plot.plot("Roll and pitch", "deg", attitude, span, marks=marks, least=1e-3, axis=around)
    shown, counted = rotation.shown_heading(angles, heading) / units.DEG, angles == "continuous"
    turning = Line("heading", time, shown, green, turn=0.0 if counted else 360.0)
    least = rotation.HEADING_RANGES["0..360" if counted else angles or "0..360"] / units.DEG
    axis = None if counted else (least, least + 360.0, 90.0)
    yield plot.plot("Heading", "deg", [turning], span, marks=marks, axis=axis, least=1e-3)
    yield "</div>"


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
    for name in ("parked", "great_circle", "motion", "drive", "voyage", "turntable"):
        section = getattr(scenario, name)
        if section is not None:
            legs = f"{len(section.legs)} legs, see below; " if name in _BY_LEGS else ""
            yield name.replace("_", " "), legs + given(section, "legs")
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
    plan = next((one for name in ("flight", *_BY_LEGS) if (one := getattr(scenario, name)) is not None), None)
    for i, leg in enumerate(() if plan is None else plan.legs, start=1):
        times = {}
        for edge in ("begins", "ends"):
            found = next((e for e in events if e[1] == f"leg {i} ({leg.type}) {edge}"), None)
            if found is not None:
                times[edge] = found[0]
                events.remove(found)
        if "begins" in times:
            settings = "; ".join(part for part in (leg_words(leg), *route_words(leg)) if part)
            legs.append((leg.type, settings, times["begins"], times.get("ends")))
    return legs, events


def place_text(truth: NavState, row: int) -> str:
    lat, lon, height = (float(v[row]) for v in (truth.latitude, truth.longitude, truth.height))
    height = round(height, 1) + 0.0  # no negative zero
    return f"{degrees(lat / units.DEG, 'NS', 5)} {degrees(lon / units.DEG, 'EW', 5)}, {height:.1f}\u00a0m"


def between_text(values: Array, places: int, unit: str) -> str:
    rounded = (round(float(v), places) + 0.0 for v in (values.min(), values.max()))  # + 0.0: no negative zero
    low, high = (f"{v:.{places}f}".replace("-", "−") for v in rounded)
    blank = "" if unit == "°" else " "
    return f"{low}{blank}{unit}" if low == high else f"{low} … {high}{blank}{unit}"
