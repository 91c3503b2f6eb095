"""The separate method: integrals over dwells in known positions and over known turns, by least squares.

For position p with the block's attitude C_p = e^[τ×] A_p e^[ε_p×] (`sinssim.truth.motions.turntable`), and a dwell of
duration T, the ideal integrals are

    accelerometers  T C_pᵀ f_n          gyros  T C_pᵀ ω_ie          turn  θ n' + s + (∫C_b(t)p dt) C_pᵀ ω_ie

f_n is the reaction to gravity, and s the settling after a turn; the attitude C_b(t)p during turns follows from the
gyros. The integrals of the compensated readings differ from these by G d + J n + ν: d are the errors of the parameters
(G has the duration for a bias, the integral u_i for a scale factor and u_j for a misalignment ij), n the errors of the
table, ν the noise. The errors of the table are nuisances with their accuracy as 1σ, so that the estimates are those of
generalised least squares with the correlations that positions share through the turns between them. The readings are
compensated with each new estimate until it stands still (Gauss and Newton), so that errors of the second order do not
remain. (Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, chapter 8; the tests are those
of IEEE Std 1293 and 952.)
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.analyses.calibration_problem import (
    Estimate,
    Solution,
    Task,
    covariance_of_integrals,
    nuisances,
    solve,
)
from sinssim.data import Array, ImuData
from sinssim.errors import RunError
from sinssim.jit import kernel
from sinssim.rotation.quaternions import multiply_k
from sinssim.truth.motions.turntable import settling


@kernel
def mean_turning(dtheta: Array, time: Array, first: int, last: int, earth: Array, out: Array) -> None:
    """Integrate C_b0b(t)ᵀ over a turn, b0 the block at its beginning, into `out`, ∫C_b(t)b0 dt, (3, 3) s.

    The turn has the samples `first` to before `last`; `earth` is the Earth's rate in the axes of b0, rad/s.
    """
    q0, q1, q2, q3 = 1.0, 0.0, 0.0, 0.0
    out[:, :] = 0.0
    c = np.empty((3, 3))
    for k in range(first, last):
        interval = time[k + 1] - time[k]
        _matrix(q0, q1, q2, q3, c)
        x = dtheta[k, 0] - interval * (c[0, 0] * earth[0] + c[1, 0] * earth[1] + c[2, 0] * earth[2])
        y = dtheta[k, 1] - interval * (c[0, 1] * earth[0] + c[1, 1] * earth[1] + c[2, 1] * earth[2])
        z = dtheta[k, 2] - interval * (c[0, 2] * earth[0] + c[1, 2] * earth[1] + c[2, 2] * earth[2])
        for half in range(2):
            size = 0.5 * math.sqrt(x * x + y * y + z * z)
            s = 0.5 * math.sin(0.5 * size) / (0.5 * size) if size > 1e-12 else 0.5
            q0, q1, q2, q3 = multiply_k(
                q0, q1, q2, q3, math.cos(0.5 * size), 0.5 * s * x, 0.5 * s * y, 0.5 * s * z
            )  # by half the angle
            if half == 0:
                _matrix(q0, q1, q2, q3, c)
                for i in range(3):
                    for j in range(3):
                        out[i, j] += interval * c[j, i]


@kernel
def _matrix(q0: float, q1: float, q2: float, q3: float, c: Array) -> None:
    """Write C of a quaternion."""
    c[0, 0] = 1.0 - 2.0 * (q2 * q2 + q3 * q3)
    c[0, 1] = 2.0 * (q1 * q2 - q0 * q3)
    c[0, 2] = 2.0 * (q1 * q3 + q0 * q2)
    c[1, 0] = 2.0 * (q1 * q2 + q0 * q3)
    c[1, 1] = 1.0 - 2.0 * (q1 * q1 + q3 * q3)
    c[1, 2] = 2.0 * (q2 * q3 - q0 * q1)
    c[2, 0] = 2.0 * (q1 * q3 - q0 * q2)
    c[2, 1] = 2.0 * (q2 * q3 + q0 * q1)
    c[2, 2] = 1.0 - 2.0 * (q1 * q1 + q2 * q2)


Rows = NDArray[np.intp]

_MOST = 100
"""Iterations: readings far better than the table converge by 0.85 a step, slower than the trust grows."""
_TRUST = 4.0
"""Growth of the trust in a step."""
_STANDS = 1e-3
"""Change of an estimate, in its 1σ, at which it stands still."""
_ENOUGH = 1e-6
"""The same in sizes of the parameters, for sensors without noise."""
_FLOOR = (1e-10, 1e-8)
"""1σ added to an integral of gyros, rad, and of accelerometers, m/s, against noiseless sensors."""


_STARTS = 40
"""Further starts, if the residuals of the first do not fit; one in seven to twenty finds the right minimum."""
_FEW = 40
"""Iterations from each of them; those that find the minimum take 15."""


def separate(task: Task) -> Estimate:
    """Estimate the parameters of a block by separate tests.

    The integrals are not linear in the errors of a table of degrees. The iteration can end beside the solution, with
    residuals larger than the noise. It then begins again with drawn errors of the table, until the residuals fit.
    """
    rates = task.section.use == "positions-and-rates"
    spans, order = _spans(task, rates)
    white = [
        np.linalg.inv(np.linalg.cholesky(covariance_of_integrals(task.gyro, spans[order], _FLOOR[0]))),
        np.linalg.inv(
            np.linalg.cholesky(covariance_of_integrals(task.accel, task.dwells.seconds(task.imu.time), _FLOOR[1]))
        ),
    ]
    # nuisances: the errors of the table
    sigma = np.full(6 * len(task.attitude), task.position_sigma)
    sigma[:3] = task.tilt_sigma
    first = _first_trust(task, white)
    best = _iterated(task, white, order, sigma, np.zeros(len(sigma)), first, _MOST)
    rng = np.random.default_rng(0)
    for _ in range(_STARTS if first < 1.0 else 0):  # readings that the second order does not touch have one minimum
        if best is not None and best.solution.fit != "large":
            break
        other = _iterated(task, white, order, sigma, sigma * rng.standard_normal(len(sigma)), 1.0, _FEW)
        if other is not None and (best is None or other.solution.chi_square < best.solution.chi_square):
            best = other
    if best is None:
        raise RunError(
            f"the estimate of the separate method still changes after {_MOST} iterations: the data do not fit the "
            f"sequence of [turntable], or the table is less accurate than position_sigma_arcsec and tilt_sigma_arcsec "
            f"state."
        )
    return best


def _iterated(
    task: Task, white: list[Array], order: Rows, table_sigma: Array, errors: Array, trust: float, most: int
) -> Estimate | None:
    """Return the estimate to which the iteration leads from some errors of the table; None if it does not converge."""
    rates = task.section.use == "positions-and-rates"
    uncertain, values, final = table_sigma > 0.0, np.zeros(len(task.known)), False
    for number in range(1, most + 1):
        imu = task.compensated(values)
        r, a, b = (
            np.concatenate([_whitened(w, x) for w, x in zip(white, part, strict=True)])
            for part in linearise(task, errors, imu, rates, order)
        )
        r, a, b = trust * r, trust * a, trust * (b * table_sigma)[:, uncertain]
        prior = -(errors / np.where(uncertain, table_sigma, 1.0))[uncertain]
        solution = solve(r, a, b, prior, task.size, values, final)
        step = nuisances(r - a @ solution.correction, b, prior)
        values = values + solution.correction
        errors[uncertain] += table_sigma[uncertain] * step
        sigma = np.sqrt(np.diag(solution.covariance))
        if final:
            left = r - a @ solution.correction - b @ step
            return _estimate(task, values, solution, number, left, white, _spans(task, rates)[0][order], errors[:3])
        stands = np.all(np.abs(solution.correction) <= np.maximum(_STANDS * sigma, _ENOUGH * task.size)) and np.all(
            np.abs(step) <= _STANDS
        )
        final, trust = bool(stands) and trust == 1.0, min(_TRUST * trust, 1.0)
    return None


def _first_trust(task: Task, white: list[Array]) -> float:
    """Return the weight of the readings in the first step.

    The integrals are not linear in the errors of the table. Readings that are better than the terms of the second order
    get less weight at first, so that the steps cannot run away; the weight grows with each step.
    """
    level = max(task.position_sigma, task.tilt_sigma) ** 2
    longest = float(np.diff(task.dwells.seconds(task.imu.time), axis=1).max())
    sizes = (2.0 * np.pi, float(np.linalg.norm(task.force)) * longest)
    beyond = max(level * size * float(np.abs(w).max()) for size, w in zip(sizes, white, strict=True))
    return 1.0 / max(beyond, 1.0)


def _spans(task: Task, rates: bool) -> tuple[Array, Rows]:
    """Return the spans of the gyros' integrals, dwells first, (K, 2) s, and their order in time."""
    time = task.imu.time
    spans = task.dwells.seconds(time)
    if rates:
        spans = np.concatenate([spans, time[task.dwells.turns]])
    return spans, np.argsort(spans[:, 0], kind="stable")


