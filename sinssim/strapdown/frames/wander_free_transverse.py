"""Navigation in local-level frames that do not point north, over the poles: wander, free and transverse azimuth.

The frame w has its z axis down and its x axis at some azimuth. Position and azimuth are one quaternion q_ew. With the
Earth's axis k in w-coordinates (its z component is −sin φ) the equations are regular at the poles:

Transport rate:   ω_ew = −ẑ × (K v) + ω_z ẑ,   K v = v/(R₂+h) + κ (k_h·v) k_h,
                  κ = (1/(R₁+h) − 1/(R₂+h))/cos²φ = e² R₂/((1 − e² sin²φ)(R₁+h)(R₂+h)),  k_h the horizontal part of k
Azimuth:          wander ω_z = 0;  free ω_z = −ω k_z (zero relative to inertial space);
                  transverse ω_z = ω_x p_z/p_x, which keeps x towards the pole p of the route's great circle and
                  grows without bound near p: `sinssim.strapdown.navigation_error` has the limit
Velocity:         v̇ = C_wb f + g − (2ω_ie + ω_ew) × v

The integration scheme is that of `level`: compensated increments, Simpson's rule, Hermite values at mid-interval. Like
the level engine this is a template over the attitude algorithm, whose variables here describe q_wb.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import q_en_k
from sinssim.earth.gravity import gravity_ned_k
from sinssim.errors import RunError
from sinssim.jit import inline, strict_inline
from sinssim.rotation.quaternions import (
    Quaternion,
    Vector,
    half_angle_k,
    multiply_k,
    quaternion_from_rotation_vector_k,
    rotate_k,
)
from sinssim.rotation.vectors import add, along, cross, mean, mul, simpson, sub, sub_cross, turned
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import BLOCK, empty_turns_k, frame_turn_k, turn_in_block_k
from sinssim.strapdown.coning_sculling import fill_fitted_turns as fill_turns
from sinssim.strapdown.engine_assembly import engines
from sinssim.strapdown.frames.navigation_problem import (
    FORMS,
    SPHERICAL,
    Increments,
    Models,
    Problem,
    Rows,
    continued_k,
    distances_k,
    first_quaternion_k,
    forces_k,
    keep_k,
)
from sinssim.strapdown.frames.route_pole import route_pole, too_near
from sinssim.strapdown.frames.three_rate_schedule import Fixed, Schedule, Slow, ahead_k, three_rate_engines
from sinssim.strapdown.frames.vertical_channel import (
    Channel,
    Loop,
    loop_gains_k,
    reference_k,
    start_loop_k,
    vertical_step_k,
)

WANDER, FREE_AZIMUTH, TRANSVERSE = 0, 1, 2
"""Rules for the azimuth by number."""

_RULES = {"wander": WANDER, "free-azimuth": FREE_AZIMUTH, "transverse": TRANSVERSE}


class Place(NamedTuple):
    """Where a vehicle is, and what follows from it.

    k, pole: the Earth's axis and the pole of the transverse frame's route, in w.
    h: height, m.
    k2, kappa: 1/(R₂+h) and κ, 1/m.
    north, down: gravity along k_h per unit of it, and down, m/s².
    """

    k: Vector
    pole: Vector
    h: float
    k2: float
    kappa: float
    north: float
    down: float


class AzimuthState(NamedTuple):
    """A vehicle at an edge.

    e, lost: q_ew, and the rounding errors of the additions to it.
    x: where it is.
    v: velocity along the axes of w, m/s.
    a: change of velocity over the last interval at the rate of its end, m/s.
    loop: of the vertical channel.
    """

    e: Quaternion
    lost: Quaternion
    x: Place
    v: Vector
    a: Vector
    loop: Loop


@inline
def earth_k(of: Models, k: Vector, h: float) -> tuple[float, float, float, float]:
    """1/(R₂+h), κ, gravity along k_h per unit of it, gravity down."""
    p, s, c = of.earth, -k[2], sqrt(k[0] * k[0] + k[1] * k[1])
    x1, x2, r1, r2 = distances_k(p, s, h)
    north, down = gravity_ned_k(p, of.gravity, s, c, r2, h)
    north = north / c if c > 0.0 else 0.0  # it is proportional to cos φ
    if of.simplified:  # (8.16)
        return (1.0 - 0.5 * p.e2 * s * s - h / p.a) / p.a, p.e2 / p.a, north, down
    k2 = 1.0 / x2
    return k2, 0.0 if SPHERICAL else p.e2 / (1.0 - p.e2) * r1 * k2 / x1, north, down  # R₁/(1 − e²) = R₂/(1 − e² sin²φ)


@inline
def third_row_k(q0: float, q1: float, q2: float, q3: float) -> Vector:
    """The Earth's axis in w-coordinates: the third row of C_ew."""
    return 2.0 * (q1 * q3 - q0 * q2), 2.0 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3


