"""The slow part of three rates in the level frames that do not point north: wander, free and transverse azimuth.

It turns the quaternion q_ew by the transport rate of the mean velocity, with the Earth's axis and the curvatures held
or extrapolated to mid-interval:

    q_ew ← q_ew ∘ q(∫ω_ew dt)

The equations are those of `frames.azimuth`, the loop is that of `schedule`.
"""

from __future__ import annotations

from sinssim.data import Array
from sinssim.jit import inline
from sinssim.rotation.quaternions import Quaternion, Vector
from sinssim.rotation.vectors import along
from sinssim.strapdown.frames.azimuth import (
    FREE_AZIMUTH,
    AzimuthState,
    Place,
    azimuth_rule,
    place_k,
    start_azimuth_k,
    transport_k,
    turned_on_k,
)
from sinssim.strapdown.frames.azimuth import north_k as azimuth_north_k
from sinssim.strapdown.frames.navigation_problem import Models, Problem, Rows
from sinssim.strapdown.frames.vertical_channel import Loop, vertical_step_k
from sinssim.strapdown.three_rate.schedule import Fixed, Schedule, Slow, ahead_k, engine_of


@inline
def first_k(
    of: Models, rule: int, axis: Array, rows: Rows, of_x: Array, loop: Loop
) -> tuple[AzimuthState, Quaternion, float, float]:
    """See `schedule.first_k`."""
    x, of_x[0], ch, sh = start_azimuth_k(of, rule, axis, of_x[0], rows, loop)
    return x, (ch, 0.0, 0.0, -sh), x.x.down, x.x.k2


@inline
def slow_k(fixed: Fixed, x: AzimuthState) -> Slow:
    """See `schedule.slow_k`."""
    k, omega = x.x.k, fixed.of.earth.omega
    t = transport_k(fixed.rule, omega, x.x, x.v)
    return Slow(along(t, omega, k), along(t, 2.0 * omega, k), (x.x.north * k[0], x.x.north * k[1], x.x.down))


@inline
def moved_k(
    fixed: Fixed, time: float, dt: float, at: float, reference: tuple[float, float], x: AzimuthState,
    before: AzimuthState, v: Vector, s: Vector,
) -> AzimuthState:  # fmt: skip
    """See `schedule.moved_k`."""
    a, b = x.x, before.x
    k2, kappa = a.k2 + at * (a.k2 - b.k2), a.kappa + at * (a.kappa - b.kappa)
    middle = Place(ahead_k(a.k, b.k, at), ahead_k(a.pole, b.pole, at), a.h, k2, kappa, a.north, a.down)
    r = transport_k(fixed.rule, fixed.of.earth.omega, middle, s)
    if fixed.rule == FREE_AZIMUTH:
        r = r[0], r[1], dt * r[2]
    e, lost = turned_on_k(x.e, x.lost, r)
    h, vz, loop = vertical_step_k(fixed.vertical, dt, fixed.gains, x.loop, a.h - s[2], v[2], reference)
    return AzimuthState(e, lost, place_k(fixed.of, fixed.rule, fixed.axis, e, h), (v[0], v[1], vz), x.a, loop)


@inline
def north_k(x: AzimuthState) -> tuple[float, float, float, Vector, float, Quaternion]:
    """See `schedule.north_k`."""
    latitude, longitude, v, azimuth, ch, sh = azimuth_north_k(x)
    return latitude, longitude, x.x.h, v, azimuth, (ch, 0.0, 0.0, sh)


engine = engine_of("azimuth", globals())


def solve(problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool) -> None:
    """Navigate at three rates; see `sinssim.strapdown.engine_assembly.ThreeRateFile`."""
    p, schedule = problem, Schedule(fast_per_medium, medium_per_slow, extrapolate)
    engine(p.algorithm, p.form)(
        p.increments, p.models, p.channel, p.solution, schedule, *azimuth_rule(p, frame), p.azimuth
    )  # fmt: skip
