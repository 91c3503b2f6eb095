"""The [[imu.faults]] of a scenario: faults of the sensor block and their times."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from sinssim.data import Array
from sinssim.errors import shortened
from sinssim.sensors.imu.datasheet_lines import not_absurd
from sinssim.sensors.imu.imu_errors import Fault, FaultKind
from sinssim.sensors.sensor_set_section import MOST
from sinssim.toml_section import NotNegative, Positive, Section
from sinssim.units import ARCSEC, DEG, DEG_H, G0, UG

CHANNELS = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
"""The channels of a block of three gyros and three accelerometers."""


def channels_of(count: int) -> tuple[str, ...]:
    """Return the names of a redundant set's sensors: "gyro_1", …, "accel_1", …."""
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
_UNITS = {"gyro_arcsec": ARCSEC, "accel_mm_s": 1e-3, "gyro_deg_h": DEG_H, "accel_ug": UG}


class _Fault(Section):
    """A fault of a sensor block, or of the single sensors of a redundant set."""

    @property
    def sizes(self) -> dict[str, tuple[float, ...]]:
        """The keys that have one number for each sensor, and their values."""
        return {key: value for key in _UNITS if (value := getattr(self, key, None)) is not None}

    @property
    def named(self) -> tuple[str, ...]:
        """The channels that the fault names; empty for a fault of all."""
        return ()

    @property
    def of_gyros(self) -> bool:
        """Whether the fault acts on a gyro of a block of three gyros and three accelerometers."""
        return any(any(value) for key, value in self.sizes.items() if key.startswith("gyro"))

    def sensors(self, kind: str) -> set[int]:
        """Return the single sensors of a redundant set that the fault names.

        Args:
            kind: "gyro" or "accel".

        Returns:
            Numbers of the sensors, from 1; none for a fault of all sensors.
        """
        numbers = (channel.removeprefix(f"{kind}_") for channel in self.named)
        sensor_numbers = {int(number) for number in numbers if number.isdigit()}
        for key, value in self.sizes.items():
            if key.startswith(kind):
                sensor_numbers |= {number for number, size in enumerate(value, start=1) if size}
        return sensor_numbers

    def check(self, where: str, count: int | None) -> None:
        """Raise if the fault is one of sensors that the set does not have: `count` is the number of each kind of a
        redundant set; None for a block of three gyros and three accelerometers."""
        known = CHANNELS if count is None else channels_of(count)
        for channel in self.named:
            if channel not in known:
                raise ValueError(f"{where}.channels: {channel!r} is not known. Known: {', '.join(known)}")
        for key, value in self.sizes.items():
            if len(value) != (count or 3):
                each = "one per axis: 3" if count is None else f"one per sensor of the redundant set: {count}"
                raise ValueError(f"{where}.{key} = {list(value)} has {len(value)} numbers; give {each}")

    def amount(self, sensor: int | None) -> Array:
        """Return the effect on each of the six channels, as `Fault.amount`: for a sensor of a redundant set by its
        number, from 0, which is axis i mod 3 of the block that emulates it; None for a block of three gyros and three
        accelerometers."""
        amount = np.zeros(6)
        for key, values in self.sizes.items():
            first = 3 * key.startswith("accel")
            if sensor is None:
                amount[first : first + 3] = np.array(values) * _UNITS[key]
            else:
                amount[first + sensor % 3] = values[sensor] * _UNITS[key]
        return amount


class _Lasting(_Fault):
    """A fault with a duration."""

    type: FaultKind
    from_s: NotNegative = Field(description="time at which the fault begins")
    to_s: Positive | None = Field(default=None, description="time at which the fault ends; default: never")

    @model_validator(mode="after")
    def _lasts(self) -> Self:
        if self.to_s is not None and not self.from_s < self.to_s:
            raise ValueError(f"to_s = {self.to_s:g} must be later than from_s = {self.from_s:g}")
        return self

    def fault(self, sensor: int | None = None) -> Fault:
        """Return the fault in SI, of a block or of one sensor as for `amount`."""
        return Fault(self.type, self.from_s, np.inf if self.to_s is None else self.to_s, self.amount(sensor))


