"""The [motion] table, motions in closed form for testing algorithms, and the [[vibration]] of any motion."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from sinssim.section import (
    Axis,
    Duration,
    Frequency,
    Heading,
    Height,
    Latitude,
    Longitude,
    NotNegative,
    Positive,
    Section,
    Source,
    Turn,
    TurnRate,
)

_TURNS = ("roll", "pitch", "yaw")

# Sizes beyond any vehicle's motion: half a turn, a kilometre, and an acceleration that destroys any instrument.
_MOST_ARCSEC, _MOST_MM, _MOST_G = 648_000.0, 1e6, 1e5


class VibrationSection(Section):
    """Vibration of the sensor block, which is added to the motion, in the axes of the sensor block: a sinusoid, or
    band-limited noise."""

    coordinate: Literal["roll", "pitch", "yaw", "forward", "right", "down"] = Field(description="vibrating coordinate")
    rms_arcsec: NotNegative | None = Field(
        default=None, le=_MOST_ARCSEC, description="rms of a vibration in roll, pitch or yaw"
    )
    rms_mm: NotNegative | None = Field(
        default=None, le=_MOST_MM, description="rms of a vibration forward, right or down"
    )
    rms_g: NotNegative | None = Field(
        default=None,
        le=_MOST_G,
        description="rms of the acceleration, which then has a flat spectrum, instead of rms_mm",
    )
    low_hz: Frequency = Field(description="lower edge of the band, or the frequency of a sinusoid")
    high_hz: Frequency | None = Field(
        default=None, description="upper edge of the band; without it, the vibration is a sinusoid"
    )
    phase_deg: float = Field(
        default=0.0,
        ge=-36_000.0,
        le=36_000.0,
        description="phase of a sinusoid (with rms_g, of its acceleration) at the start",
    )

    @model_validator(mode="after")
    def _one_size(self) -> Self:
        of_turns, of_displacements = ("rms_arcsec",), ("rms_mm", "rms_g")
        right = of_turns if self.coordinate in _TURNS else of_displacements
        given = tuple(key for key in (*of_turns, *of_displacements) if getattr(self, key) is not None)
        if len(given) != 1 or given[0] not in right:
            raise ValueError(
                f"the size of a vibration in {self.coordinate} must be given by {' or '.join(right)}; here it is given "
                f"by {' and '.join(given) or 'no key'}"
            )
        if self.high_hz is not None and self.high_hz <= self.low_hz:
            raise ValueError(f"the band from {self.low_hz:g} Hz to {self.high_hz:g} Hz is empty; increase high_hz")
        return self


class PlacedMotion(Source):
    """A motion about a place."""

    table: ClassVar[str] = "motion"

    latitude_deg: Latitude = Field(default=45.0, description="latitude of the place")
    longitude_deg: Longitude = Field(default=0.0, description="longitude of the place")
    altitude_m: Height = Field(default=0.0, description="height of the place above the ellipsoid")
    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0, description="mean roll")
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0, description="mean pitch")
    heading_deg: Heading = Field(default=0.0, description="mean heading")


class ConingMotion(PlacedMotion):
    """Classical coning: the forward axis describes a cone, and the sensor block has no net rotation."""

    type: Literal["coning"]
    half_angle_deg: Positive = Field(le=180.0, description="half-angle of the cone")
    frequency_hz: Frequency = Field(description="frequency of the motion around the cone")
    duration_s: Duration = Field(description="duration")


class ScullingMotion(PlacedMotion):
    """A rotation about the forward axis in phase with an oscillation to the right."""

    type: Literal["sculling"]
    angle_deg: Turn = Field(description="amplitude of the rotation")
    displacement_mm: Positive = Field(le=_MOST_MM, description="amplitude of the oscillation")
    frequency_hz: Frequency = Field(description="frequency of both")
    duration_s: Duration = Field(description="duration")


class SpinConeMotion(PlacedMotion):
    """The sensor block spins about its forward axis while that axis describes a cone."""

    type: Literal["spin-cone"]
    angle_deg: Positive = Field(le=180.0, description="angle between the forward axis and the axis of the cone")
    precession_deg_s: TurnRate = Field(description="rate around the cone")
    spin_deg_s: TurnRate = Field(description="rate about the forward axis")
    duration_s: Duration = Field(description="duration")


class SpinRockMotion(PlacedMotion):
    """A spin with superimposed rocking about one axis; the sensor block's lever arm is that of [imu]."""

    type: Literal["spin-rock"]
    axis: Axis = Field(description="axis of the spin: forward, right, down")
    spin_deg_s: TurnRate = Field(default=0.0, description="steady rate")
    angle_deg: Turn = Field(description="amplitude of the rocking")
    frequency_hz: Frequency = Field(description="frequency of the rocking")
    duration_s: Duration = Field(description="duration")


class DwellStep(Section):
    """The table is at rest."""

    type: Literal["dwell"]
    duration_s: Duration = Field(description="duration")


class TurnStep(Section):
    """The table turns about an axis of the sensor block."""

    type: Literal["turn"]
    axis: Axis = Field(description="axis of the turn in the axes of the sensor block: forward, right, down")
    angle_deg: float = Field(ge=-3.6e7, le=3.6e7, description="angle of the turn, right-handed about the axis")
    rate_deg_s: float = Field(ge=1e-6, le=360_000.0, description="full rate of the turn")
    ramp_s: float = Field(
        default=1.0, ge=1e-3, le=1e6, description="duration of the rise of the rate, and also of its fall"
    )
    profile: Literal["smooth", "trapezoidal"] = Field(default="smooth", description="shape of the rise and the fall")

    @model_validator(mode="after")
    def _can_be_done(self) -> Self:
        if abs(self.angle_deg) < self.rate_deg_s * self.ramp_s:
            raise ValueError(
                f"a turn by {self.angle_deg:g}° never reaches {self.rate_deg_s:g}°/s with ramps of {self.ramp_s:g} s; "
                f"give a ramp_s of at most {abs(self.angle_deg) / self.rate_deg_s:g}, or a lower rate"
            )
        return self


Step = Annotated[DwellStep | TurnStep, Field(discriminator="type")]


class RotationTableMotion(PlacedMotion):
    """A sequence of steps on a rotation table."""

    type: Literal["rotation-table"]
    steps: tuple[Step, ...] = Field(min_length=1, description="steps of the table in order")

    @property
    def duration_s(self) -> float:
        """Duration of the sequence, s."""
        return sum(
            step.duration_s if isinstance(step, DwellStep) else abs(step.angle_deg) / step.rate_deg_s + step.ramp_s
            for step in self.steps
        )


MotionSection = Annotated[
    ConingMotion | ScullingMotion | SpinConeMotion | SpinRockMotion | RotationTableMotion,
    Field(discriminator="type"),
]
