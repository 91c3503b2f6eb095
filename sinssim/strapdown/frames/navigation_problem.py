"""The initial value problem that a frame's engine solves, checks of its solution, and kernels of all engines.

The models of the Earth may have radii of curvature with the eccentricity or the height dropped, beside the exact ones
and those of (8.16):

    exact                  1/(R₁+h), 1/(R₂+h)
    spherical              1/(a+h),  1/(a+h)     e² dropped: R₁ = R₂ = a
    no-height              1/R₁,     1/R₂        h dropped
    spherical-no-height    1/a,      1/a         both dropped

Each form is compiled into engines of its own, so that the others are as fast as without it. Gravity keeps e² and h: it
has simplifications of its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sinssim.arguments import not_finite_in
from sinssim.data import Array, NavSolution
from sinssim.earth.geodetic_coordinates import radii_k
from sinssim.earth.gravity import EarthParameters, gravity_number, parameters
from sinssim.errors import RunError
from sinssim.jit import inline
from sinssim.rotation.quaternions import Matrix, Quaternion, Vector
from sinssim.rotation.vectors import resolved
from sinssim.strapdown.coning_sculling import BodyTurn
from sinssim.strapdown.frames.vertical_channel import NUMBERS, Channel
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


def form_of(of: Mechanization) -> str:
    """Return the form of the engines of a mechanization, one of `FORMS`; "" for exact radii and those of (8.16)."""
    return "" if of.curvature in ("exact", "simplified") else of.curvature


def models_of(of: Mechanization) -> Models:
    """Return the Earth of a mechanization for the engines."""
    return Models(parameters(of.earth), gravity_number(of.gravity), of.curvature == "simplified")


def channel_of(of: Mechanization, height: Array, climb: Array) -> Channel:
    """Return the vertical channel of a mechanization for the engines, with its references at the rows."""
    return Channel(NUMBERS[of.vertical], height, climb, of.baro_time_constant)


class Problem(NamedTuple):
    """Increments, models and an initial state, and the arrays of the solution, whose first rows hold that state."""

    mechanization: Mechanization  # the options of the navigator
    time: Array  # times of the rows of the solution, (N+1,) s
    dtheta: Array
    dvel: Array
    """`dtheta`, `dvel`: increments of angle, rad, and velocity, m/s, (M, 3); M is N times the samples of one update."""
    weights: Array  # weights of the fit of rate and specific force, see `coning_sculling.weight_table`
    uniform: bool  # whether all intervals are equal
    height_reference: Array  # reference height of the vertical channel, (N+1,) m; empty for a free one
    climb_reference: Array
    """Reference down velocity of the vertical channel, (N+1,) m/s; empty unless the height is held."""
    latitude: Array
    longitude: Array  # latitude, longitude: of the solution, (N+1,) rad
    height: Array  # (N+1,) m
    velocity: Array  # north, east, down, (N+1, 3) m/s
    q_nb: Array  # attitude quaternion relative to north, east, down, (N+1, 4)
    defect: Array  # defect of norm or orthogonality of the attitude variables, (N+1,)
    azimuth: Array
    """Direction of the frame's x axis from north, (N+1,) rad; its first row is that of the start. Empty for a frame
    that points north or is not level.
    """
    first: int = 0  # number of the first navigated increment; the fit uses those before it

    @property
    def algorithm(self) -> str:
        """The attitude algorithm, one of `sinssim.ALGORITHMS`."""
        return self.mechanization.algorithm

    @property
    def form(self) -> str:
        """The form of the engine, one of `FORMS`; "" for exact radii and those of (8.16)."""
        return form_of(self.mechanization)

    @property
    def increments(self) -> Increments:
        """The increments for the engines."""
        return Increments(self.time, self.dtheta, self.dvel, self.weights, self.uniform, self.first)

    @property
    def models(self) -> Models:
        """The Earth for the engines."""
        return models_of(self.mechanization)

    @property
    def channel(self) -> Channel:
        """The vertical channel for the engines."""
        return channel_of(self.mechanization, self.height_reference, self.climb_reference)

    @property
    def solution(self) -> Rows:
        """The arrays of the solution for the engines."""
        return Rows(self.latitude, self.longitude, self.height, self.velocity, self.q_nb, self.defect)

    @property
    def navigated(self) -> NavSolution:
        """The solution, once its engine has filled the rows."""
        return NavSolution(
            self.time, self.latitude, self.longitude, self.height, self.velocity, self.q_nb, self.defect,
            self.algorithm, azimuth=self.azimuth if len(self.azimuth) else None,
        )  # fmt: skip


def check_solution(problem: Problem) -> None:
    """Raise if the numbers of a solution diverged."""
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


@inline
def forces_k(c: Matrix, b: BodyTurn) -> tuple[Vector, Vector, Vector]:
    """Increment of velocity, and specific force at the start and the end times the interval, in the frame's axes."""
    return (
        resolved(c, (b.dv_x, b.dv_y, b.dv_z)),
        resolved(c, (b.fs_x, b.fs_y, b.fs_z)),
        resolved(c, (b.fe_x, b.fe_y, b.fe_z)),
    )


@inline
def continued_k(q: Quaternion, r: Quaternion) -> Quaternion:
    """The quaternion r or −r, whichever follows q without a jump of sign."""
    if q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3] < 0.0:
        return -r[0], -r[1], -r[2], -r[3]
    return r


@inline
def first_quaternion_k(rows: Rows) -> Quaternion:
    """q_nb of the first row."""
    return rows.q_nb[0, 0], rows.q_nb[0, 1], rows.q_nb[0, 2], rows.q_nb[0, 3]


@inline
def keep_k(rows: Rows, row: int, latitude: float, longitude: float, h: float, v: Vector, q: Quaternion) -> None:
    """Store a row of a solution."""
    rows.latitude[row], rows.longitude[row], rows.height[row] = latitude, longitude, h
    rows.velocity[row, 0], rows.velocity[row, 1], rows.velocity[row, 2] = v
    rows.q_nb[row, 0], rows.q_nb[row, 1], rows.q_nb[row, 2], rows.q_nb[row, 3] = q


SPHERICAL, NO_HEIGHT = False, False
"""What a form drops: e², and the height. Engines of other forms are bound to other values."""

FORMS = {
    "spherical": {"SPHERICAL": True},
    "no-height": {"NO_HEIGHT": True},
    "spherical-no-height": {"SPHERICAL": True, "NO_HEIGHT": True},
}
"""The values by form."""


@inline
def distances_k(p: EarthParameters, s: float, h: float) -> tuple[float, float, float, float]:
    """R₁+h and R₂+h in the form, and the exact R₁ and R₂; s is the sine of the latitude."""
    r1, r2 = radii_k(p, s)
    x1, x2 = (p.a, p.a) if SPHERICAL else (r1, r2)
    return (x1, x2, r1, r2) if NO_HEIGHT else (x1 + h, x2 + h, r1, r2)


@inline
def curvatures_k(p: EarthParameters, simplified: bool, s: float, h: float) -> tuple[float, float, float]:
    """1/(R₁+h), 1/(R₂+h) and R₂, which is that of gravity and exact; s is the sine of the latitude."""
    x1, x2, _, r2 = distances_k(p, s, h)
    if simplified:  # (8.16)
        x = h / p.a
        return (1.0 + p.e2 * (1.0 - 1.5 * s * s) - x) / p.a, (1.0 - 0.5 * p.e2 * s * s - x) / p.a, r2
    inverse = 1.0 / (x1 * x2)
    return x2 * inverse, x1 * inverse, r2
