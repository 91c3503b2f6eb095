"""The true motion of a run, and the linear error dynamics along it over steps of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sinssim.analyses.error_budget.inputs.sources import Column
from sinssim.analyses.error_budget.inputs.step_response_kernel import step_responses
from sinssim.data import Array, ImuData, NavState
from sinssim.estimation.dynamics import NominalMotion, dynamics
from sinssim.estimation.model import Block, ErrorModel
from sinssim.estimation.nominal import MeanGyroRates, motion
from sinssim.sensors.aiding.base.measurement import CORE, PHI, R, V, skew
from sinssim.sensors.imu.errors import ImuErrors, WarmUp
from sinssim.truth.trajectory import Trajectory

NAVIGATION_MODEL = ErrorModel((Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1.0)), 1.0, 1.0)
"""The error model of the nine navigation errors alone."""


@dataclass(frozen=True)
class Responses:
    """Effects of unit constant errors over K steps.

    Attributes:
        core: navigation errors at the end of a step by the error in it, (K, 9, m).
        mean: mean of the reading errors over the step, gyros first, (K, 6, m).
    """

    core: Array
    mean: Array


@dataclass(frozen=True)
class TrueMotion:
    """The true motion of a run's sensor block.

    Attributes:
        trajectory: the continuous motion.
        ideal: true increments.
        state: true states at the edges of the samples.
        warm_up: temperature of the block.
        gravity: name of the engine's gravity model.
    """

    trajectory: Trajectory
    ideal: ImuData
    state: NavState
    warm_up: WarmUp
    gravity: str

    @cached_property
    def rates(self) -> MeanGyroRates:
        """Source of mean rates."""
        return MeanGyroRates(self.ideal)

    @cached_property
    def _warmth(self) -> Array:
        time = self.ideal.time
        return self.warm_up.temperature(0.5 * (time[1:] + time[:-1]) - time[0])

    def distance(self, time: Array) -> Array:
        """Return the horizontal distances travelled between instants.

        Args:
            time: K+1 instants, s.

        Returns:
            (K,) m.
        """
        return np.asarray(np.diff(np.interp(time, self.ideal.time, self._travelled)))

    @cached_property
    def _travelled(self) -> Array:
        speed = np.hypot(self.state.velocity_ned[:, 0], self.state.velocity_ned[:, 1])
        passed = 0.5 * (speed[1:] + speed[:-1]) * np.diff(self.ideal.time)
        return np.concatenate([[0.0], np.cumsum(passed)])

    def nominal(self, time: Array) -> NominalMotion:
        """Return the mean motion between instants.

        Args:
            time: K+1 instants, increasing, s.

        Returns:
            K rows.
        """
        interval = np.diff(time)
        state, middle = self.trajectory.state(time), self.trajectory.state(0.5 * (time[1:] + time[:-1]))
        rate = self.rates.mean(time[:-1], time[1:], ImuErrors())
        return motion(state, middle, interval, rate, self.gravity, self.trajectory.ellipsoid)

    def dynamics(self, nominal: NominalMotion) -> Array:
        """Return F of the navigation errors, (K, 9, 9)."""
        return dynamics(NAVIGATION_MODEL, nominal, self.gravity, self.trajectory.ellipsoid)

    def responses(self, time: Array, columns: Sequence[Column | int], theta: Array, vel: Array) -> Responses:
        """Return the effects of constant errors over steps.

        Args:
            time: boundaries of K steps, s.
            columns: m constant errors, or numbers of given reading errors.
            theta, vel: given reading errors, (s, N, 3) rad and m/s.
        """
        edges = self.ideal.time
        sample = np.clip(np.searchsorted(edges, time + 1e-9, side="right") - 1, 0, len(edges) - 2)
        part = (time - edges[sample]) / (edges[sample + 1] - edges[sample])
        part[np.abs(part) < 1e-6] = 0.0
        part = np.minimum(part, 1.0)
        out, mean = np.empty((len(time) - 1, CORE, len(columns))), np.empty((len(time) - 1, 6, len(columns)))
        directions = np.array([np.zeros(3) if isinstance(c, int) else c.direction for c in columns])
        inputs, rows = self._inputs(columns, slice(int(sample[0]), int(sample[-1]) + 1))
        codes = [(0, c, 0) if isinstance(c, int) else (c.triad, -1, row) for c, row in zip(columns, rows, strict=True)]
        step_responses(
            sample, part, edges, np.ascontiguousarray(self.ideal.dvel), np.ascontiguousarray(self.state.q_nb),
            np.array(codes, dtype=np.int64).reshape(-1, 3), directions.reshape(-1, 3), inputs, theta, vel, out, mean,
        )  # fmt: skip
        return Responses(out, mean)

    def _inputs(self, columns: Sequence[Column | int], samples: slice) -> tuple[Array, list[int]]:
        """Return the integrals over samples of what unit errors multiply, each once, (r, n), and the row of each."""
        edges, warmth = self.ideal.time, self._warmth[samples]
        interval, middle = np.diff(edges)[samples], (0.5 * (edges[1:] + edges[:-1]) - edges[0])[samples]
        motion = [(rows[samples] / interval[:, None]).T for rows in (self.ideal.dtheta, self.ideal.dvel)]
        lines: dict[tuple[int, bytes], Array] = {}

        def line(triad: int, axis: Array) -> Array:
            key = triad, axis.tobytes()
            return lines[key] if key in lines else lines.setdefault(key, axis @ motion[triad])

        found: dict[float, tuple[int, Any]] = {}  # by number, or by the identity of an array, which is kept
        rows = []
        for c in columns:
            if isinstance(c, int):
                rows.append(0)
                continue
            assert c.term.multiplies is not None
            one = c.term.multiplies(line(c.triad, c.own), line(c.triad, c.along), line(1, c.along), warmth, middle)
            rows.append(found.setdefault(one if np.ndim(one) == 0 else id(one), (len(found), one))[0])
        inputs = np.empty((len(found), len(interval)))
        for row, one in found.values():
            np.multiply(one, interval, out=inputs[row])
        return inputs, rows


def noise_inputs(nominal: NominalMotion) -> dict[tuple[int, str], Array]:
    """Return how white noises of unit density drive the navigation errors.

    A quantised sum has an error ε of its own at every sample, which does not accumulate. φ + C ε and δv − C ε are
    continuous and are driven by ε during a rotation and under a specific force; the errors themselves are added to the
    results.

    Args:
        nominal: K rows of motion.

    Returns:
        By triad (0 gyros, 1 accelerometers) and "white" or "quantum": (K, 9, 3).
    """
    count, c = len(nominal.c_nb), nominal.c_nb
    turning = c @ skew(nominal.rate_b)
    found = {key: np.zeros((count, CORE, 3)) for key in ((0, "white"), (1, "white"), (0, "quantum"), (1, "quantum"))}
    found[0, "white"][:, PHI] = -c
    found[1, "white"][:, V] = c
    found[0, "quantum"][:, PHI] = turning
    found[0, "quantum"][:, V] = -skew(nominal.force_n) @ c
    found[1, "quantum"][:, V] = -turning
    found[1, "quantum"][:, R] = c
    return found


def gravity_input(phi: Array, interval: float) -> Array:
    """Return the effect of a unit disturbance of gravity, north, east, down, over a step.

    Args:
        phi: Φ, (n, n).
        interval: s.

    Returns:
        ∫Φ(t) dt of the velocity's columns by the trapezoidal rule, (n, 3).
    """
    return np.asarray(0.5 * interval * (phi + np.eye(len(phi)))[:, V])


_TERMS = 8


def exponential(f: Array, interval: Array) -> Array:
    """Return exp(F T) by its power series.

    Args:
        f: (K, n, n) 1/s, with |F|T well below 1.
        interval: T, (K,) s.

    Returns:
        (K, n, n).
    """
    scaled = f * interval[:, None, None]
    total = np.broadcast_to(np.eye(f.shape[1]), f.shape) + scaled
    term = scaled
    for k in range(2, _TERMS + 1):
        term = term @ scaled / k
        total = total + term
    return np.asarray(total)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def white_covariance(f: Array, inputs: Array, interval: Array) -> Array:
    """Return ∫ Φ(t) G Gᵀ Φ(t)ᵀ dt over steps by Gauss-Legendre quadrature.

    Args:
        f: F, (K, n, n) 1/s.
        inputs: G, (K, n, 3).
        interval: (K,) s.

    Returns:
        (K, n, n).
    """
    total = np.zeros_like(f)
    for node, weight in zip(0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS, strict=True):
        moved = exponential(f, node * interval) @ inputs
        total += weight * interval[:, None, None] * (moved @ moved.transpose(0, 2, 1))
    return total
