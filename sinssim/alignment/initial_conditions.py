"""Initial state of navigation, and P₀ of the fine-alignment filter, from an alignment or on recorded sensors.

On recorded sensors a reference with an attitude gives the state itself. Otherwise position and velocity come from the
first fix, roll and pitch from the mean specific force less the acceleration that the satellites show, and the heading
from the course of the first motion. Small gyros do not sense the Earth's rate, so that the heading of a vehicle at rest
is carried back from there by the turn that the gyros sensed in between, less their mean rate at rest. The velocity of a
receiver that gives positions only is that of their differences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.alignment.alignment_budget import OF_GYROS, Expected, Method, cone_coefficients, reading_variances
from sinssim.alignment.base_motion import Stillness, stillness
from sinssim.alignment.determination import Determination, determine, mean_readings
from sinssim.alignment.disturbed_base import align_disturbed, inertial_curve
from sinssim.alignment.parked_theory import coefficients, ideal_readings
from sinssim.arguments import POSITIVE, check_kind, names, number, vector
from sinssim.data import Array, ImuData, Measurements, NavState, rows_of
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError, check_name
from sinssim.sensors.aiding.gnss import USUAL, first_course
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.toml_section import Vector3
from sinssim.units import capital

if TYPE_CHECKING:
    from sinssim.logs.log_settings import LogStart
    from sinssim.logs.recorded_log import RecordedLog


_BODY, _ANGLES = ("forward", "right", "down"), ("xy", "xz", "yx", "yz", "zx", "zy")

STATES = tuple(
    f"{quantity} {axis}"
    for quantity, axes in (
        ("position", ("north", "east", "down")),
        ("velocity", ("north", "east", "down")),
        ("attitude", ("north", "east", "down")),
        ("gyro bias", _BODY),
        ("accelerometer bias", _BODY),
        ("gyro scale", _BODY),
        ("accelerometer scale", _BODY),
        ("gyro misalignment", _ANGLES),
        ("accelerometer misalignment", _ANGLES),
    )
    for axis in axes
)
"""The states of P₀: position [m], velocity [m/s], attitude φ with C_determined = (I − [φ×]) C_true [rad]; and of the
sensors, as in eq. (2), gyro bias [rad/s], accelerometer bias [m/s²] (added to the true reading), relative scale-factor
errors and misalignments [rad]."""


def initial_state(
    determination: Determination, longitude: float, height: float, latitude: float | None = None
) -> NavState:
    """Return the initial state of navigation: the determined attitude, at rest.

    Args:
        determination: determination of one vehicle.
        longitude: rad.
        height: above the ellipsoid, m.
        latitude: rad, if it is known better than determined.

    Returns:
        The state.

    Raises:
        InputError: a required angle is undetermined, or the determination is that of several vehicles.
    """
    _check_usable(determination, need_latitude=latitude is None)
    d = determination
    return NavState(
        np.asarray(d.latitude if latitude is None else _known(latitude), dtype=np.float64),
        np.asarray(number("longitude", longitude, "rad")),
        np.asarray(number("height", height, "m")),
        np.zeros(3),
        rotation.quaternion_from_euler(d.roll, d.pitch, d.heading),
    )


def initial_covariance(
    determination: Determination,
    sigma: ImuErrors,
    duration: float,
    *,
    height: float = 0.0,
    latitude: float | None = None,
    position_sigma: ArrayLike = (10.0, 10.0, 10.0),
    velocity_sigma: ArrayLike = (0.01, 0.01, 0.01),
    method: Method = "quiet",
    rate_hz: float = 100.0,
    states: Sequence[str] = STATES[:15],
    still: Stillness | None = None,
) -> Array:
    """Return P₀ with the correlations between the attitude and the sensor errors.

    Args:
        determination: determination of one vehicle.
        sigma: standard deviations of the sensor block's errors.
        duration: length of the session, s.
        height: above the ellipsoid, m.
        latitude: rad, if it is known; otherwise the position has the determined latitude with its error.
        position_sigma: standard deviations of the position, north, east, down, m; north only for a known latitude.
        velocity_sigma: standard deviations of the velocity, north, east, down, m/s.
        method: "quiet" for eq. (1), "disturbed" for the inertial fit, with a known latitude if it is given here.
        rate_hz: samples per second, for flicker noise.
        states: which of `STATES`, n names; by default navigation and the biases.
        still: observed motion of the base, for "quiet"; None for a base known to be at rest.

    Returns:
        (n, n), symmetric and positive semi-definite.

    Raises:
        InputError: a required angle is undetermined, the determination is that of several vehicles, or an argument
            cannot be used; the message names it.
    """
    _check_usable(determination, need_latitude=latitude is None)
    check_name("method", method, get_args(Method))
    if still is not None:
        check_kind("still", still, Stillness, "Stillness, the result of stillness(), or None")
    wanted = names("states", "state", states, STATES)
    duration, height = number("duration", duration, "s", low=POSITIVE), number("height", height, "m")
    known = latitude is not None
    phi = float(determination.latitude) if latitude is None else _known(latitude)
    gyro, accel = ideal_readings(*determination.attitude, phi, gravity=determination.gravity)
    readings = np.zeros((6, 6))  # covariance of the errors of the mean readings
    for source, variance in reading_variances(sigma, gyro, accel, duration, method, rate_hz=rate_hz).items():
        triad = range(3) if source in OF_GYROS else range(3, 6)
        readings[triad, triad] += variance
    if still is not None:
        readings[:3, :3] += still.turn_covariance / still.duration**2
    by_reading = _by_reading(determination, phi, method, known, height)
    by_error, variance = _by_sensor_error(np.r_[gyro, accel]), _sensor_variance(sigma)
    covariance = np.zeros((len(STATES), len(STATES)))
    covariance[:9, :9] = by_reading @ readings @ by_reading.T
    if still is not None:  # from the session's mean, which is determined, to its last instant
        d = determination
        c_nb = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(d.roll, d.pitch, d.heading))
        covariance[6:9, 6:9] += 0.5 * c_nb @ still.turn_covariance @ c_nb.T
    covariance[:9, 9:] = by_reading @ by_error * variance
    covariance[9:, :9] = covariance[:9, 9:].T
    covariance[9:, 9:] = np.diag(variance)
    place = _spread("position_sigma", position_sigma, "m") ** 2
    place[0] = place[0] if known else 0.0
    covariance[:3, :3] += np.diag(place)
    covariance[3:6, 3:6] += np.diag(_spread("velocity_sigma", velocity_sigma, "m/s") ** 2)
    where = [STATES.index(state) for state in wanted]
    return np.asarray(0.5 * (covariance + covariance.T))[np.ix_(where, where)]


def _by_reading(d: Determination, latitude: float, method: Method, known: bool, height: float) -> Array:
    """Return the errors of position, velocity and attitude φ by those of the six mean readings, (9, 6) SI."""
    c = coefficients(d.attitude, latitude, gravity=d.gravity)
    if method != "quiet":
        c = cone_coefficients(c, latitude, d.gravity, known=known)
    zero = np.zeros(3)
    angles = np.stack([np.r_[c.m, c.n], np.r_[zero, c.q], np.r_[zero, c.l]])  # heading, roll, pitch
    sin_k, cos_k = np.sin(float(d.heading)), np.cos(float(d.heading))
    sin_t, cos_t = np.sin(float(d.pitch)), np.cos(float(d.pitch))
    # Heading is a rotation about down, pitch about the horizontal axis to the right, roll about the nose; φ is its
    # negative.
    turns = -np.array([[0.0, cos_t * cos_k, -sin_k], [0.0, cos_t * sin_k, cos_k], [1.0, -sin_t, 0.0]])
    by_reading = np.zeros((9, 6))
    by_reading[6:] = turns @ angles
    if not known:
        meridian, _ = earth.radii(latitude)
        by_reading[0] = (float(meridian) + height) * np.r_[c.p, c.r]
    return by_reading


_APART = ~np.eye(3, dtype=bool)


def _by_sensor_error(mean: Array) -> Array:
    """Return the errors of six mean readings by biases, scale factors and misalignments row by row, (6, 24)."""
    by_error = np.hstack([np.eye(6), np.diag(mean), np.zeros((6, 12))])
    for row in range(6):
        triad = mean[:3] if row < 3 else mean[3:]
        by_error[row, 12 + 2 * row : 14 + 2 * row] = triad[_APART[row % 3]]
    return by_error


def _sensor_variance(sigma: ImuErrors) -> Array:
    """Return the variances of the sensors' states, (24,)."""
    g, a = sigma.gyro, sigma.accel
    return np.asarray(np.r_[g.bias, a.bias, g.scale, a.scale, g.misalignment[_APART], a.misalignment[_APART]] ** 2)


