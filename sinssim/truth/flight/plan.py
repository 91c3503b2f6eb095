"""The [flight] section of a scenario: aircraft, start, legs, wind, atmosphere and turbulence.

Airspeeds are calibrated (the pilot's indication), heights are above the ellipsoid, headings are true, clockwise from
north. A leg begins with the heading, height and airspeed at the end of the previous leg. The legs are in
`sinssim.truth.flight.legs`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, Union, get_args

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from sinssim.errors import InputError
from sinssim.section import Heading, Latitude, Longitude, NotNegative, Section
from sinssim.truth.flight.air import STANDARD_PRESSURE, Air
from sinssim.truth.flight.aircraft import aircraft_exists, load_aircraft
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import Airspeed, Altitude, LegBase, check_landing
from sinssim.truth.flight.legs import LEGS
from sinssim.truth.flight.wind import Atmosphere, Wind
from sinssim.truth.motion import NORMAL_EARTH, Motion, Mounting, TrueEarth
from sinssim.units import KNOT

_ON_RUNWAY = ", ".join(
    f'"{name}"'
    for leg in sorted(LEGS, key=lambda leg: leg.ends == "air")  # legs that stay on the runway first
    if leg.begins == "runway"
    for name in get_args(leg.model_fields["type"].annotation)
)


def _name(value: Any) -> Any:
    """Accept an integer as a name, because a shell removes the quotes of "737"."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


if TYPE_CHECKING:
    Leg = LegBase
else:
    Leg = Annotated[Union[LEGS], Field(discriminator="type")]  # noqa: UP007
"""One leg of a flight plan, selected by `type`."""


_SCALE, _SPAN = 533.0, 20.0  # scale of turbulence above 2000 ft (MIL-F-8785C), and a medium wing span, m


class AirStart(Section):
    """The flight begins in the air, in trimmed straight and level flight.

    Attributes:
        latitude_deg, longitude_deg: place, degrees.
        altitude_m: height above the ellipsoid, m.
        heading_deg: heading, degrees.
        airspeed_kt: calibrated airspeed, kt; None: the aircraft's cruise airspeed.
    """

    on: Literal["air"]
    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(description="longitude of the start")
    altitude_m: Altitude = Field(description="height above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="heading")
    airspeed_kt: Airspeed | None = Field(
        default=None, description="calibrated airspeed; default: the aircraft's cruise airspeed"
    )


class RunwayStart(Section):
    """The flight begins at rest on a runway or at a gate, brakes set.

    Attributes:
        latitude_deg, longitude_deg: place, degrees.
        altitude_m: height of the runway above the ellipsoid, m.
        heading_deg: heading of the runway, degrees.
        engines: whether the engines run; `taxi` and `take_off` start them if they do not.
    """

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


Start = Annotated[AirStart | RunwayStart, Field(discriminator="on")]
"""Where and how the flight begins."""


class Turbulence(Section):
    """Dryden turbulence according to MIL-F-8785C, with the scenario's seed.

    Attributes:
        severity: row of the specification's table, which determines the strength above 2000 ft: 2 is weak (0.3 m/s at 3
            km), 3 light (1.8 m/s), 4 moderate (2.9 m/s), 6 severe (7 m/s).
        wind_at_6m_mps: wind speed 20 ft above the ground, which determines the strength below 1000 ft, m/s; light 7.7,
            moderate 15.4, severe 23.
    """

    severity: int = Field(default=3, ge=1, le=7, description="2 weak, 3 light, 4 moderate, 6 severe")
    wind_at_6m_mps: NotNegative = Field(default=7.7, le=100.0, description="wind speed 6 m above the ground")

    @property
    def roll_rate(self) -> float:
        """1σ of the roll rate of a medium aircraft, rad/s: 1.9 σ_w/√(L b) (MIL-F-8785C)."""
        # vertical gusts: a tenth of the wind near the ground, above it by the severity
        sigma_w = max(0.1 * self.wind_at_6m_mps, self.severity - 1.0)
        return 1.9 * sigma_w / math.sqrt(_SCALE * _SPAN)


class FlightPlan(Motion):
    """A flight: aircraft, start, legs, wind, atmosphere and turbulence.

    Attributes:
        aircraft: name of the aircraft, a folder with an aircraft.toml.
        start: where and how the flight begins.
        legs: the legs, in order.
        wind: wind and gusts.
        atmosphere: temperature and pressure of the air; None: the standard atmosphere.
        turbulence: turbulence; None: calm air.
    """

    table: ClassVar[str] = "flight"
    travels: ClassVar[bool] = True

    aircraft: Annotated[str, BeforeValidator(_name), AfterValidator(aircraft_exists)] = Field(
        description="see `sinssim list aircraft`"
    )
    start: Start
    legs: tuple[Leg, ...] = Field(description="the legs, in order")
    wind: Wind = Field(default=Wind())
    atmosphere: Atmosphere | None = None
    turbulence: Turbulence | None = None

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
        """The place of the sensor block in the aircraft.

        Raises:
            InputError: there is no such aircraft.
        """
        return load_aircraft(self.aircraft).mounting

    def at_start(self) -> DeadReckoning:
        """Return the dead reckoning of the plan at the beginning of its first leg.

        Raises:
            InputError: the aircraft's description is invalid.
        """
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
        """Follow the legs by dead reckoning.

        Yields:
            Each leg, its estimated duration in s, and the state at its end, which the next leg updates in place.

        Raises:
            InputError: the aircraft's description is invalid.
        """
        plan = self.at_start()
        for leg in self.legs:
            seconds = leg.reckon(plan)
            plan.elapsed += seconds
            yield leg, seconds, plan

    def leg_durations(self) -> list[float]:
        """Estimate the duration of each leg, s, neglecting transitions and gusts; see `dead_reckoning`.

        Raises:
            InputError: the aircraft's description is invalid, or the wind makes a waypoint unreachable.
        """
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
        """Estimate the duration of the legs; see `Motion.duration`."""
        return sum(self.leg_durations())

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
        on_ground = self.start.on == "runway"
        height = self.start.altitude_m
        for number, leg in enumerate(self.legs, start=1):
            name = f"leg {number} ({leg.type})"
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
