"""The description of one error term of inertial sensors, and the units that data sheets use for it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.units import ARCMIN, ARCSEC, DEG, DEG_H, DEG_SQRT_H, FOOT, G0, MPS_SQRT_H, PPM, UG

ANGLE = {"arcsec": ARCSEC, "arcmin": ARCMIN, "mrad": 1e-3, "urad": 1e-6, "deg": DEG}
RATE = {"deg_h": DEG_H, "deg_s": DEG, "mdeg_s": 1e-3 * DEG, "urad_s": 1e-6, "rad_s": 1.0}
ACCELERATION = {"ug": UG, "mg": 1e3 * UG, "g": G0, "mps2": 1.0}
RATIO = {"ppm": PPM, "percent": 1e-2}
ANGLE_WALK = {
    "deg_sqrt_h": DEG_SQRT_H,
    "deg_h_sqrt_hz": DEG_H,
    "deg_s_sqrt_hz": DEG,
    "mdeg_s_sqrt_hz": 1e-3 * DEG,
    "rad_s_sqrt_hz": 1.0,
}
VELOCITY_WALK = {
    "ug_sqrt_hz": UG,
    "mg_sqrt_hz": 1e3 * UG,
    "mps_sqrt_h": MPS_SQRT_H,
    "ftps_sqrt_h": FOOT * MPS_SQRT_H,
    "mps2_sqrt_hz": 1.0,
}
PER_HOUR = {"h": 3600.0, "s": 1.0}
PER_DEGREE = {"c": 1.0}
PER_G = {"g": G0, "mps2": 1.0}


def per(units: Mapping[str, float], below: Mapping[str, float]) -> dict[str, float]:
    """Return the units of a quotient.

    Args:
        units: units of the numerator, size in SI by name in a key.
        below: units of the denominator.

    Returns:
        Every combination, for example "deg_h_per_g".
    """
    return {f"{name}_per_{other}": size / unit for name, size in units.items() for other, unit in below.items()}


_WRITTEN = {
    "deg_h": "deg/h",
    "deg_sqrt_h": "deg/√h",
    "deg_h_sqrt_h": "deg/h/√h",
    "deg_s": "deg/s",
    "deg2_s2": "(deg/s)²",
    "ug": "µg",
    "ug_sqrt_hz": "µg/√Hz",
    "ug_sqrt_h": "µg/√h",
    "mm_s": "mm/s",
    "c": "°C",
    "g2": "g²",
    "g3": "g³",
}
"""Customary notation of units where it differs from that in keys."""

# Limits beyond any sensor: 1000 deg/s, 100 g, all of the input, a whole turn; larger values are typing errors.
_MOST = {"deg": 3.6e6, "ug": 1e8, "ppm": 1e6, "arcsec": 1.296e6, "mm": 1e8, "s": 1e9, "g": 1e6}

_OFF_DIAGONAL = ~np.eye(3, dtype=bool)

Input = Callable[[Any, Any], Any]
"""Factor that a term multiplies, from a sensor's own ideal inputs x, (..., 3), and the specific force f, (..., 3)
m/s²."""


@dataclass(frozen=True, eq=False)
class ErrorTerm:
    """One error term of three gyros or of three accelerometers.

    Attributes:
        name: its key in [imu] without the unit.
        triad: "gyro" or "accel".
        field: its field of `TriadErrors`; gyros and accelerometers may share one.
        size: number of values: 1 for a noise common to the three axes, 3 for one per axis, 6 for a matrix with a zero
            diagonal (xy, xz, yx, yz, zx, zy), 9 for a full matrix, row by row.
        units: size of each unit in SI by its name in a key; the unit of scenarios is first.
        si_unit: its SI unit; "{rate}" and "{integral}" denote the units of a reading and of an increment.
        label: its name in the report, followed by the axes for 6 or 9 values.
        meaning: short description.
        explanation: description of its key in a scenario.
        stage: the kernel's stage that applies it; "" if the kernel always applies it.
        untold: its name in the list of errors that a filter neglects; "" if a filter models it.
        calibrated: whether a calibration determines it and `sinssim.sensors.imu.compensation` removes it.
        source: its source in the alignment budget.
        multiplies: factors of its values in a mean reading at rest, one for each column of a matrix; None if the budget
            has another formula for it, or linear theory does not cover it.
        limits: limits of one value in a scenario, for `pydantic.Field`; for size 1 at least 0 by default.
        sigma_limits: limits of its 1σ.
        default: default of its key; None for the grade's value, or zero if there is none.
        without: value of the field if nothing is given.
        slots: parameters of the kernel; by default one for each value of an axis.
    """

    name: str
    triad: str
    field: str
    size: int
    units: Mapping[str, float]
    si_unit: str
    label: str
    meaning: str
    explanation: str
    stage: str = ""
    untold: str = ""
    calibrated: bool = False
    source: str = ""
    multiplies: Input | None = None
    limits: Mapping[str, float] = dataclasses.field(default_factory=dict)
    sigma_limits: Mapping[str, float] = dataclasses.field(default_factory=lambda: {"ge": 0.0})
    default: float | None = None
    without: float = 0.0
    slots: int | None = None

    @property
    def key(self) -> str:
        """Its key in a scenario."""
        return f"{self.name}_{next(iter(self.units))}"

    @property
    def sigma_key(self) -> str:
        """The key of its 1σ; a noise has none."""
        return f"{self.name}_sigma_{next(iter(self.units))}"

    @property
    def keys(self) -> tuple[str, ...]:
        """Both keys; for a noise, one."""
        return (self.key, self.sigma_key) if self.drawn else (self.key,)

    @property
    def unit(self) -> float:
        """Size in SI of the unit of scenarios."""
        return next(iter(self.units.values()))

    @property
    def written_unit(self) -> str:
        """The unit of scenarios in customary notation."""
        name = next(iter(self.units))
        if name in _WRITTEN:
            return _WRITTEN[name]
        above, _, below = name.partition("_per_")
        written = [_WRITTEN.get(part, part) for part in (above, below) if part]
        return "/".join(f"({part})" if part == "deg/s" and i else part for i, part in enumerate(written))

    @property
    def written_si_unit(self) -> str:
        """Its SI unit in customary notation."""
        rate, integral = ("rad/s", "rad") if self.triad == "gyro" else ("m/s²", "m/s")
        return self.si_unit.format(rate=rate, integral=integral)

    @property
    def most(self) -> float:
        """Largest value allowed in scenarios, in their unit."""
        return _MOST[next(iter(self.units)).partition("_")[0]]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the field."""
        return {1: (), 3: (3,)}.get(self.size, (3, 3))

    @property
    def drawn(self) -> bool:
        """Whether it differs from run to run."""
        return self.size > 1

    @property
    def about(self) -> str:
        """Description of its field of `TriadErrors`: meaning, shape and unit."""
        unit = " or ".join(dict.fromkeys(replace(self, triad=triad).written_si_unit for triad in ("gyro", "accel")))
        return f"{self.meaning}, {f'{self.shape} ' if self.shape else ''}{unit}."

    def si(self, value: Any) -> Array:
        """Return a value of one of its keys in SI, in the shape of its field; see `shaped`."""
        return self.shaped(np.array(value) * self.unit)

    def shaped(self, value: Any) -> Array:
        """Arrange its values in the shape of its field; one number stands for all."""
        if not self.drawn:
            return np.asarray(value)
        values = np.full(self.size, value)
        if self.size == 6:
            matrix = np.zeros((3, 3))
            matrix[_OFF_DIAGONAL] = values  # row by row: xy, xz, yx, yz, zx, zy
            return matrix
        return values.reshape(self.shape)

    def nothing(self) -> Any:
        """Return the value of the field if nothing is given."""
        return np.zeros(self.shape) if self.drawn else self.without
