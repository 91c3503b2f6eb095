"""The table [track] of a scenario: recorded or planned motion."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from sinssim.errors import InputError, shortened
from sinssim.logs.formats.registry import FORMATS
from sinssim.system.files import open_file
from sinssim.toml_section import Heading, Keys, LeverArm, Speed
from sinssim.truth.motion import Motion
from sinssim.truth.track.route_waypoint import Waypoint

_Smoothing = Annotated[float, Field(ge=0.0, le=1e4)]
_Distance = Annotated[float, Field(gt=0.0, le=1e6)]
_Seconds = Annotated[float, Field(ge=0.0, le=1e9)]

_OF_FILES = (
    "format", "stream", "attitude", "start_s", "end_s", "height_offset_m", "recorded_point_m", "smoothing_s",
    "height_smoothing_s", "attitude_smoothing_s", "position_sigma_m", "height_sigma_m", "gap_s", "max_speed_mps",
    "speed_mps", "heading_deg",
)  # fmt: skip
_OF_ROUTES = ("acceleration_mps2",)


class TrackSource(Motion):
    """Recorded or planned motion: a file of positions with times, with or without attitude, or waypoints. The program
    computes a smooth curve, along which the ideal sensors are exact; see tracks.md.
    """

    table: ClassVar[str] = "track"
    travels: ClassVar[bool] = True

    at_most_one = (
        Keys(("smoothing_s", "position_sigma_m"), "the smoothing"),
        Keys(("height_smoothing_s", "height_sigma_m"), "the smoothing of the height"),
    )
    rules = (
        (lambda s: (s.file is None) == (not s.waypoints) and (", but not both" if s.waypoints else "."),
         "file (a recorded track) or [[track.waypoints]] (a planned route) is needed{it}"),
        # a scenario that is written out has the defaults, too
        (lambda s: s.waypoints and s.changed(*_OF_FILES), "{it} would have no effect on a planned route: remove it"),
        (lambda s: not s.waypoints and s.changed(*_OF_ROUTES),
         "{it} would have no effect on a recorded track: remove it"),
        (lambda s: s.waypoints and (len(s.waypoints) < 2 or s.waypoints[0].speed_mps is None),
         "a planned route needs at least two waypoints, and waypoints.1.speed_mps"),
    )  # fmt: skip

    file: str | None = Field(default=None, description="recorded track, relative to this file")
    format: str | None = Field(
        default=None, description=f"file format: {', '.join(FORMATS)}; default: recognised from its contents"
    )
    stream: str | None = Field(
        default=None,
        description="stream of a file with several streams; default: the first solution, or else the "
        "first set of fixes",
    )
    vehicle: Literal["aircraft", "land", "sea"] = Field(
        default="land", description="kind of vehicle, which determines the assumed attitude if no attitude was recorded"
    )
    attitude: bool = Field(default=True, description="whether a recorded attitude is used")
    start_s: _Seconds | None = Field(default=None, description="start of the used part, counted from the first sample")
    end_s: _Seconds | None = Field(default=None, description="end of the used part, counted from the first sample")
    height_offset_m: Annotated[float, Field(ge=-1e5, le=1e5)] = Field(
        default=0.0,
        description="value that is added to recorded heights: the height of the geoid if they are above mean sea level",
    )
    recorded_point_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0), description="from the vehicle's reference point to the recorded point, body axes"
    )
    smoothing_s: _Smoothing | None = Field(
        default=None,
        description="smoothing of the position: periods below 2π times this value are removed; with 0 the curve "
        "passes through the samples; default: by cross-validation",
    )
    height_smoothing_s: _Smoothing | None = Field(
        default=None, description="smoothing of the height; default: as smoothing_s"
    )
    attitude_smoothing_s: _Smoothing | None = Field(
        default=None, description="smoothing of a recorded attitude; default: by cross-validation"
    )
    position_sigma_m: _Distance | None = Field(
        default=None, description="instead of smoothing_s: rms horizontal distance of the curve from the samples"
    )
    height_sigma_m: _Distance | None = Field(
        default=None, description="the same for the height; default: as position_sigma_m"
    )
    gap_s: Annotated[float, Field(gt=0.0, le=1e9)] | None = Field(
        default=None,
        description="interval between samples beyond which the gap is bridged at uniform speed; default: 10 s, and at "
        "least 5 median intervals",
    )
    max_speed_mps: Annotated[float, Field(gt=0.0, le=12_000.0)] | None = Field(
        default=None,
        description="speed between two samples above which the file is refused; default: 1500 for an aircraft, 150 on "
        "land, 60 at sea",
    )
    speed_mps: Annotated[float, Field(gt=0.0, le=12_000.0)] | None = Field(
        default=None, description="speed along the path of a file without times"
    )
    pitch: Literal["slope", "flat"] | None = Field(
        default=None, description='assumed pitch; default: "slope", along the path; at sea "flat"'
    )
    standstill_mps: Speed | None = Field(
        default=None,
        description="speed above which the heading follows the motion again; the heading is held when the speed falls "
        "below half this value; "
        "default: 3 for an aircraft, 1 on land, 0.5 at sea",
    )
    heading_deg: Heading | None = Field(default=None, description="heading of a vehicle that never moves")
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=1e3)] | None = Field(
        default=None,
        description="largest acceleration along a planned route; default: 1 for an aircraft and on land, 0.05 at sea",
    )
    waypoints: tuple[Waypoint, ...] = Field(default=(), max_length=10_000, description="a planned route")

    @field_validator("format")
    @classmethod
    def _known_format(cls, name: str | None) -> str | None:
        if name is not None:
            FORMATS.check(name)
        return name

    @model_validator(mode="after")
    def _ends_after_its_start(self) -> Self:
        if self.start_s is not None and self.end_s is not None and self.end_s <= self.start_s:
            raise ValueError(f"end_s = {self.end_s:g} must be later than start_s = {self.start_s:g}")
        return self

    @property
    def what(self) -> str:
        """The file's name, or "N waypoints"."""
        return shortened(self.file) if self.file is not None else f"{len(self.waypoints)} waypoints"

    def digest(self) -> str:
        """Return the SHA-256 of the file, in hexadecimal; "" for a planned route."""
        if self.file is None:
            return ""
        try:
            with open_file(Path(self.file)) as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise InputError(
                f"track.file = {self.file!r} cannot be read: {error.strerror}. Give the path of a recorded track, "
                "relative to the scenario's file."
            ) from error
