"""The budget of inertial navigation without a filter: steps of time, the vertical loop, and its height readings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim import earth
from sinssim.analyses.error_budget.error_dynamics import TrueMotion, exponential
from sinssim.analyses.error_budget.share_propagation import Propagation, Reading
from sinssim.analyses.error_budget.source_shares import (
    Marks,
    SensorConstant,
    SensorGiven,
    SensorNoise,
    SensorProcess,
    Shares,
    Snapshot,
    StepEffects,
    snapshot,
    step_effects,
)
from sinssim.data import Array
from sinssim.estimation.error_dynamics import NominalMotion
from sinssim.sensors.measurement_kind import CORE

_INTEGRAL, _HELD = CORE, CORE + 1
STATES = CORE + 2
"""Core states: navigation errors, the loop's k₃∫e dt, and the error e that it holds between readings."""

_LONGEST = 1.0
"""Longest step, s. Within it the increments are integrated sample by sample; between steps the specific force is the
mean one, which is wrong for second-order effects by f Δφ (dt)²/12 of the tilt: 1e-4 in a turn at 3°/s."""

_OVERDUE = 1.5
"""Intervals between readings after which the vertical loop opens, as in `HeightReadings`."""

_OF_LOOP = 0.05
"""Longest step relative to the time constant of the vertical loop."""


@dataclass(frozen=True)
class HeightErrors:
    """An altimeter's readings for the vertical loop."""

    arrival: Array  # arrival times, (M,) s
    height: Array  # true height that a scale factor multiplies, (M,) m
    given: Array  # error of each reading that is the same in every run, reading less true height at arrival, (M,) m
    interval: float  # time between readings, s
    label: str  # name of the readings


@dataclass(frozen=True)
class Vertical:
    """The vertical channel."""

    kind: str  # "free", "baro-loop" or "truth"
    time_constant: float  # of the loop, s
    readings: HeightErrors | None  # of its altimeter; None for the exact height at every sample


def _boundaries(motion: TrueMotion, vertical: Vertical, outputs: Array) -> Array:
    """Return the boundaries of the steps: at most a second apart, all at edges of samples."""
    edges = motion.ideal.time
    longest = min(_LONGEST, _OF_LOOP * vertical.time_constant) if vertical.kind == "baro-loop" else _LONGEST
    sample = float(edges[-1] - edges[0]) / (len(edges) - 1)
    stride = max(int(longest / sample + 1e-6), 1)
    wanted = [np.arange(0, len(edges), stride), np.array([len(edges) - 1]), np.searchsorted(edges, outputs - 1e-9)]
    if (readings := vertical.readings) is not None:
        overdue = readings.arrival + _OVERDUE * readings.interval
        wanted += [np.searchsorted(edges, readings.arrival - 1e-9), np.searchsorted(edges, overdue, side="right")]
    chosen = np.unique(np.concatenate(wanted).astype(np.int64))
    return np.asarray(edges[chosen[chosen < len(edges)]])


def _with_loop(
    f: Array, nominal: NominalMotion, vertical: Vertical, motion: TrueMotion, open_loop: NDArray[np.bool_]
) -> Array:
    """Return F of navigation errors and loop, (K, 11, 11).

    With e = δh − δh_ref, δh = −δr_D: δṙ_D = δv_D + k₁ e, δv̇_D = … + k₂ e + s, ṡ = k₃ e.
    """
    whole = np.zeros((len(f), STATES, STATES))
    whole[:, :CORE, :CORE] = f
    if vertical.kind != "baro-loop":
        return whole
    rate, ellipsoid = 1.0 / vertical.time_constant, motion.trajectory.ellipsoid
    gravity = earth.gravity_ned(nominal.latitude, nominal.height, motion.gravity, ellipsoid)[:, 2]
    curvature = 1.0 / (earth.radii(nominal.latitude, ellipsoid)[1] + nominal.height)
    first, third = np.full(len(f), 3.0 * rate), np.full(len(f), rate**3)
    gains = (first, np.asarray(3.0 * rate**2 + 2.0 * gravity * curvature), third)
    sampled = vertical.readings is not None
    whole[:, 5, _INTEGRAL] = 1.0
    for row, gain in zip((2, 5, _INTEGRAL), gains, strict=True):
        if sampled:
            whole[:, row, _HELD] = np.where(open_loop, 0.0, gain)
        else:
            whole[:, row, 2] -= gain
    return whole


_BLOCK = 512
"""Steps whose effects are computed at once."""


