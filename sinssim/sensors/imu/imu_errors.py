"""Errors of one sensor block in one run, `ImuErrors`, which `imu_section.draw` draws; validation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Literal, get_args

import numpy as np

from sinssim.arguments import check_kind, numbers
from sinssim.data import Array, short_repr
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import FIELDS, SLOTS, of_triad
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.laser_gyro import NullShift

FaultKind = Literal["dropout", "freeze", "spike", "bias-step", "saturation", "jitter"]
"""Kinds of faults."""


@dataclass(frozen=True)
class WarmUp:
    """Temperature of the block above that of its calibration: Θ∞ + (Θ₀ − Θ∞) exp(−t/τ), t from the first sample."""

    start: float = 0.0  # Θ₀, K
    steady: float = 0.0  # Θ∞, K
    time_constant: float = 600.0  # τ, s

    def temperature(self, t: Array) -> Array:
        """Return Θ: temperature above that of the calibration, (...) K. `t`: time since the first sample, (...) s."""
        return np.asarray(self.steady + (self.start - self.steady) * np.exp(-t / self.time_constant))


@dataclass(frozen=True)
class Fault:
    """A fault of the block."""

    kind: FaultKind  # kind of the fault
    start: float  # its beginning, or the time of a spike, s
    end: float  # its end, s
    # one value for each of the six channels, gyros first, (6,): addition to the rate or specific force by a step, rad/s
    # or m/s²; addition to the increment by a spike, rad or m/s; range during a saturation, 0 for no change, rad/s or
    # m/s²; 1 for a channel that drops out or freezes. For jitter, the first value is the 1σ of the time stamps, s.
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
    """Return the errors of three gyros or three accelerometers in one run from error terms with their means over all
    runs, or the value of a noise, and the 1σ about the mean, SI; those of other terms are zero. Every axis of every
    term has its own random numbers."""
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


_MOST_TILT = 0.2  # rad
_OF_ACCELEROMETERS = {term.field for term in of_triad("accel")}


def check_errors(errors: ImuErrors) -> None:
    """Raise for invalid errors of a sensor block."""
    if not isinstance(errors, ImuErrors):
        raise InputError(
            f"{shortened(repr(errors))} does not describe a sensor block: give an Imu, for example "
            "Imu(grade='tactical'), or ImuErrors with the errors themselves."
        )
    for triad, name in ((errors.gyro, "gyro"), (errors.accel, "accelerometer")):
        check_kind(f"errors of the {name}s", triad, TriadErrors)
        _check_triad(triad, name)
    _check("arms", errors.arms, (3, 3))
    _check("delay", errors.delay, ())
    warm = errors.warm_up
    check_kind("warm_up", warm, WarmUp)
    _check("warm_up's start and steady temperature", (warm.start, warm.steady), (2,))
    _check("warm_up's time constant", warm.time_constant, ())
    if not warm.time_constant > 0.0:
        raise InputError(f"the warm-up's time constant, {warm.time_constant:g} s, must be positive and finite.")
    check_faults(errors.faults)


def check_sigmas(sigma: ImuErrors) -> None:
    """Raise for invalid standard deviations of a sensor block's errors."""
    check_kind("sigma", sigma, ImuErrors, "ImuErrors of standard deviations, as expected_errors(imu).sigma")
    check_errors(sigma)
    for triad, name in ((sigma.gyro, "gyro"), (sigma.accel, "accelerometer")):
        for slot in SLOTS:
            value = np.asarray(getattr(triad, slot))
            if np.any(value < 0.0):
                raise InputError(f"the 1σ of {name} {slot} = {value.tolist()} (SI) must be at least 0.")


def _check_triad(triad: TriadErrors, name: str) -> None:
    for slot in SLOTS:
        shape = FIELDS[slot].shape
        value = getattr(triad, slot)
        _check(f"{name} {slot}", value, shape)
        if slot == "correlation_time" and not value > 0.0:
            raise InputError(f"{name} correlation_time = {value} s must be greater than 0.")
        if name == "accelerometer" and slot not in _OF_ACCELEROMETERS and np.any(value):
            raise InputError(
                f"{name} {slot} = {np.asarray(value).tolist()} (SI) must be zero; it is an error of gyros."
            )
        if shape == () and not value >= 0.0:
            raise InputError(f"{name} {slot} = {value} (SI) must be at least 0.")
    far = np.abs(triad.misalignment).max()
    if not far <= _MOST_TILT or np.any(np.diagonal(triad.misalignment)):
        raise InputError(
            f"{name} misalignment = {triad.misalignment.tolist()} rad must be a matrix of small angles with a diagonal "
            f"of zeros; their magnitude can be at most {_MOST_TILT:g} rad."
        )
    if not np.all(np.asarray(triad.scale) > -1.0):
        raise InputError(
            f"{name} scale = {np.asarray(triad.scale).tolist()} must be greater than −1 (a reading of zero)."
        )
    if np.any(np.diagonal(triad.cross_axis)):
        raise InputError(
            f"{name} cross_axis = {np.asarray(triad.cross_axis).tolist()} (SI) must have a diagonal of zeros; an error "
            "that depends on the square of a sensor's own input is its quadratic term."
        )


def _check(name: str, value: Any, shape: tuple[int, ...]) -> None:
    if shape == () and type(value) is float and isfinite(value):  # by far the most frequent
        return
    with suppress(InputError):
        array = numbers(name, value)
        if array.shape == shape and np.isfinite(array).all():
            return
    wanted = "one finite number" if shape == () else f"finite numbers of shape {shape}"
    shown = value.tolist() if isinstance(value, np.ndarray) else value
    raise InputError(f"{name} = {shortened(str(shown), 200)} (SI) must be {wanted}.")


def check_faults(faults: Sequence[Fault]) -> None:
    """Raise for invalid faults."""
    for number, fault in enumerate(faults, start=1):
        name = f"imu.faults.{number}"
        if fault.kind not in get_args(FaultKind):
            error = unknown_name("fault", fault.kind, get_args(FaultKind))
            raise InputError(f"{name}: {error}") from error
        if fault.kind == "spike":
            _check(f"{name}: the time of the spike", fault.start, ())
        elif not -np.inf < fault.start < fault.end:
            raise InputError(
                f"{name}: the interval of a {fault.kind}, from {fault.start:g} s to {fault.end:g} s, must end after it "
                "begins."
            )
        _check(f"{name}: amount of the {fault.kind}", fault.amount, (6,))
        if fault.kind == "saturation" and np.any(np.asarray(fault.amount) < 0.0):
            raise InputError(f"{name}: ranges of {np.asarray(fault.amount).tolist()} (SI) must be at least 0.")
        if fault.kind == "jitter" and not fault.amount[0] > 0.0:
            raise InputError(f"{name}: a 1σ of the time stamps of {fault.amount[0]:g} s must be positive.")
