"""The [imu.sensor_set] table: one of the textbook chapter's three sets (section 8.1), a redundant set, a platform."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sinssim.data import Array
from sinssim.sensors.sets.redundant_geometry import FEWEST, READY, checked_directions, not_isolable
from sinssim.toml_section import Duration, Keys, NotNegative, Positive, Section, Vector3


class Gyros(Section):
    """Three accelerometers and three gyros."""

    type: Literal["gyros"] = Field(description="the usual set, which is the second in the chapter")


class SixAccelerometers(Section):
    """Six accelerometers at the centres of the faces of a cube, without gyros; each has the errors of [imu]."""

    type: Literal["accelerometers"] = Field(description="the first set in the chapter")
    arm_m: Positive = Field(
        description="distance from the centre of the cube, which is the position of the sensor block, to each face"
    )


class AttitudeSensor(Section):
    """Three accelerometers and a sensor of the attitude in inertial space; the algorithm is "measured-attitude"."""

    type: Literal["attitude-sensor"] = Field(description="the third set in the chapter")
    bias_arcsec: Vector3 | None = Field(
        default=None,
        description="given error of the attitude reference, as a rotation vector in Earth-centred inertial axes",
    )
    bias_sigma_arcsec: NotNegative | None = Field(
        default=None, description="1σ of a random error, added to the given one; default: 0"
    )
    drift_deg_h: Vector3 | None = Field(default=None, description="given drift of this error, in the same axes")
    drift_sigma_deg_h: NotNegative | None = Field(
        default=None,
        description="1σ of a random drift, added to the given one; default: that of the gyro biases of the grade, or "
        "0 if drift_deg_h is given",
    )
    noise_arcsec: NotNegative = Field(
        default=0.0, description="1σ of each measurement about each axis of the sensor block"
    )


class Redundant(Section):
    """More than three single-axis gyros and accelerometers along the same directions, with mutual monitoring."""

    at_most_one = (Keys(("layout", "directions"), "the sensitive axes"),)

    type: Literal["redundant"] = Field(description="a set that tolerates the failure of a sensor")
    layout: Literal["cone-4", "cone-5", "dodecahedron", "skewed-triads"] | None = Field(
        default=None, description='predefined set; default: "dodecahedron", if no directions are given'
    )
    directions: tuple[Vector3, ...] | None = Field(
        default=None,
        description="4 to 12 unit vectors along the sensitive axes, each forward, right, down, instead of a "
        "predefined set; each is the direction of one gyro and of one accelerometer",
    )
    monitoring: Literal["none", "detect", "exclude"] | None = Field(
        default=None,
        description='"none": all sensors are used without monitoring; "detect": faults are reported; "exclude": a '
        'faulty sensor is isolated and excluded; default: "exclude", or "detect" if faults cannot be isolated',
    )
    windows_s: tuple[Duration, ...] = Field(
        default=(1.0, 10.0, 100.0),
        max_length=8,
        description="lengths of the sums that are tested in addition to each sample, to detect slowly growing faults; "
        "in ascending order",
    )
    false_alarm_probability: Annotated[float, Field(ge=1e-15, le=0.1)] = Field(
        default=1e-9, description="probability that a test reports a fault although there is none"
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
    """Three gyros and three accelerometers on a gimballed platform; the algorithm is "platform". The gyros stabilise
    the platform in inertial space and torque it at the rates that the navigation algorithm commands."""

    type: Literal["platform"] = Field(
        description="a gyro-stabilised platform; the same sensors can also be used as a strapdown system"
    )
    torquer_scale_ppm: Vector3 | None = Field(
        default=None,
        description="relative errors of the torquing rates about the axes of the platform",
    )
    torquer_scale_sigma_ppm: NotNegative | None = Field(
        default=None,
        description="1σ of a random error, added to the given one; default: that of the scale factor of the gyros, or "
        "0 if torquer_scale_ppm is given",
    )
    pickoff_arcsec: Vector3 | None = Field(
        default=None, description="given errors of the measured gimbal angles roll, pitch and azimuth"
    )
    pickoff_sigma_arcsec: NotNegative | None = Field(
        default=None, description="1σ of a random error of each gimbal angle, added to the given one; default: 0"
    )
    pickoff_noise_arcsec: NotNegative = Field(default=0.0, description="1σ of each measurement of a gimbal angle")


SensorSet = Annotated[Gyros | SixAccelerometers | AttitudeSensor | Redundant | Platform, Field(discriminator="type")]