def _known(latitude: float) -> float:
    return number("latitude", latitude, "rad", low=-0.5 * np.pi, high=0.5 * np.pi)


def _spread(name: str, sigma: ArrayLike, unit: str) -> Array:
    values = vector(name, sigma, 3, f"north, east, down, {unit}")
    if np.any(values < 0.0):
        raise InputError(f"{name} = {values.tolist()} {unit} must be standard deviations: zero or more.")
    return values


def _check_usable(determination: Determination, need_latitude: bool) -> None:
    check_kind("determination", determination, Determination, "a Determination, the result of determine()")
    d = determination
    if np.ndim(d.heading) != 0:
        raise InputError("navigation needs the determination of one vehicle; select one of its elements.")
    names = ["heading", "roll", "pitch", *(["latitude"] if need_latitude else [])]
    missing = [name for name in names if not np.isfinite(getattr(d, name))]
    if missing:
        why = " ".join(map(capital, d.warnings))
        raise InputError(f"navigation cannot start: {', '.join(missing)} not determined. {why}".rstrip())


def alignment_samples(time: Array, duration: float, key: str, user: str = "navigation") -> int:
    """Return the number of samples that an alignment takes at the start of a run with edges, (N+1,) s."""
    count = int(np.searchsorted(time, time[0] + duration - 1e-9))
    if count >= len(time) - 1:
        raise InputError(
            f"{key} = {duration:g}: the run lasts {time[-1] - time[0]:g} s, and {user} needs time after the alignment."
        )
    return count


