"""Attitude by the quaternion relative to the navigation frame, λ̇ = ½ Ω(ω) λ (8.18).

Over an interval the equation has the solution q_nb ← conj(q(ζ)) ∘ q_nb ∘ q(φ), with the body's rotation vector φ and
the navigation frame's ζ, each converted to a quaternion without truncation. The change of q_nb is summed first: at rest
the turns of body and frame cancel in it, and rounding does not add up to a drift.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.quaternions import Matrix, Quaternion, dcm_from_quaternion_k, half_angle_change_k, multiply_k
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn

Attitude = Quaternion


@inline
def start_k(q0: float, q1: float, q2: float, q3: float) -> Attitude:
    """Attitude variables of a unit quaternion q_nb."""
    return q0, q1, q2, q3


@inline
def quaternion_k(attitude: Attitude) -> tuple[float, float, float, float, float]:
    """Unit quaternion q_nb and the norm defect |‖q‖ − 1| of the attitude variables."""
    a0, a1, a2, a3 = attitude
    excess = 0.5 * (a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3 - 1.0)  # ‖q‖ − 1 for a norm near one
    scale = 1.0 - excess
    return scale * a0, scale * a1, scale * a2, scale * a3, abs(excess)


@inline
def dcm_k(attitude: Attitude) -> Matrix:
    """C_nb of the unit quaternion: a norm error of 1e-13 would scale forces and cause 1 mm of height error in an
    hour."""
    q0, q1, q2, q3, _ = quaternion_k(attitude)
    return dcm_from_quaternion_k(q0, q1, q2, q3)


@inline
def step_k(attitude: Attitude, body: BodyTurn, frame: FrameTurn) -> Attitude:
    """Attitude variables at the end of the interval."""
    a0, a1, a2, a3 = attitude
    b0, b1, b2, b3 = multiply_k(a0, a1, a2, a3, *_change_k(body.phi_x, body.phi_y, body.phi_z))
    z0, z1, z2, z3 = _change_k(-frame.zeta_x, -frame.zeta_y, -frame.zeta_z)
    c0, c1, c2, c3 = multiply_k(z0, z1, z2, z3, a0 + b0, a1 + b1, a2 + b2, a3 + b3)
    return a0 + (b0 + c0), a1 + (b1 + c1), a2 + (b2 + c2), a3 + (b3 + c3)


@inline
def _change_k(x: float, y: float, z: float) -> Quaternion:
    """q(φ) − 1, in which nothing cancels."""
    c, s = half_angle_change_k(x * x + y * y + z * z)
    return c, s * x, s * y, s * z
