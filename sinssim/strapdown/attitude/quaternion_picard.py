"""Attitude by the quaternion of (8.18), λ̇ = ½ Ω(ω) λ, advanced by Picard's successive approximations.

Approximation N has the terms to order N in the interval's plain increment, λ ← λ ∘ (c, s Δθ) with

c = 1 − θ²/8 + θ⁴/384,  s = ½ − θ²/48,

and likewise for the rotation ζ of the navigation frame from the left. For a constant rate, the rotation by θ in a step
has an error of −θ³/12, +θ³/24, +θ⁵/480 and −θ⁵/1920 for the orders 1…4, and the norm becomes 1 + θ²/8, 1 + θ⁴/128, 1 −
θ⁴/384 and 1 − θ⁶/9216. Without normalisation forces are resolved with the unnormalised λ, so that they scale with its
squared norm.
"""

from __future__ import annotations

from math import sqrt

from sinssim.jit import inline
from sinssim.rotation.quaternions import Matrix, Quaternion, dcm_from_quaternion_k, multiply_k
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn

ORDER = 2
"""Order of the approximation, 1…4."""
NORMALIZED = False
"""Whether the quaternion is normalised after each step."""

Attitude = Quaternion


@inline
def picard_k(order: int, x: float, y: float, z: float) -> Quaternion:
    """Quaternion of a small rotation to a given order."""
    y2 = x * x + y * y + z * z
    s = 0.5 - y2 / 48.0 if order >= 3 else 0.5
    c = 1.0 - y2 / 8.0 if order >= 2 else 1.0
    if order >= 4:
        c += y2 * y2 / 384.0
    return c, s * x, s * y, s * z


@inline
def unit_k(q0: float, q1: float, q2: float, q3: float) -> tuple[float, float, float, float, float]:
    """Unit quaternion, and |‖q‖ − 1|."""
    norm = sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    scale = 1.0 / norm
    return scale * q0, scale * q1, scale * q2, scale * q3, abs(norm - 1.0)


@inline
def start_k(q0: float, q1: float, q2: float, q3: float) -> Attitude:
    """Attitude variables of a unit quaternion q_nb."""
    return q0, q1, q2, q3


@inline
def dcm_k(attitude: Attitude) -> Matrix:
    """C_nb times the squared norm."""
    return dcm_from_quaternion_k(attitude[0], attitude[1], attitude[2], attitude[3])


@inline
def step_k(attitude: Attitude, body: BodyTurn, frame: FrameTurn) -> Attitude:
    """Attitude variables at the end of the interval."""
    p0, p1, p2, p3 = picard_k(ORDER, body.theta_x, body.theta_y, body.theta_z)
    z0, z1, z2, z3 = picard_k(ORDER, -frame.zeta_x, -frame.zeta_y, -frame.zeta_z)
    a0, a1, a2, a3 = multiply_k(attitude[0], attitude[1], attitude[2], attitude[3], p0, p1, p2, p3)
    a0, a1, a2, a3 = multiply_k(z0, z1, z2, z3, a0, a1, a2, a3)
    if NORMALIZED:
        a0, a1, a2, a3, _ = unit_k(a0, a1, a2, a3)
    return a0, a1, a2, a3


@inline
def quaternion_k(attitude: Attitude) -> tuple[float, float, float, float, float]:
    """Unit quaternion q_nb and the norm defect |‖λ‖ − 1|."""
    return unit_k(attitude[0], attitude[1], attitude[2], attitude[3])