def aligned_state(
    session: ImuData, place: NavState, method: str, expected: Expected, gravity: str, ellipsoid: Ellipsoid
) -> tuple[NavState, Determination]:
    """Align a vehicle at a known place; return the state at the end of the session, and what was determined.

    Both methods take the plumb line for the vertical. Above the ellipsoid it differs from the normal, to which
    attitudes refer, by up to 0.17″ per km of height; the state is corrected for that. "quiet" is eq. (1), which needs a
    vehicle at rest. "disturbed" is the fit of gravity's cone, which allows a sway about the place; its velocity is what
    the fit leaves of the measured one.
    """
    if method == "quiet":
        state, determination, _ = aligned_at_rest(session, place, expected.sigma, gravity, ellipsoid)
        return state, determination
    aligned = align_disturbed(session, float(place.latitude))
    # what the cone leaves of the velocity at the last instant, into the block's axes there
    last = rotation.conjugate(inertial_curve(session)[0][-1])
    sway = rotation.rotate(last, aligned.residual_velocity[-1])
    state = _from_plumb_line(aligned.determination, place, gravity, ellipsoid)
    return replace(state, velocity_ned=rotation.rotate(state.q_nb, sway)), aligned.determination


def aligned_at_rest(
    session: ImuData,
    place: NavState,
    sigma: ImuErrors,
    gravity: str,
    ellipsoid: Ellipsoid,
    grade_sigma: ImuErrors | None = None,
) -> tuple[NavState, Determination, Stillness]:
    """Align a vehicle at rest by eq. (1); the noise of `grade_sigma`, or `sigma`, judges the motion of its base."""
    determination = determine(*mean_readings(session), Expected(ImuErrors(), sigma).instrument_sigmas)
    noise = sigma if grade_sigma is None else grade_sigma
    still = stillness(session, Expected(ImuErrors(warm_up=noise.warm_up), noise))
    still.require()
    return _from_plumb_line(determination, place, gravity, ellipsoid), determination, still


def _from_plumb_line(determination: Determination, place: NavState, gravity: str, ellipsoid: Ellipsoid) -> NavState:
    """Return the initial state relative to the ellipsoid's normal, from angles relative to the plumb line."""
    latitude, height = float(place.latitude), float(place.height)
    state = initial_state(determination, float(place.longitude), height, latitude)
    north, _, down = earth.gravity_ned(latitude, height, gravity, ellipsoid)
    to_normal = rotation.quaternion_from_rotation_vector((0.0, np.arctan2(north, down), 0.0))
    return replace(state, q_nb=rotation.multiply(to_normal, state.q_nb))


_SPAN_S = 2.0
"""Time between the two positions of a difference, s. At the 3 m/s of a first course they are 6 m apart; the errors of
positions within so short a time are alike, and their difference is some decimetres, which is 3° of the course."""
_NOISE = 0.3
"""1σ of such a difference, m, or of two independent positions if that is less."""


