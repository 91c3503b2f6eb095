"""The chapter's one-component system (section 8.1): two accelerometers and one gyro in a vertical plane.

The system moves over a spherical Earth of radius R, with the accelerometers x along the body and y up, the gyro's rate
ω nose-up positive, the coordinate y = S/R along the great circle and the pitch α of the body above the local horizon:

    V̇ = a_x cos α − a_y sin α,    ẏ = V/R,    α̇ = ω + V/R

Position is fed back through the pitch, which gives a Schuler oscillation of ω_s² = g/R. Its small errors obey (8.12)
and (8.14),

    Δÿ + ω_s² Δy = Δa/R,    Δÿ + ω_s² Δy = ω_s² Δα

with the solutions (8.13) and (8.15) below. Δα is the pitch error that the chapter writes on the right, nose-down
positive; so is the gyro error Δω₀ = dΔα/dt. The gyro here is nose-up positive: Δω₀ = −Δω.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import POSITIVE, doubles, number, numbers
from sinssim.checks import check_finite, check_increasing
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.jit import inline, kernel

RADIUS = 6371000.0
"""Radius of the chapter's spherical Earth [m], the mean radius (R₁ of the IUGG)."""

GRAVITY = 9.81
"""Its gravity [m/s²]; with `RADIUS` it gives a Schuler period of 84.4 min."""


@dataclass(frozen=True)
class OneComponentSolution:
    """The solution of the one-component system at the edges of the intervals.

    Attributes:
        time: (N+1,) s.
        velocity: along the great circle, (N+1,) m/s.
        coordinate: y = S/R, (N+1,) rad.
        pitch: α above the local horizon, (N+1,) rad.
    """

    time: Array
    velocity: Array
    coordinate: Array
    pitch: Array


@inline
def _derivative_k(
    velocity: float, pitch: float, rate: float, forward: float, up: float, curvature: float
) -> tuple[float, float, float]:
    s, c = sin(pitch), cos(pitch)
    turn = velocity * curvature
    return forward * c - up * s, turn, rate + turn


@kernel
def _simulate(
    time: Array, dtheta: Array, dvel: Array, curvature: float, velocity: Array, coordinate: Array, pitch: Array
) -> None:
    """Fourth-order Runge-Kutta integration with the mean readings of each interval."""
    v, y, a = velocity[0], coordinate[0], pitch[0]
    for k in range(len(dtheta)):
        h = time[k + 1] - time[k]
        w, fx, fy = dtheta[k] / h, dvel[k, 0] / h, dvel[k, 1] / h
        v1, y1, a1 = _derivative_k(v, a, w, fx, fy, curvature)
        v2, y2, a2 = _derivative_k(v + 0.5 * h * v1, a + 0.5 * h * a1, w, fx, fy, curvature)
        v3, y3, a3 = _derivative_k(v + 0.5 * h * v2, a + 0.5 * h * a2, w, fx, fy, curvature)
        v4, y4, a4 = _derivative_k(v + h * v3, a + h * a3, w, fx, fy, curvature)
        v += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4)
        y += h / 6.0 * (y1 + 2.0 * (y2 + y3) + y4)
        a += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        velocity[k + 1], coordinate[k + 1], pitch[k + 1] = v, y, a


def simulate(
    time: ArrayLike,
    dtheta: ArrayLike,
    dvel: ArrayLike,
    *,
    velocity: float = 0.0,
    coordinate: float = 0.0,
    pitch: float = 0.0,
    radius: float = RADIUS,
) -> OneComponentSolution:
    """Run the one-component system on increments.

    The readings of each interval are assumed constant at their mean, which gives the fourth order in the interval for
    constant readings and the second for others.

    Args:
        time: edges of the intervals, (N+1,) s.
        dtheta: integral of the gyro's rate, nose-up positive, over each interval, (N,) rad.
        dvel: integrals of the specific force along the body and up, (N, 2) m/s.
        velocity, coordinate, pitch: at time[0], m/s, rad, rad.
        radius: radius of the Earth, m.

    Returns:
        The solution at every edge.

    Raises:
        InputError: the arrays do not belong together, a value is not finite, or the times do not increase.
    """
    edges, turns, pushes = doubles("time", time), doubles("dtheta", dtheta), doubles("dvel", dvel)
    n = len(turns)
    if turns.shape != (n,) or n < 1 or pushes.shape != (n, 2) or edges.shape != (n + 1,):
        raise InputError(
            f"the one-component system: time {edges.shape}, dtheta {turns.shape} and dvel {pushes.shape} do not belong "
            "together: N ≥ 1 intervals have N+1 edges in time, (N,) angle and (N, 2) velocity increments."
        )
    check_finite("time", edges, "s")
    check_finite("dtheta", turns, "rad", edges)
    check_finite("dvel", pushes, "m/s", edges)
    check_increasing("time", edges)
    velocity, coordinate = number("velocity", velocity, "m/s"), number("coordinate", coordinate, "rad")
    pitch, radius = number("pitch", pitch, "rad"), number("radius", radius, "m", low=POSITIVE)
    v, y, a = np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)
    v[0], y[0], a[0] = velocity, coordinate, pitch
    _simulate(edges, turns, pushes, 1.0 / radius, v, y, a)
    return OneComponentSolution(edges, v, y, a)


def schuler_rate(gravity: float = GRAVITY, radius: float = RADIUS) -> float:
    """Return the Schuler frequency ω_s = √(g/R).

    Args:
        gravity: m/s².
        radius: radius of the Earth, m.

    Returns:
        rad/s; 2π over it is 84.4 min.
    """
    gravity = number("gravity", gravity, "m/s²", low=POSITIVE)
    return sqrt(gravity / number("radius", radius, "m", low=POSITIVE))


def accelerometer_error(time: ArrayLike, bias: float, gravity: float = GRAVITY, radius: float = RADIUS) -> Array:
    """Return the error of the coordinate by a constant accelerometer error, (8.13).

    Args:
        time: (N,) s.
        bias: Δa of the accelerometer along the body, m/s².
        gravity: m/s².
        radius: radius of the Earth, m.

    Returns:
        Δy = (Δa/g)(1 − cos ω_s t), (N,) rad.
    """
    phase = schuler_rate(gravity, radius) * numbers("time", time)
    bias = number("bias", bias, "m/s²")
    return np.asarray(2.0 * bias / gravity * np.sin(0.5 * phase) ** 2)


def gyro_error(time: ArrayLike, drift: float, gravity: float = GRAVITY, radius: float = RADIUS) -> Array:
    """Return the error of the coordinate by a constant gyro error, (8.15).

    Args:
        time: (N,) s.
        drift: Δω₀, nose-down positive as in the chapter, rad/s.
        gravity: m/s².
        radius: radius of the Earth, m.

    Returns:
        Δy = Δω₀ (t − sin(ω_s t)/ω_s), (N,) rad.
    """
    rate, t = schuler_rate(gravity, radius), numbers("time", time)
    drift = number("drift", drift, "rad/s")
    return np.asarray(drift * (t - np.sin(rate * t) / rate))
