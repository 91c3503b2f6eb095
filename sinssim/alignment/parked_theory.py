"""First-order theory of a parked vehicle: ideal readings, and errors in heading, roll, pitch and latitude.

Body axes and angles are those of the theory; they are converted to the package's axes. Readings of perfect instruments
are the Earth rate and the reaction to gravity, eqs. (3) and (4); the errors are eqs. (2) and (7)-(26).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError, shortened

SINGULAR_ZONE = np.radians(0.05)
"""Half-width of the zones around the poles and around the vertical attitude in which angles are undetermined, rad."""


class Attitude(NamedTuple):
    """Attitude of a parked vehicle, in rad, arrays that broadcast together.

    Attributes:
        heading: clockwise from north.
        roll: right wing down positive.
        pitch: nose up positive.
    """

    heading: ArrayLike
    roll: ArrayLike
    pitch: ArrayLike


class Angles(NamedTuple):
    """One value for each angle that is determined on a parked vehicle: an error, a mean or a standard deviation, rad.

    Attributes:
        heading: value for the heading.
        roll: value for the roll.
        pitch: value for the pitch.
        latitude: value for the latitude.
    """

    heading: Array
    roll: Array
    pitch: Array
    latitude: Array


def paper_axes(vector: ArrayLike) -> Array:
    """Convert components forward-right-down to right-forward-up, the axes of eqs. (1)-(26), or back.

    The conversion is its own inverse: X right, Y forward, Z up is (right, forward, -down).

    Args:
        vector: (..., 3) components of a vector (or of coefficients that multiply a vector).

    Returns:
        The same vector in the other axes, (..., 3).
    """
    v = np.asarray(vector, dtype=np.float64)
    return np.stack([v[..., 1], v[..., 0], -v[..., 2]], axis=-1)


class BodyAxes(NamedTuple):
    """Components of the body axes right, forward, up on east, north and up, each (..., 3)."""

    east: Array
    north: Array
    up: Array


def body_axes(attitude: Attitude) -> BodyAxes:
    """Resolve the body axes X right, Y forward, Z up on east, north and up: E, N, H of the first-order error theory."""
    heading, roll, pitch = np.broadcast_arrays(*(np.asarray(angle, dtype=np.float64) for angle in attitude))
    sin_k, cos_k = np.sin(heading), np.cos(heading)
    sin_g, cos_g = np.sin(roll), np.cos(roll)
    sin_t, cos_t = np.sin(pitch), np.cos(pitch)
    # The table above eqs. (7)-(10).
    east = [cos_k * cos_g + sin_k * sin_t * sin_g, sin_k * cos_t, cos_k * sin_g - sin_k * sin_t * cos_g]
    north = [-sin_k * cos_g + cos_k * sin_t * sin_g, cos_k * cos_t, -sin_k * sin_g - cos_k * sin_t * cos_g]
    up = [-cos_t * sin_g, sin_t, cos_t * cos_g]
    return BodyAxes(np.stack(east, -1), np.stack(north, -1), np.stack(up, -1))


def checked_angles(attitude: Attitude, latitude: ArrayLike) -> tuple[Attitude, Array]:
    """Return attitude and latitude as arrays that broadcast together."""
    given: object = attitude
    sized = isinstance(given, tuple | list) or (isinstance(given, np.ndarray) and given.ndim > 0)
    if not sized or len(attitude) != 3:
        raise InputError(f"attitude = {shortened(repr(given), 40)} must be Attitude(heading, roll, pitch), rad.")
    named = dict(zip(("heading", "roll", "pitch"), attitude, strict=True), latitude=latitude)
    arrays = {name: numbers(name, value) for name, value in named.items()}
    check_broadcast(arrays)
    for name, value in arrays.items():
        if not np.all(np.isfinite(value)):
            raise InputError(f"the {name} is not a finite number{where(~np.isfinite(value))}; give radians.")
    for name in ("pitch", "latitude"):
        beyond = np.abs(arrays[name]) > np.pi / 2 * (1 + 1e-12)
        if np.any(beyond):
            value = np.degrees(arrays[name][beyond].flat[0])
            raise InputError(
                f"the {name} is {value:.6g} deg{where(beyond)}; it must lie between -90 and 90 deg and be given in "
                "radians."
            )
    return Attitude(arrays["heading"], arrays["roll"], arrays["pitch"]), arrays["latitude"]


def check_broadcast(arrays: Mapping[str, Array]) -> None:
    """Raise for arrays that do not broadcast together, with their shapes."""
    try:
        np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError as error:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.shape)
        raise InputError(f"arrays of shapes {shapes} do not broadcast together.") from error


def where(bad: NDArray[Any]) -> str:
    """Return the first invalid element of an array in words, " (element [i, j])", or "" for a single number."""
    if bad.ndim == 0:
        return ""
    index = ", ".join(str(i) for i in np.argwhere(bad)[0])
    return f" (element [{index}])"


def ideal_readings(
    heading: ArrayLike,
    roll: ArrayLike,
    pitch: ArrayLike,
    latitude: ArrayLike,
    *,
    earth_rate: float = OMEGA_IE,
    gravity: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Return the readings of perfect instruments on a parked vehicle, eqs. (3) and (4).

    Args:
        heading, roll, pitch: attitude, rad, broadcasting.
        latitude: rad, broadcasting.
        earth_rate: U, rad/s.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        Angular rate, rad/s, and specific force, m/s², each (..., 3) forward-right-down.

    Raises:
        InputError: an angle is not finite or out of its range.
    """
    attitude, phi = checked_angles(Attitude(heading, roll, pitch), latitude)
    axes = body_axes(attitude)
    g = local_gravity(phi, gravity)
    # (3): the Earth's rate is U cosφ along north and U sinφ along up, projected by N and H of each body axis.
    rate = earth_rate * (np.cos(phi)[..., None] * axes.north + np.sin(phi)[..., None] * axes.up)
    # (4): the reaction of the support is g upwards.
    shape = np.broadcast_shapes(g.shape, rate.shape[:-1])
    force = np.broadcast_to(g[..., None] * axes.up, (*shape, 3))
    return paper_axes(np.broadcast_to(rate, (*shape, 3))), paper_axes(force)


