"""The [flight] section of a scenario: aircraft, start, legs, wind, atmosphere, turbulence; its path by dead reckoning.

Airspeeds are calibrated (the pilot's indication), heights are above the ellipsoid, headings are true, clockwise from
north. A leg begins with the heading, height and airspeed at the end of the previous leg. The legs are in
`sinssim.truth.flight.legs`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, Union, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    SerializeAsAny,
    TypeAdapter,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from sinssim.errors import InputError
from sinssim.system.extensions import Item
from sinssim.system.registries import register
from sinssim.toml_section import Heading, Keys, Latitude, Longitude, Moment, NotNegative, Section
from sinssim.truth.atmosphere import STANDARD_PRESSURE, Air, WindVector, wind_from
from sinssim.truth.flight.aircraft import aircraft_exists, ceiling, load_aircraft
from sinssim.truth.flight.guidance import Guidance
from sinssim.truth.flight.leg import Airspeed, Altitude, DeadReckoning, LegBase, Rnp, check_landing, distance, user_leg
from sinssim.truth.flight.legs import LEGS
from sinssim.truth.flight.planned_path import Begin, PlannedTrack
from sinssim.truth.motion import NORMAL_EARTH, Motion, Mounting, TrueEarth
from sinssim.units import KNOT, listed

_Gradual = Annotated[float, Field(ge=0.01, le=1e6)]
"""Rise or fall time of a gust, s; a shorter one would be a jump between two steps of the flight model."""
_Wind = Annotated[float, Field(ge=-100.0, le=100.0)]
"""m/s: the strongest jet stream."""
_Mps = Annotated[float, Field(ge=0.0, le=100.0)]
_Kt = Annotated[float, Field(ge=0.0, le=194.0)]


class Gust(Section):
    """One gust with a (1 - cos) rise, a steady part and a (1 - cos) fall."""

    start_s: Moment = Field(description="flight time at which the gust begins")
    rise_s: _Gradual = Field(default=2.0, description="duration of the rise")
    steady_s: Moment = Field(default=0.0, description="duration at full strength")
    fall_s: _Gradual = Field(default=2.0, description="duration of the fall")
    velocity_ned_mps: tuple[_Wind, _Wind, _Wind] = Field(
        description="change of the wind at full strength, north, east, down"
    )


def _speed(mps: float | None, kt: float | None) -> float:
    """Return the speed of a wind from one of its two keys, m/s."""
    return mps if mps is not None else (kt or 0.0) * KNOT


def _speed_words(mps: float | None, kt: float | None) -> str:
    return f"{mps:g} m/s" if mps is not None else f"{kt:g} kt"


class WindLevel(Section):
    """The wind at a height. Its north and east components change linearly between two heights."""

    exactly_one = (Keys(("speed_mps", "speed_kt"), "a wind has a speed, speed_mps or speed_kt"),)

    height_m: Altitude = Field(description="height above the ellipsoid")
    from_deg: Heading = Field(description="direction from which the wind blows")
    speed_mps: _Mps | None = Field(default=None, description="speed of the wind")
    speed_kt: _Kt | None = Field(default=None, description="the same in knots, instead of speed_mps")

    def words(self) -> str:
        """Return the level in words, for example "3000 m: from 270°, 20 kt"."""
        return f"{self.height_m:g} m: from {self.from_deg:g}°, {_speed_words(self.speed_mps, self.speed_kt)}"


class Wind(Section):
    """Wind and gusts: from_deg with a speed, or a profile over height, or the components north_mps and east_mps. The
    components give the direction *towards* which the air moves; from_deg gives the direction *from* which the wind
    blows."""

    rules = (
        (lambda s: s._given_twice(),
         "the wind is given twice, by {it}: keep from_deg with speed_mps or speed_kt, or north_mps and east_mps "
         "(towards which the air moves), or [[flight.wind.profile]]"),
        (lambda s: (given := s._given("from_deg", "speed_mps", "speed_kt")) and (s.from_deg is None or len(given) != 2)
         and " and ".join(given),
         "a wind needs from_deg and exactly one of speed_mps and speed_kt; here is {it}"),
        (lambda s: next((pair for pair in pairwise(level.height_m for level in s.profile) if pair[0] >= pair[1]), None),
         "the heights of a wind profile increase: {it[1]:g} m follows {it[0]:g} m"),
    )  # fmt: skip

    from_deg: Heading | None = Field(default=None, description="direction from which the wind blows")
    speed_mps: _Mps | None = Field(default=None, description="speed of the wind")
    speed_kt: _Kt | None = Field(default=None, description="the same in knots, instead of speed_mps")
    north_mps: float = Field(default=0.0, ge=-100.0, le=100.0, description="steady wind towards north")
    east_mps: float = Field(default=0.0, ge=-100.0, le=100.0, description="steady wind towards east")
    down_mps: float = Field(default=0.0, ge=-20.0, le=20.0, description="steady wind downwards")
    profile: tuple[WindLevel, ...] = Field(default=(), description="wind at heights, instead of one wind")
    gusts: tuple[Gust, ...] = Field(default=(), description="gusts, added to the steady wind")

    def _given(self, *keys: str) -> list[str]:
        return [key for key in keys if self.changed(key)]

    def _given_twice(self) -> str:
        """Return the keys of the wind if they are of two of its forms."""
        forms = (("profile",), ("from_deg", "speed_mps", "speed_kt"), ("north_mps", "east_mps"))
        given = [keys for form in forms if (keys := self._given(*form))]
        return listed([key for keys in given for key in keys]) if len(given) > 1 else ""

    def levels(self) -> tuple[tuple[float, WindVector], ...]:
        """Return the heights with their wind, m and m/s, for `sinssim.truth.atmosphere.Air`."""
        if self.profile:
            return tuple(
                (level.height_m, wind_from(level.from_deg, _speed(level.speed_mps, level.speed_kt), self.down_mps))
                for level in self.profile
            )
        if self.from_deg is not None:
            return ((0.0, wind_from(self.from_deg, _speed(self.speed_mps, self.speed_kt), self.down_mps)),)
        return ((0.0, (self.north_mps, self.east_mps, self.down_mps)),)

    def words(self) -> str:
        """Return the wind in words, "none" for calm air without gusts."""
        parts = []
        if self.profile:
            parts.append("; ".join(level.words() for level in self.profile))
        elif self.from_deg is not None:
            parts.append(f"from {self.from_deg:g}°, {_speed_words(self.speed_mps, self.speed_kt)}")
        parts += [
            f"{key} = {getattr(self, key):g}" for key in ("north_mps", "east_mps", "down_mps") if getattr(self, key)
        ]
        for gust in self.gusts:
            north, east, down = gust.velocity_ned_mps
            parts.append(
                f"gust at {gust.start_s:g} s of [{north:g}, {east:g}, {down:g}] m/s north, east, down over "
                f"{gust.rise_s:g} + {gust.steady_s:g} + {gust.fall_s:g} s"
            )
        return ", ".join(parts) or "none"


class Atmosphere(Section):
    """Temperature and pressure of the air. A barometer measures the pressure altitude in this air."""

    isa_deviation_k: float = Field(
        default=0.0, ge=-60.0, le=60.0, description="temperature above that of the standard atmosphere, at all heights"
    )
    sea_level_pressure_hpa: float = Field(default=1013.25, ge=850.0, le=1090.0, description="pressure at sea level")

    def words(self) -> str:
        """Return the atmosphere in words."""
        return f"ISA{self.isa_deviation_k:+g} K, {self.sea_level_pressure_hpa:g} hPa at sea level".replace("-", "−")


_ON_RUNWAY = ", ".join(
    f'"{name}"'
    for leg in sorted(LEGS, key=lambda leg: leg.ends == "air")  # legs that stay on the runway first
    if leg.begins == "runway"
    for name in get_args(leg.model_fields["type"].annotation)
)
_IN_SPACE = ", ".join(
    f'"{name}"' for leg in LEGS if "track" in leg.plans for name in get_args(leg.model_fields["type"].annotation)
)


def _name(value: Any) -> Any:
    """Accept an integer as a name, because a shell removes the quotes of "737"."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


