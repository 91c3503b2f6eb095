"""The motion of a run: its map, facts, height, speed and attitude over time, legs and events.

A map has places on a plane, with meridians and parallels, instants, outages and waypoints. The projection is azimuthal
equidistant about the middle of the first track, so that it works over the poles and the date line. Angles between the
ellipsoid's normals are converted to distances with the radii of curvature at the middle, which is exact near it and in
error by up to one percent on the other side of the Earth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.charts import PAIR, Axis, Chart, Charts, Color, Dash, Dots, Line, Mark, Remark, Rule, Weight, over
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.geodetic_coordinates import radii
from sinssim.exhibits import Column, Item, Section, Table
from sinssim.recording import style
from sinssim.recording.style import thinned, tick_label, time_ticks
from sinssim.scenario.plan_summary import field_words, given, leg_words, named_places, route_words, values_of
from sinssim.units import DEG, duration_words, fixed

if TYPE_CHECKING:
    from sinssim.data import NavSolution
    from sinssim.scenario import Scenario
    from sinssim.simulation.truth_and_sensors import Truth
    from sinssim.truth.sampling import Channel
    from sinssim.truth.trajectory import Trajectory


_ROWS = 4096
"""Maximum number of points drawn of a track."""
_WIDTH, _HEIGHT = 488.0, 420.0
"""Size of the map for which its words are placed, px."""
_NAME_LETTER, _NAME_HEIGHT = 5.6, 14.0  # width of a letter of a name, and its height, px
_LEAST = 100.0
"""Least extent of a map, m."""
_WIDEST, _FAR = 2.0, 10_000.0
"""Factor of the true track's extent up to which a solution widens the map; at least 10 km."""
_GRATICULES = (30.0, 20.0, 10.0, 5.0, 2.0, 1.0, 30 / 60, 20 / 60, 10 / 60, 5 / 60, 2 / 60, 1 / 60)  # deg
_DASHES: tuple[Dash, ...] = ("", "--", ":")
"""So that solutions on the same track do not hide one another; more than three are all solid."""
_OUTAGE = style.tint(style.COLORS["refused"])
NOTE = (
    "Azimuthal equidistant projection about the middle of the {} track, where the axes point east and north. Dotted: "
    "meridians and parallels."
)


class Places(Protocol):
    """Latitudes and longitudes, (N,) rad."""

    @property
    def latitude(self) -> Array: ...
    @property
    def longitude(self) -> Array: ...


@dataclass(frozen=True, eq=False)
class Track:
    """A track of a map, thinned to the points that it shows.

    Attributes:
        name: in the legend.
        time: (N,) s.
        latitude, longitude: (N,) rad.
        color: its colour.
    """

    name: str
    time: Array
    latitude: Array
    longitude: Array
    color: Color = ""

    @classmethod
    def of(cls, name: str, time: Array, places: Places, color: Color = "") -> Track:
        """Return the track of a motion or a solution, without the rows at which its place is not known."""
        rows = thinned(len(time), 4 * _ROWS)
        rows = rows[np.isfinite(places.latitude[rows] + places.longitude[rows])]
        return cls(name, time[rows], places.latitude[rows], places.longitude[rows], color)


