"""The systematic method: errors of navigation during a sequence, without a precise table.

The block navigates through the sequence on its compensated readings. In the dwells its velocity is zero, and the
computed one shows the tilt that errors of the gyros have accumulated in the turns, and the errors of the accelerometers
(Camberlein and Mazzanti, Calibration technique for laser gyro strapdown inertial navigation systems, Symposium Gyro
Technology, Stuttgart, 1985; Grewal, Henderson and Miyasako, Application of Kalman filtering to the calibration and
alignment of inertial navigation systems, IEEE Trans. Automatic Control 36 (1991) 4-13). The parameters are estimated by
least squares from all innovations of the filter, the readings are compensated with the estimate, and the sequence is
navigated again until the estimate stands still. The attitude in the first position is an unknown too, with the nominal
one of the sequence as prior knowledge.

The filter's states are the attitude error φ (C_true = (I + [φ×]) C), the velocity error δv and the instabilities of
gyros and accelerometers b. The parameters d have no states. Their effect U on the states is carried along (Friedland,
Treatment of bias in recursive filtering, IEEE Trans. Automatic Control 14 (1969) 359-367), so that the innovations ν
are U_v d + white noise of known covariance, and the result is that of a Kalman filter with all states.

    φ̇ = −ω_ie × φ − C δω      δv̇ = φ × f − 2 ω_ie × δv − C δf      δω, δf: errors of the compensated readings
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.analyses.calibration_problem import Estimate, Task, nuisances, solve
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, RunError
from sinssim.jit import inline, kernel
from sinssim.rotation.quaternions import (
    Matrix,
    Quaternion,
    Vector,
    dcm_from_quaternion_k,
    multiply_k,
    quaternion_from_rotation_vector_k,
    rotate_k,
)
from sinssim.rotation.vectors import add, along, column, cross, keep_column, mul, resolved
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.units import DEG, DEG_H

BIAS, SCALE, TILT, ARM = range(4)
STATES = 12  # attitude, velocity, instabilities of gyros and accelerometers
Codes = NDArray[np.int64]


class Sequence(NamedTuple):
    """Compensated readings of a sequence, and the steps of the filter.

    time: edges, (N+1,) s.
    dtheta, dvel: increments, (N, 3) rad and m/s.
    arm_pull: what a metre in each coordinate of each accelerometer's place adds to its increment, (N, 3, 3) 1/s; empty
        without places.
    ends, observed: first sample after each step, and whether the velocity is observed at its end, (K,).
    """

    time: Array
    dtheta: Array
    dvel: Array
    arm_pull: Array
    ends: Codes
    observed: NDArray[np.bool_]


class Assumed(NamedTuple):
    """What the filter assumes.

    codes: kind, triad, row and column of each parameter, (p, 4).
    earth, gravity: the Earth's rate, rad/s, and gravity, m/s², north-east-down.
    walk, instability, correlation_time: of gyros and accelerometers, SI.
    velocity_variance: of an observation, m²/s².
    """

    codes: Codes
    earth: Vector
    gravity: Vector
    walk: tuple[float, float]
    instability: tuple[float, float]
    correlation_time: tuple[float, float]
    velocity_variance: float


class Nominal(NamedTuple):
    """The navigated state: q_nb, velocity, m/s, and the instabilities, rad/s and m/s²."""

    q: Quaternion
    v: Vector
    gyro: Vector
    accel: Vector


@inline
def _navigated(of: Assumed, data: Sequence, k: int, x: Nominal) -> tuple[Nominal, Matrix, Vector]:
    """Navigate over an interval; return also C in its middle and the velocity increment in navigation axes."""
    dt = data.time[k + 1] - data.time[k]
    turn = along((data.dtheta[k, 0], data.dtheta[k, 1], data.dtheta[k, 2]), -dt, x.gyro)
    push = along((data.dvel[k, 0], data.dvel[k, 1], data.dvel[k, 2]), -dt, x.accel)
    # rotation φ during the interval, relative to the Earth. A force that is constant in space gives Δv = Γ f T,
    # Γ⁻¹ = I + ½[φ×] + 1/12 [φ×]² at a constant rate; at a rate that grows by ω̇, the mean angle is ½φ − ω̇T²/12
    phi = along(turn, -dt, rotate_k(x.q[0], -x.q[1], -x.q[2], -x.q[3], *of.earth))
    mean_phi = phi
    if 0 < k < data.dtheta.shape[0] - 1:
        before, after = data.dtheta[k - 1], data.dtheta[k + 1]
        mean_phi = along(phi, -1.0 / 12.0, (after[0] - before[0], after[1] - before[1], after[2] - before[2]))
    bend = cross(mean_phi, push)
    f = rotate_k(*x.q, *along(along(push, 0.5, bend), 1.0 / 12.0, cross(phi, bend)))
    v = along(add(x.v, f), dt, along(of.gravity, -2.0, cross(of.earth, x.v)))  # g − 2 ω_ie × v
    earth, half = quaternion_from_rotation_vector_k(*mul(-0.5 * dt, of.earth)), mul(0.5, turn)
    q = multiply_k(*multiply_k(*earth, *x.q), *quaternion_from_rotation_vector_k(*half))
    c = dcm_from_quaternion_k(*q)
    q = multiply_k(*earth, *multiply_k(*q, *quaternion_from_rotation_vector_k(*half)))
    return Nominal(q, v, x.gyro, x.accel), c, f


@inline
def _axis(c: Matrix, i: int) -> Vector:
    """A body axis in navigation axes."""
    return c[i], c[3 + i], c[6 + i]


@inline
def _effects(of: Assumed, data: Sequence, k: int, c: Matrix, u: Array, of_triad: int) -> None:
    """Add −½ C δω T of the gyros' parameters to the attitude, half before and half after its effect on the velocity, or
    −C δf T of the accelerometers' parameters to the velocity."""
    dt = data.time[k + 1] - data.time[k]
    for n in range(of.codes.shape[0]):
        kind, triad, i, j = of.codes[n, 0], of.codes[n, 1], of.codes[n, 2], of.codes[n, 3]
        if triad == of_triad:
            reading = dt if kind == BIAS else data.arm_pull[k, i, j] if kind == ARM else data.dvel[k, j]
            if triad == 0:
                reading = 0.5 * (dt if kind == BIAS else data.dtheta[k, j])
            keep_column(u, 3 * triad, n, along(column(u, 3 * triad, n), -reading, _axis(c, i)))


