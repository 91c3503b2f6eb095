"""Attitude by roll, pitch and heading themselves: the kinematic equations, Runge-Kutta of the fourth order.

In the package's axes, with ω the rate relative to the navigation frame (ω_ib less C_bn ω_in):
φ̇ = ω_x + tan θ (ω_y sin φ + ω_z cos φ),  θ̇ = ω_y cos φ − ω_z sin φ,  ψ̇ = (ω_y sin φ + ω_z cos φ)/cos θ.
The angles are continuous and never reduced; at θ = ±90° the equations are singular.
"""

from __future__ import annotations

from math import cos, sin

from sinssim.jit import inline
from sinssim.rotation import (
    Matrix,
    Vector,
    dcm_from_quaternion_k,
    euler_from_quaternion_k,
    quaternion_from_euler_k,
)
from sinssim.strapdown.interval import BodyTurn, FrameTurn

Attitude = Vector

# cos θ is kept from vanishing altogether: an infinite rate would end the run instead of damaging it.
_LEAST_COS = 1e-9


@inline
def start_k(q0: float, q1: float, q2: float, q3: float) -> Attitude:
    """Attitude variables of a unit quaternion q_nb."""
    return euler_from_quaternion_k(q0, q1, q2, q3)


@inline
def dcm_k(attitude: Attitude) -> Matrix:
    """C_nb."""
    q0, q1, q2, q3 = quaternion_from_euler_k(attitude[0], attitude[1], attitude[2])
    return dcm_from_quaternion_k(q0, q1, q2, q3)


@inline
def _rates_k(
    roll: float, pitch: float, heading: float,
    wx: float, wy: float, wz: float, un: float, ue: float, ud: float,
) -> Vector:  # fmt: skip
    """Angle rates times the interval, of the body's rate w and the navigation frame's rate u, both times it."""
    sr, cr = sin(roll), cos(roll)
    sp, cp = sin(pitch), cos(pitch)
    sh, ch = sin(heading), cos(heading)
    # ω − C_bn u, by heading, pitch, roll in turn
    x1, y1 = ch * un + sh * ue, ch * ue - sh * un
    x2, z2 = cp * x1 - sp * ud, sp * x1 + cp * ud
    wx -= x2
    wy -= cr * y1 + sr * z2
    wz -= cr * z2 - sr * y1
    if abs(cp) < _LEAST_COS:
        cp = _LEAST_COS if cp >= 0.0 else -_LEAST_COS
    turn = (wy * sr + wz * cr) / cp
    return wx + sp * turn, wy * cr - wz * sr, turn


@inline
def step_k(attitude: Attitude, body: BodyTurn, frame: FrameTurn) -> Attitude:
    """Attitude variables at the end of the interval."""
    roll, pitch, heading = attitude
    # body rate at s = −½, 0, ½
    ax, ay, az = (
        body.a1_x - 0.5 * body.a2_x + 0.25 * body.a3_x,
        body.a1_y - 0.5 * body.a2_y + 0.25 * body.a3_y,
        body.a1_z - 0.5 * body.a2_z + 0.25 * body.a3_z,
    )
    bx, by, bz = ax + body.a2_x, ay + body.a2_y, az + body.a2_z
    k1r, k1p, k1h = _rates_k(roll, pitch, heading, ax, ay, az, frame.u0_x, frame.u0_y, frame.u0_z)
    k2r, k2p, k2h = _rates_k(
        roll + 0.5 * k1r,
        pitch + 0.5 * k1p,
        heading + 0.5 * k1h,
        body.a1_x,
        body.a1_y,
        body.a1_z,
        frame.um_x,
        frame.um_y,
        frame.um_z,
    )
    k3r, k3p, k3h = _rates_k(
        roll + 0.5 * k2r,
        pitch + 0.5 * k2p,
        heading + 0.5 * k2h,
        body.a1_x,
        body.a1_y,
        body.a1_z,
        frame.um_x,
        frame.um_y,
        frame.um_z,
    )
    k4r, k4p, k4h = _rates_k(roll + k3r, pitch + k3p, heading + k3h, bx, by, bz, frame.u1_x, frame.u1_y, frame.u1_z)
    return (
        roll + (k1r + 2.0 * (k2r + k3r) + k4r) / 6.0,
        pitch + (k1p + 2.0 * (k2p + k3p) + k4p) / 6.0,
        heading + (k1h + 2.0 * (k2h + k3h) + k4h) / 6.0,
    )


@inline
def quaternion_k(attitude: Attitude) -> tuple[float, float, float, float, float]:
    """Unit quaternion q_nb; Euler angles have no norm to lose, so the defect is 0."""
    q0, q1, q2, q3 = quaternion_from_euler_k(attitude[0], attitude[1], attitude[2])
    return q0, q1, q2, q3, 0.0
