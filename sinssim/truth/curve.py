"""The true motion of a flight: a smooth curve through its logged positions and attitudes, and the IMU along it.

Position is a quintic (C⁴) interpolating spline in Earth-fixed coordinates relative to the first knot. A spline
evaluated directly from its values at the knots would jump there by their rounding errors: 1e-10 m over 1/30 s is 3e-9
m/s, a random walk of millimetres in an hour. Therefore only the acceleration is taken from the spline. Velocity and
position are its running integrals, panel by panel, and a second spline through the residuals (knots minus integrals)
returns the curve to the knots. Position, velocity and acceleration then agree to rounding.

Attitude is a quintic spline through the sign-continuous quaternions as vectors of R⁴, normalised:
q(t) = s(t)/|s(t)|. Rates follow analytically, ω = 2 vec(s* ∘ ṡ)/|s|², because the change of the norm has no vector
part. The curve needs one banded linear solve, is four times differentiable and of order 6 in the knot spacing. A spline
of rotation vectors (`scipy.spatial.transform.RotationSpline`) is cubic, twice differentiable, of order 4, and needs an
iteration. The attitude must turn by well under half a turn between knots.

Specific force at the sensor block, r_s = r + C_eb l (Groves, Principles of GNSS, Inertial, and Multisensor
Integrated Navigation Systems, 2nd ed., 2013, eqs. 2.112, 2.165 and 2.169):

    f = C_be [ r̈_s + 2 ω_ie × ṙ_s + ω_ie × (ω_ie × r_s) − gravitation(r_s) ],   ω_ib^b = ω_eb^b + C_be ω_ie

On a panel of length h, with u the time since its first knot, the spline is c₀ + c₁u + … + c₅u⁵. Its second derivative
is a cubic spline; from its values a and its second derivatives s at the knots k and k+1:

    c₂ = a_k/2,  c₃ = [(a_k+1 − a_k)/h − h (2 s_k + s_k+1)/6]/6,  c₄ = s_k/24,  c₅ = (s_k+1 − s_k)/(120 h)
"""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.arguments import numbers, quaternion, vector
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError
from sinssim.jit import inline, kernel, strict_kernel
from sinssim.rotation.quaternions import Quaternion, Vector
from sinssim.truth.sampling import BlockMotion, Channel, FlightEvent, check_instants, in_blocks, sample_edges

DEGREE = 5
"""Degree of the splines through the knots."""

# Limit of the angle between neighbouring attitudes (cosine of its half), beyond which they do not define a smooth
# curve.
_LEAST_COSINE = np.cos(np.pi / 8)


@inline
def _curved_k(a: Array, s: Array, k: int, j: int, h: float) -> tuple[float, float, float, float]:
    """Return c₂ … c₅ of component j on panel k."""
    third = (a[k + 1, j] - a[k, j]) / h - h / 6.0 * (2.0 * s[k, j] + s[k + 1, j])
    return a[k, j] / 2.0, third / 6.0, s[k, j] / 24.0, (s[k + 1, j] - s[k, j]) / (120.0 * h)


@strict_kernel
def _integrate(time: Array, a: Array, s: Array, first: Array, v0: Array, panels: Array) -> None:
    """Set the panels of position: velocity is the running integral of a, and position that of velocity."""
    for j in range(3):
        panels[0, 0, j], panels[0, 1, j] = first[j], v0[j]
    for k in range(len(time) - 1):
        h = time[k + 1] - time[k]
        for j in range(3):
            r, v = panels[k, 0, j], panels[k, 1, j]
            c2, c3, c4, c5 = _curved_k(a, s, k, j, h)
            panels[k, 2, j], panels[k, 3, j], panels[k, 4, j], panels[k, 5, j] = c2, c3, c4, c5
            panels[k + 1, 0, j] = r + h * (v + h * (c2 + h * (c3 + h * (c4 + h * c5))))
            panels[k + 1, 1, j] = v + h * (2.0 * c2 + h * (3.0 * c3 + h * (4.0 * c4 + h * 5.0 * c5)))


