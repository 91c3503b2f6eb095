"""First-order theory of a parked vehicle's errors in heading, roll, pitch and latitude, eqs. (2) and (7)-(26)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.alignment.axes import SINGULAR_ZONE, Angles, Attitude, body_axes, checked_angles, paper_axes, where
from sinssim.alignment.readings_at_rest import ideal_readings, local_gravity
from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.earth.models import OMEGA_IE
from sinssim.errors import InputError

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
    """Partial derivatives of the determined angles with respect to the readings, each (..., 3), forward-right-down.

    Attributes:
        m: heading by rate, s.
        n: heading by specific force, s²/m.
        q: roll by specific force, s²/m.
        l: pitch by specific force, s²/m.
        p: latitude by rate, s.
        r: latitude by specific force, s²/m.
    """

    m: Array
    n: Array
    q: Array
    l: Array  # noqa: E741 - symbol of the theory
    p: Array
    r: Array


class ErrorStatistics(NamedTuple):
    """Means and standard deviations of the angle errors, rad."""

    mean: Angles
    sigma: Angles


def coefficients(
    attitude: Attitude,
    latitude: ArrayLike,
    *,
    earth_rate: float = OMEGA_IE,
    gravity: ArrayLike | None = None,
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
    """Return the sums of (7)-(10) over the axes; with squared coefficients and variances, those of (12)-(23).

    Args:
        c: coefficients.
        d_rate: errors of the rates, (..., 3) rad/s.
        d_force: errors of the specific forces, (..., 3) m/s².

    Returns:
        Errors of the angles, rad.
    """

    def dot(coefficient: Array, value: Array) -> Array:
        return np.asarray(np.einsum("...i,...i->...", *np.broadcast_arrays(coefficient, value)))

    return Angles(
        dot(c.m, d_rate) + dot(c.n, d_force),
        dot(c.q, d_force),
        dot(c.l, d_force),
        dot(c.p, d_rate) + dot(c.r, d_force),
    )


def error_statistics(
    attitude: Attitude,
    latitude: ArrayLike,
    means: InstrumentErrors | None,
    sigmas: InstrumentErrors,
    *,
    earth_rate: float = OMEGA_IE,
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
        earth_rate: U, rad/s.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        M{Δ} and σ{Δ} of heading (11, 12), roll (16, 17), pitch (19, 20) and latitude (22, 23), rad.

    Raises:
        InputError: as for `coefficients`, or a standard deviation is negative.
    """
    c = coefficients(attitude, latitude, earth_rate=earth_rate, gravity=gravity)
    gyro, accel = ideal_readings(*attitude, latitude, earth_rate=earth_rate, gravity=gravity)
    mean = linear(c, *(means or InstrumentErrors()).reading_errors(gyro, accel))
    # (12), (17), (20), (23): the variance of a reading is the sum of those by its bias and by its scale factor.
    variances = sigmas.squared().reading_errors(gyro**2, accel**2)
    variance = linear(Coefficients(*(value**2 for value in c)), *variances)
    return ErrorStatistics(mean, Angles(*(np.sqrt(value) for value in variance)))