def local_gravity(latitude: Array, gravity: ArrayLike | None) -> Array:
    """Return g, (...) m/s²: a given positive value, or normal gravity on the ellipsoid at the latitude."""
    if gravity is None:
        from sinssim.earth.gravity import surface_gravity

        return np.asarray(surface_gravity(latitude), dtype=np.float64)
    g = numbers("gravity", gravity)
    if not np.all(g > 0.0):
        raise InputError(f"gravity must be a positive number of m/s²{where(~(g > 0.0))}.")
    return g


RANDOM_WALK_FACTOR = 10.0 / 7.0
"""Variance of the heading from angle random walk on a disturbed base, relative to eq. (1) on a quiet one.

The fit of v₀ + at + bt² to a velocity weighs the rate by W = 30 x²(1 − x)², x = t/T, and ∫W² dx = 10/7.
"""

EQUATOR = np.radians(5.0)
"""Distance from the equator, rad, within which the cone of gravity does not give the latitude, because cosφ hardly
changes."""

_FIELDS = ("gyro_bias", "gyro_scale", "accel_bias", "accel_scale")


@dataclass(frozen=True, eq=False)
class InstrumentErrors:
    """Bias and relative scale-factor error of three gyros and three accelerometers, eq. (2).

    The container holds errors, their means or their standard deviations. A single number applies to all three axes;
    arrays are (..., 3), forward-right-down.

    Attributes:
        gyro_bias: ω₀, rad/s.
        gyro_scale: k, relative.
        accel_bias: a₀, m/s².
        accel_scale: h, relative.
    """

    gyro_bias: ArrayLike = 0.0
    gyro_scale: ArrayLike = 0.0
    accel_bias: ArrayLike = 0.0
    accel_scale: ArrayLike = 0.0

    def __post_init__(self) -> None:
        """Convert every field to a float array (..., 3) and check it."""
        for name in _FIELDS:
            array = numbers(name, getattr(self, name))
            if array.ndim == 0:
                array = np.full(3, array)
            if array.shape[-1] != 3:
                raise InputError(f"{name} has shape {array.shape}; give one number, or (..., 3) forward-right-down.")
            if not np.all(np.isfinite(array)):
                raise InputError(f"{name} contains NaN or infinity{where(~np.isfinite(array))}.")
            object.__setattr__(self, name, array)

    def reading_errors(self, gyro: ArrayLike, accel: ArrayLike) -> tuple[Array, Array]:
        """Return the errors of the readings, δω = ω₀ + kω and δa = a₀ + ha.

        Args:
            gyro: true rates, (..., 3) rad/s.
            accel: true specific forces, (..., 3) m/s².

        Returns:
            δω, (..., 3) rad/s, and δa, (..., 3) m/s².
        """
        return (
            np.asarray(self.gyro_bias) + np.asarray(self.gyro_scale) * np.asarray(gyro),
            np.asarray(self.accel_bias) + np.asarray(self.accel_scale) * np.asarray(accel),
        )

    def apply(self, gyro: ArrayLike, accel: ArrayLike) -> tuple[Array, Array]:
        """Return the readings of instruments with these errors, eq. (2).

        Args:
            gyro: true rates, (..., 3) rad/s.
            accel: true specific forces, (..., 3) m/s².

        Returns:
            Readings, (..., 3) rad/s and (..., 3) m/s².
        """
        d_rate, d_force = self.reading_errors(gyro, accel)
        return np.asarray(gyro) + d_rate, np.asarray(accel) + d_force

    def squared(self) -> InstrumentErrors:
        """Return the variances of these standard deviations.

        Raises:
            InputError: a standard deviation is negative.
        """
        squares = []
        for name in _FIELDS:
            sigma = np.asarray(getattr(self, name))
            if np.any(sigma < 0.0):
                raise InputError(f"the standard deviation {name} is negative{where(sigma < 0.0)}; give zero or more.")
            squares.append(sigma**2)
        return InstrumentErrors(*squares)