@strict_kernel
def _join(time: Array, q: Array, a: Array, s: Array, panels: Array) -> None:
    """Set the panels of the quaternion, which pass exactly through the knots."""
    for k in range(len(time) - 1):
        h = time[k + 1] - time[k]
        for j in range(4):
            c2, c3, c4, c5 = _curved_k(a, s, k, 3 + j, h)
            panels[k, 0, 3 + j] = q[k, j]
            panels[k, 1, 3 + j] = (q[k + 1, j] - q[k, j]) / h - h * (c2 + h * (c3 + h * (c4 + h * c5)))
            panels[k, 2, 3 + j], panels[k, 3, 3 + j], panels[k, 4, 3 + j], panels[k, 5, 3 + j] = c2, c3, c4, c5


def checked_knots(time: ArrayLike, position_ecef: ArrayLike, q_eb: ArrayLike) -> tuple[Array, Array, Array]:
    """Return the knots of a curve as arrays after a check, with unit quaternions of continuous sign."""
    t, r, q = numbers("time", time), numbers("position_ecef", position_ecef), numbers("q_eb", q_eb)
    if t.ndim != 1 or r.shape != (len(t), 3) or q.shape != (len(t), 4):
        raise InputError(
            f"a curve needs K times, (K, 3) positions and (K, 4) quaternions; got arrays of shapes "
            f"{t.shape}, {r.shape} and {q.shape}."
        )
    if len(t) <= DEGREE:
        raise InputError(f"a curve needs at least {DEGREE + 1} knots, got {len(t)}.")
    for name, values in (("time", t), ("position", r), ("quaternion", q)):
        finite = np.isfinite(values.reshape(len(t), -1)).all(axis=1)
        if not finite.all():
            raise InputError(f"knot {int(np.argmin(finite))}: its {name} is not a finite number.")
    if not (np.diff(t) > 0.0).all():
        worst = int(np.argmin(np.diff(t) > 0.0))
        raise InputError(
            f"knot {worst + 1} at {t[worst + 1]!s} s is not later than the previous knot, at {t[worst]!s} s."
        )
    norm = np.linalg.norm(q, axis=1)
    if not (np.abs(norm - 1.0) < 1e-6).all():
        worst = int(np.argmax(np.abs(norm - 1.0)))
        raise InputError(f"knot {worst} at {t[worst]!s} s: its quaternion has norm {norm[worst]:g}, it must be 1.")
    q = q / norm[:, None]
    cosine = np.einsum("ij,ij->i", q[1:], q[:-1])
    if np.abs(cosine).min() < _LEAST_COSINE:
        worst = int(np.argmin(np.abs(cosine)))
        raise InputError(
            f"between the knots at {t[worst]!s} s and {t[worst + 1]!s} s the attitude turns by "
            f"{2.0 * np.degrees(np.arccos(abs(cosine[worst]))):.0f}°; it must turn by less than 45°: "
            "use more closely spaced knots."
        )
    q[1:] *= np.cumprod(np.where(cosine < 0.0, -1.0, 1.0))[:, None]
    return t, r, q


class KnotDerivatives(NamedTuple):
    """Derivatives at the knots, which determine the panels; they take longer to compute than the panels."""

    second: Array  # second derivatives of x, y, z, q0, q1, q2, q3, (K, 7)
    fourth: Array  # fourth derivatives, (K, 7)
    velocity: Array  # first derivative of x, y, z at the first knot, (3,) m/s


