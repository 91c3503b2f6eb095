"""Alignment in motion without prior heading: by velocity increments of accelerometers and satellites, or by the course.

By velocity increments: let the inertial frame i coincide with the Earth-fixed axes at the first fix, and the inertial
frame b₀ with the block at the first sample. The velocity changes by gravitation γ and by the specific force, which the
gyros resolve in b₀:

    β(t) = v_i(t) − v_i(0) − ∫γ dt = C_ib₀ α(t),   α(t) = ∫C_b₀b f dt

with β from fixes and α from the increments. The constant C_ib₀ is the rotation that best maps the changes of α over
windows of time to those of β (Wahba's problem). It holds for any attitude; no error needs to be small. The method is
optimisation-based alignment by velocity integration (Wu and Pan, IEEE Trans. AES 49, 2013, 1006), in inertial axes. The
velocity C_b₀b (ω × l) of an antenna on a lever arm l is added to α.

The heading is accurate to some degrees. Its errors stem mostly from the sensors' biases, and their correlation with the
attitude is not known to first order. The result is therefore only the start of the filter, at the first fix and with a
widened covariance; the filter then processes all the data. The fixes are thereby used twice, the first time with a
tenth of their weight.

By the course of a land vehicle, for sensors that cannot sense the Earth's rate: a vehicle on wheels moves along its
forward axis, so that the direction of the satellites' velocity is the direction of that axis, up to the mounting of the
block and to the slip of the tyres:

1. if the data begin at rest, gravity levels the block, the mean rates are the gyros' biases, and the compensated gyros
   carry the attitude from rest to the first fix in motion, whose course then gives the heading at rest. The sign of the
   accelerometers' forward velocity change tells whether the vehicle set off backwards;
2. if they begin in motion, the course is the heading, the climb is the pitch, and the roll is that of the road, zero.

The result is accurate to some degrees, and is the start of a filter that then processes all the data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.alignment.disturbed_base import inertial_curve
from sinssim.arguments import checked_increments, number
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.earth.ellipsoids import Ellipsoid, ellipsoid_by_name
from sinssim.errors import InputError, RunError
from sinssim.sensors.imu.compensation import MeanGyroRates, compensate
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors

WINDOW = 20.0
"""Length of the windows, s: long enough for fixes to show a change of velocity, short enough for many of them."""

WIDER = 3.0
"""Factor by which the filter's initial standard deviations exceed those of the alignment."""

WORST = np.radians(7.0)
"""Largest 1σ of an angle that a filter is started with, rad; widened, it is 21°."""


@dataclass(frozen=True)
class InMotion:
    """Start of the filter after an alignment in motion."""

    edge: int  # number of the edge of the IMU's intervals at which it can, the one nearest to the first fix
    state: NavState  # the state there
    covariance: Array  # of its errors, widened: position and velocity north, east, down, attitude φ, (9, 9)
    sigma: Array  # 1σ of the attitude about north, east, down, before widening, (3,) rad
    residual: float  # root mean square of the residuals of the velocity changes over a window, m/s


@dataclass(frozen=True)
class _Fixes:
    """Fixes in i."""

    time: Array  # (M,) s
    place: Array
    speed: Array  # place, speed: measured positions and velocities, (M, 3)
    beta: Array  # (M, 3) m/s
    arm: Array  # lever arm of the antenna, (3,) m
    q_ni: Array  # from i into north, east, down at the first fix, (4,)

    @property
    def span(self) -> int:
        """Number of fixes in a window."""
        return max(int(np.searchsorted(self.time - self.time[0], WINDOW)), 1)

    def changes(self, of: Array) -> Array:
        """Return the changes over the windows, (M − span, 3)."""
        return np.asarray(of[self.span :] - of[: -self.span])


