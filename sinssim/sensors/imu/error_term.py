"""What describes one error of inertial sensors, and the units in which datasheets state it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

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
        units: of the numerator, size in SI by name in a key.
        below: of the denominator.

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
"""Units as people write them, where that is not the key's own way."""

# No sensor is as bad: 1000 deg/s, 100 g, all of the input, a whole turn; what is beyond is a slip of the pen.
_MOST = {"deg": 3.6e6, "ug": 1e8, "ppm": 1e6, "arcsec": 1.296e6, "mm": 1e8, "s": 1e9, "g": 1e6}

Input = Callable[[Any, Any], Any]
"""Of a sensor's own ideal inputs x, (..., 3), and the specific force f, (..., 3) m/s², what a term multiplies."""


@dataclass(frozen=True, eq=False)
class ErrorTerm:
    """One error of three gyros or of three accelerometers.

    Attributes:
        name: its key in [imu] without the unit.
        triad: "gyro" or "accel".
        field: the field of `TriadErrors` that it becomes; gyros and accelerometers may share one.
        size: how many numbers: 1 for a noise, which the three axes share, 3 an axis each, 6 a matrix with a diagonal
            of zeros, xy, xz, yx, yz, zx, zy, and 9 a whole one, row by row.
        units: size of each unit in SI by its name in a key; that of scenarios first.
        si_unit: its unit in SI; "{rate}" and "{integral}" stand for those of a reading and of an increment.
        label: its name in the report; of 6 or 9 numbers the axis follows.
        meaning: what it is, in plain words.
        explanation: of its key in a scenario.
        stage: of the kernel, without which it does nothing; "" for what the kernel always does.
        untold: its name in the list of what a filter does not know; "" if a filter is told of it.
        calibrated: whether a calibration knows it and `sinssim.sensors.imu.compensation` undoes it.
        source: of the alignment budget, that it is part of.
        multiplies: what its numbers multiply in a mean reading at rest, a part for each column of a matrix; None if the
            budget has another formula for it, or linear theory does not cover it.
        limits: of one number in a scenario, as `pydantic.Field` takes them; of size 1 at least 0 by default.
        sigma_limits: of its 1σ.
        default: of its key; None takes the grade's value or none.
        without: the value of the field where nothing is said.
        slots: parameters of the kernel; by default one for each number of an axis.
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
        """The key of the 1σ to draw it from; a noise has none."""
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
    def written_unit(self) -> str:
        """That unit as people write it."""
        name = next(iter(self.units))
        if name in _WRITTEN:
            return _WRITTEN[name]
        above, _, below = name.partition("_per_")
        written = [_WRITTEN.get(part, part) for part in (above, below) if part]
        return "/".join(f"({part})" if part == "deg/s" and i else part for i, part in enumerate(written))

    @property
    def written_si_unit(self) -> str:
        """Its unit in SI as people write it."""
        rate, integral = ("rad/s", "rad") if self.triad == "gyro" else ("m/s²", "m/s")
        return self.si_unit.format(rate=rate, integral=integral)

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

    @property
    def about(self) -> str:
        """What its field of `TriadErrors` holds: meaning, shape and unit."""
        unit = " or ".join(dict.fromkeys(replace(self, triad=triad).written_si_unit for triad in ("gyro", "accel")))
        return f"{self.meaning}, {f'{self.shape} ' if self.shape else ''}{unit}."

    def nothing(self) -> Any:
        """Return the value of the field where nothing is said."""
        return np.zeros(self.shape) if self.drawn else self.without
