"""The [output] table of a scenario: further coordinates of the recorded motion and solutions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from sinssim.earth.models import ELLIPSOIDS
from sinssim.scenario.sections.choices import known_name
from sinssim.section import Section

COORDINATES: dict[str, str] = {
    "earth-fixed": "position, velocity and attitude in Earth-fixed axes",
    "inertial": "position, absolute velocity and attitude in inertial axes, which are the Earth's at the start",
    "frame": "azimuth, velocity and heading along the axes of wander, free-azimuth or transverse",
    "conditional": "conditional latitude and longitude of the transverse frame's route, velocity and heading",
    **{name: f"latitude, longitude and height on the ellipsoid {name}" for name in ELLIPSOIDS},
}
"""Coordinates beside latitude, longitude, height and velocity north-east-down, by name."""

OF_FRAME: dict[str, tuple[str, ...]] = {
    "inertial": ("inertial",),
    "wander": ("frame",),
    "free-azimuth": ("frame",),
    "transverse": ("frame", "conditional"),
}
"""The coordinates in which a frame computes, which are the default; a frame that is not listed has none of its own."""

Coordinates = Annotated[str, AfterValidator(known_name("kind of coordinates", COORDINATES))]


class OutputSection(Section):
    """Streams beside those of every run: the true motion and each solution in other coordinates."""

    coordinates: tuple[Coordinates, ...] | None = Field(
        default=None,
        description="further coordinates to record: "
        f"{', '.join(COORDINATES)}; by default those in which the frame computes",
    )
    angles: Literal["0..360", "-180..180", "-90..270", "continuous"] | None = Field(
        default=None,
        description="record roll, pitch and heading, with the heading in this range in degrees, or continuous: angles "
        "that count full turns",
    )
