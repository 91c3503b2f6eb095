"""The slow part of three rates in the inertial frame, with geodetic output: position, the Earth's angle, gravitation.

    r₁ = r₀ + Σ ½(V₀ + V₁) T

There is neither Coriolis nor a frame rate. But gravitation turns in inertial axes with the vehicle and the Earth, by
1e-4 rad/s: held over a slow interval it lags by half of it, which acts as an accelerometer bias of 5 µg at 10 Hz.
Extrapolated it does not. Position and velocity are Earth-referred by the slow part alone. The loop is that of
`schedule`.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from sinssim.data import Array
from sinssim.jit import inline
from sinssim.rotation.quaternions import Quaternion, Vector
from sinssim.rotation.vectors import add
from sinssim.strapdown.frames.inertial import InertialState, coordinates_k, gravitation_k, settled_k, start_inertial_k
from sinssim.strapdown.frames.navigation_problem import Models, Problem, Rows
from sinssim.strapdown.frames.vertical_channel import Loop
from sinssim.strapdown.three_rate.schedule import Fixed, Schedule, Slow, engine_of


@inline
def first_k(
    of: Models, rule: int, axis: Array, rows: Rows, of_x: Array, loop: Loop
) -> tuple[InertialState, Quaternion, float, float]:
    """See `schedule.first_k`."""
    return start_inertial_k(of, rows, loop)


@inline
def slow_k(fixed: Fixed, x: InertialState) -> Slow:
    """See `schedule.slow_k`."""
    return Slow((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), x.g)


@inline
def moved_k(
    fixed: Fixed, time: float, dt: float, at: float, reference: tuple[float, float], x: InertialState,
    before: InertialState, v: Vector, s: Vector,
) -> InertialState:  # fmt: skip
    """See `schedule.moved_k`."""
    angle, r = fixed.of.earth.omega * (time - fixed.start), add(x.r, s)
    turn = cos(angle), sin(angle)
    g = gravitation_k(fixed.of, turn, r)
    return settled_k(fixed.of, fixed.vertical, fixed.gains, dt, turn, reference, r, v, g, x.loop)


@inline
def north_k(x: InertialState) -> tuple[float, float, float, Vector, float, Quaternion]:
    """See `schedule.north_k`."""
    latitude, longitude, q_ni = coordinates_k(x.north)
    return latitude, longitude, x.north.h, x.north.v, 0.0, q_ni


engine = engine_of("inertial", globals())


def solve(problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool) -> None:
    """Navigate at three rates; see `sinssim.strapdown.engine_assembly.ThreeRateFile`."""
    p, schedule = problem, Schedule(fast_per_medium, medium_per_slow, extrapolate)
    engine(p.algorithm)(p.increments, p.models, p.channel, p.solution, schedule, 0, np.zeros(3), p.azimuth)
