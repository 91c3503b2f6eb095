"""Propagates every source's share of the navigation errors through steps and readings.

The core state holds the navigation errors and what follows from them: the vertical loop, or the filter's estimates of
the sensors' parameters. A source is one of

    constant    x_j = S_j θ_j: columns of a sensitivity matrix, S ← Φ S + B
    white       P_j ← Φ P_j Φᵀ + Q_j
    process     the same with the states of the process beside the core

and a reading z = H x + H_θ θ + H_y y + v, by which x ← x + K z, changes each of them alike. The covariance of all
sources together is the sum.

A process of one axis with the states s takes a step by

    s ← A s + E ν,    m = c s + d ν        with independent normal numbers ν of variance 1,

m being the mean of the process over the step. The emulator's recursions (`sensors.imu.emulation_kernel`) are such
steps of one sample; the means over longer steps have the same covariances, except that a rate random walk is exact here
and off by 0.29 T in variance there, T the sampling interval.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.sensors.flicker import DIRECT, RATES, STATIONARY, WEIGHTS
from sinssim.statistics.random_numbers import mean_step
from sinssim.truth.true_gravity_disturbance import RemainderModel


class Step(NamedTuple):
    """One step of a process of one axis with p states, driven by q numbers."""

    keep: Array  # A, (p, p)
    fresh: Array  # E, (p, q)
    mean_of_state: Array  # c, (p,)
    mean_of_fresh: Array  # d, (q,)


# A process has the covariance of its states at the start, the weights of the states in its value, and its steps.


@dataclass(frozen=True)
class GaussMarkov:
    """A stationary first-order process of variance 1."""

    correlation_time: float  # τ, s

    start: ClassVar[Array] = np.ones((1, 1))
    value: ClassVar[Array] = np.ones(1)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s]; `mean_step` has the formula."""
        keep, fresh, of_state, of_fresh = mean_step(interval / self.correlation_time)
        return Step(np.array([[keep]]), np.array([[fresh]]), np.array([of_state]), np.array([of_fresh]))


@dataclass(frozen=True)
class Walk:
    """A random walk of density 1, zero at the start."""

    start: ClassVar[Array] = np.zeros((1, 1))
    value: ClassVar[Array] = np.ones(1)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s]."""
        root = math.sqrt(interval)
        # the mean's departure from half the increment is independent of it and has the variance T/12
        return Step(np.ones((1, 1)), np.array([[root, 0.0]]), np.ones(1), root * np.array([0.5, 1.0 / math.sqrt(12.0)]))


@dataclass(frozen=True)
class Sum:
    """White noise of density 1 with its own integral as the state, which readings of a mean rate contain."""

    start: ClassVar[Array] = np.zeros((1, 1))
    value: ClassVar[Array] = np.ones(1)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s]: the mean of white noise is its integral over the interval."""
        root = math.sqrt(interval)
        return Step(np.ones((1, 1)), np.array([[root]]), np.zeros(1), np.array([1.0 / root]))


@dataclass(frozen=True)
class Flicker:
    """Flicker noise of B = 1, the sum of ten processes that `sinssim.sensors.flicker` defines for samples."""

    sample: float  # sampling interval, s

    start: ClassVar[Array] = np.asarray(STATIONARY @ STATIONARY.T)
    value: ClassVar[Array] = np.array(WEIGHTS)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s], rounded to whole samples."""
        return _flicker_step(max(round(interval / self.sample), 1))


@lru_cache(maxsize=64)
def _flicker_step(count: int) -> Step:
    """Return the step over n samples: the n numbers are replaced by eleven with the same joint covariance."""
    decay = 1.0 - np.array(RATES)
    weights = np.array(WEIGHTS)
    power = decay ** np.arange(count + 1)[:, None]  # d_m^k, (n+1, 10)
    sums = np.cumsum(power, axis=0)  # Σ d_m^i for i = 0 … k
    # the number of sample j is still in x_m at the end by d^(n−1−j), and in the sum of outputs by w₀ + Σ w_m Σ d^i
    left = np.arange(count - 1, -1, -1)
    to_end = power[left]
    to_mean = (DIRECT + sums[left] @ weights) / count
    driven = np.column_stack([to_end, to_mean])
    covariance = driven.T @ driven
    size = np.sqrt(covariance.diagonal())
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    root = size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    of_state = weights * (sums[count] - 1.0) / count  # x after j samples is d^j x
    return Step(np.diag(power[count]), root[:-1], of_state, root[-1])


@dataclass(frozen=True)
class AlongWay:
    """The remainder of gravity over the distance travelled, of variance 1; its steps are distances, not times."""

    model: RemainderModel  # order and correlation distance

    @property
    def start(self) -> Array:
        """Covariance of the value and its derivatives at the start, (p, p)."""
        return self.model.dynamics()[1]

    @property
    def value(self) -> Array:
        """Weights of the states in the process's value, (p,)."""
        return np.asarray(np.eye(self.model.order)[0])

    def step(self, interval: float) -> Step:
        """Return the step over a distance [m].

        The mean over the step is that of its ends: over a hundredth of the correlation distance, 1e-5 of it is missing.
        """
        f, stationary = self.model.dynamics()
        b, eye, x = self.model.beta, np.eye(len(f)), f * interval
        # the eigenvalues of F are all −β: exp(F d) = e^(−βd) Σ (F + β)^k d^k/k!, k < p
        nilpotent = x + b * interval * eye
        keep = eye + nilpotent + (0.5 * nilpotent @ nilpotent if len(f) == 3 else 0.0)
        keep = keep * math.exp(-b * interval)
        scale = np.sqrt(np.diag(stationary))
        rest = (stationary - keep @ stationary @ keep.T) / np.outer(scale, scale)
        values, vectors = np.linalg.eigh(0.5 * (rest + rest.T))
        fresh = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return Step(keep, fresh, 0.5 * (eye[0] + keep[0]), 0.5 * fresh[0])


