"""Navigation at three rates (8.20)-(8.28), for a slow processor: level frame with north orientation.

    fast     gyro increments, their compensation, attitude and B
    medium   velocity increments through B, Coriolis and gravity: velocity
    slow     position, radii of curvature, Earth rate Ω, transport rate ω, gravity

The velocity over a medium interval T, with the sum ΔW of its velocity increments, is

    V₁ = V₀ + ΔV − T (2Ω + ω) × (V₀ + ½ ΔV),   ΔV = ½(B₀ + B₁) ΔW + T g

The position over a slow interval follows from the mean of its velocities (trapezoidal rule), the longitude with the
latitude at mid-interval. The results of the slow part are either held until the next computation, or extrapolated
linearly from the last two values. The scheme is therefore of the second order in the medium interval, and of the first
(held) or second (extrapolated) order in the slow one. Its rows are the slow instants, at which all parts are
synchronous.

Like `level`, this is a template over the attitude algorithm.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters, gravity_ned_k
from sinssim.jit import free_inline, with_constants
from sinssim.strapdown.assemble import engines
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.frames.kernels import continued_k
from sinssim.strapdown.frames.level import curvatures_k
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.frames.radii import FORMS
from sinssim.strapdown.frames.vertical import loop_gains_k, vertical_channel_k
from sinssim.strapdown.increments.block_turns import BLOCK, empty_turns_k, turn_in_block_k
from sinssim.strapdown.increments.block_turns import fill_fitted_turns as fill_turns
from sinssim.strapdown.increments.interval import FrameTurn


class Slow(NamedTuple):
    """Results of the slow part: Ω and ω (rad/s), gravity (m/s²), curvatures (1/m)."""

    omega_n: float
    omega_d: float
    transport_n: float
    transport_e: float
    transport_d: float
    gravity_n: float
    gravity_d: float
    k1: float
    k2: float


@free_inline
def _slow_k(
    p: EarthParameters, gravity: int, simplified: bool, lat: float, h: float, vn: float, ve: float
) -> Slow:  # fmt: skip
    """Values of the slow part at a place and a velocity."""
    s, c = sin(lat), cos(lat)
    k1, k2, r2 = curvatures_k(p, simplified, s, h)
    gn, gd = gravity_ned_k(p, gravity, s, c, r2, h)
    return Slow(p.omega * c, -p.omega * s, ve * k2, -vn * k1, -ve * k2 * s / c, gn, gd, k1, k2)


@free_inline
def _ahead_k(now: Slow, before: Slow, x: float) -> Slow:
    """Linear extrapolation by x slow intervals beyond `now`; x = 0 holds."""
    return Slow(
        now.omega_n + x * (now.omega_n - before.omega_n),
        now.omega_d + x * (now.omega_d - before.omega_d),
        now.transport_n + x * (now.transport_n - before.transport_n),
        now.transport_e + x * (now.transport_e - before.transport_e),
        now.transport_d + x * (now.transport_d - before.transport_d),
        now.gravity_n + x * (now.gravity_n - before.gravity_n),
        now.gravity_d + x * (now.gravity_d - before.gravity_d),
        now.k1 + x * (now.k1 - before.k1),
        now.k2 + x * (now.k2 - before.k2),
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
    lat, lon, h = latitude[0], longitude[0], height[0]
    vn, ve, vd = velocity[0, 0], velocity[0, 1], velocity[0, 2]
    attitude = start_k(q_nb[0, 0], q_nb[0, 1], q_nb[0, 2], q_nb[0, 3])
    q0, q1, q2, q3, defect[0] = quaternion_k(attitude)
    now = _slow_k(p, gravity, simplified, lat, h, vn, ve)
    before = now  # at the start the rate of change is unknown
    b11, b12, b13, b21, b22, b23, b31, b32, b33 = dcm_k(attitude)
    # the slow part runs the baro loop
    loop1, loop2, loop3 = loop_gains_k(time_constant, now.gravity_d, now.k2)
    loop_sum = 0.0
    share = 1.0 / medium_per_slow if extrapolate else 0.0  # of a slow interval
    turns, k, begin, filled = empty_turns_k(), first, first, first
    last = first + (time.shape[0] - 1) * medium_per_slow * fast_per_medium

    for row in range(time.shape[0] - 1):
        slow_dt = time[row + 1] - time[row]
        medium_dt = slow_dt / medium_per_slow
        dt = medium_dt / fast_per_medium
        sum_n, sum_e, sum_d = 0.0, 0.0, 0.0
        for medium in range(medium_per_slow):
            # --- fast
            wx, wy, wz = 0.0, 0.0, 0.0
            for fast in range(fast_per_medium):
                wx, wy, wz = wx + dvel[k, 0], wy + dvel[k, 1], wz + dvel[k, 2]
                at = share * (medium + fast / fast_per_medium)
                u0 = _ahead_k(now, before, at)
                u1 = _ahead_k(now, before, at + share / fast_per_medium)
                n0, e0, d0 = dt * (u0.omega_n + u0.transport_n), dt * u0.transport_e, dt * (u0.omega_d + u0.transport_d)
                n1, e1, d1 = dt * (u1.omega_n + u1.transport_n), dt * u1.transport_e, dt * (u1.omega_d + u1.transport_d)
                nm, em, dm = 0.5 * (n0 + n1), 0.5 * (e0 + e1), 0.5 * (d0 + d1)
                if k == filled:
                    begin, filled = k, min(k + BLOCK, last)
                    fill_turns(dtheta, dvel, weights, True, begin, filled, turns)
                body = turn_in_block_k(turns, k - begin)
                attitude = step_k(attitude, body, FrameTurn(nm, em, dm, n0, e0, d0, nm, em, dm, n1, e1, d1))
                k += 1
            # --- medium
            c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_k(attitude)
            dn = 0.5 * ((b11 + c11) * wx + (b12 + c12) * wy + (b13 + c13) * wz)
            de = 0.5 * ((b21 + c21) * wx + (b22 + c22) * wy + (b23 + c23) * wz)
            dd = 0.5 * ((b31 + c31) * wx + (b32 + c32) * wy + (b33 + c33) * wz)
            b11, b12, b13, b21, b22, b23, b31, b32, b33 = c11, c12, c13, c21, c22, c23, c31, c32, c33
            u = _ahead_k(now, before, share * (medium + 0.5))
            cn = 2.0 * u.omega_n + u.transport_n
            ce, cd = u.transport_e, 2.0 * u.omega_d + u.transport_d
            dn, dd = dn + medium_dt * u.gravity_n, dd + medium_dt * u.gravity_d
            mn, me, md = vn + 0.5 * dn, ve + 0.5 * de, vd + 0.5 * dd
            vn1 = vn + dn + medium_dt * (cd * me - ce * md)
            ve1 = ve + de + medium_dt * (cn * md - cd * mn)
            vd1 = vd + dd + medium_dt * (ce * mn - cn * me)
            sum_n, sum_e, sum_d = sum_n + vn + vn1, sum_e + ve + ve1, sum_d + vd + vd1
            vn, ve, vd = vn1, ve1, vd1

        # --- slow
        u = _ahead_k(now, before, 0.5 if extrapolate else 0.0)
        half = 0.5 * medium_dt
        dlat = half * sum_n * u.k1
        lon += half * sum_e * u.k2 / cos(lat + 0.5 * dlat)
        lat += dlat
        h1 = h - half * sum_d
        h, vd, loop_sum = vertical_channel_k(
            vertical, slow_dt, loop1, loop2, loop3, loop_sum, h, h1, vd, height_reference, climb_reference, row
        )
        if lon > pi:
            lon -= 2.0 * pi
        elif lon <= -pi:
            lon += 2.0 * pi
        before = now
        now = _slow_k(p, gravity, simplified, lat, h, vn, ve)

        latitude[row + 1], longitude[row + 1], height[row + 1] = lat, lon, h
        velocity[row + 1, 0], velocity[row + 1, 1], velocity[row + 1, 2] = vn, ve, vd
        r0, r1, r2, r3, defect[row + 1] = quaternion_k(attitude)
        q0, q1, q2, q3 = continued_k(q0, q1, q2, q3, r0, r1, r2, r3)
        q_nb[row + 1, 0], q_nb[row + 1, 1], q_nb[row + 1, 2], q_nb[row + 1, 3] = q0, q1, q2, q3


engine = engines(
    _navigate,
    "three_rate",
    {
        form: {"_slow_k": with_constants(_slow_k, f"slow_{form.replace('-', '_')}", curvatures_k=parts["curvatures_k"])}
        for form, parts in FORMS.items()
    },
)


def solve(problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool) -> None:
    """Navigate at three rates; see `sinssim.strapdown.files.ThreeRateFile`."""
    p = problem
    engine(p.algorithm, p.form)(
        p.time, p.dtheta, p.dvel, p.weights, p.first, p.earth, p.gravity, p.simplified, *p.channel,
        fast_per_medium, medium_per_slow, extrapolate, *p.solution,
    )  # fmt: skip
