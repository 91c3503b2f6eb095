"""Kinds of vehicles: limits of their motion, and the attitude that follows from the motion where none was recorded.

The heading is the direction of the horizontal velocity while the vehicle moves. At a standstill it is the last heading;
near its end it goes over to the course of the motion that follows. A standstill begins below half the vehicle's speed
of standstill and ends at that speed, so that noise about one limit does not switch it on and off. The positions of a
receiver at rest wander faster than that, but they stay where they are: a noisy track stands wherever it gets on, over
10 to 40 s, by less than half the speed of standstill. The heading is then that of the mean motion of the five seconds
before, and after, the standstill, because the course at its edges is mostly noise. The pitch is held in the same way
below five times these speeds, because the slope of a slow path is mostly noise; it is the mean slope of the five
seconds before, and after, a standstill. Directions are unit vectors in Earth-fixed axes, which no pole and no meridian
disturbs; a held one is carried along parallel to itself.

The roll of an aircraft makes the lateral specific force zero, f·y = 0, the rotation of the Earth included; on a level
circle tan φ = v²/(gR) to that extent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.gravity import gravitation_ecef

VehicleName = Literal["aircraft", "land", "sea"]
Pitch = Literal["slope", "flat"]


@dataclass(frozen=True)
class Vehicle:
    """Assumptions about a kind of vehicle."""

    name: VehicleName  # name in scenario files
    pitch: Pitch  # "slope": the nose points along the path in the vertical plane; "flat": it stays level
    banks: bool  # whether it rolls so that the lateral specific force is zero; otherwise it does not roll
    standstill: float  # ground speed below which the course is no heading, m/s
    spot_turn: float  # largest rate at which the heading goes over from one held at a standstill to a new course, rad/s
    knots: float  # largest spacing of the knots of a curve whose attitude follows from its motion, s
    most_speed: float  # mean speed between two samples that is refused as a jump, m/s
    odd_acceleration: float  # acceleration of which a person is warned, m/s²
    odd_turn: float  # angular rate of which a person is warned, rad/s
    odd_pitch: float  # pitch from climb of which a person is warned, rad
    acceleration: float  # default acceleration along a planned route, m/s²
    ramp: float  # time in which the curvature of a planned route's corner is built up, s
    lateral: float  # lateral acceleration in a planned route's corner by default, m/s²


VEHICLES: dict[str, Vehicle] = {
    "aircraft": Vehicle("aircraft", "slope", True, 3.0, 0.5, 0.1, 1500.0, 100.0, 4.0, 1.0, 1.0, 5.0, 4.57),
    "land": Vehicle("land", "slope", False, 1.0, 0.8, 0.1, 150.0, 15.0, 2.0, 0.27, 1.0, 1.5, 2.0),
    "sea": Vehicle("sea", "flat", False, 0.5, 0.1, 0.25, 60.0, 5.0, 0.5, 0.35, 0.05, 10.0, 0.2),
}
"""Vehicles by name. An aircraft's lateral acceleration is that of 25° of bank."""


_EASE = 1.0
"""Time in which a turn that a standstill interrupts comes to an end, s."""
_GO_OVER = 2.0
"""Least time in which a held heading goes over to a new course, s."""
_LEAST_LIFT = 1.0
"""Least upward specific force for the roll of a coordinated turn, m/s²: in free fall a roll is not defined."""
_SLOPE = 5.0
"""Speed from which the pitch follows the climb, in speeds of standstill."""
_MEAN = 5.0
"""Time before and after a standstill over which the slope is averaged, s."""
_GRID = 0.5
"""Interval at which a noisy track is searched for standstills, s."""
_WINDOWS = (10.0, 20.0, 40.0)
"""Times over which the progress of a noisy track is measured, s."""
_EARTH = 6.371e6
"""Radius of the Earth, m; distances at a standstill need no better one."""
_SHARP = float(np.cos(0.3))
"""Cosine of a turn of the course between two knots that is a reversal."""
_ROUNDS = 20


class _Span(NamedTuple):
    """A standstill: first knot, and the first knot after it."""

    first: int
    last: int


class Attitude(NamedTuple):
    """Attitude from motion."""

    q_eb: Array  # attitude, v_e = C_eb v_b, (K, 4)
    held: Array  # whether the heading at a knot is held or goes over, (K,)


