"""The [imu] section of a scenario: which grade of sensor block, where it sits, and what differs from the grade.

Every error that differs from run to run can be said in two ways:

- `gyro_bias_sigma_deg_h = 0.01` is a 1σ: the three axes are drawn, each from its own seeded generator;
- `gyro_bias_deg_h = [0.01, 0.0, 0.0]` is the error itself on the forward, right and down axis: nothing is drawn.

Neither means: the grade's 1σ, or none where grades have none. The random walks, the quanta and the instabilities
describe a noise and are one number for the three axes. Writing 0 switches an error off; the draws of all the others
stay what they were. What each does, and in which order, is written in `sinssim.sensors.emulate`.

The unit behind a key may be another one that datasheets use, for example `gyro_misalignment_mrad`,
`accel_bias_sigma_mg` or `accel_vrw_mps_sqrt_h`; `sinssim.scenario.datasheet` has the table.
"""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from sinssim.scenario.datasheet import QUANTITIES, in_scenario_units, not_absurd
from sinssim.scenario.faults import Fault
from sinssim.scenario.grades import find_grade
from sinssim.scenario.laser_gyro import LaserGyroSection
from sinssim.scenario.section import MOST_TILT, NotNegative, Positive, Section, TiltSigma, Vector3
from sinssim.scenario.sensor_set import AttitudeSensor, Gyros, SensorSet, SixAccelerometers

Tilt = Annotated[float, Field(ge=-MOST_TILT, le=MOST_TILT)]
SixAngles = tuple[Tilt, Tilt, Tilt, Tilt, Tilt, Tilt]
Vector6 = tuple[float, float, float, float, float, float]
Vector9 = tuple[float, float, float, float, float, float, float, float, float]
Ratio = Annotated[float, Field(gt=-1e6)]
Ratios = tuple[Ratio, Ratio, Ratio]
Celsius = Annotated[float, Field(ge=-500.0, le=500.0)]
Place = Annotated[float, Field(ge=-1e4, le=1e4)]
Places = tuple[Place, Place, Place]