def align_in_motion(
    imu: ImuData,
    position: Measurements,
    velocity: Measurements,
    sigma: ImuErrors,
    *,
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
) -> InMotion:
    """Find the attitude of a moving vehicle without prior knowledge.

    The increments last from before the first to after the last fix to be used; a minute or two. The velocities of a
    receiver that delays or averages them are valid before its positions. `sigma` are the standard deviations of the
    sensor block's errors.
    """
    checked_increments(imu)
    shape = ellipsoid_by_name(ellipsoid)
    fixes = _fixes(imu, position, velocity, gravity, shape)
    q_nb, along, residual = _attitude(imu, fixes)
    c_ni = rotation.dcm_from_quaternion(fixes.q_ni)
    attitude = c_ni @ _noise(fixes, along, float(np.max(velocity.sigma)), sigma) @ c_ni.T
    # effect of one standard deviation of each bias: the problem is solved again without it
    bias = np.concatenate([np.broadcast_to(sigma.gyro.bias, 3), np.broadcast_to(sigma.accel.bias, 3)])
    for k in np.flatnonzero(bias):
        single = np.where(np.arange(6) == k, bias, 0.0)
        freed = compensate(imu, ImuErrors(TriadErrors(bias=single[:3]), TriadErrors(bias=single[3:])))
        turned = rotation.multiply(_attitude(freed, fixes)[0], rotation.conjugate(q_nb))
        by_bias = rotation.rotation_vector_from_quaternion(turned)
        attitude += np.outer(by_bias, by_bias)
    attitude = 0.5 * (attitude + attitude.T)
    worst = float(np.sqrt(np.linalg.eigvalsh(attitude)[-1]))
    if not worst <= WORST:
        raise RunError(
            f"alignment in motion from t = {fixes.time[0]:.6g} s to {fixes.time[-1]:.6g} s: the vehicle accelerated "
            "too little for these sensors to determine the attitude, whose error would be "
            f"{np.degrees(worst):.3g}° (1σ). Turns or changes of speed, or a longer alignment with them, are needed."
        )
    covariance = np.zeros((9, 9))
    covariance[range(3), range(3)] = position.sigma[0] ** 2
    covariance[range(3, 6), range(3, 6)] = velocity.sigma[0] ** 2
    covariance[6:, 6:] = attitude
    edge = _edges(imu, fixes)[0]
    return InMotion(
        int(edge),
        _block(imu, fixes, q_nb, float(imu.time[edge]), shape),
        WIDER**2 * covariance,
        np.sqrt(attitude.diagonal()),
        residual,
    )


def _edges(imu: ImuData, fixes: _Fixes) -> NDArray[np.intp]:
    """Return the number of the edge nearest to each fix."""
    after = np.clip(np.searchsorted(imu.time, fixes.time), 1, len(imu.time) - 1)
    before_is_nearer = imu.time[after] - fixes.time > fixes.time - imu.time[after - 1]
    return np.asarray(after - before_is_nearer)


def _fixes(imu: ImuData, position: Measurements, velocity: Measurements, gravity: str, ellipsoid: Ellipsoid) -> _Fixes:
    for m, kind in ((position, "gnss-position"), (velocity, "gnss-velocity")):
        if m.kind != kind:
            raise InputError(f"alignment in motion needs measurements of kind {kind!r}, not {m.kind!r}.")
    first, second = _together(position.time, velocity.time)
    time, speed = velocity.time[second], velocity.value[second]
    place = _moved(position.value[first], speed, time - position.time[first], ellipsoid)
    used = np.isfinite(place).all(axis=1) & np.isfinite(speed).all(axis=1)
    used &= (time >= imu.time[0]) & (time <= imu.time[-1])
    time, place, speed = time[used], place[used], speed[used]
    if len(time) < 3 or time[-1] - time[0] < 2.0 * WINDOW:
        lasting = float(time[-1] - time[0]) if len(time) else 0.0
        raise InputError(
            f"alignment in motion has {len(time)} times with position and velocity over {lasting:.6g} s within the "
            f"inertial data; at least {2.0 * WINDOW:g} s of them are needed."
        )
    since = time - time[0]
    r_e = earth.geodetic_to_ecef(place[:, 0], place[:, 1], place[:, 2], ellipsoid)
    v_e = rotation.rotate(earth.q_en(place[:, 0], place[:, 1]), speed)
    v_e += ellipsoid.omega * np.stack([-r_e[:, 1], r_e[:, 0], np.zeros(len(r_e))], axis=1)  # ω_ie × r
    pull = earth.ecef_to_eci(earth.gravitation_ecef(r_e, gravity, ellipsoid), since, ellipsoid)
    fallen = np.zeros_like(pull)
    fallen[1:] = np.cumsum(0.5 * (pull[1:] + pull[:-1]) * np.diff(time)[:, None], axis=0)
    q_in = earth.q_en(place[0, 0], place[0, 1])
    arm = np.asarray(velocity.lever_arm, dtype=np.float64)
    beta = earth.ecef_to_eci(v_e, since, ellipsoid) - fallen
    return _Fixes(time, place, speed, beta, arm, rotation.conjugate(q_in))


