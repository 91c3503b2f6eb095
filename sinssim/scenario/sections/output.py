"""The tables [output] and [recording] of a scenario: further coordinates to record, and what is kept of a run."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from sinssim.earth.models import ELLIPSOIDS
from sinssim.section import Section, known_name

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
    """Streams in addition to those of every run: the true motion and each solution in other coordinates."""

    coordinates: tuple[Coordinates, ...] | None = Field(
        default=None,
        description=f"further coordinates to record: {', '.join(COORDINATES)}; default: those of the navigation frame",
    )
    angles: Literal["0..360", "-180..180", "-90..270", "continuous"] | None = Field(
        default=None,
        description="also record roll, pitch and heading, with the heading in this range in degrees, or as continuous "
        "angles, which count full turns",
    )


Keep = Literal["summary", "report", "streams", "all"]
Detail = Literal["full", "light", "none"]

KEEP: dict[str, str] = {
    "summary": "scenario.toml and summary.json",
    "report": "also report.html",
    "streams": "also every stream in full precision (streams/*.parquet)",
    "all": "also the recording for the viewer (recording.rrd)",
}
"""What is kept of a run, by name; each has what the one before it has."""


class RecordingSection(Section):
    """The files that a run keeps, and the level of detail of its recording."""

    keep: Keep = Field(
        default="all",
        description="contents of the run directory: " + "; ".join(f'"{name}": {what}' for name, what in KEEP.items()),
    )
    detail: Detail = Field(
        default="light",
        description='streams in recording.rrd: "light": the rows that a screen can show, with all extremes, gaps and '
        'the rows around events; "full": every row; "none": no recording. The key applies to keep = "all"; '
        "streams/*.parquet always contains every row",
    )

    @property
    def has_report(self) -> bool:
        """Whether the run directory has a report."""
        return self.keep != "summary"

    @property
    def has_streams(self) -> bool:
        """Whether the run directory has the streams."""
        return self.keep in ("streams", "all")

    @property
    def has_recording(self) -> bool:
        """Whether the run directory has a recording."""
        return self.keep == "all" and self.detail != "none"
