"""Errors of one inertial sensor block in one run: `ImuErrors`, which `sinssim.sensors.imu.imu.draw` draws."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from sinssim.data import Array
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.laser_gyro.gas_flow import NullShift
from sinssim.system.short_repr import short_repr

FaultKind = Literal["dropout", "freeze", "spike", "bias-step", "saturation", "jitter"]
"""Kinds of faults."""


@dataclass(frozen=True)
class WarmUp:
    """Temperature of the block above that of its calibration: Θ∞ + (Θ₀ − Θ∞) exp(−t/τ), t from the first sample.

    Attributes:
        start: Θ₀, K.
        steady: Θ∞, K.
        time_constant: τ, s.
    """

    start: float = 0.0
    steady: float = 0.0
    time_constant: float = 600.0

    def temperature(self, t: Array) -> Array:
        """Return Θ.

        Args:
            t: time since the first sample, (...) s.

        Returns:
            Temperature above that of the calibration, (...) K.
        """
        return np.asarray(self.steady + (self.start - self.steady) * np.exp(-t / self.time_constant))


@dataclass(frozen=True)
class Fault:
    """A fault of the block.

    Attributes:
        kind: kind of the fault.
        start: its beginning, or the time of a spike, s.
        end: its end, s.
        amount: one value for each of the six channels, gyros first, (6,): addition to the rate or specific force by a
            step, rad/s or m/s²; addition to the increment by a spike, rad or m/s; range during a saturation, 0 for no
            change, rad/s or m/s²; 1 for a channel that drops out or freezes. For jitter, the first value is the 1σ of
            the time stamps, s.
    """

    kind: FaultKind
    start: float
    end: float
    amount: Array


@short_repr
@dataclass(frozen=True)
class ImuErrors:
    """The errors of one sensor block in one run.

    Attributes:
        gyro: the three gyros.
        accel: the three accelerometers.
        arms: places of the three accelerometers in the block, (3, 3) m, one row each.
        delay: lag of the accelerometers' outputs behind the gyros', s: the output for t is f(t − delay).
        warm_up: the temperature of the block.
        faults: the faults.
        null_shift: null shift of laser gyros as a function of temperature; None for no null shift.
    """

    gyro: TriadErrors = field(default_factory=TriadErrors)
    accel: TriadErrors = field(default_factory=TriadErrors)
    arms: Array = field(default_factory=lambda: np.zeros((3, 3)))
    delay: float = 0.0
    warm_up: WarmUp = field(default_factory=WarmUp)
    faults: tuple[Fault, ...] = ()
    null_shift: NullShift | None = None


def draw_triad(terms: Iterable[tuple[ErrorTerm, Array, Array]], seed: int) -> TriadErrors:
    """Return the errors of three gyros or three accelerometers in one run.

    Args:
        terms: error terms with their means over all runs, or the value of a noise, and the 1σ about the mean, SI.
        seed: the run's seed. Every axis of every term has its own random numbers.

    Returns:
        The errors; those of other terms are zero.

    Raises:
        InputError: the seed cannot be used.
    """
    from sinssim.statistics.random_numbers import key, pairs

    key(seed)  # refuses an invalid seed
    values: dict[str, Any] = {}
    for term, fixed, sigma in terms:
        if np.any(sigma):
            which = ("gyro", "accel").index(term.triad)
            random = np.array([pairs(seed, term.field, axis, 1)[which, 0] for axis in range(term.size)])
            value = fixed + sigma * term.shaped(random)
        else:
            value = np.zeros_like(sigma) + fixed
        values[term.field] = value if term.drawn else float(value)
    return TriadErrors(**values)
