"""Error equations of the one-component system along any motion, and their closed forms for a body at rest.

With errors Δa_x, Δa_y of the accelerometers and Δω of the rate, nose-up positive, the small errors of V̇ = a_ξ, ẏ = V/R,
α̇ = ω + V/R obey

    (8.10)  Δα̇ = Δω + ΔV/R,    ΔV̇ = Δa_x cos α − Δa_y sin α − a_η Δα,    Δẏ = ΔV/R
    (8.11)  Δÿ + (a_η/R) Δy = (Δa_x cos α − Δa_y sin α)/R − (a_η/R) Δα_g,    Δα_g = ∫Δω dt
    (8.12)  Δÿ + (g/R) Δy = (Δa_x − α Δa_y)/R − (g/R) Δα_g    to first order in α, with a_η = g

where a_η is the vertical specific force of the motion. Δα_g begins at Δα − Δy, so that Δα = Δα_g + Δy at all times. An
attitude sensor that measures α − y gives its error as Δα_g itself. For Δa_x = Δa_y = Δa the accelerometers' part of
(8.12) is Δa(1 − α)/R. The chapter's (8.14) has +ω_s² Δα on the right because its Δα counts nose-down.

At rest, constant errors give the sum of (8.13), (8.15) with Δω₀ = −Δω, the effect of a constant error of ω̇, and the
free oscillation of initial errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import POSITIVE, number, numbers
from sinssim.data import Array
from sinssim.jit import kernel
from sinssim.strapdown.one_component import GRAVITY, RADIUS, schuler_rate


@dataclass(frozen=True)
class ErrorSources:
    """The errors of the readings over N intervals, and the initial errors.

    Attributes:
        force: mean errors Δa_x, Δa_y of the accelerometers over each interval, (N, 2) m/s².
        rate: error Δω of the rate at the beginning and at the end of each interval, linear between, (N, 2) rad/s.
        velocity: ΔV at the start, m/s.
        coordinate: Δy at the start, rad.
        angle: Δα_g at the start, the error of the pitch minus that of the coordinate, rad.
    """

    force: Array
    rate: Array
    velocity: float = 0.0
    coordinate: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True)
class PlaneErrors:
    """Errors of the one-component system, computed minus true.

    Attributes:
        time: (N+1,) s.
        velocity: ΔV, (N+1,) m/s.
        coordinate: Δy, (N+1,) rad.
        pitch: Δα, (N+1,) rad.
    """

    time: Array
    velocity: Array
    coordinate: Array
    pitch: Array


@kernel
def _along(
    time: Array, push: Array, vertical: Array, rate: Array, curvature: float, velocity: Array, y: Array, pitch: Array
) -> None:
    """Integrate (8.10) by the fourth-order Runge-Kutta method; columns: begin, middle and end of each interval."""
    v, a = velocity[0], pitch[0]
    for k in range(len(push)):
        h = time[k + 1] - time[k]
        w0, w2 = rate[k, 0], rate[k, 1]
        w1 = 0.5 * (w0 + w2)
        v1, a1 = push[k, 0] - vertical[k, 0] * a, w0 + v * curvature
        v2 = push[k, 1] - vertical[k, 1] * (a + 0.5 * h * a1)
        a2 = w1 + (v + 0.5 * h * v1) * curvature
        v3 = push[k, 1] - vertical[k, 1] * (a + 0.5 * h * a2)
        a3 = w1 + (v + 0.5 * h * v2) * curvature
        v4 = push[k, 2] - vertical[k, 2] * (a + h * a3)
        a4 = w2 + (v + h * v3) * curvature
        y[k + 1] = y[k] + h * curvature * (v + h / 6.0 * (v1 + v2 + v3))
        v += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4)
        a += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        velocity[k + 1], pitch[k + 1] = v, a


@kernel
def _pendulum(time: Array, stiffness: Array, forcing: Array, y: Array, speed: Array) -> None:
    """Integrate ÿ + k(t) y = f(t) by the fourth-order Runge-Kutta method; columns as in `_along`."""
    p, u = y[0], speed[0]
    for j in range(len(forcing)):
        h = time[j + 1] - time[j]
        u1 = forcing[j, 0] - stiffness[j, 0] * p
        u2 = forcing[j, 1] - stiffness[j, 1] * (p + 0.5 * h * u)
        u3 = forcing[j, 1] - stiffness[j, 1] * (p + 0.5 * h * u + 0.25 * h * h * u1)
        u4 = forcing[j, 2] - stiffness[j, 2] * (p + h * u + 0.5 * h * h * u2)
        p += h * u + h * h / 6.0 * (u1 + u2 + u3)
        u += h / 6.0 * (u1 + 2.0 * (u2 + u3) + u4)
        y[j + 1], speed[j + 1] = p, u


def _nodes(values: Array) -> Array:
    """Return values at the beginning, the middle and the end of each interval, (N, 3), from those at 2N+1 nodes."""
    return np.stack([values[:-2:2], values[1::2], values[2::2]], axis=1)


def _angle_error(time: Array, sources: ErrorSources) -> Array:
    """Return Δα_g at the beginning, the middle and the end of each interval, (N, 3) rad."""
    h, first, last = np.diff(time), sources.rate[:, 0], sources.rate[:, 1]
    ends = sources.angle + np.concatenate(([0.0], np.cumsum(0.5 * h * (first + last))))
    return np.stack([ends[:-1], ends[:-1] + h * (3.0 * first + last) / 8.0, ends[1:]], axis=1)


def error_along_motion(
    time: Array, sources: ErrorSources, pitch: Array, vertical: Array, radius: float = RADIUS
) -> PlaneErrors:
    """Integrate (8.10) along a motion.

    Args:
        time: edges of the intervals, (N+1,) s.
        sources: errors of the readings and initial errors.
        pitch: true α at the edges and the middles of the intervals in turn, (2N+1,) rad.
        vertical: true a_η at the same instants, (2N+1,) m/s².
        radius: radius of the Earth, m.

    Returns:
        The errors at the edges.
    """
    v, y, a = (np.empty(len(time)) for _ in range(3))
    v[0], y[0], a[0] = sources.velocity, sources.coordinate, sources.angle + sources.coordinate
    alpha, (x, up) = _nodes(pitch), sources.force.T[:, :, None]
    push = x * np.cos(alpha) - up * np.sin(alpha)
    _along(time, push, _nodes(vertical), np.ascontiguousarray(sources.rate), 1.0 / radius, v, y, a)
    return PlaneErrors(time, v, y, a)


def error_pendulum(
    time: Array, sources: ErrorSources, pitch: Array, vertical: Array, radius: float = RADIUS
) -> PlaneErrors:
    """Integrate (8.11) along a motion: the pendulum whose stiffness a_η/R changes.

    Args:
        time, sources, pitch, vertical, radius: as for `error_along_motion`.

    Returns:
        The errors at the edges.
    """
    alpha, (x, up) = _nodes(pitch), sources.force.T[:, :, None]
    return _swing(time, sources, x * np.cos(alpha) - up * np.sin(alpha), _nodes(vertical), radius)


def error_first_order(
    time: Array, sources: ErrorSources, pitch: Array, gravity: float = GRAVITY, radius: float = RADIUS
) -> PlaneErrors:
    """Integrate (8.12): first order in α, with the stiffness g/R of a body at rest.

    Args:
        time, sources, pitch, radius: as for `error_along_motion`.
        gravity: m/s².

    Returns:
        The errors at the edges.
    """
    alpha, (x, up) = _nodes(pitch), sources.force.T[:, :, None]
    return _swing(time, sources, x - alpha * up, np.full_like(alpha, gravity), radius)


def _swing(time: Array, sources: ErrorSources, push: Array, vertical: Array, radius: float) -> PlaneErrors:
    """Integrate Δÿ + (a_η/R)(Δy + Δα_g) = push/R."""
    angle = _angle_error(time, sources)
    y, speed = np.empty(len(time)), np.empty(len(time))
    y[0], speed[0] = sources.coordinate, sources.velocity / radius
    _pendulum(time, vertical / radius, (push - vertical * angle) / radius, y, speed)
    return PlaneErrors(time, radius * speed, y, np.concatenate((angle[:, 0], angle[-1:, 2])) + y)


@dataclass(frozen=True)
class ConstantErrors:
    """Constant errors of a body at rest, and initial errors.

    Attributes:
        force: Δa_x cos α − Δa_y sin α, m/s².
        rate: Δω at the start, nose-up positive, rad/s.
        acceleration: Δω̇, rad/s².
        velocity, coordinate, angle: initial errors as in `ErrorSources`.
    """

    force: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0
    velocity: float = 0.0
    coordinate: float = 0.0
    angle: float = 0.0


def closed_form(
    time: ArrayLike, errors: ConstantErrors, gravity: float = GRAVITY, radius: float = RADIUS
) -> PlaneErrors:
    """Return the errors of a body at rest by constant errors: (8.13), (8.15) and what else is constant.

    Args:
        time: since the start, (N,) s.
        errors: the constant errors.
        gravity: m/s².
        radius: radius of the Earth, m.

    Returns:
        The errors,

            Δy = (Δa/g − Δα_g)(1 − cos ω_s t) − Δω (t − sin ω_s t/ω_s) − Δω̇ (t²/2 − (1 − cos ω_s t)/ω_s²)
                 + Δy₀ cos ω_s t + ΔV₀ sin ω_s t/(ω_s R),

        with ΔV = R dΔy/dt and Δα = Δα_g + Δω t + Δω̇ t²/2 + Δy.
    """
    t, w = numbers("time", time), schuler_rate(gravity, radius)
    gravity = number("gravity", gravity, "m/s²", low=POSITIVE)
    sine, cosine = np.sin(w * t), np.cos(w * t)
    versine = 2.0 * np.sin(0.5 * w * t) ** 2
    start = errors.force / gravity - errors.angle
    y = (
        start * versine
        - errors.rate * (t - sine / w)
        - errors.acceleration * (0.5 * t * t - versine / w**2)
        + errors.coordinate * cosine
        + errors.velocity / (w * radius) * sine
    )
    speed = (
        (start - errors.coordinate) * w * sine
        - errors.rate * versine
        - errors.acceleration * (t - sine / w)
        + errors.velocity / radius * cosine
    )
    angle = errors.angle + errors.rate * t + 0.5 * errors.acceleration * t * t
    return PlaneErrors(np.asarray(t), np.asarray(radius * speed), np.asarray(y), np.asarray(angle + y))