class _Lost(_Lasting):
    """A fault that loses the output of channels."""

    channels: tuple[SensorChannel, ...] | None = Field(default=None, min_length=1, description=_WHICH)

    @property
    def named(self) -> tuple[str, ...]:
        """The channels that the fault names; empty for a fault of all."""
        return self.channels or ()

    @property
    def of_gyros(self) -> bool:
        """Whether the fault acts on a gyro."""
        return self.channels is None or any(channel.startswith("gyro") for channel in self.channels)

    def amount(self, sensor: int | None) -> Array:
        """Return 1 for each channel that is lost, else 0."""
        amount = np.zeros(6)
        for place, name in enumerate(CHANNELS):
            if sensor is not None:  # the only axis of the block that is one of the set's sensors
                name = f"{name[:-2]}_{sensor + 1}" if place % 3 == sensor % 3 else ""
            amount[place] = bool(name) and (self.channels is None or name in self.channels)
        return amount


class Dropout(_Lost):
    """Samples are lost: they are zero and are flagged."""

    type: Literal["dropout"]


class Freeze(_Lost):
    """The last sample is repeated and flagged; the increments in the meantime are lost."""

    type: Literal["freeze"]


class Spike(_Fault):
    """One sample has an additional error."""

    rules = (
        (lambda s: not any((s.gyro_arcsec or ()) + (s.accel_mm_s or ())),
         "the spike has no size: give gyro_arcsec or accel_mm_s"),
    )  # fmt: skip

    type: Literal["spike"]
    at_s: Positive = Field(description="time within the sample")
    gyro_arcsec: PerSensor | None = Field(default=None, description="added to the sample's angle increments")
    accel_mm_s: PerSensor | None = Field(default=None, description="added to its velocity increments")

    @field_validator("gyro_arcsec", "accel_mm_s")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd({"gyro_arcsec": "gyro_quantum_arcsec"}.get(str(info.field_name), "accel_quantum_mm_s"), value)

    def fault(self, sensor: int | None = None) -> Fault:
        """Return the fault in SI, of a block or of one sensor as for `amount`."""
        return Fault("spike", self.at_s, self.at_s, self.amount(sensor))


class BiasStep(_Lasting):
    """The biases change by a step."""

    rules = (
        (lambda s: not any((s.gyro_deg_h or ()) + (s.accel_ug or ())),
         "the step has no size: give gyro_deg_h or accel_ug"),
    )  # fmt: skip

    type: Literal["bias-step"]
    gyro_deg_h: PerSensor | None = Field(default=None, description="added to the gyros' biases")
    accel_ug: PerSensor | None = Field(default=None, description="added to the accelerometers' biases")

    @field_validator("gyro_deg_h", "accel_ug")
    @classmethod
    def _of_a_sensor(cls, value: Any, info: ValidationInfo) -> Any:
        return not_absurd({"gyro_deg_h": "gyro_bias_deg_h"}.get(str(info.field_name), "accel_bias_ug"), value)


class Saturation(_Lasting):
    """The range of the sensors is reduced; values beyond it are limited and flagged."""

    rules = (
        (lambda s: s.gyro_deg_s is None and s.accel_g is None,
         "the saturation has no range: give gyro_deg_s or accel_g"),
    )  # fmt: skip

    type: Literal["saturation"]
    gyro_deg_s: Positive | None = Field(
        default=None, description="range of the gyros, in both directions; default: unchanged"
    )
    accel_g: Positive | None = Field(default=None, description="range of the accelerometers; default: unchanged")

    @property
    def of_gyros(self) -> bool:
        """Whether the fault acts on gyros."""
        return self.gyro_deg_s is not None

    def amount(self, sensor: int | None) -> Array:
        """Return the range of each channel, 0 for no change."""
        return np.repeat([(self.gyro_deg_s or 0.0) * DEG, (self.accel_g or 0.0) * G0], 3)


class Jitter(_Lasting):
    """The time stamps have random errors; the increments belong to the true times."""

    type: Literal["jitter"]
    sigma_ms: Positive = Field(description="1σ of each time stamp, at most a tenth of the interval between samples")

    def amount(self, sensor: int | None) -> Array:
        """Return the 1σ of the time stamps, s, as the first value."""
        return np.array([self.sigma_ms * 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])


ImuFault = Annotated[Dropout | Freeze | Spike | BiasStep | Saturation | Jitter, Field(discriminator="type")]
