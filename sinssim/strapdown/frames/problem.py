"""The initial value problem that a frame's file solves, and the checks of every solution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sinssim.checks import not_finite_in
from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters
from sinssim.errors import RunError


class Problem(NamedTuple):
    """Increments, models and an initial state, and the arrays of the solution, whose first rows hold that state.

    Attributes:
        algorithm: attitude algorithm, one of `sinssim.ALGORITHMS`.
        time: of the rows of the solution, (N+1,) s.
        dtheta, dvel: increments of angle, rad, and velocity, m/s, (M, 3); M is N times the samples of one update.
        weights: of the fit of rate and specific force, see `increments.fit.weight_table`.
        uniform: whether all intervals are equal.
        earth: parameters of the ellipsoid.
        gravity: number of the gravity model.
        simplified: whether the radii of curvature are those of (8.16).
        vertical: number of the vertical channel, see `frames.vertical`.
        height_reference: height that the channel goes by, (N+1,) m; empty for a free one.
        climb_reference: down velocity that it goes by, (N+1,) m/s; empty unless the height is held.
        time_constant: of the baro loop, s.
        route: latitude and longitude of A and of B, rad, for a frame that takes a route.
        latitude, longitude: of the solution, (N+1,) rad.
        height: (N+1,) m.
        velocity: north, east, down, (N+1, 3) m/s.
        q_nb: attitude quaternion relative to north, east, down, (N+1, 4).
        defect: what the attitude variables lost of norm or orthogonality, (N+1,).
        first: number of the first increment that is navigated; the fit looks at those before it.
    """

    algorithm: str
    time: Array
    dtheta: Array
    dvel: Array
    weights: Array
    uniform: bool
    earth: EarthParameters
    gravity: int
    simplified: bool
    vertical: int
    height_reference: Array
    climb_reference: Array
    time_constant: float
    route: tuple[float, float, float, float] | None
    latitude: Array
    longitude: Array
    height: Array
    velocity: Array
    q_nb: Array
    defect: Array
    first: int = 0

    @property
    def channel(self) -> tuple[int, Array, Array, float]:
        """The vertical channel as the engines take it: number, two references, time constant."""
        return self.vertical, self.height_reference, self.climb_reference, self.time_constant

    @property
    def solution(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """The arrays of the solution as the engines take them."""
        return self.latitude, self.longitude, self.height, self.velocity, self.q_nb, self.defect


def check_solution(problem: Problem) -> None:
    """Raise if the numbers of a solution ran away.

    Args:
        problem: solved.

    Raises:
        RunError: a height, velocity or attitude is no finite number.
    """
    if wrong := not_finite_in(problem.height, problem.velocity, problem.q_nb):
        raise ran_away(problem, *wrong)


def ran_away(problem: Problem, name: str, row: int) -> RunError:
    """Return the error for a solution that leaves all bounds at a row.

    Args:
        problem: solved.
        name: of the quantity that leaves them.
        row: number of the row.

    Returns:
        The error, ready to raise.
    """
    before = max(1, row * len(problem.dtheta) // (len(problem.time) - 1))
    turn, push = (float(np.hypot.reduce(a[:before], axis=1).max()) for a in (problem.dtheta, problem.dvel))
    time = float(problem.time[row])
    return RunError(
        f"the navigation's {name} ran away and is no usable number at t = {time:.2f} s. The increments before it turn "
        f"the body by up to {math.degrees(turn):.3g}° and push it by up to {push:.3g} m/s in one interval: if that is "
        f"right (rad and m/s are expected), {problem.algorithm} does not converge on so long an interval, and a higher "
        "rate or another algorithm is needed.",
        time=time,
    )