def velocity_of_positions(position: Measurements | None) -> Measurements | None:
    """Return velocities from differences of satellites' positions, at the middle of each; None with too few."""
    if position is None or len(position) < 3:
        return None
    time = position.time
    place = earth.geodetic_to_ecef(position.value[:, 0], position.value[:, 1], position.value[:, 2], WGS84)
    begin = np.arange(len(time))
    end = np.searchsorted(time, time + _SPAN_S - 1e-6)
    rows = end < len(time)
    begin, end = begin[rows], end[rows]
    if not len(begin):
        return None
    lasts = (time[end] - time[begin])[:, None]
    q_en = earth.q_en(position.value[begin, 0], position.value[begin, 1])
    velocity = rotation.rotate(rotation.conjugate(q_en), (place[end] - place[begin]) / lasts)
    noise = np.minimum(np.sqrt(position.sigma[begin] ** 2 + position.sigma[end] ** 2), _NOISE) / lasts
    at = 0.5 * (time[end] + time[begin])
    return Measurements("gnss-velocity", at, at, velocity, noise, position.lever_arm, position.name)


_RESTING = 0.3
"""Speed below which a vehicle counts as resting, m/s: five times the noise of a receiver's velocities."""
_AT_REST_S = (2.0, 30.0)
"""Shortest and longest time at rest over which readings are averaged, s."""
_SETS_OFF_S = 2.0
"""Time before the first motion that may belong to it, s."""
_MOVING_S = 1.0
"""Time over which they are averaged in motion, s."""
_LATEST_FIX_S = 2.0
"""Latest first fix, s after the start."""
_ACCELERATION = 3.0
"""Usual acceleration of a vehicle, by which position and velocity at the start are uncertain, m/s²."""
_UPSIDE_DOWN = 90.0
"""Roll at the start from which the axes are doubted, deg."""
_TILT, _HEADING = np.radians(2.0), np.radians(10.0)
"""1σ of tilts and heading of such a start: bias of the accelerometers, mounting, slip."""
_TILT_OF_REFERENCE, _HEADING_OF_REFERENCE = np.radians(0.2), np.radians(1.0)


@dataclass(frozen=True)
class RecordedStart:
    """Start of navigation on recorded sensors."""

    state: NavState  # of the sensor block at the first edge
    position: Array  # 1σ north, east, down, (3,) m
    velocity: float  # 1σ of a component, m/s
    tilt: float  # 1σ of a tilt, rad
    heading: float  # 1σ of the heading, rad
    words: str  # a sentence on where it comes from


def recorded_start(
    log: RecordedLog, start: LogStart, mounting_deg: Vector3 | None = None, gravity: str = "normal"
) -> RecordedStart:
    """Return the state that navigation starts from; what the table [log.start] gives counts more than the data.

    `mounting_deg` are roll, pitch and yaw of the block's axes in the vehicle's.
    """
    of_reference = _of_reference(log, start)
    if of_reference is not None:
        return of_reference
    begin = float(log.imu.time[0])
    fixes = {m.kind: m for m in (readings.measurements for readings in log.sensed)}
    position, velocity = fixes.get("gnss-position"), fixes.get("gnss-velocity")
    if velocity is None or not len(velocity):
        velocity = velocity_of_positions(position)
    place, place_sigma = _place(start, position, velocity, begin)
    speed, speed_sigma = _speed(start, velocity, begin)
    q_vb = rotation.quaternion_from_euler(*np.radians(mounting_deg or (0.0, 0.0, 0.0)))
    resting = _resting(velocity, begin)
    down = float(earth.gravity_ned(place[0], place[2], gravity, WGS84)[2])
    q_nv, heading, words = _attitude(log.imu, start, velocity, resting, q_vb, down)
    q_nb = rotation.multiply(q_nv, q_vb)
    latitude, longitude, height = (np.asarray(part) for part in place)
    state = NavState(latitude, longitude, height, speed, rotation.normalize(q_nb))
    return RecordedStart(state, place_sigma, speed_sigma, _TILT, heading, words)


def _of_reference(log: RecordedLog, start: LogStart) -> RecordedStart | None:
    """Return the reference's own state at the start, if it is whole there and nothing else is given."""
    reference, begin = log.reference, log.imu.time[:1]
    if reference is None or reference.knows != ("position", "velocity", "attitude") or start.is_given:
        return None
    state = reference.state_at(begin)
    if state is None:
        return None
    sigma = reference.sigma_at(begin)
    position = np.full(3, 0.1) if sigma is None else np.maximum(np.nan_to_num(sigma[0], nan=0.1), 1e-3)
    first = rows_of(state, 0)
    words = f"Navigation starts from the reference {reference.name}."
    return RecordedStart(first, position, 0.05, _TILT_OF_REFERENCE, _HEADING_OF_REFERENCE, words)


