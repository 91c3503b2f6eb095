"""The [imu.sensor_set] table: which of the textbook chapter's three sensor sets (section 8.1) the block holds."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sinssim.section import NotNegative, Positive, Section, Vector3, exclude_each_other

_FIXED_OR_DRAWN = (("bias_arcsec", "bias_sigma_arcsec"), ("drift_deg_h", "drift_sigma_deg_h"))


class Gyros(Section):
    """Three accelerometers and three gyros."""

    type: Literal["gyros"] = Field(description="the usual set, the second in the chapter")


class SixAccelerometers(Section):
    """Six accelerometers at the centres of a cube's faces, without gyros; each has the errors of [imu]."""

    type: Literal["accelerometers"] = Field(description="the first set in the chapter")
    arm_m: Positive = Field(description="distance from the cube's centre, which is the block's place, to each face")


class AttitudeSensor(Section):
    """Three accelerometers and a sensor of the attitude in inertial space; navigated by "measured-attitude"."""

    type: Literal["attitude-sensor"] = Field(description="the third set in the chapter")
    bias_arcsec: Vector3 | None = Field(
        default=None, description="fixed error of its reference, a rotation vector in Earth-centred inertial axes"
    )
    bias_sigma_arcsec: NotNegative | None = Field(
        default=None, description="1σ of this error, if it is random; default: 0"
    )
    drift_deg_h: Vector3 | None = Field(default=None, description="fixed drift of this error, in the same axes")
    drift_sigma_deg_h: NotNegative | None = Field(
        default=None, description="1σ of this drift, if it is random; default: that of the grade's gyro biases"
    )
    noise_arcsec: NotNegative = Field(default=0.0, description="1σ of each reading about each axis of the block")

    @model_validator(mode="after")
    def _fixed_or_drawn(self) -> Self:
        for fixed, sigma in _FIXED_OR_DRAWN:
            exclude_each_other(self, fixed, sigma)
        return self


SensorSet = Annotated[Gyros | SixAccelerometers | AttitudeSensor, Field(discriminator="type")]
