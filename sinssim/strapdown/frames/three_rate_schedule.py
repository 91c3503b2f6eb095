"""The loop of the three rates (8.20)-(8.28), for a slow processor, in any frame.

    fast     gyro increments, their compensation, attitude and its matrix B
    medium   velocity increments through B, Coriolis and gravity: velocity
    slow     position, radii of curvature, Earth rate Ω, transport rate ω, gravity

The velocity over a medium interval T, with the sum ΔW of its velocity increments, is

    V₁ = V₀ + ΔV − T (2Ω + ω) × (V₀ + ½ ΔV),   ΔV = ½(B₀ + B₁) ΔW + T g

The position over a slow interval follows from the mean of its velocities (trapezoidal rule). The results of the slow
part are either held until the next computation, or extrapolated linearly from the last two values. The scheme is
therefore of the second order in the medium interval, and of the first (held) or second (extrapolated) order in the slow
one. Its rows are the slow instants, at which all parts are synchronous.

Like the engines, this is a template over the attitude algorithm, and over the slow part of a frame, whose functions
`first_k`, `slow_k`, `moved_k` and `north_k` are bound to those in the frame's file.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from sinssim.data import Array
from sinssim.jit import inline, rebound
from sinssim.rotation.quaternions import Quaternion, Vector, multiply_k
from sinssim.rotation.vectors import add, along, cross, mean, mul, resolved, sub
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import BLOCK, FrameTurn, empty_turns_k, turn_in_block_k
from sinssim.strapdown.coning_sculling import fill_fitted_turns as fill_turns
from sinssim.strapdown.engine_assembly import engines
from sinssim.strapdown.frames.navigation_problem import (
    FORMS,
    Increments,
    Models,
    Rows,
    continued_k,
    first_quaternion_k,
    keep_k,
)
from sinssim.strapdown.frames.vertical_channel import Channel, loop_gains_k, reference_k, start_loop_k


class Schedule(NamedTuple):
    """Fast intervals in a medium one, medium ones in a slow one, and whether slow quantities are extrapolated."""

    fast: int
    medium: int
    extrapolate: bool


class Fixed(NamedTuple):
    """What the slow part of a frame has for the whole run.

    of: the Earth.
    rule, axis: of the frame's azimuth, see `sinssim.strapdown.frames.wander_free_transverse`.
    vertical, gains: of the vertical channel.
    start: time of the first row, s.
    """

    of: Models
    rule: int
    axis: Array
    vertical: int
    gains: Vector
    start: float


class Slow(NamedTuple):
    """What the slow part gives to the others: Ω + ω and 2Ω + ω, rad/s, and gravity, m/s²."""

    turn: Vector
    coriolis: Vector
    gravity: Vector


@inline
def ahead_k(now: Vector, before: Vector, x: float) -> Vector:
    """Linear extrapolation by x slow intervals beyond `now`; x = 0 holds."""
    return along(now, x, sub(now, before))


@inline
def _composed_k(a: Quaternion, b: Quaternion) -> Quaternion:
    """a ∘ b."""
    return multiply_k(*a, *b)


def first_k(of: Models, rule: int, axis: Array, rows: Rows, of_x: Array, loop: Any) -> Any:
    """Of a frame: state at the start, quaternion from north, east, down to the frame, gravity down and 1/(R₂+h)."""


def slow_k(fixed: Fixed, x: Any) -> Any:
    """Of a frame: results of the slow part in a state."""


def moved_k(
    fixed: Fixed, time: float, dt: float, at: float, reference: Any, x: Any, before: Any, v: Vector, s: Vector
) -> Any:
    """Of a frame: state at `time`, after a slow interval, from the new velocity v and ∫v dt, s.

    at: slow intervals by which to extrapolate to its middle from the states at its start, x, and one interval before.
    """


def north_k(x: Any) -> Any:
    """Of a frame: latitude, longitude, height, velocity, azimuth of its x axis, quaternion to north, east, down."""


def _navigate(
    data: Increments, of: Models, channel: Channel, rows: Rows, schedule: Schedule, rule: int, axis: Array, of_x: Array
) -> None:
    loop = start_loop_k(channel, rows.height[0])
    x, to_frame, down, k2 = first_k(of, rule, axis, rows, of_x, loop)
    gains = loop_gains_k(channel.time_constant, down, k2)  # the slow part runs the baro loop
    fixed = Fixed(of, rule, axis, channel.number, gains, data.time[0])
    q = first_quaternion_k(rows)
    attitude = start_k(*_composed_k(to_frame, q))
    rows.defect[0] = quaternion_k(attitude)[4]
    now, x_before, b = slow_k(fixed, x), x, dcm_k(attitude)
    before = now  # at the start the rate of change is unknown
    share = 1.0 / schedule.medium if schedule.extrapolate else 0.0  # of a slow interval
    turns, k, begin, filled = empty_turns_k(), data.first, data.first, data.first
    last = data.first + (data.time.shape[0] - 1) * schedule.medium * schedule.fast
    for row in range(data.time.shape[0] - 1):
        slow_dt = data.time[row + 1] - data.time[row]
        medium_dt = slow_dt / schedule.medium
        dt = medium_dt / schedule.fast
        v, total = x.v, (0.0, 0.0, 0.0)
        for medium in range(schedule.medium):
            pushed = (0.0, 0.0, 0.0)
            for fast in range(schedule.fast):
                pushed = add(pushed, (data.dvel[k, 0], data.dvel[k, 1], data.dvel[k, 2]))
                at = share * (medium + fast / schedule.fast)
                u0 = mul(dt, ahead_k(now.turn, before.turn, at))
                u1 = mul(dt, ahead_k(now.turn, before.turn, at + share / schedule.fast))
                um = mean(u0, u1)
                if k == filled:
                    begin, filled = k, min(k + BLOCK, last)
                    fill_turns(data.dtheta, data.dvel, data.weights, True, begin, filled, turns)
                attitude = step_k(attitude, turn_in_block_k(turns, k - begin), FrameTurn(*um, *u0, *um, *u1))
                k += 1
            c, at = dcm_k(attitude), share * (medium + 0.5)
            d = along(
                mean(resolved(b, pushed), resolved(c, pushed)), medium_dt, ahead_k(now.gravity, before.gravity, at)
            )
            b = c
            turn = ahead_k(now.coriolis, before.coriolis, at)
            v1 = along(add(v, d), -medium_dt, cross(turn, along(v, 0.5, d)))
            total, v = add(total, add(v, v1)), v1
        s, at = mul(0.5 * medium_dt, total), 0.5 if schedule.extrapolate else 0.0
        reference, time = reference_k(channel, row + 1), data.time[row + 1]
        x, x_before = moved_k(fixed, time, slow_dt, at, reference, x, x_before, v, s), x
        before, now = now, slow_k(fixed, x)
        latitude, longitude, h, v, azimuth, to_north = north_k(x)
        if of_x.shape[0] > 0:
            of_x[row + 1] = azimuth
        q0, q1, q2, q3, rows.defect[row + 1] = quaternion_k(attitude)
        q = continued_k(q, _composed_k(to_north, (q0, q1, q2, q3)))
        keep_k(rows, row + 1, latitude, longitude, h, v, q)


def three_rate_engines(
    frame: str,
    first: Callable[..., Any],
    slow: Callable[..., Any],
    moved: Callable[..., Any],
    north: Callable[..., Any],
) -> Callable[..., Callable[..., None]]:
    """Return the engines of a frame by the four functions of its slow part, as `engines` does."""
    parts = {"first_k": first, "slow_k": slow, "moved_k": moved, "north_k": north}
    forms = {
        form: {name: rebound(part, f"{name}_{frame}_{form}".replace("-", "_"), **of) for name, part in parts.items()}
        for form, of in {"": {}, **FORMS}.items()
    }
    return engines(_navigate, f"three_rate_{frame}", forms)
