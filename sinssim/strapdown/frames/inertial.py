"""Navigation in the inertial frame, with geodetic output: no frame rate, no Coriolis, no poles.

Velocity and position:   v̇_i = C_ib f + G(r_i),   ṙ_i = v_i,   G gravitation alone.

Velocity is integrated from the compensated increments and gravitation by Hermite's rule (values and rates of change at
both ends), position by Hermite's rule on the velocity, to the fourth order. The attitude algorithm's variables describe
q_ib here, so the rotation of the frame is zero. Like `level`, this is a template over the attitude algorithm.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef_k, q_en_k, radii_k
from sinssim.earth.gravity import EarthParameters, geodetic_sincos_k, gravitation_ecef_k, gravity_ned_k
from sinssim.jit import inline
from sinssim.rotation.quaternions import Quaternion, Vector, half_angle_k, multiply_k, rotate_k
from sinssim.rotation.vectors import add, along, mul, resolved, sub
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import BLOCK, FrameTurn, empty_turns_k, turn_in_block_k
from sinssim.strapdown.coning_sculling import fill_fitted_turns as fill_turns
from sinssim.strapdown.engine_assembly import engines
from sinssim.strapdown.frames.navigation_problem import (
    Increments,
    Models,
    Problem,
    Rows,
    continued_k,
    first_quaternion_k,
    keep_k,
)
from sinssim.strapdown.frames.three_rate_schedule import Fixed, Schedule, Slow, three_rate_engines
from sinssim.strapdown.frames.vertical_channel import (
    FREE,
    Channel,
    Loop,
    loop_gains_k,
    reference_k,
    start_loop_k,
    vertical_step_k,
)

Angle = tuple[float, float]
"""Cosine and sine of an angle."""


class Geodetic(NamedTuple):
    """Where a vehicle is over the Earth.

    turn, longitude, latitude: cosine and sine of the angle by which the Earth has turned, and of the coordinates.
    h: height, m.
    v: velocity relative to the Earth, north, east, down, m/s.
    """

    turn: Angle
    longitude: Angle
    latitude: Angle
    h: float
    v: Vector


class InertialState(NamedTuple):
    """A vehicle at an edge: position and velocity in inertial axes, gravitation there, and what follows from them."""

    r: Vector
    v: Vector
    g: Vector
    north: Geodetic
    loop: Loop


@inline
def gravitation_k(of: Models, turn: Angle, r: Vector) -> Vector:
    """Gravitation in inertial axes."""
    c, s = turn
    g = gravitation_ecef_k(of.earth, of.gravity, c * r[0] + s * r[1], c * r[1] - s * r[0], r[2])
    return c * g[0] - s * g[1], s * g[0] + c * g[1], g[2]


@inline
def gravitation_rate_k(gm: float, r: Vector, v: Vector) -> Vector:
    """Rate of change of a central body's gravitation along a motion, for the small term of Hermite's rule."""
    inverse = 1.0 / (r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    radial = 3.0 * inverse * (r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
    return mul(-gm * inverse * sqrt(inverse), along(v, -radial, r))


@inline
def geodetic_k(p: EarthParameters, turn: Angle, r: Vector, v: Vector) -> Geodetic:
    """Where a vehicle is over the Earth, from position and velocity in inertial axes."""
    ca, sa = turn
    xe, ye = ca * r[0] + sa * r[1], ca * r[1] - sa * r[0]
    rho = sqrt(xe * xe + ye * ye)
    s, c, h = geodetic_sincos_k(p, rho, r[2], 2)
    cl, sl = (xe / rho, ye / rho) if rho > 0.0 else (1.0, 0.0)
    # velocity relative to the Earth in Earth-fixed axes, then north, east, down
    ux, uy = v[0] + p.omega * r[1], v[1] - p.omega * r[0]
    ux, uy = ca * ux + sa * uy, ca * uy - sa * ux
    radial = cl * ux + sl * uy
    return Geodetic(turn, (cl, sl), (c, s), h, (c * v[2] - s * radial, cl * uy - sl * ux, -c * radial - s * v[2]))


@inline
def lifted_k(p: EarthParameters, x: Geodetic, r: Vector, v: Vector, lift: float, rise: float) -> tuple[Vector, Vector]:
    """Position and velocity in inertial axes after corrections of the height and its rate along the local vertical.

    The Earth-relative velocity changes by the rise alone; the inertial one also by ω × lift.
    """
    (ca, sa), (cl, sl), (c, s) = x.turn, x.longitude, x.latitude
    ux, uy = c * (ca * cl - sa * sl), c * (sa * cl + ca * sl)
    dragged = p.omega * lift
    return along(r, lift, (ux, uy, s)), add(along(v, rise, (ux, uy, s)), (-dragged * uy, dragged * ux, 0.0))


@inline
def settled_k(
    of: Models, vertical: int, gains: Vector, dt: float, turn: Angle, reference: tuple[float, float],
    r: Vector, v: Vector, g: Vector, loop: Loop,
) -> InertialState:  # fmt: skip
    """The state of a position and a velocity under the vertical channel."""
    x = geodetic_k(of.earth, turn, r, v)
    if vertical == FREE:
        return InertialState(r, v, g, x, loop)
    h, vd, loop = vertical_step_k(vertical, dt, gains, loop, x.h, x.v[2], reference)
    r, v = lifted_k(of.earth, x, r, v, h - x.h, x.v[2] - vd)
    x = Geodetic(turn, x.longitude, x.latitude, h, (x.v[0], x.v[1], vd))
    return InertialState(r, v, gravitation_k(of, turn, r), x, loop)


@inline
def start_inertial_k(of: Models, rows: Rows, loop: Loop) -> tuple[InertialState, Quaternion, float, float]:
    """State at the start, when the inertial axes coincide with the Earth's; q_in, gravity down and 1/(R₂+h)."""
    p, latitude, longitude, h = of.earth, rows.latitude[0], rows.longitude[0], rows.height[0]
    r, q = geodetic_to_ecef_k(p, latitude, longitude, h), q_en_k(latitude, longitude)
    v = rotate_k(*q, rows.velocity[0, 0], rows.velocity[0, 1], rows.velocity[0, 2])
    v = v[0] - p.omega * r[1], v[1] + p.omega * r[0], v[2]
    s, c = sin(latitude), cos(latitude)
    _, r2 = radii_k(p, s)
    _, down = gravity_ned_k(p, of.gravity, s, c, r2, h)
    turn = 1.0, 0.0
    x = InertialState(r, v, gravitation_k(of, turn, r), geodetic_k(p, turn, r, v), loop)
    return x, q, down, 1.0 / (r2 + h)


