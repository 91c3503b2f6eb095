"""The [imu] section of a scenario: which grade of sensor block, where it sits, and what differs from the grade.

Every error that differs from run to run can be said in two ways:

- `gyro_bias_sigma_deg_h = 0.01` is a 1σ: the three axes are drawn, each from its own seeded generator;
- `gyro_bias_deg_h = [0.01, 0.0, 0.0]` is the error itself on the forward, right and down axis: nothing is drawn.

Neither means: the grade's 1σ. The random walks, the quanta and the instability describe a noise and are one
number for the three axes. Writing 0 switches an error off; the draws of all the others stay what they were.
"""

from __future__ import annotations

from typing import Any, Self

from pydantic import ValidationInfo, field_validator, model_validator

from sinssim.scenario.grades import find_grade
from sinssim.scenario.laser_gyro import LaserGyroSection
from sinssim.scenario.section import NotNegative, Positive, Section, Vector3
from sinssim.scenario.sensor_set import AttitudeSensor, Gyros, SensorSet, SixAccelerometers

SixAngles = tuple[float, float, float, float, float, float]

_FIXED_OR_DRAWN = (
    ("gyro_bias_deg_h", "gyro_bias_sigma_deg_h"),
    ("gyro_scale_ppm", "gyro_scale_sigma_ppm"),
    ("gyro_misalignment_arcsec", "gyro_misalignment_sigma_arcsec"),
    ("gyro_quadratic_ppm_per_deg_s", "gyro_quadratic_sigma_ppm_per_deg_s"),
    ("gyro_cubic_ppm_per_deg2_s2", "gyro_cubic_sigma_ppm_per_deg2_s2"),
    ("accel_bias_ug", "accel_bias_sigma_ug"),
    ("accel_scale_ppm", "accel_scale_sigma_ppm"),
    ("accel_misalignment_arcsec", "accel_misalignment_sigma_arcsec"),
    ("accel_quadratic_ug_per_g2", "accel_quadratic_sigma_ug_per_g2"),
    ("accel_cubic_ug_per_g3", "accel_cubic_sigma_ug_per_g3"),
)


