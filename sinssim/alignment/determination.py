"""Heading, roll, pitch and latitude of a parked vehicle from the mean readings of its gyros and accelerometers.

The method is eq. (1). "Up" is the direction measured by accelerometers, the plumb line. Where gravity has a component
along the ellipsoid's horizon (8e-6 m/s² per km of height at mid-latitudes, and the deflection of the vertical on the
real Earth), the angles and the latitude are the astronomic ones, relative to the plumb line. The mean readings of a
session come with the noise of its sensors separated from motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.alignment.parked_theory import SINGULAR_ZONE, Angles, Attitude, InstrumentErrors, error_statistics, where
from sinssim.arguments import checked_imu, numbers
from sinssim.data import Array, ImuData
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.units import DEG_H

GRAVITY_RANGE = (9.3, 10.3)
"""Range of specific forces that usable instruments measure on a parked vehicle on the Earth, m/s²."""
EARTH_RATE_TOLERANCE = 0.25
"""Relative error of the measured Earth rate beyond which heading and latitude are not determined."""
LARGEST_RATE = 1000.0 * DEG_H
"""Rate beyond which the vehicle is not parked or the unit is wrong, rad/s."""
LARGEST_SIGMA = np.radians(30.0)
"""Expected standard deviation of an angle beyond which it counts as undetermined, rad."""


Mask = NDArray[np.bool_]


class Flags(NamedTuple):
    """One flag for each angle, boolean arrays."""

    heading: Mask
    roll: Mask
    pitch: Mask
    latitude: Mask


@dataclass(frozen=True, eq=False)
class Determination:
    """Angles and latitude of a parked vehicle; an undetermined angle is NaN, with a reason.

    Attributes:
        heading: clockwise from north, in [0, 2π), (...) rad.
        roll: right wing down positive, in (-π, π], (...) rad.
        pitch: nose up positive, (...) rad.
        latitude: north positive, (...) rad.
        earth_rate: magnitude of the measured rate, (...) rad/s.
        gravity: magnitude of the measured specific force, (...) m/s².
        undetermined: which angles are NaN.
        warnings: one sentence for each reason why a result is undetermined or doubtful.
    """

    heading: Array
    roll: Array
    pitch: Array
    latitude: Array
    earth_rate: Array
    gravity: Array
    undetermined: Flags
    warnings: tuple[str, ...] = ()

    @property
    def attitude(self) -> Attitude:
        """Heading, roll and pitch."""
        return Attitude(self.heading, self.roll, self.pitch)


def solve(gyro: ArrayLike, accel: ArrayLike) -> tuple[Angles, Array, Array]:
    """Solve eq. (1) without checks, for studies beyond its range of validity.

    Mean rates, (..., 3) rad/s, and specific forces, (..., 3) m/s², are forward-right-down. Returns the angles with the
    heading in [0, 2π), U_m in rad/s and g_m in m/s².
    """
    w, a = np.asarray(gyro, dtype=np.float64), np.asarray(accel, dtype=np.float64)
    # paper_axes by components: stacking them would take a third of the time
    wx, wy, wz = w[..., 1], w[..., 0], -w[..., 2]
    ax, ay, az = a[..., 1], a[..., 0], -a[..., 2]
    horizontal2 = ax * ax + az * az
    g_m = np.sqrt(horizontal2 + ay * ay)
    u_m = np.sqrt(wx * wx + wy * wy + wz * wz)
    # The arctangent forms equal the arcsines of (1) but keep their precision near ±90°; they also distinguish upright
    # from inverted attitudes.
    a_term = (wx * az - wz * ax) * g_m
    b_term = wy * horizontal2 - (wx * ax + wz * az) * ay
    # subtracted from zero instead of negated: a negative zero would turn a roll of 180° into −180°
    heading = np.arctan2(0.0 - a_term, b_term)
    heading = np.where(heading < 0.0, heading + 2.0 * np.pi, heading)
    heading = np.where(heading >= 2.0 * np.pi, 0.0, heading)  # a tiny negative angle plus 2π rounds to 2π
    roll = np.arctan2(0.0 - ax, az)
    pitch = np.arctan2(ay, np.sqrt(horizontal2))
    # |ω × a| / (g_m U_m) is the cosine that belongs to the sine in (1)
    cross = np.sqrt((wy * az - wz * ay) ** 2 + (wz * ax - wx * az) ** 2 + (wx * ay - wy * ax) ** 2)
    latitude = np.arctan2(wx * ax + wy * ay + wz * az, cross)
    return Angles(heading, roll, pitch, latitude), u_m, g_m


def determine(gyro: ArrayLike, accel: ArrayLike, sigmas: InstrumentErrors | None = None) -> Determination:
    """Determine heading, roll, pitch and latitude of parked vehicles from mean readings, eq. (1).

    An angle that the readings do not determine is NaN: the heading at the poles, heading and roll if the vehicle's
    longitudinal axis is vertical (both within `SINGULAR_ZONE`), heading and latitude if the measured rate differs from
    the Earth's by more than `EARTH_RATE_TOLERANCE`. With `sigmas` an angle is also NaN if its expected standard
    deviation exceeds `LARGEST_SIGMA`.

    Args:
        gyro: mean angular rates, (..., 3) rad/s, forward-right-down.
        accel: mean specific forces, (..., 3) m/s², forward-right-down; broadcasts with `gyro`.
        sigmas: standard deviations of the instruments' errors, if known.

    Returns:
        The determination, arrays of the broadcast shape.

    Raises:
        InputError: the readings are not vectors of 3, not finite or all zero, the specific force is not that of
            gravity, or the rate is impossible for a parked vehicle.
    """
    w, a = _checked_vectors(gyro, "gyro", "rad/s"), _checked_vectors(accel, "accel", "m/s²")
    try:
        np.broadcast_shapes(w.shape, a.shape)
    except ValueError as error:
        raise InputError(f"the shapes of gyro {w.shape} and accel {a.shape} do not fit together.") from error
    angles, u_m, g_m = solve(w, a)
    check_lengths(u_m, g_m)
    cos_pitch, cos_latitude = np.cos(angles.pitch), np.cos(angles.latitude)
    vertical = cos_pitch < np.sin(SINGULAR_ZONE)
    polar = cos_latitude < np.sin(SINGULAR_ZONE)
    wrong_rate = np.abs(u_m - OMEGA_IE) > EARTH_RATE_TOLERANCE * OMEGA_IE
    no_heading, no_roll, no_latitude = vertical | polar | wrong_rate, vertical, wrong_rate
    no_pitch = np.zeros_like(vertical)
    warnings = list(_reasons(angles, u_m, vertical, polar, wrong_rate))
    undetermined = Flags(no_heading, no_roll, no_pitch, no_latitude)
    if warnings:
        angles = Angles(*(np.where(mask, np.nan, value) for mask, value in zip(undetermined, angles, strict=True)))
    result = Determination(*angles, u_m, g_m, undetermined, tuple(warnings))
    if sigmas is None:
        return result
    # the theory does not apply to an undetermined angle: a regular one is its placeholder
    usable = Angles(*(np.where(vertical | polar | wrong_rate, 0.5, np.nan_to_num(angle)) for angle in angles))
    return doubt(result, error_statistics(Attitude(*usable[:3]), usable.latitude, None, sigmas, gravity=g_m).sigma)


def _reasons(angles: Angles, u_m: Array, vertical: Mask, polar: Mask, wrong_rate: Mask) -> Iterator[str]:
    """Yield a sentence for each reason why an angle is not determined."""
    if np.any(vertical):
        pitch = np.degrees(angles.pitch[vertical].flat[0])
        yield (
            f"heading and roll are not determined{where(vertical)}: the longitudinal axis is vertical "
            f"(pitch {pitch:.3f} deg)."
        )
    if np.any(polar):
        latitude = np.degrees(angles.latitude[polar].flat[0])
        yield (
            f"the heading is not determined{where(polar)}: at latitude {latitude:.3f} deg the Earth's rate has no "
            "horizontal part."
        )
    if np.any(wrong_rate):
        rate = u_m[wrong_rate].flat[0] / DEG_H
        yield (
            f"heading and latitude are not determined{where(wrong_rate)}: the gyros read {rate:.4g} deg/h, but the "
            f"Earth turns at {OMEGA_IE / DEG_H:.3f} deg/h: their errors are too large, the vehicle turned, or their "
            "unit is wrong (for an array rad/s)."
        )


def doubt(determination: Determination, sigma: Angles) -> Determination:
    """Return NaN, with a warning, for the angles whose expected standard deviation, rad, exceeds `LARGEST_SIGMA`."""
    warnings = list(determination.warnings)

    def marked(name: str, angle: Array, spread: Array) -> Array:
        spread = np.broadcast_to(spread, angle.shape)
        mask = np.isfinite(angle) & (spread > LARGEST_SIGMA)
        if np.any(mask):
            warnings.append(
                f"the {name} is not determined{where(mask)}: with these instruments its standard deviation would be "
                f"{np.degrees(spread[mask].flat[0]):.3g} deg."
            )
        return np.where(mask, np.nan, angle)

    d = determination
    angles = Angles(*map(marked, Angles._fields, (d.heading, d.roll, d.pitch, d.latitude), sigma))
    flags = Flags(*(np.isnan(angle) for angle in angles))
    return Determination(*angles, d.earth_rate, d.gravity, flags, tuple(warnings))


def _checked_vectors(values: ArrayLike, name: str, unit: str) -> Array:
    array = numbers(name, values)
    if array.shape[-1:] != (3,):
        raise InputError(f"{name} has shape {array.shape}; give mean values (..., 3) in {unit}, forward-right-down.")
    bad = ~np.isfinite(array).all(axis=-1) if not np.isfinite(array.sum()) else np.False_
    if np.any(bad):
        raise InputError(
            f"{name} contains NaN or infinity{where(np.asarray(bad))}; every value must be finite, in {unit}."
        )
    return array


def check_lengths(u_m: Array, g_m: Array) -> None:
    """Raise for readings that are impossible for a parked vehicle, with their value."""
    if not np.all(g_m > 0.0):
        raise InputError(f"the accelerometers read zero{where(~(g_m > 0.0))}: no data, or a vehicle in free fall.")
    if not np.all(u_m > 0.0):
        raise InputError(
            f"the gyros read zero on all axes{where(~(u_m > 0.0))}: no data, as the Earth's rate is not zero."
        )
    low, high = GRAVITY_RANGE
    if np.min(g_m, initial=low) < low or np.max(g_m, initial=high) > high:
        bad = (g_m < low) | (g_m > high)
        value = g_m[bad].flat[0]
        raise InputError(
            f"the measured specific force is {value:.6g} m/s²{where(bad)}; a parked vehicle on the Earth has {low} "
            f"to {high} m/s²: check the unit (m/s², or m/s per increment), the scale factors, and that the vehicle "
            "was stationary."
        )
    if np.max(u_m, initial=0.0) > LARGEST_RATE:
        bad = u_m > LARGEST_RATE
        value = u_m[bad].flat[0]
        raise InputError(
            f"the measured rate is {value / DEG_H:.6g} deg/h ({value:.4g} rad/s){where(bad)}; the Earth turns at "
            f"{OMEGA_IE / DEG_H:.3f} deg/h: the vehicle turned, or the gyros' unit is wrong (for "
            "an array rad/s)."
        )


FEWEST_SAMPLES = 40
"""Number of samples that a test for motion needs."""


def mean_readings(imu: ImuData) -> tuple[Array, Array]:
    """Return mean angular rate and mean specific force over a session.

    Args:
        imu: the session's increments.

    Returns:
        Rate, (3,) rad/s, and specific force, (3,) m/s², forward-right-down.

    Raises:
        InputError: the increments have inconsistent shapes, are not finite or not in order of time.
    """
    imu = check_session(imu)
    duration = imu.time[-1] - imu.time[0]
    return imu.dtheta.sum(axis=0) / duration, imu.dvel.sum(axis=0) / duration


def check_session(imu: ImuData) -> ImuData:
    """Return increments that are usable as a session."""
    imu = checked_imu(imu)
    if len(imu) < FEWEST_SAMPLES:
        raise InputError(f"the session has {len(imu)} samples; the test for motion needs at least {FEWEST_SAMPLES}.")
    return imu


def white_level(increments: Array, duration: float) -> float:
    """Return the random walk coefficient N of the noisiest axis, without slow motion and most of quantisation.

    White noise has an Allan deviation N/√τ at every τ; slow motion raises it at long τ, quantisation at short τ, a jolt
    in one part of the session. The result is therefore the smallest N over octaves of τ of the median over parts of the
    session, in rad/√s or m/s/√s for increments (N, 3) in rad or m/s.
    """
    count = len(increments)
    levels = []
    size = 1
    while size == 1 or count // size >= 128:
        blocks = count // size
        sums = increments[: blocks * size].reshape(blocks, size, 3).sum(axis=1)
        squares = 0.5 * np.diff(sums, axis=0) ** 2
        parts = np.array_split(squares, min(16, len(squares)))
        variance = np.median([part.mean(axis=0) for part in parts], axis=0)
        levels.append(np.sqrt(variance * count / (size * duration)))
        size *= 2
    return float(np.max(np.min(levels, axis=0)))


def pulse(increments: Array) -> float:
    """Return an upper estimate of the pulse weight of increments, (N, 3) rad or m/s.

    It is three times the typical largest departure of a sample from the mean.
    """
    departure = np.abs(increments - increments.mean(axis=0)).max(axis=1)
    return 3.0 * float(np.median([part.max() for part in np.array_split(departure, min(16, len(departure)))]))
