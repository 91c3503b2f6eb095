"""Coning- and sculling-compensated increments of one interval, to the sixth order.

Attitude and velocity of a body under rate ω and specific force f are one motion of SE(3): Y' = Y (ω, f). Its
logarithm over an interval is given by the sixth-order Magnus series in the commutator-saving form of Blanes, Casas
and Ros (BIT 40, 2000, eq. 3.10), with signs for Y' = Y A. The rotation part is the rotation vector φ, whose
brackets are coning (Bortz 1971); the translation part ν contains sculling and rotation compensation, and the velocity
increment in the axes at the interval's start is Δv = J(φ) ν.
"""

from __future__ import annotations

from sinssim.jit import inline
from sinssim.rotation.kernels import Vector, cross_k

Twist = tuple[float, float, float, float, float, float]


@inline
def bracket_k(
    ax: float, ay: float, az: float, au: float, av: float, aw: float,
    bx: float, by: float, bz: float, bu: float, bv: float, bw: float,
) -> Twist:  # fmt: skip
    """Lie bracket of two twists (ω, f): (ω_a × ω_b, ω_a × f_b + f_a × ω_b)."""
    return (
        ay * bz - az * by,
        az * bx - ax * bz,
        ax * by - ay * bx,
        (ay * bw - az * bv) + (av * bz - aw * by),
        (az * bu - ax * bw) + (aw * bx - au * bz),
        (ax * bv - ay * bu) + (au * by - av * bx),
    )


@inline
def logarithm_k(a0: Twist, a2: Twist, a3: Twist) -> Twist:
    """Rotation vector φ and translation part ν of an interval.

    a0 is the pair of measured increments, a2 and a3 the fitted moments of `sinssim.strapdown.increments.fit`.
    """
    # a1 = a0 − a3/12
    x1, y1, z1 = a0[0] - a3[0] / 12, a0[1] - a3[1] / 12, a0[2] - a3[2] / 12
    u1, v1, w1 = a0[3] - a3[3] / 12, a0[4] - a3[4] / 12, a0[5] - a3[5] / 12
    # C1 = −[a1, a2]
    cx, cy, cz, cu, cv, cw = bracket_k(
        a2[0], a2[1], a2[2], a2[3], a2[4], a2[5], x1, y1, z1, u1, v1, w1
    )  # fmt: skip
    # C2 = [a1, 2 a3 + C1]/60
    dx, dy, dz, du, dv, dw = bracket_k(
        x1, y1, z1, u1, v1, w1,
        2 * a3[0] + cx, 2 * a3[1] + cy, 2 * a3[2] + cz, 2 * a3[3] + cu, 2 * a3[4] + cv, 2 * a3[5] + cw,
    )  # fmt: skip
    # log = a0 + [20 a1 + a3 − C1, a2 + C2]/240
    ex, ey, ez, eu, ev, ew = bracket_k(
        20 * x1 + a3[0] - cx, 20 * y1 + a3[1] - cy, 20 * z1 + a3[2] - cz,
        20 * u1 + a3[3] - cu, 20 * v1 + a3[4] - cv, 20 * w1 + a3[5] - cw,
        a2[0] + dx / 60, a2[1] + dy / 60, a2[2] + dz / 60, a2[3] + du / 60, a2[4] + dv / 60, a2[5] + dw / 60,
    )  # fmt: skip
    s = 1.0 / 240.0
    return a0[0] + s * ex, a0[1] + s * ey, a0[2] + s * ez, a0[3] + s * eu, a0[4] + s * ev, a0[5] + s * ew


@inline
def velocity_increment_k(
    px: float, py: float, pz: float, nx: float, ny: float, nz: float, b: float, c: float
) -> Vector:  # fmt: skip
    """Δv = J(φ) ν = ν + b φ×ν + c φ×(φ×ν) with b = (1 − cos φ)/φ² and c = (φ − sin φ)/φ³."""
    ax, ay, az = cross_k(px, py, pz, nx, ny, nz)
    bx, by, bz = cross_k(px, py, pz, ax, ay, az)
    return nx + b * ax + c * bx, ny + b * ay + c * by, nz + b * az + c * bz
