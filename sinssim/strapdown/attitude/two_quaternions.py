"""Attitude by two quaternions (8.19): body to inertial by Δβ, navigation to inertial by ∫ω'dt, combined into B.

Each is advanced by the second-order Picard step of the chapter and never normalised. The chapter's axes (X forward, Y
up, Z right; N, H, E) are the package's axes rotated by 90° about the forward (or north) axis. A rotation R of axes maps
every vector part v to Rv and does not change scalar parts. (8.19) consists of scalar and vector products, λ₀' = (1 −
e²/8)λ₀ − ½ Δβ·λ and λ' = (1 − e²/8)λ + ½(Δβ λ₀ + λ × Δβ), with which R commutes. The formula therefore holds in any
right-handed axes, here in those of the package.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.quaternions import Matrix, Quaternion, dcm_from_quaternion_k, multiply_k
from sinssim.strapdown.attitude.quaternion_picard import unit_k
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn

Attitude = tuple[float, float, float, float, float, float, float, float]
"""λ, body to inertial, and ν, navigation to inertial; the inertial axes are the navigation frame's at the start."""


@inline
def picard_step_k(
    l0: float, l1: float, l2: float, l3: float, bx: float, by: float, bz: float
) -> Quaternion:  # (8.19), line by line
    """One quaternion of (8.19) after a rotation Δβ."""
    e2 = bx * bx + by * by + bz * bz
    c = 1.0 - e2 / 8.0
    return (
        c * l0 - 0.5 * (bx * l1 + by * l2 + bz * l3),
        c * l1 + 0.5 * (bx * l0 + bz * l2 - by * l3),
        c * l2 + 0.5 * (by * l0 + bx * l3 - bz * l1),
        c * l3 + 0.5 * (bz * l0 + by * l1 - bx * l2),
    )


@inline
def _combined_k(attitude: Attitude) -> Quaternion:
    """conj(ν) ∘ λ."""
    l0, l1, l2, l3, n0, n1, n2, n3 = attitude
    return multiply_k(n0, -n1, -n2, -n3, l0, l1, l2, l3)


@inline
def start_k(q0: float, q1: float, q2: float, q3: float) -> Attitude:
    """Attitude variables of a unit quaternion q_nb."""
    return q0, q1, q2, q3, 1.0, 0.0, 0.0, 0.0


@inline
def dcm_k(attitude: Attitude) -> Matrix:
    """B = C_nb times the squared norms."""
    q0, q1, q2, q3 = _combined_k(attitude)
    return dcm_from_quaternion_k(q0, q1, q2, q3)


@inline
def step_k(attitude: Attitude, body: BodyTurn, frame: FrameTurn) -> Attitude:
    """Attitude variables at the end of the interval."""
    l0, l1, l2, l3, n0, n1, n2, n3 = attitude
    l0, l1, l2, l3 = picard_step_k(l0, l1, l2, l3, body.theta_x, body.theta_y, body.theta_z)
    n0, n1, n2, n3 = picard_step_k(n0, n1, n2, n3, frame.zeta_x, frame.zeta_y, frame.zeta_z)
    return l0, l1, l2, l3, n0, n1, n2, n3


@inline
def quaternion_k(attitude: Attitude) -> tuple[float, float, float, float, float]:
    """Unit quaternion q_nb and the defect |‖λ‖‖ν‖ − 1|."""
    q0, q1, q2, q3 = _combined_k(attitude)
    return unit_k(q0, q1, q2, q3)
