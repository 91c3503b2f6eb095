"""Kernels that the engines of all frames share."""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.kernels import Matrix, Quaternion, Vector, product_k


@inline
def resolved_k(c: Matrix, x: float, y: float, z: float) -> Vector:
    """Components of a vector in other axes: C v, the matrix row by row."""
    c11, c12, c13, c21, c22, c23, c31, c32, c33 = c
    return (
        product_k(c11, x) + c12 * y + c13 * z,
        product_k(c21, x) + c22 * y + c23 * z,
        product_k(c31, x) + c32 * y + c33 * z,
    )


@inline
def continued_k(q0: float, q1: float, q2: float, q3: float, r0: float, r1: float, r2: float, r3: float) -> Quaternion:
    """The quaternion r or −r, whichever follows q without a jump of sign."""
    if q0 * r0 + q1 * r1 + q2 * r2 + q3 * r3 < 0.0:
        r0, r1, r2, r3 = -r0, -r1, -r2, -r3
    return r0, r1, r2, r3