class Coefficients(NamedTuple):
    """Partial derivatives of the determined angles with respect to the readings, each (..., 3), forward-right-down."""

    m: Array  # heading by rate, s
    n: Array  # heading by specific force, s²/m
    q: Array  # roll by specific force, s²/m
    l: Array  # noqa: E741 - symbol of the theory
    """Pitch by specific force, s²/m."""
    p: Array  # latitude by rate, s
    r: Array  # latitude by specific force, s²/m


class ErrorStatistics(NamedTuple):
    """Means and standard deviations of the angle errors, rad."""

    mean: Angles
    sigma: Angles


def coefficients(
    attitude: Attitude, latitude: ArrayLike, *, earth_rate: float = OMEGA_IE, gravity: ArrayLike | None = None
) -> Coefficients:
    """Return the coefficients m, n, q, l, p, r of eqs. (7)-(10).

    Args:
        attitude: heading, roll, pitch, rad, broadcasting.
        latitude: rad, broadcasting.
        earth_rate: U, rad/s.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        The coefficients for readings forward-right-down.

    Raises:
        InputError: an angle is out of its range, or within `SINGULAR_ZONE` of a pole or of the vertical attitude, where
            the first-order theory does not hold.
    """
    attitude, phi = checked_angles(attitude, latitude)
    _check_regular(attitude, phi)
    g = local_gravity(phi, gravity)[..., None]
    _, roll, pitch = (np.asarray(angle)[..., None] for angle in attitude)
    phi = phi[..., None]
    east, north, up = body_axes(attitude)
    sin_g, cos_g, tan_t = np.sin(roll), np.cos(roll), np.tan(pitch)
    sin_t, cos_t = np.sin(pitch), np.cos(pitch)
    zero = np.zeros_like(sin_g * sin_t)
    # Derivatives of the body axes with respect to roll and pitch: the last terms of n, and q, l themselves.
    tilt = np.concatenate(np.broadcast_arrays(cos_g * tan_t, zero, sin_g * tan_t), axis=-1)
    m = -east / (earth_rate * np.cos(phi))  # (7)
    n = (east * np.tan(phi) - tilt) / g  # (7)
    q = np.concatenate(np.broadcast_arrays(-cos_g / cos_t, zero, -sin_g / cos_t), axis=-1) / g  # (8)
    l = np.concatenate(np.broadcast_arrays(sin_g * sin_t, cos_t, -cos_g * sin_t), axis=-1) / g  # noqa: E741 (9)
    p = (np.cos(phi) * up - np.sin(phi) * north) / earth_rate  # (10)
    r = north / g  # (10)
    return Coefficients(*(paper_axes(value) for value in (m, n, q, l, p, r)))