Process = GaussMarkov | Walk | Sum | Flicker | AlongWay


_OF_GRAVITY = 2


@dataclass
class RunningProcess:
    """A process with its states beside the core."""

    name: str  # its source
    process: Process  # of unit size, for one axis
    sigma: Array  # size of each axis, (a,)
    triad: int | None
    """0 or 1 if it is an error of gyros or accelerometers, 2 if it is one of gravity; None for a sensor's, which enters
    by its readings.
    """
    covariance: Array  # of core and states, axis by axis, (n + a p, n + a p)
    mix: Array | None = None
    """Effect of the axes on the three sensors of the triad, (3, a); None for a process of the sensors themselves."""


class Reading(NamedTuple):
    """A correction x ← x + K z by z = H x + H_θ θ + H_y y + v."""

    gain: Array  # K, (n, k)
    core: Array  # H, (k, n)
    constants: Array  # H_θ, (k, m)
    processes: Mapping[str, Array] = {}  # H_y of the processes that enter, by source, (k, a)
    noise: Mapping[str, Array] = {}  # variance of v by white source, (k,); a source without states may stand here alone


class NavigationStep(NamedTuple):
    """A step of time."""

    phi: Array  # Φ, (n, n)
    constants: Array  # B, (n, m)
    noise: Mapping[str, Array]  # Q by white source, {name: (n, n)}
    bias: tuple[Array, Array]  # effect of a unit error of each triad's three sensors during the step, two of (n, 3)
    interval: float  # s
    gravity: Array | None = None
    """Effect of a unit disturbance north, east, down during the step, (n, 3); None where no source needs it."""
    distance: float = 0.0  # horizontal distance travelled, m


