"""Navigation at three rates in the inertial frame, with geodetic output.

    fast     gyro increments, their compensation, attitude q_ib and its matrix
    medium   velocity increments through the matrix, gravitation: velocity
    slow     position, the Earth's angle, gravitation

    V₁ = V₀ + ½(C₀ + C₁) ΔW + T G,   r₁ = r₀ + Σ ½(V₀ + V₁) T

There is neither Coriolis nor a frame rate. But gravitation turns in inertial axes with the vehicle and the Earth, by
1e-4 rad/s: held over a slow interval it lags by half of it, which acts as an accelerometer bias of 5 µg at 10 Hz.
Extrapolated it does not. Position and velocity are Earth-referred by the slow part alone.

Like `frames.inertial` this is a template over the attitude algorithm, whose variables here describe q_ib.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

from sinssim.data import Array
from sinssim.earth.kernels import (
    EarthParameters,
    geodetic_sincos_k,
    geodetic_to_ecef_k,
    gravity_ned_k,
    q_en_k,
    radii_k,
)
from sinssim.rotation.kernels import multiply_k, rotate_k
from sinssim.strapdown.assemble import engines
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.frames.inertial import gravitation_k
from sinssim.strapdown.frames.kernels import continued_k, resolved_k
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.frames.vertical import loop_gains_k, vertical_channel_k
from sinssim.strapdown.increments.block_turns import BLOCK, empty_turns_k, turn_in_block_k
from sinssim.strapdown.increments.block_turns import fill_fitted_turns as fill_turns
from sinssim.strapdown.increments.interval import FrameTurn


# A compiled engine: one loop with its state in scalars.
def _navigate(
    time: Array,
    dtheta: Array,
    dvel: Array,
    weights: Array,
    first: int,
    p: EarthParameters,
    gravity: int,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    fast_per_medium: int,
    medium_per_slow: int,
    extrapolate: bool,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
) -> None:
    omega = p.omega
    # --- inertial axes coincide with the Earth's at the first sample
    start = time[0]
    h = height[0]
    x, y, z = geodetic_to_ecef_k(p, latitude[0], longitude[0], h)
    e0, e1, e2, e3 = q_en_k(latitude[0], longitude[0])
    vx, vy, vz = rotate_k(e0, e1, e2, e3, velocity[0, 0], velocity[0, 1], velocity[0, 2])
    vx, vy = vx - omega * y, vy + omega * x
    q0, q1, q2, q3 = q_nb[0, 0], q_nb[0, 1], q_nb[0, 2], q_nb[0, 3]
    r0, r1, r2, r3 = multiply_k(e0, e1, e2, e3, q0, q1, q2, q3)
    attitude = start_k(r0, r1, r2, r3)
    _, _, _, _, defect[0] = quaternion_k(attitude)
    b11, b12, b13, b21, b22, b23, b31, b32, b33 = dcm_k(attitude)
    gx, gy, gz = gravitation_k(p, gravity, 1.0, 0.0, x, y, z)
    ox, oy, oz = gx, gy, gz  # gravitation one slow interval before; at the start its rate of change is unknown
    s, c = sin(latitude[0]), cos(latitude[0])
    _, r2 = radii_k(p, s)
    _, gravity_down = gravity_ned_k(p, gravity, s, c, r2, h)
    loop1, loop2, loop3 = loop_gains_k(time_constant, gravity_down, 1.0 / (r2 + h))
    loop_sum = 0.0
    share = 1.0 / medium_per_slow if extrapolate else 0.0  # of a slow interval
    turns, k, begin, filled = empty_turns_k(), first, first, first
    last = first + (time.shape[0] - 1) * medium_per_slow * fast_per_medium

    for row in range(time.shape[0] - 1):
        slow_dt = time[row + 1] - time[row]
        medium_dt = slow_dt / medium_per_slow
        sum_x, sum_y, sum_z = 0.0, 0.0, 0.0
        for medium in range(medium_per_slow):
            # --- fast
            wx, wy, wz = 0.0, 0.0, 0.0
            for _ in range(fast_per_medium):
                wx, wy, wz = wx + dvel[k, 0], wy + dvel[k, 1], wz + dvel[k, 2]
                if k == filled:
                    begin, filled = k, min(k + BLOCK, last)
                    fill_turns(dtheta, dvel, weights, True, begin, filled, turns)
                body = turn_in_block_k(turns, k - begin)
                attitude = step_k(attitude, body, FrameTurn(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                k += 1
            # --- medium
            c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_k(attitude)
            mean = (b11 + c11, b12 + c12, b13 + c13, b21 + c21, b22 + c22, b23 + c23, b31 + c31, b32 + c32, b33 + c33)
            dx, dy, dz = resolved_k(mean, 0.5 * wx, 0.5 * wy, 0.5 * wz)
            b11, b12, b13, b21, b22, b23, b31, b32, b33 = c11, c12, c13, c21, c22, c23, c31, c32, c33
            at = share * (medium + 0.5)
            vx1 = vx + dx + medium_dt * (gx + at * (gx - ox))
            vy1 = vy + dy + medium_dt * (gy + at * (gy - oy))
            vz1 = vz + dz + medium_dt * (gz + at * (gz - oz))
            sum_x, sum_y, sum_z = sum_x + vx + vx1, sum_y + vy + vy1, sum_z + vz + vz1
            vx, vy, vz = vx1, vy1, vz1

        # --- slow
        half = 0.5 * medium_dt
        x, y, z = x + half * sum_x, y + half * sum_y, z + half * sum_z
        angle = omega * (time[row + 1] - start)
        ca, sa = cos(angle), sin(angle)
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
        h, held, loop_sum = vertical_channel_k(
            vertical, slow_dt, loop1, loop2, loop3, loop_sum, h, h1, vd, height_reference, climb_reference, row
        )
        # the channel's corrections are along the local vertical; the inertial velocity also changes by ω × lift
        lift, rise = h - h1, vd - held
        upx, upy = c * (ca * cl - sa * sl), c * (sa * cl + ca * sl)
        x, y, z, vd = x + lift * upx, y + lift * upy, z + lift * s, held
        vx, vy, vz = vx + rise * upx - omega * lift * upy, vy + rise * upy + omega * lift * upx, vz + rise * s
        ox, oy, oz = gx, gy, gz
        gx, gy, gz = gravitation_k(p, gravity, ca, sa, x, y, z)

        latitude[row + 1], longitude[row + 1], height[row + 1] = atan2(s, c), lon, h
        velocity[row + 1, 0], velocity[row + 1, 1], velocity[row + 1, 2] = vn, ve, vd
        r0, r1, r2, r3, defect[row + 1] = quaternion_k(attitude)
        # q_in = (turn about z by the Earth's angle and the longitude) ∘ (about y by −(90° + latitude))
        e0, e1, e2, e3 = q_en_k(latitude[row + 1], lon + angle)
        r0, r1, r2, r3 = multiply_k(e0, -e1, -e2, -e3, r0, r1, r2, r3)
        q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
        q_nb[row + 1, 0], q_nb[row + 1, 1], q_nb[row + 1, 2], q_nb[row + 1, 3] = q0, q1, q2, q3


engine = engines(_navigate, "three_rate_inertial")


def solve(problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool) -> None:
    """Navigate at three rates; see `sinssim.strapdown.files.ThreeRateFile`."""
    p = problem
    engine(p.algorithm)(
        p.time, p.dtheta, p.dvel, p.weights, p.first, p.earth, p.gravity, *p.channel, fast_per_medium, medium_per_slow,
        extrapolate, *p.solution,
    )  # fmt: skip
