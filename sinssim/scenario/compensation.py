"""The [compensation] section of a scenario: how well the calibration knows the errors of the sensor block."""

from __future__ import annotations

from typing import Any

from pydantic import Field, ValidationInfo, field_validator, model_validator

from sinssim.scenario.datasheet import in_scenario_units, not_absurd
from sinssim.scenario.section import NotNegative, Section, TiltSigma

_KNOWN = "1σ of what the calibration is wrong by in"


class CompensationSection(Section):
    """Analytic compensation of the sensors' errors, in front of navigation: 0 everywhere is a perfect one.

    It knows what is constant in a run or follows the temperature, the arms and the delay of the accelerometers.
    """

    gyro_bias_sigma_deg_h: NotNegative = Field(default=0.0, description=f"{_KNOWN} the gyros' turn-on biases")
    gyro_scale_sigma_ppm: NotNegative = Field(default=0.0, description=f"{_KNOWN} their scale-factor errors")
    gyro_misalignment_sigma_arcsec: TiltSigma = Field(default=0.0, description=f"{_KNOWN} each of their six angles")
    gyro_quadratic_sigma_ppm_per_deg_s: NotNegative = Field(default=0.0, description=f"{_KNOWN} their quadratic terms")
    gyro_cubic_sigma_ppm_per_deg2_s2: NotNegative = Field(default=0.0, description=f"{_KNOWN} their cubic terms")
    gyro_asymmetry_sigma_ppm: NotNegative = Field(default=0.0, description=f"{_KNOWN} their scale-factor asymmetry")
    gyro_g_sensitivity_sigma_deg_h_per_g: NotNegative = Field(
        default=0.0, description=f"{_KNOWN} each of their nine g-sensitivities"
    )
    gyro_bias_temperature_sigma_deg_h_per_c: NotNegative = Field(
        default=0.0, description=f"{_KNOWN} their biases per degree"
    )
    gyro_scale_temperature_sigma_ppm_per_c: NotNegative = Field(
        default=0.0, description=f"{_KNOWN} their scale-factor errors per degree"
    )
    accel_bias_sigma_ug: NotNegative = Field(default=0.0, description=f"{_KNOWN} the accelerometers' biases")
    accel_scale_sigma_ppm: NotNegative = Field(default=0.0, description=f"{_KNOWN} their scale-factor errors")
    accel_misalignment_sigma_arcsec: TiltSigma = Field(default=0.0, description=f"{_KNOWN} each of their six angles")
    accel_quadratic_sigma_ug_per_g2: NotNegative = Field(default=0.0, description=f"{_KNOWN} their quadratic terms, K₂")
    accel_cubic_sigma_ug_per_g3: NotNegative = Field(default=0.0, description=f"{_KNOWN} their cubic terms, K₃")
    accel_asymmetry_sigma_ppm: NotNegative = Field(default=0.0, description=f"{_KNOWN} their scale-factor asymmetry")
    accel_cross_axis_sigma_ug_per_g2: NotNegative = Field(
        default=0.0, description=f"{_KNOWN} each of their six cross-axis couplings"
    )
    accel_bias_temperature_sigma_ug_per_c: NotNegative = Field(
        default=0.0, description=f"{_KNOWN} their biases per degree"
    )
    accel_scale_temperature_sigma_ppm_per_c: NotNegative = Field(
        default=0.0, description=f"{_KNOWN} their scale-factor errors per degree"
    )

    @model_validator(mode="before")
    @classmethod
    def _other_units(cls, data: Any) -> Any:
        return in_scenario_units(data, cls.model_fields)

    @field_validator("*")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd(str(info.field_name), value)
