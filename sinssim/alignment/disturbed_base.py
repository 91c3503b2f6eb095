"""Alignment on a disturbed base: the cone that gravity describes in inertial space (the i0 method).

The gyros give the block's attitude relative to an inertial frame ib0 that coincides with the block at the first
instant; the attitude relative to the Earth may change. In ib0 the reaction to gravity, which rotates with the Earth,
describes a cone about the Earth's axis. Its integral, a velocity, is known in the inertial frame i except for the
latitude:

    v(t) = v₀ + g C_ib0,i [cosφ sin(Ut)/U, cosφ (1 − cos Ut)/U, t sinφ]

(X of i through the meridian at the first instant, Z along the Earth's axis). A least-squares fit of this curve to the
measured velocity gives C_ib0,i, φ and g. Heave and sway add only oscillating velocities, which the fit averages. The
method is the one of inertial-frame coarse alignment (Qin, Yan, Gu and Zheng, "A clever way of SINS coarse alignment
despite rocking ship", 2005); fitting the whole curve replaces its two chosen instants.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.alignment.determination import (
    EARTH_RATE_TOLERANCE,
    Determination,
    Flags,
    check_lengths,
    check_session,
    mean_readings,
)
from sinssim.alignment.parked_theory import EQUATOR, SINGULAR_ZONE, Angles
from sinssim.arguments import number
from sinssim.data import Array, ImuData
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError, RunError
from sinssim.jit import kernel
from sinssim.rotation.quaternions import multiply_k
from sinssim.units import DEG_H

SHORTEST = 60.0
"""Shortest session with a sufficient part of the cone, s."""

LARGEST_SPEED = 2.0
"""Largest velocity of a swaying base, m/s."""

_BLOCKS = 300  # number of blocks of the session over which velocities are averaged before the fit
_ITERATIONS = 300  # a few steps at mid-latitudes, many near the poles, where the fit is strongly non-linear

# The sign of the latitude follows from the vertical component of the Earth's rate if the vehicle's own rate is less
# than this fraction of it.
_OWN_TURN = 0.5


@dataclass(frozen=True, eq=False)
class DisturbedAlignment:
    """Result of the fit of the cone.

    Attributes:
        determination: the angles at the end of the session, and the latitude.
        residual: root mean square of the residual velocity, which is heave and sway, m/s.
        time: edges of the session's intervals, (N+1,) s.
        residual_velocity: residual velocity in the block's axes at the start, (N+1, 3) m/s.
    """

    determination: Determination
    residual: float
    time: Array
    residual_velocity: Array


def align_disturbed(imu: ImuData, latitude: float | None = None) -> DisturbedAlignment:
    """Align a vehicle that sways about its place, and determine its latitude if it is not given.

    Args:
        imu: the session's increments, fast enough to follow the sway; 300 s or more.
        latitude: rad, if known.

    Returns:
        The alignment.

    Raises:
        InputError: the increments are unusable, the session is too short, the measurements are impossible for a parked
            vehicle, or the latitude is beyond a pole.
        RunError: the fit does not converge.
    """
    imu = check_session(imu)
    latitude = None if latitude is None else number("latitude", latitude, "rad")
    duration = float(imu.time[-1] - imu.time[0])
    if duration < SHORTEST:
        raise InputError(
            f"the session lasts {duration:.6g} s; the cone that gravity describes needs at least {SHORTEST:g} s, "
            "better 300 s."
        )
    if latitude is not None and not abs(latitude) <= np.pi / 2:
        raise InputError(f"the latitude is {np.degrees(latitude):.6g} deg; it must lie between -90 and 90 deg.")
    _, accel = mean_readings(imu)
    check_lengths(np.asarray(OMEGA_IE), np.asarray(np.linalg.norm(accel)))

    attitude, velocity = inertial_curve(imu)
    edges, t, v = mean_blocks(imu, velocity)
    fits = [_fit(t, v, start, fixed=latitude is not None or start.latitude == 0.0) for start in _starts(t, v, latitude)]
    turn = _turn_about_vertical(imu.time[edges[:-1]] - imu.time[0], attitude[edges[:-1]], fits[0])
    fit = min(fits, key=lambda candidate: abs(turn - OMEGA_IE * np.sin(candidate.latitude)))
    _check_stayed(fit, imu, velocity)
    determination = _determination(imu, attitude[-1], fit, turn, free=latitude is None)
    unexplained = fit.residual(imu.time - imu.time[0], velocity)
    rms = float(np.sqrt(np.mean(np.sum(unexplained**2, axis=1))))
    return DisturbedAlignment(determination, rms, imu.time, unexplained)


def mean_blocks(imu: ImuData, velocity: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Average the curve of the velocity at the samples' edges over blocks, which avoids aliasing of vibration.

    Edges of the blocks among the rows of `velocity`, (B+1,), their mean times since the start, (B,) s, and their mean
    velocities, (B, 3) m/s.
    """
    edges = np.unique(np.linspace(0, len(imu) + 1, _BLOCKS + 1).astype(np.intp))
    counts = np.diff(edges)[:, None]
    t = np.add.reduceat(imu.time - imu.time[0], edges[:-1]) / counts[:, 0]
    return edges, t, np.add.reduceat(velocity, edges[:-1], axis=0) / counts


