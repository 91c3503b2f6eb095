"""Attitude by Poisson's equation Ḃ = B[ω_b×] − [ω'_n×]B for the direction cosine matrix B = C_nb.

The step is the Taylor series of both rotations to an order of 1…4, in the body's compensated rotation vector or in its
plain increment. For a constant rate, the rotation by θ in a step has an error of −θ³/3, +θ³/6, +θ⁵/30 and −θ⁵/120 for
the orders 1…4, and the matrix is stretched perpendicular to the axis by 1 + θ²/2, 1 + θ⁴/8, 1 − θ⁴/24 and 1 − θ⁶/144.
This is not corrected, so that the loss of orthogonality can be observed, unless the variant requests the nearest
orthogonal matrix after each step.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.quaternions import (
    Matrix,
    Vector,
    cross_k,
    dcm_from_quaternion_k,
    less_cross_k,
    quaternion_from_dcm_k,
)
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn

ORDER = 4
"""Order of the Taylor series, 1…4."""
COMPENSATED = True
"""Whether the body's rotation is its rotation vector or its plain increment."""
ORTHONORMAL = False
"""Whether the matrix is orthogonalised after each step."""

Attitude = Matrix

_LOST = 1e-9  # defect above which the matrix is replaced by the nearest rotation before its quaternion is computed
_CONVERGED = 1e-8  # convergence is quadratic: after a change this small only rounding remains


@inline
def start_k(q0: float, q1: float, q2: float, q3: float) -> Attitude:
    """Attitude variables of a unit quaternion q_nb."""
    return dcm_from_quaternion_k(q0, q1, q2, q3)


@inline
def dcm_k(attitude: Attitude) -> Matrix:
    """C_nb without correction: a matrix without orthogonality resolves forces with errors."""
    return attitude


@inline
def _times_rotation_k(bx: float, by: float, bz: float, s: float, c: float, px: float, py: float, pz: float) -> Vector:
    """Row vector b (I + s [φ×] + c [φ×]²), using b [φ×] = −φ × b written as a row, b × φ."""
    ax, ay, az = cross_k(bx, by, bz, px, py, pz)
    tx, ty, tz = s * bx + c * ax, s * by + c * ay, s * bz + c * az
    return less_cross_k(bx, by, bz, px, py, pz, tx, ty, tz)


@inline
def series_k(order: int, x2: float) -> tuple[float, float]:
    """Factors s, c of I + s [φ×] + c [φ×]² to a given order, from φ²: [φ×]³ = −φ² [φ×]."""
    s = 1.0 - x2 / 6.0 if order >= 3 else 1.0
    if order >= 4:
        return s, 0.5 - x2 / 24.0
    return s, 0.5 if order >= 2 else 0.0


@inline
def nearest_rotation_k(
    b11: float, b12: float, b13: float, b21: float, b22: float, b23: float, b31: float, b32: float, b33: float
) -> Matrix:
    """Orthogonal matrix nearest to B, its polar factor: Newton's B ← ½(B + B⁻ᵀ) (Higham 1986), to rounding."""
    for _ in range(200):
        # B⁻ᵀ is the matrix of cofactors over the determinant
        c11, c12, c13 = cross_k(b21, b22, b23, b31, b32, b33)
        c21, c22, c23 = cross_k(b31, b32, b33, b11, b12, b13)
        c31, c32, c33 = cross_k(b11, b12, b13, b21, b22, b23)
        half = 0.5 / (b11 * c11 + b12 * c12 + b13 * c13)
        d11, d12, d13 = (
            half * c11 - 0.5 * b11,
            half * c12 - 0.5 * b12,
            half * c13 - 0.5 * b13,
        )
        d21, d22, d23 = (
            half * c21 - 0.5 * b21,
            half * c22 - 0.5 * b22,
            half * c23 - 0.5 * b23,
        )
        d31, d32, d33 = (
            half * c31 - 0.5 * b31,
            half * c32 - 0.5 * b32,
            half * c33 - 0.5 * b33,
        )
        b11, b12, b13 = b11 + d11, b12 + d12, b13 + d13
        b21, b22, b23 = b21 + d21, b22 + d22, b23 + d23
        b31, b32, b33 = b31 + d31, b32 + d32, b33 + d33
        change = d11 * d11 + d12 * d12 + d13 * d13 + d21 * d21 + d22 * d22 + d23 * d23
        if change + d31 * d31 + d32 * d32 + d33 * d33 < _CONVERGED * _CONVERGED:
            break
    return b11, b12, b13, b21, b22, b23, b31, b32, b33


@inline
def step_k(attitude: Attitude, body: BodyTurn, frame: FrameTurn) -> Attitude:
    """Attitude variables at the end of the interval."""
    if COMPENSATED:
        px, py, pz = body.phi_x, body.phi_y, body.phi_z
    else:
        px, py, pz = body.theta_x, body.theta_y, body.theta_z
    s, c = series_k(ORDER, px * px + py * py + pz * pz)
    b11, b12, b13 = _times_rotation_k(attitude[0], attitude[1], attitude[2], s, c, px, py, pz)
    b21, b22, b23 = _times_rotation_k(attitude[3], attitude[4], attitude[5], s, c, px, py, pz)
    b31, b32, b33 = _times_rotation_k(attitude[6], attitude[7], attitude[8], s, c, px, py, pz)
    # from the left by exp(−[ζ×]): columns b ← b (row form) times exp([ζ×]), since (exp(−[ζ×]) b)ᵀ = bᵀ exp([ζ×])
    zx, zy, zz = frame.zeta_x, frame.zeta_y, frame.zeta_z
    s, c = series_k(ORDER, zx * zx + zy * zy + zz * zz)
    b11, b21, b31 = _times_rotation_k(b11, b21, b31, s, c, zx, zy, zz)
    b12, b22, b32 = _times_rotation_k(b12, b22, b32, s, c, zx, zy, zz)
    b13, b23, b33 = _times_rotation_k(b13, b23, b33, s, c, zx, zy, zz)
    if ORTHONORMAL:
        return nearest_rotation_k(b11, b12, b13, b21, b22, b23, b31, b32, b33)
    return b11, b12, b13, b21, b22, b23, b31, b32, b33


@inline
def quaternion_k(attitude: Attitude) -> tuple[float, float, float, float, float]:
    """Unit quaternion q_nb of the nearest rotation, and the orthogonality defect max|BBᵀ − I| of the variables."""
    b11, b12, b13, b21, b22, b23, b31, b32, b33 = attitude
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
    if defect > _LOST:
        b11, b12, b13, b21, b22, b23, b31, b32, b33 = nearest_rotation_k(
            b11, b12, b13, b21, b22, b23, b31, b32, b33
        )  # fmt: skip
    q0, q1, q2, q3 = quaternion_from_dcm_k(b11, b12, b13, b21, b22, b23, b31, b32, b33)
    return q0, q1, q2, q3, defect
