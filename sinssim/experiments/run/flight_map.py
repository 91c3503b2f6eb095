"""The true motion of a run: the map with its tracks, plots, and the table of legs.

The map's projection is azimuthal equidistant about the middle of the true track, so that it works over the poles and
the date line. Angles between the ellipsoid's normals are converted to distances with the radii of curvature at the
middle, which is exact near it and in error by up to one percent on the other side of the Earth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.geodetic_coordinates import radii
from sinssim.recording import style
from sinssim.recording.report import svg_plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.svg_plot import Line, Mark
from sinssim.recording.style import thinned, tick_label, ticks, time_ticks
from sinssim.scenario.plan_summary import field_words, given, leg_words, named_places, route_words, values_of
from sinssim.units import DEG, duration_words

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.simulation.truth_stage import Truth
    from sinssim.truth.sampling import Channel
    from sinssim.truth.trajectory import Trajectory


STYLE = ".dot { fill: var(--ink); stroke: var(--paper); } .graticule { stroke: var(--line); }\n"

_ROWS = 4096
_NAME_LETTER = 5.6  # width of a letter of a name, px
"""Maximum number of points drawn of a track."""
_LEFT, _TOP, _BOTTOM, _RIGHT = 64, 8, 38, 8
_OUTAGE, _OUTAGE_WIDTH = style.css(style.tint(style.COLORS["refused"])), 11.0
"""Colour and width, px, of the mark of an outage under the track."""
_LEAST = 100.0
"""Least extent of a map, m."""
_WIDEST, _FAR = 2.0, 10_000.0
"""Factor of the true track's extent up to which a solution widens the map; at least 10 km."""
_GRATICULES = (30.0, 20.0, 10.0, 5.0, 2.0, 1.0, 30 / 60, 20 / 60, 10 / 60, 5 / 60, 2 / 60, 1 / 60)  # deg


class Track(Protocol):
    """Places over time.

    Attributes:
        time: (N,) s.
        latitude, longitude: (N,) rad.
    """

    @property
    def time(self) -> Array: ...
    @property
    def latitude(self) -> Array: ...
    @property
    def longitude(self) -> Array: ...


@dataclass(frozen=True)
class Places:
    """A track of its own, see `Track`."""

    time: Array
    latitude: Array
    longitude: Array


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
        """Return the map coordinates of places.

        Args:
            latitude, longitude: (N,) rad.

        Returns:
            East and north, (N,) m each.
        """
        east, north, up = self._axes()
        normal = _normals(latitude, longitude)
        e, n, u = normal @ east, normal @ north, normal @ up
        sine = np.hypot(e, n)
        stretch = np.where(sine > 1e-12, np.arctan2(sine, u) / np.maximum(sine, 1e-12), 1.0)
        r1, r2 = self._radii()
        return r2 * stretch * e, r1 * stretch * n

    def place(self, east: Array, north: Array) -> tuple[Array, Array]:
        """Return the places of points on the map.

        Args:
            east, north: (N,) m.

        Returns:
            Latitude and longitude, (N,) rad; the longitude is within π of that of the middle.
        """
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
    """The drawn part of the plane: `scale` px per m, and the north-west corner in m."""

    scale: float
    west: float
    north: float
    width: float
    height: float

    def pixels(self, east: Array, north: Array) -> tuple[Array, Array]:
        return (east - self.west) * self.scale, (self.north - north) * self.scale


