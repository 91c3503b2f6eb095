"""How long a scenario will take, estimated from its plan without flying it."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

from sinssim.errors import InputError
from sinssim.scenario.aircraft import Performance, load_aircraft
from sinssim.scenario.legs import (
    AltitudeLeg,
    BarrelRollLeg,
    DoubletLeg,
    FlightSection,
    HoldLeg,
    Leg,
    LoopLeg,
    ParkedLeg,
    RacetrackLeg,
    SpeedLeg,
    STurnsLeg,
    TakeoffLeg,
    TurnLeg,
    WaypointLeg,
)
from sinssim.scenario.schema import Scenario

_G = 9.81  # m/s²
_KNOT = 1852.0 / 3600.0  # m/s
_EARTH_RADIUS = 6371e3  # m
_BYTES = 350  # of memory that every sample takes: increments, true and measured, states, true and navigated, errors


@dataclass
class _Pilot:
    """Where the plan has got to: what the next leg begins with."""

    performance: Performance
    airspeed: float  # calibrated, m/s
    altitude: float  # m
    heading: float | None  # rad; None where the plan does not say
    place: tuple[float, float] | None  # latitude, longitude, rad; None where the plan does not say
    elapsed: float = 0.0  # s

    def true_airspeed(self) -> float:
        """Return the true airspeed, m/s; density of the standard troposphere, compressibility neglected."""
        density_ratio = math.pow(1.0 - 2.25577e-5 * min(self.altitude, 11_000.0), 4.25588)
        return self.airspeed / math.sqrt(density_ratio)

    def turn(self, angle: float, bank_deg: float | None) -> float:
        """Return the time of a level turn by an angle [rad], s."""
        bank = math.radians(bank_deg or self.performance.bank_deg)
        return angle * self.true_airspeed() / (_G * math.tan(bank))

    def fly(self, leg: Leg) -> float:
        """Return the leg's time, s, and go to its end."""
        place, self.place = self.place, None
        match leg:
            case ParkedLeg():
                self.place = place
                return leg.duration_s
            case TakeoffLeg():
                self.altitude += leg.height_m
                self.airspeed = self.performance.initial_climb_kt * _KNOT
                # The roll at a steady acceleration of a quarter g, then the climb.
                return self.airspeed / (0.25 * _G) + leg.height_m / self.performance.climb_mps
            case HoldLeg():
                return leg.duration_s or max(0.0, (leg.until_s or 0.0) - self.elapsed)
            case AltitudeLeg():
                change, self.altitude = leg.altitude_m - self.altitude, leg.altitude_m
                usual = self.performance.climb_mps if change > 0.0 else self.performance.descent_mps
                return abs(change) / (leg.vertical_speed_mps or usual)
            case TurnLeg():
                return self._turn_leg(leg)
            case WaypointLeg():
                target = math.radians(leg.latitude_deg), math.radians(leg.longitude_deg)
                self.place, self.heading = target, None
                return 0.0 if place is None else _distance(place, target) / self.true_airspeed()
            case RacetrackLeg():
                straight = leg.leg_duration_s or (leg.leg_length_m or 0.0) / self.true_airspeed()
                return leg.laps * 2.0 * (straight + self.turn(math.pi, leg.bank_deg))
            case STurnsLeg():
                # Each swing goes out and comes back.
                return leg.duration_s or (leg.turns or 0) * self.turn(2.0 * math.radians(leg.swing_deg), leg.bank_deg)
            case SpeedLeg():
                change, self.airspeed = leg.airspeed_kt * _KNOT - self.airspeed, leg.airspeed_kt * _KNOT
                return abs(change) / self.performance.acceleration_mps2
            case DoubletLeg():
                return leg.duration_s * (2.0 if leg.shape == "doublet" else 1.0) + leg.recovery_s
            case LoopLeg():
                return 2.0 * math.pi * self.true_airspeed() / (_G * leg.load_factor_g) + leg.recovery_s
            case BarrelRollLeg():
                return leg.duration_s + leg.recovery_s

    def _turn_leg(self, leg: TurnLeg) -> float:
        if leg.angle_deg is not None:
            angle = math.radians(leg.angle_deg)
            side = 1.0 if leg.direction == "right" else -1.0
            self.heading = None if self.heading is None else self.heading + side * angle
            return self.turn(angle, leg.bank_deg)
        target = math.radians(leg.heading_deg or 0.0)
        heading, self.heading = self.heading, target
        if heading is None:
            return self.turn(math.pi / 2.0, leg.bank_deg)  # unknown: half of the longest
        right = (target - heading) % (2.0 * math.pi)
        left = 2.0 * math.pi - right
        angle = {"right": right, "left": left, None: min(right, left)}[leg.direction]
        return self.turn(angle, leg.bank_deg)


