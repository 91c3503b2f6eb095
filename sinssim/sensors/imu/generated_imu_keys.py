"""The fields that follow from the table of terms: the errors of a triad, and the keys of error terms.

This file is written by `python -m tests.sensors.imu.write_fields`; edit
`sinssim/sensors/imu/error_term_table.py` instead.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from pydantic import Field

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.sensors.imu.datasheet_lines import ErrorTable
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import FIELDS, SLOTS
from sinssim.toml_section import NotNegative, Positive


@dataclass(frozen=True, kw_only=True)
class TriadErrors:
    """The errors of three gyros or three accelerometers, SI; all zero unless given.

    `sinssim.sensors.imu.emulation` describes the effect of each.

    Attributes:
        bias: output at zero input, constant in a run, (3,) rad/s or m/s².
        scale: relative error of the output, (3,) 1.
        misalignment: tilt of a sensitive axis towards each of the others, (3, 3) rad.
        asymmetry: scale factor of positive inputs minus that of negative ones, (3,) 1.
        quadratic: error that grows with the square of the input, (3,) 1/(rad/s) or 1/(m/s²).
        cubic: error that grows with the cube of the input, (3,) 1/(rad/s)² or 1/(m/s²)².
        cross_axis: error that grows with the product of the inputs along and across the sensitive axis, (3, 3)
            1/(rad/s) or 1/(m/s²).
        g_sensitivity: apparent rate due to an acceleration, (3, 3) rad/s/(m/s²).
        bias_temperature: change of the bias per degree of warming, (3,) rad/s/K or m/s²/K.
        scale_temperature: change of the scale-factor error per degree of warming, (3,) 1/K.
        ramp: steady growth of the bias, (3,) rad/s/s or m/s²/s.
        random_walk: white noise: random walk of the angle, growing with √t, rad/√s or m/s/√s.
        quantum: weight of one pulse of the accumulated output, rad or m/s.
        instability: slow variation of the bias within a run, rad/s or m/s².
        correlation_time: correlation time of the variation of the bias, s.
        flicker: bias instability B, floor of the Allan deviation over 0.664, rad/s or m/s².
        rate_walk: random walk of the bias itself, growing with √t, rad/s/√s or m/s²/√s.
        limit: largest input that the sensor can measure, rad/s or m/s².
    """

    bias: Array = field(default_factory=lambda: np.zeros(3))
    scale: Array = field(default_factory=lambda: np.zeros(3))
    misalignment: Array = field(default_factory=lambda: np.zeros((3, 3)))
    asymmetry: Array = field(default_factory=lambda: np.zeros(3))
    quadratic: Array = field(default_factory=lambda: np.zeros(3))
    cubic: Array = field(default_factory=lambda: np.zeros(3))
    cross_axis: Array = field(default_factory=lambda: np.zeros((3, 3)))
    g_sensitivity: Array = field(default_factory=lambda: np.zeros((3, 3)))
    bias_temperature: Array = field(default_factory=lambda: np.zeros(3))
    scale_temperature: Array = field(default_factory=lambda: np.zeros(3))
    ramp: Array = field(default_factory=lambda: np.zeros(3))
    random_walk: float = 0.0
    quantum: float = 0.0
    instability: float = 0.0
    correlation_time: float = 3600.0
    flicker: float = 0.0
    rate_walk: float = 0.0
    limit: float = 0.0

    def __post_init__(self) -> None:
        """Convert lists and integers to arrays and numbers of doubles, and refuse other objects by name."""
        for name in SLOTS:
            value = getattr(self, name)
            if type(value) is float or (type(value) is np.ndarray and value.dtype == np.float64):
                continue
            array = numbers(f"TriadErrors: {name}", value)
            object.__setattr__(self, name, float(array) if array.ndim == 0 else array)

    @property
    def acting(self) -> list[tuple[ErrorTerm, Array]]:
        """The rows of the table whose values multiply something in the readings and are not all zero, with these."""
        given = ((term, getattr(self, name)) for name, term in FIELDS.items() if term.multiplies is not None)
        return [(term, value) for term, value in given if np.count_nonzero(value)]


Three = tuple[float, float, float]
Scale = Annotated[float, Field(gt=-1000000.0)]
ScaleThree = tuple[Scale, Scale, Scale]
Misalignment = Annotated[float, Field(ge=-40000.0, le=40000.0)]
MisalignmentSigma = Annotated[float, Field(ge=0.0, le=10000.0)]
MisalignmentSix = tuple[Misalignment, Misalignment, Misalignment, Misalignment, Misalignment, Misalignment]
Nine = tuple[float, float, float, float, float, float, float, float, float]
Six = tuple[float, float, float, float, float, float]

_SIGMA = (
    "1σ of the random error of the same name, added to the given one; default: that of the grade, or 0 if an error is "
    "given"
)
_MEASURED = "measured calibration value, which is subtracted; the next key is its uncertainty"


class ImuKeys(ErrorTable):
    """The keys of the error terms of a sensor block."""

    gyro_bias_deg_h: Three | None = Field(default=None, description="turn-on biases (ω₀ and a₀ of equation (2))")
    gyro_bias_sigma_deg_h: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_scale_ppm: ScaleThree | None = Field(
        default=None, description="relative scale-factor errors (k and h of equation (2))"
    )
    gyro_scale_sigma_ppm: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_misalignment_arcsec: MisalignmentSix | None = Field(
        default=None,
        description="the six angles xy, xz, yx, yz, zx, zy; ij is the tilt of sensitive axis i towards axis j of the "
        "sensor block",
    )
    gyro_misalignment_sigma_arcsec: MisalignmentSigma | None = Field(default=None, description=_SIGMA)
    gyro_asymmetry_ppm: Three | None = Field(
        default=None, description="relative scale factor for positive inputs minus that for negative inputs"
    )
    gyro_asymmetry_sigma_ppm: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_quadratic_ppm_per_deg_s: Three | None = Field(
        default=None,
        description="non-linearity of the scale factor: its change with the rate and with the square of the rate; "
        "zero in all grades",
    )
    gyro_quadratic_sigma_ppm_per_deg_s: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_cubic_ppm_per_deg2_s2: Three | None = Field(
        default=None,
        description="non-linearity of the scale factor: its change with the rate and with the square of the rate; "
        "zero in all grades",
    )
    gyro_cubic_sigma_ppm_per_deg2_s2: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_g_sensitivity_deg_h_per_g: Nine | None = Field(
        default=None,
        description="the nine biases per specific force xx, xy, xz, yx, …, zz; ij is the bias of gyro i per specific "
        "force along axis j of the sensor block",
    )
    gyro_g_sensitivity_sigma_deg_h_per_g: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_bias_temperature_deg_h_per_c: Three | None = Field(
        default=None, description="biases per degree Celsius above the temperature of the calibration"
    )
    gyro_bias_temperature_sigma_deg_h_per_c: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_scale_temperature_ppm_per_c: Three | None = Field(
        default=None, description="scale-factor errors per degree Celsius"
    )
    gyro_scale_temperature_sigma_ppm_per_c: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_ramp_deg_h_per_h: Three | None = Field(
        default=None, description="growth of the biases from the start (rate ramp R)"
    )
    gyro_ramp_sigma_deg_h_per_h: NotNegative | None = Field(default=None, description=_SIGMA)
    gyro_arw_deg_sqrt_h: NotNegative | None = Field(default=None, description="angle and velocity random walk N")
    gyro_quantum_arcsec: NotNegative | None = Field(
        default=None, description="weight of one pulse of the accumulated angle or velocity"
    )
    gyro_instability_deg_h: NotNegative | None = Field(
        default=None, description="1σ of the bias instability, first-order Gauss-Markov"
    )
    gyro_correlation_time_s: Positive | None = Field(
        default=None, description="correlation time of the bias instability; default: 3600"
    )
    gyro_flicker_deg_h: NotNegative | None = Field(
        default=None,
        description="coefficient B of the bias instability in IEEE Std 952, whose Allan deviation is 0.664 B at "
        "every averaging time; zero in all grades",
    )
    gyro_rrw_deg_h_sqrt_h: NotNegative | None = Field(
        default=None, description="rate random walk K; zero in all grades"
    )
    gyro_range_deg_s: Positive | None = Field(
        default=None,
        description="range in both directions; values beyond it are limited and flagged; default: no limit",
    )
    accel_bias_ug: Three | None = Field(default=None, description="turn-on biases (ω₀ and a₀ of equation (2))")
    accel_bias_sigma_ug: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_scale_ppm: ScaleThree | None = Field(
        default=None, description="relative scale-factor errors (k and h of equation (2))"
    )
    accel_scale_sigma_ppm: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_misalignment_arcsec: MisalignmentSix | None = Field(
        default=None,
        description="the six angles xy, xz, yx, yz, zx, zy; ij is the tilt of sensitive axis i towards axis j of the "
        "sensor block",
    )
    accel_misalignment_sigma_arcsec: MisalignmentSigma | None = Field(default=None, description=_SIGMA)
    accel_asymmetry_ppm: Three | None = Field(
        default=None, description="relative scale factor for positive inputs minus that for negative inputs"
    )
    accel_asymmetry_sigma_ppm: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_quadratic_ug_per_g2: Three | None = Field(
        default=None,
        description="non-linearity K₂ and K₃ of IEEE Std 1293: the output error per square and per cube of the "
        "specific force; zero in all grades",
    )
    accel_quadratic_sigma_ug_per_g2: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_cubic_ug_per_g3: Three | None = Field(
        default=None,
        description="non-linearity K₂ and K₃ of IEEE Std 1293: the output error per square and per cube of the "
        "specific force; zero in all grades",
    )
    accel_cubic_sigma_ug_per_g3: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_cross_axis_ug_per_g2: Six | None = Field(
        default=None,
        description="the six couplings xy, xz, yx, yz, zx, zy; ij is the error of accelerometer i per product of the "
        "specific forces along its own axis and along axis j of the sensor block (vibro-pendulous error, "
        "K_ip and K_io of IEEE Std 1293)",
    )
    accel_cross_axis_sigma_ug_per_g2: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_bias_temperature_ug_per_c: Three | None = Field(
        default=None, description="biases per degree Celsius above the temperature of the calibration"
    )
    accel_bias_temperature_sigma_ug_per_c: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_scale_temperature_ppm_per_c: Three | None = Field(
        default=None, description="scale-factor errors per degree Celsius"
    )
    accel_scale_temperature_sigma_ppm_per_c: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_ramp_ug_per_h: Three | None = Field(
        default=None, description="growth of the biases from the start (rate ramp R)"
    )
    accel_ramp_sigma_ug_per_h: NotNegative | None = Field(default=None, description=_SIGMA)
    accel_vrw_ug_sqrt_hz: NotNegative | None = Field(default=None, description="angle and velocity random walk N")
    accel_quantum_mm_s: NotNegative = Field(
        default=0.0, description="weight of one pulse of the accumulated angle or velocity"
    )
    accel_instability_ug: NotNegative | None = Field(
        default=None, description="1σ of the bias instability, first-order Gauss-Markov"
    )
    accel_correlation_time_s: Positive | None = Field(
        default=None, description="correlation time of the bias instability; default: 3600"
    )
    accel_flicker_ug: NotNegative | None = Field(
        default=None,
        description="coefficient B of the bias instability in IEEE Std 952, whose Allan deviation is 0.664 B at "
        "every averaging time; zero in all grades",
    )
    accel_rrw_ug_sqrt_h: NotNegative | None = Field(default=None, description="rate random walk K; zero in all grades")
    accel_range_g: Positive | None = Field(
        default=None,
        description="range in both directions; values beyond it are limited and flagged; default: no limit",
    )


class CompensationKeys(ErrorTable):
    """The keys of the error terms that a calibration determines."""

    gyro_bias_deg_h: Three | None = Field(default=None, description=_MEASURED)
    gyro_bias_sigma_deg_h: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the gyros: turn-on biases (ω₀ and a₀ of equation (2))"
    )
    gyro_scale_ppm: ScaleThree | None = Field(default=None, description=_MEASURED)
    gyro_scale_sigma_ppm: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the gyros: scale factors"
    )
    gyro_misalignment_arcsec: MisalignmentSix | None = Field(default=None, description=_MEASURED)
    gyro_misalignment_sigma_arcsec: MisalignmentSigma = Field(
        default=0.0, description="1σ of the calibration error of the gyros: misalignments"
    )
    gyro_asymmetry_ppm: Three | None = Field(default=None, description=_MEASURED)
    gyro_asymmetry_sigma_ppm: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the gyros: asymmetry"
    )
    gyro_quadratic_ppm_per_deg_s: Three | None = Field(default=None, description=_MEASURED)
    gyro_quadratic_sigma_ppm_per_deg_s: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the gyros: quadratic terms"
    )
    gyro_cubic_ppm_per_deg2_s2: Three | None = Field(default=None, description=_MEASURED)
    gyro_cubic_sigma_ppm_per_deg2_s2: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the gyros: cubic terms"
    )
    gyro_g_sensitivity_deg_h_per_g: Nine | None = Field(default=None, description=_MEASURED)
    gyro_g_sensitivity_sigma_deg_h_per_g: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the gyros: sensitivity to g"
    )
    gyro_bias_temperature_deg_h_per_c: Three | None = Field(default=None, description=_MEASURED)
    gyro_bias_temperature_sigma_deg_h_per_c: NotNegative = Field(
        default=0.0,
        description="1σ of the calibration error of the gyros: biases per degree Celsius above the temperature of "
        "the calibration",
    )
    gyro_scale_temperature_ppm_per_c: Three | None = Field(default=None, description=_MEASURED)
    gyro_scale_temperature_sigma_ppm_per_c: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the gyros: scale factors' dependence on temperature"
    )
    accel_bias_ug: Three | None = Field(default=None, description=_MEASURED)
    accel_bias_sigma_ug: NotNegative = Field(
        default=0.0,
        description="1σ of the calibration error of the accelerometers: turn-on biases (ω₀ and a₀ of equation (2))",
    )
    accel_scale_ppm: ScaleThree | None = Field(default=None, description=_MEASURED)
    accel_scale_sigma_ppm: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the accelerometers: scale factors"
    )
    accel_misalignment_arcsec: MisalignmentSix | None = Field(default=None, description=_MEASURED)
    accel_misalignment_sigma_arcsec: MisalignmentSigma = Field(
        default=0.0, description="1σ of the calibration error of the accelerometers: misalignments"
    )
    accel_asymmetry_ppm: Three | None = Field(default=None, description=_MEASURED)
    accel_asymmetry_sigma_ppm: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the accelerometers: asymmetry"
    )
    accel_quadratic_ug_per_g2: Three | None = Field(default=None, description=_MEASURED)
    accel_quadratic_sigma_ug_per_g2: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the accelerometers: quadratic terms"
    )
    accel_cubic_ug_per_g3: Three | None = Field(default=None, description=_MEASURED)
    accel_cubic_sigma_ug_per_g3: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the accelerometers: cubic terms"
    )
    accel_cross_axis_ug_per_g2: Six | None = Field(default=None, description=_MEASURED)
    accel_cross_axis_sigma_ug_per_g2: NotNegative = Field(
        default=0.0, description="1σ of the calibration error of the accelerometers: cross-axis coupling"
    )
    accel_bias_temperature_ug_per_c: Three | None = Field(default=None, description=_MEASURED)
    accel_bias_temperature_sigma_ug_per_c: NotNegative = Field(
        default=0.0,
        description="1σ of the calibration error of the accelerometers: biases per degree Celsius above the "
        "temperature of the calibration",
    )
    accel_scale_temperature_ppm_per_c: Three | None = Field(default=None, description=_MEASURED)
    accel_scale_temperature_sigma_ppm_per_c: NotNegative = Field(
        default=0.0,
        description="1σ of the calibration error of the accelerometers: scale factors' dependence on temperature",
    )
