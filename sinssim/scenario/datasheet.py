"""The units that datasheets of inertial sensors use: one table, and the one function that takes a line of one to SI."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from functools import cache
from typing import Any, NamedTuple

from sinssim.errors import InputError
from sinssim.units import ARCMIN, ARCSEC, DEG, DEG_H, DEG_SQRT_H, FOOT, G0, MPS_SQRT_H, PPM, UG

_HOUR = 3600.0

_ANGLE = {"arcsec": ARCSEC, "arcmin": ARCMIN, "mrad": 1e-3, "urad": 1e-6, "deg": DEG}
_RATE = {"deg_h": DEG_H, "deg_s": DEG, "mdeg_s": 1e-3 * DEG, "urad_s": 1e-6, "rad_s": 1.0}
_ACCELERATION = {"ug": UG, "mg": 1e3 * UG, "g": G0, "mps2": 1.0}
_RATIO = {"ppm": PPM, "percent": 1e-2}
_ANGLE_WALK = {
    "deg_sqrt_h": DEG_SQRT_H,
    "deg_h_sqrt_hz": DEG_H,
    "deg_s_sqrt_hz": DEG,
    "mdeg_s_sqrt_hz": 1e-3 * DEG,
    "rad_s_sqrt_hz": 1.0,
}
_VELOCITY_WALK = {
    "ug_sqrt_hz": UG,
    "mg_sqrt_hz": 1e3 * UG,
    "mps_sqrt_h": MPS_SQRT_H,
    "ftps_sqrt_h": FOOT * MPS_SQRT_H,
    "mps2_sqrt_hz": 1.0,
}


def _per(units: Mapping[str, float], below: Mapping[str, float]) -> dict[str, float]:
    return {f"{name}_per_{other}": size / per for name, size in units.items() for other, per in below.items()}


_PER_HOUR = {"h": _HOUR, "s": 1.0}
_PER_DEGREE = {"c": 1.0}


# No sensor is as bad: 1000 deg/s, 100 g, all of the input, a whole turn; what is beyond is a slip of the pen.
_MOST = {"deg": 3.6e6, "ug": 1e8, "ppm": 1e6, "arcsec": 1.296e6, "mm": 1e8, "s": 1e9, "g": 1e6}


class Quantity(NamedTuple):
    """One kind of a sensor's error as datasheets state it.

    Attributes:
        name: its key in [imu] without the unit.
        triad: "gyro" or "accel".
        field: the field of `TriadErrors` that it becomes.
        size: how many numbers: 1 for a noise, which the three axes share, 3 an axis each, 6 misalignment-like, 9 for a
            matrix row by row.
        units: size of each unit in SI by its name in a key; that of scenarios first.
    """

    name: str
    triad: str
    field: str
    size: int
    units: Mapping[str, float]

    @property
    def key(self) -> str:
        """Its key in a scenario."""
        return f"{self.name}_{next(iter(self.units))}"

    @property
    def sigma_key(self) -> str:
        """The key of the 1σ to draw it from; of a noise there is none."""
        return f"{self.name}_sigma_{next(iter(self.units))}"

    @property
    def keys(self) -> tuple[str, ...]:
        """Both of them; of a noise one."""
        return (self.key, self.sigma_key) if self.drawn else (self.key,)

    @property
    def unit(self) -> float:
        """Size in SI of the unit that scenarios use."""
        return next(iter(self.units.values()))

    @property
    def most(self) -> float:
        """Largest number that scenarios may state, in their unit."""
        return _MOST[next(iter(self.units)).partition("_")[0]]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the field."""
        return {1: (), 3: (3,)}.get(self.size, (3, 3))

    @property
    def drawn(self) -> bool:
        """Whether it differs from run to run."""
        return self.size > 1