def attitude_from_motion(
    time: Array,
    position: Array,
    velocity: Array,
    acceleration: Array,
    up: Array,
    vehicle: Vehicle,
    gravity: str,
    ellipsoid: Ellipsoid,
    *,
    pitch: Pitch | None = None,
    standstill: float | None = None,
    heading: float = 0.0,
    noisy: bool = False,
) -> Attitude:
    """Return the attitude of a vehicle along its path, relative to the Earth in its axes, (K, 3), with the local
    vertical `up`.

    Pitch and speed of standstill are by default those of the vehicle; `heading` is that of a vehicle that never moves,
    rad. The path of noisy samples wanders at rest.
    """
    climb = np.einsum("ij,ij->i", velocity, up)
    horizontal = velocity - climb[:, None] * up
    speed = np.linalg.norm(horizontal, axis=1)
    limit = vehicle.standstill if standstill is None else standstill
    course = horizontal / np.maximum(speed, 1e-12)[:, None]
    still = _reversals(course)
    if noisy:
        still |= _wanders(time, up, limit)
    spans = _standstills(speed, limit, still)
    sloping = (pitch or vehicle.pitch) == "slope"
    slope = np.arctan2(climb, speed) if sloping else np.zeros(len(time))
    if spans and spans[0] == _Span(0, len(time)):
        ahead = _carried(_pointing(up[0], heading), up[0], up)
    else:
        spans = _wide_enough(time, course, up, spans, vehicle.spot_turn)
        ahead = course.copy()
        for span in spans:
            before, after = _mean_courses(time, horizontal, course, up, span) if noisy else (0.0, 0.0)
            _hold(time, ahead, course, up, span, vehicle.spot_turn, before, after)
    nose = slope.copy()
    for span in _standstills(speed, _SLOPE * limit) if sloping else ():
        _hold_pitch(time, nose, climb, speed, span)
    standing = np.zeros(len(time), bool)
    for first, last in spans:
        standing[first:last] = True
    forward = ahead * np.cos(nose)[:, None] + up * np.sin(nose)[:, None]
    right = np.cross(ahead, up)
    down = np.cross(forward, right)
    if vehicle.banks:
        force = _specific_force(position, velocity, acceleration, gravity, ellipsoid)
        roll = np.arctan2(
            np.einsum("ij,ij->i", force, right), np.maximum(-np.einsum("ij,ij->i", force, down), _LEAST_LIFT)
        )
        roll = (roll * _rising(time, spans))[:, None]
        right, down = right * np.cos(roll) + down * np.sin(roll), down * np.cos(roll) - right * np.sin(roll)
    return Attitude(rotation.quaternion_from_dcm(np.stack([forward, right, down], axis=2)), standing)


def _reversals(course: Array) -> NDArray[np.bool_]:
    """Return the knots at which the course turns sharply, as in a stop between two knots."""
    sharp = np.einsum("ij,ij->i", course[1:], course[:-1]) < _SHARP
    return np.asarray(np.append(sharp, False) | np.insert(sharp, 0, False))