def _place(
    start: LogStart, position: Measurements | None, velocity: Measurements | None, begin: float
) -> tuple[tuple[float, float, float], Array]:
    """Return latitude, longitude and height at the start, and their 1σ."""
    given = start.latitude_deg, start.longitude_deg, start.height_m
    if None not in given:
        latitude, longitude, height = (float(value or 0.0) for value in given)
        return (np.radians(latitude), np.radians(longitude), height), np.full(3, 1.0)
    if position is None or not len(position):
        raise InputError(
            "there is no position to start from: give log.start.latitude_deg, longitude_deg and height_m, or add "
            "[log.gnss] with positions."
        )
    wait = float(position.time[0]) - begin
    if wait > _LATEST_FIX_S:
        raise InputError(
            f"the first position comes {wait:.3g} s after the start at t = {begin:.3f} s: begin the run later "
            f"(log.from_s = {position.time[0]:.3f}), or give log.start.latitude_deg, longitude_deg and height_m."
        )
    latitude, longitude, height = (float(value) for value in position.value[0])
    back = np.zeros(3)
    if velocity is not None and len(velocity):
        back = velocity.value[int(np.argmin(np.abs(velocity.time - position.time[0])))] * -wait
    r1, r2 = earth.radii(latitude)
    latitude += back[0] / (float(r1) + height)
    longitude += back[1] / ((float(r2) + height) * np.cos(latitude))
    sigma = np.hypot(3.0 * position.sigma[0], 0.5 * _ACCELERATION * wait**2)
    if start.latitude_deg is not None and start.longitude_deg is not None:
        latitude, longitude = np.radians(start.latitude_deg), np.radians(start.longitude_deg)
    if start.height_m is not None:
        height, back[2] = start.height_m, 0.0
    return (latitude, longitude, height - back[2]), sigma


def _speed(start: LogStart, velocity: Measurements | None, begin: float) -> tuple[Array, float]:
    """Return the velocity at the start, and its 1σ."""
    if start.velocity_ned_mps is not None:
        return np.array(start.velocity_ned_mps), 0.1
    if velocity is None or not len(velocity):
        return np.zeros(3), 1.0
    k = int(np.argmin(np.abs(velocity.time - begin)))
    apart = abs(float(velocity.time[k]) - begin)
    sigma = float(np.hypot(3.0 * velocity.sigma[k].max(), _ACCELERATION * apart))
    return velocity.value[k].copy(), sigma


def _resting(velocity: Measurements | None, begin: float) -> float:
    """Return how long the vehicle rests at the start, s; 0 if it moves or nothing tells."""
    if velocity is None or not len(velocity):
        return 0.0
    moves = np.flatnonzero(np.linalg.norm(velocity.value, axis=1) > _RESTING)
    until = float(velocity.time[moves[0]] if len(moves) else velocity.time[-1]) - _SETS_OFF_S - begin
    return min(until, _AT_REST_S[1]) if until >= _AT_REST_S[0] else 0.0


