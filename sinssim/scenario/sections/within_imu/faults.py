"""The [[imu.faults]] of a scenario: faults of the sensor block and their times."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from sinssim.errors import shortened
from sinssim.section import NotNegative, Positive, Section
from sinssim.sensors.imu.datasheet import not_absurd
from sinssim.sensors.sets.geometry import MOST

CHANNELS = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
"""The channels of a block of three gyros and three accelerometers."""


def channels_of(count: int) -> tuple[str, ...]:
    """Return the names of a redundant set's sensors.

    Args:
        count: number of gyros, and of accelerometers.

    Returns:
        "gyro_1", …, "accel_1", ….
    """
    return tuple(f"{kind}_{number}" for kind in ("gyro", "accel") for number in range(1, count + 1))


def _sensor(name: str) -> str:
    if name not in CHANNELS and not re.fullmatch(r"(gyro|accel)_([1-9]|1[0-9])", name):
        raise ValueError(
            f"{shortened(name)!r} is not known. Known: {', '.join(CHANNELS)}; of a redundant set gyro_1, accel_1, …"
        )
    return name


SensorChannel = Annotated[str, AfterValidator(_sensor)]
"""One gyro or accelerometer: by its axis, x forward, y right, z down, or by its number in a redundant set."""

PerSensor = Annotated[tuple[float, ...], Field(min_length=3, max_length=MOST)]
"""One number for each axis of a block, or for each sensor of a redundant set."""

_WHICH = "affected sensors; gyro_1 and so on for a redundant set; default: all"


class _Lasting(Section):
    """A fault with a duration."""

    from_s: NotNegative = Field(description="time at which the fault begins")
    to_s: Positive | None = Field(default=None, description="time at which the fault ends; default: never")

    @model_validator(mode="after")
    def _lasts(self) -> Self:
        if self.to_s is not None and not self.from_s < self.to_s:
            raise ValueError(f"to_s = {self.to_s:g} must be later than from_s = {self.from_s:g}")
        return self


class Dropout(_Lasting):
    """Samples are lost: they are zero and are flagged."""

    type: Literal["dropout"]
    channels: tuple[SensorChannel, ...] | None = Field(default=None, min_length=1, description=_WHICH)


class Freeze(_Lasting):
    """The last sample is repeated and flagged; the increments in the meantime are lost."""

    type: Literal["freeze"]
    channels: tuple[SensorChannel, ...] | None = Field(default=None, min_length=1, description=_WHICH)


class Spike(Section):
    """One sample has an additional error."""

    type: Literal["spike"]
    at_s: Positive = Field(description="time within the sample")
    gyro_arcsec: PerSensor | None = Field(default=None, description="added to the sample's angle increments")
    accel_mm_s: PerSensor | None = Field(default=None, description="added to its velocity increments")

    @field_validator("gyro_arcsec", "accel_mm_s")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd({"gyro_arcsec": "gyro_quantum_arcsec"}.get(str(info.field_name), "accel_quantum_mm_s"), value)

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not any((self.gyro_arcsec or ()) + (self.accel_mm_s or ())):
            raise ValueError("the spike has no size: give gyro_arcsec or accel_mm_s")
        return self


class BiasStep(_Lasting):
    """The biases change by a step."""

    type: Literal["bias-step"]
    gyro_deg_h: PerSensor | None = Field(default=None, description="added to the gyros' biases")
    accel_ug: PerSensor | None = Field(default=None, description="added to the accelerometers' biases")

    @field_validator("gyro_deg_h", "accel_ug")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd({"gyro_deg_h": "gyro_bias_deg_h"}.get(str(info.field_name), "accel_bias_ug"), value)

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not any((self.gyro_deg_h or ()) + (self.accel_ug or ())):
            raise ValueError("the step has no size: give gyro_deg_h or accel_ug")
        return self


class Saturation(_Lasting):
    """The range of the sensors is reduced; values beyond it are limited and flagged."""

    type: Literal["saturation"]
    gyro_deg_s: Positive | None = Field(
        default=None, description="range of the gyros, in both directions; default: unchanged"
    )
    accel_g: Positive | None = Field(default=None, description="range of the accelerometers; default: unchanged")

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if self.gyro_deg_s is None and self.accel_g is None:
            raise ValueError("the saturation has no range: give gyro_deg_s or accel_g")
        return self


class Jitter(_Lasting):
    """The time stamps have random errors; the increments belong to the true times."""

    type: Literal["jitter"]
    sigma_ms: Positive = Field(description="1σ of each time stamp, at most a tenth of the interval between samples")


def check_sensors(fault: Fault, where: str, count: int | None) -> None:
    """Raise for a fault of sensors that a set does not have.

    Args:
        fault: the fault.
        where: key of its table.
        count: number of sensors of each kind of a redundant set; None for a block of three gyros and three
            accelerometers.

    Raises:
        ValueError: a channel, or the number of values.
    """
    known = CHANNELS if count is None else channels_of(count)
    for channel in getattr(fault, "channels", None) or ():
        if channel not in known:
            raise ValueError(f"{where}.channels: {channel!r} is not known. Known: {', '.join(known)}")
    for key, value in sizes(fault).items():
        if len(value) != (count or 3):
            each = "one per axis: 3" if count is None else f"one per sensor of the redundant set: {count}"
            raise ValueError(f"{where}.{key} = {list(value)} has {len(value)} numbers; give {each}")


def faulty_sensors(fault: Fault, kind: str) -> set[int]:
    """Return the single sensors of a redundant set that a fault names.

    Args:
        fault: the fault.
        kind: "gyro" or "accel".

    Returns:
        Numbers of the sensors, from 1; none for a fault of all sensors.
    """
    numbers = (c.removeprefix(f"{kind}_") for c in getattr(fault, "channels", None) or ())
    named = {int(number) for number in numbers if number.isdigit()}
    for key, value in sizes(fault).items():
        if key.startswith(kind):
            named |= {number for number, size in enumerate(value, start=1) if size}
    return named


def concerns_gyros(fault: Fault) -> bool:
    """Return whether a fault acts on a gyro of a block of three gyros and three accelerometers.

    Args:
        fault: the fault; one that names no channels acts on all.

    Returns:
        Whether it does.
    """
    if isinstance(fault, Dropout | Freeze):
        return fault.channels is None or any(channel.startswith("gyro") for channel in fault.channels)
    if isinstance(fault, Saturation):
        return fault.gyro_deg_s is not None
    return any(any(value) for key, value in sizes(fault).items() if key.startswith("gyro"))


def sizes(fault: Fault) -> dict[str, tuple[float, ...]]:
    """Return the keys of a fault that have one number for each sensor, and their values.

    Args:
        fault: the fault.

    Returns:
        By key; empty for a fault without any.
    """
    keys = ("gyro_arcsec", "accel_mm_s", "gyro_deg_h", "accel_ug")
    return {key: value for key in keys if (value := getattr(fault, key, None)) is not None}


Fault = Annotated[Dropout | Freeze | Spike | BiasStep | Saturation | Jitter, Field(discriminator="type")]
