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
from functools import cache
from math import cos, sin
from typing import Any

import numpy as np

from sinssim.algorithms import REGISTRY
from sinssim.data import Array
from sinssim.jit import bind, inline
from sinssim.rotation.kernels import Matrix
from sinssim.strapdown.assemble import parts
from sinssim.strapdown.attitude.quaternion import dcm_k, start_k, step_k
from sinssim.strapdown.increments.fit import is_uniform, weight_table
from sinssim.strapdown.increments.interval import FrameTurn
from sinssim.strapdown.increments.interval import fitted_turn_k as turn_k
from sinssim.studies.cost import least_time, timed_data
from sinssim.studies.operations import Operations, count

_COUNTED = 240
_ROOM = 128  # matrices kept by the timed loop
_EULER = "euler"


@dataclass(frozen=True)
class AttitudeCost:
    """Cost of the attitude alone, per sample.

    Attributes:
        algorithm: of what.
        by_functions: whether B is computed from Euler angles by sines and cosines.
        ns_per_step: processor time of one sample on one core, ns.
        operations: floating-point operations of the compensation, the step and B.
        matrix: those of B among them.
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
    own = parts(algorithm)
    if by_functions:
        own = {**own, "dcm_k": _dcm_by_functions_k}
    name = f"attitude_{algorithm.replace('-', '_')}{'_by_functions' if by_functions else ''}"
    return bind(_attitude, name, **own)


def attitude_costs(algorithm: str) -> list[AttitudeCost]:
    """Count operations and measure time of the attitude alone.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Returns:
        The cost; for Euler angles also with B by sines and cosines; none for an algorithm that iterates attitude,
        velocity and position together.
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
    """Count the floating-point operations of the attitude alone; the result is cached.

    Args:
        algorithm: one of `sinssim.ALGORITHMS` that consists of parts.
        by_functions: whether B is computed from Euler angles by sines and cosines.

    Returns:
        Mean numbers of operations per sample: of everything, and of B.
    """
    imu, _ = timed_data()
    samples = _COUNTED
    updates = samples // REGISTRY[algorithm].samples
    loop = _loop(algorithm, by_functions)
    arguments = _arguments(imu.time[: samples + 1], imu.dtheta[:samples], imu.dvel[:samples])
    found = []
    for rows in (updates, 1):  # B of every update, and of the last one alone
        found.append(count(loop, (*arguments, updates, np.empty((rows, 9))), samples, needed=True)[0])
    whole, last = found
    kinds = ("add", "multiply", "divide", "root", "function")
    share = updates / (updates - 1)
    matrix = Operations(*(share * (getattr(whole, kind) - getattr(last, kind)) for kind in kinds))
    return whole, matrix
