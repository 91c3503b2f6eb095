"""The initial value problem that a frame's engine solves, checks of its solution, and kernels of all engines.

The models of the Earth may have radii of curvature with the eccentricity or the height dropped, beside the exact ones
and those of (8.16):

    exact                  1/(R₁+h), 1/(R₂+h)
    spherical              1/(a+h),  1/(a+h)     e² dropped: R₁ = R₂ = a
    no-height              1/R₁,     1/R₂        h dropped
    spherical-no-height    1/a,      1/a         both dropped

Each form is compiled into engines of its own, so that the others are as fast as without it. Gravity keeps e² and h: it
has simplifications of its own.

The vertical channel of pure inertial navigation is unstable and can be stabilised by a reference.
The third-order baro loop controls height and vertical velocity by the error e = h − h_ref against a height reference: ḣ
= −v_D − k₁e, v̇_D = … + k₂e + k₃∫e dt, k₁ = 3/τ, k₂ = 3/τ² + 2g/R, k₃ = 1/τ³.

The readings of an altimeter are discrete. When one arrives, e is the height at that time minus the reading, and is held
until the next one arrives, as in a sampled control loop. The loop does not compensate latency and lag: in a climb the
height lags accordingly. When the next reading is overdue, the loop opens: e is 0 and the integral is kept, so that the
height is integrated from the accelerometers with the bias that the loop has estimated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import first_not_finite, not_finite_in, numbers
from sinssim.data import Array, NavSolution
from sinssim.earth.geodetic_coordinates import radii_k
from sinssim.earth.gravity import EarthParameters, gravity_number, parameters
from sinssim.errors import InputError, RunError, check_name
from sinssim.frames import VERTICALS
from sinssim.jit import inline, strict_inline
from sinssim.rotation.quaternions import Matrix, Quaternion, Vector
from sinssim.rotation.vectors import resolved
from sinssim.strapdown.coning_sculling import BodyTurn
from sinssim.strapdown.mechanization import Mechanization

FREE, BARO_LOOP, HELD = 0, 1, 2
"""Vertical channels by number."""

NUMBERS = {"free": FREE, "baro-loop": BARO_LOOP, "truth": HELD}
"""Their numbers by name."""


NOTHING_NEW, OVERDUE, NOT_A_HEIGHT = 1e30, 2e30, 0.5e30
"""Values in a reference at a row without a reading, for a held e or an open loop; and a limit of heights, m. Infinity
and NaN cannot be used, because kernels are compiled for finite numbers."""


@dataclass(frozen=True)
class HeightReadings:
    """The readings of an altimeter for the loop."""

    arrival: Array  # arrival times, in order, (M,) s
    value: Array  # heights above the ellipsoid, (M,) m
    interval: float  # time between readings, s; a reading that is late by more than half of it is overdue

    def at(self, time: Array) -> Array:
        """Return the reading that arrived since the previous row, for each row, (N+1,) m; the first row has none.

        Special values stand where there is no new reading or the next reading is overdue.
        """
        last = np.searchsorted(self.arrival, time + 1e-9, side="right") - 1
        out = np.full(len(time), NOTHING_NEW)
        if len(self.arrival):
            new = np.diff(last, prepend=-1) > 0
            out[new] = self.value[last[new]]
            out[time - self.arrival[last] > 1.5 * self.interval] = OVERDUE
        out[last < 0] = OVERDUE
        out[0] = OVERDUE
        return out


def height_reference(vertical: str, height: ArrayLike | HeightReadings | None, time: Array) -> tuple[Array, Array]:
    """Return the references of a vertical channel at the rows: height, m, and for the held one its down velocity, m/s.

    `height` is the reference at every time, m, or readings for the loop; None for the free channel. References that the
    channel does not need are empty.
    """
    check_name("vertical channel", vertical, VERTICALS)
    if height is not None and vertical == "free":
        raise InputError(
            'height would have no effect: vertical = "free" uses no height reference; "baro-loop" and "truth" do.'
        )
    if vertical == "free":
        return np.empty(0), np.empty(0)
    if height is None:
        raise InputError(f'vertical="{vertical}" needs height=…: the reference height at every imu.time, (N+1,) m.')
    if isinstance(height, HeightReadings):
        if vertical != "baro-loop":
            raise InputError(
                f'vertical="{vertical}" needs a height at every imu.time; measurements are for "baro-loop".'
            )
        return height.at(time), np.empty(0)
    reference = numbers("height", height).copy()  # a copy, because the loop fills in heights without readings
    if reference.shape != time.shape:
        raise InputError(
            f"height has shape {reference.shape}, but must have one value at every imu.time, {time.shape}."
        )
    row = first_not_finite(reference)
    if row is not None:
        raise InputError(f"height[{row}] = {reference[row]} m at t = {time[row]:.6f} s is not a finite number.")
    return reference, -np.gradient(reference, time) if vertical == "truth" else np.empty(0)


class Channel(NamedTuple):
    """The vertical channel of an engine: its number, references at the rows (empty if not needed), τ of the loop."""

    number: int
    height: Array
    climb: Array
    time_constant: float


@strict_inline
def loop_gains_k(time_constant: float, gravity_down: float, k2: float) -> Vector:
    """Gains k₁, k₂, k₃ of the baro loop; k2 is the curvature 1/(R₂+h) where it is used."""
    rate = 1.0 / time_constant
    return 3.0 * rate, 3.0 * rate * rate + 2.0 * gravity_down * k2, rate * rate * rate


@strict_inline
def error_after_k(reference: float, h: float, e: float) -> float:
    """Return the error that holds from a row on, from its reference, its height h and the previous error e."""
    if reference < NOT_A_HEIGHT:
        return h - reference
    return e if reference < OVERDUE else 0.0


class Loop(NamedTuple):
    """State of the baro loop: k₃∫e dt, and the error e that is held until the next reading."""

    sum: float
    error: float


@strict_inline
def start_loop_k(channel: Channel, h: float) -> Loop:
    """State of the loop at the start."""
    return Loop(0.0, error_after_k(channel.height[0], h, 0.0) if channel.number == BARO_LOOP else 0.0)


@strict_inline
def reference_k(channel: Channel, row: int) -> tuple[float, float]:
    """Height and down velocity of a channel's reference at a row, as far as it has them."""
    height = channel.height[row] if channel.number != FREE else 0.0
    return height, channel.climb[row] if channel.number == HELD else 0.0


@strict_inline
def vertical_step_k(
    vertical: int, dt: float, gains: Vector, loop: Loop, h1: float, v_down1: float, reference: tuple[float, float]
) -> tuple[float, float, Loop]:
    """Height, down velocity and loop at the end of an interval in any of the channels, second order in the interval.

    h1 and v_down1 are the free values at the end, and `reference` is that of the end.
    """
    height, climb = reference
    if vertical == HELD:
        return height, climb, loop
    if vertical != BARO_LOOP:
        return h1, v_down1, loop
    e = 0.5 * (loop.error + (h1 - dt * gains[0] * loop.error - height)) if height < NOT_A_HEIGHT else loop.error
    pull = dt * (gains[1] * e + loop.sum + 0.5 * dt * gains[2] * e)
    corrected_height = h1 - dt * (gains[0] * e + 0.5 * pull)
    return (
        corrected_height,
        v_down1 + pull,
        Loop(loop.sum + dt * gains[2] * e, error_after_k(height, corrected_height, loop.error)),
    )


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
