"""The path of a flight plan by dead reckoning, for a picture before the flight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.dead_reckoning import distance
from sinssim.truth.flight.plan import FlightPlan
from sinssim.truth.flight.planning.envelope import ceiling
from sinssim.units import KNOT


@dataclass(frozen=True)
class PlannedPath:
    """A planned motion.

    Attributes:
        time: instants of the points, s.
        latitude, longitude: rad.
        height: above the ellipsoid, m.
        speed: over the ground, m/s.
        legs: number and type of each leg with its beginning and end, s.
        ceiling: ceiling of the aircraft at the airspeed of each point, m; empty if it is unknown.
    """

    time: list[float]
    latitude: list[float]
    longitude: list[float]
    height: list[float]
    speed: list[float]
    legs: list[tuple[str, float, float]]
    ceiling: list[float]


def planned_path(flight: FlightPlan) -> PlannedPath:
    """Follow a flight plan by dead reckoning.

    Within a leg time is shared out by the way over the ground.

    Raises:
        InputError: the aircraft's description is invalid.
    """
    envelope = load_aircraft(flight.aircraft).envelope
    plan = flight.at_start()
    path = PlannedPath([], [], [], [], [], [], [])

    def add(time: float, place: tuple[float, float, float], speed: float, airspeed: float) -> None:
        path.time.append(time)
        path.latitude.append(place[0])
        path.longitude.append(place[1])
        path.height.append(place[2])
        path.speed.append(speed)
        if envelope is not None:
            path.ceiling.append(ceiling(envelope, max(airspeed / KNOT, envelope.airspeed_kt[0])))

    begin = plan.latitude, plan.longitude, plan.altitude
    for number, leg in enumerate(flight.legs, start=1):
        plan.trace = []
        before = plan.airspeed
        seconds = leg.reckon(plan)
        if not math.isfinite(seconds):
            break
        places = [begin, *plan.trace, (plan.latitude, plan.longitude, plan.altitude)]
        ways = [distance(*a[:2], *b[:2]) for a, b in pairwise(places)]
        whole, gone = sum(ways), 0.0
        for number_of_place, (way, place) in enumerate(zip([0.0, *ways], places, strict=True)):
            gone += way
            share = gone / whole if whole else float(number_of_place > 0)
            airspeed = before + share * (plan.airspeed - before)
            add(plan.elapsed + share * seconds, place, whole / seconds if seconds else 0.0, airspeed)
        path.legs.append((f"{number} {leg.type}", plan.elapsed, plan.elapsed + seconds))
        plan.elapsed += seconds
        begin = places[-1]
    return path
