"""Functional iteration (see `functional_iteration`) in the inertial frame, with geodetic output.

    v = v₀ + ∫ (C_ib f + G(r)) dt,   r = r₀ + ∫ v dt

at the Chebyshev points of a window. Gravitation is symmetric about the Earth's axis, so the Earth's angle is not
needed.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
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
from sinssim.jit import inline, kernel
from sinssim.rotation.kernels import dcm_from_quaternion_k, multiply_k
from sinssim.strapdown.frames.kernels import continued_k
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.frames.vertical import BARO_LOOP, HELD, NO_HEIGHT, loop_gains_k, next_error_k
from sinssim.strapdown.iteration.windows import (
    MOST_ITERATIONS,
    NODES,
    body_k,
    height_at_nodes_k,
    integrate_k,
    interpolate_vector_k,
    largest_change_k,
    turned_on_k,
    windows,
)


@inline
def _up_k(p: EarthParameters, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Direction up and height."""
    rho = sqrt(x * x + y * y)
    s, c, h = geodetic_sincos_k(p, rho, z)
    cl, sl = (x / rho, y / rho) if rho > 0.0 else (1.0, 0.0)
    return c * cl, c * sl, s, h


@kernel
def _navigate(
    first: NDArray[np.intp],
    size: NDArray[np.intp],
    fit: NDArray[np.intp],
    table: NDArray[np.intp],
    rate_table: Array,
    edge_table: Array,
    height_table: Array,
    integral: Array,
    time: Array,
    dtheta: Array,
    dvel: Array,
    p: EarthParameters,
    gravity: int,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    state: Array,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
) -> None:
    omega = p.omega
    body_rate, work, q, force = np.empty((6, NODES)), np.empty((4, NODES)), np.empty((4, NODES)), np.empty((3, NODES))
    y, rate = np.empty((7, NODES)), np.zeros((7, NODES))  # v (0…2), r (3…5), integral part of the baro loop (6)
    reference, climb = np.zeros(NODES), np.zeros(NODES)
    a0, a1, a2, a3 = state[0], state[1], state[2], state[3]  # q_ib
    vx, vy, vz, x, yy, z = state[4], state[5], state[6], state[7], state[8], state[9]
    loop_sum = state[10]
    by_readings = vertical == BARO_LOOP and height_reference[0] > NO_HEIGHT
    q0, q1, q2, q3 = state[11], state[12], state[13], state[14]
    s, c = sin(latitude[0]), cos(latitude[0])
    _, r2 = radii_k(p, s)
    _, gravity_down = gravity_ned_k(p, gravity, s, c, r2, height[0])
    loop1, loop2, loop3 = loop_gains_k(time_constant, gravity_down, 1.0 / (r2 + height[0]))

    for n in range(first.shape[0]):
        start, m, t = first[n], size[n], table[n]
        length = time[start + m] - time[start]
        body_k(dtheta, dvel, fit[n], rate_table[t], integral, body_rate, work, q, force)
        scale = 1.5 - 0.5 * (a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3)
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_from_quaternion_k(
            scale * a0, scale * a1, scale * a2, scale * a3
        )
        gx, gy, gz = gravitation_ecef_k(p, gravity, x, yy, z)
        for j in range(NODES):
            fx, fy, fz = force[0, j], force[1, j], force[2, j]
            force[0, j] = c11 * fx + c12 * fy + c13 * fz
            force[1, j] = c21 * fx + c22 * fy + c23 * fz
            force[2, j] = c31 * fx + c32 * fy + c33 * fz
            # initial values: gravitation of the start, position on a straight line
            rate[0, j] = force[0, j] + length * gx
            rate[1, j] = force[1, j] + length * gy
            rate[2, j] = force[2, j] + length * gz
            rate[3, j], rate[4, j], rate[5, j] = length * vx, length * vy, length * vz
        held_error = height[start] - height_reference[start] if by_readings and start > 0 else 0.0
        if vertical != 0 and not by_readings:
            height_at_nodes_k(vertical, height_table[t], fit[n], height_reference, climb_reference, reference, climb)
        for row in range(7):
            integrate_k(integral, rate, row, (vx, vy, vz, x, yy, z, loop_sum)[row], y)

        for _ in range(MOST_ITERATIONS):
            for j in range(NODES):
                ux, uy, uz = y[0, j], y[1, j], y[2, j]
                rx, ry, rz = y[3, j], y[4, j], y[5, j]
                wx, wy, wz = 0.0, 0.0, 0.0
                if vertical != 0:
                    nx, ny, nz, h = _up_k(p, rx, ry, rz)
                    if vertical == HELD:
                        lift = reference[j] - h
                        rise = -climb[j] - (nx * ux + ny * uy + nz * uz)
                        rx, ry, rz = rx + lift * nx, ry + lift * ny, rz + lift * nz
                        ux, uy, uz = ux + rise * nx, uy + rise * ny, uz + rise * nz
                    else:
                        e = held_error if by_readings else h - reference[j]
                        lift, rise = -loop1 * e, -(loop2 * e + y[6, j])
                        ux, uy, uz = ux + lift * nx, uy + lift * ny, uz + lift * nz
                        # the Earth-relative velocity changes by the rise alone; the inertial one also by ω × lift
                        wx = rise * nx - omega * lift * ny
                        wy, wz = rise * ny + omega * lift * nx, rise * nz
                        rate[6, j] = length * loop3 * e
                gx, gy, gz = gravitation_ecef_k(p, gravity, rx, ry, rz)
                rate[0, j] = force[0, j] + length * (gx + wx)
                rate[1, j] = force[1, j] + length * (gy + wy)
                rate[2, j] = force[2, j] + length * (gz + wz)
                rate[3, j], rate[4, j], rate[5, j] = length * ux, length * uy, length * uz
            endx, endy, endz = y[0, NODES - 1], y[1, NODES - 1], y[2, NODES - 1]
            for row in range(7):
                integrate_k(integral, rate, row, (vx, vy, vz, x, yy, z, loop_sum)[row], y)
            # the next change is smaller by the change of gravitation in the window, 1e-5 or less
            if largest_change_k(y, endx, endy, endz) < 1e-10:
                break

        # --- geodetic output at the end of each sample
        for i in range(m):
            k = start + i + 1
            vx, vy, vz = interpolate_vector_k(edge_table[t], i, y, 0)
            x, yy, z = interpolate_vector_k(edge_table[t], i, y, 3)
            if vertical == HELD:
                nx, ny, nz, h = _up_k(p, x, yy, z)
                lift = height_reference[k] - h
                rise = -climb_reference[k] - (nx * vx + ny * vy + nz * vz)
                x, yy, z = x + lift * nx, yy + lift * ny, z + lift * nz
                vx, vy, vz = vx + rise * nx - omega * lift * ny, vy + rise * ny + omega * lift * nx, vz + rise * nz
            angle = omega * (time[k] - time[0])
            ca, sa = cos(angle), sin(angle)
            xe, ye = ca * x + sa * yy, ca * yy - sa * x
            rho = sqrt(xe * xe + ye * ye)
            s, c, height[k] = geodetic_sincos_k(p, rho, z)
            if by_readings:
                held_error = next_error_k(height_reference, k, height[k], held_error)
            latitude[k], longitude[k] = atan2(s, c), atan2(ye, xe)
            # velocity relative to the Earth in Earth-fixed axes, then north, east, down
            ux, uy = vx + omega * yy, vy - omega * x
            ux, uy = ca * ux + sa * uy, ca * uy - sa * ux
            cl, sl = (xe / rho, ye / rho) if rho > 0.0 else (1.0, 0.0)
            radial = cl * ux + sl * uy
            velocity[k, 0], velocity[k, 1] = c * vz - s * radial, cl * uy - sl * ux
            velocity[k, 2] = -c * radial - s * vz
            b0, b1, b2, b3 = turned_on_k(a0, a1, a2, a3, edge_table[t], i, q)
            scale = 0.5 * (b0 * b0 + b1 * b1 + b2 * b2 + b3 * b3 - 1.0)
            defect[k] = abs(scale)
            scale = 1.0 - scale
            e0, e1, e2, e3 = q_en_k(latitude[k], longitude[k] + angle)
            r0, r1, r2, r3 = multiply_k(e0, -e1, -e2, -e3, scale * b0, scale * b1, scale * b2, scale * b3)
            q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
            q_nb[k, 0], q_nb[k, 1], q_nb[k, 2], q_nb[k, 3] = q0, q1, q2, q3
        # the next window starts at the end of the last sample
        a0, a1, a2, a3 = b0, b1, b2, b3
        loop_sum = y[6, NODES - 1]

    state[0], state[1], state[2], state[3] = a0, a1, a2, a3
    state[4], state[5], state[6], state[7], state[8], state[9] = vx, vy, vz, x, yy, z
    state[10], state[11], state[12], state[13], state[14] = loop_sum, q0, q1, q2, q3


def solve(problem: Problem, frame: str) -> None:
    """Navigate in the inertial frame, which has no radii of curvature and no azimuth.

    Args:
        problem: increments, models and initial state; its solution is filled in.
        frame: "inertial".
    """
    p = problem
    q_en = earth.q_en(p.latitude[0], p.longitude[0])
    state = np.zeros(15)
    state[:4] = rotation.multiply(q_en, p.q_nb[0])  # inertial axes coincide with the Earth's at the first sample
    state[7:10] = geodetic_to_ecef_k(p.earth, p.latitude[0], p.longitude[0], p.height[0])
    state[4:7] = rotation.rotate(q_en, p.velocity[0]) + np.cross([0.0, 0.0, p.earth.omega], state[7:10])
    state[11:15] = p.q_nb[0]
    p.defect[0] = 0.0
    for block in windows(p.time, p.uniform):
        _navigate(
            *block, p.time, p.dtheta, p.dvel, p.earth, p.gravity, *p.channel, state, *p.solution,
        )  # fmt: skip
