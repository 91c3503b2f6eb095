"""Navigation at three rates in the level frames that do not point north: wander, free and transverse azimuth.

The parts and their order are those of `three_rate.level`. The slow part turns the quaternion q_ew by the transport rate
of the mean velocity, with the Earth's axis and the curvatures held or extrapolated to mid-interval:

    q_ew ← q_ew ∘ q(∫ω_ew dt)

The equations are those of `frames.azimuth`. Like it, this is a template over the attitude algorithm, whose variables
here describe q_wb.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import NamedTuple

from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters, q_en_k
from sinssim.jit import free_inline, with_constants
from sinssim.rotation.kernels import multiply_k, quaternion_from_rotation_vector_k
from sinssim.strapdown.assemble import engines
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.frames.azimuth import (
    FREE_AZIMUTH,
    TRANSVERSE,
    azimuth_rule,
    carried_sum_k,
    coriolis_k,
    earth_k,
    into_w_k,
    third_row_k,
    transport_k,
)
from sinssim.strapdown.frames.kernels import continued_k, resolved_k
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.frames.radii import FORMS
from sinssim.strapdown.frames.vertical import loop_gains_k, vertical_channel_k
from sinssim.strapdown.increments.block_turns import BLOCK, empty_turns_k, turn_in_block_k
from sinssim.strapdown.increments.block_turns import fill_fitted_turns as fill_turns
from sinssim.strapdown.increments.interval import FrameTurn


class Slow(NamedTuple):
    """Results of the slow part: Earth's axis k and route's pole p in w, transport rate (rad/s), gravity, curvatures."""

    kx: float
    ky: float
    kz: float
    px: float
    pz: float
    tx: float
    ty: float
    tz: float
    gx: float
    gy: float
    gz: float
    k2: float
    kappa: float


@free_inline
def _slow_k(
    p: EarthParameters, gravity: int, simplified: bool, rule: int,
    kx: float, ky: float, kz: float, px: float, pz: float, h: float, vx: float, vy: float,
) -> Slow:  # fmt: skip
    """Values of the slow part at a place and a velocity."""
    k2, kappa, along, down = earth_k(p, gravity, simplified, kx, ky, kz, h)
    tx, ty, tz = transport_k(rule, p.omega, kx, ky, kz, px, pz, k2, kappa, vx, vy)
    return Slow(kx, ky, kz, px, pz, tx, ty, tz, along * kx, along * ky, down, k2, kappa)


@free_inline
def _ahead_k(now: Slow, before: Slow, x: float) -> Slow:
    """Linear extrapolation by x slow intervals beyond `now`; x = 0 holds."""
    return Slow(
        now.kx + x * (now.kx - before.kx),
        now.ky + x * (now.ky - before.ky),
        now.kz + x * (now.kz - before.kz),
        now.px + x * (now.px - before.px),
        now.pz + x * (now.pz - before.pz),
        now.tx + x * (now.tx - before.tx),
        now.ty + x * (now.ty - before.ty),
        now.tz + x * (now.tz - before.tz),
        now.gx + x * (now.gx - before.gx),
        now.gy + x * (now.gy - before.gy),
        now.gz + x * (now.gz - before.gz),
        now.k2 + x * (now.k2 - before.k2),
        now.kappa + x * (now.kappa - before.kappa),
    )


# A compiled engine: one loop with its state in scalars.
def _navigate(
    time: Array,
    dtheta: Array,
    dvel: Array,
    weights: Array,
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
    fast_per_medium: int,
    medium_per_slow: int,
    extrapolate: bool,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
    of_x: Array,
) -> None:
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
    now = _slow_k(p, gravity, simplified, rule, kx, ky, kz, px, pz, h, vx, vy)
    before = now  # at the start the rate of change is unknown
    b11, b12, b13, b21, b22, b23, b31, b32, b33 = dcm_k(attitude)
    loop1, loop2, loop3 = loop_gains_k(time_constant, now.gz, now.k2)
    loop_sum = 0.0
    share = 1.0 / medium_per_slow if extrapolate else 0.0  # of a slow interval
    turns, k, begin, filled = empty_turns_k(), first, first, first
    last = first + (time.shape[0] - 1) * medium_per_slow * fast_per_medium

    for row in range(time.shape[0] - 1):
        slow_dt = time[row + 1] - time[row]
        medium_dt = slow_dt / medium_per_slow
        dt = medium_dt / fast_per_medium
        sum_x, sum_y, sum_z = 0.0, 0.0, 0.0
        for medium in range(medium_per_slow):
            # --- fast
            wx, wy, wz = 0.0, 0.0, 0.0
            for fast in range(fast_per_medium):
                wx, wy, wz = wx + dvel[k, 0], wy + dvel[k, 1], wz + dvel[k, 2]
                at = share * (medium + fast / fast_per_medium)
                u = _ahead_k(now, before, at)
                x0, y0, z0 = dt * (omega * u.kx + u.tx), dt * (omega * u.ky + u.ty), dt * (omega * u.kz + u.tz)
                u = _ahead_k(now, before, at + share / fast_per_medium)
                x1, y1, z1 = dt * (omega * u.kx + u.tx), dt * (omega * u.ky + u.ty), dt * (omega * u.kz + u.tz)
                xm, ym, zm = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1)
                if k == filled:
                    begin, filled = k, min(k + BLOCK, last)
                    fill_turns(dtheta, dvel, weights, True, begin, filled, turns)
                body = turn_in_block_k(turns, k - begin)
                attitude = step_k(attitude, body, FrameTurn(xm, ym, zm, x0, y0, z0, xm, ym, zm, x1, y1, z1))
                k += 1
            # --- medium
            c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_k(attitude)
            mean = (b11 + c11, b12 + c12, b13 + c13, b21 + c21, b22 + c22, b23 + c23, b31 + c31, b32 + c32, b33 + c33)
            dx, dy, dz = resolved_k(mean, 0.5 * wx, 0.5 * wy, 0.5 * wz)
            b11, b12, b13, b21, b22, b23, b31, b32, b33 = c11, c12, c13, c21, c22, c23, c31, c32, c33
            u = _ahead_k(now, before, share * (medium + 0.5))
            dx, dy, dz = dx + medium_dt * u.gx, dy + medium_dt * u.gy, dz + medium_dt * u.gz
            ax, ay, az = coriolis_k(
                omega, u.kx, u.ky, u.kz, u.tx, u.ty, u.tz, vx + 0.5 * dx, vy + 0.5 * dy, vz + 0.5 * dz
            )
            vx1, vy1, vz1 = vx + dx + medium_dt * ax, vy + dy + medium_dt * ay, vz + dz + medium_dt * az
            sum_x, sum_y, sum_z = sum_x + vx + vx1, sum_y + vy + vy1, sum_z + vz + vz1
            vx, vy, vz = vx1, vy1, vz1

        # --- slow
        u = _ahead_k(now, before, 0.5 if extrapolate else 0.0)
        half = 0.5 * medium_dt
        rx, ry, rz = transport_k(rule, omega, u.kx, u.ky, u.kz, u.px, u.pz, u.k2, u.kappa, half * sum_x, half * sum_y)
        if rule == FREE_AZIMUTH:
            rz *= slow_dt
        r0, r1, r2, r3 = quaternion_from_rotation_vector_k(rx, ry, rz)
        # e + e ∘ (r − 1): a step is a million times smaller than e and would lose half its digits
        d0, d1, d2, d3 = multiply_k(e0, e1, e2, e3, -(r1 * r1 + r2 * r2 + r3 * r3) / (1.0 + r0), r1, r2, r3)
        e0, l0 = carried_sum_k(e0, l0, d0)
        e1, l1 = carried_sum_k(e1, l1, d1)
        e2, l2 = carried_sum_k(e2, l2, d2)
        e3, l3 = carried_sum_k(e3, l3, d3)
        h1 = h - half * sum_z
        h, vz, loop_sum = vertical_channel_k(
            vertical, slow_dt, loop1, loop2, loop3, loop_sum, h, h1, vz, height_reference, climb_reference, row
        )
        kx, ky, kz = third_row_k(e0, e1, e2, e3)
        if rule == TRANSVERSE:
            px, py, pz = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
        before = now
        now = _slow_k(p, gravity, simplified, rule, kx, ky, kz, px, pz, h, vx, vy)

        # --- output relative to geodetic north
        azimuth = -atan2(ky, kx)  # of the x axis, from north
        of_x[row + 1] = azimuth
        latitude[row + 1] = atan2(-kz, sqrt(kx * kx + ky * ky))
        longitude[row + 1] = atan2(-2.0 * (e2 * e3 - e0 * e1), -2.0 * (e1 * e3 + e0 * e2))
        height[row + 1] = h
        ca, sa = cos(azimuth), sin(azimuth)
        velocity[row + 1, 0], velocity[row + 1, 1], velocity[row + 1, 2] = ca * vx - sa * vy, sa * vx + ca * vy, vz
        w0, w1, w2, w3, defect[row + 1] = quaternion_k(attitude)
        r0, r1, r2, r3 = multiply_k(cos(0.5 * azimuth), 0.0, 0.0, sin(0.5 * azimuth), w0, w1, w2, w3)
        q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
        q_nb[row + 1, 0], q_nb[row + 1, 1], q_nb[row + 1, 2], q_nb[row + 1, 3] = q0, q1, q2, q3


engine = engines(
    _navigate,
    "three_rate_azimuth",
    {
        form: {"_slow_k": with_constants(_slow_k, f"slow_azimuth_{form.replace('-', '_')}", earth_k=parts["earth_k"])}
        for form, parts in FORMS.items()
    },
)


def solve(problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool) -> None:
    """Navigate at three rates; see `sinssim.strapdown.files.ThreeRateFile`."""
    p = problem
    engine(p.algorithm, p.form)(
        p.time, p.dtheta, p.dvel, p.weights, p.first, p.earth, p.gravity, p.simplified, *p.channel,
        *azimuth_rule(p, frame), fast_per_medium, medium_per_slow, extrapolate, *p.solution, p.azimuth,
    )  # fmt: skip
