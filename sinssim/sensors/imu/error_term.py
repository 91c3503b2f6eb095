"""The description of one error term of inertial sensors."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array

# Limits beyond any sensor: 1000 deg/s, 100 g, all of the input, a whole turn; larger values are typing errors.
_MOST = {"deg": 3.6e6, "ug": 1e8, "ppm": 1e6, "arcsec": 1.296e6, "mm": 1e8, "s": 1e9, "g": 1e6}

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

_OFF_DIAGONAL = ~np.eye(3, dtype=bool)

Regressor = Callable[[Any, Any, Any, Any, Any], Any]
"""What one value of a term multiplies in the mean reading of its sensor, to first order: of `sensed`, the mean rate or
specific force along the sensitive axis of sensor i; `along`, that along axis j of the sensor block; `force`, the
specific force along axis j, m/s²; `warmth`, the temperature above that of the calibration, K; `time` since the start,
s. A value with one index has j = i. Sums, products and abs, which numbers, arrays and the compiled kernel have."""


@dataclass(frozen=True, eq=False)
class ErrorTerm:
    """One error term of three gyros or of three accelerometers."""

    name: str  # its key in [imu] without the unit
    triad: str  # "gyro" or "accel"
    field: str  # its field of `TriadErrors`; gyros and accelerometers may share one
    # number of values: 1 for a noise common to the three axes, 3 for one per axis, 6 for a matrix with a zero diagonal
    # (xy, xz, yx, yz, zx, zy), 9 for a full matrix, row by row
    size: int
    units: Mapping[str, float]  # size of each unit in SI by its name in a key; the unit of scenarios is first
    si_unit: str  # its SI unit; "{rate}" and "{integral}" denote the units of a reading and of an increment
    label: str  # its name in the report, followed by the axes for 6 or 9 values
    meaning: str  # short description
    explanation: str  # description of its key in a scenario
    stage: str = ""  # the kernel's stage that applies it; "" if the kernel always applies it
    untold: str = ""  # its name in the list of errors that a filter neglects; "" if a filter models it
    calibrated: bool = False  # whether a calibration determines it and `sinssim.sensors.imu.compensation` removes it
    source: str = ""  # its source in the alignment budget
    # what each of its values multiplies in a mean reading: the one statement of its effect, which emulator,
    # compensation, filter, budgets, monitoring and calibration read; None for noise, pulses and range
    multiplies: Regressor | None = None
    # limits of one value in a scenario, for `pydantic.Field`; for size 1 at least 0 by default
    limits: Mapping[str, float] = dataclasses.field(default_factory=dict)
    sigma_limits: Mapping[str, float] = dataclasses.field(default_factory=lambda: {"ge": 0.0})  # limits of its 1σ
    default: float | None = None  # default of its key; None for the grade's value, or zero if there is none
    without: float = 0.0  # value of the field if nothing is given
    slots: int | None = None  # parameters of the kernel; by default one for each value of an axis

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

    def factors(self, warmth: Any, time: Any) -> tuple[Any, Any, Any, Any]:
        """Return the factors of 1, `sensed`, `along` and `force` in what it multiplies, if that is linear in these.
        `warmth`: temperature above that of the calibration, (...) K; `time`: time since the start, (...) s."""
        assert self.multiplies is not None
        constant = self.multiplies(0.0, 0.0, 0.0, warmth, time)
        units = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        sensitive, along, force = (self.multiplies(*unit, warmth, time) - constant for unit in units)
        return constant, sensitive, along, force

    @cached_property
    def slopes(self) -> tuple[float, float, float, float] | None:
        """Its `factors` at 1 K and 1 s; None if what it multiplies is not linear, or for a noise."""
        if self.multiplies is None:
            return None
        factors = self.factors(1.0, 1.0)
        for probe in ((-2.0, 3.0, 5.0), (7.0, -4.0, -3.0)):
            if self.multiplies(*probe, 1.0, 1.0) != np.dot(factors, (1.0, *probe)):
                return None
        return factors

    @cached_property
    def acts_on(self) -> Literal["axis", "response", "scale", "output"]:
        """Where it enters the reading y = (1 + scale) (x + response(x)) + output, with x along the sensitive axis.

        This follows from what it multiplies: the input along other axes turns the sensitive axis, a factor of the own
        input is a scale factor, any other dependence on the inputs bends the response; the rest is added to the output.
        """
        assert self.multiplies is not None
        if self.slopes is None:
            still, moving = (
                self.multiplies(sensitive, along, 2.0, 1.0, 1.0) for sensitive, along in ((0.0, 0.0), (3.0, -5.0))
            )
            return "output" if still == moving else "response"
        constant, sensitive, along, force = self.slopes
        if not (sensitive or along):
            return "output"
        return "response" if constant or force or (sensitive and along) else "scale" if sensitive else "axis"

    @property
    def of_temperature(self) -> bool:
        """Whether its effect depends on the temperature."""
        if self.multiplies is None:
            return False
        cold, warm = (self.multiplies(2.0, 3.0, 5.0, warmth, 1.0) for warmth in (0.0, 1.0))
        return bool(cold != warm)

    def inputs(
        self,
        x: Array,
        force: Array,
        warmth: ArrayLike = 0.0,
        time: ArrayLike = 0.0,
        sensed: Array | None = None,
        *,
        whole: bool = True,
    ) -> Any:
        """Return what its values multiply in mean readings: one factor for each value, (..., 3), or (..., 3, 3) for a
        matrix; zeros for a noise. They depend on mean rates or specific forces of the triad in the axes of the block,
        x, (..., 3), mean specific forces, (..., 3) m/s², the temperature above that of the calibration, (...) K, the
        time since the start, (...) s, and the inputs along the sensitive axes, (..., 3), by default x, to first
        order."""
        sensed, along, matrix = x if sensed is None else sensed, x, len(self.shape) == 2
        if matrix:
            sensed, along, force = sensed[..., None], x[..., None, :], force[..., None, :]
        warmth, time = (
            np.asarray(quantity)[(..., None, None) if matrix else (..., None)] for quantity in (warmth, time)
        )
        factors = 0.0 * sensed if self.multiplies is None else self.multiplies(sensed, along, force, warmth, time)
        return (
            factors
            if not whole
            else np.broadcast_to(factors, np.broadcast_shapes(np.shape(factors), sensed.shape, along.shape))
        )

    def effect(self, value: Array, *motion: Any, **options: Any) -> Array:
        """Return the effect of a value, in the shape of its field, on mean readings, broadcasting to (..., 3)."""
        parts = value * self.inputs(*motion, **options, whole=False)
        return np.asarray(parts.sum(axis=-1) if len(self.shape) == 2 else parts)