def _distance(start: tuple[float, float], end: tuple[float, float]) -> float:
    """Return the distance on a sphere, m (haversine)."""
    sine = math.sin((end[0] - start[0]) / 2.0) ** 2
    sine += math.cos(start[0]) * math.cos(end[0]) * math.sin((end[1] - start[1]) / 2.0) ** 2
    return 2.0 * _EARTH_RADIUS * math.asin(math.sqrt(sine))


def leg_durations(flight: FlightSection) -> list[float]:
    """Estimate how long each leg of a flight takes, wind and transitions neglected.

    Args:
        flight: the flight.

    Returns:
        One duration per leg, s; 0 where the plan does not tell (a waypoint from an unknown place).

    Raises:
        InputError: the aircraft's description is not right.
    """
    performance = load_aircraft(flight.aircraft).performance
    start = flight.start
    airspeed = 0.0 if start.on == "runway" else start.airspeed_kt or performance.cruise_kt
    pilot = _Pilot(
        performance=performance,
        airspeed=airspeed * _KNOT,
        altitude=start.altitude_m,
        heading=math.radians(start.heading_deg),
        place=(math.radians(start.latitude_deg), math.radians(start.longitude_deg)),
    )
    durations = []
    for leg in flight.legs:
        durations.append(pilot.fly(leg))
        pilot.elapsed += durations[-1]
    return durations


def check_times(scenario: Scenario) -> None:
    """Raise for sensors that the run would be too short or too long for, as far as that is known before it.

    How long a flight lasts is an estimate: twice that and ten minutes more are let pass.

    Args:
        scenario: the scenario.

    Raises:
        InputError: a fault that lies outside the run, samples that are too far apart for it, or more than this machine
            can hold.
    """
    imu, lasts = scenario.imu, expected_duration(scenario)
    about, longest = "lasts", lasts
    if (flight := scenario.flight) is not None:
        last = flight.legs[-1]
        known = all(leg_durations(flight)) or (isinstance(last, HoldLeg) and last.until_s is not None)
        about, longest = "lasts about", 2.0 * lasts + 600.0 if known else math.inf
    for number, fault in enumerate(imu.faults, start=1):
        name, begin = ("at_s", fault.at_s) if fault.type == "spike" else ("from_s", fault.from_s)
        if begin > longest or (begin == longest and fault.type != "spike"):
            raise InputError(
                f"imu.faults.{number}.{name} = {begin:g} lies outside the run, which {about} {lasts:.6g} s; a "
                f"{fault.type} begins before it ends."
            )
    if longest * imu.rate_hz < 1.0:
        raise InputError(
            f"imu.rate_hz = {imu.rate_hz:g} gives no sample in a run that {about} {lasts:.6g} s; at least "
            f"{1.0 / lasts:.3g} would give one."
        )
    memory = _memory()
    needed = _BYTES * imu.rate_hz * lasts
    if needed > memory:
        raise InputError(
            f"imu.rate_hz = {imu.rate_hz:g} makes {imu.rate_hz * lasts:.2g} samples in a run that {about} {lasts:.6g} "
            f"s, which need {needed / 1e9:.3g} GB of memory where this machine has {memory / 1e9:.3g}; at most "
            f"{imu.rate_hz * memory / needed:.3g} would fit."
        )


def _memory() -> float:
    """Return how many bytes of memory this machine has, infinitely many if it does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return math.inf


def expected_duration(scenario: Scenario) -> float:
    """Estimate how long a scenario's motion lasts.

    Args:
        scenario: the scenario.

    Returns:
        Duration, s: exact except for a flight, there about right.

    Raises:
        InputError: the aircraft's description is not right.
    """
    if scenario.flight is not None:
        return sum(leg_durations(scenario.flight))
    source = scenario.parked or scenario.great_circle or scenario.motion
    assert source is not None  # one of the four is always there
    return source.duration_s
