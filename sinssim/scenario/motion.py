"""The [motion] table, motions in closed form for testing algorithms, and the [[vibration]] of any motion."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sinssim.scenario.section import Heading, Latitude, Longitude, NotNegative, Positive, Section, Vector3

_TURNS = ("roll", "pitch", "yaw")


class VibrationSection(Section):
    """Vibration of the sensor block on top of the motion, in the block's axes: a sinusoid, or noise in a band."""

    coordinate: Literal["roll", "pitch", "yaw", "forward", "right", "down"] = Field(description="what vibrates")
    rms_arcsec: NotNegative | None = Field(default=None, description="size of a vibration in roll, pitch or yaw")
    rms_mm: NotNegative | None = Field(default=None, description="size of one forward, right or down")
    rms_g: NotNegative | None = Field(
        default=None, description="instead of rms_mm: size of its acceleration, whose spectrum is then the flat one"
    )
    low_hz: Positive = Field(description="lower edge of the band, or the frequency of a sinusoid")
    high_hz: Positive | None = Field(default=None, description="upper edge of the band; none for a sinusoid")
    phase_deg: float = Field(default=0.0, description="of a sinusoid (with rms_g, of its acceleration) at the start")

    @model_validator(mode="after")
    def _one_size(self) -> Self:
        of_turns, of_displacements = ("rms_arcsec",), ("rms_mm", "rms_g")
        right = of_turns if self.coordinate in _TURNS else of_displacements
        given = tuple(key for key in (*of_turns, *of_displacements) if getattr(self, key) is not None)
        if len(given) != 1 or given[0] not in right:
            raise ValueError(
                f"a vibration in {self.coordinate} has its size in {' or '.join(right)}; here it is given in "
                f"{' and '.join(given) or 'none'}"
            )
        if self.high_hz is not None and self.high_hz <= self.low_hz:
            raise ValueError(
                f"the band from {self.low_hz:g} Hz to {self.high_hz:g} Hz is empty; high_hz must be higher"
            )
        return self


class _Placed(Section):
    latitude_deg: Latitude = Field(default=45.0, description="of the place")
    longitude_deg: Longitude = Field(default=0.0, description="of the place")
    altitude_m: float = Field(default=0.0, description="of the place, above the ellipsoid")
    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0, description="attitude that the motion is about")
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0, description="attitude that the motion is about")
    heading_deg: Heading = Field(default=0.0, description="attitude that the motion is about")


class ConingMotion(_Placed):
    """Classical coning: the forward axis runs round a cone, the block does not turn on the whole."""

    type: Literal["coning"]
    half_angle_deg: Positive = Field(description="half-angle of the cone")
    frequency_hz: Positive = Field(description="of the motion round the cone")
    duration_s: Positive = Field(description="how long it lasts")


class ScullingMotion(_Placed):
    """A turn about the forward axis in phase with an oscillation to the right."""

    type: Literal["sculling"]
    angle_deg: Positive = Field(description="amplitude of the turn")
    displacement_mm: Positive = Field(description="amplitude of the oscillation")
    frequency_hz: Positive = Field(description="of both")
    duration_s: Positive = Field(description="how long it lasts")


class SpinConeMotion(_Placed):
    """The block spins about its forward axis while that axis goes round a cone."""

    type: Literal["spin-cone"]
    angle_deg: Positive = Field(description="between the forward axis and the axis of the cone")
    precession_deg_s: float = Field(description="rate round the cone")
    spin_deg_s: float = Field(description="rate about the forward axis")
    duration_s: Positive = Field(description="how long it lasts")


class SpinRockMotion(_Placed):
    """A spin with rocking on top, about one axis; the sensor block's lever arm is that of [imu]."""

    type: Literal["spin-rock"]
    axis: Vector3 = Field(description="of the spin: forward, right, down")
    spin_deg_s: float = Field(default=0.0, description="steady rate")
    angle_deg: Positive = Field(description="amplitude of the rocking")
    frequency_hz: Positive = Field(description="of the rocking")
    duration_s: Positive = Field(description="how long it lasts")

    @model_validator(mode="after")
    def _axis_has_a_length(self) -> Self:
        if not any(self.axis):
            raise ValueError("axis is [0, 0, 0], which points nowhere; for example [0, 0, 1] is the down axis")
        return self


class DwellStep(Section):
    """The table stands still."""

    type: Literal["dwell"]
    duration_s: Positive = Field(description="how long")


class TurnStep(Section):
    """The table turns about an axis of the block."""

    type: Literal["turn"]
    axis: Vector3 = Field(description="in the block's axes: forward, right, down")
    angle_deg: float = Field(description="how far, right-handed about the axis")
    rate_deg_s: Positive = Field(description="the full rate")
    ramp_s: Positive = Field(default=1.0, description="how long the rate takes to rise, and to fall")
    profile: Literal["smooth", "trapezoidal"] = Field(default="smooth", description="how it rises and falls")

    @model_validator(mode="after")
    def _can_be_done(self) -> Self:
        if not any(self.axis):
            raise ValueError("axis is [0, 0, 0], which points nowhere; for example [0, 0, 1] is the down axis")
        if abs(self.angle_deg) < self.rate_deg_s * self.ramp_s:
            raise ValueError(
                f"a turn by {self.angle_deg:g}° never reaches {self.rate_deg_s:g}°/s with ramps of {self.ramp_s:g} s; "
                f"ramp_s of at most {abs(self.angle_deg) / self.rate_deg_s:g}, or a lower rate, is needed"
            )
        return self


Step = Annotated[DwellStep | TurnStep, Field(discriminator="type")]


class RotationTableMotion(_Placed):
    """A sequence on a rotation table; it lasts as long as its steps."""

    type: Literal["rotation-table"]
    steps: tuple[Step, ...] = Field(min_length=1, description="what the table does, one after the other")

    @property
    def duration_s(self) -> float:
        """How long the sequence lasts, s."""
        return sum(
            step.duration_s if isinstance(step, DwellStep) else abs(step.angle_deg) / step.rate_deg_s + step.ramp_s
            for step in self.steps
        )


MotionSection = Annotated[
    ConingMotion | ScullingMotion | SpinConeMotion | SpinRockMotion | RotationTableMotion,
    Field(discriminator="type"),
]
