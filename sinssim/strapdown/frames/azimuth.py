"""Navigation in local-level frames that do not point north, over the poles: wander, free and transverse azimuth.

The frame w has its z axis down and its x axis at some azimuth. Position and azimuth are one quaternion q_ew. With the
Earth's axis k in w-coordinates (its z component is −sin φ) the equations are regular at the poles:

Transport rate:   ω_ew = −ẑ × (K v) + ω_z ẑ,   K v = v/(R₂+h) + κ (k_h·v) k_h,
                  κ = (1/(R₁+h) − 1/(R₂+h))/cos²φ = e² R₂/((1 − e² sin²φ)(R₁+h)(R₂+h)),  k_h the horizontal part of k
Azimuth:          wander ω_z = 0;  free ω_z = −ω k_z (zero relative to inertial space);
                  transverse ω_z = ω_x p_z/p_x, which keeps x towards the pole p of the route's great circle and
                  grows without bound near p: `sinssim.earth.transverse` has the limit
Velocity:         v̇ = C_wb f + g − (2ω_ie + ω_ew) × v

The integration scheme is that of `level`: compensated increments, Simpson's rule, Hermite values at mid-interval. Like
the level engine this is a template over the attitude algorithm, whose variables here describe q_wb.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np

from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters, gravity_ned_k, q_en_k, radii_k
from sinssim.earth.transverse import route_pole, too_near
from sinssim.errors import RunError
from sinssim.jit import free_inline, strict_inline
from sinssim.rotation.kernels import Vector, cross_k, half_angle_k, multiply_k, quaternion_from_rotation_vector_k
from sinssim.strapdown.assemble import engines
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.frames.kernels import continued_k, resolved_k
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.frames.radii import FORMS
from sinssim.strapdown.frames.vertical import loop_gains_k, vertical_channel_k
from sinssim.strapdown.increments.block_turns import BLOCK, empty_turns_k, turn_in_block_k
from sinssim.strapdown.increments.block_turns import fill_fitted_turns as fill_turns
from sinssim.strapdown.increments.interval import frame_turn_k

WANDER, FREE_AZIMUTH, TRANSVERSE = 0, 1, 2
"""Rules for the azimuth by number."""

_RULES = {"wander": WANDER, "free-azimuth": FREE_AZIMUTH, "transverse": TRANSVERSE}


@free_inline
def earth_k(
    p: EarthParameters, gravity: int, simplified: bool, kx: float, ky: float, kz: float, h: float
) -> tuple[float, float, float, float]:
    """1/(R₂+h), κ, gravity along k_h per unit of it, gravity down."""
    s = -kz
    c = sqrt(kx * kx + ky * ky)
    r1, r2 = radii_k(p, s)
    north, down = gravity_ned_k(p, gravity, s, c, r2, h)
    along = north / c if c > 0.0 else 0.0  # north gravity is proportional to cos φ
    if simplified:  # (8.16)
        return (1.0 - 0.5 * p.e2 * s * s - h / p.a) / p.a, p.e2 / p.a, along, down
    k2 = 1.0 / (r2 + h)
    return k2, p.e2 * r2 / (1.0 - p.e2 * s * s) * k2 / (r1 + h), along, down


@free_inline
def transport_k(
    rule: int, omega: float, kx: float, ky: float, kz: float, px: float, pz: float,
    k2: float, kappa: float, vx: float, vy: float,
) -> Vector:  # fmt: skip
    """ω_ew in w-axes."""
    along = kappa * (kx * vx + ky * vy)
    wx, wy = k2 * vy + along * ky, -k2 * vx - along * kx
    if rule == WANDER:
        return wx, wy, 0.0
    if rule == FREE_AZIMUTH:
        return wx, wy, -omega * kz
    return wx, wy, wx * pz / px


@free_inline
def coriolis_k(
    omega: float, kx: float, ky: float, kz: float, wx: float, wy: float, wz: float, vx: float, vy: float, vz: float
) -> Vector:
    """−(2ω_ie + ω_ew) × v."""
    ax, ay, az = 2.0 * omega * kx + wx, 2.0 * omega * ky + wy, 2.0 * omega * kz + wz
    return az * vy - ay * vz, ax * vz - az * vx, ay * vx - ax * vy


@free_inline
def turned_k(x: float, y: float, z: float, rx: float, ry: float, rz: float) -> Vector:
    """A vector fixed in space, in axes that rotate by the small rotation vector r (to the third order)."""
    ax, ay, az = cross_k(rx, ry, rz, x, y, z)
    bx, by, bz = cross_k(rx, ry, rz, ax, ay, az)
    return x - ax + 0.5 * bx, y - ay + 0.5 * by, z - az + 0.5 * bz


@free_inline
def third_row_k(q0: float, q1: float, q2: float, q3: float) -> Vector:
    """The Earth's axis in w-coordinates: the third row of C_ew."""
    return 2.0 * (q1 * q3 - q0 * q2), 2.0 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3


