"""Attitude by Poisson's equation Ḃ = B[ω_b×] − [ω'_n×]B for the direction cosine matrix B = C_nb.

The step is the fourth-order Taylor series of both rotations; nothing restores orthogonality, so that its loss can be
watched.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation import Matrix, Vector, dcm_from_quaternion_k, quaternion_from_dcm_k
from sinssim.strapdown.interval import BodyTurn, FrameTurn

Attitude = Matrix


@inline
def start_k(q0: float, q1: float, q2: float, q3: float) -> Attitude:
    """Attitude variables of a unit quaternion q_nb."""
    return dcm_from_quaternion_k(q0, q1, q2, q3)


@inline
def dcm_k(attitude: Attitude) -> Matrix:
    """C_nb."""
    return attitude


@inline
def _times_rotation_k(bx: float, by: float, bz: float, s: float, c: float, px: float, py: float, pz: float) -> Vector:
    """Row vector b (I + s [φ×] + c [φ×]²), using b [φ×] = −φ × b written as a row, b × φ."""
    ax, ay, az = by * pz - bz * py, bz * px - bx * pz, bx * py - by * px
    dx, dy, dz = ay * pz - az * py, az * px - ax * pz, ax * py - ay * px
    return bx + s * ax + c * dx, by + s * ay + c * dy, bz + s * az + c * dz


@inline
def step_k(attitude: Attitude, body: BodyTurn, frame: FrameTurn) -> Attitude:
    """Attitude variables at the end of the interval."""
    px, py, pz = body.phi_x, body.phi_y, body.phi_z
    x2 = px * px + py * py + pz * pz
    # Taylor to the fourth order: [φ×] − [φ×] φ²/6 and [φ×]²/2 − [φ×]² φ²/24
    s, c = 1.0 - x2 / 6.0, 0.5 - x2 / 24.0
    b11, b12, b13 = _times_rotation_k(attitude[0], attitude[1], attitude[2], s, c, px, py, pz)
    b21, b22, b23 = _times_rotation_k(attitude[3], attitude[4], attitude[5], s, c, px, py, pz)
    b31, b32, b33 = _times_rotation_k(attitude[6], attitude[7], attitude[8], s, c, px, py, pz)
    # from the left by exp(−[ζ×]): columns b ← b (row form) times exp([ζ×]), since (exp(−[ζ×]) b)ᵀ = bᵀ exp([ζ×])
    zx, zy, zz = frame.zeta_x, frame.zeta_y, frame.zeta_z
    z2 = zx * zx + zy * zy + zz * zz
    s, c = 1.0 - z2 / 6.0, 0.5 - z2 / 24.0
    b11, b21, b31 = _times_rotation_k(b11, b21, b31, s, c, zx, zy, zz)
    b12, b22, b32 = _times_rotation_k(b12, b22, b32, s, c, zx, zy, zz)
    b13, b23, b33 = _times_rotation_k(b13, b23, b33, s, c, zx, zy, zz)
    return b11, b12, b13, b21, b22, b23, b31, b32, b33


@inline
def quaternion_k(attitude: Attitude) -> tuple[float, float, float, float, float]:
    """Unit quaternion q_nb and the orthogonality defect max|BBᵀ − I| of the attitude variables."""
    b11, b12, b13, b21, b22, b23, b31, b32, b33 = attitude
    q0, q1, q2, q3 = quaternion_from_dcm_k(b11, b12, b13, b21, b22, b23, b31, b32, b33)
    defect = max(
        max(
            abs(b11 * b11 + b12 * b12 + b13 * b13 - 1.0),
            abs(b21 * b21 + b22 * b22 + b23 * b23 - 1.0),
            abs(b31 * b31 + b32 * b32 + b33 * b33 - 1.0),
        ),
        max(
            abs(b11 * b21 + b12 * b22 + b13 * b23),
            abs(b11 * b31 + b12 * b32 + b13 * b33),
            abs(b21 * b31 + b22 * b32 + b23 * b33),
        ),
    )
    return q0, q1, q2, q3, defect
