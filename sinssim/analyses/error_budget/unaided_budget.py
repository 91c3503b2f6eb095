"""The budget of inertial navigation without a filter: steps of time, the vertical loop, and its height readings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import earth
from sinssim.analyses.error_budget.error_dynamics import (
    TrueMotion,
    exponential,
    gravity_input,
    noise_inputs,
    white_covariance,
)
from sinssim.analyses.error_budget.propagation import NavigationStep, Propagation, Reading
from sinssim.analyses.error_budget.source_shares import SensorConstant, SensorGiven, SensorNoise, SensorProcess, Shares
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


class Snapshot(NamedTuple):
    """The shares of the navigation errors at one instant.

    Attributes:
        sensitivity: (9, m).
        covariances: by random source, (9, 9).
    """

    sensitivity: Array
    covariances: dict[str, Array]


@dataclass
class Marks:
    """Instants between which the changes of the errors are wanted.

    Attributes:
        time: increasing, at edges of samples, s; those before the navigation begins do not count.
        begin: the instant from which the first change counts, filled in, s.
        changes: of the navigation errors from one instant to the next, filled in.
        reached: ends of the changes, filled in, s.
    """

    time: Array
    begin: float = 0.0
    changes: list[Snapshot] = field(default_factory=list)
    reached: list[float] = field(default_factory=list)

    def start(self, propagations: Iterable[Propagation], now: float) -> None:
        """Begin the first interval."""
        self.begin = now
        for one in propagations:
            one.mark(CORE)

    def pass_by(self, published: Propagation, all_of_them: Iterable[Propagation], now: float) -> None:
        """End an interval and begin the next, if an instant is reached."""
        if len(self.time) and np.abs(self.time - now).min() < _SAME_INSTANT and now > self.begin + _SAME_INSTANT:
            self.changes.append(Snapshot(*published.changes()))
            self.reached.append(now)
            for one in all_of_them:
                one.mark(CORE)


_SAME_INSTANT = 1e-6


@dataclass(frozen=True)
class HeightErrors:
    """An altimeter's readings for the vertical loop.

    Attributes:
        arrival: arrival times, (M,) s.
        height: true height that a scale factor multiplies, (M,) m.
        given: error of each reading that is the same in every run, reading less true height at arrival, (M,) m.
        interval: time between readings, s.
        label: name of the readings.
    """

    arrival: Array
    height: Array
    given: Array
    interval: float
    label: str


@dataclass(frozen=True)
class Vertical:
    """The vertical channel.

    Attributes:
        kind: "free", "baro-loop" or "truth".
        time_constant: of the loop, s.
        readings: of its altimeter; None for the exact height at every sample.
    """

    kind: str
    time_constant: float
    readings: HeightErrors | None


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
    """Propagate all sources along the whole run.

    Args:
        outputs: instants of the results, edges of samples, (E,) s.
        begun: sample and shares where navigation begins, after an alignment; by default the start of the run.
        marks: instants between which the changes are wanted, among `outputs`.
    """
    start, propagation = (0, shares.begin(STATES)) if begun is None else begun
    time = _boundaries(motion, vertical, outputs)
    time = time[time >= motion.ideal.time[start] - 1e-9]
    held = vertical.kind == "truth"
    keep = np.eye(STATES)
    if held:
        keep[2, 2] = keep[5, 5] = 0.0
        propagation.map(keep)
    only = keep[:CORE, :CORE]
    if marks is not None:
        marks.start([propagation], float(time[0]))
    wanted = set(np.searchsorted(time, outputs - 1e-9).tolist())
    found = [snapshot(propagation, shares, rounded=False)] if 0 in wanted else []
    readings = vertical.readings
    at_boundary, overdue = _readings_at(time, readings)
    block = 512
    for first in range(0, len(time) - 1, block):
        progress(first / len(time))
        part = time[first : first + block + 1]
        nominal = motion.nominal(part)
        f = _with_loop(motion.dynamics(nominal), nominal, vertical, motion, overdue[first : first + len(part) - 1])
        interval = np.diff(part)
        if held:
            f[:, [2, 5]] = 0.0
        phi = keep @ exponential(f, interval)
        noise = _noise(f, nominal, shares, interval)
        effects = motion.responses(part, shares.kernel_columns, *series)
        constants = np.zeros((len(interval), STATES, shares.count))
        constants[:, :CORE, : shares.inertial] = effects.core[:, :, : shares.inertial]
        constants = keep @ constants
        bias = np.zeros((len(interval), STATES, 6))
        bias[:, :CORE] = effects.core[:, :, shares.inertial :]
        bias = keep @ bias
        distance = motion.distance(part)
        for k, length in enumerate(interval.tolist()):
            own = {name: keep @ q[k] @ keep for name, q in noise.items()}
            fields = keep @ gravity_input(phi[k], length)
            both = bias[k, :, :3], bias[k, :, 3:]
            propagation.step(NavigationStep(phi[k], constants[k], own, both, length, fields, float(distance[k])))
            row = first + k + 1
            if readings is not None and at_boundary[row] >= 0:
                propagation.read(_height_reading(shares, readings, int(at_boundary[row])))
            if row in wanted:
                seen = snapshot(propagation, shares)
                if held:  # nor does a pulse round what is held
                    seen = Snapshot(seen.sensitivity, {name: only @ p @ only for name, p in seen.covariances.items()})
                found.append(seen)
                if marks is not None:
                    marks.pass_by(propagation, [propagation], float(time[row]))
    progress(1.0)
    return found


def _noise(f: Array, nominal: NominalMotion, shares: Shares, interval: Array) -> dict[str, Array]:
    inputs, found = noise_inputs(nominal), {}
    for noise in shares.noises:
        if noise.process is None:
            driven = np.zeros((len(f), f.shape[1], 3))
            driven[:, :CORE] = inputs[noise.triad, noise.what] @ (noise.density * noise.mix)
            found[noise.source.name] = white_covariance(f, driven, interval)
    return found


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


def snapshot(propagation: Propagation, shares: Shares, *, rounded: bool = True) -> Snapshot:
    """Return the shares of the navigation errors at the present instant.

    Args:
        rounded: whether pulses have been counted, whose rounding is included.
    """
    covariances = {name: p.copy() for name, p in propagation.covariances(CORE).items()}
    if rounded:
        add_rounding(covariances, shares)
    return Snapshot(propagation.sensitivity[:CORE].copy(), covariances)


def add_rounding(covariances: Mapping[str, Array], shares: Shares) -> None:
    """Add the rounding of the last pulse, Q²/12 on each axis, to attitude and velocity.

    Args:
        covariances: by source, (9, 9), changed.
    """
    for noise in shares.noises:
        if noise.what == "quantum":
            rows = slice(6, 9) if noise.triad == 0 else slice(3, 6)
            covariances[noise.source.name][rows, rows] += noise.size**2 / 12.0 * noise.mix @ noise.mix.T
