"""The cost of the attitude alone: the increments' compensation, a step, and the matrix B that resolves forces.

Operations are those on which attitude and B depend. Compensation of the velocity increments is not among them: the
compiler drops it from the timed loop, too. The time is that of the loop, as in the fast part of a schedule; the engines
of one rate compensate the increments in blocks, several in one operation, which takes less.

B follows from a quaternion by products, and is itself the variable of Poisson's equation. From Euler angles it takes
sines and cosines. The engine has these from its step and by the addition theorems. `by_functions` computes B from
the angles by six functions, as a program without these would.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from math import cos, sin
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.experiments.studies.step_cost import KINDS, Operations, count, least_time, timed_data
from sinssim.jit import bind, inline, kernel
from sinssim.rotation import quaternion_from_euler
from sinssim.rotation.quaternions import Matrix, dcm_from_quaternion_k
from sinssim.strapdown.attitude import REGISTRY
from sinssim.strapdown.attitude.quaternion import dcm_k, start_k, step_k
from sinssim.strapdown.coning_sculling import FrameTurn, is_uniform, weight_table
from sinssim.strapdown.coning_sculling import fitted_turn_k as turn_k
from sinssim.strapdown.engine_assembly import parts

_COUNTED = 240
_ROOM = 128  # matrices kept by the timed loop
_BULK = 20_000
_EULER = "euler"


@dataclass(frozen=True)
class AttitudeCost:
    """Cost of the attitude alone, per sample: time on one core, operations, and those of the matrix B among them.

    `by_functions`: B is computed from Euler angles by sines and cosines.
    """

    algorithm: str
    by_functions: bool
    ns_per_step: float
    operations: Operations
    matrix: Operations

    @property
    def name(self) -> str:
        """The algorithm, and how it has B if that is not its own way."""
        return f"{self.algorithm}, B by sines and cosines" if self.by_functions else self.algorithm


@inline
def _dcm_by_functions_k(attitude: Any) -> Matrix:
    """C_nb from roll, pitch and heading, the first three variables of the Euler angles."""
    sr, cr = sin(attitude[0]), cos(attitude[0])
    sp, cp = sin(attitude[1]), cos(attitude[1])
    sh, ch = sin(attitude[2]), cos(attitude[2])
    u, v = sp * sr, sp * cr
    return (
        ch * cp, ch * u - sh * cr, ch * v + sh * sr,
        sh * cp, sh * u + ch * cr, sh * v - ch * sr,
        -sp, cp * sr, cp * cr,
    )  # fmt: skip


# Compiled loops over many attitudes: B and nothing else.
@kernel
def _matrices_from_quaternions(quaternions: Array, matrices: Array) -> None:
    for k in range(quaternions.shape[0]):
        q0, q1, q2, q3 = quaternions[k, 0], quaternions[k, 1], quaternions[k, 2], quaternions[k, 3]
        (
            matrices[k, 0], matrices[k, 1], matrices[k, 2], matrices[k, 3], matrices[k, 4], matrices[k, 5],
            matrices[k, 6], matrices[k, 7], matrices[k, 8],
        ) = dcm_from_quaternion_k(q0, q1, q2, q3)  # fmt: skip


@kernel
def _matrices_from_angles(angles: Array, matrices: Array) -> None:
    for k in range(angles.shape[0]):
        (
            matrices[k, 0], matrices[k, 1], matrices[k, 2], matrices[k, 3], matrices[k, 4], matrices[k, 5],
            matrices[k, 6], matrices[k, 7], matrices[k, 8],
        ) = _dcm_by_functions_k((angles[k, 0], angles[k, 1], angles[k, 2]))  # fmt: skip


@dataclass(frozen=True)
class MatrixCost:
    """Cost of one matrix B alone: operations, and processor time on one core, among many."""

    operations: Operations
    ns: float


def matrix_costs() -> tuple[MatrixCost, MatrixCost]:
    """Return the costs of B alone, over many attitudes in one loop: from a quaternion, and by functions of angles."""
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, (_BULK, 3))
    quaternions = quaternion_from_euler(*angles.T)
    costs = []
    for loop, attitudes in ((_matrices_from_quaternions, quaternions), (_matrices_from_angles, angles)):
        matrices = np.empty((_BULK, 9))
        ns = least_time(partial(loop, attitudes, matrices)) / _BULK
        few = np.ascontiguousarray(attitudes[:4])
        costs.append(MatrixCost(count(loop, (few, np.empty((4, 9))), 4, needed=True)[0], ns))
    return costs[0], costs[1]


# A compiled loop over updates: attitude in a frame that turns at a constant rate, and B into one of several rows.
def _attitude(
    dtheta: Array, dvel: Array, weights: Array, start: Array, turn: Array, updates: int, matrices: Array
) -> None:
    attitude = start_k(start[0], start[1], start[2], start[3])
    x, y, z = turn[0], turn[1], turn[2]
    frame = FrameTurn(x, y, z, x, y, z, x, y, z, x, y, z)
    rows = matrices.shape[0]
    for k in range(updates):
        attitude = step_k(attitude, turn_k(dtheta, dvel, weights, True, k), frame)
        row = k % rows
        (
            matrices[row, 0], matrices[row, 1], matrices[row, 2], matrices[row, 3], matrices[row, 4],
            matrices[row, 5], matrices[row, 6], matrices[row, 7], matrices[row, 8],
        ) = dcm_k(attitude)  # fmt: skip


@cache
def _loop(algorithm: str, by_functions: bool) -> Callable[..., None]:
    functions = parts(algorithm)
    if by_functions:
        functions = {**functions, "dcm_k": _dcm_by_functions_k}
    name = f"attitude_{algorithm.replace('-', '_')}{'_by_functions' if by_functions else ''}"
    return bind(_attitude, name, **functions)


def attitude_costs(algorithm: str) -> list[AttitudeCost]:
    """Count operations and measure time of the attitude alone.

    For Euler angles also with B by sines and cosines; none for an algorithm that iterates attitude, velocity and
    position together.
    """
    if REGISTRY[algorithm].windowed:
        return []
    return [_cost(algorithm, by_functions) for by_functions in ((False, True) if algorithm == _EULER else (False,))]


def _cost(algorithm: str, by_functions: bool) -> AttitudeCost:
    loop, (imu, _) = _loop(algorithm, by_functions), timed_data()
    every = REGISTRY[algorithm].samples
    matrices = np.empty((_ROOM, 9))
    arguments = _arguments(imu.time, imu.dtheta, imu.dvel)
    time_ns = least_time(lambda: loop(*arguments, len(imu) // every, matrices)) / len(imu)
    operations, matrix = count_attitude(algorithm, by_functions)
    return AttitudeCost(algorithm, by_functions, time_ns, operations, matrix)


def _arguments(time: Array, dtheta: Array, dvel: Array) -> tuple[Array, ...]:
    turn = np.array([5e-7, -2e-7, -5e-7])  # rad per update: the Earth's rate at 100 Hz
    return dtheta, dvel, weight_table(time, is_uniform(time)), np.array([1.0, 0.0, 0.0, 0.0]), turn


@cache
def count_attitude(algorithm: str, by_functions: bool = False) -> tuple[Operations, Operations]:
    """Return the mean operations per sample of the attitude alone, and of B; the result is cached."""
    imu, _ = timed_data()
    samples = _COUNTED
    updates = samples // REGISTRY[algorithm].samples
    loop = _loop(algorithm, by_functions)
    arguments = _arguments(imu.time[: samples + 1], imu.dtheta[:samples], imu.dvel[:samples])
    counts = []
    for rows in (updates, 1):  # B of every update, and of the last one alone
        counts.append(count(loop, (*arguments, updates, np.empty((rows, 9))), samples, needed=True)[0])
    whole, last = counts
    share = updates / (updates - 1)
    matrix = Operations(*(share * (getattr(whole, kind) - getattr(last, kind)) for kind in KINDS))
    return whole, matrix
