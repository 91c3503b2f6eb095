"""Functional iteration (see `functional_iteration`) in the inertial frame, with geodetic output.

    v = v₀ + ∫ (C_ib f + G(r)) dt,   r = r₀ + ∫ v dt

at the Chebyshev points of a window. Gravitation is symmetric about the Earth's axis, so the Earth's angle is not
needed there.
"""

from __future__ import annotations

from math import cos, sin

from sinssim.data import Array
from sinssim.earth.ellipsoid_kernels import gravitation_ecef_k
from sinssim.jit import inline, kernel
from sinssim.rotation.quaternions import Quaternion, Vector, multiply_k
from sinssim.rotation.vectors import add, along, mul
from sinssim.strapdown.frames.inertial import InertialState, coordinates_k, geodetic_k, lifted_k, start_inertial_k
from sinssim.strapdown.frames.navigation_problem import Increments, Models, Problem, Rows, continued_k, keep_k
from sinssim.strapdown.frames.vertical_channel import (
    BARO_LOOP,
    FREE,
    HELD,
    NO_HEIGHT,
    Channel,
    Loop,
    error_after_k,
    loop_gains_k,
)
from sinssim.strapdown.iteration.windows import (
    MOST_ITERATIONS,
    NODES,
    Windows,
    Work,
    body_k,
    height_at_nodes_k,
    integrate_rows_k,
    interpolate_vector_k,
    keep_vector_k,
    resolve_force_k,
    turned_on_k,
    unit_k,
    vector_k,
    windows,
    work_space,
)

# rows of the unknowns
_V, _R, _LOOP = 0, 3, 6
"""Velocity, position, integral part of the baro loop."""


@inline
def _iterate_k(
    of: Models, channel: Channel, gains: Vector, x: InertialState, by_readings: bool, length: float, integral: Array,
    w: Work,
) -> None:  # fmt: skip
    """Find the unknowns at the nodes of a window."""
    w.start[0], w.start[1], w.start[2] = x.v
    w.start[3], w.start[4], w.start[5] = x.r
    w.start[_LOOP] = x.loop.sum
    y, rate, p = w.y, w.rate, of.earth
    g = gravitation_ecef_k(p, of.gravity, *x.r)
    for j in range(NODES):  # initial values: gravitation of the start, position on a straight line
        keep_vector_k(rate, _V, j, along(vector_k(w.force, 0, j), length, g))
        keep_vector_k(rate, _R, j, mul(length, x.v))
    integrate_rows_k(integral, rate, w.start, y)
    for _ in range(MOST_ITERATIONS):
        for j in range(NODES):
            v, r, pushed = vector_k(y, _V, j), vector_k(y, _R, j), (0.0, 0.0, 0.0)
            if channel.number != FREE:
                # the Earth's angle is as if it stood still: its direction up and height are the same
                up = geodetic_k(p, (1.0, 0.0), r, v)
                cl, sl = up.longitude
                c, s = up.latitude
                n = c * cl, c * sl, s
                if channel.number == HELD:
                    r = along(r, w.reference[j] - up.h, n)
                    v = along(v, up.v[2] - w.climb[j], n)
                else:
                    e = x.loop.error if by_readings else up.h - w.reference[j]
                    lift, rise = -gains[0] * e, -(gains[1] * e + y[_LOOP, j])
                    v = along(v, lift, n)
                    # the Earth-relative velocity changes by the rise alone; the inertial one also by ω × lift
                    pushed = add(mul(rise, n), (-p.omega * lift * n[1], p.omega * lift * n[0], 0.0))
                    rate[_LOOP, j] = length * gains[2] * e
            g = add(gravitation_ecef_k(p, of.gravity, *r), pushed)
            keep_vector_k(rate, _V, j, along(vector_k(w.force, 0, j), length, g))
            keep_vector_k(rate, _R, j, mul(length, v))
        # the next change is smaller by the change of gravitation in the window, 1e-5 or less
        if integrate_rows_k(integral, rate, w.start, y) < 1e-10:
            break


@kernel
def _navigate(
    block: Windows, data: Increments, of: Models, channel: Channel, rows: Rows, gains: Vector, w: Work,
    x: InertialState, a: Quaternion,
) -> tuple[InertialState, Quaternion]:  # fmt: skip
    by_readings = channel.number == BARO_LOOP and channel.height[0] > NO_HEIGHT
    for n in range(block.first.shape[0]):
        first, t = block.first[n], block.table[n]
        length, edge = data.time[first + block.size[n]] - data.time[first], block.edge[t]
        body_k(data.dtheta, data.dvel, block.fit[n], block.rate[t], block.integral, w.body_rate, w.work, w.q, w.force)
        resolve_force_k(a, w.force)
        if channel.number != 0 and not by_readings:
            height_at_nodes_k(
                channel.number, block.height[t], block.fit[n], channel.height, channel.climb, w.reference, w.climb
            )
        _iterate_k(of, channel, gains, x, by_readings, length, block.integral, w)
        # geodetic output at the end of each sample
        q_ib, error = a, x.loop.error
        for i in range(block.size[n]):
            k = first + i + 1
            v, r = interpolate_vector_k(edge, i, w.y, _V), interpolate_vector_k(edge, i, w.y, _R)
            angle = of.earth.omega * (data.time[k] - data.time[0])
            turn = cos(angle), sin(angle)
            north = geodetic_k(of.earth, turn, r, v)
            if channel.number == HELD:
                lift, rise = channel.height[k] - north.h, north.v[2] - channel.climb[k]
                r, v = lifted_k(of.earth, north, r, v, lift, rise)
                north = geodetic_k(of.earth, turn, r, v)
            elif by_readings:
                error = error_after_k(channel.height[k], north.h, error)
            q_ib = turned_on_k(a, edge, i, w.q)
            unit, rows.defect[k] = unit_k(q_ib)
            latitude, longitude, q_ni = coordinates_k(north)
            before = rows.q_nb[k - 1, 0], rows.q_nb[k - 1, 1], rows.q_nb[k - 1, 2], rows.q_nb[k - 1, 3]
            keep_k(rows, k, latitude, longitude, north.h, north.v, continued_k(before, multiply_k(*q_ni, *unit)))
            x = InertialState(r, v, x.g, north, x.loop)
        # the next window starts at the end of the last sample
        a, x = q_ib, InertialState(x.r, x.v, x.g, x.north, Loop(w.y[_LOOP, NODES - 1], error))
    return x, a


def solve(problem: Problem, frame: str) -> None:
    """Navigate in the inertial frame, which has no radii of curvature and no azimuth.

    Args:
        problem: increments, models and initial state; its solution is filled in.
        frame: "inertial".
    """
    p = problem
    x, q_in, down, k2 = start_inertial_k(p.models, p.solution, Loop(0.0, 0.0))
    gains = loop_gains_k(p.channel.time_constant, down, k2)
    a = multiply_k(*q_in, *map(float, p.q_nb[0]))
    p.defect[0] = 0.0
    w = work_space(7)
    for block in windows(p.time, p.uniform):
        x, a = _navigate(block, p.increments, p.models, p.channel, p.solution, gains, w, x, a)
