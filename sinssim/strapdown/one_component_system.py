"""The chapter's one-component system (section 8.1) in a vertical plane, its error equations and closed forms.

The system has two accelerometers, x along the body and y up, and one source of pitch. It moves over a spherical Earth
of radius R. ω is the rate of the body in inertial space, nose-up positive, y = S/R the coordinate along the great
circle, and α the pitch of the accelerometer x above the local horizon:

    V̇ = a_ξ = a_x cos α − a_y sin α,    ẏ = V/R,    α̇ = ω + V/R

The pitch comes from a gyro, which measures ω (`simulate`), from an attitude sensor, which measures the inertial angle α
− y (`simulate_measured`), or from accelerometers on an arm, which measure ω̇ (`simulate_two_integrals`).

Position is fed back through the pitch, which gives a Schuler oscillation of ω_s² = g/R. Its small errors obey (8.12)
and (8.14),

    Δÿ + ω_s² Δy = Δa/R,    Δÿ + ω_s² Δy = ω_s² Δα

with the solutions (8.13) and (8.15) below. Δα is the pitch error that the chapter writes on the right, nose-down
positive; so is the gyro error Δω₀ = dΔα/dt. The gyro here is nose-up positive: Δω₀ = −Δω.

With errors Δa_x, Δa_y of the accelerometers and Δω of the rate, nose-up positive, the small errors of V̇ = a_ξ, ẏ =
V/R, α̇ = ω + V/R obey

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
from math import cos, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import POSITIVE, check_finite, check_increasing, doubles, number, numbers
from sinssim.data import Array
from sinssim.earth.ellipsoids import MEAN_GRAVITY, MEAN_RADIUS
from sinssim.errors import InputError
from sinssim.jit import inline, kernel

RADIUS = MEAN_RADIUS
"""Radius of the chapter's spherical Earth [m]."""

GRAVITY = MEAN_GRAVITY
"""Its gravity [m/s²]; with `RADIUS` it gives a Schuler period of 84.4 min."""


@dataclass(frozen=True)
class OneComponentSolution:
    """The solution of the one-component system at the edges of the intervals."""

    time: Array  # (N+1,) s
    velocity: Array  # along the great circle, (N+1,) m/s
    coordinate: Array  # y = S/R, (N+1,) rad
    pitch: Array  # α above the local horizon, (N+1,) rad
    rate: Array | None = None
    """Rate ω in inertial space where it is a state, that of the two integrals, (N+1,) rad/s; otherwise None."""


@inline
def _derivative_k(
    velocity: float, pitch: float, rate: float, forward: float, up: float, curvature: float
) -> tuple[float, float, float]:
    s, c = sin(pitch), cos(pitch)
    turn = velocity * curvature
    return forward * c - up * s, turn, rate + turn


@kernel
def _simulate_measured(
    time: Array, angle: Array, dvel: Array, curvature: float, velocity: Array, coordinate: Array, pitch: Array
) -> None:
    """Like `_simulate`, with α = inertial angle + y; the angle is linear within an interval."""
    v, y = velocity[0], coordinate[0]
    pitch[0] = angle[0] + y
    for k in range(len(dvel)):
        h = time[k + 1] - time[k]
        fx, fy = dvel[k, 0] / h, dvel[k, 1] / h
        middle = 0.5 * (angle[k] + angle[k + 1])
        v1, y1, _ = _derivative_k(v, angle[k] + y, 0.0, fx, fy, curvature)
        v2, y2, _ = _derivative_k(v + 0.5 * h * v1, middle + y + 0.5 * h * y1, 0.0, fx, fy, curvature)
        v3, y3, _ = _derivative_k(v + 0.5 * h * v2, middle + y + 0.5 * h * y2, 0.0, fx, fy, curvature)
        v4, y4, _ = _derivative_k(v + h * v3, angle[k + 1] + y + h * y3, 0.0, fx, fy, curvature)
        v += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4)
        y += h / 6.0 * (y1 + 2.0 * (y2 + y3) + y4)
        velocity[k + 1], coordinate[k + 1], pitch[k + 1] = v, y, angle[k + 1] + y


