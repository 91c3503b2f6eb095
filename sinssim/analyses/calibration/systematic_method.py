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

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.analyses.calibration.least_squares import Solution, nuisances, solve
from sinssim.analyses.calibration.separate_method import _matrix
from sinssim.analyses.calibration.turntable_data import Estimate, Task
from sinssim.data import Array, ImuData
from sinssim.errors import RunError
from sinssim.jit import kernel
from sinssim.rotation.quaternions import multiply_k
from sinssim.units import DEG, DEG_H

# Longer than others, as a kernel: one loop over the samples of a sequence.


BIAS, SCALE, TILT, ARM = range(4)
STATES = 12  # attitude, velocity, instabilities of gyros and accelerometers
Codes = NDArray[np.int64]


@kernel
def _spin(x: float, y: float, z: float, q: Array) -> None:
    """Turn a quaternion by a rotation vector in the block's axes."""
    size = math.sqrt(x * x + y * y + z * z)
    s = math.sin(0.5 * size) / size if size > 1e-12 else 0.5
    q[0], q[1], q[2], q[3] = multiply_k(q[0], q[1], q[2], q[3], math.cos(0.5 * size), s * x, s * y, s * z)


@kernel
def _correct(q: Array, x: float, y: float, z: float) -> None:
    """Apply an attitude error in the navigation axes: C ← e^[φ×] C."""
    size = math.sqrt(x * x + y * y + z * z)
    s = math.sin(0.5 * size) / size if size > 1e-12 else 0.5
    q[0], q[1], q[2], q[3] = multiply_k(math.cos(0.5 * size), s * x, s * y, s * z, q[0], q[1], q[2], q[3])


@kernel
def _propagate(passage: Array, cov: Array, work: Array) -> None:
    """Replace a covariance by A P Aᵀ."""
    for i in range(STATES):
        for j in range(STATES):
            total = 0.0
            for k in range(STATES):
                total += passage[i, k] * cov[k, j]
            work[i, j] = total
    for i in range(STATES):
        for j in range(STATES):
            total = 0.0
            for k in range(STATES):
                total += work[i, k] * passage[j, k]
            cov[i, j] = total