def _attitude(
    imu: ImuData, start: LogStart, velocity: Measurements | None, resting: float, q_vb: Array, down: float
) -> tuple[Array, float, str]:
    """Return the attitude of the vehicle at the start, the 1σ of its heading, rad, and a sentence on it."""
    begin = float(imu.time[0])
    seconds = resting or min(_MOVING_S, float(imu.time[-1]) - begin)
    count = max(int(np.searchsorted(imu.time, begin + seconds)), 1)
    lasts = float(imu.time[count]) - begin
    bias = imu.dtheta[:count].sum(axis=0) / lasts if resting else np.zeros(3)
    steps = np.diff(imu.time)[:, None]
    freed = ImuData(imu.time, imu.dtheta - bias * steps, imu.dvel)
    heading_deg, at, uncertain = start.heading_deg, begin, 0.0
    if heading_deg is None:
        at, course, uncertain = _course(velocity, start.course_speed_mps, begin)
    then = min(int(np.searchsorted(imu.time, at - 1e-9)), len(imu))
    stop = max(then, count)
    turns, pushed = inertial_curve(ImuData(freed.time[: stop + 1], freed.dtheta[:stop], freed.dvel[:stop]))
    force = (imu.dvel[:count].sum(axis=0) if resting else pushed[count]) / lasts
    sensed = rotation.rotate(q_vb, force)
    pushing = np.zeros(3)
    if not resting and velocity is not None and len(velocity) > 1:
        change = [np.interp(begin + np.array((0.0, lasts)), velocity.time, axis) for axis in velocity.value.T]
        pushing = np.array([c[1] - c[0] for c in change]) / lasts
    heading = 0.0 if heading_deg is None else np.radians(heading_deg)
    for _ in range(4):  # the tilt depends on the heading only by the acceleration
        roll, pitch = _level(sensed, pushing - np.array((0.0, 0.0, down)), float(heading))
        if start.roll_deg is not None and start.pitch_deg is not None:
            roll, pitch = np.radians(start.roll_deg), np.radians(start.pitch_deg)
        q_nv = rotation.quaternion_from_euler(roll, pitch, heading)
        if heading_deg is not None:
            break
        later = rotation.multiply(
            rotation.multiply(q_nv, q_vb), rotation.multiply(turns[then], rotation.conjugate(q_vb))
        )
        forward = rotation.rotate(later, np.array((1.0, 0.0, 0.0)))
        heading = heading + course - np.arctan2(forward[1], forward[0])
    over = np.degrees(abs(roll))
    upside = f" With the given axes the vehicle is upside down, with a roll of {over:.0f}°: check log.imu.axes."
    upside = upside if over > _UPSIDE_DOWN and start.roll_deg is None else ""
    tilt = f"roll and pitch from {lasts:.1f} s {'at rest' if resting else 'in motion'}"
    if start.roll_deg is not None:
        tilt = "the given roll and pitch"
    if heading_deg is not None:
        return q_nv, _HEADING, f"Navigation starts at t = {begin:.3f} s with {tilt} and the given heading.{upside}"
    shown = np.degrees(heading) % 360.0
    slow = f", uncertain by {np.degrees(uncertain):.0f}°" if uncertain else ""
    return (
        q_nv,
        float(np.hypot(_HEADING, uncertain)),
        (
            f"Navigation starts at t = {begin:.3f} s with {tilt}, and the heading {shown:.1f}° from the course at "
            f"t = {at:.2f} s{slow}.{upside}"
        ),
    )


def _course(velocity: Measurements | None, least: float | None, begin: float) -> tuple[float, float, float]:
    """Return when the vehicle first moves fast enough, its course then, and what its 1σ adds to the heading's, rad."""
    if velocity is not None and len(velocity):
        later = velocity.time >= begin
        time, value, sigma = velocity.time[later], velocity.value[later], velocity.sigma[later][:, :2].max(axis=1)
        clear = first_course(time, value, sigma, least)
        if clear is not None:
            k, uncertain = clear
            speed = float(np.hypot(value[k, 0], value[k, 1]))
            slow = least is None and speed < USUAL
            return float(time[k]), float(np.arctan2(value[k, 1], value[k, 0])), uncertain if slow else 0.0
    shown = "the GNSS velocities do not reach a speed at which the course is known to 10°"
    if least is not None:
        shown = f"the GNSS velocities do not reach {least:g} m/s"
    shown = "there are no GNSS velocities" if velocity is None else shown
    raise InputError(
        f"the initial heading is unknown, because {shown}. Give log.start.heading_deg, "
        "log.start.course_speed_mps, or a reference with attitude."
    )


def _level(sensed: Array, force: Array, heading: float) -> tuple[float, float]:
    """Return roll and pitch for which a specific force in the vehicle's axes is a given one in north, east, down.

    With the force in the axes of the heading, R_y(θ) R_x(φ) f = f_h: roll follows from the second component, and then
    pitch from the other two.
    """
    c, s = np.cos(heading), np.sin(heading)
    ahead = np.array((c * force[0] + s * force[1], -s * force[0] + c * force[1], force[2]))
    across = float(np.hypot(sensed[1], sensed[2]))
    roll = np.arctan2(sensed[1], sensed[2]) - np.pi + np.arcsin(np.clip(ahead[1] / across, -1.0, 1.0))
    lowered = sensed[1] * np.sin(roll) + sensed[2] * np.cos(roll)
    pitch = np.arctan2(lowered, sensed[0]) - np.arctan2(ahead[2], ahead[0])
    return _within_half_a_turn(roll), _within_half_a_turn(pitch)


def _within_half_a_turn(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)
