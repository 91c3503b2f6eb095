"""A waypoint of a planned route."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sinssim.section import Height, Keys, Latitude, Longitude, Section

_Distance = Annotated[float, Field(gt=0.0, le=1e6)]
_Seconds = Annotated[float, Field(ge=0.0, le=1e9)]


class Waypoint(Section):
    """A waypoint of a planned route; the route turns there with continuous curvature."""

    at_most_one = (Keys(("turn_radius_m", "bank_deg"), "the radius of the turn"),)

    name: str = Field(default="", max_length=60, description="name in events and messages")
    latitude_deg: Latitude = Field(description="latitude")
    longitude_deg: Longitude = Field(description="longitude")
    height_m: Height = Field(
        default=0.0, description="height above the ellipsoid; it changes smoothly from one waypoint to the next"
    )
    speed_mps: Annotated[float, Field(gt=0.0, le=12_000.0)] | None = Field(
        default=None, description="ground speed from this waypoint on; default: that of the previous waypoint"
    )
    turn_radius_m: _Distance | None = Field(
        default=None,
        description="smallest radius of the turn at this waypoint; default: from bank_deg, or the usual "
        "radius of the vehicle",
    )
    bank_deg: Annotated[float, Field(gt=0.0, le=80.0)] | None = Field(
        default=None, description="bank angle that determines the radius v²/(g tan(bank))"
    )
    stop_s: _Seconds = Field(
        default=0.0, description="time at rest at this waypoint, after braking and before accelerating"
    )