# Long: the drawing is written from frame to lines, in the order of their layers.
def draw_map(
    time: Array,
    truth: NavState,
    tracks: Mapping[str, Track],
    colors: Sequence[str],
    ellipsoid: Ellipsoid,
    *,
    width: int = 560,
    height: int = 420,
    name: str = "truth",
    outages: Sequence[tuple[float, float]] = (),
    places: Sequence[tuple[str, float, float]] = (),
) -> str:
    """Draw the true track and the tracks of the solutions.

    Args:
        time: (N,) s.
        tracks: solutions by algorithm; the map includes them unless they are far from the true track.
        colors: of the true track and of each algorithm's.
        width, height: of the map without its labels, px.
        name: of the first track, if it is not the true one.
        outages: spans without satellites, s, marked on the first track.
        places: names of waypoints with latitude and longitude, rad.
    """
    rows = thinned(len(time), _ROWS)
    lat, lon = truth.latitude[rows], truth.longitude[rows]
    up = _normals(lat, lon)
    middle = up.min(axis=0) + up.max(axis=0)
    projection = Projection(
        float(np.arctan2(middle[2], np.hypot(middle[0], middle[1]))), float(np.arctan2(middle[1], middle[0])), ellipsoid
    )
    inner = width - _LEFT - _RIGHT
    east, north = projection.plane(lat, lon)
    lines = []
    for solution in tracks.values():
        k = thinned(len(solution.time), _ROWS)
        k = k[np.isfinite(solution.latitude[k] + solution.longitude[k])]
        lines.append(projection.plane(solution.latitude[k], solution.longitude[k]))
    frame = _frame(*_shown(east, north, lines), inner, height)
    size, unit = (1000.0, "km") if frame.width > 2000.0 else (1.0, "m")
    at_e, step_e = ticks(frame.west / size, (frame.west + frame.width) / size, 7)
    at_n, step_n = ticks((frame.north - frame.height) / size, frame.north / size, 7)
    widths = [6.0 if tracks else 2.0, *[1.8] * len(tracks)]
    dashes = ["", *svg_plot.dashes(len(tracks))]
    nowhere = np.empty(0)
    entries = list(zip((name, *tracks), colors, widths, dashes, strict=True))
    parts = [projection.plane(*part) for part in _within(time, truth, outages)]
    if parts:
        entries.append(("no GNSS", _OUTAGE, _OUTAGE_WIDTH, ""))
    legend, top = svg_plot.legend([svg_plot.Line(n, nowhere, nowhere, c, w, d) for n, c, w, d in entries], width, 15)
    top += _TOP
    bottom = top + height
    x = [_LEFT + (v * size - frame.west) * frame.scale for v in at_e]
    y = [top + (frame.north - v * size) * frame.scale for v in at_n]
    body = [legend, svg_plot.segments(x, [top] * len(x), x, [bottom] * len(x), "grid")]
    body.append(svg_plot.segments([_LEFT] * len(y), y, [_LEFT + inner] * len(y), y, "grid"))
    body += [
        svg_plot.text(_LEFT - 6, b + 4, tick_label(v, step_n), "end", "soft") for v, b in zip(at_n, y, strict=True)
    ]
    body += [
        svg_plot.text(a, bottom + 15, tick_label(v, step_e), "middle", "soft") for v, a in zip(at_e, x, strict=True)
    ]
    body.append(svg_plot.text(_LEFT + inner, bottom + 32, f"east [{unit}]", "end", "soft"))
    body.append(svg_plot.text(14, top, f"north [{unit}]", "end", "soft", f'transform="rotate(-90 14 {top})"'))
    body.append(f'<svg x="{_LEFT}" y="{top}" width="{inner}" height="{height}">')
    body.append(_graticule(projection, frame))
    body += [svg_plot.path(*_sparse(*frame.pixels(*part)), _OUTAGE, _OUTAGE_WIDTH) for part in parts]
    body.append(svg_plot.path(*_sparse(*frame.pixels(east, north)), colors[0], widths[0]))
    for line, color, thick, dashed in zip(lines, colors[1:], widths[1:], dashes[1:], strict=True):
        if len(line[0]):
            body.append(svg_plot.path(*_sparse(*frame.pixels(*line)), color, thick, dashed))
    body += _waypoints(places, projection, frame)
    body += _instants(time, truth, projection, frame)
    body.append("</svg>")
    body.append(svg_plot.segments([_LEFT, _LEFT], [top, bottom], [_LEFT, _LEFT + inner], [bottom, bottom], "axis"))
    return svg_plot.element(width, bottom + _BOTTOM, "map of the track", "".join(body))


def _within(time: Array, truth: NavState, spans: Sequence[tuple[float, float]]) -> Iterator[tuple[Array, Array]]:
    """Yield the latitudes and longitudes of the track within spans of time."""
    for begin, end in spans:
        first, last = np.searchsorted(time, (begin, end))
        rows = first + thinned(int(last - first), _ROWS) if last - first > 1 else np.empty(0, np.intp)
        if len(rows):
            yield truth.latitude[rows], truth.longitude[rows]


def _sparse(x: Array, y: Array) -> tuple[Array, Array]:
    """Remove points that lie within half a pixel of the previous one."""
    steps = np.concatenate(([0.0], np.hypot(np.diff(x), np.diff(y)).cumsum()))
    keep = np.concatenate(([True], np.diff(np.floor(steps / 1.5)) > 0))
    keep[-1] = True
    return x[keep], y[keep]