@kernel
def _simulate(
    time: Array, rate: Array, dvel: Array, curvature: float, velocity: Array, coordinate: Array, pitch: Array
) -> None:
    """Fourth-order Runge-Kutta integration with the mean force of each interval.

    The columns of the rate are those at the beginning, the middle and the end of each interval, (N, 3) rad/s.
    """
    v, y, a = velocity[0], coordinate[0], pitch[0]
    for k in range(len(dvel)):
        h = time[k + 1] - time[k]
        fx, fy = dvel[k, 0] / h, dvel[k, 1] / h
        v1, y1, a1 = _derivative_k(v, a, rate[k, 0], fx, fy, curvature)
        v2, y2, a2 = _derivative_k(v + 0.5 * h * v1, a + 0.5 * h * a1, rate[k, 1], fx, fy, curvature)
        v3, y3, a3 = _derivative_k(v + 0.5 * h * v2, a + 0.5 * h * a2, rate[k, 1], fx, fy, curvature)
        v4, y4, a4 = _derivative_k(v + h * v3, a + h * a3, rate[k, 2], fx, fy, curvature)
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
    """Run the one-component system on increments over intervals with the edges `time`, (N+1,) s.

    `dtheta` are integrals of the gyro's rate, nose-up positive, (N,) rad; `dvel` those of the specific force along the
    body and up, (N, 2) m/s; velocity, m/s, coordinate and pitch, rad, are those at time[0]; `radius` is that of the
    Earth, m. The readings of each interval are assumed constant at their mean, which gives the fourth order in the
    interval for constant readings and the second for others.
    """
    turns = doubles("dtheta", dtheta)
    edges, pushes = _intervals(time, dvel, dtheta=turns)
    check_finite("dtheta", turns, "rad", edges)
    radius = number("radius", radius, "m", low=POSITIVE)
    v, y, a = _states(len(edges), velocity, coordinate, pitch)
    mean = turns * (1.0 / np.diff(edges))
    _simulate(edges, np.stack([mean, mean, mean], axis=1), pushes, 1.0 / radius, v, y, a)
    return OneComponentSolution(edges, v, y, a)


def simulate_measured(
    time: ArrayLike,
    angle: ArrayLike,
    dvel: ArrayLike,
    *,
    velocity: float = 0.0,
    coordinate: float = 0.0,
    radius: float = RADIUS,
) -> OneComponentSolution:
    """Run the one-component system with a measured angle, α = angle + y, as `simulate`.

    `angle` is the pitch in inertial space, α − y, as the attitude sensor reads it at the edges, (N+1,) rad; it is
    linear within an interval.
    """
    angles = doubles("angle", angle)
    edges, pushes = _intervals(time, dvel, angle=angles)
    check_finite("angle", angles, "rad")
    radius = number("radius", radius, "m", low=POSITIVE)
    v, y, a = _states(len(edges), velocity, coordinate, 0.0)
    _simulate_measured(edges, angles, pushes, 1.0 / radius, v, y, a)
    return OneComponentSolution(edges, v, y, a)


def simulate_two_integrals(
    time: ArrayLike,
    dvel_arm: ArrayLike,
    dvel: ArrayLike,
    arm: float,
    *,
    velocity: float = 0.0,
    coordinate: float = 0.0,
    pitch: float = 0.0,
    rate: float = 0.0,
    radius: float = RADIUS,
) -> OneComponentSolution:
    """Run the one-component system without a gyro, as `simulate`: ω̇ from an accelerometer on an arm, integrated twice.

    An accelerometer parallel to y at the distance ℓ ahead of it reads a_y + ω̇ ℓ, because the centripetal acceleration
    acts along the arm. Hence ω̇ = (a_arm − a_y)/ℓ. `dvel_arm` are the integrals of its specific force, (N,) m/s, `arm`
    is ℓ, m, and `rate` ω at time[0], rad/s.
    """
    arms = doubles("dvel_arm", dvel_arm)
    edges, pushes = _intervals(time, dvel, dvel_arm=arms)
    check_finite("dvel_arm", arms, "m/s", edges)
    arm = number("arm", arm, "m")
    if not arm:
        raise InputError("arm = 0 m gives no angular acceleration; give the distance between the accelerometers.")
    radius = number("radius", radius, "m", low=POSITIVE)
    v, y, a = _states(len(edges), velocity, coordinate, pitch)
    steps = (arms - pushes[:, 1]) / arm  # of the rate
    w = np.cumsum(np.append(number("rate", rate, "rad/s"), steps))
    _simulate(edges, np.stack([w[:-1], w[:-1] + 0.5 * steps, w[1:]], axis=1), pushes, 1.0 / radius, v, y, a)
    return OneComponentSolution(edges, v, y, a, w)


def projections(force_x: ArrayLike, force_y: ArrayLike, pitch: ArrayLike) -> tuple[Array, Array]:
    """Resolve the specific force of the body, or its integrals, along the local horizon and vertical.

    a_ξ = a_x cos α − a_y sin α and a_η = a_x sin α + a_y cos α, (N,) each, with the pitch α of the accelerometer x,
    rad. Along a motion a_η = g + vertical acceleration − V²/R.
    """
    x, y, alpha = numbers("force_x", force_x), numbers("force_y", force_y), numbers("pitch", pitch)
    c, s = np.cos(alpha), np.sin(alpha)
    return np.asarray(x * c - y * s), np.asarray(x * s + y * c)


def _intervals(time: ArrayLike, dvel: ArrayLike, **given: Array) -> tuple[Array, Array]:
    """Return checked edges and velocity increments; `given` is the reading of the pitch, per interval or per edge."""
    edges, pushes = doubles("time", time), doubles("dvel", dvel)
    ((name, reading),) = given.items()
    n = len(pushes)
    rows = (n + 1,) if name == "angle" else (n,)
    if n < 1 or pushes.shape != (n, 2) or reading.shape != rows or edges.shape != (n + 1,):
        raise _not_together(time=edges, **given, dvel=pushes)
    check_finite("time", edges, "s")
    check_finite("dvel", pushes, "m/s", edges)
    check_increasing("time", edges)
    return edges, pushes


