"""Validates `ImuErrors` made by hand, which do not come from a scenario."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, get_args

import numpy as np

from sinssim.arguments import check_kind, numbers
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.sensors.imu.errors import Fault, FaultKind, ImuErrors, WarmUp
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.terms import FIELDS, SLOTS, of_triad

_MOST_TILT = 0.2  # rad
_OF_ACCELEROMETERS = {term.field for term in of_triad("accel")}


def check_errors(errors: ImuErrors) -> None:
    """Raise for invalid errors of a sensor block.

    Raises:
        InputError: the object is not `ImuErrors`, a number is not finite, an array has the wrong shape, a noise is
            negative, a time is not positive, the axes lie far from the block's, accelerometers have an error of gyros,
            or a fault is invalid; the message gives its name and the allowed values.
    """
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
    """Raise for invalid standard deviations of a sensor block's errors.

    Args:
        sigma: standard deviations of the block's errors.

    Raises:
        InputError: as for `check_errors`, or a standard deviation is negative.
    """
    check_kind("sigma", sigma, ImuErrors, "ImuErrors of standard deviations, as expected_errors(imu).sigma")
    check_errors(sigma)
    for triad, name in ((sigma.gyro, "gyro"), (sigma.accel, "accelerometer")):
        for field in SLOTS:
            value = np.asarray(getattr(triad, field))
            if np.any(value < 0.0):
                raise InputError(f"the 1σ of {name} {field} = {value.tolist()} (SI) must be at least 0.")


def _check_triad(triad: TriadErrors, name: str) -> None:
    for field in SLOTS:
        shape = FIELDS[field].shape
        value = getattr(triad, field)
        _check(f"{name} {field}", value, shape)
        if field == "correlation_time" and not value > 0.0:
            raise InputError(f"{name} correlation_time = {value} s must be greater than 0.")
        if name == "accelerometer" and field not in _OF_ACCELEROMETERS and np.any(value):
            raise InputError(
                f"{name} {field} = {np.asarray(value).tolist()} (SI) must be zero; it is an error of gyros."
            )
        if shape == () and not value >= 0.0:
            raise InputError(f"{name} {field} = {value} (SI) must be at least 0.")
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
    with suppress(InputError):
        array = numbers(name, value)
        if array.shape == shape and np.all(np.isfinite(array)):
            return
    wanted = "one finite number" if shape == () else f"finite numbers of shape {shape}"
    shown = value.tolist() if isinstance(value, np.ndarray) else value
    raise InputError(f"{name} = {shortened(str(shown), 200)} (SI) must be {wanted}.")


def check_faults(faults: Sequence[Fault]) -> None:
    """Raise for invalid faults.

    Raises:
        InputError: a kind is unknown, a fault ends before it begins, amounts are not six finite numbers, or jitter has
            no positive 1σ.
    """
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
