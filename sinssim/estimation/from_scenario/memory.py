"""Estimates the memory of a run from its plan, and refuses a run that does not fit into this machine."""

from __future__ import annotations

from typing import NamedTuple

from sinssim.errors import InputError
from sinssim.estimation.dynamics import CORE
from sinssim.estimation.from_scenario.filter_model import filter_model
from sinssim.scenario import Scenario
from sinssim.scenario.duration import expected_duration, sample_bytes
from sinssim.system.memory import machine_memory

ROWS = 2000
"""Approximate number of rows of the filter that are kept without smoothing. NEES uses 600. The variance of the inertial
noise, from 1000 pairs of three axes, is then accurate to 3 %."""

_PROGRAM = 0.41e9
"""Memory of the program and its libraries, bytes, measured on recorded runs of 1 h and 3 h at 10 Hz."""

_EPOCH, _STATE, _PARAMETER = 500.0, 16.0, 24.0
"""What every epoch takes while a run is recorded, bytes: the aided solution and its error; every state's 1σ; and what
is estimated, true and wrong of every state that is no error of navigation. All of it is there twice while it is
written; without a run directory it is about half."""

_READING, _ARRAYS = 24.0, 8.0
"""What every reading takes, bytes: times and verdicts; and how many doubles for each of its components: the sensor's,
the filter's and the sorted value and σ, the innovation and its covariance."""

_ROW, _SMOOTHED_ROW = 6.0, 16.0
"""How many matrices of the number of states squared every kept row takes; the same with smoothing."""

_STRETCH_S, _STRETCH_MATRICES = 64.0, 8.0
"""Longest stretch that is linearised at once, s, and how many such matrices each of its epochs takes meanwhile."""


class Memory(NamedTuple):
    """Memory that a run needs, bytes.

    Attributes:
        samples: for the program, the inertial sensors and the solutions.
        filter: for the filter's states at its epochs, and the matrices that it keeps.
        readings: for the aiding sensors.
        stretch: for what is linearised at once.
    """

    samples: float
    filter: float
    readings: float
    stretch: float

    @property
    def total(self) -> float:
        """The sum, bytes."""
        return sum(self)


def needed_memory(scenario: Scenario) -> Memory:
    """Estimate the peak memory of a run.

    Args:
        scenario: with a [filter] section.

    Returns:
        The estimate.

    Raises:
        InputError: the aircraft's description is not right.
    """
    section = scenario.filter
    assert section is not None
    lasts = expected_duration(scenario)
    n = filter_model(scenario, lasts).size
    matrix = 8.0 * n**2
    grid = min(section.rate_hz, scenario.imu.rate_hz)
    sensors = {name: sensor.rate_hz for name, sensor in scenario.aiding or () if sensor is not None}
    beside = sum(rate for rate in sensors.values() if not _divides(rate, grid))
    often = max(1.0, *sensors.values())
    rows = (often + sum(r for r in sensors.values() if not _divides(r, often))) * lasts
    kept = _SMOOTHED_ROW * rows if section.smooth else _ROW * min(rows, ROWS)
    stretch = _STRETCH_MATRICES * (grid + beside) * min(_STRETCH_S, lasts)
    epochs = (grid + beside) * lasts
    readings = sum(rate * (2.0 if name in ("gnss", "master") else 1.0) for name, rate in sensors.items()) * lasts
    return Memory(
        _PROGRAM + sample_bytes(scenario) * scenario.imu.rate_hz * lasts,
        epochs * (_EPOCH + _STATE * n + _PARAMETER * (n - CORE)) + matrix * kept,
        readings * (_READING + 8.0 * 3.0 * _ARRAYS),
        matrix * stretch,
    )


def _divides(rate: float, grid: float) -> bool:
    """Return whether all instants of a rate are instants of another."""
    return abs(grid / rate - round(grid / rate)) < 1e-9


def check_memory(scenario: Scenario) -> None:
    """Raise for a run whose filter needs more memory than this machine has.

    Args:
        scenario: any scenario.

    Raises:
        InputError: the run needs more; the message names the largest part and what would fit.
    """
    section = scenario.filter
    if section is None:
        return
    memory, needed = machine_memory(), needed_memory(scenario)
    if needed.total <= memory:
        return
    lasts = expected_duration(scenario)
    rates = {f"aiding.{name}.rate_hz": sensor.rate_hz for name, sensor in scenario.aiding or () if sensor is not None}
    fastest = max(rates, key=lambda key: rates[key], default="filter.rate_hz")
    if needed.samples >= max(needed.filter, needed.readings):
        key, value = "imu.rate_hz", scenario.imu.rate_hz
    elif needed.readings > needed.filter or (section.smooth and rates[fastest] > 1.0):
        key, value = fastest, rates[fastest]  # a row is kept at every reading
    else:
        key, value = "filter.rate_hz", min(section.rate_hz, scenario.imu.rate_hz)
    part = max((memory - _PROGRAM) / (needed.total - _PROGRAM), 0.0)
    smooth = "Without filter.smooth it needs less: smoothing keeps every row of the filter. " if section.smooth else ""
    raise InputError(
        f"{key} = {value:g}: a run of about {lasts:.6g} s with a filter of {filter_model(scenario, lasts).size} states "
        f"needs {needed.total / 1e9:.3g} GB of memory where this machine has {memory / 1e9:.3g}. {smooth}"
        f"A run of {part * lasts:.3g} s would fit; lower rates need less, too."
    )