@kernel
def run_filter(
    time: Array,
    dtheta: Array,
    dvel: Array,
    arm_pull: Array,
    ends: Codes,
    observed: NDArray[np.bool_],
    codes: Codes,
    q: Array,
    earth: Array,
    gravity: Array,
    noise: Array,
    velocity_variance: float,
    white: Array,
    design: Array,
    attitude: Array,
) -> None:
    """Navigate and filter a sequence.

    Args:
        time: edges, (N+1,) s.
        dtheta, dvel: compensated increments, (N, 3) rad and m/s.
        arm_pull: what a metre in each coordinate of each accelerometer's place adds to its increment, (N, 3, 3) 1/s;
            (0, 3, 3) without places.
        ends: first sample after each step, (K,).
        observed: whether the velocity is observed at the end of a step, (K,).
        codes: kind, triad, row and column of each parameter, (p, 4).
        q: attitude at the start, q_nb, (4,); changed.
        earth, gravity: the Earth's rate, rad/s, and gravity, m/s², north-east-down, (3,).
        noise: random walks of gyros and accelerometers, their instabilities and correlation times, (6,) SI.
        white: whitened innovations, (3M,), written.
        design: their derivatives to the parameters and to the attitude at the start, (3M, p + 3), written.
        attitude: attitude after each step, (K, 4), written.
    """
    count, p = len(ends), len(codes)
    m = p + 3
    u = np.zeros((STATES, m))
    for i in range(3):
        u[i, p + i] = 1.0
    cov = np.zeros((STATES, STATES))
    for i in range(3):
        cov[3 + i, 3 + i] = velocity_variance
        cov[6 + i, 6 + i], cov[9 + i, 9 + i] = noise[2] ** 2, noise[3] ** 2
    v, wander = np.zeros(3), np.zeros(6)
    c, turned, force = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    passage, work = np.empty((STATES, STATES)), np.empty((STATES, STATES))
    gain, own = np.empty(STATES), np.empty(m)
    wanders = noise[2] > 0.0 or noise[3] > 0.0
    first, row = 0, 0
    for step in range(count):
        turned[:, :] = 0.0
        force[:] = 0.0
        for k in range(first, ends[step]):
            interval = time[k + 1] - time[k]
            _matrix(q[0], q[1], q[2], q[3], c)
            x = dtheta[k, 0] - interval * wander[0]
            y = dtheta[k, 1] - interval * wander[1]
            z = dtheta[k, 2] - interval * wander[2]
            a0 = dvel[k, 0] - interval * wander[3]
            a1 = dvel[k, 1] - interval * wander[4]
            a2 = dvel[k, 2] - interval * wander[5]
            # rotation φ during the interval, relative to the Earth. A force that is constant in space gives Δv = Γ f T,
            # Γ⁻¹ = I + ½[φ×] + 1/12 [φ×]² at a constant rate; at a rate that grows by ω̇, the mean angle is ½φ − ω̇T²/12
            rx = x - interval * (c[0, 0] * earth[0] + c[1, 0] * earth[1] + c[2, 0] * earth[2])
            ry = y - interval * (c[0, 1] * earth[0] + c[1, 1] * earth[1] + c[2, 1] * earth[2])
            rz = z - interval * (c[0, 2] * earth[0] + c[1, 2] * earth[1] + c[2, 2] * earth[2])
            g0, g1, g2 = rx, ry, rz
            if 0 < k < len(dtheta) - 1:
                g0 -= (dtheta[k + 1, 0] - dtheta[k - 1, 0]) / 12.0
                g1 -= (dtheta[k + 1, 1] - dtheta[k - 1, 1]) / 12.0
                g2 -= (dtheta[k + 1, 2] - dtheta[k - 1, 2]) / 12.0
            b0, b1, b2 = g1 * a2 - g2 * a1, g2 * a0 - g0 * a2, g0 * a1 - g1 * a0
            d0, d1, d2 = ry * b2 - rz * b1, rz * b0 - rx * b2, rx * b1 - ry * b0
            a0, a1, a2 = a0 + 0.5 * b0 + d0 / 12.0, a1 + 0.5 * b1 + d1 / 12.0, a2 + 0.5 * b2 + d2 / 12.0
            f0 = c[0, 0] * a0 + c[0, 1] * a1 + c[0, 2] * a2
            f1 = c[1, 0] * a0 + c[1, 1] * a1 + c[1, 2] * a2
            f2 = c[2, 0] * a0 + c[2, 1] * a1 + c[2, 2] * a2
            w0 = v[0] + f0 + interval * (gravity[0] - 2.0 * (earth[1] * v[2] - earth[2] * v[1]))
            w1 = v[1] + f1 + interval * (gravity[1] - 2.0 * (earth[2] * v[0] - earth[0] * v[2]))
            w2 = v[2] + f2 + interval * (gravity[2] - 2.0 * (earth[0] * v[1] - earth[1] * v[0]))
            v[0], v[1], v[2] = w0, w1, w2
            half = -0.5 * interval
            _correct(q, half * earth[0], half * earth[1], half * earth[2])
            _spin(0.5 * x, 0.5 * y, 0.5 * z, q)
            _matrix(q[0], q[1], q[2], q[3], c)  # in the middle of the interval
            for i in range(3):
                for j in range(3):
                    turned[i, j] += interval * c[i, j]
            force[0] += f0
            force[1] += f1
            force[2] += f2
            for n in range(p):  # C δω of each parameter: half before and half after its effect on the velocity
                kind, triad, i, j = codes[n, 0], codes[n, 1], codes[n, 2], codes[n, 3]
                if triad == 0:
                    reading = interval if kind == BIAS else dtheta[k, j]
                    for axis in range(3):
                        u[axis, n] -= 0.5 * c[axis, i] * reading
                else:
                    reading = interval
                    if kind == ARM:
                        reading = arm_pull[k, i, j]
                    elif kind != BIAS:
                        reading = dvel[k, j]
                    for axis in range(3):
                        u[3 + axis, n] -= c[axis, i] * reading
            if wanders:
                for n in range(m):
                    for axis in range(3):
                        for j in range(3):
                            u[axis, n] -= interval * c[axis, j] * u[6 + j, n]
                            u[3 + axis, n] -= interval * c[axis, j] * u[9 + j, n]
            for n in range(m):
                p0, p1, p2 = u[0, n], u[1, n], u[2, n]
                v0, v1, v2 = u[3, n], u[4, n], u[5, n]
                u[3, n] = v0 + p1 * f2 - p2 * f1 - 2.0 * interval * (earth[1] * v2 - earth[2] * v1)
                u[4, n] = v1 + p2 * f0 - p0 * f2 - 2.0 * interval * (earth[2] * v0 - earth[0] * v2)
                u[5, n] = v2 + p0 * f1 - p1 * f0 - 2.0 * interval * (earth[0] * v1 - earth[1] * v0)
                u[0, n] = p0 - interval * (earth[1] * p2 - earth[2] * p1)
                u[1, n] = p1 - interval * (earth[2] * p0 - earth[0] * p2)
                u[2, n] = p2 - interval * (earth[0] * p1 - earth[1] * p0)
            for n in range(p):
                if codes[n, 1] == 0:
                    i, j = codes[n, 2], codes[n, 3]
                    reading = interval if codes[n, 0] == BIAS else dtheta[k, j]
                    for axis in range(3):
                        u[axis, n] -= 0.5 * c[axis, i] * reading
            _spin(0.5 * x, 0.5 * y, 0.5 * z, q)
            _correct(q, half * earth[0], half * earth[1], half * earth[2])
        length = time[ends[step]] - time[first]
        first = ends[step]
        _transition(passage, turned, force, earth, length, noise)
        for i in range(6):
            wander[i] *= passage[6 + i, 6 + i]
            for n in range(m):
                u[6 + i, n] *= passage[6 + i, 6 + i]
        _propagate(passage, cov, work)
        _add_noise(cov, force, length, noise)
        if observed[step]:
            for i in range(3):  # one component after the other: their noise is independent
                variance = cov[3 + i, 3 + i] + velocity_variance
                root = math.sqrt(variance)
                innovation = -v[i]
                white[row] = innovation / root
                for n in range(m):
                    own[n] = u[3 + i, n]
                    design[row, n] = own[n] / root
                row += 1
                for j in range(STATES):
                    gain[j] = cov[3 + i, j] / variance
                _correct(q, gain[0] * innovation, gain[1] * innovation, gain[2] * innovation)
                for j in range(3):
                    v[j] += gain[3 + j] * innovation
                for j in range(6):
                    wander[j] += gain[6 + j] * innovation
                for j in range(STATES):
                    for n in range(m):
                        u[j, n] -= gain[j] * own[n]
                    for n in range(STATES):
                        cov[j, n] -= gain[j] * gain[n] * variance
        for i in range(4):
            attitude[step, i] = q[i]


