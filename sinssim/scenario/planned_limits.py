"""Duration and limits of a plan: those of its sensors, of its aircraft, and of frames along a route near its pole."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import normal
from sinssim.errors import InputError, warn
from sinssim.logs.track import Track
from sinssim.scenario.tables import Tables
from sinssim.strapdown.attitude import PLATFORM, REGISTRY
from sinssim.strapdown.frames import FRAME_REGISTRY
from sinssim.strapdown.frames.route_pole import (
    RADIUS,
    distance_from_pole,
    nearest_allowed,
    route_pole,
    sentence,
    too_near,
)
from sinssim.system.process import machine_memory
from sinssim.truth.flight.aircraft import (
    Envelope,
    Performance,
    best_ceiling,
    ceiling,
    climb_rate,
    descent_rate,
    load_aircraft,
    speed_range,
)
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.leg import DeadReckoning, LegBase, bearing, distance
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from sinssim.truth.motion import Motion, PlacedMotion, TrueEarth
from sinssim.truth.motions.parked_and_great_circle import GreatCircleFlight
from sinssim.truth.one_component import OneComponent
from sinssim.units import KNOT

_SAMPLE_BYTES, _ALGORITHM_BYTES = 880.0, 176.0
"""Memory per sample while a run is recorded, bytes (420 without a run directory): true and measured increments, true
and navigated states, errors, and copies being written; each further algorithm adds a solution and its errors."""
_PLATFORM_BYTES = 360.0
"""What a platform takes beside its solution: forces, attitude, gimbals, readings, and a further strapdown solution."""
_PLANE_BYTES = 1500.0
"""The same for a one-component run."""


def check_times(scenario: Tables) -> None:
    """Raise for a run that is too short or too long for its sensors, as far as this is known beforehand.

    The duration of a flight is an estimate, so up to twice the estimate plus ten minutes is accepted.
    """
    if isinstance(scenario.source, OneComponent):
        _check_plane(scenario.source)
        return
    imu, lasts = scenario.imu, expected_duration(scenario)
    about, longest = "lasts", lasts
    if isinstance(scenario.source, FlightPlan):
        about, longest = "lasts about", 2.0 * lasts + 600.0
    for number, fault in enumerate(imu.faults, start=1):
        name, begin = ("at_s", fault.at_s) if fault.type == "spike" else ("from_s", fault.from_s)
        if begin > longest or (begin == longest and fault.type != "spike"):
            raise InputError(
                f"imu.faults.{number}.{name} = {begin:g} lies outside the run, which {about} {lasts:.6g} s; a "
                f"{fault.type} must begin before the run ends."
            )
    if longest * imu.rate_hz < 1.0:
        raise InputError(
            f"imu.rate_hz = {imu.rate_hz:g} gives no sample in a run that {about} {lasts:.6g} s; at least "
            f"{1.0 / lasts:.3g} would give one."
        )
    memory = machine_memory()
    needed = sample_bytes(scenario) * imu.rate_hz * lasts
    if needed > memory:
        raise InputError(
            f"imu.rate_hz = {imu.rate_hz:g} makes {imu.rate_hz * lasts:.2g} samples in a run that {about} {lasts:.6g} "
            f"s, which need {needed / 1e9:.3g} GB of memory; this machine has {memory / 1e9:.3g} GB. Use at most "
            f"{imu.rate_hz * memory / needed:.3g}."
        )


def _check_plane(section: OneComponent) -> None:
    """Raise for a one-component run that is shorter than an interval, or too long for this machine's memory."""
    intervals, memory = section.duration_s * section.rate_hz, machine_memory()
    if intervals < 1.0:
        raise InputError(
            f"one_component.rate_hz = {section.rate_hz:g} gives no sample in a run of {section.duration_s:g} s; at "
            f"least {1.0 / section.duration_s:.3g} would give one."
        )
    if _PLANE_BYTES * intervals > memory:
        raise InputError(
            f"one_component.rate_hz = {section.rate_hz:g} makes {intervals:.2g} samples in a run of "
            f"{section.duration_s:g} s, which need {_PLANE_BYTES * intervals / 1e9:.3g} GB of memory; this machine "
            f"has {memory / 1e9:.3g} GB. Use at most {memory / (_PLANE_BYTES * section.duration_s):.3g}."
        )


def sample_bytes(scenario: Tables, first: float = _SAMPLE_BYTES) -> float:
    """Return the memory per sample of a run, bytes; `first` is that of a run with one algorithm."""
    more = _PLATFORM_BYTES if PLATFORM in scenario.navigation.algorithms else 0.0
    solutions = len(scenario.navigation.algorithms) - 1 + 3 * len(scenario.navigator) + len(scenario.filters)
    return first + _ALGORITHM_BYTES * solutions + more