def fit_of_session(imu: ImuData, latitude: float) -> ConeFit:
    """Return the fitted cone of a session at a known latitude, rad."""
    _, t, v = mean_blocks(imu, inertial_curve(imu)[1])
    return _fit(t, v, _starts(t, v, latitude)[0], fixed=True)


def _check_stayed(fit: ConeFit, imu: ImuData, velocity: Array) -> None:
    """Raise for velocities too large for a swaying base.

    A constant acceleration throughout the session is not detected, because it cannot be distinguished from a tilt.
    """
    speed = np.linalg.norm(fit.residual(imu.time - imu.time[0], velocity), axis=1)
    start, worst = float(np.linalg.norm(fit.v0)), int(np.argmax(speed))
    if max(start, float(speed[worst])) > LARGEST_SPEED:
        fastest, when = (start, imu.time[0]) if start > speed[worst] else (float(speed[worst]), imu.time[worst])
        raise InputError(
            f"the vehicle travelled during the session: {fastest:.3g} m/s at {when:.6g} s, but a swaying base has less "
            f"than {LARGEST_SPEED:g} m/s; use a part of the session in which it stays at its place."
        )


def inertial_curve(imu: ImuData) -> tuple[Array, Array]:
    """Return attitude and integral of the specific force in the inertial frame of the block's first instant.

    The quaternions ib0 from b are (N+1, 4), the velocities (N+1, 3) m/s.
    """
    theta, dvel = imu.dtheta, imu.dvel
    # Change of the increments per interval, centred: coning and sculling to the next order (Savage 1998). A single
    # interval shows none.
    d_theta, d_dvel = (np.gradient(of, axis=0) if len(of) > 1 else np.zeros_like(of) for of in (theta, dvel))
    phi = theta + np.cross(theta, d_theta) / 12.0
    turned = np.cross(phi, dvel)
    u = dvel + 0.5 * turned + np.cross(phi, turned) / 6.0
    u += (np.cross(theta, d_dvel) + np.cross(dvel, d_theta)) / 12.0
    from sinssim import rotation

    q = np.empty((len(imu) + 1, 4))
    _accumulate(rotation.quaternion_from_rotation_vector(phi), q)
    return q, np.concatenate([np.zeros((1, 3)), np.cumsum(rotation.rotate(q[:-1], u), axis=0)])


@kernel
def _accumulate(steps: Array, out: Array) -> None:
    q0, q1, q2, q3 = 1.0, 0.0, 0.0, 0.0
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = q0, q1, q2, q3
    for k in range(steps.shape[0]):
        q0, q1, q2, q3 = multiply_k(q0, q1, q2, q3, steps[k, 0], steps[k, 1], steps[k, 2], steps[k, 3])
        out[k + 1, 0], out[k + 1, 1], out[k + 1, 2], out[k + 1, 3] = q0, q1, q2, q3


@dataclass(frozen=True, eq=False)
class ConeFit:
    """Unknowns of the fit."""

    c: Array  # C_ib0,i, (3, 3)
    latitude: float  # rad
    gravity: float  # m/s²
    v0: Array  # velocity at the start, (3,) m/s

    def residual(self, t: Array, v: Array) -> Array:
        """Return the residual of a velocity after the cone, (N, 3) m/s."""
        return v - self.v0 - self.gravity * (_cone(t, self.latitude) @ self.c.T)