@inline
def place_k(of: Models, rule: int, axis: Array, e: Quaternion, h: float) -> Place:
    """The place of a frame's quaternion q_ew and a height."""
    k = third_row_k(*e)
    return Place(k, pole_k(rule, axis, e), h, *earth_k(of, k, h))


@inline
def pole_k(rule: int, axis: Array, e: Quaternion) -> Vector:
    """The pole of the route in w; any for the other frames."""
    if rule == TRANSVERSE:
        return rotate_k(e[0], -e[1], -e[2], -e[3], axis[0], axis[1], axis[2])
    return 1.0, 0.0, 0.0


@inline
def transport_k(rule: int, omega: float, x: Place, v: Vector) -> Vector:
    """ω_ew in w-axes."""
    north = x.kappa * (x.k[0] * v[0] + x.k[1] * v[1])
    wx, wy = x.k2 * v[1] + north * x.k[1], -x.k2 * v[0] - north * x.k[0]
    if rule == WANDER:
        return wx, wy, 0.0
    if rule == FREE_AZIMUTH:
        return wx, wy, -omega * x.k[2]
    return wx, wy, wx * x.pole[2] / x.pole[0]


@inline
def rates_k(rule: int, omega: float, x: Place, v: Vector) -> tuple[Vector, Vector, Vector]:
    """ω_ew, the acceleration by gravity and Coriolis g − (2ω_ie + ω_ew) × v, and ω_iw, at a place and a velocity."""
    t = transport_k(rule, omega, x, v)
    g = sub_cross((x.north * x.k[0], x.north * x.k[1], x.down), along(t, 2.0 * omega, x.k), v)
    return t, g, along(t, omega, x.k)


@inline
def _ahead_k(rule: int, of: Models, x: Place, dt: float, v: Vector) -> Place:
    """The place at the interval's end, extrapolated with the velocity in its middle."""
    r = mul(dt, transport_k(rule, of.earth.omega, x, v))
    k, h = turned(x.k, r), x.h - dt * v[2]
    return Place(k, turned(x.pole, r), h, *earth_k(of, k, h))


@inline
def _middle_k(x: Place, x1: Place, bend: Vector, bend_h: float) -> Place:
    """The place at mid-interval, by cubic Hermite interpolation."""
    k = mean(x.k, x1.k)
    k2, down = x1.k2 * x1.k2, 2.0 * x1.down * x1.k2
    return Place(
        sub_cross(k, bend, k), mean(x.pole, x1.pole), 0.0, 0.5 * (x.k2 + x1.k2) + k2 * bend_h,
        0.5 * (x.kappa + x1.kappa), 0.5 * (x.north + x1.north), 0.5 * (x.down + x1.down) + down * bend_h,
    )  # fmt: skip


@strict_inline
def carried_sum_k(total: float, lost: float, step: float) -> tuple[float, float]:
    """A sum and its rounding error, to be added with the next step (Kahan summation)."""
    due = step + lost
    new = total + due
    return new, due - (new - total)


