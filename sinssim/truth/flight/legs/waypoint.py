"""The leg "waypoint": to a place, or along a route of places with names and heights.

The height over the way to a waypoint is a straight slope with rounded ends. The slope begins and ends on parabolas,
along which the vertical speed changes uniformly, so that the aircraft is at the waypoint's height, with the slope it is
to have there, when it reaches the waypoint.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, remainder, sin
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.toml_section import Keys, Latitude, Longitude, Section, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import INTERVAL, AircraftState, Autopilot, G
from sinssim.truth.flight.leg import Altitude, Bank, DeadReckoning, LegBase, LegError, bearing, distance
from sinssim.truth.flight.planned_path import PlannedTrack, great_circle, over_ground
from sinssim.units import DEG

VERTICAL_ACCELERATION = 0.3
"""Vertical acceleration of the rounded ends, 0.03 g, which passengers hardly notice [m/s²]."""
_ACCELERATIONS = (VERTICAL_ACCELERATION, 0.6, 1.2, 2.4)
"""What is tried in turn where the way is too short for a gentle change [m/s²]."""


@dataclass(frozen=True)
class HeightPath:
    """Height over the distance that is left to a waypoint."""

    # distance left where the change of height begins and ends, m
    begin: float
    end: float
    height: float  # at the beginning, m
    slope: float  # of the straight part, height over way, positive up
    # before the beginning and after the end
    slope_before: float
    slope_after: float
    curvature: float  # of the parabolas, 1/m

    def at(self, left: float) -> tuple[float, float]:
        """Return height, m, and slope at a distance left, m; before the beginning the height is constant."""
        way, length = self.begin - left, self.begin - self.end
        if way <= 0.0:
            return self.height, 0.0
        first = abs(self.slope - self.slope_before) / self.curvature
        last = abs(self.slope - self.slope_after) / self.curvature
        s = min(way, first)
        bend = math.copysign(self.curvature, self.slope - self.slope_before)
        height, slope = self.height + (self.slope_before + 0.5 * bend * s) * s, self.slope_before + bend * s
        height += self.slope * max(0.0, min(way, length - last) - first)
        if way > first:
            slope = self.slope
        s = min(way, length) - (length - last)
        if s > 0.0:
            bend = math.copysign(self.curvature, self.slope_after - self.slope)
            height, slope = height + (self.slope + 0.5 * bend * s) * s, self.slope + bend * s
        if way > length:
            height, slope = height + self.slope_after * (way - length), self.slope_after
        return height, slope


def single_slope(
    height: float, target: float, left: float, speed: float, slope_before: float = 0.0, slope_after: float = 0.0
) -> HeightPath | None:
    """Return a path of one slope from here to the waypoint; None if the way is too short for the change of height.

    With the slopes m₀ before, m between and m₁ after, and the curvature κ, the parabolas are |m − m₀|/κ and |m − m₁|/κ
    long, and the path rises by mL − sgn(m − m₀)(m − m₀)²/2κ − sgn(m − m₁)(m − m₁)²/2κ over its length L. The rise grows
    with m until the parabolas meet. The curvature is the vertical acceleration over the square of the ground speed.
    """
    for acceleration in _ACCELERATIONS if left > 0.0 else ():
        curvature = acceleration / speed**2

        def rise(slope: float, curvature: float = curvature) -> float:
            before, after = slope - slope_before, slope - slope_after
            return slope * left - 0.5 * (before * abs(before) + after * abs(after)) / curvature

        middle, reach = 0.5 * (slope_before + slope_after), 0.5 * curvature * left
        low, high = middle - reach, middle + reach
        if not rise(low) <= target - height <= rise(high):
            continue
        for _ in range(60):
            slope = 0.5 * (low + high)
            low, high = (slope, high) if rise(slope) < target - height else (low, slope)
        return HeightPath(left, 0.0, height, 0.5 * (low + high), slope_before, slope_after, curvature)
    return None


def at_a_slope(height: float, target: float, left: float, speed: float, slope: float) -> HeightPath | None:
    """Return a path of a given slope: a climb begins here, a descent so late that it ends at the waypoint. None if the
    way is too short. The speed over the ground is that in the middle of the change.

    From level flight to level flight at a slope m the change of height takes the way |Δh/m| + |m|/κ.
    """
    curvature = VERTICAL_ACCELERATION / speed**2
    change = abs(target - height)
    slope = min(slope, math.sqrt(change * curvature))  # of a change so small that the parabolas meet
    length = change / slope + slope / curvature if change else 0.0
    if length > left:
        return None
    if target < height:
        return HeightPath(length, 0.0, height, -slope, 0.0, 0.0, curvature)
    return HeightPath(left, left - length, height, slope, 0.0, 0.0, curvature)


def length_at_a_slope(height: float, target: float, speed: float, slope: float) -> float:
    """Return the way of `at_a_slope`, m."""
    change = abs(target - height)
    return change / slope + slope * speed**2 / VERTICAL_ACCELERATION


def passing_slope(before: float, after: float) -> float:
    """Return the slope at a waypoint between two slopes: the flatter one, level if one goes up and the other down."""
    return math.copysign(min(abs(before), abs(after)), before) if before * after > 0.0 else 0.0


_MEAN_RADIUS = 6_371_009.0  # radius for bearings and distances to a waypoint [m]
_ROUNDS = 20  # iterations for the turn towards a waypoint, whose angle and end depend on each other: enough for 0.1 s
_HEIGHT_LIMIT = 50.0  # largest distance from a waypoint's height at which it counts as reached [m]

_COARSE, _FINE = 1000.0, 50.0  # distance of the points of a planned way, level and where its height changes [m]
_CIRCLING = 4.0 * pi  # turn on the way to a place from which on the aircraft circles around it [rad]

PlaceName = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^\S(.*\S)?$")]
"""Name of a waypoint in messages, reports and pictures."""
PathAngle = Annotated[float, Field(gt=0.0, le=30.0)]
VerticalSpeed = Annotated[float, Field(gt=0.0, le=150.0)]

_NAME = "name in events, reports and pictures"
_HEIGHT = "height above the ellipsoid at the waypoint; default: the current height"
_PATH = (
    "angle of the climb or descent; a climb begins at once, a descent at its top of descent; default: a constant "
    "slope to the waypoint"
)
_RATE = "mean vertical speed of the climb or descent, positive, instead of path_deg"


class Waypoint(Section):
    """A waypoint of a route."""

    at_most_one = (Keys(("path_deg", "vertical_speed_mps"), "the slope of the climb or descent"),)
    rules = (
        (lambda s: s.height_m is None and s.changed("path_deg", "vertical_speed_mps"),
         "{it} needs height_m, the height to reach at the waypoint"),
    )  # fmt: skip

    name: PlaceName | None = Field(default=None, description=_NAME)
    latitude_deg: Latitude = Field(description="latitude of the waypoint")
    longitude_deg: Longitude = Field(description="longitude of the waypoint")
    height_m: Altitude | None = Field(default=None, description=_HEIGHT)
    path_deg: PathAngle | None = Field(default=None, description=_PATH)
    vertical_speed_mps: VerticalSpeed | None = Field(default=None, description=_RATE)

    def slope(self, speed: float) -> float | None:
        """Return the slope of the climb or descent at a ground speed in m/s; None: one slope all the way there."""
        if self.path_deg is not None:
            return math.tan(self.path_deg * DEG)
        return None if self.vertical_speed_mps is None else self.vertical_speed_mps / speed


class WaypointLeg(LegBase):
    """Fly straight to a waypoint at constant airspeed, or along a route of waypoints. If a waypoint has a height, the
    aircraft reaches this height when it comes within capture_radius_m. Without path_deg and vertical_speed_mps, the
    path to the waypoint has a constant slope."""

    example: ClassVar[dict[str, Any]] = {"latitude_deg": 51.47, "longitude_deg": -0.45}
    holds: ClassVar[frozenset[str]] = frozenset({"height", "airspeed"})
    plans: ClassVar[frozenset[str]] = frozenset({"track", "height"})
    at_most_one = Waypoint.at_most_one
    rules = (
        (lambda s: s.waypoints and s.changed(*Waypoint.model_fields),
         "waypoints and {it} are given: give it to one of the waypoints"),
        (lambda s: not s.waypoints
         and next((key for key in ("latitude_deg", "longitude_deg") if getattr(s, key) is None), ""),
         "a waypoint needs latitude_deg and longitude_deg, or waypoints: give {it}"),
        *Waypoint.rules,
    )  # fmt: skip

    type: Literal["waypoint"]
    name: PlaceName | None = Field(default=None, description=_NAME)
    latitude_deg: Latitude | None = Field(default=None, description="latitude of the waypoint")
    longitude_deg: Longitude | None = Field(default=None, description="longitude of the waypoint")
    height_m: Altitude | None = Field(default=None, description=_HEIGHT)
    path_deg: PathAngle | None = Field(default=None, description=_PATH)
    vertical_speed_mps: VerticalSpeed | None = Field(default=None, description=_RATE)
    waypoints: tuple[Waypoint, ...] = Field(default=(), description="a route of places, instead of one place")
    capture_radius_m: float = Field(
        default=500.0, ge=20.0, le=20_000.0, description="distance from the waypoint at which it is considered reached"
    )
    bank_deg: Bank | None = Field(
        default=None, description="largest angle of bank; default: the aircraft's usual angle"
    )
    timeout_s: Timeout = Field(default=7200.0, description="the leg fails if it takes longer")

    def places(self) -> tuple[Waypoint, ...]:
        """Return the places of the leg in order, one or more."""
        if self.waypoints:
            return self.waypoints
        return (Waypoint(**{key: getattr(self, key) for key in Waypoint.model_fields}),)

    def label(self, number: int) -> str | None:
        """Return the name of a place of the leg by its number from 0; None for a single place without a name."""
        return self.places()[number].name or (f"waypoint {number + 1}" if self.waypoints else None)

    def end_height(self, height: float) -> float:
        for place in self.places():
            height = height if place.height_m is None else place.height_m
        return height

    def slopes_at(self, height: float, latitude: float, longitude: float) -> list[float]:
        """Return the slope with which each place is passed, from the height and place of the beginning, m and rad:
        level, or on through a route that goes on up or down."""
        means: list[float | None] = []
        for place in self.places():
            target = place.latitude_deg * DEG, place.longitude_deg * DEG
            way = distance(latitude, longitude, *target)
            latitude, longitude = target
            to = height if place.height_m is None else place.height_m
            single = place.slope(1.0) is None and way > 2.0 * self.capture_radius_m
            means.append((to - height) / way if single else None)
            height = to
        after = [*means[1:], None]
        return [
            0.0 if first is None or second is None else passing_slope(first, second)
            for first, second in zip(means, after, strict=True)
        ]

    def height_path(
        self, number: int, height: float, left: float, speed: float, slopes: list[float]
    ) -> HeightPath | None:
        """Return the path of the height to a place, counted from 0, from a height, over the distance left to its
        capture, m, at a mean ground speed, m/s, with `slopes_at`; None if the way is too short."""
        place = self.places()[number]
        to = height if place.height_m is None else place.height_m
        slope = place.slope(speed)
        if slope is not None:
            return at_a_slope(height, to, left, speed, slope)
        return single_slope(height, to, left, speed, slopes[number - 1] if number else 0.0, slopes[number])

    def shortage(self, number: int, height: float, left: float, speed: float) -> str:
        """Say why there is no path of the height to a place; the arguments are those of `height_path`."""
        place = self.places()[number]
        slope = place.slope(speed)
        change = f"from {height:.0f} m to height_m = {place.height_m:g}"
        if slope is None:
            return f"there is no path {change} within {left / 1e3:.1f} km"
        key = "path_deg" if place.path_deg is not None else "vertical_speed_mps"
        needed = length_at_a_slope(height, place.height_m or 0.0, speed, slope)
        return f"{change} at {key} = {getattr(place, key):g} takes {needed / 1e3:.1f} km; {left / 1e3:.1f} km are left"

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: a turn onto each bearing, then straight ahead; see `LegBase.reckon`."""
        slopes = self.slopes_at(plan.altitude, plan.latitude, plan.longitude)
        return sum(self.reckon_place(number, plan, slopes) for number in range(len(self.places())))

    def reckon_place(self, number: int, plan: DeadReckoning, slopes: list[float]) -> float:
        """Advance the dead reckoning, except for its time, to one place of the leg, counted from 0, and return the
        duration, s."""
        place = self.places()[number]
        target = math.radians(place.latitude_deg), math.radians(place.longitude_deg)
        start = plan.altitude
        to = start if place.height_m is None else place.height_m
        if distance(plan.latitude, plan.longitude, *target) <= self.capture_radius_m:
            plan.altitude = to
            return 0.0
        begin = plan.latitude, plan.longitude, plan.heading, plan.turning
        traced = len(plan.trace or ())
        seconds = 0.0
        for _ in range(_ROUNDS):  # a turn onto the bearing of the place from the end of the turn
            towards = plan.heading_along(bearing(plan.latitude, plan.longitude, *target))
            if towards is None:
                return math.inf
            plan.latitude, plan.longitude, plan.heading, plan.turning = begin
            plan.altitude = start
            if plan.trace is not None:
                del plan.trace[traced:]
            seconds = plan.turn(math.remainder(towards - plan.heading, 2.0 * math.pi), self.bank_deg)
        left = max(0.0, distance(plan.latitude, plan.longitude, *target) - self.capture_radius_m)
        ahead = bearing(plan.latitude, plan.longitude, *target)
        if to == start:
            straight = left / max(plan.ground_speed(ahead), 1.0)
            plan.sink(straight)
            seconds += straight
        else:
            seconds += self._reckon_heights(number, plan, left, ahead, slopes)
        back = bearing(*target, plan.latitude, plan.longitude)
        plan.latitude, plan.longitude = target
        plan.move(self.capture_radius_m * math.cos(back), self.capture_radius_m * math.sin(back))
        plan.heading = plan.heading_along(back + math.pi) or 0.0
        return seconds

    def _reckon_heights(
        self, number: int, plan: DeadReckoning, left: float, ahead: float, slopes: list[float]
    ) -> float:
        """Return the time of a way along which the height changes, s, and set the height at its end."""
        start, to = plan.altitude, self.places()[number].height_m
        assert to is not None  # the height changes
        plan.altitude = 0.5 * (start + to)
        path = self.height_path(number, start, left, max(plan.ground_speed(ahead), 1.0), slopes)
        seconds, edges = 0.0, 20
        target = self.places()[number].latitude_deg * DEG, self.places()[number].longitude_deg * DEG
        begin, whole = (plan.latitude, plan.longitude), left + self.capture_radius_m
        for step in range(edges):
            here = left * (1.0 - (step + 0.5) / edges)
            plan.altitude = start + (to - start) * (1.0 - here / left) if path is None else path.at(here)[0]
            seconds += left / edges / max(plan.ground_speed(ahead), 1.0)
            if plan.trace is not None:
                share = 1.0 - (here + self.capture_radius_m) / whole
                east = math.remainder(target[1] - begin[1], 2.0 * math.pi)
                plan.trace.append((begin[0] + share * (target[0] - begin[0]), begin[1] + share * east, plan.altitude))
        plan.altitude = to
        return seconds

    def planned(self, plan: DeadReckoning) -> tuple[PlannedTrack, ...]:
        """Return for each place an arc onto its bearing and the great circle to it; see `LegBase.planned`.

        The next track begins where the place before counts as reached.
        """
        slopes = self.slopes_at(plan.altitude, plan.latitude, plan.longitude)
        tracks = []
        for number in range(len(self.places())):
            begin, level = (plan.latitude, plan.longitude), plan.altitude
            ways = self._turn_onto(number, plan)
            place = self.places()[number]
            target = place.latitude_deg * DEG, place.longitude_deg * DEG
            arc = over_ground(begin, level, ways) if ways else np.array([begin])
            to = level if place.height_m is None else place.height_m
            line = great_circle((arc[-1, 0], arc[-1, 1]), target, _COARSE if to == level else _FINE)
            points = np.vstack((arc, line[1:]))
            heights = np.full(len(points), level)
            if to != level:
                plan.latitude, plan.longitude = begin
                heights = self._planned_heights(number, plan, points, slopes)
                plan.altitude = to
            tracks.append(PlannedTrack(points[:, 0], points[:, 1], heights, level))
            back = bearing(*target, *line[-2])
            plan.latitude, plan.longitude = target
            plan.move(self.capture_radius_m * math.cos(back), self.capture_radius_m * math.sin(back))
            plan.heading = plan.heading_along(back + math.pi) or 0.0
        return tuple(tracks)

    def _turn_onto(self, number: int, plan: DeadReckoning) -> list[tuple[float, float]]:
        """Return the ways of the turn onto the bearing of a place; none if it counts as reached, or the wind is too
        strong."""
        place = self.places()[number]
        target = place.latitude_deg * DEG, place.longitude_deg * DEG
        begin, ways = (plan.latitude, plan.longitude, plan.heading), list[tuple[float, float]]()
        if distance(*begin[:2], *target) <= self.capture_radius_m:
            return ways
        for _ in range(_ROUNDS):
            towards = plan.heading_along(bearing(plan.latitude, plan.longitude, *target))
            if towards is None:
                return []
            plan.latitude, plan.longitude, plan.heading = begin
            plan.ways = []
            plan.turn(math.remainder(towards - plan.heading, 2.0 * math.pi), self.bank_deg)
            ways, plan.ways = [way for way in plan.ways if math.hypot(*way) > 1e-6], None
        return ways

    def _planned_heights(self, number: int, plan: DeadReckoning, points: Array, slopes: list[float]) -> Array:
        """Return the heights at the points of the way to a place, from the beginning of the way, as `_Heights` does."""
        place = self.places()[number]
        target, to = (place.latitude_deg * DEG, place.longitude_deg * DEG), place.height_m
        assert to is not None  # the height changes
        left = distance(plan.latitude, plan.longitude, *target) - self.capture_radius_m
        ahead = bearing(plan.latitude, plan.longitude, *target)
        speed = max(plan.air.ground_speed(plan.airspeed, 0.5 * (plan.altitude + to), ahead), 20.0)
        path = self.height_path(number, plan.altitude, left, speed, slopes)
        if path is None:
            return np.full(len(points), math.nan)
        here = (distance(latitude, longitude, *target) - self.capture_radius_m for latitude, longitude in points)
        return np.array([path.at(max(way, 0.0))[0] for way in here])

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Keep the track on the bearing of each place, and the height on its path; see `LegBase.fly`."""
        pilot.bank_limit = pilot.usual_bank if self.bank_deg is None else self.bank_deg * DEG
        slopes = self.slopes_at(pilot.height, state.latitude, state.longitude)
        for number in range(len(self.places())):
            yield from self._fly_to(number, slopes, pilot, state)
        pilot.heading %= 2.0 * pi
        pilot.bank_limit = pilot.usual_bank

    def _fly_to(self, number: int, slopes: list[float], pilot: Autopilot, state: AircraftState) -> Iterator[None]:
        """Fly to one place."""
        place, label = self.places()[number], self.label(number)
        latitude, longitude = place.latitude_deg * DEG, place.longitude_deg * DEG
        heights = None if place.height_m is None else _Heights(self, number, slopes, pilot, state)
        turned, last, nearest = 0.0, state.psi, math.inf
        while True:
            # Great-circle bearing and distance on the mean sphere.
            east = sin(longitude - state.longitude) * cos(latitude)
            north = cos(state.latitude) * sin(latitude) - sin(state.latitude) * cos(latitude) * cos(
                longitude - state.longitude
            )
            along = sin(state.latitude) * sin(latitude) + cos(state.latitude) * cos(latitude) * cos(
                longitude - state.longitude
            )
            left = _MEAN_RADIUS * atan2(hypot(north, east), along)
            if left < self.capture_radius_m:
                break
            nearest = min(nearest, left)
            turned += remainder(state.psi - last, 2.0 * pi)
            last = state.psi
            if abs(turned) > _CIRCLING:
                radius = state.tas**2 / (G * math.tan(pilot.bank_limit))
                raise LegError(
                    f"the aircraft circles {label or 'the waypoint'}, which lies within its turn: at "
                    f"{state.tas:.0f} m/s and {pilot.bank_limit / DEG:.0f}° of bank a turn has a radius of "
                    f"{radius / 1e3:.1f} km, and the waypoint was never nearer than {nearest / 1e3:.1f} km",
                    f"a larger bank_deg, a lower airspeed, a capture_radius_m above {self.capture_radius_m:g}, or a "
                    "distant waypoint",
                )
            # The heading for this track is the bearing minus the drift angle.
            pilot.heading = atan2(east, north) - remainder(state.track - state.psi, 2.0 * pi)
            if heights is not None:
                heights.follow(left - self.capture_radius_m, atan2(east, north))
            yield
        if heights is not None:
            heights.finish()
        if label is not None:
            pilot.remarks.append(f"{label} reached: {left:.0f} m away, height {state.height:.0f} m")


class _Heights:
    """Sets the autopilot's height along the path to a place."""

    def __init__(
        self, leg: WaypointLeg, number: int, slopes: list[float], pilot: Autopilot, state: AircraftState
    ) -> None:
        self._leg, self._number, self._slopes = leg, number, slopes
        self._pilot, self._state = pilot, state
        self._place, self._label = leg.places()[number], leg.label(number) or "the waypoint"
        self._start = pilot.height if number == 0 or not slopes[number - 1] else state.height
        self._to = self._place.height_m if self._place.height_m is not None else self._start
        self._path: HeightPath | None = None
        self._begun = False
        self._before = self._left = math.inf

    def follow(self, measured: float, ahead: float) -> None:
        """Set the height for the next step from the distance to the capture of the place, m, as known since the last
        slow update, and the bearing of the place, rad."""
        pilot, state = self._pilot, self._state
        closing = state.ground_speed * cos(remainder(state.track - ahead, 2.0 * pi))
        if measured != self._before:
            self._before = self._left = measured
        else:
            self._left -= closing * INTERVAL
        if not self._begun:
            self._plan(measured, ahead)
        if self._path is None:
            return
        height, slope = self._path.at(self._left)
        rate = slope * closing
        # The height's reference moves at the vertical speed: its loop needs it ahead by rate/height_rate.
        pilot.height = height + rate / pilot.height_rate
        pilot.climb_limit = max(pilot.usual_climb, 1.5 * rate + 1.0)
        pilot.descent_limit = max(pilot.usual_descent, -1.5 * rate + 1.0)

    def _plan(self, left: float, ahead: float) -> None:
        """Compute the path, until its beginning is reached."""
        state, pilot = self._state, self._pilot
        middle = 0.5 * (self._start + self._to)
        speed = max(state.air.ground_speed(pilot.airspeed, middle, ahead), 20.0)
        path = self._leg.height_path(self._number, self._start, left, speed, self._slopes)
        if path is None and self._path is None:
            raise LegError(
                f"{self._label} cannot be reached at its height: "
                f"{self._leg.shortage(self._number, self._start, left, speed)}",
                "a steeper path, a smaller change of height, or a waypoint farther away",
            )
        self._path, self._begun = path or self._path, path is None or left <= path.begin
        if self._begun and self._place.slope(1.0) is not None and self._to < self._start:
            pilot.remarks.append(
                f"top of descent to {self._label}: {left / 1e3:.1f} km away, height {state.height:.0f} m"
            )

    def finish(self) -> None:
        """Hold the waypoint's height from here on, and refuse a height that was not reached."""
        pilot, state = self._pilot, self._state
        pilot.height = self._to
        pilot.climb_limit, pilot.descent_limit = pilot.usual_climb, pilot.usual_descent
        if abs(state.height - self._to) > _HEIGHT_LIMIT:
            raise LegError(
                f"{self._label} was reached at a height of {state.height:.0f} m instead of {self._to:g} m",
                "a flatter path, a lower airspeed for a climb, or a waypoint farther away",
            )