QUANTITIES = (
    Quantity("gyro_bias", "gyro", "bias", 3, _RATE),
    Quantity("gyro_scale", "gyro", "scale", 3, _RATIO),
    Quantity("gyro_misalignment", "gyro", "misalignment", 6, _ANGLE),
    Quantity("gyro_asymmetry", "gyro", "asymmetry", 3, _RATIO),
    Quantity("gyro_quadratic", "gyro", "quadratic", 3, _per(_RATIO, {"deg_s": DEG, "rad_s": 1.0})),
    Quantity("gyro_cubic", "gyro", "cubic", 3, _per(_RATIO, {"deg2_s2": DEG**2, "rad2_s2": 1.0})),
    Quantity("gyro_g_sensitivity", "gyro", "g_sensitivity", 9, _per(_RATE, {"g": G0, "mps2": 1.0})),
    Quantity("gyro_bias_temperature", "gyro", "bias_temperature", 3, _per(_RATE, _PER_DEGREE)),
    Quantity("gyro_scale_temperature", "gyro", "scale_temperature", 3, _per(_RATIO, _PER_DEGREE)),
    Quantity("gyro_ramp", "gyro", "ramp", 3, _per(_RATE, _PER_HOUR)),
    Quantity("gyro_arw", "gyro", "random_walk", 1, _ANGLE_WALK),
    Quantity("gyro_quantum", "gyro", "quantum", 1, _ANGLE),
    Quantity("gyro_instability", "gyro", "instability", 1, _RATE),
    Quantity("gyro_correlation_time", "gyro", "correlation_time", 1, {"s": 1.0, "h": _HOUR}),
    Quantity("gyro_flicker", "gyro", "flicker", 1, _RATE),
    Quantity("gyro_rrw", "gyro", "rate_walk", 1, {"deg_h_sqrt_h": DEG_H / 60.0, "rad_s_sqrt_s": 1.0}),
    Quantity("gyro_range", "gyro", "limit", 1, {"deg_s": DEG, "rad_s": 1.0}),
    Quantity("accel_bias", "accel", "bias", 3, _ACCELERATION),
    Quantity("accel_scale", "accel", "scale", 3, _RATIO),
    Quantity("accel_misalignment", "accel", "misalignment", 6, _ANGLE),
    Quantity("accel_asymmetry", "accel", "asymmetry", 3, _RATIO),
    Quantity("accel_quadratic", "accel", "quadratic", 3, _per(_ACCELERATION, {"g2": G0**2})),
    Quantity("accel_cubic", "accel", "cubic", 3, _per(_ACCELERATION, {"g3": G0**3})),
    Quantity("accel_cross_axis", "accel", "cross_axis", 6, _per(_ACCELERATION, {"g2": G0**2})),
    Quantity("accel_bias_temperature", "accel", "bias_temperature", 3, _per(_ACCELERATION, _PER_DEGREE)),
    Quantity("accel_scale_temperature", "accel", "scale_temperature", 3, _per(_RATIO, _PER_DEGREE)),
    Quantity("accel_ramp", "accel", "ramp", 3, _per(_ACCELERATION, _PER_HOUR)),
    Quantity("accel_vrw", "accel", "random_walk", 1, _VELOCITY_WALK),
    Quantity("accel_quantum", "accel", "quantum", 1, {"mm_s": 1e-3, "mps": 1.0}),
    Quantity("accel_instability", "accel", "instability", 1, _ACCELERATION),
    Quantity("accel_correlation_time", "accel", "correlation_time", 1, {"s": 1.0, "h": _HOUR}),
    Quantity("accel_flicker", "accel", "flicker", 1, _ACCELERATION),
    Quantity("accel_rrw", "accel", "rate_walk", 1, {"ug_sqrt_h": UG / 60.0, "mps2_sqrt_s": 1.0}),
    Quantity("accel_range", "accel", "limit", 1, {"g": G0, "mps2": 1.0}),
)
"""Every error of a sensor block that a scenario can state."""

_BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}


class Line(NamedTuple):
    """A line of a datasheet, understood.

    Attributes:
        quantity: what it states.
        sigma: whether it states the 1σ to draw it from, not the error itself.
        factor: its unit in SI.
    """

    quantity: Quantity
    sigma: bool
    factor: float


@cache
def line(key: str) -> Line | None:
    """Take a key apart.

    Args:
        key: quantity and unit, for example "gyro_arw_deg_sqrt_h" or "accel_bias_sigma_mg".

    Returns:
        What it states; None if it is no key of a sensor's error.

    Raises:
        InputError: the quantity is known and the unit is not; the message lists the units.
    """
    for name in sorted(_BY_NAME, key=len, reverse=True):  # gyro_bias_temperature before gyro_bias
        if key.startswith(f"{name}_"):
            quantity, unit = _BY_NAME[name], key.removeprefix(f"{name}_")
            sigma = quantity.drawn and unit.startswith("sigma_")
            unit = unit.removeprefix("sigma_") if sigma else unit
            if unit not in quantity.units:
                raise InputError(f"{name} is not stated in {unit!r}; known units: {', '.join(quantity.units)}.")
            return Line(quantity, sigma, quantity.units[unit])
    return None


def to_si(key: str, value: float) -> float:
    """Convert one number of a datasheet to what the emulator computes with.

    Args:
        key: quantity and unit as in a scenario, for example "accel_vrw_mps_sqrt_h".
        value: the number that the datasheet states.

    Returns:
        The number in SI, as `TriadErrors` holds it.

    Raises:
        InputError: a quantity or a unit that is not known, or a number that is not finite; the message says what is.
    """
    found = line(key)
    if found is None:
        raise InputError(f"unknown quantity in {key!r}; known: {', '.join(_BY_NAME)}, each with a unit behind.")
    if not math.isfinite(value):
        raise InputError(f"{key} = {value} is not a finite number.")
    return value * found.factor


def not_absurd(key: str, value: Any) -> Any:
    """Refuse an error that no sensor has.

    Args:
        key: quantity and unit, as scenarios have them.
        value: a number, several, or None.

    Returns:
        The value.

    Raises:
        ValueError: it is too large.
    """
    found = line(key)
    if found is not None and value is not None:
        most = found.quantity.most
        for number in value if isinstance(value, tuple) else (value,):
            if not abs(number) <= most:
                raise ValueError(f"{number:g} is more than any sensor has; its size must be at most {most:g}")
    return value


def in_scenario_units(data: Any, known: Collection[str]) -> Any:
    """Put errors that are given in other units under the keys, and into the units, that scenarios use.

    Args:
        data: a table of a scenario; what is no table comes back as it is.
        known: keys that the table may have. A unit that is none stays in its key, for the schema to refuse.

    Returns:
        The table.

    Raises:
        ValueError: an error is given twice, in two units.
    """
    if not isinstance(data, dict):
        return data
    found: dict[str, Any] = {}
    for key, value in data.items():
        try:
            stated = None if key in known else line(key)
        except InputError:
            stated = None
        if stated is not None:
            quantity = stated.quantity
            key = quantity.sigma_key if stated.sigma else quantity.key
            value = _times(value, stated.factor / quantity.unit)
        if key in found:
            raise ValueError(f"{key} is given twice, in two units: keep one of them")
        found[key] = value
    return found


def _times(value: Any, factor: float) -> Any:
    """Multiply numbers, at any depth; what is no number stays for the schema to refuse."""
    if isinstance(value, list | tuple):
        return tuple(_times(item, factor) for item in value)
    return value * factor if isinstance(value, int | float) and not isinstance(value, bool) else value