@dataclass(frozen=True)
class Projection:
    """Azimuthal equidistant about a place.

    Attributes:
        latitude, longitude: the place, rad.
        ellipsoid: reference ellipsoid.
    """

    latitude: float
    longitude: float
    ellipsoid: Ellipsoid

    def _axes(self) -> tuple[Array, Array, Array]:
        """East, north and up at the place, in Earth-fixed axes."""
        s, c = np.sin(self.latitude), np.cos(self.latitude)
        sl, cl = np.sin(self.longitude), np.cos(self.longitude)
        return np.array([-sl, cl, 0.0]), np.array([-s * cl, -s * sl, c]), np.array([c * cl, c * sl, s])

    def _radii(self) -> tuple[float, float]:
        r1, r2 = radii(self.latitude, self.ellipsoid)
        return float(r1), float(r2)

    def plane(self, latitude: Array, longitude: Array) -> tuple[Array, Array]:
        """Return the map coordinates of places, (N,) rad each: east and north, (N,) m."""
        east, north, up = self._axes()
        normal = _normals(latitude, longitude)
        e, n, u = normal @ east, normal @ north, normal @ up
        sine = np.hypot(e, n)
        stretch = np.where(sine > 1e-12, np.arctan2(sine, u) / np.maximum(sine, 1e-12), 1.0)
        r1, r2 = self._radii()
        return r2 * stretch * e, r1 * stretch * n

    def place(self, east: Array, north: Array) -> tuple[Array, Array]:
        """Return latitude and longitude, (N,) rad, of points on the map, (N,) m, within π of the middle."""
        r1, r2 = self._radii()
        e, n = east / r2, north / r1
        angle = np.hypot(e, n)
        shrink = np.sinc(angle / np.pi)
        axes = self._axes()
        normal = np.outer(e * shrink, axes[0]) + np.outer(n * shrink, axes[1]) + np.outer(np.cos(angle), axes[2])
        longitude = np.arctan2(normal[:, 1], normal[:, 0])
        turned = (longitude - self.longitude + np.pi) % (2.0 * np.pi) - np.pi
        return np.arctan2(normal[:, 2], np.hypot(normal[:, 0], normal[:, 1])), self.longitude + turned


def _normals(latitude: Array, longitude: Array) -> Array:
    c = np.cos(latitude)
    return np.column_stack((c * np.cos(longitude), c * np.sin(longitude), np.sin(latitude)))


@dataclass(frozen=True)
class _Frame:
    """The drawn part of the plane: `scale` px per m, and the edges in m."""

    scale: float
    west: float
    north: float

    @property
    def width(self) -> float:
        return _WIDTH / self.scale

    @property
    def height(self) -> float:
        return _HEIGHT / self.scale

    def pixels(self, east: Array, north: Array) -> tuple[Array, Array]:
        return (east - self.west) * self.scale, (self.north - north) * self.scale

    def shows(self, east: Array, north: Array) -> NDArray[np.bool_]:
        """Return which points are on the map."""
        x, y = self.pixels(east, north)
        return (x > 0.0) & (x < _WIDTH) & (y > 0.0) & (y < _HEIGHT)


def track_map(
    tracks: Sequence[Track],
    ellipsoid: Ellipsoid,
    *,
    outages: Sequence[tuple[float, float]] = (),
    places: Sequence[tuple[str, float, float]] = (),
    legs: Sequence[tuple[str, float]] = (),
    note: str = "",
) -> Charts:
    """Return the map of the motion and of solutions that are not far from it.

    Outages, s, are marked on the motion. Places have a name with latitude and longitude, rad; legs have a name with an
    instant, s, which is marked instead of round times.
    """
    motion, *solutions = tracks
    up = _normals(motion.latitude, motion.longitude)
    middle = up.min(axis=0) + up.max(axis=0)
    projection = Projection(
        float(np.arctan2(middle[2], np.hypot(middle[0], middle[1]))), float(np.arctan2(middle[1], middle[0])), ellipsoid
    )
    lines = []
    for track in tracks:
        k = thinned(len(track.time), _ROWS)
        lines.append(projection.plane(track.latitude[k], track.longitude[k]))
    frame = _frame(*_shown(*lines[0], lines[1:]))
    dashes: list[Dash] = ["", *_DASHES[: len(solutions)]]
    dashes = dashes if len(dashes) == len(tracks) else [""] * len(tracks)
    marks: list[Mark] = list(_graticule(projection, frame))
    for number, span in enumerate(_within(motion, outages)):
        label = "" if number else "no GNSS"
        marks.append(_line(label, *projection.plane(*span), frame, _OUTAGE, "broad"))
    for track, line, dash in zip(tracks, lines, dashes, strict=True):
        weight: Weight = "wide" if track is motion and solutions else "line"
        label = track.name if solutions or outages else ""
        time = track.time[thinned(len(track.time), _ROWS)] if track is motion else None
        marks.append(_line(label, *line, frame, track.color, weight, dash, time))
    marks += [*_waypoints(places, projection, frame), *_instants(motion, projection, frame, legs)]
    unit = fixed("km", 1e3) if frame.width > 2000.0 else fixed("m")
    chart = Chart(
        key="map", x=Axis(label="east", units=unit, low=frame.west, high=frame.west + frame.width),
        y=Axis(label="north", units=unit, low=frame.north - frame.height, high=frame.north), marks=tuple(marks),
        equal=True,
    )  # fmt: skip
    return Charts("map", ((chart,),), (0.5 * PAIR[0], 5.6), note=note, on=("page",))


