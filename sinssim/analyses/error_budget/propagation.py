"""Propagates every source's share of the navigation errors through steps and readings.

The core state holds the navigation errors and what follows from them: the vertical loop, or the filter's estimates of
the sensors' parameters. A source is one of

    constant    x_j = S_j θ_j: columns of a sensitivity matrix, S ← Φ S + B
    white       P_j ← Φ P_j Φᵀ + Q_j
    process     the same with the states of the process beside the core

and a reading z = H x + H_θ θ + H_y y + v, by which x ← x + K z, changes each of them alike. The covariance of all
sources together is the sum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sinssim.analyses.error_budget.inputs.processes import Process, Step
from sinssim.data import Array

_OF_GRAVITY = 2


@dataclass
class RunningProcess:
    """A process with its states beside the core.

    Attributes:
        name: its source.
        process: of unit size, for one axis.
        sigma: size of each axis, (a,).
        triad: 0 or 1 if it is an error of gyros or accelerometers, 2 if it is one of gravity; None for a sensor's,
            which enters by its readings.
        covariance: of core and states, axis by axis, (n + a p, n + a p).
        mix: effect of the axes on the three sensors of the triad, (3, a); None for a process of the sensors themselves.
    """

    name: str
    process: Process
    sigma: Array
    triad: int | None
    covariance: Array
    mix: Array | None = None


class Reading(NamedTuple):
    """A correction x ← x + K z by z = H x + H_θ θ + H_y y + v.

    Attributes:
        gain: K, (n, k).
        core: H, (k, n).
        constants: H_θ, (k, m).
        processes: H_y of the processes that enter, by source, (k, a).
        noise: variance of v by white source, (k,); a source without states may stand here alone.
    """

    gain: Array
    core: Array
    constants: Array
    processes: Mapping[str, Array] = {}
    noise: Mapping[str, Array] = {}


class NavigationStep(NamedTuple):
    """A step of time.

    Attributes:
        phi: Φ, (n, n).
        constants: B, (n, m).
        noise: Q by white source, {name: (n, n)}.
        bias: effect of a unit error of each triad's three sensors during the step, two of (n, 3).
        interval: s.
        gravity: effect of a unit disturbance north, east, down during the step, (n, 3); None where no source needs it.
        distance: horizontal distance travelled, m.
    """

    phi: Array
    constants: Array
    noise: Mapping[str, Array]
    bias: tuple[Array, Array]
    interval: float
    gravity: Array | None = None
    distance: float = 0.0


@dataclass
class Propagation:
    """All sources' shares at one instant.

    Attributes:
        sensitivity: S, (n, m).
        white: names of the white sources, in the order of `covariance`.
        covariance: P_j of the white sources, (w, n, n).
        processes: the processes.
        kept: number of states at the end of the core that hold the first ones as they were at a marked instant; steps,
            readings and maps are those of the core without them.
    """

    sensitivity: Array
    white: Sequence[str]
    covariance: Array
    processes: list[RunningProcess]
    kept: int = 0
    _steps: dict[tuple[str, float], Step] = field(default_factory=dict)

    @classmethod
    def start(cls, core: int, constants: int, white: Sequence[str]) -> Propagation:
        """Return a propagation without any error yet.

        Args:
            constants: number m of constant columns.
        """
        return cls(np.zeros((core, constants)), white, np.zeros((len(white), core, core)), [])

    def add(self, name: str, process: Process, sigma: Array, triad: int | None, mix: Array | None = None) -> None:
        """Add a process in its initial state."""
        n, each = len(self.sensitivity), len(process.start)
        covariance = np.zeros((n + each * len(sigma),) * 2)
        for axis, size in enumerate(sigma):
            own = slice(n + axis * each, n + (axis + 1) * each)
            covariance[own, own] = size**2 * process.start
        self.processes.append(RunningProcess(name, process, sigma, triad, covariance, mix))

    def step(self, step: NavigationStep) -> None:
        """Advance over a step of time."""
        if self.kept:
            step = _widened(step, self.kept)
        phi = step.phi
        self.sensitivity = phi @ self.sensitivity + step.constants
        if len(self.white):
            self.covariance = phi @ self.covariance @ phi.T
            for number, name in enumerate(self.white):
                if name in step.noise:
                    self.covariance[number] += step.noise[name]
        for one in self.processes:
            self._step_process(one, step)

    def _step_process(self, one: RunningProcess, step: NavigationStep) -> None:
        length = step.distance if one.triad == _OF_GRAVITY else step.interval
        key = one.name, round(length, 9)
        if key not in self._steps:
            self._steps[key] = one.process.step(length)
        own = self._steps[key]
        n, (each, fresh), axes = len(step.phi), own.fresh.shape, len(one.sigma)
        bias = None if one.triad is None else (*step.bias, step.gravity)[one.triad]
        if bias is not None and one.mix is not None:
            bias = bias @ one.mix
        whole = np.zeros(one.covariance.shape)
        whole[:n, :n] = step.phi
        drive = np.zeros((len(whole), axes * fresh))
        for axis in range(axes):
            states = slice(n + axis * each, n + (axis + 1) * each)
            numbers = slice(axis * fresh, (axis + 1) * fresh)
            whole[states, states] = own.keep
            drive[states, numbers] = one.sigma[axis] * own.fresh
            if bias is not None:
                whole[:n, states] = bias[:, axis, None] * own.mean_of_state
                drive[:n, numbers] = (one.sigma[axis] * bias[:, axis])[:, None] * own.mean_of_fresh
        one.covariance = whole @ one.covariance @ whole.T + drive @ drive.T

    def read(self, reading: Reading) -> None:
        """Correct by a reading."""
        gain, core = reading.gain, reading.core
        if self.kept:
            gain, core = _with_rows(gain, self.kept), _with_rows(core.T, self.kept).T
        self.sensitivity = self.sensitivity + gain @ (core @ self.sensitivity + reading.constants)
        kept = np.eye(len(gain)) + gain @ core
        if len(self.white):
            self.covariance = kept @ self.covariance @ kept.T
            for number, name in enumerate(self.white):
                if name in reading.noise:
                    self.covariance[number] += (gain * reading.noise[name]) @ gain.T
        n = len(gain)
        for one in self.processes:
            whole = np.eye(len(one.covariance))
            whole[:n, :n] = kept
            if one.name in reading.processes:
                axes = gain @ reading.processes[one.name]  # by the process's values, axis by axis
                whole[:n, n:] = (axes[:, :, None] * one.process.value.ravel()).reshape(n, -1)
            one.covariance = whole @ one.covariance @ whole.T

    def reset(self, name: str) -> None:
        """Set the states of a process to zero."""
        n = len(self.sensitivity)
        for one in self.processes:
            if one.name == name:
                one.covariance = one.covariance.copy()
                one.covariance[n:] = 0.0
                one.covariance[:, n:] = 0.0

    def map(self, core: Array) -> None:
        """Apply a linear map to the core state, (n, n)."""
        self._apply(_with_identity(core, self.kept))

    def _apply(self, core: Array) -> None:
        n = len(core)
        self.sensitivity = core @ self.sensitivity
        self.covariance = core @ self.covariance @ core.T
        for one in self.processes:
            one.covariance[:n] = core @ one.covariance[:n]
            one.covariance[:, :n] = one.covariance[:, :n] @ core.T

    def project(self, core: Array) -> None:
        """Apply a linear map to the core state that changes their number, (m, n); nothing may be kept yet."""
        m, n = core.shape
        self.sensitivity = core @ self.sensitivity
        self.covariance = core @ self.covariance @ core.T
        for one in self.processes:
            whole = np.zeros((m + len(one.covariance) - n, len(one.covariance)))
            whole[:m, :n] = core
            whole[m:, n:] = np.eye(len(one.covariance) - n)
            one.covariance = whole @ one.covariance @ whole.T

    def mark(self, count: int) -> None:
        """Keep the first core states as they are now, beside the core, for `changes`."""
        n = len(self.sensitivity) - self.kept
        again = np.eye(n + count, n)
        again[n:, :count] = np.eye(count)
        whole = np.hstack([again, np.zeros((n + count, self.kept))])
        self.kept, kept = 0, count
        self.project(whole)
        self.kept = kept

    def changes(self) -> tuple[Array, dict[str, Array]]:
        """Return the changes of the kept states since they were marked.

        Returns:
            Their sensitivity, (c, m), and their covariances by random source, (c, c).
        """
        n, c = len(self.sensitivity), self.kept
        less = np.eye(c, n)
        less[:, n - c :] -= np.eye(c)
        found = {name: less @ self.covariance[k] @ less.T for k, name in enumerate(self.white)}
        found |= {one.name: less @ one.covariance[:n, :n] @ less.T for one in self.processes}
        return less @ self.sensitivity, found

    def copy(self) -> Propagation:
        """Return a copy that continues by itself."""
        processes = [RunningProcess(p.name, p.process, p.sigma, p.triad, p.covariance, p.mix) for p in self.processes]
        return Propagation(self.sensitivity, self.white, self.covariance, processes, self.kept, self._steps)

    def covariances(self, rows: int) -> dict[str, Array]:
        """Return the covariances of the first core states by random source, (rows, rows) each."""
        found = {name: self.covariance[k, :rows, :rows] for k, name in enumerate(self.white)}
        return found | {one.name: one.covariance[:rows, :rows] for one in self.processes}


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
