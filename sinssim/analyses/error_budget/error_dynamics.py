"""The true motion of a run, and the linear error dynamics along it over steps of time.

Within a step, attitude, velocity and position errors that begin at zero follow

    φ̇ = −C u_gyro,   δv̇ = f × φ + C u_accel,   δṙ = δv                                                 (1)

with the factor u that a constant sensor error multiplies in the readings. They are integrated sample by sample on the
true increments, so that a turn or an acceleration within the step is exact however long the step is. Rotation of the
local level and of the Earth within one step, 1e-4 of the result, is left to the transition between steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.error_budget.error_sources import Column
from sinssim.data import Array, ImuData, NavState
from sinssim.estimation.error_dynamics import NominalMotion, dynamics
from sinssim.estimation.linearisation import motion
from sinssim.estimation.state_model import Block, ErrorModel
from sinssim.jit import inline, strict_kernel
from sinssim.rotation.quaternions import Matrix, Vector, dcm_from_quaternion_k
from sinssim.rotation.vectors import add, along, column, cross, keep_column, mul, resolved
from sinssim.sensors.imu.compensation import MeanGyroRates
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp
from sinssim.sensors.measurement_kind import CORE, PHI, R, V, skew
from sinssim.truth.trajectory import Trajectory

Ints = NDArray[np.int64]


class StepMotion(NamedTuple):
    """The true motion over K steps.

    edges, part: sample that contains each boundary of the steps, and its fraction before the boundary, (K+1,).
    time: edges of the samples, (N+1,) s.
    dvel: true velocity increments, (N, 3) m/s.
    q: true attitude at the edges, (N+1, 4).
    """

    edges: Ints
    part: Array
    time: Array
    dvel: Array
    q: Array


class UnitErrors(NamedTuple):
    """The m constant errors whose effects are integrated.

    columns: triad (0 gyro, 1 accelerometer), series (−1 for none) and row of `inputs` of each, (m, 3).
    directions: in which one without a series adds its input to the increments of its triad, (m, 3).
    inputs: integrals of the inputs over the samples from the first boundary on, (r, n).
    theta, vel: reading errors of each series, (s, N, 3) rad and m/s.
    """

    columns: Ints
    directions: Array
    inputs: Array
    theta: Array
    vel: Array


@inline
def _share(of: StepMotion, k: int, n: int) -> float:
    """The fraction of sample n in step k."""
    share = 1.0
    if n == of.edges[k]:
        share -= of.part[k]
    if n == of.edges[k + 1]:
        share -= 1.0 - of.part[k + 1]
    return share


@inline
def _mean_matrix(q: Array, n: int) -> Matrix:
    """C_nb in the middle of sample n, from the mean of the quaternions at its edges."""
    a, b = (q[n, 0], q[n, 1], q[n, 2], q[n, 3]), (q[n + 1, 0], q[n + 1, 1], q[n + 1, 2], q[n + 1, 3])
    sign = 1.0 if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] > 0.0 else -1.0
    q0, q1, q2, q3 = a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3]
    unit = 1.0 / math.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    return dcm_from_quaternion_k(unit * q0, unit * q1, unit * q2, unit * q3)


@inline
def _reading_errors(errors: UnitErrors, m: int, n: int, first: int, share: float) -> tuple[Vector, Vector]:
    """Errors of gyros and accelerometers by column m in a share of sample n; `first` is the sample of `inputs`."""
    i = errors.columns[m, 1]
    if i >= 0:
        g, a = errors.theta[i, n], errors.vel[i, n]
        return mul(share, (g[0], g[1], g[2])), mul(share, (a[0], a[1], a[2]))
    d = errors.directions[m, 0], errors.directions[m, 1], errors.directions[m, 2]
    u = mul(share * errors.inputs[errors.columns[m, 2], n - first], d)
    return (u, (0.0, 0.0, 0.0)) if errors.columns[m, 0] == 0 else ((0.0, 0.0, 0.0), u)


@strict_kernel
def step_responses(of: StepMotion, errors: UnitErrors, out: Array, means: Array) -> None:
    """Compute the responses over all steps. `out`: position, velocity, attitude at the end of each step, (K, 9, m),
    written; `means`: mean of u over each step in body axes, gyros first, (K, 6, m), written."""
    out[:, :, :], means[:, :, :] = 0.0, 0.0
    for k in range(len(of.edges) - 1):
        length, x, u = 0.0, out[k], means[k]
        for n in range(of.edges[k], min(of.edges[k + 1] + 1, len(of.dvel))):
            share = _share(of, k, n)
            if share <= 0.0:
                continue
            t = share * (of.time[n + 1] - of.time[n])
            length += t
            c = _mean_matrix(of.q, n)
            f = resolved(c, mul(share, (of.dvel[n, 0], of.dvel[n, 1], of.dvel[n, 2])))
            for m in range(len(errors.columns)):
                gyro, accel = _reading_errors(errors, m, n, of.edges[0], share)
                keep_column(u, 0, m, add(column(u, 0, m), gyro))
                keep_column(u, 3, m, add(column(u, 3, m), accel))
                phi, v, turn = column(x, 6, m), column(x, 3, m), mul(-1.0, resolved(c, gyro))
                push = add(cross(f, along(phi, 0.5, turn)), resolved(c, accel))  # (1)
                keep_column(x, 0, m, along(column(x, 0, m), t, along(v, 0.5, push)))
                keep_column(x, 3, m, add(v, push))
                keep_column(x, 6, m, add(phi, turn))
        if length > 0.0:
            for row in range(6):
                for m in range(len(errors.columns)):
                    u[row, m] /= length


NAVIGATION_MODEL = ErrorModel((Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1.0)), 1.0, 1.0)
"""The error model of the nine navigation errors alone."""


@dataclass(frozen=True)
class Responses:
    """Effects of unit constant errors over K steps."""

    core: Array  # navigation errors at the end of a step by the error in it, (K, 9, m)
    mean: Array  # mean of the reading errors over the step, gyros first, (K, 6, m)


@dataclass(frozen=True)
class TrueMotion:
    """The true motion of a run's sensor block."""

    trajectory: Trajectory  # the continuous motion
    ideal: ImuData  # true increments
    state: NavState  # true states at the edges of the samples
    warm_up: WarmUp  # temperature of the block
    gravity: str  # name of the engine's gravity model

    @cached_property
    def rates(self) -> MeanGyroRates:
        """Source of mean rates."""
        return MeanGyroRates(self.ideal)

    @cached_property
    def _warmth(self) -> Array:
        time = self.ideal.time
        return self.warm_up.temperature(0.5 * (time[1:] + time[:-1]) - time[0])

    def distance(self, time: Array) -> Array:
        """Return the horizontal distances travelled between K+1 instants, (K,) m."""
        return np.asarray(np.diff(np.interp(time, self.ideal.time, self._travelled)))

    @cached_property
    def _travelled(self) -> Array:
        speed = np.hypot(self.state.velocity_ned[:, 0], self.state.velocity_ned[:, 1])
        passed = 0.5 * (speed[1:] + speed[:-1]) * np.diff(self.ideal.time)
        return np.concatenate([[0.0], np.cumsum(passed)])

    def nominal(self, time: Array) -> NominalMotion:
        """Return the mean motion between K+1 increasing instants, K rows."""
        interval = np.diff(time)
        state, middle = self.trajectory.state(time), self.trajectory.state(0.5 * (time[1:] + time[:-1]))
        rate = self.rates.mean(time[:-1], time[1:], ImuErrors())
        return motion(state, middle, interval, rate, self.gravity, self.trajectory.ellipsoid)

    def dynamics(self, nominal: NominalMotion) -> Array:
        """Return F of the navigation errors, (K, 9, 9)."""
        return dynamics(NAVIGATION_MODEL, nominal, self.gravity, self.trajectory.ellipsoid)

    def responses(self, time: Array, columns: Sequence[Column | int], theta: Array, vel: Array) -> Responses:
        """Return the effects of constant errors, or by number of given ones, over the steps between K+1 instants.

        The given reading errors `theta` and `vel` are (s, N, 3) rad and m/s.
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
        motion = StepMotion(
            sample, part, edges, np.ascontiguousarray(self.ideal.dvel), np.ascontiguousarray(self.state.q_nb)
        )
        numbered = np.array(codes, dtype=np.int64).reshape(-1, 3)
        step_responses(motion, UnitErrors(numbered, directions.reshape(-1, 3), inputs, theta, vel), out, mean)
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

        factors: dict[float, tuple[int, Any]] = {}  # by number, or by the identity of an array, which is kept
        rows = []
        for c in columns:
            if isinstance(c, int):
                rows.append(0)
                continue
            assert c.term.multiplies is not None
            factor = c.term.multiplies(
                line(c.triad, c.sensitive), line(c.triad, c.along), line(1, c.along), warmth, middle
            )
            rows.append(factors.setdefault(factor if np.ndim(factor) == 0 else id(factor), (len(factors), factor))[0])
        inputs = np.empty((len(factors), len(interval)))
        for row, factor in factors.values():
            np.multiply(factor, interval, out=inputs[row])
        return inputs, rows


def noise_inputs(nominal: NominalMotion) -> dict[tuple[int, str], Array]:
    """Return how white noises of unit density drive the navigation errors, (K, 9, 3) each.

    The keys are the triad (0 gyros, 1 accelerometers) and "white" or "quantum". A quantised sum has an error ε of its
    own at every sample, which does not accumulate. φ + C ε and δv − C ε are continuous and are driven by ε during a
    rotation and under a specific force; the errors themselves are added to the results.
    """
    count, c = len(nominal.c_nb), nominal.c_nb
    turning = c @ skew(nominal.rate_b)
    inputs = {key: np.zeros((count, CORE, 3)) for key in ((0, "white"), (1, "white"), (0, "quantum"), (1, "quantum"))}
    inputs[0, "white"][:, PHI] = -c
    inputs[1, "white"][:, V] = c
    inputs[0, "quantum"][:, PHI] = turning
    inputs[0, "quantum"][:, V] = -skew(nominal.force_n) @ c
    inputs[1, "quantum"][:, V] = -turning
    inputs[1, "quantum"][:, R] = c
    return inputs


def gravity_input(phi: Array, interval: float) -> Array:
    """Return the effect of a unit disturbance of gravity, north, east, down, over a step with Φ, (n, 3).

    It is ∫Φ(t) dt of the velocity's columns by the trapezoidal rule.
    """
    return np.asarray(0.5 * interval * (phi + np.eye(len(phi)))[:, V])


_TERMS = 8


def exponential(f: Array, interval: Array) -> Array:
    """Return exp(F T) by its power series, (K, n, n), for F in 1/s and T in s with |F|T well below 1."""
    scaled = f * interval[:, None, None]
    total = np.broadcast_to(np.eye(f.shape[1]), f.shape) + scaled
    term = scaled
    for k in range(2, _TERMS + 1):
        term = term @ scaled / k
        total = total + term
    return np.asarray(total)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def white_covariance(f: Array, inputs: Array, interval: Array) -> Array:
    """Return ∫ Φ(t) G Gᵀ Φ(t)ᵀ dt over steps, (K, n, n), by Gauss-Legendre quadrature; G, (K, n, 3), are `inputs`."""
    total = np.zeros_like(f)
    for node, weight in zip(0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS, strict=True):
        moved = exponential(f, node * interval) @ inputs
        total += weight * interval[:, None, None] * (moved @ moved.transpose(0, 2, 1))
    return total