def knot_derivatives(time: Array, position: Array, q: Array) -> KnotDerivatives:
    """Return the derivatives of the splines through the knots, whose quaternions have a continuous sign."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(time, np.concatenate([position, q], axis=1), k=DEGREE)
    a, s, v0 = spline(time, 2), spline(time, 4), spline(time[0], 1)[:3]
    panels = np.empty((len(time), 6, 7))
    _integrate(time, a, s, position[0], v0, panels)
    rest = make_interp_spline(time, position - panels[:, 0, :3], k=DEGREE)  # what the integrals miss
    a[:, :3] += rest(time, 2)
    s[:, :3] += rest(time, 4)
    return KnotDerivatives(a, s, v0 + rest(time[0], 1))


def panels_through(time: Array, position: Array, q: Array, derivatives: KnotDerivatives) -> Array:
    """Return the polynomials between knots: (K-1, 6, 7) coefficients of x, y, z, q0, q1, q2, q3 by power of the time
    since the first knot of the panel."""
    a, s, v0 = derivatives
    panels = np.empty((len(time), 6, 7))  # a row more than panels, for the last knot
    _integrate(time, a, s, position[0], v0, panels)
    _join(time, q, a, s, panels)
    return panels[:-1]


# Gauss-Legendre points on each piece of a sample interval between knots. Six points reach rounding on pieces of 50 ms
# at 10 rad/s. Four points reach it on pieces of at most 20 ms on which the attitude turns by at most 0.1 rad.
_POINTS, _FEW_POINTS = 6, 4
_SHORT, _SMALL_TURN = 0.02, 0.1


class _Curve(NamedTuple):
    """The coefficients of a curve for the kernels."""

    time: Array  # (K,) knots, s
    panels: Array  # (K-1, 6, 7) coefficients of x, y, z, q0, q1, q2, q3 by power of the time since the panel's knot
    origin: Vector  # origin of positions, m
    lever: Vector  # lever arm from the position's point to the sensor block, in the block's axes, m


class _Motion(NamedTuple):
    """The sensor block's motion at one instant, in Earth-fixed axes unless stated otherwise."""

    position: Vector
    velocity: Vector
    acceleration: Vector
    attitude: Quaternion  # e from block
    rate: Vector  # of the block relative to the Earth, in the block's axes


@inline
def _value_k(c: Array, i: int, j: int, u: float) -> tuple[float, float, float]:
    """Value and first two derivatives of component j on panel i."""
    c0, c1, c2, c3, c4, c5 = c[i, 0, j], c[i, 1, j], c[i, 2, j], c[i, 3, j], c[i, 4, j], c[i, 5, j]
    return (
        c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5)))),
        c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5))),
        2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5)),
    )


@inline
def _motion_k(curve: _Curve, i: int, t: float) -> _Motion:
    c, u = curve.panels, t - curve.time[i]
    x, vx, ax = _value_k(c, i, 0, u)
    y, vy, ay = _value_k(c, i, 1, u)
    z, vz, az = _value_k(c, i, 2, u)
    s0, d0, e0 = _value_k(c, i, 3, u)
    s1, d1, e1 = _value_k(c, i, 4, u)
    s2, d2, e2 = _value_k(c, i, 5, u)
    s3, d3, e3 = _value_k(c, i, 6, u)

    inverse = 1.0 / (s0 * s0 + s1 * s1 + s2 * s2 + s3 * s3)
    scale = sqrt(inverse)
    q0, q1, q2, q3 = scale * s0, scale * s1, scale * s2, scale * s3
    # ω = 2 vec(s* ∘ ṡ)/|s|²   and   ω̇ = 2 vec(s* ∘ s̈)/|s|² − 2 ω (s·ṡ)/|s|²
    _, wx, wy, wz = rotation.multiply_k(s0, -s1, -s2, -s3, d0, d1, d2, d3)
    _, bx, by, bz = rotation.multiply_k(s0, -s1, -s2, -s3, e0, e1, e2, e3)
    twice = 2.0 * inverse
    wx, wy, wz = twice * wx, twice * wy, twice * wz
    growth = twice * (s0 * d0 + s1 * d1 + s2 * d2 + s3 * d3)
    bx, by, bz = twice * bx - growth * wx, twice * by - growth * wy, twice * bz - growth * wz

    # the block on its lever arm: C l, C (ω × l), C (ω̇ × l + ω × (ω × l))
    lx, ly, lz = curve.lever
    px, py, pz = rotation.cross_k(wx, wy, wz, lx, ly, lz)
    mx, my, mz = rotation.cross_k(wx, wy, wz, px, py, pz)
    nx, ny, nz = rotation.cross_k(bx, by, bz, lx, ly, lz)
    lx, ly, lz = rotation.rotate_k(q0, q1, q2, q3, lx, ly, lz)
    px, py, pz = rotation.rotate_k(q0, q1, q2, q3, px, py, pz)
    nx, ny, nz = rotation.rotate_k(q0, q1, q2, q3, mx + nx, my + ny, mz + nz)
    ox, oy, oz = curve.origin
    return _Motion(
        (ox + (x + lx), oy + (y + ly), oz + (z + lz)),
        (vx + px, vy + py, vz + pz),
        (ax + nx, ay + ny, az + nz),
        (q0, q1, q2, q3),
        (wx, wy, wz),
    )


