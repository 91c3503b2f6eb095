"""Navigation in the inertial frame, with geodetic output: no frame rate, no Coriolis, no poles.

Velocity and position:   v̇_i = C_ib f + G(r_i),   ṙ_i = v_i,   G gravitation alone.

Velocity is integrated from the compensated increments and gravitation by Hermite's rule (values and rates of change at
both ends), position by Hermite's rule on the velocity, to the fourth order. The attitude algorithm's variables describe
q_ib here, so the rotation of the frame is zero. Like `level`, this is a template over the attitude algorithm.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

from sinssim.data import Array
from sinssim.earth.kernels import (
    EarthParameters,
    geodetic_sincos_k,
    geodetic_to_ecef_k,
    gravitation_ecef_k,
    gravity_ned_k,
    q_en_k,
    radii_k,
)
from sinssim.jit import free_inline
from sinssim.rotation.kernels import Vector, half_angle_k, multiply_k, rotate_k
from sinssim.strapdown.assemble import engines
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.frames.kernels import continued_k, resolved_k
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.frames.vertical import BARO_LOOP, HELD, baro_loop_k, loop_gains_k
from sinssim.strapdown.increments.block_turns import BLOCK, empty_turns_k, turn_in_block_k
from sinssim.strapdown.increments.block_turns import fill_fitted_turns as fill_turns
from sinssim.strapdown.increments.interval import FrameTurn


@free_inline
def gravitation_k(p: EarthParameters, gravity: int, c: float, s: float, x: float, y: float, z: float) -> Vector:
    """Gravitation in inertial axes; c, s are cosine and sine of the Earth's angle."""
    gx, gy, gz = gravitation_ecef_k(p, gravity, c * x + s * y, c * y - s * x, z)
    return c * gx - s * gy, s * gx + c * gy, gz


@free_inline
def _gravitation_rate_k(gm: float, x: float, y: float, z: float, vx: float, vy: float, vz: float) -> Vector:
    """Rate of change of a central body's gravitation along a motion, for the small term of Hermite's rule."""
    inverse = 1.0 / (x * x + y * y + z * z)
    factor = -gm * inverse * sqrt(inverse)
    radial = 3.0 * inverse * (x * vx + y * vy + z * vz)
    return factor * (vx - radial * x), factor * (vy - radial * y), factor * (vz - radial * z)


