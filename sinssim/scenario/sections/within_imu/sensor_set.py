"""The [imu.sensor_set] table: one of the textbook chapter's three sets (section 8.1), a redundant set, a platform."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sinssim.data import Array
from sinssim.section import Duration, NotNegative, Positive, Section, Vector3
from sinssim.sensors.sets.geometry import FEWEST, READY, checked_directions, not_isolable


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
        default=None, description="given error of its reference, a rotation vector in Earth-centred inertial axes"
    )
    bias_sigma_arcsec: NotNegative | None = Field(
        default=None, description="1σ of a random error, added to the given one; default: 0"
    )
    drift_deg_h: Vector3 | None = Field(default=None, description="given drift of this error, in the same axes")
    drift_sigma_deg_h: NotNegative | None = Field(
        default=None,
        description="1σ of a random drift, added to the given one; default: that of the grade's gyro "
        "biases, 0 beside drift_deg_h",
    )
    noise_arcsec: NotNegative = Field(default=0.0, description="1σ of each reading about each axis of the block")


class Redundant(Section):
    """More single-axis gyros and accelerometers than three, along the same directions, monitored against each other."""

    type: Literal["redundant"] = Field(description="a set that survives the failure of a sensor")
    layout: Literal["cone-4", "cone-5", "dodecahedron", "skewed-triads"] | None = Field(
        default=None, description='a ready set; default: "dodecahedron", if no directions are given'
    )
    directions: tuple[Vector3, ...] | None = Field(
        default=None,
        description="4 to 12 unit vectors along the sensitive axes, each forward, right, down, instead of a ready set; "
        "each is the direction of one gyro and of one accelerometer",
    )
    monitoring: Literal["none", "detect", "exclude"] | None = Field(
        default=None,
        description='"none": all sensors are used whatever they read; "detect": faults are reported; "exclude": a '
        'faulty sensor is found and no longer used; default: "exclude", "detect" where no fault can be isolated',
    )
    windows_s: tuple[Duration, ...] = Field(
        default=(1.0, 10.0, 100.0),
        max_length=8,
        description="lengths of the sums that are tested beside each sample, for slow faults; in order",
    )
    false_alarm_probability: Annotated[float, Field(ge=1e-15, le=0.1)] = Field(
        default=1e-9, description="probability that a test finds a fault where there is none"
    )
    missed_detection_probability: Annotated[float, Field(ge=1e-9, le=0.5)] = Field(
        default=1e-3, description="probability that a test misses the smallest fault that the report states"
    )

    @property
    def axes(self) -> Array:
        """The sensitive axes, unit vectors, (m, 3)."""
        return READY[self.layout or "dodecahedron"] if self.directions is None else checked_directions(self.directions)

    @property
    def mode(self) -> Literal["none", "detect", "exclude"]:
        """What the monitoring does, with the default filled in."""
        return self.monitoring or ("detect" if not_isolable(self.axes) else "exclude")

    @model_validator(mode="after")
    def _one_set_of_directions(self) -> Self:
        if self.layout is not None and self.directions is not None:
            raise ValueError("layout and directions both give the sensitive axes: keep one of them")
        axes = self.axes
        if self.monitoring == "exclude" and (why := not_isolable(axes)):
            more = ", or take five sensors or more" if len(axes) == FEWEST else ""
            raise ValueError(
                f'monitoring = "exclude" cannot find the faulty sensor of this set: {why}; give monitoring = '
                f'"detect"{more}'
            )
        for shorter, longer in pairwise(self.windows_s):
            if not shorter < longer:
                raise ValueError(f"windows_s = {list(self.windows_s)} must increase, each longer than the one before")
        return self


class Platform(Section):
    """Three gyros and three accelerometers on a gimballed platform; navigated by "platform".

    The gyros hold the platform in inertial space and turn it at the rates that the navigator commands.
    """

    type: Literal["platform"] = Field(description="a gyro-stabilised platform, beside the same sensors strapped down")
    torquer_scale_ppm: Vector3 | None = Field(
        default=None,
        description="relative errors of the rates at which the gyros turn the platform when torqued, about its axes",
    )
    torquer_scale_sigma_ppm: NotNegative | None = Field(
        default=None,
        description="1σ of a random error, added to the given one; default: that of the gyros' scale factor, 0 beside "
        "torquer_scale_ppm",
    )
    pickoff_arcsec: Vector3 | None = Field(
        default=None, description="given errors of the gimbal angles roll, pitch and azimuth that are read out"
    )
    pickoff_sigma_arcsec: NotNegative | None = Field(
        default=None, description="1σ of a random error of each gimbal angle, added to the given one; default: 0"
    )
    pickoff_noise_arcsec: NotNegative = Field(default=0.0, description="1σ of each reading of a gimbal angle")


SensorSet = Annotated[Gyros | SixAccelerometers | AttitudeSensor | Redundant | Platform, Field(discriminator="type")]
