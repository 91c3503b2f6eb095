"""The study file: what is compared with what, typed and checked as a scenario is.

A study has parts. Each part is a full factorial: every motion × every set of sensors × every algorithm × every rate
(or three-rate schedule) × every frame, gravity model and curvature.
"""

from __future__ import annotations

import itertools
from collections import Counter
from fnmatch import fnmatchcase
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from sinssim.errors import unknown_name
from sinssim.names import ALGORITHMS, CURVATURES
from sinssim.scenario.grades import GRADES
from sinssim.scenario.imu import ImuSection
from sinssim.scenario.schema import Curvature, Frame, Gravity, GreatCircleSection, ParkedSection, Vertical
from sinssim.scenario.section import Latitude, NotNegative, Positive, Section, Vector3
from sinssim.studies.claim_names import CLAIMS, VARIANTS


class ToneSection(Section):
    """Vibration of the sensor block: a sinusoid, or noise in a band of frequencies, on one coordinate."""

    coordinate: Literal["roll", "pitch", "yaw", "forward", "right", "down"] = Field(description="what vibrates")
    rms_arcsec: NotNegative | None = Field(default=None, description="for roll, pitch and yaw")
    rms_mm: NotNegative | None = Field(default=None, description="for forward, right and down")
    low_hz: Positive = Field(description="lower edge of the band, or the frequency of a sinusoid")
    high_hz: Positive | None = Field(default=None, description="upper edge of the band; none for a sinusoid")
    phase_deg: float = Field(default=0.0, description="of a sinusoid at the start")

    @model_validator(mode="after")
    def _one_amplitude(self) -> Self:
        turns = self.coordinate in ("roll", "pitch", "yaw")
        if (self.rms_arcsec is None) == turns or (self.rms_mm is None) != turns:
            right = "rms_arcsec" if turns else "rms_mm"
            raise ValueError(f"a vibration in {self.coordinate} has its amplitude in {right}, and in nothing else")
        if self.high_hz is not None and self.high_hz <= self.low_hz:
            raise ValueError(f"the band from {self.low_hz:g} Hz to {self.high_hz:g} Hz must rise")
        return self


class _Motion(Section):
    name: str = Field(default="", description="short name for tables and plots; by default what it is")
    vibration: tuple[ToneSection, ...] = Field(default=(), description="of the sensor block, on top of the motion")

    @property
    def label(self) -> str:
        """The motion's name, or what it is."""
        return self.name or str(self.type)  # type: ignore[attr-defined]


class _AtPlace(_Motion):
    latitude_deg: Latitude = Field(default=45.0, description="of the place")
    duration_s: Positive = Field(description="how long the motion lasts")


class ScenarioMotion(_Motion):
    """The motion of a scenario: its flight, parked vehicle or great circle, with its mounting of the sensor block."""

    type: Literal["scenario"]
    scenario: str = Field(description="a scenario's file, or a name of `sinssim list scenarios`")
    set: tuple[str, ...] = Field(default=(), description='changes of the scenario, each "key.path=value"')
    duration_s: Positive | None = Field(default=None, description="only its first so many seconds")

    @property
    def label(self) -> str:
        """The motion's name, or the scenario's."""
        return self.name or self.scenario.rsplit("/", 1)[-1].removesuffix(".toml")


class ConingMotion(_AtPlace):
    """Classical coning about the block's forward axis."""

    type: Literal["coning"]
    half_angle_deg: Positive = Field(description="half-angle of the cone")
    frequency_hz: Positive = Field(description="of the motion round the cone")


class ScullingMotion(_AtPlace):
    """A turn about the forward axis in phase with an oscillation to the right."""

    type: Literal["sculling"]
    angle_deg: Positive = Field(description="amplitude of the turn")
    displacement_mm: Positive = Field(description="amplitude of the displacement")
    frequency_hz: Positive = Field(description="of both")


class SpinConeMotion(_AtPlace):
    """A body that spins about its forward axis while that axis goes round a cone (Savage)."""

    type: Literal["spin-cone"]
    angle_deg: Positive = Field(description="between the forward axis and the axis of the cone")
    precession_deg_s: float = Field(description="rate round the cone")
    spin_deg_s: float = Field(description="rate about the forward axis")


class SpinRockMotion(_AtPlace):
    """A spin with rocking on top, about one axis, the block on a lever arm (Savage)."""

    type: Literal["spin-rock"]
    axis: Vector3 = Field(description="of the spin, in the block's axes")
    spin_deg_s: float = Field(description="steady rate")
    angle_deg: Positive = Field(description="amplitude of the rocking")
    frequency_hz: Positive = Field(description="of the rocking")
    lever_arm_m: Vector3 = Field(default=(0.0, 0.0, 0.0), description="from the axis to the block")


class GreatCircleMotion(_Motion, GreatCircleSection):
    """Level flight at constant height and ground speed along a great circle."""

    type: Literal["great-circle"]


class ParkedMotion(_Motion, ParkedSection):
    """A vehicle that stands still."""

    type: Literal["parked"]


Motion = Annotated[
    ScenarioMotion | ConingMotion | ScullingMotion | SpinConeMotion | SpinRockMotion | GreatCircleMotion | ParkedMotion,
    Field(discriminator="type"),
]


def _claim(name: str) -> str:
    if name not in CLAIMS:
        raise unknown_name("claim", name, CLAIMS)
    return name


def _variant(name: str) -> str:
    if name not in VARIANTS:
        raise unknown_name("sensor-set variant", name, VARIANTS)
    return name


Claim = Annotated[str, AfterValidator(_claim)]
Variant = Annotated[str, AfterValidator(_variant)]
Schedule = tuple[Positive, Positive, Positive]