def _shown(east: Array, north: Array, lines: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the points of the true track, and those of the solutions near enough to it."""
    far = max(_WIDEST * float(np.hypot(east, north).max()), _FAR)
    near = [np.hypot(*line) <= far for line in lines]
    return (
        np.concatenate([east, *(line[0][keep] for line, keep in zip(lines, near, strict=True))]),
        np.concatenate([north, *(line[1][keep] for line, keep in zip(lines, near, strict=True))]),
    )


def _frame(east: Array, north: Array, width: float, height: float) -> _Frame:
    """Return the frame that shows all points with a margin, equally scaled in both directions."""
    extent = max(float(np.ptp(east)) / width, float(np.ptp(north)) / height) * 1.16
    per_pixel = max(extent, _LEAST / min(width, height))
    wide, high = per_pixel * width, per_pixel * height
    west = 0.5 * float(east.min() + east.max()) - 0.5 * wide
    top = 0.5 * float(north.min() + north.max()) + 0.5 * high
    return _Frame(1.0 / per_pixel, west, top, wide, high)


def _graticule(projection: Projection, frame: _Frame) -> str:
    """Return parallels and meridians."""
    e, n = np.meshgrid(np.linspace(0.0, frame.width, 61), np.linspace(0.0, frame.height, 61))
    lat, lon = (v / DEG for v in projection.place((frame.west + e).ravel(), (frame.north - n).ravel()))
    low, high = lat.min(), lat.max()
    x, y = frame.pixels(*projection.plane(np.array([0.5, -0.5]) * np.pi, np.zeros(2)))
    poles = (x > 0.0) & (x < frame.width * frame.scale) & (y > 0.0) & (y < frame.height * frame.scale)
    poles &= np.array([high > 0.0, low < 0.0])  # the point opposite to the middle is projected onto the middle
    polar = bool(poles.any())
    across = np.linspace(lon.min(), lon.max(), 241) if not polar else np.linspace(-180.0, 180.0, 361)
    along = np.linspace(low, 90.0 if poles[0] else high, 241) if not poles[1] else np.linspace(-90.0, high, 241)
    parallels = _round(low, high)
    meridians = np.arange(-180.0, 180.0, 30.0) if polar else _round(float(lon.min()), float(lon.max()))
    body: list[str] = []
    taken: list[tuple[float, float, float]] = []
    for value in parallels:
        line = projection.plane(np.full(len(across), value) * DEG, across * DEG)
        body.append(_circle(*frame.pixels(*line), frame, degrees(value, "NS"), lambda x, _: int(np.argmin(x)), taken))

    def lower(_: Array, y: Array) -> int:
        """Return the lower end of a meridian or, if a pole is visible, the end away from the pole."""
        return 0 if poles[0] else len(y) - 1 if poles[1] else int(np.argmax(y))

    for value in meridians:
        line = projection.plane(along * DEG, np.full(len(along), value) * DEG)
        name = degrees((value + 180.0) % 360.0 - 180.0, "EW")
        body.append(_circle(*frame.pixels(*line), frame, name, lower, taken))
    return "".join(body)


def _round(low: float, high: float) -> Array:
    """Return round angles within a range, deg."""
    step = next((s for s in _GRATICULES if high - low >= 3.0 * s), _GRATICULES[-1])
    return step * np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)


def _circle(
    x: Array,
    y: Array,
    frame: _Frame,
    name: str,
    where: Callable[[Array, Array], int],
    taken: list[tuple[float, float, float]],
) -> str:
    """Return a parallel or a meridian, with its name at one of its points on the map where no other name is.

    The places of the names, their left and right ends and baselines, are added to `taken`.
    """
    width, height = frame.width * frame.scale, frame.height * frame.scale
    near = (x > -width) & (x < 2.0 * width) & (y > -height) & (y < 2.0 * height)
    shown = np.flatnonzero((x > 0.0) & (x < width) & (y > 14.0) & (y < height))
    if not len(shown):
        return ""
    edge = shown[where(x[shown], y[shown])]
    line = svg_plot.path(*_sparse(x[near], y[near]), "#ccc", 0.8, "1 3").replace(
        "<polyline", '<polyline class="graticule"'
    )
    right = float(x[edge]) > width - 40.0
    place = float(x[edge]) + (-3.0 if right else 3.0)
    base, long = float(y[edge]) - 3, _NAME_LETTER * len(name)
    left = place - long if right else place
    if any(left < end and begin < left + long and abs(base - other) < 11.0 for begin, end, other in taken):
        return line
    taken.append((left, left + long, base))
    return line + svg_plot.text(place, base, name, "end" if right else "start", "soft over", 'font-size="10"')


def degrees(value: float, signs: str, places: int | None = None) -> str:
    """Write an angle with its hemisphere.

    Args:
        value: deg.
        signs: "NS" or "EW".
        places: decimals of a degree; whole minutes if not given.

    Returns:
        For example "49°30′N" or "49.50000°N".
    """
    side = signs[0] if value >= 0.0 else signs[1]
    if places is not None:
        return f"{abs(value):.{places}f}°{side}"
    minutes = round(abs(value) * 60.0)
    return f"{minutes // 60}°" + (f"{minutes % 60:02d}′" if minutes % 60 else "") + (side if minutes % 10800 else "")


def _instants(time: Array, truth: NavState, projection: Projection, frame: _Frame) -> list[str]:
    """Return dots along the true track at round times, at its start and at its end."""
    at, step, unit, size = time_ticks(float(time[0]), float(time[-1]))
    at = at[(at * size > time[0]) & (at * size < time[-1])]
    k = np.searchsorted(time, np.concatenate(([time[0]], at * size, [time[-1]]))).clip(max=len(time) - 1)
    x, y = frame.pixels(*projection.plane(truth.latitude[k], truth.longitude[k]))
    if np.hypot(np.ptp(x), np.ptp(y)) < 20.0:
        return [_dot(float(x[0]), float(y[0]), 4.5)]
    names = ["start", *(tick_label(t, step) for t in at), "end"]
    if len(at):
        names[1] += f" {unit}"
    body = [
        _dot(float(a), float(b), 4.5 if i in (0, len(k) - 1) else 2.6)
        for i, (a, b) in enumerate(zip(x, y, strict=True))
    ]
    taken: list[tuple[float, float]] = []
    for i in [0, len(k) - 1, *range(1, len(k) - 1)]:
        a, b = float(x[i]), float(y[i])
        if all(abs(a - c) > 30.0 or abs(b - d) > 14.0 for c, d in taken):
            taken.append((a, b))
            right = a < frame.width * frame.scale - 50.0
            body.append(svg_plot.text(a + (7 if right else -7), b - 6, names[i], "start" if right else "end", "over"))
    return body


def _waypoints(places: Sequence[tuple[str, float, float]], projection: Projection, frame: _Frame) -> list[str]:
    """Return a diamond and the name of each waypoint on the map, below it to the right or the left."""
    body = []
    for name, latitude, longitude in places:
        x, y = (float(v[0]) for v in frame.pixels(*projection.plane(np.array([latitude]), np.array([longitude]))))
        wide, high = frame.width * frame.scale, frame.height * frame.scale
        if 0.0 <= x <= wide and 0.0 <= y <= high:
            corners = np.array([x, x + 5.0, x, x - 5.0, x]), np.array([y - 5.0, y, y + 5.0, y, y - 5.0])
            right = x < wide - 8.0 * len(name) - 8.0
            body.append(svg_plot.path(*corners, "#1c1c1c", 1.5))
            body.append(svg_plot.text(x + (7 if right else -7), y + 15, name, "start" if right else "end", "over"))
    return body


def _dot(x: float, y: float, radius: float) -> str:
    return f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="#1c1c1c" stroke="#fff"/>'


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
    yield svg_plot.plot("Height above the ellipsoid", "m", [height], span, marks=marks, least=1e-3)
    yield svg_plot.plot("Speed", "m/s", speeds, span, marks=marks, least=1e-3)
    around = (-180.0, 180.0, 90.0) if np.abs(roll).max() > 120.0 else None
    yield svg_plot.plot("Roll and pitch", "deg", attitude, span, marks=marks, least=1e-3, axis=around)
    shown, counted = rotation.shown_heading(angles, heading) / units.DEG, angles == "continuous"
    turning = Line("heading", time, shown, green, turn=0.0 if counted else 360.0)
    least = rotation.HEADING_RANGES["0..360" if counted else angles or "0..360"] / units.DEG
    axis = None if counted else (least, least + 360.0, 90.0)
    yield svg_plot.plot("Heading", "deg", [turning], span, marks=marks, axis=axis, least=1e-3)
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