@inline
def turned_on_k(e: Quaternion, lost: Quaternion, r: Vector) -> tuple[Quaternion, Quaternion]:
    """e ∘ q(r) as e + e ∘ (q(r) − 1): a step is ten million times smaller than e and would lose half its digits."""
    r0, r1, r2, r3 = quaternion_from_rotation_vector_k(*r)
    d = multiply_k(*e, -(r1 * r1 + r2 * r2 + r3 * r3) / (1.0 + r0), r1, r2, r3)
    e0, l0 = carried_sum_k(e[0], lost[0], d[0])
    e1, l1 = carried_sum_k(e[1], lost[1], d[1])
    e2, l2 = carried_sum_k(e[2], lost[2], d[2])
    e3, l3 = carried_sum_k(e[3], lost[3], d[3])
    return (e0, e1, e2, e3), (l0, l1, l2, l3)


@inline
def start_azimuth_k(
    of: Models, rule: int, axis: Array, azimuth: float, rows: Rows, loop: Loop
) -> tuple[AzimuthState, float, float, float]:
    """State at the start, azimuth of the x axis, given or towards the route's pole, and cosine and sine of its half."""
    e = q_en_k(rows.latitude[0], rows.longitude[0])
    if rule == TRANSVERSE:
        pole = pole_k(rule, axis, e)
        azimuth = atan2(pole[1], pole[0])
    ch, sh = cos(0.5 * azimuth), sin(0.5 * azimuth)
    e = multiply_k(*e, ch, 0.0, 0.0, sh)
    v = rotate_k(ch, 0.0, 0.0, -sh, rows.velocity[0, 0], rows.velocity[0, 1], rows.velocity[0, 2])
    x = place_k(of, rule, axis, e, rows.height[0])
    return AzimuthState(e, (0.0, 0.0, 0.0, 0.0), x, v, (0.0, 0.0, 0.0), loop), azimuth, ch, sh


@inline
def step_azimuth_k(
    of: Models, rule: int, axis: Array, turning: bool, vertical: int, gains: Vector, dt: float,
    reference: tuple[float, float], f: tuple[Vector, Vector, Vector], at: AzimuthState,
) -> tuple[AzimuthState, tuple[Vector, Vector, Vector]]:  # fmt: skip
    """The state one interval later, and the frame's rate ω_iw at the start, in the middle and at the end, times dt.

    f is the increment of velocity by specific force, and specific force at the start and at the end, times dt. If
    `turning`, they are in the axes of the start, out of which the frame turns during the interval; otherwise in axes
    that turn with it, those of a platform.
    """
    omega, x, v, (d, s, e) = of.earth.omega, at.x, at.v, f
    t0, g0, w0 = rates_k(rule, omega, x, v)
    u0 = mul(dt, w0)
    x1 = _ahead_k(rule, of, x, dt, along(v, 0.5, at.a))
    # velocity at the end, predicted, with Coriolis as at mid-interval
    half = along(mul(0.5, d), 1.0 / 12.0, sub(e, s))  # ∫∫a/dt from the end back: what the frame's rotation turns
    a0 = along(s, dt, g0)
    _, gm, _ = rates_k(rule, omega, x, along(v, 0.5, a0))
    pushed = add(v, d)
    v1 = pushed
    if turning:
        v1, e = sub_cross(pushed, u0, half), sub_cross(e, u0, e)
    v1 = along(v1, dt, gm)
    t1, g1, w1 = rates_k(rule, omega, x1, v1)
    a1, u1 = along(e, dt, g1), mul(dt, w1)
    # middle of the interval
    vm = along(mean(v, v1), 0.125, sub(a0, a1))
    xm = _middle_k(x, x1, mul(0.125 * dt, sub(t0, t1)), 0.125 * dt * (v[2] - v1[2]))
    tm, gm, wm = rates_k(rule, omega, xm, vm)
    # velocity at the end: −∫ζ × a with ζ = u₀ τ + (u₁ − u₀) τ²/2, and +½∫ζ × (ζ × a)
    if turning:
        zeta = along(u0, 1.0 / 3.0, sub(u1, u0))
        pushed = sub_cross(pushed, zeta, along(half, -1.0 / 6.0, cross(zeta, d)))
    v1 = along(along(pushed, dt / 6.0, add(g0, g1)), dt / 1.5, gm)
    # position at the end; the Earth's values are corrected from the extrapolated to the final height
    h = x.h - dt / 6.0 * (v[2] + 4.0 * vm[2] + v1[2])
    h, vz, loop = vertical_step_k(vertical, dt, gains, at.loop, h, v1[2], reference)
    q, lost = turned_on_k(at.e, at.lost, mul(dt, simpson(t0, tm, t1)))
    up, k2_rate, g_rate = h - x1.h, x1.k2 * x1.k2, 2.0 * x1.down * x1.k2
    place = Place(
        third_row_k(*q), pole_k(rule, axis, q), h, x1.k2 - k2_rate * up, x1.kappa, x1.north, x1.down - g_rate * up
    )
    return AzimuthState(q, lost, place, (v1[0], v1[1], vz), a1, loop), (u0, mul(dt, wm), u1)


