"""Loads the class of an aiding sensor outside the package, and explains its failures."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from sinssim.errors import InputError, RunError
from sinssim.formatting import listed
from sinssim.sensors.aiding.base.sensor import AidingSensor
from sinssim.sensors.aiding.registry import KINDS
from sinssim.system.own_content.layout import Item
from sinssim.system.own_content.modules import explained, load_module


def sensor_class(item: Item) -> type[AidingSensor]:
    """Run the file of an aiding sensor outside the package and return its class.

    Args:
        item: the sensor.

    Returns:
        The class; what its methods raise is explained with the file.

    Raises:
        InputError: the file cannot be run, or has no class that can be used.
    """
    module = load_module(item)
    found = [
        one
        for one in vars(module).values()
        if isinstance(one, type) and issubclass(one, AidingSensor) and one.__module__ == module.__name__
    ]
    wrong = f"the {item.words} cannot be used: {item.file}"
    if len(found) != 1:
        names = listed([one.__name__ for one in found]) if found else "there is none"
        raise InputError(f"{wrong} must have one class that derives from AidingSensor; {names}.")
    sensor = found[0]
    if not (sensor.__doc__ or "").strip():
        raise InputError(f"{wrong}: {sensor.__name__} needs a docstring, whose first line describes it.")
    if sensor.read is AidingSensor.read and sensor.from_imu is AidingSensor.from_imu:
        raise InputError(
            f"{wrong}: {sensor.__name__} needs a method read(self, vehicle) that returns its measurements."
        )
    if not sensor.table:
        sensor.table = item.name
        own: Any = sensor
        own.read, own.states = _read(item, sensor.read), _read(item, sensor.states)
    _register_kind(item, list(vars(module).values()), module.__name__)
    return sensor


def _register_kind(item: Item, found: list[Any], module: str) -> None:
    """Register the kind of measurement that the file of a sensor brings, if it does, under the file's name."""
    # known by its methods: the base class belongs to a later stage
    kinds = [
        one for one in found
        if isinstance(one, type) and one.__module__ == module and hasattr(one, "compare") and hasattr(one, "observe")
    ]  # fmt: skip
    wrong = f"the {item.words} cannot be used: {item.file}"
    if len(kinds) > 1:
        raise InputError(f"{wrong} may contain one kind of measurement, not {listed([k.__name__ for k in kinds])}.")
    if not kinds:
        KINDS.drop(item.name)
        return
    kind: Any = kinds[0]
    if item.name in KINDS.shipped:
        raise InputError(f"{wrong}: {item.name} is the name of a kind of measurement of sinssim; rename the file.")
    missing = [name for name in ("columns", "axes", "unit") if not hasattr(kind, name)]
    if missing:
        raise InputError(f"{wrong}: {kind.__name__} needs {listed(missing)}, see docs/extending/measurement-kind.md.")
    if KINDS.get(item.name) is not kind:
        kind.compare = _compared(item, kind.compare)
        KINDS.add(item.name, kind)


def _compared(item: Item, method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method `compare` whose failures name the file, and whose results are checked."""

    @functools.wraps(method)
    def compare(kind: Any, at: Any, value: Any) -> Any:
        residual, h = method(kind, at, value)
        count, size = len(value), at.model.size
        for name, given, shape in (
            ("residuals", residual, (count, kind.errors)), ("H", h, (count, kind.errors, size)),
        ):  # fmt: skip
            if np.shape(given) != shape:
                raise ValueError(f"{name} have the shape {np.shape(given)}; {shape} is needed")
            if not np.isfinite(given).all():
                raise ValueError(f"{name} are not finite")
        return residual, h

    return explained(item, compare)  # no RunError, which would be taken for a divergence


def _read(item: Item, method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method whose failures name the file, and whose readings are checked."""

    @functools.wraps(method)
    def call(*arguments: Any, **named: Any) -> Any:
        result = list(method(*arguments, **named))
        for one in result:
            _check(getattr(one, "measurements", None))
        return result

    return explained(item, call, RunError)


def _check(readings: Any) -> None:
    """Raise for readings that are not one row of finite numbers for each instant."""
    if readings is None:
        return
    value, time = np.asarray(readings.value), np.asarray(readings.time)
    if value.ndim != 2 or len(value) != len(time):
        raise ValueError(f"the measurements have the shape {value.shape}; ({len(time)}, components) is needed")
    bad = ~np.isfinite(value).all(axis=1)
    if bad.any():
        raise ValueError(
            f"{int(bad.sum())} of {len(bad)} measurements are not finite, the first at t = {time[bad][0]:g} s"
        )