@free_inline
def into_w_k(q0: float, q1: float, q2: float, q3: float, x: float, y: float, z: float) -> Vector:
    """C_weᵀ… of an Earth-fixed vector: v_w = C_ewᵀ v_e."""
    tx, ty, tz = cross_k(-q1, -q2, -q3, x, y, z)
    ux, uy, uz = cross_k(-q1, -q2, -q3, tx + q0 * x, ty + q0 * y, tz + q0 * z)
    return x + 2.0 * ux, y + 2.0 * uy, z + 2.0 * uz


@strict_inline
def carried_sum_k(total: float, lost: float, step: float) -> tuple[float, float]:
    """A sum and its rounding error, to be added with the next step (Kahan summation)."""
    due = step + lost
    new = total + due
    return new, due - (new - total)


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
    simplified: bool,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    rule: int,
    axis: Array,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
    of_x: Array,
) -> None:
    count = time.shape[0] - 1
    omega = p.omega
    # --- the frame at the start: x at the azimuth in the first row, or towards the route's pole
    h = height[0]
    e0, e1, e2, e3 = q_en_k(latitude[0], longitude[0])
    azimuth = of_x[0]
    if rule == TRANSVERSE:
        px, py, pz = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
        azimuth = atan2(py, px)
    of_x[0] = azimuth
    ch, sh = cos(0.5 * azimuth), sin(0.5 * azimuth)
    e0, e1, e2, e3 = multiply_k(e0, e1, e2, e3, ch, 0.0, 0.0, sh)
    l0, l1, l2, l3 = 0.0, 0.0, 0.0, 0.0  # rounding errors of the additions to it
    w0, w1, w2, w3 = multiply_k(ch, 0.0, 0.0, -sh, q_nb[0, 0], q_nb[0, 1], q_nb[0, 2], q_nb[0, 3])
    attitude = start_k(w0, w1, w2, w3)
    vx = cos(azimuth) * velocity[0, 0] + sin(azimuth) * velocity[0, 1]
    vy = cos(azimuth) * velocity[0, 1] - sin(azimuth) * velocity[0, 0]
    vz = velocity[0, 2]
    q0, q1, q2, q3 = q_nb[0, 0], q_nb[0, 1], q_nb[0, 2], q_nb[0, 3]
    _, _, _, _, defect[0] = quaternion_k(attitude)
    kx, ky, kz = third_row_k(e0, e1, e2, e3)
    px, py, pz = 1.0, 0.0, 0.0
    if rule == TRANSVERSE:
        px, py, pz = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
    k2, kappa, along, down = earth_k(p, gravity, simplified, kx, ky, kz, h)
    loop1, loop2, loop3 = loop_gains_k(time_constant, down, k2)
    loop_sum = 0.0
    ax, ay, az = 0.0, 0.0, 0.0  # acceleration at the end of the previous interval, times dt
    turns = empty_turns_k()

    for k in range(count):
        dt = time[k + 1] - time[k]

        # --- rates at the start
        tx0, ty0, tz0 = transport_k(rule, omega, kx, ky, kz, px, pz, k2, kappa, vx, vy)
        gx0, gy0, gz0 = coriolis_k(omega, kx, ky, kz, tx0, ty0, tz0, vx, vy, vz)
        gx0, gy0, gz0 = gx0 + along * kx, gy0 + along * ky, gz0 + down
        ux0, uy0, uz0 = dt * (omega * kx + tx0), dt * (omega * ky + ty0), dt * (omega * kz + tz0)

        # --- Earth at the end, at an extrapolated position
        rx, ry, rz = transport_k(rule, omega, kx, ky, kz, px, pz, dt * k2, dt * kappa, vx + 0.5 * ax, vy + 0.5 * ay)
        if rule == FREE_AZIMUTH:
            rz *= dt
        kx1, ky1, kz1 = turned_k(kx, ky, kz, rx, ry, rz)
        px1, _, pz1 = turned_k(px, py, pz, rx, ry, rz)
        h_taken = h - dt * (vz + 0.5 * az)
        k2_1, kappa_1, along_1, down_1 = earth_k(p, gravity, simplified, kx1, ky1, kz1, h_taken)

        # --- the body's rotation and specific force over the interval, into the frame of its start
        if k % BLOCK == 0:
            fill_turns(dtheta, dvel, weights, uniform, first + k, first + min(k + BLOCK, count), turns)
        b = turn_in_block_k(turns, k % BLOCK)
        c_wb = dcm_k(attitude)
        dx, dy, dz = resolved_k(c_wb, b.dv_x, b.dv_y, b.dv_z)
        sx, sy, sz = resolved_k(c_wb, b.fs_x, b.fs_y, b.fs_z)
        ex, ey, ez = resolved_k(c_wb, b.fe_x, b.fe_y, b.fe_z)

        # --- velocity at the end, predicted, with Coriolis as at mid-interval
        ax0, ay0, az0 = sx + dt * gx0, sy + dt * gy0, sz + dt * gz0
        # ∫∫a/dt from the end back: what the frame's rotation turns
        hx, hy, hz = 0.5 * dx + (ex - sx) / 12.0, 0.5 * dy + (ey - sy) / 12.0, 0.5 * dz + (ez - sz) / 12.0
        rx, ry, rz = cross_k(ux0, uy0, uz0, hx, hy, hz)
        vxm, vym, vzm = vx + 0.5 * ax0, vy + 0.5 * ay0, vz + 0.5 * az0
        mx, my, mz = transport_k(rule, omega, kx, ky, kz, px, pz, k2, kappa, vxm, vym)
        mx, my, mz = coriolis_k(omega, kx, ky, kz, mx, my, mz, vxm, vym, vzm)
        vx1 = vx + dx - rx + dt * (mx + along * kx)
        vy1 = vy + dy - ry + dt * (my + along * ky)
        vz1 = vz + dz - rz + dt * (mz + down)
        rx, ry, rz = cross_k(ux0, uy0, uz0, ex, ey, ez)
        tx1, ty1, tz1 = transport_k(rule, omega, kx1, ky1, kz1, px1, pz1, k2_1, kappa_1, vx1, vy1)
        gx1, gy1, gz1 = coriolis_k(omega, kx1, ky1, kz1, tx1, ty1, tz1, vx1, vy1, vz1)
        gx1, gy1, gz1 = gx1 + along_1 * kx1, gy1 + along_1 * ky1, gz1 + down_1
        ax, ay, az = ex - rx + dt * gx1, ey - ry + dt * gy1, ez - rz + dt * gz1
        ux1, uy1, uz1 = dt * (omega * kx1 + tx1), dt * (omega * ky1 + ty1), dt * (omega * kz1 + tz1)

        # --- middle of the interval
        vxm = 0.5 * (vx + vx1) + 0.125 * (ax0 - ax)
        vym = 0.5 * (vy + vy1) + 0.125 * (ay0 - ay)
        vzm = 0.5 * (vz + vz1) + 0.125 * (az0 - az)
        bend_h = 0.125 * dt * (vz - vz1)
        bend_x, bend_y, bend_z = 0.125 * dt * (tx0 - tx1), 0.125 * dt * (ty0 - ty1), 0.125 * dt * (tz0 - tz1)
        kxm, kym, kzm = 0.5 * (kx + kx1), 0.5 * (ky + ky1), 0.5 * (kz + kz1)
        rx, ry, rz = cross_k(bend_x, bend_y, bend_z, kxm, kym, kzm)
        kxm, kym, kzm = kxm - rx, kym - ry, kzm - rz
        pxm, pzm = 0.5 * (px + px1), 0.5 * (pz + pz1)
        k2m, kappam = 0.5 * (k2 + k2_1) + k2_1 * k2_1 * bend_h, 0.5 * (kappa + kappa_1)
        along_m, down_m = 0.5 * (along + along_1), 0.5 * (down + down_1) + 2.0 * down_1 * k2_1 * bend_h
        txm, tym, tzm = transport_k(rule, omega, kxm, kym, kzm, pxm, pzm, k2m, kappam, vxm, vym)
        gxm, gym, gzm = coriolis_k(omega, kxm, kym, kzm, txm, tym, tzm, vxm, vym, vzm)
        gxm, gym, gzm = gxm + along_m * kxm, gym + along_m * kym, gzm + down_m
        uxm, uym, uzm = dt * (omega * kxm + txm), dt * (omega * kym + tym), dt * (omega * kzm + tzm)

        # --- velocity and position at the end: −∫ζ × a with ζ = u₀ τ + (u₁ − u₀) τ²/2, and +½∫ζ × (ζ × a)
        wx, wy, wz = ux0 + (ux1 - ux0) / 3.0, uy0 + (uy1 - uy0) / 3.0, uz0 + (uz1 - uz0) / 3.0
        mx, my, mz = cross_k(wx, wy, wz, dx, dy, dz)
        rx, ry, rz = cross_k(wx, wy, wz, hx - mx / 6.0, hy - my / 6.0, hz - mz / 6.0)
        sixth = dt / 6.0
        vx1 = vx + dx - rx + sixth * (gx0 + 4.0 * gxm + gx1)
        vy1 = vy + dy - ry + sixth * (gy0 + 4.0 * gym + gy1)
        vz1 = vz + dz - rz + sixth * (gz0 + 4.0 * gzm + gz1)
        h1 = h - sixth * (vz + 4.0 * vzm + vz1)
        r0, r1, r2, r3 = quaternion_from_rotation_vector_k(
            sixth * (tx0 + 4.0 * txm + tx1), sixth * (ty0 + 4.0 * tym + ty1), sixth * (tz0 + 4.0 * tzm + tz1)
        )
        # e + e ∘ (r − 1): a step is ten million times smaller than e and would lose half its digits
        d0, d1, d2, d3 = multiply_k(e0, e1, e2, e3, -(r1 * r1 + r2 * r2 + r3 * r3) / (1.0 + r0), r1, r2, r3)
        e0, l0 = carried_sum_k(e0, l0, d0)
        e1, l1 = carried_sum_k(e1, l1, d1)
        e2, l2 = carried_sum_k(e2, l2, d2)
        e3, l3 = carried_sum_k(e3, l3, d3)

        # --- vertical channel
        h1, vz1, loop_sum = vertical_channel_k(
            vertical, dt, loop1, loop2, loop3, loop_sum, h, h1, vz1, height_reference, climb_reference, k
        )

        # --- attitude
        frame = frame_turn_k(ux0, uy0, uz0, uxm, uym, uzm, ux1, uy1, uz1)
        attitude = step_k(attitude, b, frame)

        vx, vy, vz, h = vx1, vy1, vz1, h1
        kx, ky, kz = third_row_k(e0, e1, e2, e3)
        if rule == TRANSVERSE:
            px, py, pz = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
        moved_h = h1 - h_taken
        k2, kappa = k2_1 - k2_1 * k2_1 * moved_h, kappa_1
        along, down = along_1, down_1 - 2.0 * down_1 * k2_1 * moved_h

        # --- output relative to geodetic north
        equatorial = sqrt(kx * kx + ky * ky)
        ca, sa = (kx / equatorial, -ky / equatorial) if equatorial > 0.0 else (1.0, 0.0)
        ch, sh = half_angle_k(ca, sa)
        of_x[k + 1] = -atan2(ky, kx)  # azimuth of the x axis, from north
        latitude[k + 1] = atan2(-kz, equatorial)
        longitude[k + 1] = atan2(-2.0 * (e2 * e3 - e0 * e1), -2.0 * (e1 * e3 + e0 * e2))
        height[k + 1] = h
        velocity[k + 1, 0], velocity[k + 1, 1], velocity[k + 1, 2] = ca * vx - sa * vy, sa * vx + ca * vy, vz
        w0, w1, w2, w3, defect[k + 1] = quaternion_k(attitude)
        r0, r1, r2, r3 = multiply_k(ch, 0.0, 0.0, sh, w0, w1, w2, w3)
        q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
        q_nb[k + 1, 0], q_nb[k + 1, 1], q_nb[k + 1, 2], q_nb[k + 1, 3] = q0, q1, q2, q3


