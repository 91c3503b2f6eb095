"""The legs of a vehicle on a road or on the sea, in the tables [drive] and [voyage]."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Union

from pydantic import Field

from sinssim.section import A_TURN, Keys, Section

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
