"""The base class of every table of a scenario file, and value types that several tables share."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from sinssim.errors import InputError


def _tuples(value: Any) -> Any:
    """Turn lists into tuples, at any depth: a frozen model holds nothing that can change."""
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


class Section(BaseModel):
    """One table of a scenario file: immutable, no unknown keys, no conversions between types, no NaN or infinity."""

    def __init__(self, /, *unnamed: object, **data: Any) -> None:
        """Check values as those of a scenario file are; the mistakes are named in an `InputError`."""
        if unnamed:
            raise InputError(f"{type(self).__name__} takes its values by name, for example {self._example()}.")
        try:
            super().__init__(**data)
        except ValidationError as error:
            from sinssim.scenario.mistakes import report

            raise InputError(report(error, type(self), {}, (), type(self).__name__)) from error

    # pydantic then makes the tables inside others by itself, and names a mistake in them by its whole path
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def _example(cls) -> str:
        return f"{cls.__name__}({next(iter(cls.model_fields), '')}=…)"

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True)

    @model_validator(mode="before")
    @classmethod
    def _arrays_are_tuples(cls, data: Any) -> Any:
        return {key: _tuples(value) for key, value in data.items()} if isinstance(data, dict) else data


def exclude_each_other(section: Section, fixed: str, sigma: str) -> None:
    """Raise for an error of which both the value and the 1σ are stated.

    Args:
        section: a table of a scenario file.
        fixed: key of the error itself.
        sigma: key of the 1σ of a random error.

    Raises:
        ValueError: both are.
    """
    stated = getattr(section, sigma) != type(section).model_fields[sigma].default
    if stated and getattr(section, fixed) is not None:
        raise ValueError(
            f"{fixed} (the error itself) and {sigma} (1σ of a random error) are both given: keep one of them"
        )


Latitude = Annotated[float, Field(ge=-90.0, le=90.0)]
"""Geodetic latitude, degrees north."""

Longitude = Annotated[float, Field(ge=-180.0, le=360.0)]
"""Longitude, degrees east."""

Heading = Annotated[float, Field(ge=-360.0, le=360.0)]
"""Heading or course, degrees clockwise from north."""

# The system's names have 255 bytes, a letter up to four, and "-interrupted" may follow.
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][\w.-]*$", max_length=60)]
"""Short name of a scenario or study, which names its directory."""

Sentence = Annotated[str, Field(max_length=1000)]
"""What a person is told on every run: a sentence or two."""

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Vector3 = tuple[float, float, float]

# Limits of what is computed with: beyond them squares overflow, inverses do not exist, or arrays fill the memory.

Duration = Annotated[float, Field(gt=0.0, le=1e9)]
"""How long something lasts, s: thirty years, in which a double still tells tenths of a microsecond apart."""

Moment = Annotated[float, Field(ge=0.0, le=1e9)]
"""Time since the beginning, s, with the limit of `Duration`."""

Timeout = Annotated[float, Field(gt=0.0, le=1e6)]
"""Time after which a leg has failed, s: eleven days, more than any aircraft stays up."""

Height = Annotated[float, Field(ge=-12_000.0, le=1e6)]
"""Height above the ellipsoid, m: from the deepest sea to where the series of the gravity models fail."""

_Speed = 12_000.0  # m/s, above the escape velocity: nothing faster stays near the Earth
Speed = Annotated[float, Field(ge=0.0, le=_Speed)]
"""Size of a velocity, m/s, at most above the escape velocity: nothing faster stays near the Earth."""
Velocity = Annotated[float, Field(ge=-_Speed, le=_Speed)]
"""Component of a velocity, m/s, with the limit of `Speed`."""

Offset = Annotated[float, Field(ge=-1e6, le=1e6)]
"""Error in its own unit: 1000 km, or all of a scale factor; a larger one is no error but another quantity."""
Spread = Annotated[float, Field(ge=0.0, le=1e6)]
"""1σ of such an error."""
Noise = Annotated[float, Field(ge=1e-12, le=1e6)]
"""1σ of a reading's white noise: below, its square is lost beside any variance of the filter."""
CorrelationTime = Annotated[float, Field(ge=1e-3, le=1e9)]
"""Correlation time, s: below the shortest sampling interval, the error is white noise; see `Duration` for the top."""

Rate = Annotated[float, Field(ge=1e-6, le=1e6)]
"""Readings per second: from one in twelve days to more than any sensor gives."""
Frequency = Annotated[float, Field(ge=1e-6, le=1e5)]
"""Hz: below, nothing moves within a run; above, no structure vibrates."""
Turn = Annotated[float, Field(gt=0.0, le=36_000.0)]
"""Angle or amplitude of a turn, degrees: a hundred turns."""
TurnRate = Annotated[float, Field(ge=-360_000.0, le=360_000.0)]
"""Degrees per second: a thousand turns per second, more than a shell or a centrifuge makes."""


def _points(axis: Vector3) -> Vector3:
    length = math.hypot(*axis)
    if not 1e-6 <= length <= 1e6:  # far beyond, its square would overflow or vanish
        raise ValueError(
            f"axis is {list(axis)}, of length {length:g}, which points nowhere; for example [0, 0, 1] is the down axis"
        )
    return axis


Axis = Annotated[Vector3, AfterValidator(_points)]
"""Direction in the block's axes, forward, right, down, of a length from 1e-6 to 1e6; 1 is usual."""

_Arm = Annotated[float, Field(ge=-1000.0, le=1000.0)]
LeverArm = tuple[_Arm, _Arm, _Arm]
"""Forward, right, down, m: no vehicle is longer."""