def _whitened(white: Array, values: Array) -> Array:
    """Whiten observations, (K, 3, …), along the first axis; return them in rows, (3K, …)."""
    done = np.tensordot(white, values, axes=(1, 0))
    return np.asarray(done.reshape(done.shape[0] * 3, *done.shape[2:]))


def cross(v: Array) -> Array:
    """Return [v×], (..., 3, 3), of vectors (..., 3)."""
    zero = np.zeros(v.shape[:-1])
    rows = [[zero, -v[..., 2], v[..., 1]], [v[..., 2], zero, -v[..., 0]], [-v[..., 1], v[..., 0], zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def right_jacobian(phi: Array) -> Array:
    """Return J of e^[(φ + δ)×] = e^[φ×] e^[(J δ)×] for small δ, (..., 3, 3), of rotation vectors (..., 3) rad.

    J = I − (1 − cos φ)/φ² [φ×] + (φ − sin φ)/φ³ [φ×]² (Chirikjian, Stochastic Models, Information Theory, and Lie
    Groups, vol. 2, 2012, eq. (10.86)).
    """
    square = np.sum(phi * phi, axis=-1)[..., None, None]
    small = square < 1e-6
    size = np.sqrt(np.where(small, 1.0, square))
    first = np.where(small, 0.5 - square / 24.0, (1.0 - np.cos(size)) / size**2)
    second = np.where(small, 1.0 / 6.0 - square / 120.0, (size - np.sin(size)) / size**3)
    turned = cross(phi)
    return np.asarray(np.eye(3) - first * turned + second * (turned @ turned))


def _sums(values: Array, rows: Array) -> Array:
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(values, axis=0)])
    return np.asarray(total[rows[:, 1]] - total[rows[:, 0]])


