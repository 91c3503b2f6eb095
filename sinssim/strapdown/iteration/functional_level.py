"""Functional iteration in the local-level frames: level, wander, free azimuth and transverse.

The level frame is the transverse frame with the Earth's pole. See `functional_iteration` for the method.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import atan2, cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters
from sinssim.jit import bind, kernel
from sinssim.rotation.kernels import dcm_from_quaternion_k, multiply_k, quaternion_from_rotation_vector_k
from sinssim.strapdown.frames.azimuth import (
    TRANSVERSE,
    azimuth_rule,
    coriolis_k,
    earth_k,
    into_w_k,
    third_row_k,
    transport_k,
    turned_k,
)
from sinssim.strapdown.frames.kernels import continued_k
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.frames.radii import FORMS
from sinssim.strapdown.frames.vertical import BARO_LOOP, HELD, NO_HEIGHT, loop_gains_k, next_error_k
from sinssim.strapdown.iteration.windows import (
    MOST_ITERATIONS,
    NODES,
    body_k,
    height_at_nodes_k,
    integrate_k,
    interpolate_k,
    interpolate_vector_k,
    largest_change_k,
    turned_on_k,
    windows,
)


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
    simplified: bool,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    rule: int,
    axis: Array,
    state: Array,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
    of_x: Array,
) -> None:
    omega = p.omega
    body_rate, work, q, force = np.empty((6, NODES)), np.empty((4, NODES)), np.empty((4, NODES)), np.empty((3, NODES))
    # rows of y and its rate: v (0…2), h (3), turn ρ of w relative to the Earth (4…6) and ζ to inertial space (7…9),
    # integral part of the baro loop (10)
    y, rate = np.empty((11, NODES)), np.zeros((11, NODES))
    reference, climb = np.zeros(NODES), np.zeros(NODES)
    e0, e1, e2, e3 = state[0], state[1], state[2], state[3]  # q_ew
    a0, a1, a2, a3 = state[4], state[5], state[6], state[7]  # q_wb
    vx, vy, vz, h = state[8], state[9], state[10], state[11]
    loop_sum = state[12]
    by_readings = vertical == BARO_LOOP and height_reference[0] > NO_HEIGHT
    q0, q1, q2, q3 = state[13], state[14], state[15], state[16]
    kx0, ky0, kz0 = third_row_k(e0, e1, e2, e3)
    k2, kappa, along, down = earth_k(p, gravity, simplified, kx0, ky0, kz0, h)
    loop1, loop2, loop3 = loop_gains_k(time_constant, down, k2)

    for n in range(first.shape[0]):
        start, m, t = first[n], size[n], table[n]
        length = time[start + m] - time[start]
        body_k(dtheta, dvel, fit[n], rate_table[t], integral, body_rate, work, q, force)
        scale = 1.5 - 0.5 * (a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3)
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_from_quaternion_k(
            scale * a0, scale * a1, scale * a2, scale * a3
        )
        for j in range(NODES):
            fx, fy, fz = force[0, j], force[1, j], force[2, j]
            force[0, j] = c11 * fx + c12 * fy + c13 * fz
            force[1, j] = c21 * fx + c22 * fy + c23 * fz
            force[2, j] = c31 * fx + c32 * fy + c33 * fz
        held_error = h - height_reference[start] if by_readings and start > 0 else 0.0
        if vertical != 0 and not by_readings:
            height_at_nodes_k(vertical, height_table[t], fit[n], height_reference, climb_reference, reference, climb)

        # --- initial values: gravity and Coriolis of the start, position on a straight line
        kx0, ky0, kz0 = third_row_k(e0, e1, e2, e3)
        px0, py0, pz0 = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
        k2, kappa, along, down = earth_k(p, gravity, simplified, kx0, ky0, kz0, h)
        tx, ty, tz = transport_k(rule, omega, kx0, ky0, kz0, px0, pz0, k2, kappa, vx, vy)
        gx, gy, gz = coriolis_k(omega, kx0, ky0, kz0, tx, ty, tz, vx, vy, vz)
        for j in range(NODES):
            rate[0, j] = force[0, j] + length * (gx + along * kx0)
            rate[1, j] = force[1, j] + length * (gy + along * ky0)
            rate[2, j] = force[2, j] + length * (gz + down)
            rate[3, j], rate[4, j], rate[5, j], rate[6, j] = -length * vz, length * tx, length * ty, length * tz
            rate[7, j] = length * (omega * kx0 + tx)
            rate[8, j] = length * (omega * ky0 + ty)
            rate[9, j] = length * (omega * kz0 + tz)
        for c in range(11):
            begin = (vx, vy, vz, h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, loop_sum)[c]
            integrate_k(integral, rate, c, begin, y)

        for _ in range(MOST_ITERATIONS):
            for j in range(NODES):
                rx, ry, rz = y[4, j], y[5, j], y[6, j]
                zx, zy, zz = y[7, j], y[8, j], y[9, j]
                kx, ky, kz = turned_k(kx0, ky0, kz0, rx, ry, rz)
                px, _, pz = turned_k(px0, py0, pz0, rx, ry, rz)
                ux, uy, uz, hj = y[0, j], y[1, j], y[2, j], y[3, j]
                if vertical == HELD:
                    uz, hj = climb[j], reference[j]
                k2, kappa, along, down = earth_k(p, gravity, simplified, kx, ky, kz, hj)
                tx, ty, tz = transport_k(rule, omega, kx, ky, kz, px, pz, k2, kappa, ux, uy)
                gx, gy, gz = coriolis_k(omega, kx, ky, kz, tx, ty, tz, ux, uy, uz)
                fx, fy, fz = turned_k(force[0, j], force[1, j], force[2, j], zx, zy, zz)
                rate[0, j] = fx + length * (gx + along * kx)
                rate[1, j] = fy + length * (gy + along * ky)
                rate[2, j] = fz + length * (gz + down)
                rate[3, j] = -length * uz
                # ρ̇ = ω_ew + ½ ρ × ω_ew: further terms are below rounding for such small rotations
                tx, ty, tz = length * tx, length * ty, length * tz
                rate[4, j] = tx + 0.5 * (ry * tz - rz * ty)
                rate[5, j] = ty + 0.5 * (rz * tx - rx * tz)
                rate[6, j] = tz + 0.5 * (rx * ty - ry * tx)
                tx, ty, tz = tx + length * omega * kx, ty + length * omega * ky, tz + length * omega * kz
                rate[7, j] = tx + 0.5 * (zy * tz - zz * ty)
                rate[8, j] = ty + 0.5 * (zz * tx - zx * tz)
                rate[9, j] = tz + 0.5 * (zx * ty - zy * tx)
                if vertical == BARO_LOOP:
                    e = held_error if by_readings else hj - reference[j]
                    rate[3, j] -= length * loop1 * e
                    rate[2, j] += length * (loop2 * e + y[10, j])
                    rate[10, j] = length * loop3 * e
            endx, endy, endz = y[0, NODES - 1], y[1, NODES - 1], y[2, NODES - 1]
            for c in range(11):
                begin = (vx, vy, vz, h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, loop_sum)[c]
                integrate_k(integral, rate, c, begin, y)
            # the next change is smaller by the rotation of the frame in the window, 1e-5
            if largest_change_k(y, endx, endy, endz) < 1e-10:
                break

        # --- output relative to geodetic north at the end of each sample
        for i in range(m):
            k = start + i + 1
            vx, vy, vz = interpolate_vector_k(edge_table[t], i, y, 0)
            h = interpolate_k(edge_table[t], i, y, 3)
            if vertical == HELD:
                vz, h = climb_reference[k], height_reference[k]
            elif by_readings:
                held_error = next_error_k(height_reference, k, h, held_error)
            rx, ry, rz = interpolate_vector_k(edge_table[t], i, y, 4)
            r0, r1, r2, r3 = quaternion_from_rotation_vector_k(rx, ry, rz)
            f0, f1, f2, f3 = multiply_k(e0, e1, e2, e3, r0, r1, r2, r3)
            b0, b1, b2, b3 = turned_on_k(a0, a1, a2, a3, edge_table[t], i, q)
            zx, zy, zz = interpolate_vector_k(edge_table[t], i, y, 7)
            z0, z1, z2, z3 = quaternion_from_rotation_vector_k(-zx, -zy, -zz)
            b0, b1, b2, b3 = multiply_k(z0, z1, z2, z3, b0, b1, b2, b3)
            kx, ky, kz = third_row_k(f0, f1, f2, f3)
            azimuth = -atan2(ky, kx)
            of_x[k] = azimuth
            latitude[k] = atan2(-kz, sqrt(kx * kx + ky * ky))
            longitude[k] = atan2(-2.0 * (f2 * f3 - f0 * f1), -2.0 * (f1 * f3 + f0 * f2))
            height[k] = h
            ca, sa = cos(azimuth), sin(azimuth)
            velocity[k, 0], velocity[k, 1], velocity[k, 2] = ca * vx - sa * vy, sa * vx + ca * vy, vz
            scale = 0.5 * (b0 * b0 + b1 * b1 + b2 * b2 + b3 * b3 - 1.0)
            defect[k] = abs(scale)
            scale = 1.0 - scale
            r0, r1, r2, r3 = multiply_k(
                cos(0.5 * azimuth), 0.0, 0.0, sin(0.5 * azimuth), scale * b0, scale * b1, scale * b2, scale * b3
            )
            q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
            q_nb[k, 0], q_nb[k, 1], q_nb[k, 2], q_nb[k, 3] = q0, q1, q2, q3
        # the next window starts at the end of the last sample
        a0, a1, a2, a3 = b0, b1, b2, b3
        scale = 1.5 - 0.5 * (f0 * f0 + f1 * f1 + f2 * f2 + f3 * f3)
        e0, e1, e2, e3 = scale * f0, scale * f1, scale * f2, scale * f3
        loop_sum = y[10, NODES - 1]

    state[0], state[1], state[2], state[3] = e0, e1, e2, e3
    state[4], state[5], state[6], state[7] = a0, a1, a2, a3
    state[8], state[9], state[10], state[11], state[12] = vx, vy, vz, h, loop_sum
    state[13], state[14], state[15], state[16] = q0, q1, q2, q3


@cache
def _engine(form: str) -> Callable[..., None]:
    """Return the engine with the radii of a form, one of `FORMS`, or of the exact and simplified ones for ""."""
    if not form:
        return _navigate
    plain = getattr(_navigate, "py_func")  # noqa: B009 - of the compiled function
    return bind(plain, f"functional_{form.replace('-', '_')}", earth_k=FORMS[form]["earth_k"])


def solve(problem: Problem, frame: str) -> None:
    """Navigate in a local-level frame.

    Args:
        problem: increments, models and initial state; its solution is filled in.
        frame: "level", or one of `sinssim.strapdown.frames.azimuth`.
    """
    p = problem
    rule, axis = (TRANSVERSE, np.array([0.0, 0.0, 1.0])) if frame == "level" else azimuth_rule(p, frame)
    q_en = earth.q_en(p.latitude[0], p.longitude[0])
    azimuth = float(p.azimuth[0]) if len(p.azimuth) else 0.0
    if rule == TRANSVERSE:
        pole = rotation.rotate(rotation.conjugate(q_en), axis)
        azimuth = atan2(float(pole[1]), float(pole[0]))
    q_nw = np.array([cos(0.5 * azimuth), 0.0, 0.0, sin(0.5 * azimuth)])
    state = np.zeros(17)
    state[:4] = rotation.multiply(q_en, q_nw)
    state[4:8] = rotation.multiply(rotation.conjugate(q_nw), p.q_nb[0])
    state[8:11] = rotation.rotate(rotation.conjugate(q_nw), p.velocity[0])
    state[11] = p.height[0]
    state[13:17] = p.q_nb[0]
    p.defect[0] = 0.0
    of_x = p.azimuth if len(p.azimuth) else np.empty(len(p.time))  # the level frame's own is zero
    of_x[0] = azimuth
    for block in windows(p.time, p.uniform):
        _engine(p.form)(
            *block, p.time, p.dtheta, p.dvel, p.earth, p.gravity, p.simplified, *p.channel, rule, axis, state,
            *p.solution, of_x,
        )  # fmt: skip
