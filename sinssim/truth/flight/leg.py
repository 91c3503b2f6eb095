"""The base class of the legs of a flight plan: keys, check, flying; and dead reckoning over the legs without flying.

Legs are in `sinssim.truth.flight.legs`; `docs/extending/leg.md` adds one. In the dead reckoning, each leg begins at the
end of the previous one, on a sphere of the Earth's mean radius, in the wind without gusts. Climbs, turns and changes of
speed are steady; transients of roll and pitch, which take seconds, are neglected.
"""

from __future__ import annotations

import functools
import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import pi, remainder
from typing import Annotated, Any, ClassVar, Literal, TypeAlias, get_args

import numpy as np
from pydantic import AfterValidator, Field

from sinssim.errors import InputError, RunError, SinssimError
from sinssim.system.extensions import Item, class_in, explained, failure, load_module
from sinssim.system.registries import ensure, registered
from sinssim.toml_section import Section, Timeout
from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import HEIGHT, INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.planned_path import SAGITTA, PlannedTrack, over_ground
from sinssim.truth.sampling import FlightEvent
from sinssim.units import DEG, KNOT, listed

GRAVITY = 9.81
"""Gravity for dead reckoning [m/s²]."""

_EARTH_RADIUS = 6371e3  # m
_STEPS = 20  # steps of a climb through air that changes with height in other ways than the standard atmosphere