def _parts(errors: Array) -> tuple[Array, Array, Array]:
    """Return tilt, (3,), positions, (P, 3), and axes, (P − 1, 3), of the errors of the table, rad."""
    count = len(errors) // 6
    return errors[:3], errors[3 : 3 + 3 * count].reshape(-1, 3), errors[3 + 3 * count :].reshape(-1, 3)


def linearise(
    task: Task, errors: Array, imu: ImuData, rates: bool, order: Rows
) -> tuple[tuple[Array, Array], tuple[Array, Array], tuple[Array, Array]]:
    """Return residuals, their derivatives to the parameters, (…, 3, p), and to the errors of the table, (…, 3, q).

    Each is a pair, of the gyros in the `order` of time, and of the accelerometers. The residuals are (K, 3) rad and (P,
    3) m/s; `errors` of the table are tilt, positions and axes, one after the other, rad.
    """
    tilt, position, axes = _parts(errors)
    exp = rotation.quaternion_from_rotation_vector
    q = rotation.multiply(exp(tilt), rotation.multiply(task.attitude, exp(position)))
    c = np.swapaxes(rotation.dcm_from_quaternion(q), -1, -2)  # block from north-east-down, (P, 3, 3)
    seconds = task.dwells.seconds(imu.time)
    length = np.diff(seconds, axis=1)
    force, spin = c @ task.force, c @ task.earth_rate
    measured = [_sums(imu.dtheta, task.dwells.rows), _sums(imu.dvel, task.dwells.rows)]
    residual = [measured[0] - length * spin, measured[1] - length * force]
    of_table = [_of_dwells(c, spin, task.earth_rate, length), _of_dwells(c, force, task.force, length)]
    # what converts changes of the errors of the table to rotations, (1 + P + (P − 1), 3, 3)
    additive = np.concatenate([right_jacobian(-tilt)[None], right_jacobian(position), right_jacobian(-axes)])
    lengths = [length[:, 0], length[:, 0]]
    if rates and len(position) > 1:
        turned = _sums(imu.dtheta, task.dwells.turns)
        expected, jacobian = _turns(task, errors, imu, c, spin)
        measured[0] = np.concatenate([measured[0], turned])
        residual[0] = np.concatenate([residual[0], turned - expected])
        of_table[0] = np.concatenate([of_table[0], jacobian])
        lengths[0] = np.concatenate([lengths[0], np.diff(imu.time[task.dwells.turns], axis=1)[:, 0]])
    of_table = [_times(jacobian_, additive) for jacobian_ in of_table]
    measured[0], residual[0] = measured[0][order], residual[0][order]
    of_table[0], lengths[0] = of_table[0][order], lengths[0][order]
    design = [_design(task, triad, measured[i], lengths[i]) for i, triad in enumerate(("gyro", "accel"))]
    return (residual[0], residual[1]), (design[0], design[1]), (of_table[0], of_table[1])