@kernel
def _transition(out: Array, turned: Array, force: Array, earth: Array, length: float, noise: Array) -> None:
    """Write the transition of the states over a step."""
    out[:, :] = 0.0
    for i in range(STATES):
        out[i, i] = 1.0
    # −[ω×] T of attitude and −2[ω×] T of velocity, [φ ×] f = −[f×] φ
    for block in range(2):
        at, s = 3 * block, length * (1.0 + block)
        out[at, at + 1], out[at, at + 2] = s * earth[2], -s * earth[1]
        out[at + 1, at], out[at + 1, at + 2] = -s * earth[2], s * earth[0]
        out[at + 2, at], out[at + 2, at + 1] = s * earth[1], -s * earth[0]
    out[3, 1], out[3, 2] = force[2], -force[1]
    out[4, 0], out[4, 2] = -force[2], force[0]
    out[5, 0], out[5, 1] = force[1], -force[0]
    half = 0.5
    for j in range(3):
        t0, t1, t2 = turned[0, j], turned[1, j], turned[2, j]
        for i in range(3):
            out[i, 6 + j] = -turned[i, j]
            out[3 + i, 9 + j] = -turned[i, j]
        out[3, 6 + j] = -half * (t1 * force[2] - t2 * force[1])
        out[4, 6 + j] = -half * (t2 * force[0] - t0 * force[2])
        out[5, 6 + j] = -half * (t0 * force[1] - t1 * force[0])
        out[6 + j, 6 + j] = math.exp(-length / noise[4])
        out[9 + j, 9 + j] = math.exp(-length / noise[5])


