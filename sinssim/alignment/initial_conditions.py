"""Initial state of navigation and initial covariance P₀ of the fine-alignment filter from an alignment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.alignment.alignment_budget import OF_GYROS, Expected, Method, cone_coefficients, reading_variances
from sinssim.alignment.base_motion import Stillness, stillness
from sinssim.alignment.determination import Determination, determine, mean_readings
from sinssim.alignment.disturbed_base import align_disturbed, inertial_curve
from sinssim.alignment.parked_theory import coefficients, ideal_readings
from sinssim.arguments import POSITIVE, check_kind, names, number, vector
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError, check_name
from sinssim.sensors.imu.imu_errors import ImuErrors

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
        raise InputError(
            f"navigation cannot start: {', '.join(missing)} not determined. {' '.join(determination.warnings)}".rstrip()
        )


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
