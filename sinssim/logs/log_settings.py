"""The table [log]: recorded sensors, injected outages of GNSS, an optional reference, and where navigation starts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, ValidationError, model_validator

from sinssim.errors import InputError, shortened, unknown_name
from sinssim.logs.column_description import FixColumns, LogDescription, Quantity, SolutionColumns, TriadColumns
from sinssim.logs.column_names import UNITS
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
    Span,
    Spread,
    TimeSpread,
    Velocity,
    once,
)

_NUMBER = r"(\d+(?:\.\d*)?)"
_SPAN = re.compile(f"{_NUMBER}:{_NUMBER}")
_REGULAR = re.compile(rf"{_NUMBER}/{_NUMBER}(?:@({_NUMBER}(?:,{_NUMBER})*))?")


class Outages(Section):
    """Injected GNSS outages, which show the performance of the system without GNSS."""

    paired = (("length_s", "every_s"),)
    rules = (
        (lambda s: not s.at_s and s.length_s is None, "give at_s, or length_s and every_s"),
        (lambda s: isinstance(s.first_s, tuple) and s.length_s is None,
         "several beginnings (first_s) are those of regular outages: give length_s and every_s"),
        (lambda s: isinstance(s.first_s, tuple) and s.at_s,
         "at_s and several beginnings (first_s) exclude each other"),
    )  # fmt: skip

    at_s: tuple[Span, ...] = Field(default=(), description="[from, to] of each outage, in the time of the run")
    length_s: Positive | None = Field(default=None, description="length of regular outages")
    every_s: Positive | None = Field(default=None, description="period of regular outages")
    first_s: Moment | tuple[Moment, ...] | None = Field(
        default=None,
        description="start of the first regular outage; default: one period after the start; with several values, the "
        "filter makes one further pass for each, and the outages of these passes are evaluated together",
    )

    @model_validator(mode="after")
    def _regular(self) -> Self:
        if self.length_s is not None and self.every_s is not None and self.length_s >= self.every_s:
            raise ValueError(
                f"length_s = {self.length_s:g} must be less than every_s = {self.every_s:g}, or there would be no fix"
            )
        if isinstance(self.first_s, tuple) and len({*self.first_s}) < max(1, len(self.first_s)):
            raise ValueError("first_s: give each beginning once, for example [30.0, 45.0, 60.0]")
        return self

    def spans(self, start: float, end: float) -> tuple[tuple[float, float], ...]:
        """Return beginning and end, s, of the outages within a run, in order; a regular outage that would not end
        within the run is left out. None with several beginnings, whose outages are those of further passes of the
        filter."""
        if isinstance(self.first_s, tuple):
            return ()
        inside = [span for span in self.at_s if span[0] < end and span[1] > start]
        return tuple(sorted((*inside, *self._regular_spans(self.first_s, start, end))))

    def passes(self, start: float, end: float) -> tuple[tuple[tuple[float, float], ...], ...]:
        """Return the outages of each further pass of the filter: for each of several beginnings those within the run,
        as `spans`; none otherwise."""
        beginnings = self.first_s if isinstance(self.first_s, tuple) else ()
        return tuple(tuple(self._regular_spans(first, start, end)) for first in beginnings)

    def _regular_spans(self, first: float | None, start: float, end: float) -> Iterator[tuple[float, float]]:
        """Yield the regular outages from a beginning on."""
        if self.length_s is None or self.every_s is None:
            return
        begin = start + self.every_s if first is None else first
        while begin + self.length_s <= end:
            if begin >= start:
                yield begin, begin + self.length_s
            begin += self.every_s


def outage_settings(written: Sequence[str]) -> list[str]:
    """Return settings "key.path=value" of `log.outages` for outages: "40:55" from 40 s to 55 s; "15/45" for 15 s every
    45 s, "15/45@60" the same, the first at 60 s, "15/45@30,45,60" once for each of these beginnings."""
    spans, regular = _parsed(written)
    listed = ", ".join(f"[{begin}, {end}]" for begin, end in spans)
    settings = [f"log.outages.at_s=[{listed}]"] if spans else []
    if regular is not None:
        settings += [f"log.outages.length_s={float(regular[1])}", f"log.outages.every_s={float(regular[2])}"]
        if regular[3]:
            first = [float(word) for word in regular[3].split(",")]
            settings.append(f"log.outages.first_s={first if len(first) > 1 else first[0]}")
    return settings


def outage_spans(written: Sequence[str], start: float, end: float) -> tuple[tuple[float, float], ...]:
    """Return the outages within a run: beginning and end of each, in order, s. `written`: as for `outage_settings`,
    with one beginning at most; `start`, `end`: of the run, s."""
    spans, regular = _parsed(written)
    keys: dict[str, Any] = {"at_s": spans}
    if regular is not None:
        if "," in (regular[3] or ""):
            raise InputError(f"--outage {regular[0]}: several beginnings need several exports; give one.")
        keys |= {"length_s": float(regular[1]), "every_s": float(regular[2])}
        keys |= {"first_s": float(regular[3])} if regular[3] else {}
    try:
        within = Outages.model_validate(keys).spans(start, end)
    except ValidationError as error:
        why = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise InputError(f"--outage {' '.join(written)}: {why}.") from error
    if not within:
        raise InputError(f"--outage {' '.join(written)}: no outage lies within the run, {start:g} to {end:g} s.")
    return within


def _parsed(written: Sequence[str]) -> tuple[list[tuple[float, float]], re.Match[str] | None]:
    """Return single outages, and the regular ones as their parts."""
    spans: list[tuple[float, float]] = []
    regular = None
    for text in written:
        if parts := _SPAN.fullmatch(text):
            spans.append((float(parts[1]), float(parts[2])))
        elif (parts := _REGULAR.fullmatch(text)) and regular is None:
            regular = parts
        else:
            why = "regular outages are already given" if regular and _REGULAR.fullmatch(text) else "it is not an outage"
            raise InputError(
                f"--outage {shortened(text)}: {why}. Write 40:55 for an outage from 40 s to 55 s. Write 15/45, only "
                "once, for outages of 15 s every 45 s, 15/45@60 if the first begins at 60 s, or 15/45@30,45,60 for "
                "one pass with each of these first times."
            )
    return spans, regular


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
        "drop": "would end a recorded motion",
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
    """Replace relative paths of a log's files by absolute ones, in the contents of a scenario's file. `folder`: the
    scenario's folder."""
    tables = [log.get(key) for key in ("imu", "gnss", "reference")] if isinstance(log, dict) else []
    others = log.get("others") if isinstance(log, dict) else None
    for table in (*tables, *(others if isinstance(others, list) else ())):
        if isinstance(table, dict) and isinstance(table.get("file"), str):
            table["file"] = str(folder.resolve() / table["file"])
    imu = log.get("imu") if isinstance(log, dict) else None
    for triad in (imu.get("gyro"), imu.get("accel"), imu.get("gravity")) if isinstance(imu, dict) else ():
        if isinstance(triad, dict) and isinstance(triad.get("file"), str):
            triad["file"] = str(folder.resolve() / triad["file"])
