"""The [imu.sensor_set] table: which of the chapter's three sets of sensors (section 8.1) the block holds."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sinssim.scenario.section import NotNegative, Positive, Section, Vector3

_FIXED_OR_DRAWN = (("bias_arcsec", "bias_sigma_arcsec"), ("drift_deg_h", "drift_sigma_deg_h"))


class Gyros(Section):
    """Three accelerometers and three gyros."""

    type: Literal["gyros"] = Field(description="the ordinary set, the chapter's second")


class SixAccelerometers(Section):
    """Six accelerometers in the middles of a cube's faces, and no gyro; each has the errors of the accelerometers."""

    type: Literal["accelerometers"] = Field(description="the chapter's first set")
    arm_m: Positive = Field(description="from the cube's centre, the block's place, to each face")


class AttitudeSensor(Section):
    """Three accelerometers and a sensor of the attitude in inertial space; navigated by "measured-attitude"."""

    type: Literal["attitude-sensor"] = Field(description="the chapter's third set")
    bias_arcsec: Vector3 | None = Field(
        default=None, description="rotation vector, Earth-centred inertial axes, by which its reference is off"
    )
    bias_sigma_arcsec: NotNegative | None = Field(default=None, description="1σ to draw it from; 0 unless given")
    drift_deg_h: Vector3 | None = Field(default=None, description="rate, in the same axes, at which it turns on")
    drift_sigma_deg_h: NotNegative | None = Field(
        default=None, description="1σ to draw it from; that of the grade's gyro biases unless given"
    )
    noise_arcsec: NotNegative = Field(default=0.0, description="1σ of every reading about every axis of the block")

    @model_validator(mode="after")
    def _fixed_or_drawn(self) -> Self:
        for fixed, sigma in _FIXED_OR_DRAWN:
            if getattr(self, fixed) is not None and getattr(self, sigma) is not None:
                raise ValueError(
                    f"{fixed} (the error itself) and {sigma} (1σ to draw it from) are both given: keep one of them"
                )
        return self


SensorSet = Annotated[Gyros | SixAccelerometers | AttitudeSensor, Field(discriminator="type")]
