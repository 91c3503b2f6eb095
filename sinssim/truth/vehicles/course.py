"""The course of a vehicle on a road or on the sea: its legs, and speed and heading over time along them.

Changes of speed and of the rate of turn follow S(x) = x − sin(2πx)/2π on 0…1, whose first two derivatives are zero at
both ends. The way ∫v dt and the heading ∫r dt have closed forms with ∫S dx = x²/2 + (cos 2πx − 1)/4π².
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Union

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.toml_section import A_TURN, Keys, Section
from sinssim.truth.sampling import FlightEvent

_Lasting = Annotated[float, Field(gt=0.0, le=86_400.0)]
_Distance = Annotated[float, Field(gt=0.0, le=2e6)]
_Speed = Annotated[float, Field(gt=0.0, le=60.0)]


class Stop(Section):
    """Brake to a standstill and remain at rest."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 60.0}

    type: Literal["stop"]
    duration_s: _Lasting = Field(description="time at rest, after braking")


class Straight(Section):
    """Straight ahead on a constant heading; the speed changes at the beginning of the leg."""

    example: ClassVar[dict[str, Any]] = {"distance_m": 2000.0, "speed_mps": 8.0}
    exactly_one = (Keys(("distance_m", "duration_s"), "a straight leg ends after distance_m or after duration_s"),)

    type: Literal["straight"]
    distance_m: _Distance | None = Field(default=None, description="distance, including the change of speed")
    duration_s: _Lasting | None = Field(default=None, description="duration, including the change of speed")
    speed_mps: _Speed | None = Field(default=None, description="target speed; default: that of the previous leg")


class Turn(Section):
    """A turn at constant speed, with a smooth beginning and end."""

    example: ClassVar[dict[str, Any]] = {"angle_deg": 90.0}

    type: Literal["turn"]
    angle_deg: Annotated[float, A_TURN] = Field(
        ge=-3600.0, le=3600.0, description="change of the heading, right positive"
    )
    rate_deg_s: Annotated[float, Field(gt=0.0, le=60.0)] | None = Field(
        default=None, description="largest rate of the turn; default: the rate that follows from lateral_mps2"
    )


VehicleLeg = Annotated[Union[Straight, Turn, Stop], Field(discriminator="type")]  # noqa: UP007
"""One leg, selected by `type`."""


_RAMP = 0.25
"""Part of a turn at whose beginning and end the rate changes."""
_LEAST_RAMP_S = 2.0
"""Shortest time in which the rate of a turn changes [s]."""


@dataclass(frozen=True)
class Piece:
    """A piece of the motion: the speed changes, or the rate of turn, or neither."""

    # s
    start: float
    lasting: float
    # speed at the beginning, and its change, m/s
    speed: float
    change: float
    # rate of turn at the beginning, and its change, rad/s
    rate: float
    rate_change: float
    # way and heading at the beginning, m and rad
    way: float
    heading: float


@dataclass(frozen=True)
class Course:
    """A vehicle's motion along its course."""

    # m/s and m/s², (K,)
    speed: Array
    acceleration: Array
    # rad and rad/s, (K,)
    heading: Array
    rate: Array
    way: Array  # m, (K,)


