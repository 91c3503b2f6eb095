"""Checks the distance of a motion from the pole of its route, for frames that are oriented along one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sinssim.algorithms import REGISTRY
from sinssim.data import Array, NavState
from sinssim.earth.transverse_route import (
    RADIUS,
    distance_from_pole,
    nearest_allowed,
    normal,
    route_pole,
    sentence,
    too_near,
)
from sinssim.errors import InputError
from sinssim.frames import FRAME_REGISTRY
from sinssim.logs.track_motion import Track
from sinssim.scenario.tables import Tables
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from sinssim.truth.motion import PlacedMotion, TrueEarth
from sinssim.truth.motions.parked_and_great_circle import GreatCircleFlight

_PLACES = 1000
"""Places along a track that are checked; `check_route_flown` checks all."""


class _Approach(NamedTuple):
    """Closest approach of a motion to the pole of its route: distance, m, speed, m/s, and time."""

    latitude: float
    longitude: float
    beside: float
    speed: float
    when: str


def check_route(scenario: Tables) -> None:
    """Raise for a plan that comes too near to the pole of its route, as far as this is known before the flight.

    The place of a vehicle at rest and a great circle are known completely; of a flight, the start and the waypoints.
    """
    navigation = scenario.navigation
    if not FRAME_REGISTRY[navigation.frame].takes_route or navigation.route_deg is None:
        return
    lat_a, lon_a, lat_b, lon_b = map(math.radians, navigation.route_deg)
    pole, step = route_pole((lat_a, lon_a, lat_b, lon_b), 0.0, 0.0, np.zeros(3)), _step(scenario)
    for approach in _approaches(scenario, pole):
        distance = float(distance_from_pole(pole, approach.latitude, approach.longitude)) + approach.beside
        if distance <= float(nearest_allowed(approach.speed, step)):
            nearer = pole if normal(approach.latitude, approach.longitude) @ pole > 0.0 else -pole
            why = sentence(nearer, distance, approach.speed, step, approach.when)
            raise InputError(f"navigation.route_deg: {why}")


def check_route_flown(scenario: Tables, time: Array, truth: NavState) -> None:
    """Raise for a true motion that comes too near to the pole of its route, at the edges of the samples, (N+1,) s."""
    navigation = scenario.navigation
    if not FRAME_REGISTRY[navigation.frame].takes_route:
        return
    route = None
    if navigation.route_deg is not None:
        lat_a, lon_a, lat_b, lon_b = map(math.radians, navigation.route_deg)
        route = lat_a, lon_a, lat_b, lon_b
    latitude, longitude, velocity = truth.latitude, truth.longitude, truth.velocity_ned
    pole = route_pole(route, float(latitude[0]), float(longitude[0]), velocity[0])
    every = slice(None, None, round(_step(scenario) * scenario.imu.rate_hz))
    if len(time[every]) < 2:
        return
    near = too_near(pole, time[every], latitude[every], longitude[every], velocity[every])
    if near is not None:
        raise InputError(f"navigation.{'frame' if route is None else 'route_deg'}: {near[1]}")


def _step(scenario: Tables) -> float:
    """Return the shortest step of the scenario's algorithms, s."""
    known = [REGISTRY[name].samples for name in scenario.navigation.algorithms if name in REGISTRY]
    return min(known, default=1) / scenario.imu.rate_hz


def _approaches(scenario: Tables, pole: Array) -> Iterator[_Approach]:
    match scenario.source:
        case GreatCircleFlight() as circle:
            yield from _on_circle(circle, pole)
        case Track() as track:
            yield from _on_track(track, scenario.truth)
        case FlightPlan() as flight:
            yield from _on_flight(flight)
        case PlacedMotion(travels=False) as rest:
            latitude, longitude, _ = rest.place
            yield _Approach(latitude, longitude, 0.0, 0.0, "all the time")


def _on_circle(circle: GreatCircleFlight, pole: Array) -> Iterator[_Approach]:
    """Yield start, end, and the nearest points of the circle n₀ cos u + t₀ sin u to the pole or its opposite
    between."""
    lat, lon, course = (math.radians(v) for v in (circle.latitude_deg, circle.longitude_deg, circle.course_deg))
    up = normal(lat, lon)
    north = np.array([-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat)])
    ahead = math.cos(course) * north + math.sin(course) * np.array([-math.sin(lon), math.cos(lon), 0.0])
    whole = circle.speed_mps * circle.duration_s / RADIUS
    nearest = math.atan2(ahead @ pole, up @ pole) % math.pi
    angles = [0.0, *np.arange(nearest, whole, math.pi), whole]
    for angle in sorted(angles, key=lambda u: -abs((up * math.cos(u) + ahead * math.sin(u)) @ pole)):
        there = up * math.cos(angle) + ahead * math.sin(angle)
        seconds = angle * RADIUS / circle.speed_mps if angle else 0.0
        latitude, longitude = math.asin(max(-1.0, min(1.0, there[2]))), math.atan2(there[1], there[0])
        yield _Approach(latitude, longitude, 0.0, circle.speed_mps, f"at t = {seconds:.0f} s")


def _on_track(track: Track, earth: TrueEarth) -> Iterator[_Approach]:
    """Yield places along a track."""
    from sinssim.earth.geodetic_coordinates import ecef_to_geodetic

    knots = track.prepared(earth).knots
    rows = np.linspace(0, len(knots.time) - 1, _PLACES).astype(int)
    latitude, longitude, _ = ecef_to_geodetic(knots.position[rows])
    speed = np.linalg.norm(knots.velocity[rows], axis=1)
    for lat, lon, v, t in zip(latitude, longitude, speed, knots.time[rows], strict=True):
        yield _Approach(float(lat), float(lon), 0.0, float(v), f"at t = {t:.0f} s")


def _on_flight(flight: FlightPlan) -> Iterator[_Approach]:
    """Yield the start, and every waypoint, which is passed within its radius."""
    start = flight.at_start()
    slowest = max(0.0, start.true_airspeed() - math.hypot(*start.wind))
    yield _Approach(start.latitude, start.longitude, 0.0, slowest, "at the start")
    for number, (leg, _, plan) in enumerate(flight.reckoned(), start=1):
        if isinstance(leg, WaypointLeg):
            speed = max(0.0, plan.true_airspeed() - math.hypot(*plan.wind))
            when = f"or less at the end of leg {number}, a waypoint"
            for place in leg.places():
                latitude, longitude = math.radians(place.latitude_deg), math.radians(place.longitude_deg)
                yield _Approach(latitude, longitude, leg.capture_radius_m, speed, when)
