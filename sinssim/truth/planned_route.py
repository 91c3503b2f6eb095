"""A planned route: great-circle legs between waypoints, corners of continuous curvature, and the timetable along them.

A leg is a great circle of the ellipsoid's normal, as in `motions.parked_and_great_circle`. A corner is laid out in
the azimuthal equidistant projection of the normals about its waypoint, in which both legs are straight lines through
the middle, with the metres of the ellipsoid there to the north and to the east. Distances along the path are those of
the ground track at its height, found by quadrature, so that a planned speed is the ground speed. Heights change by a
smooth step of degree 9 from one waypoint to the next.

In the timetable, a change of speed is a smooth step of degree 7 in time, so that the distance is four times
continuously differentiable. Its largest acceleration is 35/16 of the mean one. The vehicle accelerates from a waypoint
on, and brakes ahead of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, pi, radians, tan
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.earth.ellipsoids import Ellipsoid, normal
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef, radii
from sinssim.errors import InputError
from sinssim.truth.route_waypoint import Corner, Waypoint, integrated_step7, turns_back
from sinssim.truth.vehicle_attitude import Vehicle
from sinssim.units import DEG, G0

_STRAIGHT = 1e-6
"""Turn below which a waypoint is passed straight on, rad."""
_LEG_PANEL = 20_000.0
"""Largest panel of the quadrature of the distance along a leg, m."""
_POINTS = 8


@dataclass(frozen=True)
class _Leg:
    """A great circle from `begin` to `begin + length` in nominal metres."""

    begin: float
    length: float
    start: Array  # normal at its start
    ahead: Array  # direction at its start
    radius: float  # nominal metres per radian

    def normals(self, along: Array) -> tuple[Array, Array]:
        """Return the normals at nominal distances from the beginning, and their derivatives, (N, 3)."""
        angle = (along / self.radius)[:, None]
        cosine, sine = np.cos(angle), np.sin(angle)
        return self.start * cosine + self.ahead * sine, (self.ahead * cosine - self.start * sine) / self.radius

    @property
    def edges(self) -> Array:
        """Panels of the quadrature, nominal distances from the beginning."""
        return np.linspace(0.0, self.length, max(16, int(np.ceil(self.length / _LEG_PANEL))) + 1)


@dataclass(frozen=True)
class _Turn:
    """A corner from `begin` to `begin + length` in metres at its waypoint."""

    begin: float
    corner: Corner
    start: Array  # normal at the waypoint
    ahead: Array  # turn of the normal per metre along the incoming leg, rad/m
    right: Array  # and to the right of it

    @property
    def length(self) -> float:
        return self.corner.length

    @property
    def edges(self) -> Array:
        return self.corner.edges

    def normals(self, along: Array) -> tuple[Array, Array]:
        """Return the normals at distances from the beginning, and their derivatives, (N, 3)."""
        x, y = np.moveaxis(self.corner.points(along), 1, 0)
        psi = self.corner.heading(along)
        out = (x - self.corner.tangent)[:, None] * self.ahead + y[:, None] * self.right
        change = np.cos(psi)[:, None] * self.ahead + np.sin(psi)[:, None] * self.right
        c = np.maximum(np.linalg.norm(out, axis=1), 1e-12)
        rate = np.einsum("ij,ij->i", out, change) / c
        sinc = np.sin(c) / c
        bend = np.where(c > 1e-4, (c * np.cos(c) - np.sin(c)) / c**2, -c / 3.0)  # d(sin c/c)/dc
        normal = self.start * np.cos(c)[:, None] + sinc[:, None] * out
        slope = (bend * rate)[:, None] * out + sinc[:, None] * change - (np.sin(c) * rate)[:, None] * self.start
        return normal, slope


class Route:
    """The path of a planned route by distance over ground.

    Args:
        waypoints: two or more.
        vehicle: what moves.
        ellipsoid: reference ellipsoid.

    Attributes:
        speeds: ground speed from each waypoint on, (W,) m/s.
        passed: distance over ground at which each waypoint is passed, in the middle of its corner, (W,) m.
        corners: corner at each waypoint; None at the ends and where the route goes straight on.
        length: of the whole path, m.

    Raises:
        InputError: two waypoints coincide or are antipodes, a turn is too sharp, or a leg too short for its corners.
    """

    def __init__(self, waypoints: tuple[Waypoint, ...], vehicle: Vehicle, ellipsoid: Ellipsoid) -> None:
        self._ellipsoid = ellipsoid
        self._vehicle = vehicle
        self.waypoints = waypoints
        self.speeds = _speeds(waypoints)
        latitude, longitude = (
            np.array([getattr(w, key) * DEG for w in waypoints]) for key in ("latitude_deg", "longitude_deg")
        )
        self._normals = normal(latitude, longitude)
        self._east, self._north = _axes(self._normals)
        height = np.array([w.height_m for w in waypoints])
        self._radii = np.stack(radii(latitude, ellipsoid)) + height  # north, east
        self._radius = float(np.mean(self._radii))
        angles = self._leg_angles()
        self.corners = tuple(self._corner(number) for number in range(len(waypoints)))
        self._pieces, self._marks = self._laid_out(angles)
        self._nominal, self._ground, self.passed = self._measured()
        self.length = float(self._ground[-1])
        self._inverses = self._inverted()

    def named(self, number: int) -> str:
        """Return a waypoint in messages: "track.waypoints.2 (Dover)"."""
        name = self.waypoints[number].name
        return f"track.waypoints.{number + 1}" + (f" ({name})" if name else "")

    def positions(self, distance: Array) -> Array:
        """Return Earth-fixed positions at distances over ground, (N, 3) m."""
        distance = np.clip(distance, 0.0, self.length)
        begins = np.array([begin for begin, _ in self._inverses])
        piece = np.clip(np.searchsorted(begins, distance, side="right") - 1, 0, len(begins) - 1)
        normal = np.empty((len(distance), 3))
        for number in np.unique(piece):
            rows, part = piece == number, self._pieces[number]
            inside = np.clip(self._inverses[number][1](distance[rows]) - part.begin, 0.0, part.length)
            normal[rows] = part.normals(inside)[0]
        latitude = np.arctan2(normal[:, 2], np.hypot(normal[:, 0], normal[:, 1]))
        longitude = np.arctan2(normal[:, 1], normal[:, 0])
        return geodetic_to_ecef(latitude, longitude, self._heights(distance), self._ellipsoid)

    def _inverted(self) -> list[tuple[float, Any]]:
        """Return the ground distance at the beginning of each piece, and its nominal distances by ground distance.

        The nominal metre differs from piece to piece, so that each has a spline of its own.
        """
        from scipy.interpolate import make_interp_spline

        inverses = []
        for piece in self._pieces:
            rows = (self._nominal >= piece.begin - 1e-7) & (self._nominal <= piece.begin + piece.length + 1e-7)
            ground = self._ground[rows]
            inverses.append((float(ground[0]), make_interp_spline(ground, self._nominal[rows], k=5)))
        return inverses

    def _leg_angles(self) -> Array:
        a, b = self._normals[:-1], self._normals[1:]
        angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
        for number, angle in enumerate(angles):
            if angle * self._radius < 1e-3 or angle > pi - 1e-6:
                why = "are the same place" if angle < 1.0 else "lie opposite each other on the Earth"
                raise InputError(
                    f"{self.named(number)} and {self.named(number + 1)} {why}, so that no leg is defined between "
                    "them: move one of them" + ("; a time at rest is stop_s." if angle < 1.0 else ".")
                )
        return np.asarray(angles)

    def _direction(self, at: int, other: int) -> Array:
        """Return the horizontal direction at one waypoint to another."""
        n, to = self._normals[at], self._normals[other]
        level = to - (to @ n) * n
        return np.asarray(level / np.linalg.norm(level))

    def _on_ground(self, number: int, direction: Array) -> tuple[float, float]:
        """Return the metres to the east and north at a waypoint of a turn of the normal by a radian."""
        r1, r2 = self._radii[:, number]
        return float(r2 * (self._east[number] @ direction)), float(r1 * (self._north[number] @ direction))

    def _corner(self, number: int) -> Corner | None:
        if number in (0, len(self.waypoints) - 1):
            return None
        before = self._on_ground(number, -self._direction(number, number - 1))
        after = self._on_ground(number, self._direction(number, number + 1))
        angle = atan2(before[1] * after[0] - before[0] * after[1], before[0] * after[0] + before[1] * after[1])
        if abs(angle) < _STRAIGHT:
            return None
        if turns_back(angle):
            raise InputError(
                f"{self.named(number)}: the route turns by {abs(angle) / DEG:.0f}° there, more than 170°, which is "
                "too much for one corner: give two waypoints, about a diameter of the turn apart."
            )
        waypoint, speed = self.waypoints[number], max(self.speeds[number - 1], self.speeds[number])
        if waypoint.turn_radius_m is not None:
            radius = waypoint.turn_radius_m
        elif waypoint.bank_deg is not None:
            radius = speed**2 / (G0 * tan(radians(waypoint.bank_deg)))
        else:
            radius = max(speed**2 / self._vehicle.lateral, 5.0)
        if radius > 0.1 * self._radius:
            raise InputError(
                f"{self.named(number)}: the turn has a radius of {radius / 1e3:.4g} km, too large for the Earth; give "
                "a lower speed_mps, or a larger bank_deg."
            )
        return Corner(angle, radius, speed * self._vehicle.ramp)

    def _laid_out(self, angles: Array) -> tuple[list[_Leg | _Turn], Array]:
        """Return the pieces in order, and the nominal distances at which the waypoints are passed."""
        pieces: list[_Leg | _Turn] = []
        marks, begin = [0.0], 0.0
        for number, angle in enumerate(angles):
            start, ahead = self._normals[number], self._direction(number, number + 1)
            onto = -self._direction(number + 1, number)
            ground = self._on_ground(number, ahead), self._on_ground(number + 1, onto)
            corners = self.corners[number], self.corners[number + 1]
            cut = [c.tangent if c else 0.0 for c in corners]
            ends = [tangent / hypot(*metres) for tangent, metres in zip(cut, ground, strict=True)]
            if sum(ends) > angle:
                whole = angle * 0.5 * (hypot(*ground[0]) + hypot(*ground[1]))
                raise InputError(
                    f"the leg from {self.named(number)} to {self.named(number + 1)} has {whole:.5g} m, "
                    f"but the turns at its ends need {cut[0]:.4g} m and {cut[1]:.4g} m of them: give a smaller "
                    "turn_radius_m, a larger bank_deg or a lower speed_mps."
                )
            rest = float(angle - sum(ends)) * self._radius
            if rest > 1e-6:
                here = start * np.cos(ends[0]) + ahead * np.sin(ends[0])
                there = ahead * np.cos(ends[0]) - start * np.sin(ends[0])
                pieces.append(_Leg(begin, rest, here, there, self._radius))
                begin += rest
            corner = corners[1]
            marks.append(begin + (0.5 * corner.length if corner else 0.0))
            if corner is not None:
                pieces.append(self._turned(number + 1, begin, corner, ground[1]))
                begin += corner.length
        return pieces, np.array(marks)

    def _turned(self, number: int, begin: float, corner: Corner, ahead: tuple[float, float]) -> _Turn:
        """Return the piece of a corner; `ahead` points east and north along the incoming leg."""
        (east, north), (r1, r2) = np.array(ahead) / hypot(*ahead), self._radii[:, number]
        to_east, to_north = self._east[number] / r2, self._north[number] / r1  # rad/m
        along, right = east * to_east + north * to_north, north * to_east - east * to_north
        return _Turn(begin, corner, self._normals[number], along, right)

    def _measured(self) -> tuple[Array, Array, Array]:
        """Return nominal distances, distances over ground, and the latter at the waypoints."""
        edges = [np.zeros(1), *(piece.begin + piece.edges[1:] for piece in self._pieces)]
        nominal = np.concatenate(edges)
        ground = np.concatenate([[0.0], np.cumsum(self._over_ground(nominal[:-1], nominal[1:]))])
        panel = np.searchsorted(nominal, self._marks, side="right").clip(1, len(nominal) - 1) - 1
        return nominal, ground, np.asarray(ground[panel] + self._over_ground(nominal[panel], self._marks))

    def _over_ground(self, left: Array, right: Array) -> Array:
        """Return distances over ground between nominal distances, (N,) m."""
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
        half = 0.5 * (right - left)
        at = (left + half)[:, None] + half[:, None] * nodes
        return np.asarray(half * (self._stretch(at.ravel()).reshape(at.shape) @ weights))

    def _at(self, nominal: Array) -> tuple[Array, Array]:
        """Return normals and their derivatives at nominal distances, (N, 3)."""
        normal, slope = np.empty((len(nominal), 3)), np.empty((len(nominal), 3))
        begins = np.array([piece.begin for piece in self._pieces])
        piece = np.clip(np.searchsorted(begins, nominal, side="right") - 1, 0, len(begins) - 1)
        for number in np.unique(piece):
            rows, part = piece == number, self._pieces[number]
            normal[rows], slope[rows] = part.normals(nominal[rows] - part.begin)
        return normal, slope

    def _stretch(self, nominal: Array) -> Array:
        """Return metres over ground per nominal metre, from the turn of the normal and the radii of curvature."""
        normal, slope = self._at(nominal)
        across = np.hypot(normal[:, 0], normal[:, 1])
        r1, r2 = radii(np.arctan2(normal[:, 2], across), self._ellipsoid)
        pole = across < 1e-12  # any direction is a meridian there
        east = (
            np.column_stack((-normal[:, 1], normal[:, 0], np.zeros(len(normal)))) / np.maximum(across, 1e-12)[:, None]
        )
        to_east = np.where(pole, 0.0, np.einsum("ij,ij->i", slope, east))
        to_north = np.sqrt(np.maximum(np.einsum("ij,ij->i", slope, slope) - to_east**2, 0.0))
        height = self._height_nominal(nominal)
        return np.asarray(np.hypot((r1 + height) * to_north, (r2 + height) * to_east))

    def _height_nominal(self, nominal: Array) -> Array:
        return _stepped(nominal, self._marks, np.array([w.height_m for w in self.waypoints]))

    def _heights(self, distance: Array) -> Array:
        return _stepped(distance, self.passed, np.array([w.height_m for w in self.waypoints]))


def _axes(normals: Array) -> tuple[Array, Array]:
    """Return east and north at normals, (N, 3); at a pole, those of the meridian of Greenwich."""
    across = np.hypot(normals[:, 0], normals[:, 1])
    pole = across < 1e-12
    x, y = np.where(pole, 1.0, normals[:, 0]), np.where(pole, 0.0, normals[:, 1])
    east = np.column_stack((-y, x, np.zeros(len(x)))) / np.where(pole, 1.0, across)[:, None]
    return east, np.cross(normals, east)


def _stepped(x: Array, at: Array, values: Array) -> Array:
    """Return values that change by a smooth step of degree 9 between abscissae."""
    leg = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(at) - 2)
    u = np.clip((x - at[leg]) / (at[leg + 1] - at[leg]), 0.0, 1.0)
    step = u**5 * (126.0 + u * (-420.0 + u * (540.0 + u * (-315.0 + 70.0 * u))))
    return np.asarray(values[leg] + (values[leg + 1] - values[leg]) * step)


def _speeds(waypoints: tuple[Waypoint, ...]) -> Array:
    """Return the speed from each waypoint on, m/s."""
    speeds: list[float] = []
    for waypoint in waypoints:
        speeds.append(speeds[-1] if waypoint.speed_mps is None else waypoint.speed_mps)
    return np.array(speeds)


_PEAK = 35.0 / 16.0


@dataclass(frozen=True)
class _Phase:
    """A time at constant speed, or a change of speed."""

    begin: float
    duration: float
    distance: float  # at its beginning
    before: float
    after: float

    def travelled(self, t: Array) -> Array:
        """Return distances at instants, (N,) m."""
        x = (t - self.begin) / self.duration
        change = (self.after - self.before) * self.duration * integrated_step7(x)
        return np.asarray(self.distance + self.before * (t - self.begin) + change)

    @property
    def covered(self) -> float:
        """Distance covered in it, m."""
        return 0.5 * (self.before + self.after) * self.duration


class Timetable:
    """Distance along a route over time, with a largest acceleration along it, m/s²."""

    def __init__(self, route: Route, acceleration: float) -> None:
        self._route, self._acceleration = route, acceleration
        self._phases: list[_Phase] = []
        self._time = self._distance = 0.0
        self.stops: dict[int, tuple[float, float]] = {}  # beginning and end of each stop, s, by waypoint
        passings = [0.0]
        last = len(route.waypoints) - 1
        self._stop(0)
        for leg in range(last):
            self._travel(leg)
            passings.append(self._time)
            self._stop(leg + 1)
        self.passings = np.array(passings)  # instant at which each waypoint is passed, or its stop begins, (W,) s
        self.duration = self._time

    def distances(self, time: Array) -> Array:
        """Return distances over ground at instants, (N,) m."""
        begins = np.array([phase.begin for phase in self._phases])
        number = np.clip(np.searchsorted(begins, time, side="right") - 1, 0, len(begins) - 1)
        out = np.empty(len(time))
        for k in np.unique(number):
            rows = number == k
            out[rows] = self._phases[k].travelled(time[rows])
        return out

    def _stop(self, number: int) -> None:
        seconds = self._route.waypoints[number].stop_s
        if seconds > 0.0:
            self.stops[number] = (self._time, self._time + seconds)
            self._add(seconds, 0.0, 0.0)

    def _add(self, duration: float, before: float, after: float) -> None:
        if duration <= 0.0:
            return
        phase = _Phase(self._time, duration, self._distance, before, after)
        self._phases.append(phase)
        self._time += duration
        self._distance += phase.covered

    def _travel(self, leg: int) -> None:
        """Travel from a waypoint to the next one: accelerate, go on at the leg's speed, brake."""
        route = self._route
        whole = float(route.passed[leg + 1] - route.passed[leg])
        speed = float(route.speeds[leg])
        ahead = self._speed_at(leg + 1)
        before = self._speed_at(leg)
        speedup, braking = (
            _PEAK * abs(speed - before) / self._acceleration,
            _PEAK * abs(speed - ahead) / self._acceleration,
        )
        needs = 0.5 * (before + speed) * speedup + 0.5 * (speed + ahead) * braking
        if needs > whole:
            raise InputError(
                f"the leg from {route.named(leg)} to {route.named(leg + 1)} has {whole:.5g} m, but its changes of "
                f"speed, from {before:g} to {speed:g} and to {ahead:g} m/s, need {needs:.5g} m at "
                f"{self._acceleration:g} m/s²: give a lower speed_mps, or a larger track.acceleration_mps2."
            )
        self._add(speedup, before, speed)
        self._add((whole - needs) / speed, speed, speed)
        self._add(braking, speed, ahead)
        self._distance = float(route.passed[leg + 1])  # without the rounding of the sum

    def _speed_at(self, number: int) -> float:
        """Return the speed at a waypoint: 0 at a stop, else the lower one of its two legs."""
        route = self._route
        if route.waypoints[number].stop_s > 0.0:
            return 0.0
        last = len(route.waypoints) - 1
        return float(min(route.speeds[max(number - 1, 0)], route.speeds[min(number, last - 1)]))