@inline
def north_k(x: AzimuthState) -> tuple[float, float, Vector, float, float, float]:
    """Latitude, longitude, velocity north, east, down, azimuth of the x axis, and cosine and sine of its half."""
    k, e, v = x.x.k, x.e, x.v
    equatorial = sqrt(k[0] * k[0] + k[1] * k[1])
    c, s = (k[0] / equatorial, -k[1] / equatorial) if equatorial > 0.0 else (1.0, 0.0)
    longitude = atan2(-2.0 * (e[2] * e[3] - e[0] * e[1]), -2.0 * (e[1] * e[3] + e[0] * e[2]))
    velocity = c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]
    ch, sh = half_angle_k(c, s)
    return atan2(-k[2], equatorial), longitude, velocity, -atan2(k[1], k[0]), ch, sh


def _navigate(data: Increments, of: Models, channel: Channel, rows: Rows, rule: int, axis: Array, of_x: Array) -> None:
    count = data.time.shape[0] - 1
    x, of_x[0], ch, sh = start_azimuth_k(of, rule, axis, of_x[0], rows, start_loop_k(channel, rows.height[0]))
    gains = loop_gains_k(channel.time_constant, x.x.down, x.x.k2)
    q = first_quaternion_k(rows)
    attitude = start_k(*multiply_k(ch, 0.0, 0.0, -sh, *q))
    rows.defect[0] = quaternion_k(attitude)[4]
    turns = empty_turns_k()
    for k in range(count):
        if k % BLOCK == 0:
            first, last = data.first + k, data.first + min(k + BLOCK, count)
            fill_turns(data.dtheta, data.dvel, data.weights, data.uniform, first, last, turns)
        body = turn_in_block_k(turns, k % BLOCK)
        x, u = step_azimuth_k(
            of, rule, axis, True, channel.number, gains, data.time[k + 1] - data.time[k], reference_k(channel, k + 1),
            forces_k(dcm_k(attitude), body), x,
        )  # fmt: skip
        attitude = step_k(attitude, body, frame_turn_k(*u))
        latitude, longitude, v, of_x[k + 1], ch, sh = north_k(x)
        q0, q1, q2, q3, rows.defect[k + 1] = quaternion_k(attitude)
        q = continued_k(q, multiply_k(ch, 0.0, 0.0, sh, q0, q1, q2, q3))
        keep_k(rows, k + 1, latitude, longitude, x.x.h, v, q)


engine = engines(_navigate, "azimuth", FORMS)


def azimuth_rule(problem: Problem, frame: str) -> tuple[int, Array]:
    """Return the rule for a frame's azimuth, and the pole of the route, Earth-fixed; zero without a route."""
    p, rule = problem, _RULES[frame]
    if rule != TRANSVERSE:
        return rule, np.zeros(3)
    return rule, route_pole(p.mechanization.route, float(p.latitude[0]), float(p.longitude[0]), p.velocity[0])