@dataclass
class DeadReckoning:
    """State of the plan at the end of a leg, which is the beginning of the next leg."""

    performance: Performance
    roll_rate: float  # largest roll rate of the autopilot, rad/s
    airspeed: float  # calibrated, m/s
    altitude: float  # m
    heading: float  # clockwise from north, rad
    # rad
    latitude: float
    longitude: float
    air: Air = field(default_factory=Air)  # the air: wind over height, temperature and pressure
    elapsed: float = 0.0  # since the start of the flight, s
    turning: float = 0.0  # ∫ω² dt of the manoeuvres so far, rad²/s; changes of pitch are small and neglected
    engines: bool = True  # whether the engines run
    # latitude and longitude, rad, and height, m, along the legs, for a picture of the plan; None: not kept
    trace: list[tuple[float, float, float]] | None = None
    # ways north and east over the ground, m, one after another, for the geometry of the plan; None: not kept
    ways: list[tuple[float, float]] | None = None

    @property
    def wind(self) -> tuple[float, float]:
        """Velocity of the air at the present height, north and east, m/s."""
        north, east, _ = self.air.wind(self.altitude)
        return north, east

    def true_airspeed(self) -> float:
        """Return the true airspeed, m/s, by compressible flow in the plan's atmosphere."""
        return self.air.true_airspeed(self.airspeed, self.altitude)

    def move(self, north: float, east: float) -> None:
        """Move the place by a way over the ground, m, on a constant course, as on a rhumb line."""
        before = self.latitude
        self.latitude = max(-0.5 * math.pi, min(0.5 * math.pi, before + north / _EARTH_RADIUS))
        self.longitude += east / (_EARTH_RADIUS * max(math.cos(0.5 * (before + self.latitude)), 1e-3))
        self.mark()

    def mark(self) -> None:
        """Add the present place to the trace, if it is kept."""
        if self.trace is not None:
            self.trace.append((self.latitude, self.longitude, self.altitude))

    def ahead(self, way: float) -> None:
        """Move the place straight ahead over the ground, for example on the runway, m."""
        self.move(way * math.cos(self.heading), way * math.sin(self.heading))

    def straight(self, seconds: float, share: float = 1.0) -> float:
        """Keep the heading for a time in the wind; return it, s. The mean speed ahead through the air is a share of the
        true airspeed."""
        ahead = share * self.true_airspeed() * seconds
        way = (ahead * math.cos(self.heading) + self.wind[0] * seconds,
               ahead * math.sin(self.heading) + self.wind[1] * seconds)  # fmt: skip
        self.sink(seconds)
        self.move(*way)
        if self.ways is not None:
            self.ways.append(way)
        return seconds

    def sink(self, seconds: float) -> None:
        """Let a glider sink at its usual rate for a time, s."""
        if self.performance.glider:
            self.altitude -= self.performance.descent_mps * seconds

    def climb(self, altitude: float, rate: float) -> float:
        """Climb or descend to a height straight ahead at a steady vertical speed, m/s, positive; return the duration,
        s."""
        steps = _STEPS if self.air.varies else 1
        whole, step = abs(altitude - self.altitude) / rate, (altitude - self.altitude) / steps
        for number in range(steps):
            before = self.true_airspeed()
            self.altitude = altitude if number == steps - 1 else self.altitude + step
            after = self.true_airspeed()
            level = self.altitude
            self.straight(whole / steps, 0.5 * (before + after) / after)
            self.altitude = level  # a glider's sink is this descent
        return whole

    def turn_rate(self, bank_deg: float | None) -> float:
        """Return the rate of a level turn, g tan(bank)/V, rad/s, by default at the aircraft's usual angle of bank."""
        return GRAVITY * math.tan(math.radians(bank_deg or self.performance.bank_deg)) / self.true_airspeed()

    def turning_of(self, angle: float, seconds: float, bank_deg: float | None) -> float:
        """Return ∫ω² dt of a turn by an angle, rad, in a time, s, including rolling in and out, rad²/s."""
        bank = math.radians(bank_deg or self.performance.bank_deg)
        return angle**2 / seconds + 2.0 * bank * self.roll_rate if seconds > 0.0 else 0.0

    def turn(self, angle: float, bank_deg: float | None) -> float:
        """Turn by an angle, right positive, rad, at a steady rate in the wind; return the duration, s."""
        if self.ways is not None:
            self.straight(self._rolling_in(angle, bank_deg))
        seconds = abs(angle) / self.turn_rate(bank_deg)
        self.sink(seconds)
        self.turning += self.turning_of(angle, seconds, bank_deg)
        radius, start, end = self.true_airspeed() / self.turn_rate(bank_deg), self.heading, self.heading + angle
        radius = math.copysign(radius, angle)
        if self.trace is not None:
            self._trace_turn(radius, angle, seconds)
        if self.ways is not None:
            self.ways += self._ways_of_turn(radius, angle, seconds)
        north = radius * (math.sin(end) - math.sin(start)) + self.wind[0] * seconds
        east = radius * (math.cos(start) - math.cos(end)) + self.wind[1] * seconds
        self.move(north, east)
        self.heading = end % (2.0 * math.pi)
        return seconds

    def _trace_turn(self, radius: float, angle: float, seconds: float) -> None:
        """Add the places within a turn to the trace."""
        begin, steps = (self.latitude, self.longitude), max(1, round(abs(angle) / 0.1))
        for step in range(1, steps):
            share = step / steps
            heading = self.heading + share * angle
            north = radius * (math.sin(heading) - math.sin(self.heading)) + self.wind[0] * share * seconds
            east = radius * (math.cos(self.heading) - math.cos(heading)) + self.wind[1] * share * seconds
            self.move(north, east)
            self.latitude, self.longitude = begin

    def _rolling_in(self, angle: float, bank_deg: float | None) -> float:
        """Return the time from the beginning of a turn to the arc: half of that of rolling to its bank, which a small
        turn does not reach, s."""
        bank = math.radians(bank_deg or self.performance.bank_deg)
        return 0.5 * min(bank / self.roll_rate, math.sqrt(abs(angle) * self.true_airspeed() / GRAVITY / self.roll_rate))

    def _ways_of_turn(self, radius: float, angle: float, seconds: float) -> list[tuple[float, float]]:
        """Return the ways along a turn, so short that the straight lines are the arc."""
        steps = max(1, math.ceil(abs(angle) * math.sqrt(abs(radius) / (8.0 * SAGITTA))))
        share = np.linspace(0.0, 1.0, steps + 1)
        heading = self.heading + share * angle
        north = radius * np.sin(heading) + self.wind[0] * share * seconds
        east = -radius * np.cos(heading) + self.wind[1] * share * seconds
        return list(zip(np.diff(north).tolist(), np.diff(east).tolist(), strict=True))

    def heading_along(self, track: float) -> float | None:
        """Return the heading that makes good a track over the ground in the wind, rad; None if the wind is too
        strong."""
        across = self.wind[1] * math.cos(track) - self.wind[0] * math.sin(track)
        speed = self.true_airspeed()
        if abs(across) >= speed or self.ground_speed(track) <= 0.0:
            return None
        return (track - math.asin(across / speed)) % (2.0 * math.pi)

    def ground_speed(self, track: float) -> float:
        """Return the speed made good along a track over the ground, m/s."""
        return self.air.ground_speed(self.airspeed, self.altitude, track)


def distance(latitude: float, longitude: float, latitude_to: float, longitude_to: float) -> float:
    """Return the distance between two places on the mean sphere, by the haversine formula, m."""
    sine = math.sin((latitude_to - latitude) / 2.0) ** 2
    sine += math.cos(latitude) * math.cos(latitude_to) * math.sin((longitude_to - longitude) / 2.0) ** 2
    return 2.0 * _EARTH_RADIUS * math.asin(min(1.0, math.sqrt(sine)))