def _together(position: Array, velocity: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows of positions and of velocities that make a fix: the nearest ones, less than half a step apart."""
    if not len(position) or not len(velocity):
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    after = np.clip(np.searchsorted(velocity, position), 1, max(len(velocity) - 1, 1))
    nearest = np.where(velocity[after] - position < position - velocity[after - 1], after, after - 1)
    closest_first = np.argsort(np.abs(velocity[nearest] - position), kind="stable")
    rows, first = np.unique(nearest[closest_first], return_index=True)
    first = closest_first[first]
    step = float(np.median(np.diff(velocity)))
    near = np.abs(velocity[rows] - position[first]) < 0.5 * step
    return first[near], rows[near]


def _moved(place: Array, speed: Array, by: Array, ellipsoid: Ellipsoid) -> Array:
    """Return positions after a time at their velocities; half a second of 1 g costs a metre, which gravity ignores."""
    north, east, down = (speed * by[:, None]).T
    latitude, longitude = earth.displaced(place[:, 0], place[:, 1], place[:, 2], north, east, ellipsoid)
    moved = np.stack([latitude, longitude, place[:, 2] - down], axis=1)
    return np.where(by[:, None] == 0.0, place, moved)


def _attitude(imu: ImuData, fixes: _Fixes) -> tuple[Array, Array, float]:
    """Return q_nb at the first fix, the changes of β over the windows, and the rms residual."""
    from scipy.spatial.transform import Rotation

    q_b0b, pushed = inertial_curve(imu)
    alpha = np.stack([np.interp(fixes.time, imu.time, axis) for axis in pushed.T], axis=1)
    edges = _edges(imu, fixes)
    if fixes.arm.any():
        alpha += rotation.rotate(q_b0b[edges], np.cross(MeanGyroRates(imu).at(fixes.time, ImuErrors()), fixes.arm))
    change = fixes.changes(alpha)
    best, distance = Rotation.align_vectors(fixes.changes(fixes.beta), change)
    q_ib = rotation.multiply(best.as_quat(scalar_first=True), q_b0b[edges[0]])
    along = np.asarray(best.apply(change))
    return rotation.multiply(fixes.q_ni, q_ib), along, float(distance) / np.sqrt(change.size)


def _noise(fixes: _Fixes, along: Array, velocity_sigma: float, sigma: ImuErrors) -> Array:
    """Return the covariance of the attitude in i from the noise of fixes and sensors, (3, 3).

    A small rotation δ changes the velocity change c of a window by δ × c. For the windows' errors e, the fit is δ = U Σ
    c × e with U⁻¹ = Σ A and A = |c|² I − c cᵀ. The error of a fix enters two windows, at the end of one and at the
    beginning of another. The accelerometers' noise between two fixes enters all windows around them. The gyros' noise
    rotates all later windows.
    """
    span = fixes.span
    count, step = len(fixes.time), float(np.mean(np.diff(fixes.time)))
    squares = np.sum(along * along, axis=1)[:, None, None] * np.eye(3) - along[:, :, None] * along[:, None, :]
    u = np.linalg.inv(np.sum(squares, axis=0) + 1e-9 * np.eye(3))

    def crossed(weight: Array) -> Array:
        return np.asarray(np.sum(weight * weight) * np.eye(3) - weight.T @ weight)

    of_fix = np.zeros((count, 3))
    of_fix[span:] += along
    of_fix[:-span] -= along
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(along, axis=0)])
    between = np.arange(count - 1)
    around = total[np.minimum(between + 1, len(along))] - total[np.maximum(between - span + 1, 0)]
    later = np.cumsum(squares[::-1], axis=0)[::-1]
    inner = velocity_sigma**2 * crossed(of_fix) + sigma.accel.random_walk**2 * step * crossed(around)
    inner += sigma.gyro.random_walk**2 * step * np.einsum("kij,klj->il", later, later)
    return np.asarray(u @ inner @ u)


def _block(imu: ImuData, fixes: _Fixes, q_nb: Array, instant: float, ellipsoid: Ellipsoid) -> NavState:
    """Return the state of the block near the first fix, reduced from the antenna by the lever arm."""
    place, speed = fixes.place[0], fixes.speed[0]
    q_en = earth.q_en(place[0], place[1])
    q_eb = rotation.multiply(q_en, q_nb)
    antenna = earth.geodetic_to_ecef(place[0], place[1], place[2], ellipsoid)
    block = antenna - rotation.rotate(q_eb, fixes.arm) + (instant - fixes.time[0]) * rotation.rotate(q_en, speed)
    spin = rotation.rotate(rotation.conjugate(q_eb), np.array([0.0, 0.0, ellipsoid.omega]))
    turning = MeanGyroRates(imu).at(fixes.time[:1], ImuErrors())[0] - spin
    velocity = speed - rotation.rotate(q_nb, np.cross(turning, fixes.arm))
    return NavState(*earth.ecef_to_geodetic(block, ellipsoid), velocity, q_nb)


COURSE_SIGMA = np.radians(3.0)
"""1σ of the angle between course and forward axis by the slip of the tyres and by a turn, rad."""

ROAD_SIGMA = np.radians(3.0)
"""1σ of the roll of a road, and of the pitch of a vehicle on it, rad."""

_CLEAR = 10.0  # speed from which a course is taken, in units of the velocity's 1σ: the course is then good to 6°
_SLOWEST = 1.0  # m/s, and at least this
_LEAST_REST_S = 2.0


@dataclass(frozen=True)
class ByCourse:
    """Start of the filter after an alignment by the course."""

    edge: int  # number of the edge of the IMU's intervals at which it starts
    state: NavState  # the state there
    covariance: Array  # of its errors: position and velocity north, east, down, attitude φ, (9, 9)
    gyro_bias: Array  # mean rates at rest, (3,) rad/s; zero if the data begin in motion
    backwards: bool  # whether the vehicle set off backwards
    course_time: float  # instant of the fix whose course was taken, s


def align_by_course(
    imu: ImuData,
    position: Measurements,
    velocity: Measurements,
    sigma: ImuErrors,
    *,
    angles: tuple[float, float] = (0.0, 0.0),
    angles_sigma: float = np.radians(3.0),
) -> ByCourse:
    """Find the attitude of a land vehicle from its course.

    The increments last from the beginning to after the vehicle has set off; `sigma` are the standard deviations of the
    sensor block's errors, `angles` pitch and yaw of the vehicle's axes in the block's, and `angles_sigma` the 1σ of
    each of them, rad. State and covariance are those at the beginning of the data if the vehicle stands there, else at
    the first clear course.
    """
    checked_increments(imu)
    angles_sigma = number("angles_sigma", angles_sigma, "rad", low=0.0)
    for m, kind in ((position, "gnss-position"), (velocity, "gnss-velocity")):
        if m.kind != kind or not len(m):
            raise InputError(f"an alignment by the course needs fixes of kind {kind!r}, not {len(m)} of {m.kind!r}.")
    inside = (velocity.time > imu.time[0]) & (velocity.time < imu.time[-1]) & np.isfinite(velocity.value).all(axis=1)
    level = np.hypot(velocity.value[:, 0], velocity.value[:, 1])
    needed = np.maximum(_CLEAR * velocity.sigma[:, :2].max(axis=1), _SLOWEST)
    clear = np.flatnonzero(inside & (level > needed))
    if not len(clear):
        fastest = float(np.max(level[inside], initial=0.0))
        raise RunError(
            f"alignment by the course from t = {imu.time[0]:.6g} s to {imu.time[-1]:.6g} s: the vehicle moves with "
            f"{fastest:.3g} m/s at most, and a course needs {_SLOWEST:g} m/s and {_CLEAR:g} times the 1σ of the "
            "velocity. A longer alignment, until it moves, is needed."
        )
    row = int(clear[0])
    instant = float(velocity.time[row])
    seen = velocity.value[row]
    course = float(np.arctan2(seen[1], seen[0]))
    course_sigma = float(np.hypot(COURSE_SIGMA, velocity.sigma[row, :2].max() / level[row]))
    rest_end = _end_of_rest(velocity, inside, imu)
    if rest_end is not None and rest_end - imu.time[0] >= _LEAST_REST_S:
        edge, still = 0, int(np.searchsorted(imu.time, rest_end)) - 1
        q_nb, bias, backwards = _from_rest(imu, still, instant, course, angles)
        lasting = float(imu.time[still] - imu.time[0])
        drift = float(np.hypot(np.max(sigma.gyro.random_walk) / np.sqrt(lasting), 1e-4)) * (instant - rest_end)
        tilt = max(float(np.max(sigma.accel.bias)) / 9.8, 2e-3)
        speed, speed_sigma = np.zeros(3), np.full(3, 0.05)
    else:
        edge = int(np.argmin(np.abs(imu.time - instant)))
        pitch = float(np.arctan2(-seen[2], level[row]))
        q_nb = rotation.multiply(
            rotation.quaternion_from_euler(0.0, pitch, course), rotation.conjugate(_vehicle_in_block(angles))
        )
        bias, backwards, drift, tilt = np.zeros(3), False, 0.0, float(np.hypot(ROAD_SIGMA, angles_sigma))
        speed, speed_sigma = seen, velocity.sigma[row]
    covariance = np.zeros((9, 9))
    near = int(np.argmin(np.abs(position.time - imu.time[edge])))
    moved = abs(float(position.time[near] - imu.time[edge])) * float(np.linalg.norm(speed))
    covariance[range(3), range(3)] = position.sigma[near] ** 2 + moved**2
    covariance[range(3, 6), range(3, 6)] = speed_sigma**2
    heading = float(np.sqrt(course_sigma**2 + angles_sigma**2 + drift**2))
    covariance[range(6, 9), range(6, 9)] = np.array([tilt, tilt, heading]) ** 2
    place = position.value[near]
    state = NavState(place[0], place[1], place[2], speed.copy(), q_nb)
    return ByCourse(edge, state, covariance, bias, backwards, instant)


def _end_of_rest(velocity: Measurements, inside: NDArray[np.bool_], imu: ImuData) -> float | None:
    """Return the last fix of those from the beginning on that are all within 3σ of zero; None if the first is not."""
    moving = np.flatnonzero(inside & (np.abs(velocity.value) > 3.0 * velocity.sigma).any(axis=1))
    before = np.flatnonzero(inside)
    before = before[before < (moving[0] if len(moving) else len(inside))]
    return float(velocity.time[before[-1]]) if len(before) else None


def _vehicle_in_block(angles: tuple[float, float]) -> Array:
    """Return the rotation from the vehicle's axes into the block's."""
    return rotation.quaternion_from_euler(0.0, angles[0], angles[1])


def _from_rest(
    imu: ImuData, still: int, instant: float, course: float, angles: tuple[float, float]
) -> tuple[Array, Array, bool]:
    """Return the attitude at rest, the gyros' biases, and whether the vehicle sets off backwards."""
    lasting = float(imu.time[still] - imu.time[0])
    bias = imu.dtheta[:still].sum(axis=0) / lasting
    force = imu.dvel[:still].sum(axis=0) / lasting
    roll = float(np.arctan2(-force[1], -force[2]))
    pitch = float(np.arctan2(force[0], np.hypot(force[1], force[2])))
    last = int(np.searchsorted(imu.time, instant))
    step = np.diff(imu.time[still : last + 1])[:, None]
    level = rotation.quaternion_from_euler(roll, pitch, 0.0)  # into level axes that do not turn
    q_vb, q = _vehicle_in_block(angles), level
    gained, forward = np.zeros(3), rotation.rotate(rotation.multiply(level, q_vb), np.array([1.0, 0.0, 0.0]))
    gravity = rotation.rotate(level, force)
    for turn, push, dt in zip(imu.dtheta[still:last] - bias * step, imu.dvel[still:last], step, strict=True):
        q = rotation.multiply(q, rotation.quaternion_from_rotation_vector(turn))
        gained = gained + rotation.rotate(q, push) - gravity * dt
    axis = rotation.rotate(rotation.multiply(q, q_vb), np.array([1.0, 0.0, 0.0]))
    backwards = bool(gained @ (axis + forward) < 0.0)
    heading = course + (np.pi if backwards else 0.0) - float(np.arctan2(axis[1], axis[0]))
    return rotation.multiply(rotation.quaternion_from_euler(0.0, 0.0, heading), level), bias, backwards
