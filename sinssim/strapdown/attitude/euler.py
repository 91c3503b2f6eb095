"""Attitude by roll, pitch and heading: the kinematic equations, integrated by fourth-order Runge-Kutta.

In the package's axes, with ω the rate relative to the navigation frame (ω_ib less C_bn ω_in):
φ̇ = ω_x + tan θ (ω_y sin φ + ω_z cos φ),  θ̇ = ω_y cos φ − ω_z sin φ,  ψ̇ = (ω_y sin φ + ω_z cos φ)/cos θ.
The angles are continuous and never reduced; at θ = ±90° the equations are singular.

The four stages depend on each other, so other computations are kept out of them. Sines and cosines at the stages and at
the end follow by the addition theorems from those at the start of the step and the small change of the stage; every few
steps they are computed anew from the angles. C_bn ω_in at mid-interval and at the end follows from C_bn at the start
and the body's measured turn, which is more accurate than the attitudes of the stages.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.quaternions import Matrix, Vector, euler_from_quaternion_k, less_cross_k, sincos_k
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn

Attitude = tuple[float, float, float, float, float, float, float, float, float, int]
"""Roll, pitch, heading; sine and cosine of half of each; steps since these were taken from the angles."""

# lower limit of cos θ: with an infinite rate the run would end
_LEAST_COS = 1e-9

_FRESH_EVERY = 8  # steps between new sines and cosines, which accumulate rounding errors

_SMALL = 0.06  # changes below this [rad] are summed as series with a truncation error below 1e-17


@inline
def start_k(q0: float, q1: float, q2: float, q3: float) -> Attitude:
    """Attitude variables of a unit quaternion q_nb."""
    roll, pitch, heading = euler_from_quaternion_k(q0, q1, q2, q3)
    sr, cr = sincos_k(0.5 * roll)
    sp, cp = sincos_k(0.5 * pitch)
    sh, ch = sincos_k(0.5 * heading)
    return roll, pitch, heading, sr, cr, sp, cp, sh, ch, 0


@inline
def quaternion_k(attitude: Attitude) -> tuple[float, float, float, float, float]:
    """Unit quaternion q_nb; Euler angles have no norm, so the defect is 0."""
    _, _, _, sr, cr, sp, cp, sh, ch, _ = attitude
    return (
        cr * cp * ch + sr * sp * sh,
        sr * cp * ch - cr * sp * sh,
        cr * sp * ch + sr * cp * sh,
        cr * cp * sh - sr * sp * ch,
        0.0,
    )


@inline
def _doubled_k(s: float, c: float) -> tuple[float, float]:
    """Sine and cosine of an angle from those of its half."""
    return 2.0 * s * c, (c - s) * (c + s)


@inline
def dcm_k(attitude: Attitude) -> Matrix:
    """C_nb."""
    sr, cr = _doubled_k(attitude[3], attitude[4])
    sp, cp = _doubled_k(attitude[5], attitude[6])
    sh, ch = _doubled_k(attitude[7], attitude[8])
    u, v = sp * sr, sp * cr
    return (
        ch * cp, ch * u - sh * cr, ch * v + sh * sr,
        sh * cp, sh * u + ch * cr, sh * v - ch * sr,
        -sp, cp * sr, cp * cr,
    )  # fmt: skip


@inline
def _turned_k(angle: float, change: float, s: float, c: float) -> tuple[float, float]:
    """Sine and cosine of angle + change from those of the angle."""
    x = change * change
    if x > _SMALL * _SMALL:
        return sincos_k(angle + change)
    y = x * x
    sine = 1.0 - x / 6 + y * (1 / 120 - x / 5040)  # sine of the change over the change
    versine = 1 / 2 - x / 24 + y * (1 / 720 - x / 40320)  # 1 − cosine over its square
    # the products with s and c do not depend on the series, which shortens the chain of stages
    return s + ((c * change) * sine - (s * x) * versine), c - ((s * change) * sine + (c * x) * versine)


@inline
def _rates_k(
    sr: float, cr: float, sp: float, cp: float, wx: float, wy: float, wz: float
) -> tuple[float, float, float]:  # fmt: skip
    """Angle rates of the body's rate relative to the navigation frame."""
    if abs(cp) < _LEAST_COS:
        cp = _LEAST_COS if cp >= 0.0 else -_LEAST_COS
    secant = 1.0 / cp
    turn = secant * (wy * sr + wz * cr)
    return wx + sp * turn, wy * cr - wz * sr, turn