class ImuSection(Section):
    """The sensor block: grade, rate, place and errors.

    Attributes:
        grade: name of the grade, one of `sinssim.sensors.GRADES`.
        rate_hz: samples per second.
        lever_arm_m: place of the block from the centre of gravity, forward, right, down; None: the aircraft's.
        mounting_deg: roll, pitch and yaw of the block's axes in the vehicle's; None: the aircraft's.
        gyro_bias_deg_h, accel_bias_ug: turn-on biases (ω₀ and a₀ of equation (2)).
        gyro_scale_ppm, accel_scale_ppm: relative scale-factor errors (k and h of equation (2)).
        gyro_misalignment_arcsec, accel_misalignment_arcsec: the six angles xy, xz, yx, yz, zx, zy; ij is the tilt
            of sensitive axis i towards the block's axis j.
        gyro_quadratic_ppm_per_deg_s, gyro_cubic_ppm_per_deg2_s2: non-linearity of the scale factor, its change with
            the rate and with the rate squared; no grade has any.
        accel_quadratic_ug_per_g2, accel_cubic_ug_per_g3: non-linearity K₂ and K₃ of IEEE Std 1293, the reading's
            error with the specific force squared and cubed; no grade has any.
        gyro_arw_deg_sqrt_h, accel_vrw_ug_sqrt_hz: angle and velocity random walk.
        gyro_quantum_arcsec, accel_quantum_mm_s: weight of one pulse of the accumulated angle or velocity.
        gyro_instability_deg_h, accel_instability_ug: 1σ of the bias instability, first-order Gauss-Markov.
        gyro_correlation_time_s, accel_correlation_time_s: correlation time of the bias instability.
        laser_gyro: the gyros' physics, from which their random walk and quantum follow.
        *_sigma_*: 1σ to draw the error of the same name from, in place of the grade's.
    """

    grade: str = "laser-standard"
    rate_hz: Positive = 100.0
    sensor_set: SensorSet = Gyros(type="gyros")
    lever_arm_m: Vector3 | None = None
    mounting_deg: Vector3 | None = None

    gyro_bias_deg_h: Vector3 | None = None
    gyro_bias_sigma_deg_h: NotNegative | None = None
    gyro_scale_ppm: Vector3 | None = None
    gyro_scale_sigma_ppm: NotNegative | None = None
    gyro_misalignment_arcsec: SixAngles | None = None
    gyro_misalignment_sigma_arcsec: NotNegative | None = None
    gyro_quadratic_ppm_per_deg_s: Vector3 | None = None
    gyro_quadratic_sigma_ppm_per_deg_s: NotNegative | None = None
    gyro_cubic_ppm_per_deg2_s2: Vector3 | None = None
    gyro_cubic_sigma_ppm_per_deg2_s2: NotNegative | None = None
    gyro_arw_deg_sqrt_h: NotNegative | None = None
    gyro_quantum_arcsec: NotNegative | None = None
    gyro_instability_deg_h: NotNegative | None = None
    gyro_correlation_time_s: Positive | None = None

    accel_bias_ug: Vector3 | None = None
    accel_bias_sigma_ug: NotNegative | None = None
    accel_scale_ppm: Vector3 | None = None
    accel_scale_sigma_ppm: NotNegative | None = None
    accel_misalignment_arcsec: SixAngles | None = None
    accel_misalignment_sigma_arcsec: NotNegative | None = None
    accel_quadratic_ug_per_g2: Vector3 | None = None
    accel_quadratic_sigma_ug_per_g2: NotNegative | None = None
    accel_cubic_ug_per_g3: Vector3 | None = None
    accel_cubic_sigma_ug_per_g3: NotNegative | None = None
    accel_vrw_ug_sqrt_hz: NotNegative | None = None
    accel_quantum_mm_s: NotNegative = 0.0
    accel_instability_ug: NotNegative | None = None
    accel_correlation_time_s: Positive | None = None

    laser_gyro: LaserGyroSection | None = None

    @field_validator("grade")
    @classmethod
    def _known_grade(cls, name: str) -> str:
        find_grade(name)
        return name

    @field_validator(*(fixed for fixed, _ in _FIXED_OR_DRAWN), mode="before")
    @classmethod
    def _one_number_per_axis(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, int | float):
            sigma = dict(_FIXED_OR_DRAWN)[str(info.field_name)]
            raise ValueError(f"the error itself needs one number per axis, a list; a 1σ to draw from is {sigma}")
        return value

    @model_validator(mode="after")
    def _fixed_or_drawn(self) -> Self:
        for fixed, sigma in _FIXED_OR_DRAWN:
            if getattr(self, fixed) is not None and getattr(self, sigma) is not None:
                raise ValueError(
                    f"{fixed} (the error itself) and {sigma} (1σ to draw it from) are both given: keep one of them"
                )
        if self.laser_gyro is not None:
            for key in ("gyro_arw_deg_sqrt_h", "gyro_quantum_arcsec"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key} follows from the physics in laser_gyro, which is given too: keep one")
        return self

    @model_validator(mode="after")
    def _errors_are_of_this_set(self) -> Self:
        if isinstance(self.sensor_set, SixAccelerometers | AttitudeSensor):
            kind = self.sensor_set.type
            for name, field in type(self).model_fields.items():
                if "gyro" in name and getattr(self, name) != field.default:
                    raise ValueError(f'{name} is given, and sensor_set.type = "{kind}" has no gyros: leave it out')
            for fixed, sigma in _FIXED_OR_DRAWN:
                if kind == "accelerometers" and getattr(self, fixed) is not None:
                    raise ValueError(
                        f"{fixed} has one number per axis of a triad, and sensor_set.type = "
                        f'"{kind}" has six accelerometers, whose errors are drawn: give {sigma}'
                    )
        return self