@inline
def step_inertial_k(
    of: Models, vertical: int, gains: Vector, dt: float, turn: Angle, reference: tuple[float, float],
    d: Vector, change: Vector, x: InertialState,
) -> InertialState:  # fmt: skip
    """The state one interval later, when the Earth has turned by `turn` since the start.

    d is the increment of velocity by specific force, `change` the specific force at the start less that at the end,
    times dt.
    """
    r = along(x.r, dt, along(along(x.v, 0.5, d), 1.0 / 12.0, change))  # without gravitation
    v = add(x.v, d)
    # gravitation at the end: the position is accurate to the third order without it
    r1 = along(r, 0.5 * dt * dt, x.g)
    g1 = gravitation_k(of, turn, r1)
    bend = sub(gravitation_rate_k(of.earth.gm, x.r, x.v), gravitation_rate_k(of.earth.gm, r1, along(v, dt, x.g)))
    v1 = along(along(v, 0.5 * dt, add(x.g, g1)), dt * dt / 12.0, bend)
    # ∫∫G = dt²/6 (2 G₀ + G₁) + …: G is sufficiently linear over the interval
    r1 = along(r, dt * dt / 6.0, along(g1, 2.0, x.g))
    return settled_k(of, vertical, gains, dt, turn, reference, r1, v1, g1, x.loop)


@inline
def coordinates_k(x: Geodetic) -> tuple[float, float, Quaternion]:
    """Latitude, longitude, and the quaternion from inertial axes to north, east, down."""
    (ca, sa), (cl, sl), (c, s) = x.turn, x.longitude, x.latitude
    # q_in = (turn about z by the Earth's angle and the longitude) ∘ (about y by −(90° + latitude))
    cy, sy = half_angle_k(-s, -c)
    cz, sz = half_angle_k(ca * cl - sa * sl, sa * cl + ca * sl)
    return atan2(s, c), atan2(sl, cl), (cz * cy, sz * sy, -cz * sy, -sz * cy)