def _times(jacobian: Array, blocks: Array) -> Array:
    parts = jacobian.reshape(*jacobian.shape[:2], -1, 3)
    return np.asarray(np.einsum("kibj,bjl->kibl", parts, blocks).reshape(jacobian.shape))


def _design(task: Task, triad: str, measured: Array, length: Array) -> Array:
    """Return G, (K, 3, p)."""
    g = np.zeros((len(measured), 3, len(task.known)))
    for k, parameter in enumerate(task.known):
        if parameter.triad == triad:
            g[:, parameter.row, k] = length if parameter.field == "bias" else measured[:, parameter.column]
    return g


def _of_dwells(c: Array, measured: Array, of_place: Array, length: Array) -> Array:
    """Return the derivatives of a dwell's integral to the errors of the table, (P, 3, q)."""
    count = len(c)
    derivative = np.zeros((count, 3, 6 * count))
    derivative[:, :, :3] = length[:, :, None] * (c @ cross(of_place))
    turned = length[:, :, None] * cross(measured)
    for p in range(count):
        derivative[p, :, 3 + 3 * p : 6 + 3 * p] = turned[p]
    return derivative


def _turns(task: Task, errors: Array, imu: ImuData, c: Array, spin: Array) -> tuple[Array, Array]:
    """Return the expected integrals of the turns, (P − 1, 3) rad, and their derivatives to the errors of the table."""
    count = len(c)
    _, position, axes = _parts(errors)
    expected, jacobian = np.zeros((count - 1, 3)), np.zeros((count - 1, 3, len(errors)))
    mean = np.empty((3, 3))
    for k, (first, last) in enumerate(task.dwells.turns):
        angle, unit = float(task.angle[k]), task.axis[k]
        axis = rotation.rotate(rotation.quaternion_from_rotation_vector(axes[k]), unit)
        left = settling(unit, axis, angle, position[k], position[k + 1])
        mean_turning(imu.dtheta, imu.time, int(first), int(last), np.ascontiguousarray(spin[k]), mean)
        expected[k] = angle * axis + left + mean @ spin[k]
        n = cross(axis)
        right = right_jacobian(angle * axis)
        of_left = np.linalg.inv(right_jacobian(-left))
        back = np.eye(3) - np.sin(angle) * n + (1.0 - np.cos(angle)) * (n @ n)  # e^[−θn'×]
        jacobian[k, :, :3] = mean @ c[k] @ cross(task.earth_rate)
        jacobian[k, :, 3 + 3 * k : 6 + 3 * k] = mean @ cross(spin[k]) - of_left @ back
        jacobian[k, :, 6 + 3 * k : 9 + 3 * k] = np.linalg.inv(right_jacobian(left))
        at = 3 + 3 * count + 3 * k
        jacobian[k, :, at : at + 3] = -angle * (np.eye(3) - of_left @ right) @ n
    return expected, jacobian


def _estimate(
    task: Task, values: Array, solution: Solution, number: int, left: Array, white: list[Array], spans: Array,
    tilt: Array,
) -> Estimate:  # fmt: skip
    count = 3 * len(white[0])
    gyro = np.linalg.solve(white[0], left[:count].reshape(-1, 3)) / np.diff(spans, axis=1)
    length = np.diff(task.dwells.seconds(task.imu.time), axis=1)
    accel = np.linalg.solve(white[1], left[count:].reshape(-1, 3)) / length
    return Estimate(values, solution, number, gyro, accel, left, tilt.copy())