def solve(problem: Problem, frame: str) -> None:
    """Navigate in a frame of this file; see `sinssim.strapdown.engine_assembly.FrameFile`."""
    p = problem
    engine(p.algorithm, p.form)(p.increments, p.models, p.channel, p.solution, *azimuth_rule(p, frame), p.azimuth)


def check(problem: Problem, frame: str) -> None:
    """Raise if the solution comes too near to the pole of the transverse frame's route; other frames have no limit."""
    p, (rule, pole) = problem, azimuth_rule(problem, frame)
    if rule == TRANSVERSE and (near := too_near(pole, p.time, p.latitude, p.longitude, p.velocity)) is not None:
        raise RunError(near[1], time=float(p.time[near[0]]))


@inline
def slow_first_k(
    of: Models, rule: int, axis: Array, rows: Rows, of_x: Array, loop: Loop
) -> tuple[AzimuthState, Quaternion, float, float]:
    """`first_k` of `three_rate_schedule`."""
    x, of_x[0], ch, sh = start_azimuth_k(of, rule, axis, of_x[0], rows, loop)
    return x, (ch, 0.0, 0.0, -sh), x.x.down, x.x.k2


@inline
def slow_k(fixed: Fixed, x: AzimuthState) -> Slow:
    """`slow_k` of `three_rate_schedule`."""
    k, omega = x.x.k, fixed.of.earth.omega
    t = transport_k(fixed.rule, omega, x.x, x.v)
    return Slow(along(t, omega, k), along(t, 2.0 * omega, k), (x.x.north * k[0], x.x.north * k[1], x.x.down))


@inline
def slow_moved_k(
    fixed: Fixed, time: float, dt: float, at: float, reference: tuple[float, float], x: AzimuthState,
    before: AzimuthState, v: Vector, s: Vector,
) -> AzimuthState:  # fmt: skip
    """`moved_k` of `three_rate_schedule`."""
    a, b = x.x, before.x
    k2, kappa = a.k2 + at * (a.k2 - b.k2), a.kappa + at * (a.kappa - b.kappa)
    middle = Place(ahead_k(a.k, b.k, at), ahead_k(a.pole, b.pole, at), a.h, k2, kappa, a.north, a.down)
    r = transport_k(fixed.rule, fixed.of.earth.omega, middle, s)  # ∫ω_ew dt, of the mean velocity
    if fixed.rule == FREE_AZIMUTH:
        r = r[0], r[1], dt * r[2]
    e, lost = turned_on_k(x.e, x.lost, r)
    h, vz, loop = vertical_step_k(fixed.vertical, dt, fixed.gains, x.loop, a.h - s[2], v[2], reference)
    return AzimuthState(e, lost, place_k(fixed.of, fixed.rule, fixed.axis, e, h), (v[0], v[1], vz), x.a, loop)


@inline
def slow_north_k(x: AzimuthState) -> tuple[float, float, float, Vector, float, Quaternion]:
    """`north_k` of `three_rate_schedule`."""
    latitude, longitude, v, azimuth, ch, sh = north_k(x)
    return latitude, longitude, x.x.h, v, azimuth, (ch, 0.0, 0.0, sh)


three_rate_engine = three_rate_engines("azimuth", slow_first_k, slow_k, slow_moved_k, slow_north_k)


def solve_three_rates(
    problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool
) -> None:
    """Navigate at three rates; see `sinssim.strapdown.engine_assembly.ThreeRateFile`."""
    p, schedule = problem, Schedule(fast_per_medium, medium_per_slow, extrapolate)
    three_rate_engine(p.algorithm, p.form)(
        p.increments, p.models, p.channel, p.solution, schedule, *azimuth_rule(p, frame), p.azimuth
    )
