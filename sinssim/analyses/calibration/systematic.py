"""The systematic method: errors of navigation during a sequence, without a precise table.

The block navigates through the sequence on its compensated readings. In the dwells its velocity is zero, and the
computed one shows the tilt that errors of the gyros have accumulated in the turns, and the errors of the
accelerometers (Camberlein and Mazzanti, Calibration technique for laser gyro strapdown inertial navigation systems,
Symposium Gyro Technology, Stuttgart, 1985; Grewal, Henderson and Miyasako, Application of Kalman filtering to the
calibration and alignment of inertial navigation systems, IEEE Trans. Automatic Control 36 (1991) 4-13). Its filter is
in `sinssim.analyses.calibration.systematic_kernel`. The parameters are estimated by least squares from all of its
innovations, the readings are compensated with the estimate, and the sequence is navigated again until the estimate
stands still. The attitude in the first position is an unknown too, with the nominal one of the sequence as prior
knowledge.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.analyses.calibration import systematic_kernel as kernel
from sinssim.analyses.calibration.least_squares import Solution, nuisances, solve
from sinssim.analyses.calibration.task import Estimate, Task
from sinssim.data import Array, ImuData
from sinssim.errors import RunError
from sinssim.units import DEG, DEG_H

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
    """Return the steps of the filter.

    Returns:
        First sample after each step, (K,), and whether the block stands during the step, (K,).
    """
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
    """Return the whitened innovations and their derivatives.

    Args:
        q: attitude at the first sample, (4,).

    Returns:
        Innovations, (3M,); derivatives to the parameters and to the attitude at the start, (3M, p + 3); attitude after
        each step, (K, 4).
    """
    first = int(task.dwells.rows[0, 0])
    codes = np.array([[_kind(one.field), int(one.triad == "accel"), one.row, one.column] for one in task.known])
    arms = any(one.field == "arm" for one in task.known)
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
    kernel.run_filter(
        np.ascontiguousarray(imu.time[first:]), np.ascontiguousarray(imu.dtheta[first:]),
        np.ascontiguousarray(imu.dvel[first:]), arm_pull(imu)[first:] if arms else np.empty((0, 3, 3)),
        ends - first, observed, codes, q.copy(), task.earth_rate, -task.force, noise, variance, white, design, attitude,
    )  # fmt: skip
    return white, design, attitude


def _kind(field: str) -> int:
    return {"bias": kernel.BIAS, "scale": kernel.SCALE, "misalignment": kernel.TILT, "arm": kernel.ARM}[field]


def arm_pull(imu: ImuData) -> Array:
    """Return what the places of the accelerometers add to their increments.

    Returns:
        Derivative of the increment of accelerometer i to coordinate j of its place, [Δω × e_j + T ω × (ω × e_j)]_i,
        (N, 3, 3) 1/s.
    """
    interval = np.diff(imu.time)
    rate = imu.dtheta / interval[:, None]
    edges = np.concatenate([rate[:1], 0.5 * (rate[1:] + rate[:-1]), rate[-1:]])
    turning = np.diff(edges, axis=0)
    found = np.empty((len(rate), 3, 3))
    for j, unit in enumerate(np.eye(3)):
        found[:, :, j] = np.cross(turning, unit) + interval[:, None] * np.cross(rate, np.cross(rate, unit))
    return found


def _coarse(task: Task) -> Array:
    """Return first values of the parameters: large biases of gyros from the mean of the dwells."""
    values = np.zeros(len(task.known))
    if max(one.size for one in task.known if one.triad == "gyro" and one.field == "bias") < _COARSE_BIAS:
        return values
    rate = np.array([task.imu.dtheta[a:b].sum(axis=0) for a, b in task.dwells.rows])
    rate = rate / np.diff(task.dwells.seconds(task.imu.time), axis=1)
    earth = rotation.rotate(rotation.conjugate(task.attitude), task.earth_rate)
    mean = np.mean(rate - earth, axis=0)
    for k, one in enumerate(task.known):
        if one.triad == "gyro" and one.field == "bias":
            values[k] = mean[one.row]
    return values


def _levelled(task: Task, imu: ImuData) -> Array:
    """Return the nominal attitude of the first position, turned so that gravity is where the accelerometers feel it."""
    first, last = task.dwells.rows[0]
    own = imu.dvel[first:last].sum(axis=0)
    measured = rotation.rotate(task.attitude[0], own / np.linalg.norm(own))
    true = task.force / np.linalg.norm(task.force)
    axis = np.cross(measured, true)
    size = float(np.linalg.norm(axis))
    angle = float(np.arctan2(size, measured @ true))
    turn = axis / size * angle if size > 0.0 else np.zeros(3)
    return rotation.multiply(rotation.quaternion_from_rotation_vector(turn), task.attitude[0])


def _estimate(task: Task, values: Array, solution: Solution, number: int, left: Array) -> Estimate:
    return Estimate(values, solution, number, np.empty((0, 3)), left.reshape(-1, 3), left)
