"""Navigation in the local-level, north-pointing frame, interval by interval, of the fourth order.

The compensated increments are accurate to the sixth order in the interval (see `coning_sculling`). Gravity, Coriolis
acceleration and velocity are integrated by Simpson's rule, with values at mid-interval from cubic Hermite interpolation
between the ends. The rotation of the frame is the integral of its rate. The frame's own coning, u₀ × u₁/12 from its
turns u at the rates of both ends, is left out: for an aircraft at 4 g it is 5e-15 rad/s at 100 Hz and 5e-11 rad/s at
1 Hz.

Position (8.2):        φ̇ = v_N/(R₁+h),  λ̇ = v_E/((R₂+h) cos φ),  ḣ = −v_D
Velocity:              v̇ = C_nb f + g − (2ω_ie + ω_en) × v
Frame rate:            ω_in = ω_ie + ω_en,  ω_ie = (ω cos φ, 0, −ω sin φ),
                       ω_en = (v_E/(R₂+h), −v_N/(R₁+h), −v_E tan φ/(R₂+h))

The engine is a template over the attitude algorithm: `start_k`, `dcm_k`, `step_k` and `quaternion_k`, imported here
from the quaternion, and `fill_turns` are bound to each algorithm's own by `sinssim.jit.bind`. The increments may begin
before the first navigated interval, whose number is `first`, and continue beyond the last, because the fit uses
neighbours. `solve_three_rates` is the schedule of (8.20)-(8.28) with the slow part of this frame.
"""

from __future__ import annotations

from math import cos, degrees, pi, sin
from typing import NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth.gravity import gravity_ned_k
from sinssim.errors import RunError
from sinssim.jit import inline
from sinssim.rotation.quaternions import Quaternion, Vector
from sinssim.rotation.vectors import add, along, cross, mul, sub, sub_cross
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import BLOCK, FrameTurn, empty_turns_k, turn_in_block_k
from sinssim.strapdown.coning_sculling import fill_fitted_turns as fill_turns
from sinssim.strapdown.engine_assembly import engines
from sinssim.strapdown.frames import frames_that
from sinssim.strapdown.frames.navigation_problem import (
    FORMS,
    Increments,
    Models,
    Problem,
    Rows,
    continued_k,
    curvatures_k,
    first_quaternion_k,
    forces_k,
    keep_k,
    ran_away,
)
from sinssim.strapdown.frames.three_rate_schedule import Fixed, Schedule, Slow, three_rate_engines
from sinssim.strapdown.frames.vertical_channel import (
    Channel,
    Loop,
    loop_gains_k,
    reference_k,
    start_loop_k,
    vertical_step_k,
)
from sinssim.strapdown.navigation_error import POLAR_LIMIT
from sinssim.units import listed

EXACT_EVERY = 128
"""Steps between new sines and cosines of the latitude."""


class Place(NamedTuple):
    """What follows from latitude and height.

    s, c, i: sine, cosine and secant of the latitude.
    k1, k2: curvatures 1/(R₁+h) and 1/(R₂+h), 1/m.
    gn, gd: gravity north and down, m/s².
    """

    s: float
    c: float
    i: float
    k1: float
    k2: float
    gn: float
    gd: float


class LevelState(NamedTuple):
    """One run at an edge.

    v: velocity north, east, down, m/s.
    a: change of velocity over the last interval at the rate of its end, m/s.
    h, north, east: height, m; displacement from the start in latitude and longitude, rad.
    at: what follows from the position.
    loop: of the vertical channel.
    """

    v: Vector
    a: Vector
    h: float
    north: float
    east: float
    at: Place
    loop: Loop


@inline
def moved_k(s: float, c: float, change: float) -> tuple[float, float]:
    """Sine and cosine of an angle after a small change, from those before it (to the fourth order)."""
    y = change * change
    sine, versine = change * (1.0 - y / 6.0), y * (0.5 - y / 24.0)
    return s - s * versine + c * sine, c - c * versine - s * sine


@inline
def place_k(of: Models, s: float, c: float, h: float) -> Place:
    """What follows from the latitude's sine and cosine and the height."""
    k1, k2, r2 = curvatures_k(of.earth, of.simplified, s, h)
    return Place(s, c, 1.0 / c, k1, k2, *gravity_ned_k(of.earth, of.gravity, s, c, r2, h))


