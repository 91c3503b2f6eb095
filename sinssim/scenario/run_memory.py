"""Estimates the memory of a run from its plan, and refuses a run that does not fit into this machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from sinssim.errors import InputError
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import filter_model
from sinssim.scenario.planned_limits import expected_duration, sample_bytes
from sinssim.sensors.measurement_kind import CORE
from sinssim.system.process import machine_memory

ROWS = 2000
"""Approximate number of rows of the filter that are kept without smoothing. NEES uses 600. The variance of the inertial
noise, from 1000 pairs of three axes, is then accurate to 3 %."""

_PROGRAM, _RECORDER = 0.31e9, 0.12e9
"""Memory of the program with its libraries, and of the libraries and buffers that write a run directory, bytes."""

_BEFORE, _BEFORE_RECORDED = 320.0, 560.0
"""What every sample takes before the filter runs, bytes, with one algorithm: true and measured increments, true and
navigated states, errors; the same with the copies that are being written."""

_SAMPLE = 64.0
"""What every sample takes while the filter runs, bytes: its instant and its increments."""

_EPOCH, _STATE, _PARAMETER = 100.0, 8.0, 16.0
"""What every epoch takes, bytes: the aided solution; every state's 1σ; and the estimated and the true value of every
state that is no error of navigation."""

_READING = 104.0
"""What a reading of three components takes, bytes: reading, times, verdict, innovation and the lower triangle
of its covariance."""

_ROW, _SMOOTHED_ROW = 6.0, 16.0
"""How many matrices of the number of states squared every kept row takes; the same with smoothing."""

_STRETCH_S, _STRETCH_MATRICES = 64.0, 8.0
"""Longest stretch that is linearised at once, s, and how many such matrices each of its epochs takes meanwhile."""


class Memory(NamedTuple):
    """Memory that a run needs, bytes."""

    program: float  # for the program
    samples: float  # for true motion, inertial sensors and solutions, before the filter starts
    increments: float  # for the part of it that the filter needs
    filter: float  # for the filter's states at its epochs, and the matrices that it keeps
    readings: float  # for the aiding sensors
    stretch: float  # for what is linearised at once

    @property
    def total(self) -> float:
        """The peak, before the filter starts or while it runs, bytes."""
        return self.program + max(self.samples, self.increments + self.filter + self.readings + self.stretch)


def needed_memory(scenario: Scenario, *, recorded: bool = True) -> Memory:
    """Estimate the peak memory of a run, which is larger if it is written to a run directory."""
    lasts = expected_duration(scenario)
    return _memory(scenario, filter_model(scenario, lasts).size, lasts, recorded)


def _memory(
    scenario: Scenario, n: int, lasts: float, recorded: bool, more: Mapping[str, float] | None = None
) -> Memory:
    """Estimate the memory of a run with n states that lasts so many seconds."""
    section = scenario.filter
    assert section is not None
    matrix = 8.0 * n**2
    grid = min(section.rate_hz, scenario.imu.rate_hz)
    sensors = {name: sensor.rate_hz for name, sensor in scenario.aiding or () if sensor is not None} | dict(more or {})
    beside = sum(rate for rate in sensors.values() if not _divides(rate, grid))
    often = max((1.0, *sensors.values()))
    rows = (often + sum(r for r in sensors.values() if not _divides(r, often))) * lasts
    matrices = _SMOOTHED_ROW * rows if section.smooth else _ROW * min(rows, ROWS)
    epochs, samples = (grid + beside) * lasts, scenario.imu.rate_hz * lasts
    ways = 2.0 if section.backward else 1.0  # the backward run has increments, readings and epochs of its own
    matrices += min(rows, ROWS) * (ways - 1.0)
    readings = sum(rate * (2.0 if name in ("gnss", "master") else 1.0) for name, rate in sensors.items()) * lasts
    return Memory(
        _PROGRAM + _RECORDER * recorded,
        sample_bytes(scenario, _BEFORE_RECORDED if recorded else _BEFORE) * samples,
        _SAMPLE * samples * ways,
        epochs * (_EPOCH + _STATE * n + _PARAMETER * (n - CORE)) * ways + matrix * matrices,
        readings * _READING * ways,
        matrix * _STRETCH_MATRICES * (grid + beside) * min(_STRETCH_S, lasts),
    )


def _divides(rate: float, grid: float) -> bool:
    """Return whether all instants of a rate are instants of another."""
    return abs(grid / rate - round(grid / rate)) < 1e-9


def check_memory(scenario: Scenario, *, recorded: bool = True, of_log: Mapping[str, float] | None = None) -> None:
    """Raise for a run whose filter needs more memory than this machine has.

    `recorded` says whether the run is written to a run directory, and `of_log` has the readings per second of recorded
    sensors by name.
    """
    section = scenario.filter
    if section is None:
        return
    memory, lasts = machine_memory(), expected_duration(scenario)
    n = filter_model(scenario, lasts).size
    needed = _memory(scenario, n, lasts, recorded, of_log)
    if needed.total <= memory:
        return
    fits, longer = 0.0, lasts
    while longer - fits > 1e-3 * lasts:
        half = 0.5 * (fits + longer)
        fits, longer = (half, longer) if _memory(scenario, n, half, recorded, of_log).total <= memory else (fits, half)
    rates = {f"aiding.{name}.rate_hz": sensor.rate_hz for name, sensor in scenario.aiding or () if sensor is not None}
    fastest = max(rates, key=lambda key: rates[key], default="filter.rate_hz")
    if needed.program + needed.samples == needed.total or needed.increments >= max(needed.filter, needed.readings):
        key, value = "imu.rate_hz", scenario.imu.rate_hz
    elif needed.readings > needed.filter or (section.smooth and rates[fastest] > 1.0):
        key, value = fastest, rates[fastest]  # a row is kept at every reading
    else:
        key, value = "filter.rate_hz", min(section.rate_hz, scenario.imu.rate_hz)
    smooth = "Without filter.smooth it needs less: smoothing keeps every row of the filter. " if section.smooth else ""
    raise InputError(
        f"{key} = {value:g}: a run of about {lasts:.6g} s with a filter of {n} states "
        f"needs {needed.total / 1e9:.3g} GB of memory; this machine has {memory / 1e9:.3g} GB. {smooth}"
        f"A run of {fits:.3g} s would fit; lower rates need less, too."
    )