def expected_duration(scenario: Tables) -> float:
    """Return the duration of a scenario's motion, s: an estimate for a flight, and exact for any other motion."""
    source = scenario.source
    lasts = source.duration(scenario.truth) if isinstance(source, Motion) else source.known_duration
    if lasts is None:
        raise InputError(
            f"the scenario {scenario.name} has recorded sensors ([log]), whose duration is known when their files are "
            "read, as `sinssim run` and `sinssim check` do; nothing else uses such a scenario."
        )
    if scenario.drop is not None:
        height = scenario.flight.start.altitude_m if scenario.flight else getattr(source, "altitude_m", 0.0)
        return scenario.drop.about(lasts, height)
    return lasts


_LATE = 1.2  # time of a release over the planned duration of a flight, which is right to some percent
_SLACK = 1.03  # what exceeds the envelope by less than this is not refused: it is interpolated
_HEIGHTS = 12  # heights of a climb at which it is judged


@dataclass(frozen=True)
class Finding:
    """A part of a plan that the aircraft cannot fly, or not as it is written."""

    refused: bool  # whether it cannot be flown
    text: str  # a sentence with leg, key, value and what is right


def check_limits(scenario: Tables) -> None:
    """Raise for a flight plan beyond the limits of its aircraft, as far as its aircraft.toml gives them."""
    refused = [finding.text for finding in findings(scenario) if finding.refused]
    if refused:
        raise InputError("\n".join(refused))


def limit_notes(scenario: Tables) -> Iterator[str]:
    """Yield a note on each leg that will be flown otherwise than it is written, and on a release after the flight."""
    yield from (finding.text for finding in findings(scenario) if not finding.refused)
    if scenario.drop is not None and scenario.flight is not None:
        lasts, release = scenario.flight.duration(scenario.truth), scenario.drop.release_s
        if release > _LATE * lasts:
            yield (
                f"drop.release_s = {release:g} is after the flight, which lasts about {lasts:.0f} s by its plan; the "
                "run will refuse it. Release earlier, or let it fly longer."
            )


def warn_of_limits(*scenarios: Tables) -> None:
    """Warn of the legs that an aircraft cannot fly, or not as they are written, once for each sentence.

    The scenarios are one that will be flown, or the cells of a study.
    """
    for text in dict.fromkeys(finding.text for scenario in scenarios for finding in findings(scenario)):
        warn(text)


def findings(scenario: Tables) -> Iterator[Finding]:
    """Yield what exceeds the limits of the aircraft on the legs of a flight, flown straight and without turbulence;
    nothing for another motion, or for an aircraft without [envelope]."""
    flight = scenario.flight
    aircraft = None if flight is None else load_aircraft(flight.aircraft)
    if flight is None or aircraft is None or aircraft.envelope is None:
        return
    judge = _Judge(flight, aircraft.envelope, aircraft.performance)
    ground = 0.0 if flight.start.on == "air" else flight.start.altitude_m
    state = flight.at_start()
    if flight.start.on == "air":
        yield from judge.airspeed("flight.start.airspeed_kt", state.airspeed, state.altitude)
    for number, leg in enumerate(flight.legs, start=1):
        before = replace(state)
        seconds = leg.reckon(state)
        if not math.isfinite(seconds):
            return  # the wind makes the leg impossible, which has its own message
        ground = state.altitude if leg.lands else ground
        if leg.begins == "air" and leg.ends == "air":
            name = f"flight.legs.{number} ({leg.type})"
            yield from judge.leg(name, leg, before, state)
            if state.altitude <= ground:
                yield Finding(
                    True,
                    f"{name} ends at {state.altitude:g} m, but the ground is at {ground:g} m. The ground is at the "
                    "height of the runway after a take-off, otherwise at 0 m. Give a greater height.",
                )
                return
            if seconds > _SLACK * leg.timeout_s and not hasattr(leg, "altitude_m"):
                yield Finding(
                    True, f"{name} takes about {seconds:.0f} s, which is longer than timeout_s = {leg.timeout_s:g}."
                )