@kernel
def _add_noise(cov: Array, force: Array, length: float, noise: Array) -> None:
    """Add the noise of a step: random walks with their effect on the velocity, and the instabilities' own."""
    angle, speed = noise[0] ** 2 * length, noise[1] ** 2 * length
    f0, f1, f2 = force[0], force[1], force[2]  # m/s over the step
    square = f0 * f0 + f1 * f1 + f2 * f2
    f = (f0, f1, f2)
    for i in range(3):
        cov[i, i] += angle
        for j in range(3):
            cov[3 + i, 3 + j] += angle / 3.0 * ((square if i == j else 0.0) - f[i] * f[j])
        cov[3 + i, 3 + i] += speed
        cov[6 + i, 6 + i] += noise[2] ** 2 * (1.0 - math.exp(-2.0 * length / noise[4]))
        cov[9 + i, 9 + i] += noise[3] ** 2 * (1.0 - math.exp(-2.0 * length / noise[5]))
    h = 0.5 * angle
    # ½ N² T (−[f×]): velocity against attitude
    for i, j, value in (
        (0, 1, f2), (0, 2, -f1), (1, 0, -f2), (1, 2, f0), (2, 0, f1), (2, 1, -f0),
    ):  # fmt: skip
        cov[3 + i, j] += h * value
        cov[j, 3 + i] += h * value


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


def systematic(task: Task) -> Estimate:
    """Estimate the parameters of a block from its navigation errors.

    Raises:
        RunError: the iteration does not converge: the readings do not fit the sequence.
    """
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
            return _estimate(task, values, solution, number, rest - b @ step)
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
    codes = np.array(
        [
            [_kind(parameter.field), int(parameter.triad == "accel"), parameter.row, parameter.column]
            for parameter in task.known
        ]
    )
    arms = any(parameter.field == "arm" for parameter in task.known)
    noise = np.array(
        [
            task.gyro.white, task.accel.white, task.gyro.instability, task.accel.instability,
            task.gyro.correlation_time, task.accel.correlation_time,
        ]
    )  # fmt: skip
    variance = (task.section.velocity_sigma_mm_s * 1e-3) ** 2 + task.accel.quantum**2 / 12.0
    size = 3 * int(np.count_nonzero(observed))
    white, design = np.empty(size), np.empty((size, len(codes) + 3))
    attitude = np.empty((len(ends), 4))
    run_filter(
        np.ascontiguousarray(imu.time[first:]), np.ascontiguousarray(imu.dtheta[first:]),
        np.ascontiguousarray(imu.dvel[first:]), arm_pull(imu)[first:] if arms else np.empty((0, 3, 3)),
        ends - first, observed, codes, q.copy(), task.earth_rate, -task.force, noise, variance, white, design, attitude,
    )  # fmt: skip
    return white, design, attitude


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


def _estimate(task: Task, values: Array, solution: Solution, number: int, left: Array) -> Estimate:
    return Estimate(values, solution, number, np.empty((0, 3)), left.reshape(-1, 3), left)