@inline
def _readings_k(
    p: earth.EarthParameters, model: int, motion: _Motion
) -> tuple[float, float, float, float, float, float]:
    """Inertial angular rate and specific force in the block's axes."""
    x, y, z = motion.position
    vx, vy, _ = motion.velocity
    ax, ay, az = motion.acceleration
    q0, q1, q2, q3 = motion.attitude
    gx, gy, gz = earth.gravitation_ecef_k(p, model, x, y, z)
    w = p.omega
    fx, fy, fz = rotation.rotate_k(
        q0, -q1, -q2, -q3, ax - 2.0 * w * vy - w * w * x - gx, ay + 2.0 * w * vx - w * w * y - gy, az - gz
    )
    ex, ey, ez = rotation.rotate_k(q0, -q1, -q2, -q3, 0.0, 0.0, w)
    wx, wy, wz = motion.rate
    return wx + ex, wy + ey, wz + ez, fx, fy, fz


@kernel
def _increments(
    curve: _Curve,
    p: earth.EarthParameters,
    model: int,
    edges: Array,
    nodes: Array,
    weights: Array,
    first: int,
    last: int,
    dtheta: Array,
    dvel: Array,
) -> None:
    """Integrate over the intervals first...last-1, piece by piece between knots."""
    knots = curve.time
    panel = max(0, min(np.searchsorted(knots, edges[first], side="right") - 1, len(knots) - 2))
    for k in range(first, last):
        tx = ty = tz = sx = sy = sz = 0.0
        left = edges[k]
        while True:
            while panel < len(knots) - 2 and knots[panel + 1] <= left:
                panel += 1
            right = edges[k + 1]
            if panel < len(knots) - 2:
                right = min(right, knots[panel + 1])
            middle, half = 0.5 * (left + right), 0.5 * (right - left)
            for i in range(len(nodes)):
                wx, wy, wz, fx, fy, fz = _readings_k(p, model, _motion_k(curve, panel, middle + half * nodes[i]))
                weight = half * weights[i]
                tx, ty, tz = tx + weight * wx, ty + weight * wy, tz + weight * wz
                sx, sy, sz = sx + weight * fx, sy + weight * fy, sz + weight * fz
            if right >= edges[k + 1]:
                break
            left = right
        dtheta[k, 0], dtheta[k, 1], dtheta[k, 2] = tx, ty, tz
        dvel[k, 0], dvel[k, 1], dvel[k, 2] = sx, sy, sz


@kernel
def _states(
    curve: _Curve,
    p: earth.EarthParameters,
    t: Array,
    panel: Array,
    first: int,
    last: int,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity_ned: Array,
    q_nb: Array,
) -> None:
    for k in range(first, last):
        motion = _motion_k(curve, panel[k], t[k])
        x, y, z = motion.position
        vx, vy, vz = motion.velocity
        q0, q1, q2, q3 = motion.attitude
        latitude[k], longitude[k], height[k] = earth.ecef_to_geodetic_k(p, x, y, z)
        n0, n1, n2, n3 = earth.q_en_k(latitude[k], longitude[k])
        velocity_ned[k] = rotation.rotate_k(n0, -n1, -n2, -n3, vx, vy, vz)
        q_nb[k] = rotation.multiply_k(n0, -n1, -n2, -n3, q0, q1, q2, q3)


@kernel
def _rate_rows(
    curve: _Curve, p: earth.EarthParameters, model: int, t: Array, panel: Array, omega: Array, force: Array
) -> None:
    for k in range(len(t)):
        wx, wy, wz, fx, fy, fz = _readings_k(p, model, _motion_k(curve, panel[k], t[k]))
        omega[k, 0], omega[k, 1], omega[k, 2] = wx, wy, wz
        force[k, 0], force[k, 1], force[k, 2] = fx, fy, fz


