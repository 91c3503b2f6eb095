"""The tables of true motions in closed form ([parked], [great_circle]), and [truth]."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from sinssim.earth.models import ELLIPSOIDS
from sinssim.scenario.sections.choices import EllipsoidName, Gravity
from sinssim.section import (
    Duration,
    Heading,
    Height,
    Latitude,
    Longitude,
    Section,
    Source,
    Speed,
)


class ParkedSection(Source):
    """A stationary vehicle at any place on the Earth, including the poles, with any attitude."""

    table: ClassVar[str] = "parked"

    latitude_deg: Latitude = Field(description="geodetic latitude, north positive")
    longitude_deg: Longitude = Field(default=0.0, description="longitude, east positive")
    altitude_m: Height = Field(default=0.0, description="height above the ellipsoid")
    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0, description="roll, right side down positive")
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0, description="pitch, nose up positive")
    heading_deg: Heading = Field(default=0.0, description="heading, clockwise from north")
    duration_s: Duration = Field(description="duration")


class GreatCircleSection(Source):
    """Level flight at constant height and ground speed along a great circle: truth in closed form."""

    table: ClassVar[str] = "great_circle"
    travels: ClassVar[bool] = True

    latitude_deg: Latitude = Field(description="latitude at the start")
    longitude_deg: Longitude = Field(default=0.0, description="longitude at the start")
    altitude_m: Height = Field(default=0.0, description="height above the ellipsoid")
    course_deg: Heading = Field(description="course at the start, clockwise from north")
    speed_mps: Speed = Field(description="ground speed")
    duration_s: Duration = Field(description="duration")


class TruthSection(Section):
    """Gravity model and ellipsoid of the truth."""

    gravity: Gravity = Field(default="normal", description="gravity model, see `sinssim list gravity`")
    ellipsoid: EllipsoidName = Field(
        default="wgs84",
        description=f"one of {', '.join(ELLIPSOIDS)}; the constants of the chapter are inconsistent: ω²a/g_e is 0.6 % "
        f"less than its q",
    )
