"""The motion of the one-component system in the vertical plane, and the outputs of ideal sensors along it.

V(t), H(t) and the pitch ϑ(t) of the body are curves through the rows of [one_component.motion]. They give the pitch of
the accelerometers α = ϑ + α_a0 and, as in the chapter's equations,

    ẏ = V/R,    ω = ϑ̇ − ẏ,    a_ξ = V̇,    a_η = g + Ḧ − V²/R,
    a_x = a_ξ cos α + a_η sin α,    a_y = a_η cos α − a_ξ sin α

With `altitude_effects` the motion is that of a point at the distance r = R + H from the centre of the Earth:

    ẏ = V/r,    a_ξ = V̇ + V Ḣ/r,    a_η = g (R/r)² + Ḧ − V²/r
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.truth.one_component_configuration import OneComponent, Row
from sinssim.truth.sampling import sample_edges
from sinssim.units import DEG

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_BLOCK = 16384  # pieces integrated together, so that no temporary is as long as a run


@dataclass(frozen=True)
class PlaneState:
    """True motion in the vertical plane at N instants."""

    time: Array  # (N,) s
    velocity: Array  # V along the great circle, (N,) m/s
    height: Array  # H, (N,) m
    body_pitch: Array  # ϑ, (N,) rad
    pitch: Array  # α = ϑ + α_a0 of the accelerometer x, (N,) rad
    rate: Array  # ω in inertial space, (N,) rad/s
    horizontal: Array  # specific force a_ξ, (N,) m/s²
    vertical: Array  # specific force a_η, (N,) m/s²


@dataclass(frozen=True)
class PlaneIncrements:
    """Integrals of what ideal sensors read over N intervals."""

    time: Array  # edges of the intervals, (N+1,) s
    coordinate: Array  # y at the edges, (N+1,) rad
    dvel: Array  # of a_x and a_y, (N, 2) m/s
    dtheta: Array  # of ω, (N,) rad
    drate: Array  # of ω̇, (N,) rad/s


class PlaneMotion:
    """The motion of a [one_component] table."""

    def __init__(self, system: OneComponent) -> None:
        """Lay the curves through the rows."""
        motion, self.duration = system.motion, system.duration_s
        self._radius, self._gravity = system.radius_m, system.gravity_mps2
        self._at_height = system.altitude_effects
        self._mounting, self._start = system.mounting_angle_deg * DEG, system.coordinate_deg * DEG
        smooth = motion.interpolation == "spline"
        self._velocity = _curve(motion.velocity_mps, smooth)
        self._height = _curve(motion.height_m, smooth)
        self._body_pitch = _curve(motion.pitch_deg, smooth, DEG)
        knots = (curve.x for curve in (self._velocity, self._height, self._body_pitch))
        self._knots = np.unique(np.concatenate([k for k in knots if len(k) > 2] or [np.zeros(1)]))
        if self._at_height:
            _check_height(self._height, self.duration, self._radius)

    def state(self, time: Array) -> PlaneState:
        """Return the true motion.

        Args:
            time: instants, (N,) s.
        """
        v, height, theta = self._velocity(time), self._height(time), self._body_pitch(time)
        turn, horizontal, vertical = self._felt(time, v, height)
        rate = self._body_pitch(time, 1) - turn
        return PlaneState(time, v, height, theta, theta + self._mounting, rate, horizontal, vertical)

    def _felt(self, time: Array, velocity: Array, height: Array) -> tuple[Array, Array, Array]:
        """Return ẏ, rad/s, and the specific force along the local horizon and up, m/s²."""
        along, up = self._velocity(time, 1), self._height(time, 2)
        if not self._at_height:
            return velocity / self._radius, along, self._gravity + up - velocity**2 / self._radius
        r = self._radius + height
        gravity = self._gravity * (self._radius / r) ** 2
        return velocity / r, along + velocity * self._height(time, 1) / r, gravity + up - velocity**2 / r

    def increments(self, rate_hz: float) -> PlaneIncrements:
        """Return the integrals of ideal readings by Gauss-Legendre quadrature, exact to rounding between rows."""
        time = sample_edges(0.0, self.duration, rate_hz)
        edges = np.unique(np.concatenate((time, self._knots[self._knots < time[-1]])))
        sums = np.concatenate(list(self._pieces(edges)))
        pieces = np.searchsorted(edges, time)  # the rows inside an interval cut it into pieces
        push = np.add.reduceat(sums[:, :2], pieces[:-1])
        coordinate = self._start + np.concatenate(([0.0], np.cumsum(sums[:, 2])))[pieces]
        truth = self.state(time)
        dtheta = np.diff(truth.body_pitch) - np.add.reduceat(sums[:, 2], pieces[:-1])
        return PlaneIncrements(time, coordinate, push, dtheta, np.diff(truth.rate))

    def _pieces(self, edges: Array) -> Iterator[Array]:
        """Yield the integrals of a_x, a_y and ẏ over smooth pieces, block by block, (B, 3)."""
        for first in range(0, len(edges) - 1, _BLOCK):
            ends = edges[first : first + _BLOCK + 1]
            half = 0.5 * np.diff(ends)[:, None]
            time = (ends[:-1, None] + half * (1.0 + _NODES)).ravel()
            state = self.state(time)
            c, s = np.cos(state.pitch), np.sin(state.pitch)
            turn = self._body_pitch(time, 1) - state.rate
            felt = (state.horizontal * c + state.vertical * s, state.vertical * c - state.horizontal * s, turn)
            yield np.stack([half[:, 0] * (f.reshape(len(half), -1) @ _WEIGHTS) for f in felt], axis=1)


def _curve(rows: tuple[Row, ...], smooth: bool, unit: float = 1.0) -> PPoly:
    """Return a piecewise polynomial through rows, constant for a single one."""
    time, values = np.array(rows, dtype=np.float64).T
    values = unit * values
    if len(time) == 1:
        return PPoly(values[None, :], np.array([0.0, 1.0]))
    if smooth:
        return CubicSpline(time, values, bc_type="natural")
    monotone = PchipInterpolator(time, values)
    return PPoly(monotone.c, monotone.x)


def _check_height(height: PPoly, duration: float, radius: float) -> None:
    """Raise for a height at which the motion would come near to the centre of the Earth."""
    time = np.linspace(0.0, duration, 10_001)
    lowest = float(height(time).min())
    if lowest < -0.5 * radius:
        raise InputError(
            f"one_component.motion.height_m reaches {lowest:g} m; with altitude_effects it must stay above half the "
            f"radius, {-0.5 * radius:g} m."
        )
