"""Alignment of a land vehicle by its course, for sensors that cannot sense the Earth's rate.

A vehicle on wheels moves along its forward axis, so that the direction of the satellites' velocity is the direction of
that axis, up to the mounting of the block and to the slip of the tyres:

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

from sinssim import rotation
from sinssim.arguments import number
from sinssim.checks import checked_increments
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.errors import InputError, RunError
from sinssim.sensors.imu.errors import ImuErrors

COURSE_SIGMA = np.radians(3.0)
"""1σ of the angle between course and forward axis by the slip of the tyres and by a turn, rad."""

ROAD_SIGMA = np.radians(3.0)
"""1σ of the roll of a road, and of the pitch of a vehicle on it, rad."""

_CLEAR = 10.0  # speed from which a course is taken, in units of the velocity's 1σ: the course is then good to 6°
_SLOWEST = 1.0  # m/s, and at least this
_LEAST_REST_S = 2.0


@dataclass(frozen=True)
class ByCourse:
    """Start of the filter after an alignment by the course.

    Attributes:
        edge: number of the edge of the IMU's intervals at which it starts.
        state: the state there.
        covariance: of its errors: position and velocity north, east, down, attitude φ, (9, 9).
        gyro_bias: mean rates at rest, (3,) rad/s; zero if the data begin in motion.
        backwards: whether the vehicle set off backwards.
        course_time: instant of the fix whose course was taken, s.
    """

    edge: int
    state: NavState
    covariance: Array
    gyro_bias: Array
    backwards: bool
    course_time: float


# Long: the arguments, and the two cases.
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

    Args:
        imu: increments from the beginning to after the vehicle has set off.
        position: "gnss-position", in the time of `imu`.
        velocity: "gnss-velocity".
        sigma: standard deviations of the sensor block's errors.
        angles: pitch and yaw of the vehicle's axes in the block's, rad.
        angles_sigma: 1σ of each of them, rad.

    Returns:
        State and covariance at the beginning of the data if the vehicle stands there, else at the first clear course.

    Raises:
        InputError: there are no fixes, or an argument cannot be used.
        RunError: the vehicle does not move fast enough for a course.
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
