"""The [compensation] section of a scenario: the calibration errors of the sensor block."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, ValidationInfo, create_model, field_validator, model_validator

from sinssim.section import Section
from sinssim.sensors.imu.datasheet import in_scenario_units, not_absurd
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.terms import TERMS

_SENSORS = {"gyro": "gyros", "accel": "accelerometers"}


def _key(term: ErrorTerm) -> Any:
    """Return type and default of one term's key."""
    error = f"1σ of the calibration error of the {_SENSORS[term.triad]}: {term.untold or term.explanation}"
    return Annotated[float, Field(**dict[str, Any](term.sigma_limits))], Field(default=0.0, description=error)


if TYPE_CHECKING:
    _Terms = Section
else:
    _Terms = create_model(
        "_Terms", __base__=Section, **{term.sigma_key: _key(term) for term in TERMS if term.calibrated}
    )


class CompensationSection(_Terms):
    """Analytic compensation of the sensors' errors before navigation; with 0 everywhere it is perfect.

    It removes the errors that are constant in a run or depend on the temperature, and the effects of the
    accelerometers' arms and delay.
    """

    @model_validator(mode="before")
    @classmethod
    def _other_units(cls, data: Any) -> Any:
        return in_scenario_units(data, cls.model_fields)

    @field_validator("*")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd(str(info.field_name), value)