def _check_regular(attitude: Attitude, latitude: Array) -> None:
    for angle, what in (
        (latitude, "the latitude is {:.4f} deg{}: at a pole the heading is undefined"),
        (np.asarray(attitude.pitch), "the pitch is {:.4f} deg{}: with a vertical axis heading and roll are undefined"),
    ):
        singular = np.abs(angle) > np.pi / 2 - SINGULAR_ZONE
        if np.any(singular):
            text = what.format(np.degrees(angle[singular].flat[0]), where(singular))
            raise InputError(
                f"{text} and the first-order error theory does not hold; stay at least {np.degrees(SINGULAR_ZONE):g} "
                "deg away."
            )


def errors(
    attitude: Attitude,
    latitude: ArrayLike,
    instrument_errors: InstrumentErrors,
    *,
    earth_rate: float = OMEGA_IE,
    gravity: ArrayLike | None = None,
) -> Angles:
    """Return the first-order errors (determined minus true) of heading, roll, pitch and latitude, eqs. (7)-(10).

    Args:
        attitude: true heading, roll, pitch, rad, broadcasting.
        latitude: true latitude, rad, broadcasting.
        instrument_errors: biases and scale-factor errors; leading shapes broadcast.
        earth_rate: U, rad/s.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        ΔK, Δγ, Δθ, Δφ, rad.

    Raises:
        InputError: as for `coefficients`.
    """
    c = coefficients(attitude, latitude, earth_rate=earth_rate, gravity=gravity)
    gyro, accel = ideal_readings(*attitude, latitude, earth_rate=earth_rate, gravity=gravity)
    return linear(c, *instrument_errors.reading_errors(gyro, accel))


def linear(c: Coefficients, d_rate: Array, d_force: Array) -> Angles:
    """Return the sums of (7)-(10) over the axes, rad; with squared coefficients and variances, those of (12)-(23).

    The errors of the readings are (..., 3) rad/s and m/s².
    """

    def dot(coefficient: Array, value: Array) -> Array:
        return np.asarray(np.einsum("...i,...i->...", coefficient, value))

    return Angles(
        dot(c.m, d_rate) + dot(c.n, d_force), dot(c.q, d_force), dot(c.l, d_force), dot(c.p, d_rate) + dot(c.r, d_force)
    )


def error_statistics(
    attitude: Attitude,
    latitude: ArrayLike,
    means: InstrumentErrors | None,
    sigmas: InstrumentErrors,
    *,
    gravity: ArrayLike | None = None,
) -> ErrorStatistics:
    """Return means and standard deviations of the angle errors, eqs. (11)-(26) in their general form.

    The instruments' errors are uncorrelated random values. By broadcasting, one call computes a map over heading and
    latitude.

    Args:
        attitude: true heading, roll, pitch, rad, broadcasting.
        latitude: true latitude, rad, broadcasting.
        means: M{·} of the instruments' errors; None for zero.
        sigmas: σ{·} of the instruments' errors.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        M{Δ} and σ{Δ} of heading (11, 12), roll (16, 17), pitch (19, 20) and latitude (22, 23), rad.

    Raises:
        InputError: as for `coefficients`, or a standard deviation is negative.
    """
    c = coefficients(attitude, latitude, gravity=gravity)
    gyro, accel = ideal_readings(*attitude, latitude, gravity=gravity)
    mean = linear(c, *(means or InstrumentErrors()).reading_errors(gyro, accel))
    # (12), (17), (20), (23): the variance of a reading is the sum of those by its bias and by its scale factor.
    variances = sigmas.squared().reading_errors(gyro**2, accel**2)
    variance = linear(Coefficients(*(value**2 for value in c)), *variances)
    return ErrorStatistics(mean, Angles(*(np.sqrt(value) for value in variance)))
