"""The aiding sensors and their kinds of measurement: files under `sensors/aiding`, or files outside the package.

A file's name is that of the sensor's table in [aiding]; sensors that share a file of the package have their `table`.
See `docs/extending/aiding-sensor.md`.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.errors import InputError, RunError
from sinssim.sensors import aiding
from sinssim.sensors.aiding_sensor import AidingSensor
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind
from sinssim.system.extensions import Item, class_in, classes_in, explained, load_module
from sinssim.system.registries import Registry, on_change, registered

_ORDER = (
    "gnss", "baro", "magnetometer", "airspeed", "odometer", "zero_velocity", "zero_rate", "attitude", "star_tracker",
    "master", "dual_antenna", "land_vehicle",
)  # fmt: skip
"""The first sensors in lists, whose readings of one instant the filter takes in this order; others follow by name."""


CLASSES: dict[str, type[AidingSensor]] = {}
"""The package's sensors by table."""
BROKEN: dict[str, str] = {}
"""Reasons why files of the package cannot be used, by name; the other sensors remain usable."""


def _load() -> dict[str, MeasurementKind]:
    """Load the package's sensors, and return their kinds of measurement by name."""
    loaded: dict[str, type[AidingSensor]] = {}
    for path in (path for folder in aiding.__path__ for path in sorted(Path(folder).glob("[!_]*.py"))):
        wrong = f"{path} cannot be used"
        try:
            module = importlib.import_module(f"{aiding.__name__}.{path.stem}")
            tables = [sensor for sensor in classes_in(module, AidingSensor) if "table" in vars(sensor)]
            for sensor in tables or [class_in(module, AidingSensor, wrong)]:
                sensor.table = sensor.table or path.stem
                loaded[sensor.table] = _checked(sensor, wrong)
        except InputError as error:
            BROKEN[path.stem] = str(error)
        except Exception as error:  # any error of an invalid file
            BROKEN[path.stem] = f"{wrong}: {type(error).__name__}: {error}"
    CLASSES.update({name: loaded.pop(name) for name in _ORDER if name in loaded} | loaded)
    return {kind.name: kind for sensor in CLASSES.values() for kind in sensor.kinds}


def _checked(sensor: type[AidingSensor], wrong: str) -> type[AidingSensor]:
    """Return a sensor; raise an InputError that begins with `wrong` if it cannot be used."""
    if not (sensor.__doc__ or "").strip():
        raise InputError(f"{wrong}: {sensor.__name__} needs a docstring, whose first line describes it.")
    if sensor.read is AidingSensor.read and sensor.from_imu is AidingSensor.from_imu:
        raise InputError(
            f"{wrong}: {sensor.__name__} needs a method read(self, vehicle) that returns its measurements."
        )
    return sensor


KINDS: Registry[MeasurementKind] = Registry("kinds", "kind of measurement", _load())
"""The kinds of measurement by `Measurements.kind`."""

SENSORS: Registry[str] = Registry("aiding", "aiding sensor", {name: name for name in (*CLASSES, *BROKEN)})
"""The aiding sensors by table."""

_BROUGHT: dict[str, str] = {}
"""Sensors outside the package by the name of a kind of measurement that they bring."""


def _drop_kinds(of: Callable[[str], bool] = lambda table: registered("aiding", table) is None) -> None:
    """Drop the kinds of some sensors outside the package, by default of those that are no longer registered."""
    for name in [name for name, table in _BROUGHT.items() if of(table)]:
        KINDS.drop(name)
        del _BROUGHT[name]


on_change.append(_drop_kinds)


def measurement_kind(name: str) -> MeasurementKind:
    """Return a kind of measurement by its name, `Measurements.kind`."""
    return KINDS.check(name)


def own_errors() -> set[str]:
    """Return the names of errors that only sensors of some kind have: "wind", "mounting"."""
    return {error for kind in KINDS.values() for error in kind.own_errors}


def sensor_class(item: Item) -> type[AidingSensor]:
    """Run the file of an aiding sensor outside the package, register its kinds of measurement, and return its class,
    whose failures name the file."""
    wrong = f"the {item.words} cannot be used: {item.file}"
    sensor: type[AidingSensor] = _checked(class_in(load_module(item), AidingSensor, wrong), wrong)
    if not sensor.table:
        sensor.table = item.name
        user_class: Any = sensor
        user_class.read, user_class.states = _read(item, sensor.read), _read(item, sensor.states)
        sensor.kinds = tuple(replace(kind, compare=_compared(item, kind)) for kind in sensor.kinds)
    _drop_kinds(lambda table: table == item.name)
    for kind in sensor.kinds:
        if kind.name in KINDS:
            by = _BROUGHT.get(kind.name, "sinssim")
            raise InputError(f"{wrong}: {kind.name} is the name of a kind of measurement of {by}; rename its own.")
        KINDS.add(kind.name, kind)
        _BROUGHT[kind.name] = item.name
    return sensor


def _compared(item: Item, kind: MeasurementKind) -> Callable[[Comparison, Any], Any]:
    """Return a function `compare` whose failures name the file, and whose results are checked."""

    @functools.wraps(kind.compare)
    def compare(at: Comparison, value: Any) -> Any:
        residual, h = kind.compare(at, value)
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
        for entry in result:
            _check(getattr(entry, "measurements", None))
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