@inline
def start_level_k(of: Models, latitude: float, h: float, v: Vector, loop: Loop) -> LevelState:
    """State at the start."""
    return LevelState(v, (0.0, 0.0, 0.0), h, 0.0, 0.0, place_k(of, sin(latitude), cos(latitude), h), loop)


@inline
def _rates_k(
    turn: float, s: float, c: float, secant: float, k1: float, k2: float, v: Vector
) -> tuple[float, float, Vector, Vector]:
    """Rates at a point of the interval, times the interval: changes of latitude and longitude, ω_in, and 2ω_ie + ω_en.

    turn, k1 and k2 are the Earth's rotation and the curvatures times the interval; s, c and secant are those of the
    latitude.
    """
    dlat, east = v[0] * k1, v[1] * k2  # (8.2)
    dlon = east * secant
    u = east + turn * c, -dlat, -s * (turn + dlon)
    return dlat, dlon, u, (east + 2.0 * turn * c, -dlat, -s * (2.0 * turn + dlon))


@inline
def step_level_k(
    of: Models, vertical: int, gains: Vector, dt: float, lon0: float, reference: tuple[float, float],
    f: tuple[Vector, Vector, Vector], x: LevelState,
) -> tuple[LevelState, FrameTurn]:  # fmt: skip
    """State one interval later, and the rotation of the frame: the step of one run.

    lon0 is the longitude of the start, f the increment of velocity by specific force, and specific force at the start
    and at the end, times the interval, in the axes of its start.
    """
    v, at, (d, s, e) = x.v, x.at, f
    # the Earth's rotation, curvatures and gravity times the interval
    turn, r1, r2, g0 = dt * of.earth.omega, dt * at.k1, dt * at.k2, (dt * at.gn, 0.0, dt * at.gd)
    # Earth at the interval's end, at an extrapolated position: this long chain of divisions and roots is then
    # independent of the body's and runs in parallel. The final position corrects it to first order.
    dlat_taken, h_taken = r1 * (v[0] + 0.5 * x.a[0]), x.h - dt * (v[2] + 0.5 * x.a[2])
    x1 = place_k(of, *moved_k(at.s, at.c, dlat_taken), h_taken)
    # how fast the secant grows with latitude, and curvatures and gravity down decrease with height
    i_rate, k1_rate, k2_rate, g_rate = x1.s * x1.i * x1.i, x1.k1 * x1.k1, x1.k2 * x1.k2, 2.0 * x1.gd * x1.k2
    r1_1, r2_1, g1 = dt * x1.k1, dt * x1.k2, (dt * x1.gn, 0.0, dt * x1.gd)
    # what the frame's rotation turns: the increment less ∫∫a/dt
    half, pushed = along(mul(0.5, d), 1.0 / 12.0, sub(e, s)), add(v, d)

    # start of the interval: frame's rotation, Coriolis and acceleration, times dt
    dlat0, dlon0, u0, w = _rates_k(turn, at.s, at.c, at.i, r1, r2, v)
    c0 = cross(v, w)
    a0 = add(add(s, g0), c0)
    # velocity at the end, predicted: the frame's rotation during the interval turns the increment by −∫ζ × a, and
    # Coriolis acts as at mid-interval
    vm = along(v, 0.5, a0)
    _, _, _, w = _rates_k(turn, at.s, at.c, at.i, r1, r2, vm)
    v1 = sub_cross(sub_cross(add(pushed, g0), u0, half), w, vm)
    dlat1, _, u1, w = _rates_k(turn, x1.s, x1.c, x1.i, r1_1, r2_1, v1)
    c1 = cross(v1, w)
    a1 = add(sub_cross(add(e, g1), u0, e), c1)  # with the end's specific force in the axes of the end

    # middle of the interval: cubic Hermite interpolation for velocity and the values that depend on position.
    # Velocity, curvatures and cosine are doubled, so that the rates are fourfold, as Simpson's rule takes them.
    vm = along(add(v, v1), 0.25, sub(a0, a1))
    bend, bend_h = 0.125 * (dlat0 - dlat1), 0.25 * dt * (v[2] - v1[2])  # ⅛ (φ̇₀ − φ̇₁) dt, ¼ (ḣ₁ − ḣ₀) dt
    dlatm, dlonm, um, w = _rates_k(
        4.0 * turn, 0.5 * (at.s + x1.s) + x1.c * bend, 0.5 * (at.c + x1.c) - x1.s * bend,
        0.5 * (at.i + x1.i) + i_rate * bend, r1 + r1_1 + k1_rate * (dt * bend_h),
        r2 + r2_1 + k2_rate * (dt * bend_h), vm,
    )  # fmt: skip
    cm = cross(vm, w)  # eightfold

    # velocity at the end: −∫ζ × a with ζ = u₀ τ + (u₁ − u₀) τ²/2, and +½∫ζ × (ζ × a)
    zeta = along(u0, 1.0 / 3.0, sub(u1, u0))
    v1 = sub_cross(pushed, zeta, along(half, -1.0 / 6.0, cross(zeta, d)))
    g = 0.5 * (g0[0] + g1[0]), 0.0, 0.5 * (g0[2] + g1[2] + 2.0 / 3.0 * dt * g_rate * bend_h)
    v1 = along(along(add(v1, g), 1.0 / 6.0, add(c0, c1)), 1.0 / 12.0, cm)
    # position at the end, summed from the start: in a sum with the latitude, a slow vehicle's steps would be lost
    dlat = (dlat0 + dlatm + v1[0] * r1_1) / 6.0
    east = x.east + (dlon0 + dlonm + v1[1] * r2_1 * x1.i) / 6.0
    if lon0 + east > pi:
        east -= 2.0 * pi
    elif lon0 + east <= -pi:
        east += 2.0 * pi
    h = x.h - dt / 6.0 * (v[2] + 2.0 * vm[2] + v1[2])
    h, vd, loop = vertical_step_k(vertical, dt, gains, x.loop, h, v1[2], reference)
    # the Earth's values, corrected from the extrapolated to the final position
    moved, up = dlat - dlat_taken, h - h_taken
    at = Place(
        x1.s + x1.c * moved, x1.c - x1.s * moved, x1.i + i_rate * moved,
        x1.k1 - k1_rate * up, x1.k2 - k2_rate * up, x1.gn, x1.gd - g_rate * up,
    )  # fmt: skip
    turned = FrameTurn(*mul(1.0 / 6.0, add(add(u0, um), u1)), *u0, *mul(0.25, um), *u1)
    return LevelState((v1[0], v1[1], vd), a1, h, x.north + dlat, east, at, loop), turned