class Profile:
    """Speed, heading and way of a vehicle as functions of time."""

    def __init__(
        self, table: str, legs: Iterable[VehicleLeg], heading: float, acceleration: float, lateral: float
    ) -> None:
        """Lay out the legs.

        Args:
            table: name of the table that has the legs.
            heading: heading at the start, rad.
            acceleration: mean acceleration of changes of speed, m/s².
            lateral: lateral acceleration in turns for which no rate is given, m/s².
        """
        self._pieces: list[Piece] = []
        self._at = (0.0, 0.0, 0.0, heading)  # time, speed, way, heading
        events = []
        for number, leg in enumerate(legs, start=1):
            name = f"leg {number} ({leg.type})"
            events.append(FlightEvent(self._at[0], f"{name} begins"))
            if isinstance(leg, Stop):
                self._change_speed(0.0, acceleration)
                self._add(leg.duration_s)
            elif isinstance(leg, Straight):
                self._straight(leg, f"{table}.legs.{number} ({leg.type})", acceleration)
            else:
                self._turn(leg, f"{table}.legs.{number} ({leg.type})", lateral)
            events.append(FlightEvent(self._at[0], f"{name} ends"))
        self.events = tuple(events)
        self.duration = self._at[0]
        self.turning = sum(
            (p.rate + 0.5 * p.rate_change) ** 2 * p.lasting for p in self._pieces if p.rate or p.rate_change
        )
        """About ∫ω² dt of the turns, rad²/s."""

    def _add(self, lasting: float, change: float = 0.0, rate: float = 0.0, rate_change: float = 0.0) -> None:
        time, speed, way, heading = self._at
        self._pieces.append(Piece(time, lasting, speed, change, rate, rate_change, way, heading))
        self._at = (
            time + lasting,
            speed + change,
            way + (speed + 0.5 * change) * lasting,
            heading + (rate + 0.5 * rate_change) * lasting,
        )

    def _change_speed(self, speed: float, acceleration: float) -> None:
        change = speed - self._at[1]
        if change:
            self._add(abs(change) / acceleration, change=change)
            time, _, way, heading = self._at
            self._at = (time, speed, way, heading)  # without a rounding error

    def _straight(self, leg: Straight, name: str, acceleration: float) -> None:
        time, before, way, _ = self._at
        speed = before if leg.speed_mps is None else leg.speed_mps
        if speed == 0.0:
            raise InputError(f"{name}: the vehicle is at rest; give speed_mps, or use a stop.")
        self._change_speed(speed, acceleration)
        if leg.duration_s is not None:
            left = leg.duration_s - (self._at[0] - time)
            ended, of = f"duration_s = {leg.duration_s:g}", f"{self._at[0] - time:.4g} s"
        else:
            left = ((leg.distance_m or 0.0) - (self._at[2] - way)) / speed
            ended, of = f"distance_m = {leg.distance_m:g}", f"{self._at[2] - way:.4g} m"
        if left < 0.0:
            raise InputError(
                f"{name}: {ended} is too short for the change of speed from {before:g} to {speed:g} m/s, which takes "
                f"{of}; give a larger value, or a larger acceleration_mps2."
            )
        if left > 0.0:
            self._add(left)

    def _turn(self, leg: Turn, name: str, lateral: float) -> None:
        speed = self._at[1]
        if speed == 0.0:
            raise InputError(f"{name}: the vehicle is at rest; a turn needs a straight leg with a speed before it.")
        angle = np.radians(leg.angle_deg)
        rate = lateral / speed if leg.rate_deg_s is None else np.radians(leg.rate_deg_s)
        steady = abs(angle) / rate
        ramp = max(_LEAST_RAMP_S, _RAMP * steady)
        steady -= ramp
        if steady < 0.0:  # a small turn: it only begins and ends
            steady, rate = 0.0, abs(angle) / ramp
        rate = np.copysign(rate, angle)
        self._add(ramp, rate_change=rate)
        if steady > 0.0:
            self._add(steady, rate=rate)
        self._add(ramp, rate=rate, rate_change=-rate)

    def at(self, time: Array) -> Course:
        """Return the motion at instants (time: s, (K,); before 0 and after the end, the vehicle moves on
        at its speed)."""
        starts = np.array([piece.start for piece in self._pieces])
        number = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(starts) - 1)
        names = ("start", "lasting", "speed", "change", "rate", "rate_change", "way", "heading")
        of = {name: np.array([getattr(p, name) for p in self._pieces])[number] for name in names}
        into = time - of["start"]
        x = np.clip(into / of["lasting"], 0.0, 1.0)
        turn = 2.0 * np.pi * x
        s = x - np.sin(turn) / (2.0 * np.pi)
        integral = (0.5 * x * x + (np.cos(turn) - 1.0) / (4.0 * np.pi**2)) * of["lasting"]
        beyond = np.maximum(into - of["lasting"], 0.0)
        return Course(
            speed=of["speed"] + of["change"] * s,
            acceleration=of["change"] * (1.0 - np.cos(turn)) / of["lasting"],
            heading=of["heading"] + of["rate"] * into + of["rate_change"] * (integral + beyond),
            rate=of["rate"] + of["rate_change"] * s,
            way=of["way"] + of["speed"] * into + of["change"] * (integral + beyond),
        )