class Curve(BlockMotion):
    """The true motion of a sensor block along a smooth curve through knots; see the module's text.

    Args:
        time: knots, increasing, (K,) s, K ≥ 6; 20-40 per second are suitable for an aircraft.
        position_ecef: position of the body's reference point at the knots, (K, 3) m.
        q_eb: attitude of the body at the knots, v_e = C_eb v_b, (K, 4).
        lever_arm: from the reference point to the sensor block, in body axes, (3,) m.
        q_bs: mounting of the block, v_b = C_bs v_s, (4,).
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.
        events: events along the motion.
        channels: other logged quantities.
        derivatives: of position and attitude at the knots, if they are known; they do not serve a block that is turned
            in the body.

    Raises:
        InputError: the knots do not define a curve; the message names the knot.
    """

    def __init__(
        self,
        time: ArrayLike,
        position_ecef: ArrayLike,
        q_eb: ArrayLike,
        lever_arm: ArrayLike = (0.0, 0.0, 0.0),
        q_bs: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        gravity: str = "normal",
        ellipsoid: Ellipsoid = WGS84,
        events: tuple[FlightEvent, ...] = (),
        channels: Mapping[str, Channel] | None = None,
        derivatives: KnotDerivatives | None = None,
    ) -> None:
        t, r, q_eb = checked_knots(time, position_ecef, q_eb)
        q_bs, lever_arm = quaternion("q_bs", q_bs), vector("lever_arm", lever_arm, 3, "m")
        self.events = events
        self.gravity = gravity
        self.ellipsoid = ellipsoid
        self.channels: Mapping[str, Channel] = channels or {}
        self.start, self.end = float(t[0]), float(t[-1])
        self._model = earth.gravity_number(gravity)
        self._parameters = earth.parameters(ellipsoid)

        # The mounting is a constant factor on the right, so the block's quaternions are interpolated.
        q_es = rotation.multiply(q_eb, rotation.normalize(q_bs))
        position = r - r[0]
        if derivatives is None or not np.array_equal(q_es, q_eb):
            derivatives = knot_derivatives(t, position, q_es)
        panels = panels_through(t, position, q_es, derivatives)
        cosine = np.einsum("ij,ij->i", q_eb[1:], q_eb[:-1])
        self._fastest = float(np.max(2.0 * np.arccos(np.minimum(cosine, 1.0)) / np.diff(t)))  # rad/s
        lever = rotation.rotate(rotation.conjugate(rotation.normalize(q_bs)), lever_arm)
        self._curve = _Curve(t, panels, tuple(map(float, r[0])), tuple(map(float, lever)))  # type: ignore[arg-type]

    def _panel(self, t: Array) -> Array:
        knots = self._curve.time
        return np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2)

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the sensor block at instants t; see `Trajectory.state`."""
        instants = check_instants(t, self.start, self.end)
        times = np.atleast_1d(instants)
        panel = self._panel(times)
        latitude, longitude, height = (np.empty(len(times)) for _ in range(3))
        velocity, q_nb = np.empty((len(times), 3)), np.empty((len(times), 4))
        out = latitude, longitude, height, velocity, q_nb
        in_blocks(
            len(times),
            lambda first, last: _states(self._curve, self._parameters, times, panel, first, last, *out),
        )
        shape = instants.shape
        return NavState(
            latitude.reshape(shape),
            longitude.reshape(shape),
            height.reshape(shape),
            velocity.reshape(*shape, 3),
            q_nb.reshape(*shape, 4),
        )

    def _rates(self, time: Array) -> tuple[Array, Array]:
        omega, force = np.empty((len(time), 3)), np.empty((len(time), 3))
        _rate_rows(self._curve, self._parameters, self._model, time, self._panel(time), omega, force)
        return omega, force

    def increments(self, rate_hz: float) -> ImuData:
        """Return exact increments at rate_hz by Gauss-Legendre quadrature between knots; see
        `Trajectory.increments`."""
        edges = sample_edges(self.start, self.end, rate_hz)
        knots = self._curve.time
        piece = min(1.0 / rate_hz, float(np.diff(knots).max()))
        few = piece <= _SHORT and piece * self._fastest <= _SMALL_TURN
        return ImuData(edges, *self._integrals(edges, _FEW_POINTS if few else _POINTS))

    def _integrals(self, edges: Array, points: int) -> tuple[Array, Array]:
        nodes, weights = np.polynomial.legendre.leggauss(points)
        dtheta, dvel = np.empty((len(edges) - 1, 3)), np.empty((len(edges) - 1, 3))
        in_blocks(
            len(edges) - 1,
            lambda first, last: _increments(
                self._curve, self._parameters, self._model, edges, nodes, weights, first, last, dtheta, dvel
            ),
        )
        return dtheta, dvel
