"""Estimates the duration of a scenario from its plan without flying it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from sinssim.algorithms import PLATFORM
from sinssim.errors import InputError
from sinssim.scenario.sections.one_component import OneComponentSection
from sinssim.scenario.tables import Tables
from sinssim.system.memory import machine_memory
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import LegBase, check_landing
from sinssim.truth.flight.plan import FlightPlan
from sinssim.units import KNOT

_SAMPLE_BYTES, _ALGORITHM_BYTES = 880.0, 176.0
"""Memory per sample while a run is recorded, bytes (420 without a run directory): true and measured increments, true
and navigated states, errors, and copies being written; each further algorithm adds a solution and its errors."""
_PLATFORM_BYTES = 360.0
"""What a platform takes beside its solution: forces, attitude, gimbals, readings, and a further strapdown solution."""
_PLANE_BYTES = 1500.0
"""The same for a one-component run."""


def plan_at_start(flight: FlightPlan) -> DeadReckoning:
    """Return the dead reckoning of a flight plan at its start.

    Args:
        flight: the flight.

    Returns:
        The state at the beginning of the first leg.

    Raises:
        InputError: the aircraft's description is invalid.
    """
    aircraft = load_aircraft(flight.aircraft)
    check_landing(flight.legs, flight.aircraft, aircraft.performance)
    start = flight.start
    airspeed = 0.0 if start.on == "runway" else start.airspeed_kt or aircraft.performance.cruise_kt
    return DeadReckoning(
        performance=aircraft.performance,
        roll_rate=math.radians(aircraft.autopilot.roll_rate_max_deg_s),
        airspeed=airspeed * KNOT,
        altitude=start.altitude_m,
        heading=math.radians(start.heading_deg),
        latitude=math.radians(start.latitude_deg),
        longitude=math.radians(start.longitude_deg),
        air=flight.air(),
        engines=start.on == "air" or start.engines == "running",
    )


def reckon_legs(flight: FlightPlan) -> Iterator[tuple[LegBase, float, DeadReckoning]]:
    """Follow the legs of a flight plan by dead reckoning.

    Args:
        flight: the flight.

    Yields:
        Each leg, its estimated duration in s, and the state at its end, which the next leg updates in place.

    Raises:
        InputError: the aircraft's description is invalid.
    """
    plan = plan_at_start(flight)
    for leg in flight.legs:
        seconds = leg.reckon(plan)
        plan.elapsed += seconds
        yield leg, seconds, plan


def leg_durations(flight: FlightPlan) -> list[float]:
    """Estimate the duration of each leg of a flight, neglecting transitions and gusts; see `dead_reckoning`.

    Args:
        flight: the flight.

    Returns:
        One duration per leg, s.

    Raises:
        InputError: the aircraft's description is invalid, or the wind makes a waypoint unreachable.
    """
    durations = []
    for number, (leg, seconds, plan) in enumerate(reckon_legs(flight), start=1):
        durations.append(seconds)
        if not math.isfinite(seconds):
            north, east = (round(speed, 2) + 0.0 for speed in plan.wind)  # no negative zero
            raise InputError(
                f"flight.legs.{number} ({leg.type}) cannot be flown: the wind of {north:g} m/s north and {east:g} m/s "
                f"east is too strong for the airspeed of {plan.true_airspeed():.3g} m/s. Give a weaker wind or a "
                "higher airspeed."
            )
    return durations


def planned_turning(flight: FlightPlan) -> float:
    """Estimate the rotation in a flight's manoeuvres: turns, rolling in and out, loops, rolls, doublets.

    Args:
        flight: the flight.

    Returns:
        ∫ω² dt of the manoeuvres, rad²/s.

    Raises:
        InputError: the aircraft's description is invalid.
    """
    return [plan.turning for _, _, plan in reckon_legs(flight)][-1]


def check_times(scenario: Tables) -> None:
    """Raise for a run that is too short or too long for its sensors, as far as this is known beforehand.

    The duration of a flight is an estimate, so up to twice the estimate plus ten minutes is accepted.

    Args:
        scenario: the scenario.

    Raises:
        InputError: a fault lies outside the run, the run is shorter than a sample, or the samples exceed this machine's
            memory.
    """
    if scenario.one_component is not None:
        _check_plane(scenario.one_component)
        return
    imu, lasts = scenario.imu, expected_duration(scenario)
    about, longest = "lasts", lasts
    if scenario.flight is not None:
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


def _check_plane(section: OneComponentSection) -> None:
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
    return first + _ALGORITHM_BYTES * (len(scenario.navigation.algorithms) - 1) + more


def expected_duration(scenario: Tables) -> float:
    """Estimate the duration of a scenario's motion.

    Args:
        scenario: the scenario.

    Returns:
        Duration, s: exact except for a flight, for which it is an estimate.

    Raises:
        InputError: the aircraft's description or the track is invalid.
    """
    if scenario.flight is not None:
        return sum(leg_durations(scenario.flight))
    if scenario.track is not None:
        return scenario.track.prepared(scenario.truth).duration
    vehicle = scenario.drive or scenario.voyage
    if vehicle is not None:
        return vehicle.profile.duration
    if scenario.log is not None:
        if scenario.log.to_s is None:
            raise InputError(
                f"the scenario {scenario.name} has recorded sensors ([log]), whose duration is known when their files "
                "are read, as `sinssim run` and `sinssim check` do; nothing else uses such a scenario."
            )
        return scenario.log.to_s - (scenario.log.from_s or 0.0)
    source = scenario.parked or scenario.great_circle or scenario.motion or scenario.turntable or scenario.one_component
    assert source is not None  # a scenario always has one of the seven
    return source.duration_s
