"""Attitude, velocity and position by functional iteration over windows of samples, the reference for comparisons.

Rate and specific force over a window are the polynomials whose integrals over its samples are the increments. The
unknowns are represented by their values at Chebyshev points. The integral equations

    q = 1 + ½ ∫ q ∘ ω dt                                     body, relative to its axes at the window's start
    v = v₀ + ∫ (C_wb f + g − (2ω_ie + ω_ew) × v) dt           likewise position and the rotation of the navigation frame

are iterated (Picard) at these points to rounding, with integrals by the Chebyshev integration matrix. The remaining
error is that of the polynomials. Quaternion: Wu, Y., "RodFIter: attitude reconstruction from inertial measurement by
functional iteration", IEEE Trans. AES 54 (2018) 2131, and Wu, Y., Yan, G., "Attitude reconstruction from inertial
measurements: QuatFIter and its comparison with RodFIter", IEEE Trans. AES 55 (2019) 3629; with velocity and position:
Wu, Y., "iNavFIter: next-generation inertial navigation computation based on functional iteration", IEEE Trans. AES 56
(2020) 2061.

A window has eight samples, and the solution has a row at the end of every sample. Remaining samples at the end are
navigated with a polynomial through the last eight.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import cos, sin

import numpy as np

from sinssim.data import Array
from sinssim.earth.gravity import gravitation_ecef_k
from sinssim.errors import InputError
from sinssim.jit import bind, inline, kernel
from sinssim.rotation.quaternions import Quaternion, Vector, multiply_k, quaternion_from_rotation_vector_k
from sinssim.rotation.vectors import add, along, column, cross, keep_column, mul, turned
from sinssim.strapdown.frames import FRAME_REGISTRY, frames_that
from sinssim.strapdown.frames.inertial import InertialState, coordinates_k, geodetic_k, lifted_k, start_inertial_k
from sinssim.strapdown.frames.navigation_problem import FORMS, Increments, Models, Problem, Rows, continued_k, keep_k
from sinssim.strapdown.frames.vertical_channel import (
    BARO_LOOP,
    FREE,
    HELD,
    NOT_A_HEIGHT,
    Channel,
    Loop,
    error_after_k,
    loop_gains_k,
)
from sinssim.strapdown.frames.wander_free_transverse import (
    TRANSVERSE,
    AzimuthState,
    Place,
    azimuth_rule,
    earth_k,
    north_k,
    place_k,
    rates_k,
    start_azimuth_k,
)
from sinssim.strapdown.iteration_windows import (
    MOST_ITERATIONS,
    NODES,
    Windows,
    Work,
    body_k,
    height_at_nodes_k,
    integrate_rows_k,
    interpolate_k,
    interpolate_vector_k,
    resolve_force_k,
    turned_on_k,
    unit_k,
    windows,
    work_space,
)
from sinssim.units import listed

# rows of the unknowns in the local-level frames
_V, _H, _RHO, _ZETA, _LOOP = 0, 3, 4, 7, 10
"""Velocity, height, turns of w relative to the Earth and to inertial space, integral part of the baro loop."""
_ZERO = (0.0, 0.0, 0.0)


@inline
def _node_k(
    of: Models, rule: int, start: Place, length: float, v: Vector, h: float, rho: Vector, zeta: Vector, f: Vector
) -> tuple[Vector, Vector, Vector]:
    """Rates of v, ρ and ζ at a node, times the window's length; f is the force times it in the axes of the start.

    ρ̇ = ω_ew + ½ ρ × ω_ew: further terms are below rounding for such small rotations.
    """
    k = turned(start.k, rho)
    x = Place(k, turned(start.pole, rho), h, *earth_k(of, k, h))
    t, g, w = rates_k(rule, of.earth.omega, x, v)
    t, w = mul(length, t), mul(length, w)
    return along(turned(f, zeta), length, g), along(t, 0.5, cross(rho, t)), along(w, 0.5, cross(zeta, w))


@inline
def _iterate_level_k(
    of: Models, rule: int, channel: Channel, gains: Vector, start: Place, v: Vector, loop: Loop, by_readings: bool,
    length: float, integral: Array, w: Work,
) -> None:  # fmt: skip
    """Find the unknowns at the nodes of a window."""
    w.start[_V], w.start[_V + 1], w.start[_V + 2] = v
    w.start[_H], w.start[_LOOP] = start.h, loop.sum
    y, rate = w.y, w.rate
    for j in range(NODES):  # initial values: gravity and Coriolis of the start, position on a straight line
        dv, rho, zeta = _node_k(of, rule, start, length, v, start.h, _ZERO, _ZERO, column(w.force, 0, j))
        keep_column(rate, _V, j, dv)
        keep_column(rate, _RHO, j, rho)
        keep_column(rate, _ZETA, j, zeta)
        rate[_H, j] = -length * v[2]
    integrate_rows_k(integral, rate, w.start, y)
    for _ in range(MOST_ITERATIONS):
        for j in range(NODES):
            v, h = column(y, _V, j), y[_H, j]
            if channel.number == HELD:
                v, h = (v[0], v[1], w.climb[j]), w.reference[j]
            dv, rho, zeta = _node_k(
                of, rule, start, length, v, h, column(y, _RHO, j), column(y, _ZETA, j), column(w.force, 0, j)
            )
            keep_column(rate, _V, j, dv)
            keep_column(rate, _RHO, j, rho)
            keep_column(rate, _ZETA, j, zeta)
            rate[_H, j] = -length * v[2]
            if channel.number == BARO_LOOP:
                e = loop.error if by_readings else h - w.reference[j]
                rate[_H, j] -= length * gains[0] * e
                rate[_V + 2, j] += length * (gains[1] * e + y[_LOOP, j])
                rate[_LOOP, j] = length * gains[2] * e
        # the next change is smaller by the rotation of the frame in the window, 1e-5
        if integrate_rows_k(integral, rate, w.start, y) < 1e-10:
            break


# `bind` gives it the form of the radii of curvature.
def _navigate_level(
    block: Windows, data: Increments, of: Models, channel: Channel, rows: Rows, rule: int, axis: Array, of_x: Array,
    w: Work, x: AzimuthState, a: Quaternion,
) -> tuple[AzimuthState, Quaternion]:  # fmt: skip
    by_readings = channel.number == BARO_LOOP and channel.height[0] > NOT_A_HEIGHT
    e, v, h, loop = x.e, x.v, x.x.h, x.loop
    gains = loop_gains_k(channel.time_constant, x.x.down, x.x.k2)
    for n in range(block.first.shape[0]):
        first, t = block.first[n], block.table[n]
        length, edge = data.time[first + block.size[n]] - data.time[first], block.edge[t]
        body_k(data.dtheta, data.dvel, block.fit[n], block.rate[t], block.integral, w.body_rate, w.work, w.q, w.force)
        resolve_force_k(a, w.force)
        if channel.number != 0 and not by_readings:
            height_at_nodes_k(
                channel.number, block.height[t], block.fit[n], channel.height, channel.climb, w.reference, w.climb
            )
        _iterate_level_k(
            of, rule, channel, gains, place_k(of, rule, axis, e, h), v, loop, by_readings, length, block.integral, w
        )
        # output relative to geodetic north at the end of each sample
        q_ew, q_wb, error = e, a, loop.error
        for i in range(block.size[n]):
            k = first + i + 1
            v, h = interpolate_vector_k(edge, i, w.y, _V), interpolate_k(edge, i, w.y, _H)
            if channel.number == HELD:
                v, h = (v[0], v[1], channel.climb[k]), channel.height[k]
            elif by_readings:
                error = error_after_k(channel.height[k], h, error)
            q_ew = multiply_k(*e, *quaternion_from_rotation_vector_k(*interpolate_vector_k(edge, i, w.y, _RHO)))
            back = quaternion_from_rotation_vector_k(*mul(-1.0, interpolate_vector_k(edge, i, w.y, _ZETA)))
            q_wb = multiply_k(*back, *turned_on_k(a, edge, i, w.q))
            x = AzimuthState(q_ew, q_ew, place_k(of, rule, axis, q_ew, h), v, v, loop)
            latitude, longitude, v_n, of_x[k], ch, sh = north_k(x)
            unit, rows.defect[k] = unit_k(q_wb)
            before = rows.q_nb[k - 1, 0], rows.q_nb[k - 1, 1], rows.q_nb[k - 1, 2], rows.q_nb[k - 1, 3]
            keep_k(rows, k, latitude, longitude, h, v_n, continued_k(before, multiply_k(ch, 0.0, 0.0, sh, *unit)))
        # the next window starts at the end of the last sample
        a, (e, _), loop = q_wb, unit_k(q_ew), Loop(w.y[_LOOP, NODES - 1], error)
        x = AzimuthState(e, e, x.x, v, v, loop)
    return x, a


@cache
def _engine(form: str) -> Callable[..., tuple[AzimuthState, Quaternion]]:
    """Return the engine with the radii of a form, one of `FORMS`, or of the exact and simplified ones for ""."""
    return bind(_navigate_level, f"functional_{form.replace('-', '_')}", **FORMS.get(form, {}))


def solve_level(problem: Problem, frame: str) -> None:
    """Navigate in a local-level frame, "level" or one with an azimuth of its own; fill in the solution."""
    p = problem
    rule, axis = (TRANSVERSE, np.array([0.0, 0.0, 1.0])) if frame == "level" else azimuth_rule(p, frame)
    of_x = p.azimuth if len(p.azimuth) else np.zeros(len(p.time))  # the level frame's own is zero
    x, of_x[0], ch, sh = start_azimuth_k(p.models, rule, axis, float(of_x[0]), p.solution, Loop(0.0, 0.0))
    a = multiply_k(ch, 0.0, 0.0, -sh, *map(float, p.q_nb[0]))
    p.defect[0] = 0.0
    w = work_space(11)
    for block in windows(p.time, p.uniform):
        x, a = _engine(p.form)(
            block, p.increments, p.models, p.channel, p.solution, rule, axis, of_x, w, AzimuthState(*x), a
        )


# rows of the unknowns in the inertial frame
_V_I, _R_I, _LOOP_I = 0, 3, 6
"""Velocity, position, integral part of the baro loop."""


@inline
def _iterate_inertial_k(
    of: Models, channel: Channel, gains: Vector, x: InertialState, by_readings: bool, length: float, integral: Array,
    w: Work,
) -> None:  # fmt: skip
    """Find the unknowns at the nodes of a window."""
    w.start[0], w.start[1], w.start[2] = x.v
    w.start[3], w.start[4], w.start[5] = x.r
    w.start[_LOOP_I] = x.loop.sum
    y, rate, p = w.y, w.rate, of.earth
    g = gravitation_ecef_k(p, of.gravity, *x.r)
    for j in range(NODES):  # initial values: gravitation of the start, position on a straight line
        keep_column(rate, _V_I, j, along(column(w.force, 0, j), length, g))
        keep_column(rate, _R_I, j, mul(length, x.v))
    integrate_rows_k(integral, rate, w.start, y)
    for _ in range(MOST_ITERATIONS):
        for j in range(NODES):
            v, r, pushed = column(y, _V_I, j), column(y, _R_I, j), (0.0, 0.0, 0.0)
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
                    lift, rise = -gains[0] * e, -(gains[1] * e + y[_LOOP_I, j])
                    v = along(v, lift, n)
                    # the Earth-relative velocity changes by the rise alone; the inertial one also by ω × lift
                    pushed = add(mul(rise, n), (-p.omega * lift * n[1], p.omega * lift * n[0], 0.0))
                    rate[_LOOP_I, j] = length * gains[2] * e
            g = add(gravitation_ecef_k(p, of.gravity, *r), pushed)
            keep_column(rate, _V_I, j, along(column(w.force, 0, j), length, g))
            keep_column(rate, _R_I, j, mul(length, v))
        # the next change is smaller by the change of gravitation in the window, 1e-5 or less
        if integrate_rows_k(integral, rate, w.start, y) < 1e-10:
            break


@kernel
def _navigate_inertial(
    block: Windows, data: Increments, of: Models, channel: Channel, rows: Rows, gains: Vector, w: Work,
    x: InertialState, a: Quaternion,
) -> tuple[InertialState, Quaternion]:  # fmt: skip
    by_readings = channel.number == BARO_LOOP and channel.height[0] > NOT_A_HEIGHT
    for n in range(block.first.shape[0]):
        first, t = block.first[n], block.table[n]
        length, edge = data.time[first + block.size[n]] - data.time[first], block.edge[t]
        body_k(data.dtheta, data.dvel, block.fit[n], block.rate[t], block.integral, w.body_rate, w.work, w.q, w.force)
        resolve_force_k(a, w.force)
        if channel.number != 0 and not by_readings:
            height_at_nodes_k(
                channel.number, block.height[t], block.fit[n], channel.height, channel.climb, w.reference, w.climb
            )
        _iterate_inertial_k(of, channel, gains, x, by_readings, length, block.integral, w)
        # geodetic output at the end of each sample
        q_ib, error = a, x.loop.error
        for i in range(block.size[n]):
            k = first + i + 1
            v, r = interpolate_vector_k(edge, i, w.y, _V_I), interpolate_vector_k(edge, i, w.y, _R_I)
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
        a, x = q_ib, InertialState(x.r, x.v, x.g, x.north, Loop(w.y[_LOOP_I, NODES - 1], error))
    return x, a


def solve_inertial(problem: Problem, frame: str) -> None:
    """Navigate in the inertial frame, which has no radii of curvature and no azimuth; fill in the solution."""
    p = problem
    x, q_in, down, k2 = start_inertial_k(p.models, p.solution, Loop(0.0, 0.0))
    gains = loop_gains_k(p.channel.time_constant, down, k2)
    a = multiply_k(*q_in, *map(float, p.q_nb[0]))
    p.defect[0] = 0.0
    w = work_space(7)
    for block in windows(p.time, p.uniform):
        x, a = _navigate_inertial(block, p.increments, p.models, p.channel, p.solution, gains, w, x, a)


_ENGINES = {
    "level": solve_level,
    "wander_free_transverse": solve_level,
    "inertial": solve_inertial,
}
"""Engines by file of the frame."""


def engine(frame: str) -> Callable[[Problem, str], None]:
    """Return the engine for a frame, one of `sinssim.FRAMES`."""
    file = FRAME_REGISTRY[frame].file
    if file not in _ENGINES:
        raise InputError(
            f"functional-iteration has its own engine for each frame, but none for {frame}; it can be used in the "
            "frames"
            f" {listed(frames_that(lambda entry: entry.file in _ENGINES))}. All other algorithms navigate in {frame}."
        )
    return _ENGINES[file]
