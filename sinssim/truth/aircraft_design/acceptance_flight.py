"""The flight that an aircraft has to fly well before it is accepted, and its errors leg by leg.

Climb, turns to both sides, lower and higher airspeed in level flight and descent are each followed by straight and
level flight; a glider descends first, and its height is not judged. A second flight meets a gust from the side and from
below. The errors of a leg are the largest differences from what the leg holds: the height of a turn, the airspeed of a
climb, all three in level flight.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.truth.flight.aircraft import Aircraft, Performance
from sinssim.truth.flight.autopilot import INTERVAL, G
from sinssim.truth.flight.flight_log import CHANNELS, FlightRecord
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.units import DEG, FOOT, KNOT

_SETTLED = 15.0  # part of a hold that counts: its end, after the manoeuvre before it has settled [s]
_HOLD = 30.0  # [s]
_GUST = (0.0, 5.0, -3.0)  # to the east and up, m/s: a moderate gust
_GUST_AT, _GUST_END = 10.0, 60.0  # [s]
_DEGREE = 111e3  # a degree of latitude, nearly [m]
_PATIENCE = 600.0  # a leg that takes longer is not flown [s]
_ENGINES = len(CHANNELS)  # column of the first engine's thrust


@dataclass(frozen=True)
class Limits:
    """Largest errors of one kind of leg; None: the leg does not hold the quantity."""

    height_m: float | None
    airspeed_kt: float | None
    heading_deg: float | None
    rate_deg_s: float | None = None  # largest roll or pitch rate of straight flight: what is left of an oscillation


LIMITS = {
    "hold": Limits(10.0, 5.0, 1.0, 0.6),  # as an instrument pilot holds them, at the tenth of the altitude's 100 ft
    "climb": Limits(None, 10.0, 3.0),
    "descend": Limits(None, 15.0, 3.0),  # idle thrust cannot brake
    "turn": Limits(30.0, 10.0, None),  # 100 ft and 10 kt: the practical test of a turn
    "speed": Limits(30.0, None, 3.0),
    "gust": Limits(30.0, 10.0, 10.0),
}
"""The largest errors of an accepted aircraft, by kind of leg."""


@dataclass(frozen=True)
class LegErrors:
    """The largest errors of a leg."""

    leg: str  # "hold after climb" and so on
    kind: str  # key of `LIMITS`
    height_m: float | None
    airspeed_kt: float | None
    heading_deg: float | None
    rate_deg_s: float | None

    def excess(self) -> str:
        """Return what exceeds its limit in words, "" for nothing."""
        limits, words = asdict(LIMITS[self.kind]), []
        for key, unit in (("height_m", "m"), ("airspeed_kt", "kt"), ("heading_deg", "°"), ("rate_deg_s", "°/s")):
            value, most = getattr(self, key), limits[key]
            if value is not None and most is not None and not value <= most:
                words.append(f"{key.split('_')[0]} {value:.1f} {unit} (limit {most:g} {unit})")
        return f"{self.leg}: {', '.join(words)}" if words else ""


HEIGHTS = (3000.0, 1500.0, 600.0)
"""Heights of a design and of its acceptance flight, m: the first at which an aircraft flies."""


def acceptance_height(aircraft: Aircraft) -> float:
    """Return the height of the acceptance flight of an aircraft by its envelope, m."""
    top = HEIGHTS[0] if aircraft.envelope is None else aircraft.envelope.height_m[-1]
    return next((height for height in HEIGHTS if height <= top), 0.4 * top)


def acceptance_plans(aircraft: str, performance: Performance, height: float) -> list[tuple[FlightPlan, list[str]]]:
    """Return the two flights of an aircraft at a height, m, with the name of each leg.

    Args:
        aircraft: its name or the path of its folder.
        performance: its usual speeds.
        height: height of the flights, m.
    """
    cruise, glides = performance.cruise_kt, performance.glider
    rise = round(min(500.0, 80.0 * performance.climb_mps))
    legs: list[dict[str, Any]] = [{"type": "hold", "duration_s": _HOLD}]
    names = ["hold from the trim"]
    descent = {"type": "descend", "altitude_m": height - 100.0 * performance.descent_mps if glides else height}
    for name, leg in (
        ("descent", descent) if glides else ("climb", {"type": "climb", "altitude_m": height + rise}),
        ("turn right", {"type": "turn", "angle_deg": 120.0, "direction": "right"}),
        ("turn left", {"type": "turn", "angle_deg": 180.0, "direction": "left"}),
        ("slower", {"type": "speed", "airspeed_kt": round(0.9 * cruise, 1)}),
        ("faster", {"type": "speed", "airspeed_kt": cruise}),
        *(() if glides else (("descent", descent),)),
    ):
        legs += [{**leg, "timeout_s": _PATIENCE}, {"type": "hold", "duration_s": _HOLD}]
        names += [name, f"hold after {name}"]
    gust = {"start_s": _GUST_AT, "rise_s": 2.0, "steady_s": 4.0, "fall_s": 2.0, "velocity_ned_mps": _GUST}
    start = {"on": "air", "latitude_deg": 45.0, "longitude_deg": 0.0, "altitude_m": height, "airspeed_kt": cruise}
    plain = {"aircraft": aircraft, "start": start, "legs": legs}
    windy = {
        "aircraft": aircraft, "start": start, "legs": [{"type": "hold", "duration_s": _GUST_END}],
        "wind": {"gusts": [gust]},
    }  # fmt: skip
    return [(FlightPlan.model_validate(plain), names), (FlightPlan.model_validate(windy), ["gust"])]


def standing_height(record: FlightRecord) -> float:
    """Return the height above the ellipsoid at the beginning of a flight from a runway at 0 m, m."""
    from sinssim.earth.geodetic_coordinates import ecef_to_geodetic

    return float(ecef_to_geodetic(np.frombuffer(record.poses)[None, :3] * FOOT)[2][0])


_FINAL, _SETTLING_IN = 6_000.0, 50.0  # glide path of the circuit [m], and the time before it [s]
_CIRCUIT = 300.0  # height of the circuit above the runway [m]


def circuit_plan(aircraft: str, performance: Performance, runway_m: float) -> FlightPlan:
    """Return a flight from a runway of a length, m, and, if there is an airspeed of the approach, back to it.

    The turn onto the approach begins beside the centreline by the diameter of its half circle.
    """
    speed = performance.initial_climb_kt * KNOT
    diameter = 2.0 * speed**2 / (G * math.tan(performance.bank_deg * DEG))
    north, east = -(_FINAL + _SETTLING_IN * speed) / _DEGREE, diameter / (_DEGREE * math.cos(45.0 * DEG))
    legs: list[dict[str, Any]] = [{"type": "take_off", "height_m": _CIRCUIT, "runway_m": runway_m}]
    if performance.approach_kt is not None:
        abeam = {"latitude_deg": 45.0 + north, "longitude_deg": east, "capture_radius_m": 500.0}
        runway = {"latitude_deg": 45.0, "longitude_deg": 0.0, "altitude_m": 0.0, "heading_deg": 0.0,
                  "length_m": runway_m}  # fmt: skip
        legs += [
            {"type": "turn", "angle_deg": 180.0, "direction": "right"}, {"type": "waypoint", **abeam},
            {"type": "turn", "heading_deg": 0.0, "direction": "right"}, {"type": "land", **runway},
        ]  # fmt: skip
    for leg in legs:
        leg["timeout_s"] = 3.0 * _PATIENCE
    start = {"on": "runway", "latitude_deg": 45.0, "longitude_deg": 0.0}
    return FlightPlan.model_validate({"aircraft": aircraft, "start": start, "legs": legs})


def fly_acceptance(aircraft: str, performance: Performance, height: float) -> tuple[LegErrors, ...]:
    """Fly the acceptance flights in this process; return the errors of each leg.

    Raises:
        InputError: a leg cannot be flown: the sentence of the flight says why.
    """
    errors: list[LegErrors] = []
    for plan, names in acceptance_plans(aircraft, performance, height):
        errors += errors_of_legs(plan, fly_plan(plan), names, glides=performance.glider)
    return tuple(errors)


def errors_of_legs(
    plan: FlightPlan, record: FlightRecord, names: list[str], *, glides: bool = False
) -> list[LegErrors]:
    """Return the errors of each leg of a flown plan of `acceptance_plans`, of a glider without those of the height."""
    from sinssim.earth.geodetic_coordinates import ecef_to_geodetic

    poses = np.frombuffer(record.poses).reshape(-1, 6)
    time = np.arange(len(poses)) * INTERVAL
    height = ecef_to_geodetic(poses[:, :3] * FOOT)[2]
    heading = np.unwrap(poses[:, 5])
    columns = np.frombuffer(record.channels).reshape(-1, len(record.channels) // (1 + (len(poses) - 1) // 3))
    names_of = [name for name, _, _, _ in CHANNELS]
    airspeed = columns[:, names_of.index("calibrated_airspeed_mps")] * FOOT / KNOT
    airspeed = np.interp(time, np.arange(len(airspeed)) * 3.0 * INTERVAL, airspeed)
    rates = np.abs(np.gradient(np.unwrap(poses[:, 3:5], axis=0), INTERVAL, axis=0)).max(axis=1) / DEG
    bounds = [event.time for event in record.events if event.text.endswith((" begins", " ends"))]
    start: Any = plan.start
    level, speed, course = start.altitude_m, start.airspeed_kt, float(heading[0])
    errors = []
    for number, (leg, name) in enumerate(zip(plan.legs, names, strict=True)):
        begin, end = bounds[2 * number : 2 * number + 2]
        settled = leg.type == "hold" and name != "gust"
        part = (time >= (end - _SETTLED if settled else begin)) & (time <= end)
        level, speed = getattr(leg, "altitude_m", level), getattr(leg, "airspeed_kt", speed)
        if leg.type == "turn":
            side = 1.0 if getattr(leg, "direction", "right") == "right" else -1.0
            course += side * getattr(leg, "angle_deg", 0.0) * DEG
        kind = "gust" if name == "gust" else leg.type
        limits = LIMITS[kind]
        values = (height - level, airspeed - speed, (heading - course) / DEG, rates)
        asked = (None if glides else limits.height_m, limits.airspeed_kt, limits.heading_deg, limits.rate_deg_s)
        errors.append(LegErrors(name, kind, *(_largest(v[part], a) for v, a in zip(values, asked, strict=True))))
    return errors


def _largest(values: Array, limit: float | None) -> float | None:
    """Return the largest size of values, None where nothing is asked."""
    return None if limit is None else round(float(np.abs(values).max()), 3)


_KEYS = (("height_m", "height, m"), ("airspeed_kt", "airspeed, kt"), ("heading_deg", "heading, °"),
         ("rate_deg_s", "roll or pitch rate, °/s"))  # fmt: skip


def acceptance_numbers(name: str, height: float, errors: Sequence[LegErrors]) -> dict[str, Any]:
    """Return the errors of an acceptance flight as plain numbers with units in the names; `height` is its height, m."""
    return {
        "aircraft": name,
        "height_m": height,
        "accepted": not any(leg_errors.excess() for leg_errors in errors),
        "legs": [{**asdict(leg_errors), "limits": asdict(LIMITS[leg_errors.kind])} for leg_errors in errors],
    }


def acceptance_items(name: str, height: float, errors: Sequence[LegErrors]) -> Iterator[Item]:
    """Yield the verdict on an aircraft and the largest errors of each leg; `height` is that of the flight, m."""
    excess = [words for leg_errors in errors if (words := leg_errors.excess())]
    yield Sentence(
        f"{name} flies the acceptance plan at {height:.0f} m: every leg is within its limits."
        if not excess
        else f"{name} does not hold the limits of the acceptance plan at {height:.0f} m: {'; '.join(excess)}."
    )
    columns = (Column("leg", words=True), *(Column(head) for _, head in _KEYS))
    rows = [(leg_errors.leg, *(_cell(leg_errors, key) for key, _ in _KEYS)) for leg_errors in errors]
    yield Table(columns, rows, title="Largest errors", note="In brackets: limits.")


def _cell(errors: LegErrors, key: str) -> str:
    value, most = getattr(errors, key), getattr(LIMITS[errors.kind], key)
    return "" if value is None else f"{value:.2f} ({most:g})"
