"""From a determination to the start of navigation: the initial state, and P₀ of the filter that aligns finely."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from sinssim.alignment.axes import Array, Attitude
from sinssim.alignment.budget import OF_GYROS, Method, cone_coefficients, reading_variances
from sinssim.alignment.determination import Determination, ideal_readings
from sinssim.alignment.theory import coefficients
from sinssim.data import NavState
from sinssim.errors import InputError
from sinssim.sensors.imu_errors import ImuErrors

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
"""The states of P₀: position [m], velocity [m/s], attitude φ with C_determined = (I − [φ×]) C_true [rad], and of the
sensors, as eq. (2) has them, gyro bias [rad/s], accelerometer bias [m/s²] (what is added to the true reading), relative
scale-factor errors and misalignments [rad]."""


def initial_state(
    determination: Determination, longitude: float, height: float, latitude: float | None = None
) -> NavState:
    """Return the state from which navigation starts: the determined attitude, at rest.

    Args:
        determination: of one vehicle.
        longitude: rad.
        height: above the ellipsoid, m.
        latitude: rad, if it is known better than it was determined.

    Returns:
        The state.

    Raises:
        InputError: an angle that is needed is undetermined, or the determination is of many vehicles.
    """
    from sinssim import rotation

    _check_usable(determination, need_latitude=latitude is None)
    d = determination
    return NavState(
        np.asarray(d.latitude if latitude is None else latitude, dtype=np.float64),
        np.asarray(longitude, dtype=np.float64),
        np.asarray(height, dtype=np.float64),
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
) -> Array:
    """Return P₀ of states, with what ties the attitude to the errors of the sensors that spoiled it.

    Args:
        determination: of one vehicle.
        sigma: standard deviations of the sensor block's errors.
        duration: length of the session, s.
        height: above the ellipsoid, m.
        latitude: rad, if it is known; otherwise the determined latitude is the position, with its own error.
        position_sigma: standard deviations of the position, north, east, down, m; north only of a known latitude.
        velocity_sigma: standard deviations of the velocity, north, east, down, m/s.
        method: "quiet" for eq. (1), "disturbed" for the inertial fit, whose latitude is known if it is given here.
        rate_hz: samples per second, for flicker noise.
        states: which of `STATES`, n names; by default navigation and the biases.

    Returns:
        (n, n), symmetric and positive semi-definite.

    Raises:
        InputError: an angle that is needed is undetermined, or the determination is of many vehicles.
    """
    from sinssim import earth

    _check_usable(determination, need_latitude=latitude is None)
    d = determination
    phi = float(d.latitude if latitude is None else latitude)
    attitude = Attitude(d.heading, d.roll, d.pitch)
    c = coefficients(attitude, phi, gravity=d.gravity)
    if method != "quiet":
        c = cone_coefficients(c, phi, d.gravity, known=latitude is not None)
    gyro, accel = ideal_readings(*attitude, phi, gravity=d.gravity)
    rate, force = np.zeros(3), np.zeros(3)
    variances = reading_variances(sigma, gyro, accel, duration, method, rate_hz=rate_hz)
    for source, variance in variances.items():
        of = rate if source in OF_GYROS else force
        of += variance

    # Rows: heading, roll, pitch, latitude; columns: errors of the six mean readings.
    zero = np.zeros(3)
    angles = np.stack([np.r_[c.m, c.n], np.r_[zero, c.q], np.r_[zero, c.l], np.r_[c.p, c.r]])
    sin_k, cos_k = np.sin(float(d.heading)), np.cos(float(d.heading))
    sin_t, cos_t = np.sin(float(d.pitch)), np.cos(float(d.pitch))
    # Heading turns about down, pitch about the horizontal axis to the right, roll about the nose; φ is minus that.
    turns = -np.array([[0.0, cos_t * cos_k, -sin_k], [0.0, cos_t * sin_k, cos_k], [1.0, -sin_t, 0.0]])
    by_reading = np.zeros((9, 6))
    by_reading[6:] = turns @ angles[:3]
    if latitude is None:
        meridian, _ = earth.radii(phi)
        by_reading[0] = (float(meridian) + height) * angles[3]
    covariance = np.zeros((len(STATES), len(STATES)))
    covariance[:9, :9] = by_reading @ np.diag(np.r_[rate, force]) @ by_reading.T

    # The readings' errors by the errors of the sensors: biases, scale factors, misalignments row by row.
    mean = np.r_[gyro, accel]
    by_error = np.hstack([np.eye(6), np.diag(mean), np.zeros((6, 12))])
    apart = ~np.eye(3, dtype=bool)
    for row in range(6):
        block = mean[:3] if row < 3 else mean[3:]
        by_error[row, 12 + 2 * row : 14 + 2 * row] = block[apart[row % 3]]
    g, a = sigma.gyro, sigma.accel
    variance = np.r_[g.bias, a.bias, g.scale, a.scale, g.misalignment[apart], a.misalignment[apart]] ** 2
    covariance[:9, 9:] = by_reading @ by_error * variance
    covariance[9:, :9] = covariance[:9, 9:].T
    covariance[9:, 9:] = np.diag(variance)
    known = np.asarray(position_sigma, dtype=np.float64) ** 2
    known[0] = 0.0 if latitude is None else known[0]
    covariance[:3, :3] += np.diag(known)
    covariance[3:6, 3:6] += np.diag(np.asarray(velocity_sigma, dtype=np.float64) ** 2)
    where = [STATES.index(state) for state in states]
    return np.asarray(0.5 * (covariance + covariance.T))[np.ix_(where, where)]


def _check_usable(determination: Determination, need_latitude: bool) -> None:
    d = determination
    if np.ndim(d.heading) != 0:
        raise InputError("navigation starts from one vehicle; take one element of the determination.")
    names = ["heading", "roll", "pitch", *(["latitude"] if need_latitude else [])]
    missing = [name for name in names if not np.isfinite(getattr(d, name))]
    if missing:
        raise InputError(
            f"navigation cannot start: {', '.join(missing)} not determined. {' '.join(determination.warnings)}".rstrip()
        )