def _line(
    label: str, east: Array, north: Array, frame: _Frame, color: Color, weight: Weight = "line", dash: Dash = "",
    time: Array | None = None,
) -> Line:  # fmt: skip
    """Return a line without the points that lie within half a pixel of the previous one; `time` is at its points."""
    x, y = frame.pixels(east, north)
    steps = np.concatenate(([0.0], np.hypot(np.diff(x), np.diff(y)).cumsum()))
    seen = np.concatenate(([True], np.diff(np.floor(steps / 1.5)) > 0))
    seen[-1:] = True
    line = Line(label=label, x=east[seen], y=north[seen], color=color, weight=weight, dash=dash)
    return line if time is None else replace(line, time=time[seen])


def _within(track: Track, spans: Sequence[tuple[float, float]]) -> Iterator[tuple[Array, Array]]:
    """Yield the latitudes and longitudes of a track within spans of time."""
    for begin, end in spans:
        first, last = np.searchsorted(track.time, (begin, end))
        if last - first > 1:
            rows = first + thinned(int(last - first), _ROWS)
            yield track.latitude[rows], track.longitude[rows]


def _shown(east: Array, north: Array, lines: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the points of the motion, and those of the solutions near enough to it."""
    far = max(_WIDEST * float(np.hypot(east, north).max()), _FAR)
    near = [np.hypot(*line) <= far for line in lines]
    return (
        np.concatenate([east, *(line[0][rows] for line, rows in zip(lines, near, strict=True))]),
        np.concatenate([north, *(line[1][rows] for line, rows in zip(lines, near, strict=True))]),
    )


def _frame(east: Array, north: Array) -> _Frame:
    """Return the frame that shows all points with a margin, equally scaled in both directions."""
    extent = max(float(np.ptp(east)) / _WIDTH, float(np.ptp(north)) / _HEIGHT) * 1.16
    per_pixel = max(extent, _LEAST / min(_WIDTH, _HEIGHT))
    west = 0.5 * float(east.min() + east.max()) - 0.5 * per_pixel * _WIDTH
    top = 0.5 * float(north.min() + north.max()) + 0.5 * per_pixel * _HEIGHT
    return _Frame(1.0 / per_pixel, west, top)


def _graticule(projection: Projection, frame: _Frame) -> Iterator[Mark]:
    """Yield parallels and meridians with their names."""
    e, n = np.meshgrid(np.linspace(0.0, frame.width, 61), np.linspace(0.0, frame.height, 61))
    lat, lon = (v / DEG for v in projection.place((frame.west + e).ravel(), (frame.north - n).ravel()))
    low, high = lat.min(), lat.max()
    visible = frame.shows(*projection.plane(np.array([0.5, -0.5]) * np.pi, np.zeros(2)))
    poles = visible & np.array([high > 0.0, low < 0.0])  # the point opposite to the middle is projected onto the middle
    polar = bool(poles.any())
    across = np.linspace(lon.min(), lon.max(), 241) if not polar else np.linspace(-180.0, 180.0, 361)
    along = np.linspace(low, 90.0 if poles[0] else high, 241) if not poles[1] else np.linspace(-90.0, high, 241)
    meridians = np.arange(-180.0, 180.0, 30.0) if polar else _round(float(lon.min()), float(lon.max()))
    taken: list[tuple[float, float, float]] = []
    for value in _round(low, high):
        line = projection.plane(np.full(len(across), value) * DEG, across * DEG)
        yield from _circle(*line, frame, degrees(value, "NS"), lambda x, _: int(np.argmin(x)), taken)

    def lower(_: Array, y: Array) -> int:
        """Return the lower end of a meridian or, if a pole is visible, the end away from the pole."""
        return 0 if poles[0] else len(y) - 1 if poles[1] else int(np.argmax(y))

    for value in meridians:
        line = projection.plane(along * DEG, np.full(len(along), value) * DEG)
        yield from _circle(*line, frame, degrees((value + 180.0) % 360.0 - 180.0, "EW"), lower, taken)


def _round(low: float, high: float) -> Array:
    """Return round angles within a range, deg."""
    step = next((s for s in _GRATICULES if high - low >= 3.0 * s), _GRATICULES[-1])
    return step * np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)


def _circle(
    east: Array,
    north: Array,
    frame: _Frame,
    name: str,
    where: Callable[[Array, Array], int],
    taken: list[tuple[float, float, float]],
) -> Iterator[Mark]:
    """Yield a parallel or a meridian, with its name at one of its points on the map where no other name is.

    The places of the names, their left and right ends and baselines, px, are added to `taken`.
    """
    x, y = frame.pixels(east, north)
    near = (x > -_WIDTH) & (x < 2.0 * _WIDTH) & (y > -_HEIGHT) & (y < 2.0 * _HEIGHT)
    shown = np.flatnonzero((x > 0.0) & (x < _WIDTH) & (y > 14.0) & (y < _HEIGHT))
    if not len(shown):
        return
    edge = shown[where(x[shown], y[shown])]
    yield _line("", east[near], north[near], frame, "faint", "hair", ":")
    left_of = float(x[edge]) > _WIDTH - 40.0
    place = float(x[edge]) + (-3.0 if left_of else 3.0)
    base, long = float(y[edge]) - 3, _NAME_LETTER * len(name)
    left = place - long if left_of else place
    if any(left < end and begin < left + long and abs(base - other) < 11.0 for begin, end, other in taken):
        return
    taken.append((left, left + long, base))
    yield Remark(x=float(east[edge]), y=float(north[edge]), text=name, left=left_of, soft=True)


def degrees(value: float, signs: str, places: int | None = None) -> str:
    """Write an angle, deg, with its hemisphere, of "NS" or "EW": "49°30′N", or with decimal `places` "49.50000°N"."""
    side = signs[0] if value >= 0.0 else signs[1]
    if places is not None:
        return f"{abs(value):.{places}f}°{side}"
    minutes = round(abs(value) * 60.0)
    return f"{minutes // 60}°" + (f"{minutes % 60:02d}′" if minutes % 60 else "") + (side if minutes % 10800 else "")


def _instants(
    motion: Track, projection: Projection, frame: _Frame, legs: Sequence[tuple[str, float]] = ()
) -> Iterator[Mark]:
    """Yield dots along a track at round times or at the instants of legs, at its start and at its end."""
    time = motion.time
    at, step, unit, size = time_ticks(float(time[0]), float(time[-1]))
    at = at[(at * size > time[0]) & (at * size < time[-1])]
    inner = [instant for _, instant in legs] or at * size
    k = np.searchsorted(time, np.concatenate(([time[0]], inner, [time[-1]]))).clip(max=len(time) - 1)
    east, north = projection.plane(motion.latitude[k], motion.longitude[k])
    x, y = frame.pixels(east, north)
    if np.hypot(np.ptp(x), np.ptp(y)) < 20.0:
        yield Dots(x=east[:1], y=north[:1], color="ink", size=6.75)
        return
    names = ["start", *([name for name, _ in legs] or (tick_label(t, step) for t in at)), "end"]
    if len(at) and not legs:
        names[1] += f" {unit}"
    yield Dots(x=east[[0, -1]], y=north[[0, -1]], color="ink", size=6.75)
    yield Dots(x=east[1:-1], y=north[1:-1], color="ink", size=3.9)
    taken: list[tuple[float, float]] = []
    for i in [0, len(k) - 1, *range(1, len(k) - 1)]:
        a, b = float(x[i]), float(y[i])
        if all(abs(a - c) > 30.0 or abs(b - d) > 14.0 for c, d in taken):
            taken.append((a, b))
            yield Remark(x=float(east[i]), y=float(north[i]), text=names[i], left=a >= _WIDTH - 50.0)


def _waypoints(places: Sequence[tuple[str, float, float]], projection: Projection, frame: _Frame) -> Iterator[Mark]:
    """Yield a diamond and the name of each waypoint on the map, below it on a side where it meets no other name."""
    shown = []
    for name, latitude, longitude in places:
        east, north = projection.plane(np.array([latitude]), np.array([longitude]))
        if frame.shows(east, north)[0]:
            x, y = frame.pixels(east, north)
            shown.append((name, east, north, float(x[0]), float(y[0])))
    for (name, east, north, *_), left in zip(shown, _sides([(len(n), x, y) for n, _, _, x, y in shown]), strict=True):
        yield Line(x=east, y=north, color="ink", marker="D", hollow=True)
        yield Remark(x=float(east[0]), y=float(north[0]), text=name, left=left, below=True)


def _sides(names: Sequence[tuple[int, float, float]]) -> list[bool]:
    """Return which names, with a number of letters and a place, px, stand to the left of it: those beside the right
    edge, and those that would meet another name to the right."""
    sides, taken = [False] * len(names), list[tuple[float, float, float]]()
    at_edge = [x >= _WIDTH - 8.0 * letters - 8.0 for letters, x, _ in names]
    for k in sorted(range(len(names)), key=lambda k: not at_edge[k]):  # those without a choice first
        letters, x, y = names[k]
        width = 8.0 * letters
        near = [(begin, end) for begin, end, other in taken if abs(y - other) < _NAME_HEIGHT]
        right, left = (not any(a < end and begin < a + width for begin, end in near) for a in (x, x - width))
        sides[k] = at_edge[k] or (not right and left and x > width)
        begin = x - width if sides[k] else x
        taken.append((begin, begin + width, y))
    return sides


_BY_LEGS = ("drive", "voyage")


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
) -> Charts:
    """Return the map with the true track, those of the solutions, and places with a name, latitude and longitude."""
    motion = replace(motion, color=style.tint(style.COLORS["truth"]) if solutions else "truth")
    outages = () if scenario.aiding is None else scenario.aiding.outages
    note = NOTE.format("true")
    places = [*named_places(scenario), *places]
    return track_map([motion, *solutions], ellipsoid, outages=outages, places=places, note=note)


def motion_facts(scenario: Scenario, truth: Truth) -> Table:
    """Return what a motion is in a few numbers, and its source."""
    trajectory, state = truth.trajectory, truth.state
    roll, pitch, _ = (angle / DEG for angle in rotation.euler_from_quaternion(state.q_nb))
    speed = ground_speed(state)
    facts = [
        ("duration", duration_words(float(truth.time[-1] - truth.time[0]))),
        ("distance over ground (∫ ground speed dt)", distance_text(truth.time, speed)),
        ("start", place_text(state, 0)),
        ("end", place_text(state, -1)),
        ("height above the ellipsoid", between_text(state.height, 1, "m")),
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
    metres, speeds = Axis(units=fixed("m"), least=1e-3), Axis(units=fixed("m/s"), least=1e-3)
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
        (chart("height", "Height above the ellipsoid", metres, Line(label="height", x=time, y=state.height, color="y")),
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
    plan = next((section for name in ("flight", *_BY_LEGS) if (section := getattr(scenario, name)) is not None), None)
    for i, leg in enumerate(() if plan is None else plan.legs, start=1):
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