@inline
def refreshed_k(lat0: float, x: LevelState) -> LevelState:
    """The same state with new sine and cosine of the latitude, which accumulate rounding errors."""
    s, c, at = sin(lat0 + x.north), cos(lat0 + x.north), x.at
    return LevelState(x.v, x.a, x.h, x.north, x.east, Place(s, c, 1.0 / c, at.k1, at.k2, at.gn, at.gd), x.loop)


def _navigate(data: Increments, of: Models, channel: Channel, rows: Rows) -> None:
    count = data.time.shape[0] - 1
    lat0, lon0, h0 = rows.latitude[0], rows.longitude[0], rows.height[0]
    v = rows.velocity[0, 0], rows.velocity[0, 1], rows.velocity[0, 2]
    x = start_level_k(of, lat0, h0, v, start_loop_k(channel, h0))
    gains = loop_gains_k(channel.time_constant, x.at.gd, x.at.k2)
    q = first_quaternion_k(rows)
    attitude = start_k(*q)
    rows.defect[0] = quaternion_k(attitude)[4]
    turns = empty_turns_k()
    for k in range(count):
        if k % BLOCK == 0:
            first, last = data.first + k, data.first + min(k + BLOCK, count)
            fill_turns(data.dtheta, data.dvel, data.weights, data.uniform, first, last, turns)
        if k % EXACT_EVERY == 0:
            x = refreshed_k(lat0, x)
        body = turn_in_block_k(turns, k % BLOCK)
        x, turn = step_level_k(
            of, channel.number, gains, data.time[k + 1] - data.time[k], lon0, reference_k(channel, k + 1),
            forces_k(dcm_k(attitude), body), x,
        )  # fmt: skip
        attitude = step_k(attitude, body, turn)
        q0, q1, q2, q3, rows.defect[k + 1] = quaternion_k(attitude)
        q = continued_k(q, (q0, q1, q2, q3))
        keep_k(rows, k + 1, lat0 + x.north, lon0 + x.east, x.h, x.v, q)


engine = engines(_navigate, "level", FORMS)


def solve(problem: Problem, frame: str) -> None:
    """Navigate in the level frame; see `sinssim.strapdown.engine_assembly.FrameFile`."""
    p = problem
    engine(p.algorithm, p.form)(p.increments, p.models, p.channel, p.solution)