def _cone(t: Array, latitude: float) -> Array:
    """Return the integral of the reaction to unit gravity on the cone, in i, (N, 3) s."""
    half = 0.5 * OMEGA_IE * t
    return np.stack(
        [
            np.cos(latitude) * np.sin(2.0 * half) / OMEGA_IE,
            np.cos(latitude) * 2.0 * np.sin(half) ** 2 / OMEGA_IE,
            np.sin(latitude) * t,
        ],
        axis=1,
    )


def _starts(t: Array, v: Array, latitude: float | None) -> list[ConeFit]:
    """Return initial values in each hemisphere, or on the equator, from the parabola v₀ + at + bt².

    a points up, b points east, and the length of b gives cosφ.
    """
    x = t / t[-1]
    coefficients, *_ = np.linalg.lstsq(np.stack([np.ones_like(x), x, x * x], axis=1), v, rcond=None)
    v0, a, b = coefficients[0], coefficients[1] / t[-1], coefficients[2] / t[-1] ** 2
    gravity = float(np.linalg.norm(a))
    up = a / gravity
    east = b - up * (up @ b)
    # b = ½ g U cosφ: the direction of gravity turns at the horizontal component of the Earth's rate.
    apparent = 2.0 * float(np.linalg.norm(east)) / gravity
    if not apparent > 0.0:
        raise InputError(
            "gyros and accelerometers do not show the Earth's rotation; check that the increments are real."
        )
    slack = EARTH_RATE_TOLERANCE * OMEGA_IE
    low, high = (-slack, OMEGA_IE + slack)
    if latitude is not None:
        low, high = (OMEGA_IE * np.cos(latitude) + side for side in (-slack, slack))
    if not low < apparent < high:
        raise InputError(
            f"the measured gravity turns in inertial space at {apparent / DEG_H:.4g} deg/h, but "
            + ("the Earth" if latitude is None else f"the Earth at latitude {np.degrees(latitude):.3g} deg")
            + f" makes it turn at {'most ' if latitude is None else ''}{(high - slack) / DEG_H:.4g} deg/h: the gyros' "
            "errors are too large for an alignment, or the vehicle travelled."
        )
    cosine = min(1.0, apparent / OMEGA_IE)
    east /= np.linalg.norm(east)
    north = np.cross(up, east)
    size = float(np.arccos(cosine))
    if latitude is not None:
        candidates = [latitude]
    elif size < EQUATOR:
        candidates = [0.0]
    else:
        candidates = [size, -size]
    starts = []
    for phi in candidates:
        meridian, axis = np.cos(phi) * up - np.sin(phi) * north, np.sin(phi) * up + np.cos(phi) * north
        starts.append(ConeFit(np.stack([meridian, east, axis], axis=1), phi, gravity, v0))
    return starts


def _turn_about_vertical(t: Array, attitude: Array, fit: ConeFit) -> float:
    """Return the mean rate of the block about the plumb line, rad/s: U sinφ if it does not turn on the Earth.

    It is the slope of a straight line through the angle, which a sway hardly changes. It distinguishes north from
    south.
    """
    from sinssim import rotation

    up = fit.c @ np.array([np.cos(fit.latitude), 0.0, np.sin(fit.latitude)])
    angle = rotation.rotation_vector_from_quaternion(attitude) @ up
    return float(np.polynomial.polynomial.polyfit(t, angle, 1)[1])


def cone_jacobian(fit: ConeFit, t: Array, fixed: bool) -> Array:
    """Return the derivatives of the fitted velocity at times since the start, (N,) s, to the unknowns, (N, 3, 8).

    These are a small rotation of `fit.c` in ib0, the latitude (zero if it is known), gravity and v₀.
    """
    curve = _cone(t, fit.latitude) @ fit.c.T
    slope = _cone(t, fit.latitude + 0.5 * np.pi) @ fit.c.T  # derivatives of cosine and sine
    jacobian = np.empty((len(t), 3, 8))
    for k in range(3):  # a small rotation δ of C adds δ × curve
        jacobian[:, :, k] = fit.gravity * np.cross(np.eye(3)[k], curve)
    jacobian[:, :, 3] = 0.0 if fixed else fit.gravity * slope
    jacobian[:, :, 4] = curve
    jacobian[:, :, 5:] = np.eye(3)
    return jacobian


