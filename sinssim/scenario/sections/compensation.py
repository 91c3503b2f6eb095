"""The [compensation] section of a scenario: the calibration errors of the sensor block."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, create_model, model_validator

from sinssim.errors import InputError
from sinssim.scenario.sections.imu import Places
from sinssim.sensors.imu.datasheet import ErrorTable
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.terms import TERMS
from sinssim.toml_file import read_toml

_SENSORS = {"gyro": "gyros", "accel": "accelerometers"}


def _keys(term: ErrorTerm) -> Iterator[tuple[str, Any]]:
    """Yield the keys of one term with their types and defaults: calibrated value, and 1σ of its error."""
    number: Any = Annotated[float, Field(**dict[str, Any](term.limits))] if term.limits else float
    several: Any = tuple.__class_getitem__((number,) * term.size)
    value = "measured calibration value, which is subtracted; the next key is its uncertainty"
    yield term.key, (several | None, Field(default=None, description=value))
    error = f"1σ of the calibration error of the {_SENSORS[term.triad]}: {term.untold or term.explanation}"
    sigma: Any = Annotated[float, Field(**dict[str, Any](term.sigma_limits))]
    yield term.sigma_key, (sigma, Field(default=0.0, description=error))


if TYPE_CHECKING:
    _Terms = ErrorTable
else:
    _Terms = create_model(
        "_Terms", __base__=ErrorTable, **{key: kind for term in TERMS if term.calibrated for key, kind in _keys(term)}
    )


class CompensationSection(_Terms):
    """Analytic compensation of the sensor errors before navigation. If all keys are 0, the compensation is perfect. It
    removes the errors that are constant in a run or depend on the temperature, and the effects of the arms and the
    delay of the accelerometers. An error with a measured calibration value is compensated by this value, which may
    differ from the true error. Any other error is compensated by the true error of the run minus a random error of the
    given 1σ. The filter assumes the 1σ in both cases."""

    file: str | None = Field(
        default=None,
        description="path of a calibration by `sinssim calibrate`, relative to this file; its table [compensation] is "
        "used; keys given here replace those of the file",
    )
    accel_arms_mm: tuple[Places, Places, Places] | None = Field(
        default=None,
        description="calibrated positions of the three accelerometers, each forward, right, down; default: the true "
        "positions",
    )

    @model_validator(mode="before")
    @classmethod
    def _of_file(cls, data: Any) -> Any:
        """Replace the file by its contents."""
        if not isinstance(data, dict) or not isinstance(data.get("file"), str):
            return data
        path = Path(data["file"])
        try:
            table = read_toml(path)[1].get("compensation")
        except InputError as error:
            raise ValueError(f"file: {str(error).rstrip('.')}") from error
        if not isinstance(table, dict):
            raise ValueError(f"file: {path} has no table [compensation]; give one that `sinssim calibrate` made")
        if "file" in table:
            raise ValueError(f"file: {path} refers to another file; give that one")
        return {**table, **{key: value for key, value in data.items() if key != "file"}}

    @model_validator(mode="after")
    def _values_have_uncertainties(self) -> Self:
        for term in TERMS:
            if term.calibrated and getattr(self, term.key) is not None and term.sigma_key not in self.model_fields_set:
                raise ValueError(
                    f"{term.key} (the calibration value) needs its uncertainty: give {term.sigma_key}, 0 if exact"
                )
        return self

    def uncertainties(self) -> CompensationSection:
        """Return the section without its measured values, with the 1σ alone."""
        return CompensationSection(**{t.sigma_key: getattr(self, t.sigma_key) for t in TERMS if t.calibrated})