def _navigate(data: Increments, of: Models, channel: Channel, rows: Rows) -> None:
    count = data.time.shape[0] - 1
    x, q_in, down, k2 = start_inertial_k(of, rows, start_loop_k(channel, rows.height[0]))
    gains = loop_gains_k(channel.time_constant, down, k2)
    q = first_quaternion_k(rows)
    attitude = start_k(*multiply_k(*q_in, *q))
    rows.defect[0] = quaternion_k(attitude)[4]
    turns = empty_turns_k()
    for k in range(count):
        if k % BLOCK == 0:
            first, last = data.first + k, data.first + min(k + BLOCK, count)
            fill_turns(data.dtheta, data.dvel, data.weights, data.uniform, first, last, turns)
        b = turn_in_block_k(turns, k % BLOCK)
        c_ib, angle = dcm_k(attitude), of.earth.omega * (data.time[k + 1] - data.time[0])
        x = step_inertial_k(
            of, channel.number, gains, data.time[k + 1] - data.time[k], (cos(angle), sin(angle)),
            reference_k(channel, k + 1), resolved(c_ib, (b.dv_x, b.dv_y, b.dv_z)),
            resolved(c_ib, (b.fs_x - b.fe_x, b.fs_y - b.fe_y, b.fs_z - b.fe_z)), x,
        )  # fmt: skip
        attitude = step_k(attitude, b, FrameTurn(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        q0, q1, q2, q3, rows.defect[k + 1] = quaternion_k(attitude)
        latitude, longitude, q_ni = coordinates_k(x.north)
        q = continued_k(q, multiply_k(*q_ni, q0, q1, q2, q3))
        keep_k(rows, k + 1, latitude, longitude, x.north.h, x.north.v, q)


engine = engines(_navigate, "inertial")


def solve(problem: Problem, frame: str) -> None:
    """Navigate in the inertial frame; see `sinssim.strapdown.engine_assembly.FrameFile`."""
    p = problem
    engine(p.algorithm)(p.increments, p.models, p.channel, p.solution)


def check(problem: Problem, frame: str) -> None:
    """Accept every solution: the inertial frame can be used everywhere."""


@inline
def slow_first_k(
    of: Models, rule: int, axis: Array, rows: Rows, of_x: Array, loop: Loop
) -> tuple[InertialState, Quaternion, float, float]:
    """`first_k` of `three_rate_schedule`."""
    return start_inertial_k(of, rows, loop)


@inline
def slow_k(fixed: Fixed, x: InertialState) -> Slow:
    """`slow_k` of `three_rate_schedule`.

    Gravitation turns in inertial axes with the vehicle and the Earth, by 1e-4 rad/s: held over a slow interval it lags
    by half of it, which acts as an accelerometer bias of 5 µg at 10 Hz. Extrapolated it does not.
    """
    return Slow((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), x.g)


@inline
def slow_moved_k(
    fixed: Fixed, time: float, dt: float, at: float, reference: tuple[float, float], x: InertialState,
    before: InertialState, v: Vector, s: Vector,
) -> InertialState:  # fmt: skip
    """`moved_k` of `three_rate_schedule`."""
    angle, r = fixed.of.earth.omega * (time - fixed.start), add(x.r, s)
    turn = cos(angle), sin(angle)
    g = gravitation_k(fixed.of, turn, r)
    return settled_k(fixed.of, fixed.vertical, fixed.gains, dt, turn, reference, r, v, g, x.loop)


@inline
def slow_north_k(x: InertialState) -> tuple[float, float, float, Vector, float, Quaternion]:
    """`north_k` of `three_rate_schedule`."""
    latitude, longitude, q_ni = coordinates_k(x.north)
    return latitude, longitude, x.north.h, x.north.v, 0.0, q_ni


three_rate_engine = three_rate_engines("inertial", slow_first_k, slow_k, slow_moved_k, slow_north_k)


def solve_three_rates(
    problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool
) -> None:
    """Navigate at three rates; see `sinssim.strapdown.engine_assembly.ThreeRateFile`."""
    p, schedule = problem, Schedule(fast_per_medium, medium_per_slow, extrapolate)
    three_rate_engine(p.algorithm)(p.increments, p.models, p.channel, p.solution, schedule, 0, np.zeros(3), p.azimuth)