engine = engines(_navigate, "azimuth", FORMS)


def azimuth_rule(problem: Problem, frame: str) -> tuple[int, Array]:
    """Return the rule for a frame's azimuth.

    Args:
        problem: the problem, with initial state and route.
        frame: "wander", "free-azimuth" or "transverse".

    Returns:
        The rule's number, and the pole of the route's great circle, Earth-fixed unit vector, (3,); zero without a
        route.
    """
    p, rule = problem, _RULES[frame]
    if rule != TRANSVERSE:
        return rule, np.zeros(3)
    return rule, route_pole(p.mechanization.route, float(p.latitude[0]), float(p.longitude[0]), p.velocity[0])


def solve(problem: Problem, frame: str) -> None:
    """Navigate in a frame of this file; see `sinssim.strapdown.files.FrameFile`."""
    p = problem
    engine(p.algorithm, p.form)(
        p.time, p.dtheta, p.dvel, p.weights, p.uniform, p.first, p.earth, p.gravity, p.simplified, *p.channel,
        *azimuth_rule(p, frame), *p.solution, p.azimuth,
    )  # fmt: skip


def check(problem: Problem, frame: str) -> None:
    """Raise if the solution comes too near to the pole of the transverse frame's route.

    Args:
        problem: the solved problem.
        frame: the other frames of this file can be used everywhere.

    Raises:
        RunError: the solution comes too near.
    """
    p, (rule, pole) = problem, azimuth_rule(problem, frame)
    if rule == TRANSVERSE and (near := too_near(pole, p.time, p.latitude, p.longitude, p.velocity)) is not None:
        raise RunError(near[1], time=float(p.time[near[0]]))
