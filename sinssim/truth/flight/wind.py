"""Wind of a flight: by components or as people give it, over height, with gusts; and the temperature of the air."""

from __future__ import annotations

import itertools
from typing import Annotated, Self

from pydantic import Field, model_validator

from sinssim.section import Heading, Keys, Moment, Section
from sinssim.truth.flight.air import WindVector, wind_from
from sinssim.truth.flight.leg import Altitude
from sinssim.units import KNOT

_Gradual = Annotated[float, Field(ge=0.01, le=1e6)]
"""Rise or fall time of a gust, s; a shorter one would be a jump between two steps of the flight model."""
_Wind = Annotated[float, Field(ge=-100.0, le=100.0)]
"""m/s: the strongest jet stream."""
_Mps = Annotated[float, Field(ge=0.0, le=100.0)]
_Kt = Annotated[float, Field(ge=0.0, le=194.0)]


class Gust(Section):
    """One gust with a (1 - cos) rise, a steady part and a (1 - cos) fall.

    Attributes:
        start_s: flight time at which the gust begins, s.
        rise_s, steady_s, fall_s: durations of its three parts, s.
        velocity_ned_mps: change of the wind at full strength, north, east, down, m/s.
    """

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
    """The wind at a height. Its north and east components change linearly between two heights.

    Attributes:
        height_m: height above the ellipsoid, m.
        from_deg: direction from which the wind blows, clockwise from true north, degrees.
        speed_mps, speed_kt: horizontal speed, m/s or kt; exactly one of them.
    """

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
    blows.

    Attributes:
        from_deg: direction from which the wind blows, clockwise from true north, degrees.
        speed_mps, speed_kt: horizontal speed, m/s or kt.
        north_mps, east_mps: steady wind towards north and east, m/s.
        down_mps: steady wind downwards, with any of the forms, m/s.
        profile: wind at heights, instead of the other forms.
        gusts: gusts, added to the wind.
    """

    from_deg: Heading | None = Field(default=None, description="direction from which the wind blows")
    speed_mps: _Mps | None = Field(default=None, description="speed of the wind")
    speed_kt: _Kt | None = Field(default=None, description="the same in knots, instead of speed_mps")
    north_mps: float = Field(default=0.0, ge=-100.0, le=100.0, description="steady wind towards north")
    east_mps: float = Field(default=0.0, ge=-100.0, le=100.0, description="steady wind towards east")
    down_mps: float = Field(default=0.0, ge=-20.0, le=20.0, description="steady wind downwards")
    profile: tuple[WindLevel, ...] = Field(default=(), description="wind at heights, instead of one wind")
    gusts: tuple[Gust, ...] = Field(default=(), description="gusts, added to the steady wind")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        given = [key for key in ("from_deg", "speed_mps", "speed_kt") if getattr(self, key) is not None]
        components = [key for key in ("north_mps", "east_mps") if getattr(self, key)]
        forms = [*(["profile"] if self.profile else []), *given, *components]
        if (self.profile and (given or components)) or (given and components):
            raise ValueError(
                f"the wind is given twice, by {', '.join(forms[:-1])} and {forms[-1]}: keep from_deg with speed_mps or "
                "speed_kt, or north_mps and east_mps (towards which the air moves), or [[flight.wind.profile]]"
            )
        if given and (self.from_deg is None or len(given) != 2):
            raise ValueError(
                f"a wind needs from_deg and exactly one of speed_mps and speed_kt; here is {' and '.join(given)}"
            )
        heights = [level.height_m for level in self.profile]
        for below, above in itertools.pairwise(heights):
            if above <= below:
                raise ValueError(f"the heights of a wind profile increase: {above:g} m follows {below:g} m")
        return self

    def levels(self) -> tuple[tuple[float, WindVector], ...]:
        """Return the heights with their wind, m and m/s, for `sinssim.truth.flight.air.Air`."""
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
        said = []
        if self.profile:
            said.append("; ".join(level.words() for level in self.profile))
        elif self.from_deg is not None:
            said.append(f"from {self.from_deg:g}°, {_speed_words(self.speed_mps, self.speed_kt)}")
        said += [
            f"{key} = {getattr(self, key):g}" for key in ("north_mps", "east_mps", "down_mps") if getattr(self, key)
        ]
        for gust in self.gusts:
            north, east, down = gust.velocity_ned_mps
            said.append(
                f"gust at {gust.start_s:g} s of [{north:g}, {east:g}, {down:g}] m/s north, east, down over "
                f"{gust.rise_s:g} + {gust.steady_s:g} + {gust.fall_s:g} s"
            )
        return ", ".join(said) or "none"


class Atmosphere(Section):
    """Temperature and pressure of the air. A barometer measures the pressure altitude in this air.

    Attributes:
        isa_deviation_k: temperature less that of the standard atmosphere, the same at all heights, K.
        sea_level_pressure_hpa: pressure at sea level, hPa.
    """

    isa_deviation_k: float = Field(
        default=0.0, ge=-60.0, le=60.0, description="temperature above that of the standard atmosphere, at all heights"
    )
    sea_level_pressure_hpa: float = Field(default=1013.25, ge=850.0, le=1090.0, description="pressure at sea level")

    def words(self) -> str:
        """Return the atmosphere in words."""
        return f"ISA{self.isa_deviation_k:+g} K, {self.sea_level_pressure_hpa:g} hPa at sea level".replace("-", "−")