@inline
def _seen_after_k(rx: float, ry: float, rz: float, x: float, y: float, z: float) -> Vector:
    """A vector in axes rotated by the small rotation vector r: exp(−[r×]) to the third order."""
    ax, ay, az = less_cross_k(x, y, z, rx / 3.0, ry / 3.0, rz / 3.0, x, y, z)
    ax, ay, az = less_cross_k(x, y, z, 0.5 * rx, 0.5 * ry, 0.5 * rz, ax, ay, az)
    return less_cross_k(x, y, z, rx, ry, rz, ax, ay, az)


@inline
def step_k(attitude: Attitude, body: BodyTurn, frame: FrameTurn) -> Attitude:
    """Attitude variables at the end of the interval."""
    roll, pitch, heading, hsr, hcr, hsp, hcp, hsh, hch, age = attitude
    c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_k(attitude)
    sr, cr = _doubled_k(hsr, hcr)
    sp, cp = _doubled_k(hsp, hcp)
    # body rate at s = −½, 0, ½ minus the frame's
    ax, ay, az = (
        body.a1_x - 0.5 * body.a2_x + 0.25 * body.a3_x,
        body.a1_y - 0.5 * body.a2_y + 0.25 * body.a3_y,
        body.a1_z - 0.5 * body.a2_z + 0.25 * body.a3_z,
    )
    bx, by, bz = ax + body.a2_x, ay + body.a2_y, az + body.a2_z
    un, ue, ud = frame.u0_x, frame.u0_y, frame.u0_z
    ax -= c11 * un + c21 * ue + c31 * ud
    ay -= c12 * un + c22 * ue + c32 * ud
    az -= c13 * un + c23 * ue + c33 * ud
    un, ue, ud = frame.um_x, frame.um_y, frame.um_z
    ux, uy, uz = _seen_after_k(
        0.5 * body.a1_x - body.a2_x / 8.0 + body.a3_x / 24.0,
        0.5 * body.a1_y - body.a2_y / 8.0 + body.a3_y / 24.0,
        0.5 * body.a1_z - body.a2_z / 8.0 + body.a3_z / 24.0,
        c11 * un + c21 * ue + c31 * ud,
        c12 * un + c22 * ue + c32 * ud,
        c13 * un + c23 * ue + c33 * ud,
    )
    mx, my, mz = body.a1_x - ux, body.a1_y - uy, body.a1_z - uz
    un, ue, ud = frame.u1_x, frame.u1_y, frame.u1_z
    ux, uy, uz = _seen_after_k(
        body.phi_x,
        body.phi_y,
        body.phi_z,
        c11 * un + c21 * ue + c31 * ud,
        c12 * un + c22 * ue + c32 * ud,
        c13 * un + c23 * ue + c33 * ud,
    )
    bx, by, bz = bx - ux, by - uy, bz - uz
    # the stages; the rates do not depend on heading
    k1r, k1p, k1h = _rates_k(sr, cr, sp, cp, ax, ay, az)
    sr1, cr1 = _turned_k(roll, 0.5 * k1r, sr, cr)
    sp1, cp1 = _turned_k(pitch, 0.5 * k1p, sp, cp)
    k2r, k2p, k2h = _rates_k(sr1, cr1, sp1, cp1, mx, my, mz)
    sr1, cr1 = _turned_k(roll, 0.5 * k2r, sr, cr)
    sp1, cp1 = _turned_k(pitch, 0.5 * k2p, sp, cp)
    k3r, k3p, k3h = _rates_k(sr1, cr1, sp1, cp1, mx, my, mz)
    sr1, cr1 = _turned_k(roll, k3r, sr, cr)
    sp1, cp1 = _turned_k(pitch, k3p, sp, cp)
    k4r, k4p, k4h = _rates_k(sr1, cr1, sp1, cp1, bx, by, bz)
    roll1 = (k1r + 2.0 * (k2r + k3r) + k4r) / 6.0
    pitch1 = (k1p + 2.0 * (k2p + k3p) + k4p) / 6.0
    heading1 = (k1h + 2.0 * (k2h + k3h) + k4h) / 6.0
    if age == _FRESH_EVERY:
        hsr, hcr = sincos_k(0.5 * roll)
        hsp, hcp = sincos_k(0.5 * pitch)
        hsh, hch = sincos_k(0.5 * heading)
        age = 0
    hsr, hcr = _turned_k(0.5 * roll, 0.5 * roll1, hsr, hcr)
    hsp, hcp = _turned_k(0.5 * pitch, 0.5 * pitch1, hsp, hcp)
    hsh, hch = _turned_k(0.5 * heading, 0.5 * heading1, hsh, hch)
    return roll + roll1, pitch + pitch1, heading + heading1, hsr, hcr, hsp, hcp, hsh, hch, age + 1