def _not_together(**arrays: Array) -> InputError:
    *most, last = (f"{name} {array.shape}" for name, array in arrays.items())
    reading = "N+1 angles" if "angle" in arrays else "(N,) readings of the rate or the arm"
    return InputError(
        f"the one-component system: {', '.join(most)} and {last} do not belong together: N ≥ 1 intervals have N+1 "
        f"edges in time, {reading} and (N, 2) velocity increments."
    )


def _states(edges: int, velocity: float, coordinate: float, pitch: float) -> tuple[Array, Array, Array]:
    """Return arrays for the states, with the initial values in their first row."""
    v, y, a = np.empty(edges), np.empty(edges), np.empty(edges)
    v[0], y[0] = number("velocity", velocity, "m/s"), number("coordinate", coordinate, "rad")
    a[0] = number("pitch", pitch, "rad")
    return v, y, a


def schuler_rate(gravity: float = GRAVITY, radius: float = RADIUS) -> float:
    """Return the Schuler frequency ω_s = √(g/R), rad/s; 2π over it is 84.4 min."""
    gravity = number("gravity", gravity, "m/s²", low=POSITIVE)
    return sqrt(gravity / number("radius", radius, "m", low=POSITIVE))


def accelerometer_error(time: ArrayLike, bias: float) -> Array:
    """Return the error of the coordinate by a constant accelerometer error Δa, (8.13): Δy = (Δa/g)(1 − cos ω_s t)."""
    phase = schuler_rate() * numbers("time", time)
    bias = number("bias", bias, "m/s²")
    return np.asarray(2.0 * bias / GRAVITY * np.sin(0.5 * phase) ** 2)


def gyro_error(time: ArrayLike, drift: float) -> Array:
    """Return the error of the coordinate by a constant gyro error, (8.15): δy = Δω₀ (t − sin(ω_s t)/ω_s), (N,) rad.

    Δω₀ is nose-down positive as in the chapter, rad/s.
    """
    rate, t = schuler_rate(), numbers("time", time)
    drift = number("drift", drift, "rad/s")
    return np.asarray(drift * (t - np.sin(rate * t) / rate))


@dataclass(frozen=True)
class ErrorSources:
    """The errors of the readings over N intervals, and the initial errors."""

    force: Array  # mean errors Δa_x, Δa_y of the accelerometers over each interval, (N, 2) m/s²
    rate: Array  # error Δω of the rate at the beginning and at the end of each interval, linear between, (N, 2) rad/s
    velocity: float = 0.0  # ΔV at the start, m/s
    coordinate: float = 0.0  # Δy at the start, rad
    angle: float = 0.0  # Δα_g at the start, the error of the pitch minus that of the coordinate, rad


@dataclass(frozen=True)
class PlaneErrors:
    """Errors of the one-component system, computed minus true."""

    time: Array  # (N+1,) s
    velocity: Array  # ΔV, (N+1,) m/s
    coordinate: Array  # Δy, (N+1,) rad
    pitch: Array  # Δα, (N+1,) rad


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
    """Integrate (8.10) along a motion; return the errors at the edges `time`, (N+1,) s.

    `pitch`, true α in rad, and `vertical`, true a_η in m/s², are those at the edges and the middles of the intervals in
    turn, (2N+1,).
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
    """Integrate (8.11) along a motion, as `error_along_motion`: the pendulum whose stiffness a_η/R changes."""
    alpha, (x, up) = _nodes(pitch), sources.force.T[:, :, None]
    return _swing(time, sources, x * np.cos(alpha) - up * np.sin(alpha), _nodes(vertical), radius)


def error_first_order(
    time: Array, sources: ErrorSources, pitch: Array, gravity: float = GRAVITY, radius: float = RADIUS
) -> PlaneErrors:
    """Integrate (8.12), as `error_along_motion`: first order in α, with the stiffness g/R of a body at rest."""
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
    """Constant errors of a body at rest, and initial errors."""

    force: float = 0.0  # Δa_x cos α − Δa_y sin α, m/s²
    rate: float = 0.0  # Δω at the start, nose-up positive, rad/s
    acceleration: float = 0.0  # Δω̇, rad/s²
    velocity: float = 0.0
    coordinate: float = 0.0
    angle: float = 0.0  # velocity, coordinate, angle: initial errors as in `ErrorSources`


def closed_form(
    time: ArrayLike, errors: ConstantErrors, gravity: float = GRAVITY, radius: float = RADIUS
) -> PlaneErrors:
    """Return the errors of a body at rest by constant errors: (8.13), (8.15) and what else is constant.

        Δy = (Δa/g − Δα_g)(1 − cos ω_s t) − Δω (t − sin ω_s t/ω_s) − Δω̇ (t²/2 − (1 − cos ω_s t)/ω_s²)
             + Δy₀ cos ω_s t + ΔV₀ sin ω_s t/(ω_s R)

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
