"""The [flight] section of a scenario: aircraft, start, legs in the pilot's words, wind and turbulence.

Airspeeds are calibrated (what the pilot reads), heights are above the ellipsoid, headings are true, clockwise
from north. A leg begins with the heading, height and airspeed that the leg before it was flying.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from sinssim.scenario.aircraft import aircraft_exists
from sinssim.scenario.section import Heading, Latitude, Longitude, NotNegative, Positive, Section, Vector3

Bank = Annotated[float, Field(gt=0.0, le=80.0)]
"""Angle of bank, degrees, without sign: the direction says which way."""

Altitude = Annotated[float, Field(ge=-430.0, le=20_000.0)]
"""Height above the ellipsoid, m; from the Dead Sea's shore to above any of these aircraft."""

Airspeed = Annotated[float, Field(ge=40.0, le=800.0)]
"""Calibrated airspeed, kt."""

Direction = Literal["left", "right"]


def _name(value: Any) -> Any:
    """Take a whole number for a name: the 737 is one, and a shell takes its quotes away."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class LegBase(Section):
    """What every leg has: a time limit.

    Attributes:
        timeout_s: the leg fails if it is not flown within this time, s.
    """

    timeout_s: Positive = Field(default=1800.0, description="the leg fails if it takes longer")


class TakeoffLeg(LegBase):
    """From rest on the runway to a height above it, straight ahead.

    Attributes:
        height_m: height above the runway at which the leg ends, m.
    """

    type: Literal["takeoff"]
    height_m: float = Field(default=300.0, ge=50.0, le=3000.0, description="height above the runway to reach")
    timeout_s: Positive = Field(default=300.0, description="the leg fails if it takes longer")


class ParkedLeg(LegBase):
    """At rest on the runway, brakes set.

    Attributes:
        duration_s: how long, s.
    """

    type: Literal["parked"]
    duration_s: float = Field(gt=0.0, le=86_400.0, description="how long it stands")
    timeout_s: Positive = Field(default=86_400.0, description="the leg fails if it takes longer")


class HoldLeg(LegBase):
    """Straight and level: heading, height and airspeed held; for a duration or until an instant of the flight.

    Attributes:
        duration_s: how long, s.
        until_s: time since the start of the flight at which the leg ends, s.
    """

    type: Literal["hold"]
    duration_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="how long")
    until_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="flight time at which it ends")
    timeout_s: Positive = Field(default=86_400.0, description="the leg fails if it takes longer")

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if (self.duration_s is None) == (self.until_s is None):
            raise ValueError("a hold ends after duration_s or at until_s (flight time): give exactly one of them")
        return self


class AltitudeLeg(LegBase):
    """Climb or descend to a height, the airspeed held.

    Attributes:
        altitude_m: height above the ellipsoid to reach, m.
        vertical_speed_mps: rate of climb or descent, without sign, m/s; None: the aircraft's usual one.
    """

    type: Literal["climb", "descend"]
    altitude_m: Altitude = Field(description="height above the ellipsoid to reach")
    vertical_speed_mps: float | None = Field(
        default=None, gt=0.0, le=150.0, description="rate of climb or descent, positive; default: the aircraft's"
    )


class TurnLeg(LegBase):
    """Level turn to a heading or by an angle.

    Attributes:
        heading_deg: heading to turn to, degrees.
        angle_deg: angle to turn by, degrees; more than 360 is more than a circle.
        direction: which way; None: the shorter one (only with heading_deg).
        bank_deg: angle of bank, degrees; None: the aircraft's usual one.
    """

    type: Literal["turn"]
    heading_deg: Heading | None = Field(default=None, description="heading to turn to")
    angle_deg: float | None = Field(default=None, gt=0.0, le=36_000.0, description="angle to turn by")
    direction: Direction | None = Field(default=None, description="left or right; default: the shorter way")
    bank_deg: Bank | None = Field(default=None, description="angle of bank; default: the aircraft's")

    @model_validator(mode="after")
    def _one_aim(self) -> Self:
        if (self.heading_deg is None) == (self.angle_deg is None):
            raise ValueError("a turn is to heading_deg or by angle_deg: give exactly one of them")
        if self.angle_deg is not None and self.direction is None:
            raise ValueError('a turn by angle_deg needs direction = "left" or "right"')
        return self


class WaypointLeg(LegBase):
    """Fly over a place on the ground, straight to it, height and airspeed held.

    Attributes:
        latitude_deg: latitude, degrees.
        longitude_deg: longitude, degrees.
        capture_radius_m: the leg ends when the place is nearer than this, m.
        bank_deg: greatest angle of bank, degrees; None: the aircraft's usual one.
    """

    type: Literal["waypoint"]
    latitude_deg: Latitude = Field(description="latitude of the waypoint")
    longitude_deg: Longitude = Field(description="longitude of the waypoint")
    capture_radius_m: float = Field(default=500.0, ge=20.0, le=20_000.0, description="it is reached when this near")
    bank_deg: Bank | None = Field(default=None, description="greatest angle of bank; default: the aircraft's")
    timeout_s: Positive = Field(default=7200.0, description="the leg fails if it takes longer")


class RacetrackLeg(LegBase):
    """Two straight legs joined by two half circles, flown a number of times; the first leg is straight ahead.

    Attributes:
        leg_duration_s: duration of a straight leg, s.
        leg_length_m: length of a straight leg over the ground, m.
        direction: which way the turns go.
        bank_deg: angle of bank, degrees; None: the aircraft's usual one.
        laps: how many times round.
    """

    type: Literal["racetrack"]
    leg_duration_s: float | None = Field(default=None, gt=0.0, le=7200.0, description="duration of a straight leg")
    leg_length_m: float | None = Field(default=None, gt=0.0, le=500_000.0, description="length of a straight leg")
    direction: Direction = Field(default="right", description="which way the turns go")
    bank_deg: Bank | None = Field(default=None, description="angle of bank; default: the aircraft's")
    laps: int = Field(default=1, ge=1, le=100, description="how many times round")
    timeout_s: Positive = Field(default=86_400.0, description="the leg fails if it takes longer")

    @model_validator(mode="after")
    def _one_length(self) -> Self:
        if (self.leg_duration_s is None) == (self.leg_length_m is None):
            raise ValueError("a racetrack's straight legs have leg_duration_s or leg_length_m: give exactly one")
        return self


class STurnsLeg(LegBase):
    """S-turns about the present heading: to one side, to the other, and back; good for alignment in motion.

    Attributes:
        swing_deg: heading swing to each side, degrees.
        bank_deg: angle of bank, degrees; None: the aircraft's usual one.
        turns: number of swings.
        duration_s: swings until this time is over, s.
        first: side of the first swing.
    """

    type: Literal["s_turns"]
    swing_deg: float = Field(default=30.0, gt=0.0, le=120.0, description="heading swing to each side")
    bank_deg: Bank | None = Field(default=None, description="angle of bank; default: the aircraft's")
    turns: int | None = Field(default=None, ge=1, le=1000, description="number of swings")
    duration_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="swings until this time is over")
    first: Direction = Field(default="right", description="side of the first swing")
    timeout_s: Positive = Field(default=86_400.0, description="the leg fails if it takes longer")

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if (self.turns is None) == (self.duration_s is None):
            raise ValueError("S-turns end after turns or after duration_s: give exactly one of them")
        return self


class SpeedLeg(LegBase):
    """Accelerate or decelerate to an airspeed, straight and level.

    Attributes:
        airspeed_kt: calibrated airspeed to reach, kt.
    """

    type: Literal["speed"]
    airspeed_kt: Airspeed = Field(description="calibrated airspeed to reach")
    timeout_s: Positive = Field(default=600.0, description="the leg fails if it takes longer")


class DoubletLeg(LegBase):
    """A doublet (one way, then the other) or a step on one control, the autopilot off that axis meanwhile.

    Attributes:
        control: which control.
        amplitude: size, in parts of the control's full travel; positive is stick back, stick right, right pedal.
        duration_s: duration of the step, or of each half of the doublet, s.
        shape: doublet or step.
        recovery_s: straight and level afterwards, s.
    """

    type: Literal["doublet"]
    control: Literal["elevator", "aileron", "rudder"] = Field(description="elevator, aileron or rudder")
    amplitude: float = Field(ge=-1.0, le=1.0, description="in parts of full travel; stick back or right, right pedal")
    duration_s: float = Field(default=1.0, gt=0.0, le=30.0, description="of the step or of each half of the doublet")
    shape: Literal["doublet", "step"] = Field(default="doublet", description="doublet or step")
    recovery_s: NotNegative = Field(default=10.0, description="straight and level afterwards")
    timeout_s: Positive = Field(default=600.0, description="the leg fails if it takes longer")


class LoopLeg(LegBase):
    """A full vertical loop, pulled from level flight and ended in level flight on the same heading.

    Attributes:
        load_factor_g: load factor held through the loop, g.
        recovery_s: level flight afterwards, s.
    """

    type: Literal["loop"]
    load_factor_g: float = Field(default=4.0, ge=2.0, le=9.0, description="load factor held through the loop")
    recovery_s: NotNegative = Field(default=10.0, description="level flight afterwards")
    timeout_s: Positive = Field(default=120.0, description="the leg fails if it takes longer")


class BarrelRollLeg(LegBase):
    """A full roll around a helix, the load factor positive all the way, ended in level flight.

    Attributes:
        direction: which way it rolls.
        duration_s: duration of the roll itself, s.
        load_factor_g: load factor held through the roll, g.
        recovery_s: level flight afterwards, s.
    """

    type: Literal["barrel_roll"]
    direction: Direction = Field(default="right", description="which way it rolls")
    duration_s: float = Field(default=8.0, ge=3.0, le=20.0, description="duration of the roll")
    load_factor_g: float = Field(default=1.5, ge=0.5, le=4.0, description="load factor held through the roll")
    recovery_s: NotNegative = Field(default=10.0, description="level flight afterwards")
    timeout_s: Positive = Field(default=120.0, description="the leg fails if it takes longer")


Leg = Annotated[
    TakeoffLeg
    | ParkedLeg
    | HoldLeg
    | AltitudeLeg
    | TurnLeg
    | WaypointLeg
    | RacetrackLeg
    | STurnsLeg
    | SpeedLeg
    | DoubletLeg
    | LoopLeg
    | BarrelRollLeg,
    Field(discriminator="type"),
]
"""One leg of a flight plan; `type` says which."""


class AirStart(Section):
    """The flight begins in the air, in trimmed straight and level flight.

    Attributes:
        latitude_deg, longitude_deg: place, degrees.
        altitude_m: height above the ellipsoid, m.
        heading_deg: heading, degrees.
        airspeed_kt: calibrated airspeed, kt; None: the aircraft's usual one.
    """

    on: Literal["air"]
    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(description="longitude of the start")
    altitude_m: Altitude = Field(description="height above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="heading")
    airspeed_kt: Airspeed | None = Field(default=None, description="calibrated airspeed; default: the aircraft's")


class RunwayStart(Section):
    """The flight begins at rest on a runway, engines running, brakes set.

    Attributes:
        latitude_deg, longitude_deg: place, degrees.
        altitude_m: height of the runway above the ellipsoid, m.
        heading_deg: heading of the runway, degrees.
    """

    on: Literal["runway"]
    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(description="longitude of the start")
    altitude_m: Annotated[float, Field(ge=-430.0, le=4500.0)] = Field(
        default=0.0, description="height of the runway above the ellipsoid"
    )
    heading_deg: Heading = Field(default=0.0, description="heading of the runway")


Start = Annotated[AirStart | RunwayStart, Field(discriminator="on")]
"""Where and how the flight begins."""


class Gust(Section):
    """One gust of the shape (1 - cos): it rises, stays, falls.

    Attributes:
        start_s: flight time at which it begins, s.
        rise_s, steady_s, fall_s: durations of its three parts, s.
        velocity_ned_mps: the wind's change at its height, north, east, down, m/s.
    """

    start_s: NotNegative = Field(description="flight time at which it begins")
    rise_s: Positive = Field(default=2.0, description="duration of the rise")
    steady_s: NotNegative = Field(default=0.0, description="duration at full strength")
    fall_s: Positive = Field(default=2.0, description="duration of the fall")
    velocity_ned_mps: Vector3 = Field(description="change of the wind at full strength, north, east, down")


class Wind(Section):
    """The air's own motion: steady, and gusts. The wind blows *towards* where its components point.

    Attributes:
        north_mps, east_mps, down_mps: steady wind, m/s.
        gusts: gusts on top.
    """

    north_mps: float = Field(default=0.0, ge=-100.0, le=100.0, description="steady wind towards north")
    east_mps: float = Field(default=0.0, ge=-100.0, le=100.0, description="steady wind towards east")
    down_mps: float = Field(default=0.0, ge=-20.0, le=20.0, description="steady wind downwards")
    gusts: tuple[Gust, ...] = Field(default=(), description="gusts on top of it")


class Turbulence(Section):
    """Dryden turbulence after MIL-F-8785C, seeded by the scenario's seed.

    Attributes:
        severity: row of the specification's table, which sets the strength above 2000 ft: 2 is weak (0.3 m/s at
            3 km), 3 light (1.5 m/s), 4 moderate (2.5 m/s), 6 severe.
        wind_at_6m_mps: wind speed 20 ft above the ground, which sets the strength below 1000 ft, m/s; light
            7.7, moderate 15.4, severe 23.
    """

    severity: int = Field(default=3, ge=1, le=7, description="2 weak, 3 light, 4 moderate, 6 severe")
    wind_at_6m_mps: NotNegative = Field(default=7.7, description="wind speed 6 m above the ground")


class FlightSection(Section):
    """A flight: which aircraft, from where, along which legs, through which air.

    Attributes:
        aircraft: name of the aircraft, a folder with an aircraft.toml.
        start: where and how the flight begins.
        legs: the legs, in order.
        wind: steady wind and gusts.
        turbulence: turbulence; None: calm air.
    """

    aircraft: Annotated[str, BeforeValidator(_name), AfterValidator(aircraft_exists)] = Field(
        description="see `sinssim list aircraft`"
    )
    start: Start
    legs: tuple[Leg, ...] = Field(description="the legs, in order")
    wind: Wind = Field(default=Wind())
    turbulence: Turbulence | None = None

    @model_validator(mode="after")
    def _order_of_legs(self) -> Self:
        if not self.legs:
            raise ValueError("a flight has at least one leg")
        on_ground = self.start.on == "runway"
        height = self.start.altitude_m
        for number, leg in enumerate(self.legs, start=1):
            if on_ground and leg.type not in ("parked", "takeoff"):
                raise ValueError(
                    f"leg {number} ({leg.type}) begins on the runway; the legs before the first in the air "
                    'are "parked" and "takeoff"'
                )
            if not on_ground and leg.type in ("parked", "takeoff"):
                raise ValueError(
                    f'leg {number} ({leg.type}) needs the aircraft at rest on a runway: start with on = "runway"'
                    " and put it before any leg in the air"
                )
            if leg.type == "takeoff":
                on_ground = False
                height += leg.height_m
            if isinstance(leg, AltitudeLeg):
                up = leg.altitude_m - height
                if (up < 0.0) if leg.type == "climb" else (up > 0.0):
                    raise ValueError(
                        f"leg {number} ({leg.type}) goes {'down' if up < 0.0 else 'up'}, from {height:g} m to"
                        f" altitude_m = {leg.altitude_m:g}: give the height to reach, or"
                        f' type = "{"descend" if up < 0.0 else "climb"}"'
                    )
                height = leg.altitude_m
        return self