class Part(Section):
    """One comparison: everything in it is combined with everything else in it."""

    title: str = Field(description="what is asked, as a heading")
    text: str = Field(default="", description="a few sentences on what is seen")
    decides: tuple[Claim, ...] = Field(default=(), description="claims that this part has the numbers for")
    motions: tuple[Motion, ...] = Field(min_length=1, description="true motions")
    variants: tuple[Variant, ...] = Field(default=("rate-gyros",), min_length=1, description="sets of sensors (8.1)")
    sensors: tuple[str, ...] = Field(
        default=("ideal",), min_length=1, description="grades of sensors, or names of the study's own [blocks]"
    )
    algorithms: tuple[str, ...] = Field(
        default=("quaternion",),
        min_length=1,
        description='attitude algorithms; "*" stands for any letters, so that "poisson-*" is a family and "*" all',
    )
    rates_hz: tuple[Positive, ...] = Field(default=(), description="sample rates; each divides the highest")
    schedules_hz: tuple[Schedule, ...] = Field(
        default=(), description="three-rate schedules: fast, medium and slow, each dividing the one before"
    )
    frames: tuple[Frame, ...] = Field(default=("level",), min_length=1, description="navigation frames")
    gravities: tuple[Gravity, ...] = Field(default=("normal",), min_length=1, description="the engine's gravity")
    curvatures: tuple[Curvature, ...] = Field(default=("exact",), min_length=1, description="radii of curvature")
    vertical: Vertical = Field(default="baro-loop", description="height channel; its reference is the true height")

    @field_validator("algorithms")
    @classmethod
    def _known_algorithms(cls, patterns: tuple[str, ...]) -> tuple[str, ...]:
        found: list[str] = []
        for pattern in patterns:
            matching = [name for name in ALGORITHMS if fnmatchcase(name, pattern)]
            if not matching:
                raise unknown_name("algorithm", pattern, ALGORITHMS)
            found += matching
        return tuple(found)

    @field_validator("algorithms", "sensors", "frames", "gravities", "curvatures", "variants", "rates_hz", "decides")
    @classmethod
    def _once(cls, values: tuple[object, ...], info: ValidationInfo) -> tuple[object, ...]:
        for value, count in Counter(values).items():
            if count > 1:
                shown = f"{value:g} Hz" if isinstance(value, float) else repr(value)
                raise ValueError(f"{info.field_name} names {shown} {count} times; once is enough")
        return values

    @model_validator(mode="after")
    def _motions_have_their_own_names(self) -> Self:
        for label, count in Counter(motion.label for motion in self.motions).items():
            if count > 1:
                raise ValueError(f"{count} motions are called {label!r}; give each a name of its own with name = …")
        return self

    @model_validator(mode="after")
    def _rates_divide(self) -> Self:
        if not self.rates_hz and not self.schedules_hz:
            raise ValueError("it needs rates_hz, for example rates_hz = [100.0], or schedules_hz")
        for schedule in self.schedules_hz:
            for fast, slow in itertools.pairwise(schedule):
                if not divides(slow, fast):
                    raise ValueError(
                        f"schedules_hz: {slow:g} Hz does not divide {fast:g} Hz; each rate of a schedule (fast, "
                        "medium, slow) is a whole fraction of the one before"
                    )
        for rate in (*self.rates_hz, *(schedule[0] for schedule in self.schedules_hz)):
            if not divides(rate, self.highest_hz):
                near = self.highest_hz / round(self.highest_hz / rate)
                raise ValueError(
                    f"rates_hz: {rate:g} Hz does not divide the highest rate, {self.highest_hz:g} Hz, whose samples "
                    f"are summed to make its own; {near:g} Hz does"
                )
        return self

    @property
    def highest_hz(self) -> float:
        """The rate that samples are generated at; those of the lower rates are sums of them."""
        return max((*self.rates_hz, *(schedule[0] for schedule in self.schedules_hz)))

    @property
    def pace(self) -> tuple[tuple[float, Schedule | None], ...]:
        """Every rate, and every schedule with its fast rate."""
        return (*((rate, None) for rate in self.rates_hz), *((s[0], s) for s in self.schedules_hz))


def divides(slow: float, fast: float) -> bool:
    """Return whether one rate is a whole fraction of another.

    Args:
        slow: Hz.
        fast: Hz.

    Returns:
        Whether fast/slow is a whole number, to rounding.
    """
    ratio = fast / slow
    return ratio > 0.5 and abs(ratio - round(ratio)) < 1e-9 * ratio


class Study(Section):
    """A comparison study."""

    name: str = Field(pattern=r"^[A-Za-z0-9][\w.-]*$", description="short name; names the directory")
    description: str = Field(default="", description="one sentence")
    seed: int = Field(default=0, ge=0, description="seed of the sensors' errors")
    blocks: dict[str, ImuSection] = Field(default={}, description="sensor blocks of its own, by name: [imu] sections")
    parts: tuple[Part, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _known_sensors(self) -> Self:
        for number, part in enumerate(self.parts, start=1):
            for name in part.sensors:
                if name not in self.blocks and name not in GRADES:
                    raise ValueError(
                        f"parts.{number}.sensors: {unknown_name('grade', name, {**GRADES, **self.blocks})}"
                    )
        return self

    def block(self, name: str) -> ImuSection:
        """Return the [imu] section of a sensor block.

        Args:
            name: of one of the study's own blocks, or a grade.

        Returns:
            The section.
        """
        return self.blocks.get(name) or ImuSection(grade=name)

    @model_validator(mode="after")
    def _titles_differ(self) -> Self:
        for title, count in Counter(part.title for part in self.parts).items():
            if count > 1:
                raise ValueError(f"{count} parts have the title {title!r}; results are found by their part's title")
        return self


assert set(CURVATURES) == {"exact", "simplified"}  # `claims` compares these two