@cache
def _beside(leg: type[LegBase]) -> TypeAdapter[LegBase]:
    """Return the check of a leg outside the package; in a union, a mistake is located as one of the package's legs."""
    either: Any = Annotated[Union[LEGS[0], leg], Field(discriminator="type")]  # noqa: UP007
    return TypeAdapter(either)


def _of_user_too(data: Any, shipped: ValidatorFunctionWrapHandler) -> Any:
    """Check a leg, which may be one outside the package."""
    if isinstance(data, LegBase) and data.item is not None:
        return data
    leg = user_leg(data.get("type")) if isinstance(data, dict) else None
    return shipped(data) if leg is None else _beside(leg).validate_python(data)


if TYPE_CHECKING:
    Leg = LegBase
else:
    Leg = SerializeAsAny[
        Annotated[Union[LEGS], Field(discriminator="type"), WrapValidator(_of_user_too)]  # noqa: UP007
    ]
"""One leg of a flight plan, selected by `type`."""


_SCALE, _SPAN = 533.0, 20.0  # scale of turbulence above 2000 ft (MIL-F-8785C), and a medium wing span, m


Fuel = Annotated[float, Field(gt=0.0)]
_FUEL: Any = Field(
    default=None,
    description="fuel at the start, the same share of the capacity of each tank; default: that of the model",
)