def _wanders(time: Array, up: Array, limit: float) -> NDArray[np.bool_]:
    """Return the knots of a noisy path at which it stays within half the limit times one of `_WINDOWS`, (K,).

    At both ends, the path stands only within the distances that it has while it stands for certain.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    grid = np.arange(time[0], time[-1], _GRID)
    place = _EARTH * np.stack([np.interp(grid, time, axis) for axis in up.T])
    still = np.zeros(len(grid), bool)
    for length in _WINDOWS:
        half = round(0.5 * length / _GRID)
        if 2 * half >= len(grid):
            break
        size = maximum_filter1d(place, 2 * half + 1, axis=1) - minimum_filter1d(place, 2 * half + 1, axis=1)
        within = np.linalg.norm(size, axis=0) < 0.5 * limit * length
        within[:half] = within[len(grid) - half :] = False
        still |= maximum_filter1d(within, 2 * half + 1)
    selected = np.zeros(len(time), bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still, [0]])))
    longest = round(_WINDOWS[-1] / _GRID)
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        begin = _inside(place[:, first : min(last, first + longest)])[0] if first else 0
        end = _inside(place[:, max(first, last - longest) : last][:, ::-1])[0] if last < len(grid) else 0
        selected |= (time >= grid[first + begin]) & (time <= (grid[last - 1 - end] if last < len(grid) else time[-1]))
    return selected


def _inside(place: Array) -> NDArray[np.intp]:
    """Return the rows within two median distances of the middle of places, (3, N)."""
    away = np.linalg.norm(place - np.median(place, axis=1)[:, None], axis=0)
    return np.flatnonzero(away <= 2.0 * np.median(away))


def _mean_courses(time: Array, velocity: Array, course: Array, up: Array, span: _Span) -> tuple[float, float]:
    """Return the angles from the course at both edges of a standstill to the mean course beyond it, rad."""
    selected = []
    for edge, rows in (
        (span.first - 1, slice(int(np.searchsorted(time, time[max(span.first - 1, 0)] - _MEAN)), span.first)),
        (span.last, slice(span.last, int(np.searchsorted(time, time[min(span.last, len(time) - 1)] + _MEAN)) + 1)),
    ):
        inside = 0 <= edge < len(time)
        selected.append(_turn(course[edge], velocity[rows].mean(axis=0), up[edge]) if inside else 0.0)
    return selected[0], selected[1]


def _standstills(speed: Array, limit: float, still: NDArray[np.bool_] | None = None) -> list[_Span]:
    """Return where the vehicle stands: below half the limit or where it is known to, until the limit is reached."""
    slow = speed < 0.5 * limit
    if still is not None:
        slow = slow | still
    moves = np.where(slow, -1, np.where(speed >= limit, 1, 0))
    known = np.flatnonzero(moves)
    if not len(known):
        return []  # always slow, but never at rest: it has a course
    latest = np.maximum.accumulate(np.where(moves != 0, np.arange(len(speed)), -1))
    state = np.where(latest >= 0, moves[np.maximum(latest, 0)], moves[known[0]])
    edges = np.flatnonzero(np.diff(np.concatenate([[1], state, [1]])))
    return [_Span(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _wide_enough(time: Array, course: Array, up: Array, spans: list[_Span], rate: float) -> list[_Span]:
    """Return the standstills, widened until the heading can go over to the new course at the largest rate."""
    for _ in range(_ROUNDS):
        wider = []
        for span in spans:
            first, last = span
            if first > 0 and last < len(time):
                turn = abs(_turn(_carried(course[first - 1], up[first - 1], up[last]), course[last], up[last]))
                missing = _duration(turn, rate) - float(time[last] - time[first])
                if missing > 0.0:
                    first = max(1, int(np.searchsorted(time, time[first] - 0.5 * missing)))
                    last = min(len(time) - 1, int(np.searchsorted(time, time[last] + 0.5 * missing)) + 1)
            wider.append(_Span(first, last))
        merged: list[_Span] = []
        for span in wider:
            if merged and span.first <= merged[-1].last:
                merged[-1] = _Span(merged[-1].first, max(merged[-1].last, span.last))
            else:
                merged.append(span)
        if merged == spans:
            break
        spans = merged
    return spans


def _duration(turn: float, rate: float) -> float:
    """Return the time of a smooth turn, whose largest rate is 15/8 of the mean one, s."""
    return 15.0 / 8.0 * turn / rate


def _hold(
    time: Array, ahead: Array, course: Array, up: Array, span: _Span, most: float, mean_before: float, mean_after: float
) -> None:
    """Fill in the heading of a standstill: hold the course before it, then go over to the course after it.

    The courses are those at the edges or, of a noisy path, which turns there at random, the mean courses beyond them.
    """
    first, last = span
    rows, before, after = slice(first, last), first > 0, last < len(time)
    origin = first - 1 if before else last
    base = _carried(course[origin], up[origin], up[rows])
    turn_out = turn_in = np.zeros(last - first)
    change = 0.0
    if before and first > 1:
        rate = _change(course, up, first - 2) / (time[first - 1] - time[first - 2])
        eased = np.clip(rate, -most, most) * _ease(np.append(time[rows] - time[first - 1], np.inf))
        turn_out, mean_before = eased[:-1], mean_before and mean_before - eased[-1]
    if before:
        turn_out = turn_out + mean_before * _smooth((time[rows] - time[first - 1]) / _GO_OVER)
    if after:
        change = _turn(_carried(course[origin], up[origin], up[last]), course[last], up[last])
        turn_in = np.full(last - first, change)
        if last + 1 < len(time):
            rate = _change(course, up, last) / (time[last + 1] - time[last])
            eased = np.clip(rate, -most, most) * _ease(np.append(time[last] - time[rows], np.inf))
            turn_in, mean_after = turn_in - eased[:-1], mean_after and mean_after + eased[-1]
        turn_in = turn_in + mean_after * _smooth((time[last] - time[rows]) / _GO_OVER)
    share = _share(time, span, max(_GO_OVER, _duration(abs(change), most)))
    angle = (1.0 - share) * turn_out + share * turn_in
    ahead[rows] = base * np.cos(angle)[:, None] + np.cross(base, up[rows]) * np.sin(angle)[:, None]


def _hold_pitch(time: Array, nose: Array, climb: Array, speed: Array, span: _Span) -> None:
    """Fill in the pitch where the vehicle is too slow for a slope: the mean slope before it, then that after it.

    The slope at the edge of the span, where the vehicle is slow, goes over to the mean of `_MEAN` beyond it.
    """
    first, last = span
    rows, t = slice(first, last), time[first:last]
    out = into = np.zeros(last - first)
    if first > 0:
        edge, before = first - 1, time[first - 1] - _MEAN
        out = np.full(last - first, np.arctan2(climb[edge], speed[edge]))
        if first > 1:
            rate = (out[0] - np.arctan2(climb[first - 2], speed[first - 2])) / (time[edge] - time[first - 2])
            out = out + rate * _ease(t - time[edge])
        mean = _mean_slope(climb, speed, slice(int(np.searchsorted(time, before)), first))
        share = _smooth((t - time[edge]) / _GO_OVER)
        out = (1.0 - share) * out + share * mean
    if last < len(time):
        into = np.full(last - first, np.arctan2(climb[last], speed[last]))
        if last + 1 < len(time):
            rate = (np.arctan2(climb[last + 1], speed[last + 1]) - into[0]) / (time[last + 1] - time[last])
            into = into - rate * _ease(time[last] - t)
        mean = _mean_slope(climb, speed, slice(last, int(np.searchsorted(time, time[last] + _MEAN)) + 1))
        share = _smooth((time[last] - t) / _GO_OVER)
        into = (1.0 - share) * into + share * mean
    share = _share(time, span, 2.0 * _GO_OVER)
    nose[rows] = (1.0 - share) * out + share * into


def _mean_slope(climb: Array, speed: Array, rows: slice) -> float:
    """Return the mean slope of a part of the path, rad."""
    return float(np.arctan2(np.mean(climb[rows]), np.mean(speed[rows])))


def _share(time: Array, span: _Span, takes: float) -> Array:
    """Return the share of what follows a standstill: a smooth step at its end; 1 or 0 with nothing on one side."""
    first, last = span
    if first == 0 or last == len(time):
        return np.full(last - first, 1.0 if first == 0 else 0.0)
    end = float(time[last])
    begins = max(float(time[first]), end - takes)
    return _smooth((time[first:last] - begins) / max(end - begins, 1e-9))


def _carried(direction: Array, start: Array, up: Array) -> Array:
    """Return a horizontal direction carried along the great circles from its vertical to others, (3,) or (K, 3).

    The rotation that takes the vertical a to b the short way takes d ⊥ a to d − (b·d)/(1 + a·b) (a + b).
    """
    share = (up @ direction) / (1.0 + up @ start)
    return np.asarray(direction - share[..., None] * (start + up))


def _change(course: Array, up: Array, knot: int) -> float:
    """Return the turn of the course from one knot to the next, rad."""
    return _turn(_carried(course[knot], up[knot], up[knot + 1]), course[knot + 1], up[knot + 1])


def _turn(of: Array, to: Array, up: Array) -> float:
    """Return the angle from one horizontal direction to another, clockwise seen from above, rad."""
    return float(np.arctan2(np.cross(of, up) @ to, of @ to))


def _pointing(up: Array, heading: float) -> Array:
    """Return the horizontal direction of a heading."""
    east = np.cross((0.0, 0.0, 1.0), up)
    size = np.linalg.norm(east)
    east = east / size if size > 1e-12 else np.array([0.0, 1.0, 0.0])
    return np.asarray(np.cross(up, east) * np.cos(heading) + east * np.sin(heading))


def _smooth(x: Array) -> Array:
    """Return the smooth step 10x³ − 15x⁴ + 6x⁵ from 0 to 1."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x**3 * (10.0 + x * (6.0 * x - 15.0)))


