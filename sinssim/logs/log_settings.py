"""The table [log]: recorded sensors, an optional reference solution, and where navigation starts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from sinssim.errors import unknown_name
from sinssim.logs.gnss_outages import Outages
from sinssim.logs.text.column_description import FixColumns, LogDescription, Quantity, SolutionColumns, TriadColumns
from sinssim.logs.text.column_names import UNITS
from sinssim.toml_section import (
    CorrelationTime,
    Factor,
    Heading,
    Height,
    Latitude,
    LeverArm,
    Longitude,
    Moment,
    Noise,
    Positive,
    Section,
    Source,
    Spread,
    TimeSpread,
    Velocity,
    once,
)

TEXT_FORMAT = "text"
"""The format whose columns the section itself describes."""

_INSTANT = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d(\.\d+)?)?")
Offset = Annotated[float, Field(ge=-1e9, le=1e9)]
Lag = Annotated[float, Field(ge=-100.0, le=100.0)]
Noise3 = tuple[Noise, Noise, Noise]


def _is_instant(text: str) -> str:
    if not _INSTANT.fullmatch(text):
        raise ValueError(f'"{text}" is not a date and time such as "2025-07-08 19:34:21.723"')
    return text


Instant = Annotated[str, AfterValidator(_is_instant)]


class LogFile(Section):
    """A recorded file: its place, its format and its clock."""

    file: str = Field(description="path of the file, relative to the scenario's file")
    format: str | None = Field(
        default=None,
        description=f'"{TEXT_FORMAT}" for columns that this table describes, or the name of a format, see logs.md; '
        "default: recognised from the file",
    )
    stream: str | None = Field(
        default=None, description="name of the stream in a file with several streams; default: the only stream"
    )
    clock: Literal["gps", "utc", "unix"] = Field(
        default="gps",
        description="time scale of first_row, and of dates without a time scale; unix: the column of times counts "
        "from 1970, and first_row is in UTC",
    )
    first_row: Instant | None = Field(
        default=None,
        description='time of the first row, "2025-07-08 19:34:21.723", for a file whose times have no date',
    )
    time_offset_s: Offset = Field(
        default=0.0,
        description="value that is added to the file's times: negative if the time stamps are late by this amount",
    )


class LogImu(LogFile, LogDescription):
    """The recorded IMU; the keys of its columns are described in docs/alignment.md."""

    rules = (
        *LogDescription.rules,
        (lambda s: s.gravity is not None and (s.kind != "rates" or s.accel is None),
         'gravity is added to the accelerations of a table [accel], which needs kind = "rates"'),
    )  # fmt: skip

    readings: Literal["instantaneous", "mean"] = Field(
        default="instantaneous",
        description='for kind = "rates": values at the time stamps, or means over the interval that ends at the time '
        "stamp",
    )
    stamps: Literal["as-given", "even"] = Field(
        default="as-given",
        description="even: the IMU samples evenly and only the time stamps jitter; a straight line through them is "
        "used",
    )
    clock_drift_ppm: Annotated[float, Field(ge=-1e5, le=1e5)] = Field(
        default=0.0,
        description="how much faster the clock of the IMU runs than that of the other files; its times since the first "
        "row are divided by 1 + 1e-6 of this",
    )
    check_scale: bool = Field(
        default=True, description="whether a specific force that is impossible for a vehicle on the Earth is refused"
    )
    max_gap_s: Annotated[float, Field(ge=0.0, le=10.0)] = Field(
        default=0.1, description="longest gap that is bridged by linear interpolation; a longer one stops the run"
    )
    gravity: TriadColumns | None = Field(
        default=None,
        description="columns and unit of a gravity vector that is added to accelerations without gravity (linear or "
        "user acceleration); its signs are those under which the sum is a specific force",
    )

    @model_validator(mode="after")
    def _gravity_is_a_part(self) -> Self:
        if self.gravity is None or self.accel is None:
            return self
        if self.gravity.unit not in UNITS["accel", "rates"]:
            raise unknown_name("unit of gravity", self.gravity.unit, UNITS["accel", "rates"])
        if self.gravity.model_dump(exclude={"signs", "unit"}) == self.accel.model_dump(exclude={"signs", "unit"}):
            raise ValueError("gravity and accel have the same columns of the same file")
        return self


class _Position(LogFile, FixColumns):
    """A file with positions."""

    lever_arm_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0),
        description="from the sensor block to the antenna or reference point, in the axes of the sensor block",
    )
    geoid_height_m: Annotated[float, Field(ge=-120.0, le=120.0)] = Field(
        default=0.0,
        description="value that is added to the heights: the height of the geoid above the ellipsoid if "
        "they refer to the geoid",
    )
    position_sigma_m: Noise3 | None = Field(
        default=None, description="1σ north, east, down, instead of the values in the file"
    )
    velocity_sigma_mps: Noise3 | None = Field(
        default=None, description="1σ north, east, down, instead of the values in the file"
    )
    velocity_delay_s: Lag = Field(
        default=0.0,
        description="age of a velocity at its time stamp: half the interval for a mean over the last interval",
    )
    quality_factors: dict[str, Factor] | None = Field(
        default=None,
        description='factor of σ for each quality code, for example { "1" = 1.0, "2" = 20.0 }; fixes with other codes '
        "are not used; default: every fix has the σ of the file, except fixes whose code means that there is no "
        "solution",
    )

    @model_validator(mode="after")
    def _codes_are_numbers(self) -> Self:
        for code in self.quality_factors or ():
            if not re.fullmatch(r"-?\d+", code):
                raise ValueError(f'quality_factors: "{code}" is not a whole number, as quality codes are')
        return self


class LogGnss(_Position):
    """The recorded GNSS receiver."""

    use: tuple[Literal["position", "velocity"], ...] = Field(
        default=("position", "velocity"),
        min_length=1,
        description="quantities that the filter uses, if the file contains them",
    )
    sigma_factor: Factor = Field(default=1.0, description="factor for the σ of positions in the file")
    velocity_sigma_factor: Factor = Field(default=1.0, description="factor for the σ of velocities in the file")
    least_sigma_m: Spread = Field(default=0.0, description="least 1σ of each component of a position")
    least_velocity_sigma_mps: Spread = Field(default=0.0, description="least 1σ of each component of a velocity")
    latency_s: Moment = Field(default=0.0, description="time from the validity of a fix to its arrival at the filter")
    lever_arm_sigma_m: Spread = Field(default=0.0, description="1σ of the lever arm, which is then a state")
    time_offset_sigma_s: TimeSpread = Field(default=0.0, description="1σ of the clock offset, which is then a state")
    velocity_delay_sigma_s: TimeSpread = Field(
        default=0.0, description="1σ of the delay of the velocities, which is then a state"
    )
    correlated_position_sigma_m: Spread = Field(
        default=0.0, description="1σ of a slowly varying error north and east, which is a state"
    )
    correlated_height_sigma_m: Spread = Field(
        default=0.0, description="1σ of a slowly varying height error, which is a state"
    )
    correlated_velocity_sigma_mps: Spread = Field(default=0.0, description="1σ of a slowly varying velocity error")
    correlation_time_s: CorrelationTime = Field(
        default=100.0, description="correlation time of the slowly varying errors"
    )


class LogReference(_Position, SolutionColumns):
    """A reference solution from which errors are computed. It may lack velocity, attitude or both."""

    gap_s: Positive | None = Field(
        default=None, description="longest interval that is interpolated; default: three times the usual interval"
    )


class Constant(Section):
    """A constant in a unit."""

    value: Positive = Field(description="numerical value")
    unit: str = Field(description="unit of the number")


class LogOther(LogFile):
    """Measurements of another aiding sensor in a text file."""

    name: str = Field(pattern=r"^[a-z][a-z0-9-]*$", max_length=40, description="short name, unique")
    kind: Literal["baro-height", "heading", "speed", "airspeed"] = Field(description="kind of measurement")
    time: str | int = Field(default="time_s", description="column with the times of validity")
    time_unit: str | None = Field(default=None, description="s, ms, us or ns")
    reading: Quantity = Field(description="column and unit of the measurements")
    sigma: Quantity = Field(description="column or constant, and unit, of the 1σ of the measurements")
    bias_sigma: Constant | None = Field(
        default=None,
        description="1σ of an error that all measurements share, a constant with a unit; the error becomes a state",
    )
    bias_correlation_time_s: CorrelationTime | None = Field(
        default=None, description="correlation time of that error; default: it is constant"
    )
    scale_sigma_ppm: Spread = Field(default=0.0, description="1σ of the scale factor error, which becomes a state")
    lever_arm_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0), description="from the sensor block to the sensor, in the axes of the sensor block"
    )
    delimiter: str = Field(default=",", description="as for [log.imu]")
    skip_lines: int = Field(default=0, ge=0, le=1_000_000, description="as for [log.imu]")


class LogStart(Section):
    """The initial state of navigation. Quantities that are not given are determined from the data."""

    paired = (("latitude_deg", "longitude_deg"), ("roll_deg", "pitch_deg"))

    latitude_deg: Latitude | None = Field(default=None, description="default: the first position")
    longitude_deg: Longitude | None = Field(default=None, description="default: the first position")
    height_m: Height | None = Field(default=None, description="default: the first position")
    velocity_ned_mps: tuple[Velocity, Velocity, Velocity] | None = Field(
        default=None, description="default: the first velocity, or zero"
    )
    roll_deg: Annotated[float, Field(ge=-180.0, le=180.0)] | None = Field(
        default=None, description="roll of the vehicle; default: from the accelerometers"
    )
    pitch_deg: Annotated[float, Field(ge=-90.0, le=90.0)] | None = Field(
        default=None, description="pitch of the vehicle; default: from the accelerometers"
    )
    heading_deg: Heading | None = Field(
        default=None,
        description="heading of the vehicle; default: the course of the first motion, carried back to the start by "
        "the gyro data",
    )
    course_speed_mps: Positive | None = Field(
        default=None,
        description="speed above which the course is used as heading; default: 3, or if the log does not reach it, the "
        "speed at which the 1σ of the velocity gives the course to 10°",
    )

    @property
    def is_given(self) -> bool:
        """Whether anything differs from the defaults, which the scenario.toml of a run writes out."""
        return any(getattr(self, name) != field.default for name, field in type(self).model_fields.items())


class Log(Source):
    """Recorded sensors: the IMU, the aiding sensors, and the reference."""

    table: ClassVar[str] = "log"
    recorded: ClassVar[bool] = True
    idle: ClassVar[Mapping[str, str]] = {
        "vibration": "would add a motion to a recorded one",
        "isolator": "would change a recorded motion",
        "ensemble": "makes many runs of a simulation, but a recording is a single run",
    }

    rules = (
        (lambda s: s.outages is not None and s.gnss is None,
         "outages are GNSS outages and need [log.gnss], which is missing"),
    )  # fmt: skip

    from_s: Moment | None = Field(
        default=None, description="start of the run, counted from the first row of the IMU file"
    )
    to_s: Moment | None = Field(default=None, description="end of the run, counted from the first row of the IMU file")
    imu: LogImu
    gnss: LogGnss | None = None
    others: Annotated[tuple[LogOther, ...], once("name", lambda other: other.name)] = Field(
        default=(), description="further aiding sensors"
    )
    reference: LogReference | None = None
    start: LogStart = LogStart()
    outages: Outages | None = None

    @model_validator(mode="after")
    def _span(self) -> Self:
        if self.from_s is not None and self.to_s is not None and not self.from_s < self.to_s:
            raise ValueError(f"from_s = {self.from_s:g} must be before to_s = {self.to_s:g}")
        return self

    @property
    def has_readings(self) -> bool:
        """Whether it brings readings of aiding sensors."""
        return self.gnss is not None or bool(self.others)

    @property
    def known_duration(self) -> float | None:
        """Duration, s, if the end is given."""
        return None if self.to_s is None else self.to_s - (self.from_s or 0.0)

    def files(self) -> Iterator[tuple[str, LogFile]]:
        """Yield key and table of each file."""
        yield "imu", self.imu
        if self.gnss is not None:
            yield "gnss", self.gnss
        if self.reference is not None:
            yield "reference", self.reference
        yield from ((f"others.{number}", other) for number, other in enumerate(self.others, start=1))


def files_from(log: Any, folder: Path) -> None:
    """Replace relative paths of a log's files by absolute ones, in the contents of a scenario's file.

    Args:
        folder: the scenario's folder.
    """
    tables = [log.get(key) for key in ("imu", "gnss", "reference")] if isinstance(log, dict) else []
    others = log.get("others") if isinstance(log, dict) else None
    for table in (*tables, *(others if isinstance(others, list) else ())):
        if isinstance(table, dict) and isinstance(table.get("file"), str):
            table["file"] = str(folder.resolve() / table["file"])
    imu = log.get("imu") if isinstance(log, dict) else None
    for triad in (imu.get("gyro"), imu.get("accel"), imu.get("gravity")) if isinstance(imu, dict) else ():
        if isinstance(triad, dict) and isinstance(triad.get("file"), str):
            triad["file"] = str(folder.resolve() / triad["file"])
