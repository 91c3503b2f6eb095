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
"""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.arguments import quaternion, vector
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.models import WGS84, Ellipsoid
from sinssim.jit import inline, kernel
from sinssim.rotation.kernels import Quaternion, Vector
from sinssim.truth.channel import Channel, FlightEvent
from sinssim.truth.panels import KnotDerivatives, checked_knots, knot_derivatives, panels_through
from sinssim.truth.sample_times import check_instants, in_blocks, sample_edges

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
def _rates(
    curve: _Curve, p: earth.EarthParameters, model: int, t: Array, panel: Array, omega: Array, force: Array
) -> None:
    for k in range(len(t)):
        wx, wy, wz, fx, fy, fz = _readings_k(p, model, _motion_k(curve, panel[k], t[k]))
        omega[k, 0], omega[k, 1], omega[k, 2] = wx, wy, wz
        force[k, 0], force[k, 1], force[k, 2] = fx, fy, fz


class Curve:
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

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.start:g} … {self.end:g} s)"

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the sensor block; see `Trajectory.state`.

        Args:
            t: times, () or (N,) s.

        Returns:
            The state at those times, in arrays of the same leading shape.

        Raises:
            InputError: a time lies outside [start, end].
        """
        instants = check_instants(t, self.start, self.end)
        times = np.atleast_1d(instants)
        panel = self._panel(times)
        latitude, longitude, height = (np.empty(len(times)) for _ in range(3))
        velocity, q_nb = np.empty((len(times), 3)), np.empty((len(times), 4))
        in_blocks(
            len(times),
            lambda first, last: _states(
                self._curve,
                self._parameters,
                times,
                panel,
                first,
                last,
                latitude,
                longitude,
                height,
                velocity,
                q_nb,
            ),
        )
        shape = instants.shape
        return NavState(
            latitude.reshape(shape),
            longitude.reshape(shape),
            height.reshape(shape),
            velocity.reshape(*shape, 3),
            q_nb.reshape(*shape, 4),
        )

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return inertial angular rate and specific force of the sensor block; see `Trajectory.rates`.

        Args:
            t: times, () or (N,) s.

        Returns:
            Angular rate, (3,) or (N, 3) rad/s, and specific force, (3,) or (N, 3) m/s², in the block's axes.

        Raises:
            InputError: a time lies outside [start, end].
        """
        instants = check_instants(t, self.start, self.end)
        times = np.atleast_1d(instants)
        omega, force = np.empty((len(times), 3)), np.empty((len(times), 3))
        _rates(self._curve, self._parameters, self._model, times, self._panel(times), omega, force)
        return omega.reshape(*instants.shape, 3), force.reshape(*instants.shape, 3)

    def increments(self, rate_hz: float) -> ImuData:
        """Return exact increments by Gauss-Legendre quadrature between knots; see `Trajectory.increments`.

        Args:
            rate_hz: samples per second.

        Returns:
            Integrals of inertial angular rate and specific force; edges at start + k/rate_hz up to `end`.

        Raises:
            InputError: the rate is not positive and finite, or an interval is longer than the trajectory.
        """
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
