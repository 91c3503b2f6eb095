"""The initial value problem of a frame's file, and the checks of every solution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sinssim.checks import not_finite_in
from sinssim.data import Array
from sinssim.earth.kernels import EarthParameters
from sinssim.errors import RunError
from sinssim.strapdown.frames.vertical import NUMBERS, Channel
from sinssim.strapdown.mechanization import Mechanization


class Increments(NamedTuple):
    """What an engine integrates; see `Problem`."""

    time: Array
    dtheta: Array
    dvel: Array
    weights: Array
    uniform: bool
    first: int


class Models(NamedTuple):
    """Ellipsoid, number of the gravity model, and whether the radii of curvature are those of (8.16)."""

    earth: EarthParameters
    gravity: int
    simplified: bool


class Rows(NamedTuple):
    """The arrays of a solution; see `Problem`."""

    latitude: Array
    longitude: Array
    height: Array
    velocity: Array
    q_nb: Array
    defect: Array


class Problem(NamedTuple):
    """Increments, models and an initial state, and the arrays of the solution, whose first rows hold that state.

    Attributes:
        mechanization: the options of the navigator.
        time: times of the rows of the solution, (N+1,) s.
        dtheta, dvel: increments of angle, rad, and velocity, m/s, (M, 3); M is N times the samples of one update.
        weights: weights of the fit of rate and specific force, see `increments.fit.weight_table`.
        uniform: whether all intervals are equal.
        earth: parameters of the ellipsoid.
        gravity: number of the gravity model.
        height_reference: reference height of the vertical channel, (N+1,) m; empty for a free one.
        climb_reference: reference down velocity of the vertical channel, (N+1,) m/s; empty unless the height is held.
        latitude, longitude: of the solution, (N+1,) rad.
        height: (N+1,) m.
        velocity: north, east, down, (N+1, 3) m/s.
        q_nb: attitude quaternion relative to north, east, down, (N+1, 4).
        defect: defect of norm or orthogonality of the attitude variables, (N+1,).
        azimuth: direction of the frame's x axis from north, (N+1,) rad; its first row is that of the start. Empty for a
            frame that points north or is not level.
        first: number of the first navigated increment; the fit uses those before it.
    """

    mechanization: Mechanization
    time: Array
    dtheta: Array
    dvel: Array
    weights: Array
    uniform: bool
    earth: EarthParameters
    gravity: int
    height_reference: Array
    climb_reference: Array
    latitude: Array
    longitude: Array
    height: Array
    velocity: Array
    q_nb: Array
    defect: Array
    azimuth: Array
    first: int = 0

    @property
    def algorithm(self) -> str:
        """The attitude algorithm, one of `sinssim.ALGORITHMS`."""
        return self.mechanization.algorithm

    @property
    def simplified(self) -> bool:
        """Whether the radii of curvature are those of (8.16), which the engines have beside the exact ones."""
        return self.mechanization.curvature == "simplified"

    @property
    def form(self) -> str:
        """The form of the engine with these radii, one of `radii.FORMS`; "" for exact ones and those of (8.16)."""
        curvature = self.mechanization.curvature
        return "" if curvature in ("exact", "simplified") else curvature

    @property
    def increments(self) -> Increments:
        """The increments for the engines."""
        return Increments(self.time, self.dtheta, self.dvel, self.weights, self.uniform, self.first)

    @property
    def models(self) -> Models:
        """The Earth for the engines."""
        return Models(self.earth, self.gravity, self.simplified)

    @property
    def channel(self) -> Channel:
        """The vertical channel for the engines."""
        of = self.mechanization
        return Channel(NUMBERS[of.vertical], self.height_reference, self.climb_reference, of.baro_time_constant)

    @property
    def solution(self) -> Rows:
        """The arrays of the solution for the engines."""
        return Rows(self.latitude, self.longitude, self.height, self.velocity, self.q_nb, self.defect)


def check_solution(problem: Problem) -> None:
    """Raise if the numbers of a solution diverged.

    Raises:
        RunError: a height, velocity or attitude is not finite.
    """
    if wrong := not_finite_in(problem.height, problem.velocity, problem.q_nb):
        raise ran_away(problem, *wrong)


def ran_away(problem: Problem, name: str, row: int) -> RunError:
    """Return the error for a solution that diverges at a row."""
    before = max(1, row * len(problem.dtheta) // (len(problem.time) - 1))
    turn, push = (float(np.hypot.reduce(a[:before], axis=1).max()) for a in (problem.dtheta, problem.dvel))
    time = float(problem.time[row])
    return RunError(
        f"the navigation's {name} diverged and is not usable at t = {time:.2f} s. The increments before it rotate the "
        f"body by up to {math.degrees(turn):.3g}° and accelerate it by up to {push:.3g} m/s in one interval. If that "
        f"is right (rad and m/s are expected), the interval is too long for {problem.algorithm}: use a higher rate or "
        "another algorithm.",
        time=time,
    )