@inline
def _carry(of: Assumed, dt: float, c: Matrix, f: Vector, u: Array) -> None:
    """Carry the effects over an interval, by the equations of φ and δv."""
    unstable = of.instability[0] > 0.0 or of.instability[1] > 0.0
    for n in range(u.shape[1]):
        phi, v = column(u, 0, n), column(u, 3, n)
        if unstable:
            phi, v = (
                along(phi, -dt, resolved(c, column(u, 6, n))),
                along(v, -dt, resolved(c, column(u, 9, n))),
            )
        keep_column(u, 3, n, along(add(v, cross(phi, f)), -2.0 * dt, cross(of.earth, v)))
        keep_column(u, 0, n, along(phi, -dt, cross(of.earth, phi)))


@kernel
def _navigate_step(
    of: Assumed, data: Sequence, first: int, end: int, x: Nominal, u: Array, turned: Array
) -> tuple[Nominal, Vector]:
    """Navigate over a step and carry the effects along; write ∫C dt and return ∫C f dt."""
    turned[:, :] = 0.0
    force = (0.0, 0.0, 0.0)
    for k in range(first, end):
        dt = data.time[k + 1] - data.time[k]
        x, c, f = _navigated(of, data, k, x)
        for i in range(3):
            for j in range(3):
                turned[i, j] += dt * c[3 * i + j]
        force = add(force, f)
        _effects(of, data, k, c, u, 0)
        _effects(of, data, k, c, u, 1)
        _carry(of, dt, c, f, u)
        _effects(of, data, k, c, u, 0)
    return x, force