def _ease(since: Array) -> Array:
    """Return ∫(1 − smooth step), s: a rate of 1 that dies out in `_EASE`."""
    x = np.clip(since / _EASE, 0.0, 1.0)
    return np.asarray(_EASE * (x - x**4 * (2.5 + x * (x - 3.0))))


def _rising(time: Array, spans: list[_Span]) -> Array:
    """Return 0 in standstills and 1 away from them, with a smooth step of `_GO_OVER` between."""
    away = np.full(len(time), np.inf)
    for first, last in spans:
        away[first:last] = 0.0
        away[:first] = np.minimum(away[:first], time[first] - time[:first])
        if last > 0:
            away[last:] = np.minimum(away[last:], time[last:] - time[last - 1])
    return _smooth(away / _GO_OVER)


def _specific_force(position: Array, velocity: Array, acceleration: Array, gravity: str, ellipsoid: Ellipsoid) -> Array:
    """Return f = r̈ + 2 ω_ie × ṙ + ω_ie × (ω_ie × r) − gravitation, in Earth-fixed axes, (K, 3) m/s²."""
    omega = np.array([0.0, 0.0, ellipsoid.omega])
    rotating = 2.0 * np.cross(omega, velocity) + np.cross(omega, np.cross(omega, position))
    return np.asarray(acceleration + rotating - gravitation_ecef(position, gravity, ellipsoid))