def bearing(latitude: float, longitude: float, latitude_to: float, longitude_to: float) -> float:
    """Return the bearing of the great circle from one place to another, at the first, clockwise from north, rad."""
    apart = longitude_to - longitude
    east = math.sin(apart) * math.cos(latitude_to)
    north = math.cos(latitude) * math.sin(latitude_to) - math.sin(latitude) * math.cos(latitude_to) * math.cos(apart)
    return math.atan2(east, north)


Bank = Annotated[float, Field(gt=0.0, le=80.0)]
"""Angle of bank, degrees, without sign; the key direction gives the side."""

Altitude = Annotated[float, Field(ge=-430.0, le=20_000.0)]
"""Height above the ellipsoid, m; from the shore of the Dead Sea to above the ceiling of any of these aircraft."""

Airspeed = Annotated[float, Field(ge=40.0, le=800.0)]
"""Calibrated airspeed, kt."""

Direction = Literal["left", "right"]

RNP = (0.3, 1.0, 2.0, 4.0, 10.0)
"""Required navigation performance: half the width of the corridor about the planned path, nmi."""


def _of_rnp(value: float) -> float:
    if value not in RNP:
        raise ValueError(f"rnp is {listed([f'{rnp:g}' for rnp in RNP], 'or')} (nmi), not {value:g}")
    return value


Rnp = Annotated[float, AfterValidator(_of_rnp)]
"""One of `RNP`."""

HALF_STEP = 0.5 * INTERVAL
"""Half of the autopilot's step: an instant of the flight counts as reached this long before it [s]."""


class LegError(Exception):
    """Raised by a leg that cannot be flown, with the reason, and a change of the plan that would help."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


_Class: TypeAlias = "type[LegBase]"  # the class has a field of the name type


class LegBase(Section):
    """One leg of a flight plan.

    A subclass adds its keys, among them `type: Literal[...]`, by which a scenario selects it."""

    example: ClassVar[dict[str, Any]] = {}  # keys of a valid leg without `type`, for the reference of the scenario file
    # whether the aircraft is on the runway or in the air at the beginning and the end
    begins: ClassVar[Literal["runway", "air"]] = "air"
    ends: ClassVar[Literal["runway", "air"]] = "air"
    # whether the leg may hold the aircraft still (`Autopilot.standing`); its model is then not stepped
    stands_still: ClassVar[bool] = False
    lands: ClassVar[bool] = False  # whether the aircraft needs what a landing takes, see `Performance.approach_kt`
    # what the aircraft has at the end of the leg: "height", "airspeed" and "heading" of the autopilot
    holds: ClassVar[frozenset[str]] = frozenset({"height", "airspeed", "heading"})
    # what of the leg is planned in space, "track" and "height", see `planned`
    plans: ClassVar[frozenset[str]] = frozenset()
    item: ClassVar[Item | None] = None
    """The file of a leg outside the package."""

    rnp: Rnp | None = Field(
        default=None,
        description="required navigation performance, nmi: judges how far the true path is from the planned one; "
        "default: that of the flight",
    )
    timeout_s: Timeout = Field(default=1800.0, description="the leg fails if it takes longer")
    type: str  # the leg's name in a scenario

    @classmethod
    def own_table(cls, name: str) -> _Class | None:
        """Return the class of a leg outside the package, for the words of a mistake in it."""
        return user_leg(name)

    def end_height(self, height: float) -> float:
        """Return the height at the end of the leg from that at its beginning, m, for the check of a plan before flying;
        by default the same."""
        return height

    @abstractmethod
    def reckon(self, plan: DeadReckoning) -> float:
        """Advance the dead reckoning of a plan, except for its time, to the end of the leg; return the estimated
        duration, s, infinite if the wind makes the end unreachable."""

    def planned(self, plan: DeadReckoning) -> tuple[PlannedTrack, ...]:
        """Advance the dead reckoning of a plan as `reckon` does, from where the leg really begins.

        Returns:
            The planned path, one track for each place of a route; nothing for a leg that is not planned in space.
        """
        begin, level = (plan.latitude, plan.longitude), plan.altitude
        plan.ways = []
        self.reckon(plan)
        ways, plan.ways = [way for way in plan.ways if any(way)], None
        if not ways or "track" not in self.plans:
            return ()
        points = over_ground(begin, level, ways)
        heights = np.full(len(points), level if "height" in self.plans else math.nan)
        return (PlannedTrack(points[:, 0], points[:, 1], heights, level),)

    @abstractmethod
    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Fly the leg: set the targets of the autopilot, and yield once per step of `INTERVAL` until the leg is flown.
        The state is refreshed between steps. The caller monitors the time limit, ground contact and stall; a leg that
        cannot be flown raises a `LegError`."""