_FIXED_OR_DRAWN = tuple((quantity.key, quantity.sigma_key) for quantity in QUANTITIES if quantity.drawn)


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
        gyro_asymmetry_ppm, accel_asymmetry_ppm: relative scale factor of positive inputs less that of negative ones.
        gyro_quadratic_ppm_per_deg_s, gyro_cubic_ppm_per_deg2_s2: non-linearity of the scale factor, its change with
            the rate and with the rate squared; no grade has any.
        accel_quadratic_ug_per_g2, accel_cubic_ug_per_g3: non-linearity K₂ and K₃ of IEEE Std 1293, the reading's
            error with the specific force squared and cubed; no grade has any.
        accel_cross_axis_ug_per_g2: the six couplings xy, xz, yx, yz, zx, zy; ij is the error of accelerometer i per
            force along itself and force along the block's axis j (vibro-pendulous error, IEEE Std 1293's K_ip, K_io).
        gyro_g_sensitivity_deg_h_per_g: the nine biases per specific force xx, xy, xz, yx, …, zz; ij is that of gyro i
            per force along the block's axis j.
        gyro_bias_temperature_deg_h_per_c, accel_bias_temperature_ug_per_c: biases per degree over the temperature of
            the calibration.
        gyro_scale_temperature_ppm_per_c, accel_scale_temperature_ppm_per_c: scale-factor errors per degree.
        gyro_ramp_deg_h_per_h, accel_ramp_ug_per_h: growth of the biases from the start (rate ramp R).
        gyro_arw_deg_sqrt_h, accel_vrw_ug_sqrt_hz: angle and velocity random walk N.
        gyro_quantum_arcsec, accel_quantum_mm_s: weight of one pulse of the accumulated angle or velocity.
        gyro_instability_deg_h, accel_instability_ug: 1σ of the bias instability, first-order Gauss-Markov.
        gyro_correlation_time_s, accel_correlation_time_s: correlation time of the bias instability.
        gyro_flicker_deg_h, accel_flicker_ug: B of IEEE Std 952's bias instability, whose Allan deviation is 0.664 B
            at every averaging time; no grade has any.
        gyro_rrw_deg_h_sqrt_h, accel_rrw_ug_sqrt_h: rate random walk K; no grade has any.
        gyro_range_deg_s, accel_range_g: what is beyond, either way, is cut off and flagged; None: no limit.
        temperature_start_c, temperature_steady_c: temperature of the block at the start and when it has warmed up, both
            over that of the calibration.
        warm_up_time_s: time constant of the warm-up.
        accel_arms_mm: places of the three accelerometers in the block, forward, right, down each (size effect).
        accel_delay_ms: how much later than the gyros the accelerometers sample, at most one interval.
        laser_gyro: the gyros' physics, from which their random walk and quantum follow.
        faults: what goes wrong in the run.
        *_sigma_*: 1σ to draw the error of the same name from, in place of the grade's.
    """

    grade: str = "laser-standard"
    rate_hz: Annotated[float, Field(gt=0.0, le=1e5)] = 100.0
    sensor_set: SensorSet = Gyros(type="gyros")
    lever_arm_m: Vector3 | None = None
    mounting_deg: Vector3 | None = None

    gyro_bias_deg_h: Vector3 | None = None
    gyro_bias_sigma_deg_h: NotNegative | None = None
    gyro_scale_ppm: Ratios | None = None
    gyro_scale_sigma_ppm: NotNegative | None = None
    gyro_misalignment_arcsec: SixAngles | None = None
    gyro_misalignment_sigma_arcsec: TiltSigma | None = None
    gyro_asymmetry_ppm: Vector3 | None = None
    gyro_asymmetry_sigma_ppm: NotNegative | None = None
    gyro_quadratic_ppm_per_deg_s: Vector3 | None = None
    gyro_quadratic_sigma_ppm_per_deg_s: NotNegative | None = None
    gyro_cubic_ppm_per_deg2_s2: Vector3 | None = None
    gyro_cubic_sigma_ppm_per_deg2_s2: NotNegative | None = None
    gyro_g_sensitivity_deg_h_per_g: Vector9 | None = None
    gyro_g_sensitivity_sigma_deg_h_per_g: NotNegative | None = None
    gyro_bias_temperature_deg_h_per_c: Vector3 | None = None
    gyro_bias_temperature_sigma_deg_h_per_c: NotNegative | None = None
    gyro_scale_temperature_ppm_per_c: Vector3 | None = None
    gyro_scale_temperature_sigma_ppm_per_c: NotNegative | None = None
    gyro_ramp_deg_h_per_h: Vector3 | None = None
    gyro_ramp_sigma_deg_h_per_h: NotNegative | None = None
    gyro_arw_deg_sqrt_h: NotNegative | None = None
    gyro_quantum_arcsec: NotNegative | None = None
    gyro_instability_deg_h: NotNegative | None = None
    gyro_correlation_time_s: Positive | None = None
    gyro_flicker_deg_h: NotNegative | None = None
    gyro_rrw_deg_h_sqrt_h: NotNegative | None = None
    gyro_range_deg_s: Positive | None = None

    accel_bias_ug: Vector3 | None = None
    accel_bias_sigma_ug: NotNegative | None = None
    accel_scale_ppm: Ratios | None = None
    accel_scale_sigma_ppm: NotNegative | None = None
    accel_misalignment_arcsec: SixAngles | None = None
    accel_misalignment_sigma_arcsec: TiltSigma | None = None
    accel_asymmetry_ppm: Vector3 | None = None
    accel_asymmetry_sigma_ppm: NotNegative | None = None
    accel_quadratic_ug_per_g2: Vector3 | None = None
    accel_quadratic_sigma_ug_per_g2: NotNegative | None = None
    accel_cubic_ug_per_g3: Vector3 | None = None
    accel_cubic_sigma_ug_per_g3: NotNegative | None = None
    accel_cross_axis_ug_per_g2: Vector6 | None = None
    accel_cross_axis_sigma_ug_per_g2: NotNegative | None = None
    accel_bias_temperature_ug_per_c: Vector3 | None = None
    accel_bias_temperature_sigma_ug_per_c: NotNegative | None = None
    accel_scale_temperature_ppm_per_c: Vector3 | None = None
    accel_scale_temperature_sigma_ppm_per_c: NotNegative | None = None
    accel_ramp_ug_per_h: Vector3 | None = None
    accel_ramp_sigma_ug_per_h: NotNegative | None = None
    accel_vrw_ug_sqrt_hz: NotNegative | None = None
    accel_quantum_mm_s: NotNegative = 0.0
    accel_instability_ug: NotNegative | None = None
    accel_correlation_time_s: Positive | None = None
    accel_flicker_ug: NotNegative | None = None
    accel_rrw_ug_sqrt_h: NotNegative | None = None
    accel_range_g: Positive | None = None

    temperature_start_c: Celsius = 0.0
    temperature_steady_c: Celsius = 0.0
    warm_up_time_s: Positive = 600.0
    accel_arms_mm: tuple[Places, Places, Places] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    accel_delay_ms: float = 0.0

    laser_gyro: LaserGyroSection | None = None
    faults: tuple[Fault, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _other_units(cls, data: Any) -> Any:
        return in_scenario_units(data, cls.model_fields)

    @field_validator(*(key for quantity in QUANTITIES for key in quantity.keys))
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd(str(info.field_name), value)

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
        if abs(self.accel_delay_ms) * 1e-3 * self.rate_hz > 1.0:
            raise ValueError(
                f"accel_delay_ms = {self.accel_delay_ms:g} is more than one interval between samples; at rate_hz = "
                f"{self.rate_hz:g} at most {1e3 / self.rate_hz:g} either way can be had"
            )
        for number, fault in enumerate(self.faults, start=1):
            if fault.type == "jitter" and fault.sigma_ms * 1e-3 * self.rate_hz > 0.1:
                raise ValueError(
                    f"faults.{number}.sigma_ms = {fault.sigma_ms:g} would bring the time stamps out of order; at "
                    f"rate_hz = {self.rate_hz:g} at most {100.0 / self.rate_hz:g}, a tenth of the interval, can be had"
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
            for name in ("accel_arms_mm", "accel_delay_ms", "faults"):
                if getattr(self, name) != type(self).model_fields[name].default:
                    raise ValueError(f'{name} is of a block of gyros; with sensor_set.type = "{kind}" leave it out')
        return self