class AirStart(Section):
    """The flight begins in the air, in trimmed straight and level flight."""

    on: Literal["air"]
    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(description="longitude of the start")
    altitude_m: Altitude = Field(description="height above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="heading")
    airspeed_kt: Airspeed | None = Field(
        default=None, description="calibrated airspeed; default: the aircraft's cruise airspeed"
    )
    fuel_kg: Fuel | None = _FUEL


class RunwayStart(Section):
    """The flight begins at rest on a runway or at a gate, brakes set."""

    on: Literal["runway"]
    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(description="longitude of the start")
    altitude_m: Annotated[float, Field(ge=-430.0, le=4500.0)] = Field(
        default=0.0, description="height of the runway above the ellipsoid"
    )
    heading_deg: Heading = Field(default=0.0, description="heading of the runway")
    engines: Literal["running", "off"] = Field(
        default="running", description='engines at the start; "off": the first taxi or take_off starts them'
    )
    fuel_kg: Fuel | None = _FUEL


Start = Annotated[AirStart | RunwayStart, Field(discriminator="on")]
"""Where and how the flight begins."""


class Turbulence(Section):
    """Dryden turbulence according to MIL-F-8785C, with the scenario's seed."""

    severity: int = Field(default=3, ge=1, le=7, description="2 weak, 3 light, 4 moderate, 6 severe")
    wind_at_6m_mps: NotNegative = Field(default=7.7, le=100.0, description="wind speed 6 m above the ground")

    @property
    def roll_rate(self) -> float:
        """1σ of the roll rate of a medium aircraft, rad/s: 1.9 σ_w/√(L b) (MIL-F-8785C)."""
        # vertical gusts: a tenth of the wind near the ground, above it by the severity
        sigma_w = max(0.1 * self.wind_at_6m_mps, self.severity - 1.0)
        return 1.9 * sigma_w / math.sqrt(_SCALE * _SPAN)


class FlightPlan(Motion):
    """A flight: aircraft, start, legs, wind, atmosphere and turbulence."""

    table: ClassVar[str] = "flight"
    travels: ClassVar[bool] = True

    aircraft: Annotated[str, BeforeValidator(_name), AfterValidator(aircraft_exists)] = Field(
        description="see `sinssim list aircraft`"
    )
    start: Start  # where and how the flight begins
    legs: tuple[Leg, ...] = Field(description="the legs, in order")
    wind: Wind = Field(default=Wind())  # wind and gusts
    atmosphere: Atmosphere | None = None  # temperature and pressure of the air; None: the standard atmosphere
    turbulence: Turbulence | None = None  # turbulence; None: calm air
    guidance: Guidance = Guidance()  # what the autopilot and the legs see
    rnp: Rnp | None = Field(
        default=None,
        description="required navigation performance, nmi, of every leg with a planned path: judges how far the true "
        "path is from it",
    )

    def user_items(self) -> list[Item]:
        """Return the files of its legs outside the package."""
        return [item for item in dict.fromkeys(leg.item for leg in self.legs) if item is not None]

    def __reduce__(self) -> Any:
        """Return how another process, as the one that flies, makes the plan: with the legs outside the package."""
        items = self.user_items()
        return (_plan, (type(self), items, self.model_dump())) if items else super().__reduce__()

    def air(self) -> Air:
        """Return the air that the aircraft flies in: wind over height, temperature and pressure."""
        day = self.atmosphere
        if day is None:
            return Air(self.wind.levels())
        standard = day.sea_level_pressure_hpa == 1013.25
        pressure = STANDARD_PRESSURE if standard else 100.0 * day.sea_level_pressure_hpa
        return Air(self.wind.levels(), day.isa_deviation_k, pressure)

    @property
    def mounting(self) -> Mounting:
        """The place of the sensor block in the aircraft."""
        return load_aircraft(self.aircraft).mounting

    def at_start(self) -> DeadReckoning:
        """Return the dead reckoning of the plan at the beginning of its first leg."""
        aircraft, start = load_aircraft(self.aircraft), self.start
        check_landing(self.legs, self.aircraft, aircraft.performance)
        airspeed = 0.0 if start.on == "runway" else start.airspeed_kt or aircraft.performance.cruise_kt
        return DeadReckoning(
            performance=aircraft.performance,
            roll_rate=math.radians(aircraft.autopilot.roll_rate_max_deg_s),
            airspeed=airspeed * KNOT,
            altitude=start.altitude_m,
            heading=math.radians(start.heading_deg),
            latitude=math.radians(start.latitude_deg),
            longitude=math.radians(start.longitude_deg),
            air=self.air(),
            engines=start.on == "air" or start.engines == "running",
        )

    def reckoned(self) -> Iterator[tuple[LegBase, float, DeadReckoning]]:
        """Follow the legs by dead reckoning; return each leg, its estimated duration in s, and the state at its end,
        which the next leg updates in place."""
        plan = self.at_start()
        for leg in self.legs:
            seconds = leg.reckon(plan)
            plan.elapsed += seconds
            yield leg, seconds, plan

    def leg_durations(self) -> list[float]:
        """Estimate the duration of each leg, s, neglecting transitions and gusts; see `dead_reckoning`."""
        durations = []
        for number, (leg, seconds, plan) in enumerate(self.reckoned(), start=1):
            durations.append(seconds)
            if not math.isfinite(seconds):
                north, east = (round(speed, 2) + 0.0 for speed in plan.wind)  # no negative zero
                raise InputError(
                    f"flight.legs.{number} ({leg.type}) cannot be flown: the wind of {north:g} m/s north and {east:g} "
                    f"m/s east is too strong for the airspeed of {plan.true_airspeed():.3g} m/s. Give a weaker wind or "
                    "a higher airspeed."
                )
        return durations

    def duration(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        return sum(self.leg_durations())

    def planned_tracks(self, begins: Sequence[Begin]) -> list[tuple[PlannedTrack, ...]]:
        """Return the planned path of each leg that begins, as far as it is planned in space, see `LegBase.planned`.

        What a leg does not take over from the plan of the leg before it is that of its beginning in a flight.

        Args:
            begins: where the legs begin, of the aircraft's centre of gravity.
        """
        plan, tracks = self.at_start(), []
        ordered = frozenset() if self.start.on == "runway" else frozenset({"height", "heading"})
        for leg, begin in zip(self.legs, begins, strict=False):
            plan.elapsed, plan.latitude, plan.longitude = begin.time, begin.latitude, begin.longitude
            plan.altitude = plan.altitude if "height" in ordered else begin.height
            plan.heading = plan.heading if "heading" in ordered else begin.heading
            planned = leg.planned(plan)
            if plan.performance.glider:  # its height is not planned
                planned = tuple(replace(track, height=np.full_like(track.height, math.nan)) for track in planned)
            tracks.append(planned)
            ordered = frozenset() if leg.ends == "runway" else leg.holds
        return tracks

    def rnp_of(self, number: int) -> float | None:
        """Return the required navigation performance of a leg, counted from 0, nmi; None without one."""
        leg = self.legs[number]
        return (leg.rnp or self.rnp) if "track" in leg.plans else None

    @property
    def usual_speed(self) -> float:
        """The largest usual ground speed, whose effects are small; see `Motion.usual_speed`."""
        return 250.0

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Estimate ∫ω² dt of the manoeuvres (turns, rolling in and out, loops, rolls, doublets) and the turbulence."""
        manoeuvres = [plan.turning for _, _, plan in self.reckoned()][-1]
        return manoeuvres if self.turbulence is None else manoeuvres + self.turbulence.roll_rate**2 * self.duration()

    @model_validator(mode="after")
    def _order_of_legs(self) -> Self:
        if not self.legs:
            raise ValueError("a flight needs at least one leg")
        if self.rnp is not None and not any("track" in leg.plans for leg in self.legs):
            raise ValueError(f"rnp = {self.rnp:g} judges the distance from the planned path, but no leg of this flight "
                             f"has one: legs of the types {_IN_SPACE} have one")  # fmt: skip
        on_ground = self.start.on == "runway"
        height = self.start.altitude_m
        for number, leg in enumerate(self.legs, start=1):
            name = f"leg {number} ({leg.type})"
            if leg.rnp is not None and "track" not in leg.plans:
                raise ValueError(f"{name} has rnp = {leg.rnp:g}, but no planned path in space; legs of the types "
                                 f"{_IN_SPACE} have one")  # fmt: skip
            if on_ground and leg.begins != "runway":
                raise ValueError(
                    f"{name} would begin on the runway; the legs before the first leg in the air are of the types "
                    f"{_ON_RUNWAY}"
                )
            if not on_ground and leg.begins == "runway":
                raise ValueError(
                    f'{name} needs the aircraft at rest on a runway: start with on = "runway" and put this leg before '
                    "any leg in the air"
                )
            on_ground = leg.ends == "runway"
            try:
                height = leg.end_height(height)
            except ValueError as error:
                raise ValueError(f"{name} {error}") from error
        return self


def _plan(kind: type[FlightPlan], items: list[Item], contents: dict[str, Any]) -> FlightPlan:
    register(items)
    return kind.model_validate(contents)


@dataclass(frozen=True)
class PlannedPath:
    """A planned motion."""

    time: list[float]  # instants of the points, s
    # rad
    latitude: list[float]
    longitude: list[float]
    height: list[float]  # above the ellipsoid, m
    speed: list[float]  # over the ground, m/s
    legs: list[tuple[str, float, float]]  # number and type of each leg with its beginning and end, s
    ceiling: list[float]  # ceiling of the aircraft at the airspeed of each point, m; empty if it is unknown


def planned_path(flight: FlightPlan) -> PlannedPath:
    """Follow a flight plan by dead reckoning.

    Within a leg time is shared out by the way over the ground.
    """
    aircraft = load_aircraft(flight.aircraft)
    envelope = None if aircraft.performance.glider else aircraft.envelope
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