def user_leg(name: Any) -> type[LegBase] | None:
    """Return the class of a leg outside the package by its name in a scenario, None if there is none of that name."""
    ensure("legs", name)
    item = registered("legs", name) if isinstance(name, str) else None
    if item is None:
        return None
    wrong = f"the {item.words} cannot be used: {item.file}"
    leg: type[LegBase] = class_in(load_module(item), LegBase, wrong)
    if leg.item is None:
        if get_args(leg.model_fields["type"].annotation) != (name,):
            raise InputError(f'{wrong}: {leg.__name__} needs type: Literal["{name}"], the name of the file.')
        if missing := sorted(getattr(leg, "__abstractmethods__", ())):
            raise InputError(f"{wrong}: {leg.__name__} needs the {listed([f'method {method}' for method in missing])}.")
        leg.item = item
        methods: Any = leg
        methods.end_height = explained(item, leg.end_height, passed=ValueError)  # a plan that cannot be flown
        methods.reckon, methods.fly = explained(item, leg.reckon), _explained_flight(item, leg.fly)
    return leg


def _explained_flight(item: Item, fly: Callable[..., Iterator[None]]) -> Callable[..., Iterator[None]]:
    """Return the method `fly` of a leg outside the package, whose failures name the file and the line."""

    @functools.wraps(fly)
    def explained_fly(*arguments: Any) -> Iterator[None]:
        try:
            yield from fly(*arguments)
        except (SinssimError, LegError):
            raise
        except Exception as error:  # raised by the user's code
            raise RunError(f"the {item.words} failed: {failure(item.file, error)}.") from error

    return explained_fly


def wait(state: AircraftState, until: float) -> Iterator[None]:
    """Let the autopilot hold its targets until an instant of the flight, s."""
    until -= HALF_STEP
    while state.time < until:
        yield


def check_landing(legs: Sequence[LegBase], aircraft: str, performance: Performance) -> None:
    """Raise for a landing of an aircraft whose description does not say how it lands, for a take-off of an aircraft
    that cannot, and for a glider's climb."""
    for number, leg in enumerate(legs, start=1):
        if performance.glider and leg.type == "climb":
            raise InputError(
                f"flight.legs.{number} ({leg.type}): the aircraft {aircraft} is a glider, which only descends."
            )
        if leg.begins == "runway" and not performance.takes_off:
            raise InputError(
                f"flight.legs.{number} ({leg.type}): the aircraft {aircraft} does not take off, as its aircraft.toml "
                'says (performance.takes_off): start with on = "air".'
            )
        if leg.lands and performance.approach_kt is None:
            raise InputError(
                f"flight.legs.{number} ({leg.type}): the aircraft {aircraft} cannot land, because its aircraft.toml "
                "has no performance.approach_kt; give it, with landing_flaps and standing_height_m."
            )


_HEIGHT, _HEADING = 50.0, 5.0 * DEG  # a leg that ends farther from its order than this is not attained [m, rad]
_SPEED, _SPEED_SHARE = 10.0 * KNOT, 0.05  # the same for the airspeed: farther off than both [m/s, of the order]
_TURBULENT = 3.0  # factor of these limits in turbulence
_MISSED = " did not reach its targets: at its end "


def shortfall(
    name: str, leg: LegBase, pilot: Autopilot, state: AircraftState, *, turbulent: bool
) -> FlightEvent | None:
    """Compare the end in the air of a leg, named for example "leg 3 (climb)", with what it ordered; return a sentence
    with what is achieved and ordered, None where both agree. Turbulence moves the aircraft at any instant."""
    misses, more = [], _TURBULENT if turbulent else 1.0
    level = "height" in leg.holds and pilot.vertical == HEIGHT and not pilot.glides
    if level and abs(state.height - pilot.height) > more * _HEIGHT:
        misses.append(f"the height is {state.height:.0f} m instead of {pilot.height:.0f} m")
    off = abs(state.cas - pilot.airspeed)
    if "airspeed" in leg.holds and off > more * max(_SPEED, _SPEED_SHARE * pilot.airspeed):
        misses.append(f"the airspeed is {state.cas / KNOT:.0f} kt instead of {pilot.airspeed / KNOT:.0f} kt")
    if "heading" in leg.holds and abs(remainder(state.psi - pilot.heading, 2.0 * pi)) > more * _HEADING:
        misses.append(f"the heading is {state.psi / DEG % 360.0:.0f}° instead of {pilot.heading / DEG % 360.0:.0f}°")
    return FlightEvent(state.time, f"{name}{_MISSED}{', '.join(misses)}") if misses else None


def not_attained(events: Iterable[FlightEvent]) -> list[str]:
    """Return the sentences of `shortfall` among the events of a flight, each with its time."""
    return [f"{event.text} (at {event.time:.0f} s)." for event in events if _MISSED in event.text]