# A compiled engine: one loop with its state in scalars.
def _navigate(
    time: Array,
    dtheta: Array,
    dvel: Array,
    weights: Array,
    uniform: bool,
    first: int,
    p: EarthParameters,
    gravity: int,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
) -> None:
    count = time.shape[0] - 1
    omega = p.omega
    # --- inertial axes coincide with the Earth's at the first sample
    start = time[0]
    x, y, z = geodetic_to_ecef_k(p, latitude[0], longitude[0], height[0])
    e0, e1, e2, e3 = q_en_k(latitude[0], longitude[0])
    vx, vy, vz = rotate_k(e0, e1, e2, e3, velocity[0, 0], velocity[0, 1], velocity[0, 2])
    vx, vy = vx - omega * y, vy + omega * x
    q0, q1, q2, q3 = q_nb[0, 0], q_nb[0, 1], q_nb[0, 2], q_nb[0, 3]
    r0, r1, r2, r3 = multiply_k(e0, e1, e2, e3, q0, q1, q2, q3)
    attitude = start_k(r0, r1, r2, r3)
    _, _, _, _, defect[0] = quaternion_k(attitude)
    gx, gy, gz = gravitation_k(p, gravity, 1.0, 0.0, x, y, z)
    s, c = sin(latitude[0]), cos(latitude[0])
    _, r2 = radii_k(p, s)
    _, gravity_down = gravity_ned_k(p, gravity, s, c, r2, height[0])
    loop1, loop2, loop3 = loop_gains_k(time_constant, gravity_down, 1.0 / (r2 + height[0]))
    loop_sum = 0.0
    h = height[0]
    turns = empty_turns_k()

    for k in range(count):
        dt = time[k + 1] - time[k]
        if k % BLOCK == 0:
            fill_turns(dtheta, dvel, weights, uniform, first + k, first + min(k + BLOCK, count), turns)
        b = turn_in_block_k(turns, k % BLOCK)
        c_ib = dcm_k(attitude)
        dx, dy, dz = resolved_k(c_ib, b.dv_x, b.dv_y, b.dv_z)
        # change of the specific force over the interval, times dt
        fx, fy, fz = b.fs_x - b.fe_x, b.fs_y - b.fe_y, b.fs_z - b.fe_z
        fx, fy, fz = resolved_k(c_ib, fx, fy, fz)
        # gravitation at the end: the position is accurate to the third order without it
        sixth = dt * dt / 6.0
        x1 = x + dt * (vx + 0.5 * dx + fx / 12.0) + 0.5 * dt * dt * gx
        y1 = y + dt * (vy + 0.5 * dy + fy / 12.0) + 0.5 * dt * dt * gy
        z1 = z + dt * (vz + 0.5 * dz + fz / 12.0) + 0.5 * dt * dt * gz
        angle = omega * (time[k + 1] - start)
        ca, sa = cos(angle), sin(angle)
        gx1, gy1, gz1 = gravitation_k(p, gravity, ca, sa, x1, y1, z1)
        jx, jy, jz = _gravitation_rate_k(p.gm, x, y, z, vx, vy, vz)
        kx, ky, kz = _gravitation_rate_k(p.gm, x1, y1, z1, vx + dx + dt * gx, vy + dy + dt * gy, vz + dz + dt * gz)
        twelfth = dt * dt / 12.0
        vx1 = vx + dx + 0.5 * dt * (gx + gx1) + twelfth * (jx - kx)
        vy1 = vy + dy + 0.5 * dt * (gy + gy1) + twelfth * (jy - ky)
        vz1 = vz + dz + 0.5 * dt * (gz + gz1) + twelfth * (jz - kz)
        # ∫∫G = dt²/6 (2 G₀ + G₁) + …: G is sufficiently linear over the interval
        x += dt * (vx + 0.5 * dx + fx / 12.0) + sixth * (2.0 * gx + gx1)
        y += dt * (vy + 0.5 * dy + fy / 12.0) + sixth * (2.0 * gy + gy1)
        z += dt * (vz + 0.5 * dz + fz / 12.0) + sixth * (2.0 * gz + gz1)
        vx, vy, vz, gx, gy, gz = vx1, vy1, vz1, gx1, gy1, gz1
        attitude = step_k(attitude, b, FrameTurn(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))

        # --- geodetic output
        xe, ye = ca * x + sa * y, ca * y - sa * x
        rho = sqrt(xe * xe + ye * ye)
        s, c, h1 = geodetic_sincos_k(p, rho, z)
        lon = atan2(ye, xe)
        # velocity relative to the Earth in Earth-fixed axes, then east, north, down
        ux, uy = vx + omega * y, vy - omega * x
        ux, uy = ca * ux + sa * uy, ca * uy - sa * ux
        cl, sl = (xe / rho, ye / rho) if rho > 0.0 else (1.0, 0.0)
        radial = cl * ux + sl * uy
        vn, ve, vd = c * vz - s * radial, cl * uy - sl * ux, -c * radial - s * vz

        # --- vertical channel: corrections along the local vertical
        if vertical != 0:
            lift, rise = 0.0, 0.0
            if vertical == BARO_LOOP:
                held, v_down, loop_sum = baro_loop_k(dt, loop1, loop2, loop3, loop_sum, h, h1, vd, height_reference, k)
                lift, rise = held - h1, vd - v_down
            elif vertical == HELD:
                lift, rise = height_reference[k + 1] - h1, vd - climb_reference[k + 1]
            h1, vd = h1 + lift, vd - rise
            upx, upy = c * (ca * cl - sa * sl), c * (sa * cl + ca * sl)
            x, y, z = x + lift * upx, y + lift * upy, z + lift * s
            # the Earth-relative velocity changes by the rise alone; the inertial one also by ω × lift
            vx, vy, vz = vx + rise * upx - omega * lift * upy, vy + rise * upy + omega * lift * upx, vz + rise * s
            gx, gy, gz = gravitation_k(p, gravity, ca, sa, x, y, z)
        h = h1

        latitude[k + 1], longitude[k + 1], height[k + 1] = atan2(s, c), lon, h
        velocity[k + 1, 0], velocity[k + 1, 1], velocity[k + 1, 2] = vn, ve, vd
        r0, r1, r2, r3, defect[k + 1] = quaternion_k(attitude)
        # q_in = (turn about z by the Earth's angle and the longitude) ∘ (about y by −(90° + latitude))
        cy, sy = half_angle_k(-s, -c)
        cz, sz = half_angle_k(ca * cl - sa * sl, sa * cl + ca * sl)
        e0, e1, e2, e3 = cz * cy, -sz * sy, cz * sy, sz * cy
        r0, r1, r2, r3 = multiply_k(e0, -e1, -e2, -e3, r0, r1, r2, r3)
        q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
        q_nb[k + 1, 0], q_nb[k + 1, 1], q_nb[k + 1, 2], q_nb[k + 1, 3] = q0, q1, q2, q3


engine = engines(_navigate, "inertial")


def solve(problem: Problem, frame: str) -> None:
    """Navigate in the inertial frame; see `sinssim.strapdown.files.FrameFile`."""
    p = problem
    engine(p.algorithm)(
        p.time, p.dtheta, p.dvel, p.weights, p.uniform, p.first, p.earth, p.gravity, *p.channel, *p.solution
    )  # fmt: skip


def check(problem: Problem, frame: str) -> None:
    """Accept every solution: the inertial frame can be used everywhere."""
