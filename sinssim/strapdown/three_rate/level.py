"""The slow part of three rates (8.20)-(8.28) in the level frame with north orientation.

The longitude over a slow interval is computed with the latitude at its middle. The loop is that of `schedule`.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth.ellipsoid_kernels import gravity_ned_k
from sinssim.jit import inline
from sinssim.rotation.quaternions import Quaternion, Vector
from sinssim.strapdown.frames.navigation_problem import Models, Problem, Rows, curvatures_k
from sinssim.strapdown.frames.vertical_channel import Loop, vertical_step_k
from sinssim.strapdown.three_rate.schedule import Fixed, Schedule, Slow, engine_of


class Place(NamedTuple):
    """Latitude and longitude, rad, height, m, velocity, m/s, the baro loop; curvatures, 1/m, gravity north and down."""

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
def _place_k(of: Models, latitude: float, longitude: float, h: float, v: Vector, loop: Loop) -> Place:
    s = sin(latitude)
    k1, k2, r2 = curvatures_k(of.earth, of.simplified, s, h)
    return Place(latitude, longitude, h, v, loop, k1, k2, *gravity_ned_k(of.earth, of.gravity, s, cos(latitude), r2, h))


@inline
def first_k(
    of: Models, rule: int, axis: Array, rows: Rows, of_x: Array, loop: Loop
) -> tuple[Place, Quaternion, float, float]:
    """See `schedule.first_k`."""
    v = rows.velocity[0, 0], rows.velocity[0, 1], rows.velocity[0, 2]
    x = _place_k(of, rows.latitude[0], rows.longitude[0], rows.height[0], v, loop)
    return x, (1.0, 0.0, 0.0, 0.0), x.down, x.k2


@inline
def slow_k(fixed: Fixed, x: Place) -> Slow:
    """See `schedule.slow_k`."""
    s, c = sin(x.latitude), cos(x.latitude)
    north, down = fixed.of.earth.omega * c, -fixed.of.earth.omega * s
    tn, te, td = x.v[1] * x.k2, -x.v[0] * x.k1, -x.v[1] * x.k2 * s / c
    return Slow((north + tn, te, down + td), (2.0 * north + tn, te, 2.0 * down + td), (x.north, 0.0, x.down))


@inline
def moved_k(
    fixed: Fixed, time: float, dt: float, at: float, reference: tuple[float, float], x: Place, before: Place,
    v: Vector, s: Vector,
) -> Place:  # fmt: skip
    """See `schedule.moved_k`."""
    north = s[0] * (x.k1 + at * (x.k1 - before.k1))
    longitude = x.longitude + s[1] * (x.k2 + at * (x.k2 - before.k2)) / cos(x.latitude + 0.5 * north)
    if longitude > pi:
        longitude -= 2.0 * pi
    elif longitude <= -pi:
        longitude += 2.0 * pi
    h, vd, loop = vertical_step_k(fixed.vertical, dt, fixed.gains, x.loop, x.h - s[2], v[2], reference)
    return _place_k(fixed.of, x.latitude + north, longitude, h, (v[0], v[1], vd), loop)


@inline
def north_k(x: Place) -> tuple[float, float, float, Vector, float, Quaternion]:
    """See `schedule.north_k`."""
    return x.latitude, x.longitude, x.h, x.v, 0.0, (1.0, 0.0, 0.0, 0.0)


engine = engine_of("level", globals())


def solve(problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool) -> None:
    """Navigate at three rates; see `sinssim.strapdown.engine_assembly.ThreeRateFile`."""
    p, schedule = problem, Schedule(fast_per_medium, medium_per_slow, extrapolate)
    engine(p.algorithm, p.form)(p.increments, p.models, p.channel, p.solution, schedule, 0, np.zeros(3), p.azimuth)