@dataclass(frozen=True)
class _Judge:
    """What judges the legs of a flight."""

    flight: FlightPlan
    envelope: Envelope
    performance: Performance

    def leg(self, name: str, leg: LegBase, before: DeadReckoning, after: DeadReckoning) -> Iterator[Finding]:
        """Judge a leg by the states before and after it."""
        if after.airspeed != before.airspeed:
            yield from self.airspeed(f"{name}: airspeed_kt", after.airspeed, after.altitude)
        bank = getattr(leg, "bank_deg", None)
        if bank is not None:
            yield from self.bank(name, bank, after.airspeed, after.altitude)
        if isinstance(leg, WaypointLeg):
            yield from self.route(name, leg, before)
        elif after.altitude < before.altitude and self.performance.glider:
            return  # its sink is not chosen
        elif after.altitude != before.altitude and hasattr(leg, "altitude_m"):
            yield from self.climb(name, leg, before, after)

    def airspeed(self, name: str, airspeed: float, height: float) -> Iterator[Finding]:
        """Judge an airspeed of level flight or of a glide."""
        what = "a steady glide" if self.performance.glider else "level flight"
        speed = airspeed / KNOT
        slow, fast = speed_range(self.envelope, height)
        if not fast:
            top, best = best_ceiling(self.envelope)
            yield Finding(
                True,
                f"{name} = {speed:.4g} at {height:.0f} m: the {self.flight.aircraft} has no {what} at this height; its "
                f"ceiling is about {top:.0f} m at {best:.0f} kt.",
            )
        elif not slow / _SLACK <= speed <= fast * _SLACK:
            yield Finding(
                True,
                f"{name} = {speed:.4g} at {height:.0f} m: {what} of the {self.flight.aircraft} (flaps up) is possible "
                f"from {slow:.0f} to {fast:.0f} kt there.",
            )

    def bank(self, name: str, bank_deg: float, airspeed: float, height: float) -> Iterator[Finding]:
        """Judge a bank angle by the load factor 1/cos φ and the stall, whose airspeed grows with its root."""
        load, speed = 1.0 / math.cos(math.radians(bank_deg)), airspeed / KNOT
        most = self.performance.max_load_factor_g
        slow, _ = speed_range(self.envelope, height)
        if load > most:
            allowed = math.degrees(math.acos(1.0 / most))
            yield Finding(
                True,
                f"{name}: bank_deg = {bank_deg:g} needs {load:.2g} g to stay level; the autopilot of the "
                f"{self.flight.aircraft} allows {most:g} g: give at most {allowed:.0f}.",
            )
        elif slow and speed * _SLACK < slow * math.sqrt(load):
            allowed = math.degrees(math.acos(min(1.0, (slow / speed) ** 2)))
            yield Finding(
                True,
                f"{name}: at bank_deg = {bank_deg:g} the {self.flight.aircraft} stalls below "
                f"{slow * math.sqrt(load):.0f} kt, and it flies at {speed:.0f} kt: give at most {allowed:.0f}, or a "
                "higher airspeed.",
            )

    def climb(self, name: str, leg: LegBase, before: DeadReckoning, after: DeadReckoning) -> Iterator[Finding]:
        """Judge a climb or descent at a constant airspeed."""
        speed, low, high = after.airspeed / KNOT, before.altitude, after.altitude
        heights = [low + (high - low) * step / _HEIGHTS for step in range(_HEIGHTS + 1)]
        wished = getattr(leg, "vertical_speed_mps", None)
        if high < low:
            usual = wished or self.performance.descent_mps
            most = min(descent_rate(self.envelope, height, speed) for height in heights)
            if usual > _SLACK * most:
                yield Finding(False, self._too_steep(f"{name}: vertical_speed_mps = {usual:g}", speed, most))
            return
        yield from self.above_ceiling(f"{name}: altitude_m", high, speed)
        rates = [climb_rate(self.envelope, height, speed) for height in heights]
        usual = wished or self.performance.climb_mps
        if rates[-1] > 0.0:
            step = (high - low) / _HEIGHTS
            takes = sum(step / max(0.1, min(usual, 0.5 * (a + b))) for a, b in pairwise(rates))
            if takes > leg.timeout_s:
                yield Finding(
                    True,
                    f"{name}: timeout_s = {leg.timeout_s:g}: the climb to {high:g} m at {speed:.0f} kt takes "
                    f"{takes:.0f} s with full throttle; give a longer time, or a lower altitude_m.",
                )
            elif wished is not None and wished > _SLACK * min(rates):
                yield Finding(
                    False,
                    f"{name}: vertical_speed_mps = {wished:g}: the {self.flight.aircraft} climbs at "
                    f"{max(min(rates), 0.0):.1f} m/s at most at {high:g} m and {speed:.0f} kt; the climb takes longer.",
                )

    def above_ceiling(self, name: str, height: float, speed: float) -> Iterator[Finding]:
        """Judge a height to climb to."""
        if self.performance.glider:
            yield Finding(True, f"{name} = {height:g}: the {self.flight.aircraft} is a glider, which is lower by then.")
            return
        if climb_rate(self.envelope, height, speed) > 0.0:
            return
        reached = ceiling(self.envelope, speed)
        top, best = best_ceiling(self.envelope)
        better = f", or fly at {best:.0f} kt, where it is about {top:.0f} m" if top > reached + 200.0 else ""
        yield Finding(
            climb_rate(self.envelope, height / _SLACK, speed) <= 0.0,
            f"{name} = {height:g} is above the ceiling of the {self.flight.aircraft} at {speed:.0f} kt, about "
            f"{reached:.0f} m: give a lower height{better}.",
        )

    def circling(
        self, name: str, leg: WaypointLeg, target: tuple[float, float], before: DeadReckoning
    ) -> Iterator[Finding]:
        """Judge a place that may lie within the turn towards it, in calm air."""
        plan, bank = replace(before, trace=None), leg.bank_deg or self.performance.bank_deg
        radius = plan.true_airspeed() / plan.turn_rate(leg.bank_deg)
        plan.ahead(plan.true_airspeed() * math.radians(bank) / plan.roll_rate)  # rolling into the turn
        side = math.copysign(
            0.5 * math.pi, math.sin(bearing(before.latitude, before.longitude, *target) - plan.heading)
        )
        plan.heading += side
        plan.ahead(radius)  # to the centre of the circle
        inside = 0.9 * radius - distance(plan.latitude, plan.longitude, *target)
        if any(plan.wind) or inside <= leg.capture_radius_m:
            return
        yield Finding(
            True,
            f"{name} lies within the turn towards it, whose radius is {radius / 1e3:.1f} km at "
            f"{plan.airspeed / KNOT:.0f} kt and {bank:g}° of bank: the aircraft would circle it. Give a larger "
            f"bank_deg, a lower airspeed, a capture_radius_m above {leg.capture_radius_m:g}, or a waypoint farther "
            "away.",
        )

    def _too_steep(self, what: str, speed: float, most: float) -> str:
        return (
            f"{what}: with idle engines the {self.flight.aircraft} descends at {most:.1f} m/s at {speed:.0f} kt. A "
            "faster descent increases its airspeed; to avoid this, give a slower descent."
        )

    def route(self, name: str, leg: WaypointLeg, before: DeadReckoning) -> Iterator[Finding]:
        """Judge the climbs and descents of a route, place by place."""
        plan = replace(before)
        slopes = leg.slopes_at(plan.altitude, plan.latitude, plan.longitude)
        for number, place in enumerate(leg.places()):
            target = math.radians(place.latitude_deg), math.radians(place.longitude_deg)
            start, left = plan.altitude, distance(plan.latitude, plan.longitude, *target) - leg.capture_radius_m
            ahead = bearing(plan.latitude, plan.longitude, *target)
            if self.performance.glider and place.height_m is not None:
                what = f"{name}: {leg.label(number) or 'the waypoint'}: height_m = {place.height_m:g}"
                yield Finding(True, f"{what}: the {self.flight.aircraft} is a glider, whose height is not chosen.")
            yield from self.circling(f"{name}: {leg.label(number) or 'the waypoint'}", leg, target, plan)
            leg.reckon_place(number, plan, slopes)
            to, speed = plan.altitude, plan.airspeed / KNOT
            if to == start or left <= 0.0:
                continue
            label = f"{name}: {leg.label(number) or 'the waypoint'}, height_m"
            if to > start:
                yield from self.above_ceiling(label, to, speed)
            ground = max(plan.air.ground_speed(plan.airspeed, 0.5 * (start + to), ahead), 1.0)
            path = leg.height_path(number, start, left, ground, slopes)
            if path is None:
                yield Finding(True, f"{label} = {to:g}: {leg.shortage(number, start, left, ground)}.")
                continue
            rate = abs(path.slope) * ground
            if to < start:
                most = min(descent_rate(self.envelope, height, speed) for height in (start, to))
                if rate > _SLACK * most:
                    yield Finding(False, self._too_steep(f"{label} = {to:g} needs {rate:.1f} m/s", speed, most))
            elif rate > _SLACK * (most := min(climb_rate(self.envelope, height, speed) for height in (start, to))) > 0:
                yield Finding(
                    True,
                    f"{label} = {to:g} needs a climb of {rate:.1f} m/s; the {self.flight.aircraft} climbs at "
                    f"{most:.1f} m/s at most at {speed:.0f} kt there: give a lower height, or a place farther away.",
                )


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