def _fit(t: Array, v: Array, start: ConeFit, fixed: bool) -> ConeFit:
    """Fit the cone by Gauss-Newton steps on a small rotation of C_ib0,i, latitude, g and v₀."""
    fit = start
    scale = np.array([1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1.0, 1.0, 1.0])
    for _ in range(_ITERATIONS):
        jacobian = cone_jacobian(fit, t, fixed)
        step, *_ = np.linalg.lstsq(jacobian.reshape(-1, 8) * scale, fit.residual(t, v).reshape(-1), rcond=1e-13)
        step *= scale
        length = float(np.linalg.norm(step[:3])) + abs(step[3])
        step *= min(1.0, 0.3 / length) if length > 0.0 else 1.0
        fit = ConeFit(
            _rotation(step[:3]) @ fit.c,
            float(np.clip(fit.latitude + step[3], -np.pi / 2, np.pi / 2)),
            float(fit.gravity + step[4]),
            fit.v0 + step[5:],
        )
        if length < 1e-10:
            return fit
    raise RunError(
        "the fit of gravity's cone does not converge: the session is too short, the gyros are too inaccurate, or the "
        "vehicle travelled. Give the latitude if it is known, or a longer session."
    )


def _rotation(vector: Array) -> Array:
    from sinssim import rotation

    return rotation.dcm_from_quaternion(rotation.quaternion_from_rotation_vector(vector))


def _determination(imu: ImuData, q_last: Array, fit: ConeFit, turn: float, free: bool) -> Determination:
    from sinssim import rotation

    phi, ut = fit.latitude, OMEGA_IE * (imu.time[-1] - imu.time[0])
    up = np.array([np.cos(phi) * np.cos(ut), np.cos(phi) * np.sin(ut), np.sin(phi)])
    east = np.array([-np.sin(ut), np.cos(ut), 0.0])
    c_ni = np.stack([np.cross(up, east), east, -up])
    q_nb = rotation.quaternion_from_dcm(c_ni @ fit.c.T @ rotation.dcm_from_quaternion(q_last))
    roll, pitch, heading = rotation.euler_from_quaternion(q_nb)

    warnings: list[str] = []
    rate = float(np.linalg.norm(imu.dtheta.sum(axis=0))) / float(imu.time[-1] - imu.time[0])
    polar = bool(np.cos(phi) < np.sin(SINGULAR_ZONE))
    vertical = bool(np.cos(pitch) < np.sin(SINGULAR_ZONE))
    vertical_rate = OMEGA_IE * np.sin(phi)
    equatorial = free and abs(phi) < EQUATOR
    turned = free and not equatorial and abs(turn - vertical_rate) > _OWN_TURN * abs(vertical_rate)
    if equatorial:
        warnings.append(
            f"the latitude is not determined: within {np.degrees(EQUATOR):g} deg of the equator gravity's cone hardly "
            "depends on it; give the latitude if it is known."
        )
    if turned:
        warnings.append(
            f"heading and latitude are not determined: the vehicle turned about the vertical at {turn / DEG_H:.3g} "
            f"deg/h, but the Earth's rate gives {vertical_rate / DEG_H:.3g} or {-vertical_rate / DEG_H:.3g} "
            "deg/h, so that north and south latitude cannot be distinguished; give the latitude."
        )
    if polar:
        warnings.append(f"the heading is not determined: at latitude {np.degrees(phi):.3f} deg there is no north.")
    if vertical:
        warnings.append(
            "heading and roll are not determined: the longitudinal axis is vertical "
            f"(pitch {np.degrees(pitch):.3f} deg)."
        )
    flags = Flags(*(np.asarray(f) for f in (turned or polar or vertical, vertical, False, turned or equatorial)))
    angles = Angles(heading, roll, pitch, np.asarray(phi))
    marked = Angles(*(np.where(flag, np.nan, angle) for flag, angle in zip(flags, angles, strict=True)))
    return Determination(
        *marked,
        earth_rate=np.asarray(rate),
        gravity=np.asarray(fit.gravity),
        undetermined=flags,
        warnings=tuple(warnings),
    )
