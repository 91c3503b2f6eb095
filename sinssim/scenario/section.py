"""The base of every table of a scenario file, and the kinds of values that several tables share."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator


def _tuples(value: Any) -> Any:
    """Turn lists into tuples, at any depth: a frozen model holds nothing that can change."""
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


class Section(BaseModel):
    """One table of a scenario file: immutable, no unknown keys, no conversions between types, no NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True)

    @model_validator(mode="before")
    @classmethod
    def _arrays_are_tuples(cls, data: Any) -> Any:
        return {key: _tuples(value) for key, value in data.items()} if isinstance(data, dict) else data


Latitude = Annotated[float, Field(ge=-90.0, le=90.0)]
"""Geodetic latitude, degrees north."""

Longitude = Annotated[float, Field(ge=-180.0, le=360.0)]
"""Longitude, degrees east."""

Heading = Annotated[float, Field(ge=-360.0, le=360.0)]
"""Heading or course, degrees clockwise from north."""

Positive = Annotated[float, Field(gt=0.0)]
MOST_TILT = 40_000.0
"""Largest angle of misalignment, arcsec: beyond 11 degrees three axes are no block any more."""
TiltSigma = Annotated[float, Field(ge=0.0, le=MOST_TILT / 4.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Vector3 = tuple[float, float, float]