def check(problem: Problem, frame: str) -> None:
    """Raise if the solution comes too near to a pole."""
    latitude = problem.latitude
    if max(float(np.max(latitude)), -float(np.min(latitude))) <= POLAR_LIMIT:
        return
    row = int(np.argmax(~(np.abs(latitude) <= POLAR_LIMIT)))
    if not abs(latitude[row]) <= 0.5 * pi:  # no step of a vehicle crosses the pole from 89.9°
        raise ran_away(problem, "latitude", row)
    able = listed(frames_that(lambda entry: entry.passes_poles))
    time = float(problem.time[row])
    raise RunError(
        f"the north-pointing level frame cannot be used within {90.0 - degrees(POLAR_LIMIT):.1f}° of a pole, where "
        f"the direction of north changes too fast: latitude {degrees(latitude[row]):.4f}° at t = {time:.2f} s. "
        f"The frames {able} pass the poles.",
        time=time,
    )


class SlowPlace(NamedTuple):
    """Of the slow part: coordinates, rad, height, velocity, the baro loop; curvatures, 1/m, gravity north and down."""

    latitude: float
    longitude: float
    h: float
    v: Vector
    loop: Loop
    k1: float
    k2: float
    north: float
    down: float


@inline
def slow_place_k(of: Models, latitude: float, longitude: float, h: float, v: Vector, loop: Loop) -> SlowPlace:
    s, c = sin(latitude), cos(latitude)
    k1, k2, r2 = curvatures_k(of.earth, of.simplified, s, h)
    return SlowPlace(latitude, longitude, h, v, loop, k1, k2, *gravity_ned_k(of.earth, of.gravity, s, c, r2, h))


@inline
def slow_first_k(
    of: Models, rule: int, axis: Array, rows: Rows, of_x: Array, loop: Loop
) -> tuple[SlowPlace, Quaternion, float, float]:
    """`first_k` of `three_rate_schedule`."""
    v = rows.velocity[0, 0], rows.velocity[0, 1], rows.velocity[0, 2]
    x = slow_place_k(of, rows.latitude[0], rows.longitude[0], rows.height[0], v, loop)
    return x, (1.0, 0.0, 0.0, 0.0), x.down, x.k2


@inline
def slow_k(fixed: Fixed, x: SlowPlace) -> Slow:
    """`slow_k` of `three_rate_schedule`."""
    s, c = sin(x.latitude), cos(x.latitude)
    north, down = fixed.of.earth.omega * c, -fixed.of.earth.omega * s
    tn, te, td = x.v[1] * x.k2, -x.v[0] * x.k1, -x.v[1] * x.k2 * s / c
    return Slow((north + tn, te, down + td), (2.0 * north + tn, te, 2.0 * down + td), (x.north, 0.0, x.down))


@inline
def slow_moved_k(
    fixed: Fixed, time: float, dt: float, at: float, reference: tuple[float, float], x: SlowPlace, before: SlowPlace,
    v: Vector, s: Vector,
) -> SlowPlace:  # fmt: skip
    """`moved_k` of `three_rate_schedule`."""
    north = s[0] * (x.k1 + at * (x.k1 - before.k1))
    # with the latitude in the middle of the slow interval
    longitude = x.longitude + s[1] * (x.k2 + at * (x.k2 - before.k2)) / cos(x.latitude + 0.5 * north)
    if longitude > pi:
        longitude -= 2.0 * pi
    elif longitude <= -pi:
        longitude += 2.0 * pi
    h, vd, loop = vertical_step_k(fixed.vertical, dt, fixed.gains, x.loop, x.h - s[2], v[2], reference)
    return slow_place_k(fixed.of, x.latitude + north, longitude, h, (v[0], v[1], vd), loop)


@inline
def slow_north_k(x: SlowPlace) -> tuple[float, float, float, Vector, float, Quaternion]:
    """`north_k` of `three_rate_schedule`."""
    return x.latitude, x.longitude, x.h, x.v, 0.0, (1.0, 0.0, 0.0, 0.0)


three_rate_engine = three_rate_engines("level", slow_first_k, slow_k, slow_moved_k, slow_north_k)


def solve_three_rates(
    problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool
) -> None:
    """Navigate at three rates; see `sinssim.strapdown.engine_assembly.ThreeRateFile`."""
    p, schedule = problem, Schedule(fast_per_medium, medium_per_slow, extrapolate)
    three_rate_engine(p.algorithm, p.form)(
        p.increments, p.models, p.channel, p.solution, schedule, 0, np.zeros(3), p.azimuth
    )
