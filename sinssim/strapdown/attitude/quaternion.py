"""Attitude by the quaternion relative to the navigation frame, λ̇ = ½ Ω(ω) λ (8.18).

Over an interval the equation has the solution q_nb ← conj(q(ζ)) ∘ q_nb ∘ q(φ), with the body's rotation vector φ and
the navigation frame's ζ, each converted to a quaternion without truncation.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.quaternions import (
    Matrix,
    Quaternion,
    dcm_from_quaternion_k,
    multiply_k,
    quaternion_from_rotation_vector_k,
)
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
    p0, p1, p2, p3 = quaternion_from_rotation_vector_k(body.phi_x, body.phi_y, body.phi_z)
    z0, z1, z2, z3 = quaternion_from_rotation_vector_k(-frame.zeta_x, -frame.zeta_y, -frame.zeta_z)
    a0, a1, a2, a3 = multiply_k(attitude[0], attitude[1], attitude[2], attitude[3], p0, p1, p2, p3)
    return multiply_k(z0, z1, z2, z3, a0, a1, a2, a3)