@dataclass
class Propagation:
    """All sources' shares at one instant."""

    sensitivity: Array  # S, (n, m)
    white: Sequence[str]  # names of the white sources, in the order of `covariance`
    covariance: Array  # P_j of the white sources, (w, n, n)
    processes: list[RunningProcess]
    marked: int = 0
    """Number of states at the end of the core that hold the first ones as they were at a marked instant; steps,
    readings and maps are those of the core without them.
    """
    _steps: dict[tuple[str, float], Step] = field(default_factory=dict)

    @classmethod
    def start(cls, core: int, constants: int, white: Sequence[str]) -> Propagation:
        """Return a propagation of `core` states and m constant columns without any error yet."""
        return cls(np.zeros((core, constants)), white, np.zeros((len(white), core, core)), [])

    def add(self, name: str, process: Process, sigma: Array, triad: int | None, mix: Array | None = None) -> None:
        """Add a process in its initial state."""
        n, each = len(self.sensitivity), len(process.start)
        covariance = np.zeros((n + each * len(sigma),) * 2)
        for axis, size in enumerate(sigma):
            states = slice(n + axis * each, n + (axis + 1) * each)
            covariance[states, states] = size**2 * process.start
        self.processes.append(RunningProcess(name, process, sigma, triad, covariance, mix))

    def step(self, step: NavigationStep) -> None:
        """Advance over a step of time."""
        if self.marked:
            step = _widened(step, self.marked)
        phi = step.phi
        self.sensitivity = phi @ self.sensitivity + step.constants
        if len(self.white):
            self.covariance = phi @ self.covariance @ phi.T
            for number, name in enumerate(self.white):
                if name in step.noise:
                    self.covariance[number] += step.noise[name]
        for running in self.processes:
            self._step_process(running, step)

    def _step_process(self, running: RunningProcess, step: NavigationStep) -> None:
        length = step.distance if running.triad == _OF_GRAVITY else step.interval
        key = running.name, round(length, 9)
        if key not in self._steps:
            self._steps[key] = running.process.step(length)
        advance = self._steps[key]
        n, (each, fresh), axes = len(step.phi), advance.fresh.shape, len(running.sigma)
        bias = None if running.triad is None else (*step.bias, step.gravity)[running.triad]
        if bias is not None and running.mix is not None:
            bias = bias @ running.mix
        whole = np.zeros(running.covariance.shape)
        whole[:n, :n] = step.phi
        drive = np.zeros((len(whole), axes * fresh))
        for axis in range(axes):
            states = slice(n + axis * each, n + (axis + 1) * each)
            numbers = slice(axis * fresh, (axis + 1) * fresh)
            whole[states, states] = advance.keep
            drive[states, numbers] = running.sigma[axis] * advance.fresh
            if bias is not None:
                whole[:n, states] = bias[:, axis, None] * advance.mean_of_state
                drive[:n, numbers] = (running.sigma[axis] * bias[:, axis])[:, None] * advance.mean_of_fresh
        running.covariance = whole @ running.covariance @ whole.T + drive @ drive.T

    def read(self, reading: Reading) -> None:
        """Correct by a reading."""
        gain, core = reading.gain, reading.core
        if self.marked:
            gain, core = _with_rows(gain, self.marked), _with_rows(core.T, self.marked).T
        self.sensitivity = self.sensitivity + gain @ (core @ self.sensitivity + reading.constants)
        reduced = np.eye(len(gain)) + gain @ core
        if len(self.white):
            self.covariance = reduced @ self.covariance @ reduced.T
            for number, name in enumerate(self.white):
                if name in reading.noise:
                    self.covariance[number] += (gain * reading.noise[name]) @ gain.T
        n = len(gain)
        for running in self.processes:
            whole = np.eye(len(running.covariance))
            whole[:n, :n] = reduced
            if running.name in reading.processes:
                axes = gain @ reading.processes[running.name]  # by the process's values, axis by axis
                whole[:n, n:] = (axes[:, :, None] * running.process.value.ravel()).reshape(n, -1)
            running.covariance = whole @ running.covariance @ whole.T

    def reset(self, name: str) -> None:
        """Set the states of a process to zero."""
        n = len(self.sensitivity)
        for running in self.processes:
            if running.name == name:
                running.covariance = running.covariance.copy()
                running.covariance[n:] = 0.0
                running.covariance[:, n:] = 0.0

    def map(self, core: Array) -> None:
        """Apply a linear map to the core state, (n, n)."""
        self._apply(_with_identity(core, self.marked))

    def _apply(self, core: Array) -> None:
        n = len(core)
        self.sensitivity = core @ self.sensitivity
        self.covariance = core @ self.covariance @ core.T
        for running in self.processes:
            running.covariance[:n] = core @ running.covariance[:n]
            running.covariance[:, :n] = running.covariance[:, :n] @ core.T

    def project(self, core: Array) -> None:
        """Apply a linear map to the core state that changes their number, (m, n); nothing may be kept yet."""
        m, n = core.shape
        self.sensitivity = core @ self.sensitivity
        self.covariance = core @ self.covariance @ core.T
        for running in self.processes:
            whole = np.zeros((m + len(running.covariance) - n, len(running.covariance)))
            whole[:m, :n] = core
            whole[m:, n:] = np.eye(len(running.covariance) - n)
            running.covariance = whole @ running.covariance @ whole.T

    def mark(self, count: int) -> None:
        """Keep the first core states as they are now, beside the core, for `changes`."""
        n = len(self.sensitivity) - self.marked
        again = np.eye(n + count, n)
        again[n:, :count] = np.eye(count)
        whole = np.hstack([again, np.zeros((n + count, self.marked))])
        self.marked = 0
        self.project(whole)
        self.marked = count

    def changes(self) -> tuple[Array, dict[str, Array]]:
        """Return sensitivity, (c, m), and covariances, (c, c) by source, of the changes since the last mark."""
        n, c = len(self.sensitivity), self.marked
        less = np.eye(c, n)
        less[:, n - c :] -= np.eye(c)
        covariances = {name: less @ self.covariance[k] @ less.T for k, name in enumerate(self.white)}
        covariances |= {running.name: less @ running.covariance[:n, :n] @ less.T for running in self.processes}
        return less @ self.sensitivity, covariances

    def copy(self) -> Propagation:
        """Return a copy that continues by itself."""
        processes = [RunningProcess(p.name, p.process, p.sigma, p.triad, p.covariance, p.mix) for p in self.processes]
        return Propagation(self.sensitivity, self.white, self.covariance, processes, self.marked, self._steps)

    def covariances(self, rows: int) -> dict[str, Array]:
        """Return the covariances of the first core states by random source, (rows, rows) each."""
        white = {name: self.covariance[k, :rows, :rows] for k, name in enumerate(self.white)}
        return white | {running.name: running.covariance[:rows, :rows] for running in self.processes}


def _with_rows(values: Array, count: int) -> Array:
    """Return a matrix with rows of zeros below it."""
    return np.concatenate([values, np.zeros((count, values.shape[1]))])


def _with_identity(core: Array, count: int) -> Array:
    """Return a square matrix with further states that it leaves as they are."""
    whole = np.eye(len(core) + count)
    whole[: len(core), : len(core)] = core
    return whole


def _widened(step: NavigationStep, count: int) -> NavigationStep:
    """Return a step with further states that it leaves as they are."""
    return NavigationStep(
        _with_identity(step.phi, count),
        _with_rows(step.constants, count),
        {name: _with_rows(_with_rows(q, count).T, count).T for name, q in step.noise.items()},
        (_with_rows(step.bias[0], count), _with_rows(step.bias[1], count)),
        step.interval,
        None if step.gravity is None else _with_rows(step.gravity, count),
        step.distance,
    )