def propagate(
    motion: TrueMotion,
    shares: Shares,
    series: tuple[Array, Array],
    vertical: Vertical,
    outputs: Array,
    progress: Callable[[float], None],
    begun: tuple[int, Propagation] | None = None,
    marks: Marks | None = None,
) -> list[Snapshot]:
    """Propagate all sources along the whole run; return their shares at `outputs`, edges of samples, (E,) s.

    Navigation begins after an alignment at the sample and with the shares of `begun`. The changes are wanted between
    the instants of `marks`, which are among `outputs`.
    """
    start, propagation = (0, shares.begin(STATES)) if begun is None else begun
    time = _boundaries(motion, vertical, outputs)
    time = time[time >= motion.ideal.time[start] - 1e-9]
    keep = np.eye(STATES)
    if vertical.kind == "truth":  # height and vertical velocity have no errors
        keep[2, 2] = keep[5, 5] = 0.0
        propagation.map(keep)
    if marks is not None:
        marks.start([propagation], float(time[0]))
    wanted = set(np.searchsorted(time, outputs - 1e-9).tolist())
    snapshots = [snapshot(propagation, shares, rounded=False)] if 0 in wanted else []
    readings = vertical.readings
    at_boundary, overdue = _readings_at(time, readings)
    for first in range(0, len(time) - 1, _BLOCK):
        progress(first / len(time))
        part = time[first : first + _BLOCK + 1]
        phi, effects = _steps(motion, shares, series, vertical, part, overdue[first : first + len(part) - 1], keep)
        for k in range(len(phi)):
            propagation.step(effects.step(k, phi[k], keep))
            row = first + k + 1
            if readings is not None and at_boundary[row] >= 0:
                propagation.read(_height_reading(shares, readings, int(at_boundary[row])))
            if row in wanted:
                seen, core = snapshot(propagation, shares), keep[:CORE, :CORE]  # nor does a pulse round what is held
                snapshots.append(
                    Snapshot(seen.sensitivity, {name: core @ p @ core for name, p in seen.covariances.items()})
                )
                if marks is not None:
                    marks.pass_by(propagation, [propagation], float(time[row]))
    progress(1.0)
    return snapshots


def _steps(
    motion: TrueMotion,
    shares: Shares,
    series: tuple[Array, Array],
    vertical: Vertical,
    time: Array,
    open_loop: NDArray[np.bool_],
    keep: Array,
) -> tuple[Array, StepEffects]:
    """Return Φ, (K, 11, 11), and the effects over steps; the states that `keep` projects away have no errors."""
    nominal = motion.nominal(time)
    f = _with_loop(motion.dynamics(nominal), nominal, vertical, motion, open_loop)
    f = np.where(np.diag(keep)[:, None] > 0.0, f, 0.0)
    effects = step_effects(motion, shares, series, time, nominal, f, STATES)
    constants, bias = keep @ effects.constants, keep @ effects.bias
    noise = {name: keep @ q @ keep for name, q in effects.noise.items()}
    return keep @ exponential(f, np.diff(time)), effects._replace(constants=constants, bias=bias, noise=noise)


def _readings_at(time: Array, readings: HeightErrors | None) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return the number of the reading that arrives at each boundary, −1 for none, and whether the loop is open."""
    at_boundary, overdue = np.full(len(time), -1), np.zeros(len(time), dtype=bool)
    if readings is None:
        return at_boundary, overdue
    last = np.searchsorted(readings.arrival, time + 1e-9, side="right") - 1
    new = np.diff(last, prepend=-1) > 0
    at_boundary[new] = last[new]
    overdue = (last < 0) | (time - readings.arrival[np.maximum(last, 0)] > _OVERDUE * readings.interval)
    return at_boundary, overdue


def _height_reading(shares: Shares, readings: HeightErrors, number: int) -> Reading:
    """Return the correction that replaces the held error by −δr_D − δh_ref."""
    gain = np.zeros((STATES, 1))
    gain[_HELD] = 1.0
    core = np.zeros((1, STATES))
    core[0, _HELD], core[0, 2] = -1.0, -1.0
    constants = np.zeros((1, shares.count))
    processes: dict[str, Array] = {}
    noise: dict[str, Array] = {}
    for sensor in shares.sensors:
        if isinstance(sensor, SensorConstant) and sensor.block == f"{readings.label} scale":
            constants[0, shares.of_block[sensor.block]] = -readings.height[number]
        elif isinstance(sensor, SensorProcess) and sensor.block == f"{readings.label} bias":
            processes[sensor.source.name] = -np.ones((1, 1))
        elif isinstance(sensor, SensorNoise):
            noise[sensor.source.name] = sensor.sigma**2
        elif isinstance(sensor, SensorGiven):
            constants[0, shares.of_label[sensor.label]] = -readings.given[number]
    return Reading(gain, core, constants, processes, noise)
