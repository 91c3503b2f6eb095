"""The map of a run as SVG: tracks in kilometres about their middle, over meridians and parallels.

The projection is azimuthal equidistant about the middle of the true track, so that it works over the poles and the date
line. Angles between the ellipsoid's normals are converted to distances with the radii of curvature at the middle, which
is exact near it and in error by up to one percent on the other side of the Earth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sinssim.data import Array, NavState
from sinssim.earth.coordinates import radii
from sinssim.earth.models import Ellipsoid
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.scales import thinned, tick_label, ticks, time_ticks
from sinssim.units import DEG

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
    dashes = ["", *plot.dashes(len(tracks))]
    nowhere = np.empty(0)
    entries = list(zip((name, *tracks), colors, widths, dashes, strict=True))
    parts = [projection.plane(*part) for part in _within(time, truth, outages)]
    if parts:
        entries.append(("no GNSS", _OUTAGE, _OUTAGE_WIDTH, ""))
    legend, top = plot.legend([plot.Line(n, nowhere, nowhere, c, w, d) for n, c, w, d in entries], width, 15)
    top += _TOP
    bottom = top + height
    x = [_LEFT + (v * size - frame.west) * frame.scale for v in at_e]
    y = [top + (frame.north - v * size) * frame.scale for v in at_n]
    body = [legend, plot.segments(x, [top] * len(x), x, [bottom] * len(x), "grid")]
    body.append(plot.segments([_LEFT] * len(y), y, [_LEFT + inner] * len(y), y, "grid"))
    body += [plot.text(_LEFT - 6, b + 4, tick_label(v, step_n), "end", "soft") for v, b in zip(at_n, y, strict=True)]
    body += [plot.text(a, bottom + 15, tick_label(v, step_e), "middle", "soft") for v, a in zip(at_e, x, strict=True)]
    body.append(plot.text(_LEFT + inner, bottom + 32, f"east [{unit}]", "end", "soft"))
    body.append(plot.text(14, top, f"north [{unit}]", "end", "soft", f'transform="rotate(-90 14 {top})"'))
    body.append(f'<svg x="{_LEFT}" y="{top}" width="{inner}" height="{height}">')
    body.append(_graticule(projection, frame))
    body += [plot.path(*_sparse(*frame.pixels(*part)), _OUTAGE, _OUTAGE_WIDTH) for part in parts]
    body.append(plot.path(*_sparse(*frame.pixels(east, north)), colors[0], widths[0]))
    for line, color, thick, dashed in zip(lines, colors[1:], widths[1:], dashes[1:], strict=True):
        if len(line[0]):
            body.append(plot.path(*_sparse(*frame.pixels(*line)), color, thick, dashed))
    body += _waypoints(places, projection, frame)
    body += _instants(time, truth, projection, frame)
    body.append("</svg>")
    body.append(plot.segments([_LEFT, _LEFT], [top, bottom], [_LEFT, _LEFT + inner], [bottom, bottom], "axis"))
    return plot.element(width, bottom + _BOTTOM, "map of the track", "".join(body))


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
    line = plot.path(*_sparse(x[near], y[near]), "#ccc", 0.8, "1 3").replace("<polyline", '<polyline class="graticule"')
    right = float(x[edge]) > width - 40.0
    place = float(x[edge]) + (-3.0 if right else 3.0)
    base, long = float(y[edge]) - 3, _NAME_LETTER * len(name)
    left = place - long if right else place
    if any(left < end and begin < left + long and abs(base - other) < 11.0 for begin, end, other in taken):
        return line
    taken.append((left, left + long, base))
    return line + plot.text(place, base, name, "end" if right else "start", "soft over", 'font-size="10"')


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
            body.append(plot.text(a + (7 if right else -7), b - 6, names[i], "start" if right else "end", "over"))
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
            body.append(plot.path(*corners, "#1c1c1c", 1.5))
            body.append(plot.text(x + (7 if right else -7), y + 15, name, "start" if right else "end", "over"))
    return body


def _dot(x: float, y: float, radius: float) -> str:
    return f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="#1c1c1c" stroke="#fff"/>'
