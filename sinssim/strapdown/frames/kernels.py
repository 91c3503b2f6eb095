"""Kernels that the engines of all frames share."""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.kernels import Matrix, Quaternion, Vector
from sinssim.rotation.vectors import resolved
from sinssim.strapdown.frames.problem import Rows
from sinssim.strapdown.increments.interval import BodyTurn


@inline
def forces_k(c: Matrix, b: BodyTurn) -> tuple[Vector, Vector, Vector]:
    """Increment of velocity, and specific force at the start and the end times the interval, in the frame's axes."""
    return (
        resolved(c, (b.dv_x, b.dv_y, b.dv_z)),
        resolved(c, (b.fs_x, b.fs_y, b.fs_z)),
        resolved(c, (b.fe_x, b.fe_y, b.fe_z)),
    )


@inline
def continued_k(q: Quaternion, r: Quaternion) -> Quaternion:
    """The quaternion r or −r, whichever follows q without a jump of sign."""
    if q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3] < 0.0:
        return -r[0], -r[1], -r[2], -r[3]
    return r


@inline
def first_quaternion_k(rows: Rows) -> Quaternion:
    """q_nb of the first row."""
    return rows.q_nb[0, 0], rows.q_nb[0, 1], rows.q_nb[0, 2], rows.q_nb[0, 3]


@inline
def keep_k(rows: Rows, row: int, latitude: float, longitude: float, h: float, v: Vector, q: Quaternion) -> None:
    """Store a row of a solution."""
    rows.latitude[row], rows.longitude[row], rows.height[row] = latitude, longitude, h
    rows.velocity[row, 0], rows.velocity[row, 1], rows.velocity[row, 2] = v
    rows.q_nb[row, 0], rows.q_nb[row, 1], rows.q_nb[row, 2], rows.q_nb[row, 3] = q