@kernel
def _observe(of: Assumed, x: Nominal, u: Array, cov: Array, white: Array, design: Array) -> Nominal:
    """Update by a velocity of zero, one component after the other: their noise is independent.

    `white` and `design` are the three rows of the whitened innovations and of their derivatives, written.
    """
    for i in range(3):
        variance = cov[3 + i, 3 + i] + of.velocity_variance
        innovation = -x.v[i]
        effect, gain = u[3 + i].copy(), cov[3 + i] / variance
        white[i], design[i] = innovation / math.sqrt(variance), effect / math.sqrt(variance)
        step = gain * innovation
        q = multiply_k(*quaternion_from_rotation_vector_k(step[0], step[1], step[2]), *x.q)  # C ← e^[φ×] C
        x = Nominal(
            q, add(x.v, (step[3], step[4], step[5])), add(x.gyro, (step[6], step[7], step[8])),
            add(x.accel, (step[9], step[10], step[11])),
        )  # fmt: skip
        u -= np.outer(gain, effect)
        cov -= variance * np.outer(gain, gain)
    return x


@kernel
def run_filter(of: Assumed, data: Sequence, q: Quaternion, white: Array, design: Array, attitude: Array) -> None:
    """Navigate and filter a sequence from the attitude q_nb; write the whitened innovations (3M,), their derivatives to
    the parameters and to the attitude at the start (3M, p + 3), and the attitude after each step (K, 4)."""
    p = of.codes.shape[0]
    u, cov, turned = np.zeros((STATES, p + 3)), np.zeros((STATES, STATES)), np.empty((3, 3))
    for i in range(3):
        u[i, p + i] = 1.0
        cov[3 + i, 3 + i] = of.velocity_variance
        cov[6 + i, 6 + i], cov[9 + i, 9 + i] = of.instability[0] ** 2, of.instability[1] ** 2
    x = Nominal(q, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    first, row = 0, 0
    for step in range(len(data.ends)):
        end = data.ends[step]
        x, force = _navigate_step(of, data, first, end, x, u, turned)
        passage = _transition(of, turned, force, data.time[end] - data.time[first])
        u[6:] *= np.diag(passage)[6:].reshape(6, 1)
        x = Nominal(x.q, x.v, mul(passage[6, 6], x.gyro), mul(passage[9, 9], x.accel))
        cov[:, :] = passage @ cov @ passage.T
        _add_noise(of, cov, force, data.time[end] - data.time[first])
        if data.observed[step]:
            x = _observe(of, x, u, cov, white[row : row + 3], design[row : row + 3])
            row += 3
        first = end
        attitude[step, 0], attitude[step, 1], attitude[step, 2], attitude[step, 3] = x.q


@kernel
def _skew(a: Vector) -> Array:
    """[a×]."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


@kernel
def _transition(of: Assumed, turned: Array, force: Vector, length: float) -> Array:
    """Return the transition of the states over a step, from ∫C dt and ∫C f dt."""
    out = np.eye(STATES)
    earth, pull = length * _skew(of.earth), _skew(force)
    out[0:3, 0:3] -= earth
    out[3:6, 3:6] -= 2.0 * earth
    out[3:6, 0:3] = -pull  # φ × f = −[f×] φ
    out[0:3, 6:9] = -turned
    out[3:6, 6:9] = 0.5 * (pull @ turned)
    out[3:6, 9:12] = -turned
    for i in range(3):
        out[6 + i, 6 + i] = math.exp(-length / of.correlation_time[0])
        out[9 + i, 9 + i] = math.exp(-length / of.correlation_time[1])
    return out


@kernel
def _add_noise(of: Assumed, cov: Array, force: Vector, length: float) -> None:
    """Add the noise of a step: random walks with their effect on the velocity, and the instabilities' own."""
    angle, speed = of.walk[0] ** 2 * length, of.walk[1] ** 2 * length
    pull = _skew(force)  # m/s over the step
    cov[3:6, 3:6] += angle / 3.0 * (pull @ pull.T)
    half = 0.5 * angle * pull  # ½ N² T (−[f×]): velocity against attitude
    cov[3:6, 0:3] -= half
    cov[0:3, 3:6] -= half.T
    for i in range(3):
        cov[i, i] += angle
        cov[3 + i, 3 + i] += speed
        for at, n in ((6 + i, 0), (9 + i, 1)):
            lost = 1.0 - math.exp(-2.0 * length / of.correlation_time[n])
            cov[at, at] += of.instability[n] ** 2 * lost


Rows = NDArray[np.int64]
Mask = NDArray[np.bool_]

_MOST = 15
_STANDS = 1e-2
"""Change of an estimate, in its 1σ, at which it stands still."""
_ENOUGH = 1e-5
"""The same in sizes of the parameters, for sensors without noise."""
_TURN_STEP = 1.0
"""Longest step of the filter, s."""
_COARSE_BIAS = 1.0 * DEG_H
"""Size of the gyros' biases from which they are first taken from the mean of the dwells."""


def in_accelerometer_frame(errors: ImuErrors) -> tuple[ImuErrors, Array]:
    """Return the errors of a block in the frame of its accelerometers, and C, v_accelerometers = C v_block, (3, 3).

    In this frame the misalignments xy, xz and yz of the accelerometers are zero.
    """
    axes = np.eye(3) + errors.accel.misalignment
    if not np.linalg.det(axes) > 0.0:
        raise InputError("the sensitive axes of the accelerometers must span space.")
    # rows of C by Gram and Schmidt: x along the first sensitive axis, y in the plane of the first two
    q, r = np.linalg.qr(axes.T)
    turn = (q * np.sign(np.diag(r))).T

    def triad(errors_: TriadErrors) -> TriadErrors:
        whole = (1.0 + errors_.scale)[:, None] * (np.eye(3) + errors_.misalignment) @ turn.T
        scale = np.diag(whole)
        tilt = whole / scale[:, None]
        tilt[np.eye(3, dtype=bool)] = 0.0
        return replace(errors_, scale=scale - 1.0, misalignment=tilt)

    accel = triad(errors.accel)
    accel.misalignment[np.triu_indices(3)] = 0.0  # zero but for rounding
    return replace(errors, gyro=triad(errors.gyro), accel=accel, arms=errors.arms @ turn.T), turn


def systematic(task: Task) -> Estimate:
    """Estimate the parameters of a block from its navigation errors."""
    ends, observed = steps(task)
    values, prior_sigma = _coarse(task), np.full(3, task.section.attitude_sigma_deg * DEG)
    q = _levelled(task, task.compensated(values))
    q_first = q.copy()
    final = False
    for number in range(1, _MOST + 1):
        white, design, _ = linearise(task, task.compensated(values), q, ends, observed)
        b = design[:, len(task.known) :] * prior_sigma
        turned = rotation.rotation_vector_from_quaternion(rotation.multiply(q, rotation.conjugate(q_first)))
        prior = -turned / prior_sigma
        solution = solve(white, design[:, : len(task.known)], b, prior, task.size, values, final)
        rest = white - design[:, : len(task.known)] @ solution.correction
        step = nuisances(rest, b, prior)
        values = values + solution.correction
        q = rotation.multiply(rotation.quaternion_from_rotation_vector(prior_sigma * step), q)
        if final:
            left = rest - b @ step
            return Estimate(values, solution, number, np.empty((0, 3)), left.reshape(-1, 3), left)
        sigma = np.sqrt(np.diag(solution.covariance))
        final = bool(np.all(np.abs(solution.correction) <= np.maximum(_STANDS * sigma, _ENOUGH * task.size)))
    raise RunError(
        f"the estimate of the systematic method still changes after {_MOST} iterations: the data do not fit the "
        f"sequence of [turntable], or the sensor errors are too large for this method; try the separate method."
    )


def steps(task: Task) -> tuple[Rows, Mask]:
    """Return the first sample after each step of the filter, (K,), and whether the block stands during it, (K,)."""
    time = task.imu.time
    ends: list[Rows] = []
    observed: list[Mask] = []
    spans = np.concatenate([task.dwells.rows, task.dwells.turns])
    standing = np.arange(len(spans)) < len(task.dwells.rows)
    for k in np.argsort(spans[:, 0], kind="stable"):
        first, last = (int(row) for row in spans[k])
        if last <= first:
            continue
        longest = task.section.interval_s if standing[k] else _TURN_STEP
        count = max(round(float(time[last] - time[first]) / longest), 1)
        edges: Rows = np.unique(np.linspace(first, last, count + 1).round().astype(np.int64))[1:]
        ends.append(edges)
        observed.append(np.full(len(edges), standing[k]))
    return np.concatenate(ends), np.concatenate(observed)


def linearise(task: Task, imu: ImuData, q: Array, ends: Rows, observed: Mask) -> tuple[Array, Array, Array]:
    """Return the whitened innovations, (3M,), and their derivatives to the parameters and to the attitude q at the
    start.

    The derivatives are (3M, p + 3); the attitude after each step follows, (K, 4).
    """
    first = int(task.dwells.rows[0, 0])
    codes = np.array([[_kind(p.field), int(p.triad == "accel"), p.row, p.column] for p in task.known])
    arms = any(parameter.field == "arm" for parameter in task.known)
    variance = (task.section.velocity_sigma_mm_s * 1e-3) ** 2 + task.accel.quantum**2 / 12.0
    size = 3 * int(np.count_nonzero(observed))
    white, design = np.empty(size), np.empty((size, len(codes) + 3))
    attitude = np.empty((len(ends), 4))
    gyro, accel = task.gyro, task.accel
    of = Assumed(
        codes, _vector(task.earth_rate), _vector(-task.force), (gyro.white, accel.white),
        (gyro.instability, accel.instability), (gyro.correlation_time, accel.correlation_time), variance,
    )  # fmt: skip
    time, dtheta, dvel = (np.ascontiguousarray(rows[first:]) for rows in (imu.time, imu.dtheta, imu.dvel))
    pull = arm_pull(imu)[first:] if arms else np.empty((0, 3, 3))
    start = float(q[0]), float(q[1]), float(q[2]), float(q[3])
    run_filter(of, Sequence(time, dtheta, dvel, pull, ends - first, observed), start, white, design, attitude)
    return white, design, attitude


def _vector(a: Array) -> Vector:
    return float(a[0]), float(a[1]), float(a[2])


def _kind(field: str) -> int:
    return {"bias": BIAS, "scale": SCALE, "misalignment": TILT, "arm": ARM}[field]


def arm_pull(imu: ImuData) -> Array:
    """Return what the places of the accelerometers add to their increments.

    It is the derivative of the increment of accelerometer i to coordinate j of its place, [Δω × e_j + T ω × (ω ×
    e_j)]_i, (N, 3, 3) 1/s.
    """
    interval = np.diff(imu.time)
    rate = imu.dtheta / interval[:, None]
    edges = np.concatenate([rate[:1], 0.5 * (rate[1:] + rate[:-1]), rate[-1:]])
    turning = np.diff(edges, axis=0)
    derivative = np.empty((len(rate), 3, 3))
    for j, unit in enumerate(np.eye(3)):
        derivative[:, :, j] = np.cross(turning, unit) + interval[:, None] * np.cross(rate, np.cross(rate, unit))
    return derivative


def _coarse(task: Task) -> Array:
    """Return first values of the parameters: large biases of gyros from the mean of the dwells."""
    values = np.zeros(len(task.known))
    if (
        max(parameter.size for parameter in task.known if parameter.triad == "gyro" and parameter.field == "bias")
        < _COARSE_BIAS
    ):
        return values
    rate = np.array([task.imu.dtheta[a:b].sum(axis=0) for a, b in task.dwells.rows])
    rate = rate / np.diff(task.dwells.seconds(task.imu.time), axis=1)
    earth = rotation.rotate(rotation.conjugate(task.attitude), task.earth_rate)
    mean = np.mean(rate - earth, axis=0)
    for k, parameter in enumerate(task.known):
        if parameter.triad == "gyro" and parameter.field == "bias":
            values[k] = mean[parameter.row]
    return values


def _levelled(task: Task, imu: ImuData) -> Array:
    """Return the nominal attitude of the first position, turned so that gravity is where the accelerometers feel it."""
    first, last = task.dwells.rows[0]
    felt = imu.dvel[first:last].sum(axis=0)
    measured = rotation.rotate(task.attitude[0], felt / np.linalg.norm(felt))
    true = task.force / np.linalg.norm(task.force)
    axis = np.cross(measured, true)
    size = float(np.linalg.norm(axis))
    angle = float(np.arctan2(size, measured @ true))
    turn = axis / size * angle if size > 0.0 else np.zeros(3)
    return rotation.multiply(rotation.quaternion_from_rotation_vector(turn), task.attitude[0])
