"""The errors of a scenario's aiding sensors, as sources of the budget."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.analyses.error_budget.error_sources import Source
from sinssim.analyses.error_budget.source_shares import (
    SensorConstant,
    SensorGiven,
    SensorNoise,
    SensorProcess,
    SensorSource,
)
from sinssim.data import Array, Measurements
from sinssim.errors import InputError
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.aiding_sensor import AidingSensor, Vehicle
from sinssim.units import ARCMIN, DEG_H, PPM

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

_WRITTEN = {"m": ("m", 1.0), "mps": ("m/s", 1.0), "rad": ("arcmin", ARCMIN), "radps": ("deg/h", DEG_H)}
"""Units as people write them, by the unit of a residual."""

_OF_TIME = (" delay", " time offset")
"""Endings of the states of an error of time, which the budget does not model."""


@dataclass(frozen=True)
class AidingSources:
    """The aiding sensors of a scenario."""

    measurements: list[Measurements]
    """Readings without random errors, with the true 1σ of their noise; those of sensors at rest are zero."""
    sources: list[SensorSource]  # their errors
    tables: tuple[str, ...]  # the tables of the sensors
    blocks: dict[str, Any]  # 1σ of each random error with states, by block of an error model


def aiding_sources(scenario: Scenario, trajectory: Trajectory) -> AidingSources:
    """Return the errors of a scenario's aiding sensors; raise `InputError` for a sensor that has no budget."""
    assert scenario.aiding is not None
    vehicle = Vehicle(trajectory, scenario.seed)
    sources = AidingSources([], [], tuple(scenario.aiding.sensors()), {})
    for table, sensor in scenario.aiding.sensors().items():
        if sensor.no_budget:
            raise InputError(f"[aiding.{table}] has no budget: {sensor.no_budget}. Remove it, or use an ensemble.")
        late = next(
            (state.block for state in sensor.states() if state.block.endswith(_OF_TIME) and any(state.sigma)), ""
        )
        if late:
            raise InputError(f"[aiding.{table}] has no budget: the state {late!r}. Remove its key, or use an ensemble.")
        noisy = [readings.measurements for readings in sensor.read(vehicle)]
        exact = noisy if sensor.assumed else _exact(table, _without_random(sensor), trajectory, scenario.seed)
        kinds = {}
        for with_noise, m in zip(noisy, exact, strict=True):
            value = np.zeros_like(m.value) if sensor.assumed else m.value
            sources.measurements.append(replace(m, value=value, sigma=with_noise.sigma))
            kinds[m.label] = m.kind
            sources.sources.extend(_noises(table, m, with_noise.sigma))
            given = Source(_name(f"{m.label} given"), "errors equal in every run", table, "given", float("nan"), "")
            sources.sources.append(SensorGiven(given, m.label))
        for error in _states(table, _random_alone(sensor), kinds):
            sources.sources.append(error)
            sources.blocks[error.block] = error.sigma + sources.blocks.get(error.block, 0.0)
    return sources


def _exact(table: str, sensor: AidingSensor, trajectory: Trajectory, seed: int) -> list[Measurements]:
    """Return the readings of a sensor without random errors; they must be the same for every seed."""
    first, second = (
        [readings.measurements for readings in sensor.read(Vehicle(trajectory, s))] for s in (seed, seed + 1)
    )
    for a, b in zip(first, second, strict=True):
        same = np.array_equal(a.value, b.value) and np.array_equal(a.lever_arm, b.lever_arm)
        if not same:
            raise InputError(
                f"[aiding.{table}] has no budget: {a.label} has random errors in addition to those of the keys with "
                f"sigma in their name."
            )
    return first


def _name(text: str) -> str:
    return text.replace("-", "_").replace(" ", "_")


_AXES = {"n": "north", "e": "east", "d": "down"}


def _groups(sigma: Array, axes: Sequence[str]) -> Iterator[tuple[Array, str, str]]:
    """Yield the components of each size, zero for the others, with an ending of their name and of their label."""
    sizes = [size for size in dict.fromkeys(sigma.tolist()) if size]
    for size in sizes:
        equal = [axis for axis, value in zip(axes, sigma.tolist(), strict=True) if value == size]
        words = " and ".join(_AXES.get(axis, axis) for axis in equal)
        ending = ("", "") if len(sizes) == 1 else (f"_{''.join(equal)}", f", {words}")
        yield np.where(sigma == size, size, 0.0), *ending


def _noises(table: str, m: Measurements, sigma: Array) -> Iterator[SensorNoise]:
    kind = measurement_kind(m.kind)
    unit, size = _WRITTEN.get(kind.unit, (kind.unit, 1.0))
    whole = np.array(sigma[0] if len(sigma) else np.zeros(kind.errors), dtype=np.float64)
    what = m.label.removeprefix(f"{table}-").replace("-", " ")
    label = "noise" if what == table.replace("_", " ") else f"{what} noise"
    for part, ending, words in _groups(whole, kind.axes):
        value = float(f"{part.max() / size:.12g}")
        source = Source(_name(f"{m.label} noise") + ending, label + words, table, "random", value, unit)
        yield SensorNoise(source, m.label, part)


def _states(table: str, sensor: AidingSensor, kinds: Mapping[str, str]) -> Iterator[SensorConstant | SensorProcess]:
    for state in sensor.states():
        if not any(state.sigma) or not state.drawn:
            continue
        label = next((label for label in kinds if state.block.startswith(f"{label} ")), "")
        what = state.block.removeprefix(f"{label} ")
        kind = kinds.get(label)
        unit, size = ("m", 1.0)
        if what == "scale":
            unit, size = "ppm", PPM
        elif kind is not None:
            known = measurement_kind(kind)
            unit = known.own_errors[what][1] if what in known.own_errors else known.unit
            unit, size = _WRITTEN.get(unit, (unit, 1.0))
        sigma = np.array(state.sigma, dtype=np.float64)
        words = state.block.removeprefix(f"{table}-").removeprefix(f"{table} ").replace("-", " ")
        constant = not np.isfinite(state.correlation_time)
        axes = ["all"] * len(sigma) if constant or kind is None else measurement_kind(kind).axes
        groups = [(sigma, "", "")] if constant else _groups(sigma, axes)
        for part, ending, also in groups:
            value = float(f"{part.max() / size:.12g}")
            source = Source(_name(state.block) + ending, words + also, table, "random", value, unit)
            if constant:
                yield SensorConstant(source, state.block, part)
            else:
                yield SensorProcess(source, state.block, part, state.correlation_time)


def _zero(value: Any) -> Any:
    return tuple(0.0 for _ in value) if isinstance(value, tuple) else 0.0


def _without_random(sensor: AidingSensor) -> AidingSensor:
    """Return the sensor with only its given errors."""
    return sensor.model_copy(
        update={name: _zero(value) for name, value in sensor if "sigma" in name and value is not None}
    )


def _random_alone(sensor: AidingSensor) -> AidingSensor:
    """Return the sensor without the given errors that have a random part of the same name."""
    names = set(type(sensor).model_fields)
    given = {name.replace("_sigma", "") for name in names if "_sigma" in name} & names
    return sensor.model_copy(update={name: _zero(getattr(sensor, name) or 0.0) for name in given})
