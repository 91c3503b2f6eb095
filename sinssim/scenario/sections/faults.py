"""The [[imu.faults]] of a scenario: faults of the sensor block and their times."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from sinssim.section import NotNegative, Positive, Section, Vector3
from sinssim.sensors.imu.datasheet import not_absurd

SensorChannel = Literal["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
"""One gyro or accelerometer; x is forward, y right, z down."""

CHANNELS: tuple[SensorChannel, ...] = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")


class _Lasting(Section):
    """A fault with a duration."""

    from_s: NotNegative = Field(description="time at which it begins")
    to_s: Positive | None = Field(default=None, description="time at which it ends; default: never")

    @model_validator(mode="after")
    def _lasts(self) -> Self:
        if self.to_s is not None and not self.from_s < self.to_s:
            raise ValueError(f"to_s = {self.to_s:g} must be later than from_s = {self.from_s:g}")
        return self


class Dropout(_Lasting):
    """Samples are lost: they read zero and are flagged."""

    type: Literal["dropout"]
    channels: tuple[SensorChannel, ...] = Field(default=CHANNELS, min_length=1, description="which sensors")


class Freeze(_Lasting):
    """The last sample is repeated and flagged; the increments in the meantime are lost."""

    type: Literal["freeze"]
    channels: tuple[SensorChannel, ...] = Field(default=CHANNELS, min_length=1, description="which sensors")


class Spike(Section):
    """One sample has an additional error."""

    type: Literal["spike"]
    at_s: Positive = Field(description="time within the sample")
    gyro_arcsec: Vector3 | None = Field(default=None, description="added to the sample's angle increments")
    accel_mm_s: Vector3 | None = Field(default=None, description="added to its velocity increments")

    @field_validator("gyro_arcsec", "accel_mm_s")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd({"gyro_arcsec": "gyro_quantum_arcsec"}.get(str(info.field_name), "accel_quantum_mm_s"), value)

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not any((self.gyro_arcsec or ()) + (self.accel_mm_s or ())):
            raise ValueError("the spike has no size: give gyro_arcsec or accel_mm_s")
        return self


class BiasStep(_Lasting):
    """The biases change by a step."""

    type: Literal["bias-step"]
    gyro_deg_h: Vector3 | None = Field(default=None, description="added to the gyros' biases")
    accel_ug: Vector3 | None = Field(default=None, description="added to the accelerometers' biases")

    @field_validator("gyro_deg_h", "accel_ug")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd({"gyro_deg_h": "gyro_bias_deg_h"}.get(str(info.field_name), "accel_bias_ug"), value)

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not any((self.gyro_deg_h or ()) + (self.accel_ug or ())):
            raise ValueError("the step has no size: give gyro_deg_h or accel_ug")
        return self


class Saturation(_Lasting):
    """The range of the sensors is reduced; values beyond it are limited and flagged."""

    type: Literal["saturation"]
    gyro_deg_s: Positive | None = Field(
        default=None, description="range of the gyros, in both directions; default: their own"
    )
    accel_g: Positive | None = Field(default=None, description="range of the accelerometers; default: their own")

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if self.gyro_deg_s is None and self.accel_g is None:
            raise ValueError("the saturation has no range: give gyro_deg_s or accel_g")
        return self


class Jitter(_Lasting):
    """The time stamps have random errors; the increments are those of the true instants."""

    type: Literal["jitter"]
    sigma_ms: Positive = Field(description="1σ of each time stamp, at most a tenth of the interval between samples")


Fault = Annotated[Dropout | Freeze | Spike | BiasStep | Saturation | Jitter, Field(discriminator="type")]
