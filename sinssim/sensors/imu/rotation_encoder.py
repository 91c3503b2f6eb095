"""The encoders of a rotating IMU: the angles that are read, and attitudes turned in and out by them.

A reading of the angle α is

    (1) α̃ = Q round((α + b + A sin(mα + χ) + n) / Q)

with the bias b, the amplitude A and the m cycles of the periodic error, the noise n and the smallest step Q. The
navigator takes the attitude of the block in the vehicle from the readings, q̃_vb, and turns its own attitude out,
q_nv = q_nb ∘ q̃_vb*. The wobble of the axis is not in the readings.

The true attitude of the block enters the initial state: an alignment gives the attitude of the block, whatever the
encoders say. Their errors therefore appear in the vehicle's attitude from the start, and in nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.sensors.imu.imu_section import Imu
from sinssim.statistics.random_numbers import normals
from sinssim.truth.motions.imu_rotation import PART, Turning, TurningBlock
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC, DEG

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_GAUSS = tuple(zip((0.5 * (_NODES + 1.0)).tolist(), (0.5 * _WEIGHTS).tolist(), strict=True))
"""Nodes and weights of the quadrature over an interval of length 1."""


@dataclass(frozen=True)
class EncoderErrors:
    """The errors of the two encoders in one run."""

    bias: Array = field(default_factory=lambda: np.zeros(2))  # b of the outer and the inner encoder, (2,) rad
    periodic: float = 0.0  # A, rad
    cycles: int = 1  # m
    phase: float = 0.0  # χ, rad
    noise: float = 0.0  # 1σ of n, rad
    quantum: float = 0.0  # Q, rad; 0 for none
    seed: int = 0  # the run's seed


def draw_encoders(imu: Imu, seed: int) -> EncoderErrors | None:
    """Return the errors of one run's encoders, SI, given values plus random ones; None without [imu.rotation]."""
    imu_rotation = imu.rotation
    if imu_rotation is None:
        return None
    drawn = np.array([normals(seed, "encoder", axis, 1)[0] for axis in range(2)])
    bias = np.array(imu_rotation.encoder_bias_arcsec or (0.0, 0.0)) + imu_rotation.encoder_bias_sigma_arcsec * drawn
    return EncoderErrors(
        bias * ARCSEC,
        imu_rotation.encoder_periodic_arcsec * ARCSEC,
        imu_rotation.encoder_cycles,
        imu_rotation.encoder_phase_deg * DEG,
        imu_rotation.encoder_noise_arcsec * ARCSEC,
        imu_rotation.encoder_quantum_arcsec * ARCSEC,
        seed,
    )


def read_angles(turns: Turning, errors: EncoderErrors, edges: Array, t: Array) -> Array:
    """Return the readings of the encoders (1): angles of the outer and the inner axis at instants, (K, 2) rad. Each
    edge of the samples, (N+1,) s, has a noise of its own, and an instant between two edges that of the nearest."""
    true = turns.angles(t)
    read = true + errors.bias
    if errors.periodic:
        read += errors.periodic * np.sin(errors.cycles * true + errors.phase)
    if errors.noise:
        step = (edges[-1] - edges[0]) / (len(edges) - 1)
        nearest = np.clip(np.rint((t - edges[0]) / step).astype(np.intp), 0, len(edges) - 1)
        for axis in range(2):
            read[:, axis] += errors.noise * normals(errors.seed, "encoder noise", axis, len(edges))[nearest]
    if errors.quantum:
        read = errors.quantum * np.rint(read / errors.quantum)
    if not turns.two_axes:  # there is no second encoder
        read[:, 1] = true[:, 1]
    return read


@dataclass(frozen=True)
class Encoders:
    """The encoders of a rotating IMU in one run."""

    turns: Turning  # the true rotation
    errors: EncoderErrors  # their errors
    edges: Array  # edges of the samples, (N+1,) s

    def attitude(self, t: Array) -> Array:
        """Return the block's attitude in the vehicle as it is read at instants, (K,) s: q̃_vb, (K, 4)."""
        return self.turns.without_wobble(self.angles(t))

    def angles(self, t: Array) -> Array:
        """Return the readings, (K, 2) rad, at instants (K,) s."""
        return read_angles(self.turns, self.errors, self.edges, t)

    def mean_rate(self, t: Array) -> Array:
        """Return the mean rate of the block in the vehicle over two samples around instants, (K,) s, as gyros are
        averaged: ω_vb in the block's axes as it is commanded, (K, 3) rad/s."""
        interval = (self.edges[-1] - self.edges[0]) / (len(self.edges) - 1)
        t = np.clip(t, self.edges[0], self.edges[-1])
        begin = np.maximum(t - interval, self.edges[0])
        length = np.minimum(t + interval, self.edges[-1]) - begin
        rates = [weight * self.turns.rate(begin + node * length) for node, weight in _GAUSS]
        return np.asarray(sum(rates))

    def turned_out(self, solution: NavSolution) -> NavSolution:
        """Return the solution of the block with the vehicle's attitude: the same with the vehicle's attitude.
        `solution`: with the block's attitude, K rows."""
        angles, q_nv = self.angles(solution.time), np.empty_like(solution.q_nb)
        for first in range(0, len(q_nv), PART):
            part = slice(first, first + PART)
            q_bv = rotation.conjugate(self.turns.without_wobble(angles[part]))
            q_nv[part] = rotation.multiply(solution.q_nb[part], q_bv)
        return replace(solution, q_nb=q_nv)


def encoders_of(block: Trajectory, errors: EncoderErrors | None, edges: Array) -> Encoders | None:
    """Return the encoders of a block, of which `block_of` gives the motion that its sensors feel, with their errors in
    this run, by default none, and samples of the edges, (N+1,) s; None for a block that does not turn."""
    return Encoders(block.turns, errors or EncoderErrors(), edges) if isinstance(block, TurningBlock) else None


def turned_in(state: NavState, block: Trajectory, t: float) -> NavState:
    """Return the state of a rotating IMU, with its attitude, from that of its vehicle at an instant, s, possibly with
    errors, by the true angles; the same state for a block that does not turn."""
    if not isinstance(block, TurningBlock):
        return state
    return replace(state, q_nb=rotation.multiply(state.q_nb, block.turns.attitude(np.array([t]))[0]))
