"""Body axes and angles of the parked-vehicle theory, and the conversion to the package's axes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.arguments import numbers
from sinssim.data import Array
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
    """Resolve the body axes X right, Y forward, Z up on east, north and up.

    Args:
        attitude: heading, roll, pitch, rad, broadcasting.

    Returns:
        E, N, H of the first-order error theory, last axis X, Y, Z.
    """
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
    """Check that angles are finite and in their ranges.

    Args:
        attitude: heading, roll, pitch, rad.
        latitude: rad.

    Raises:
        InputError: an angle is not finite, or a pitch or latitude exceeds ±90 deg.
    """
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
    """Raise if arrays do not broadcast together.

    Raises:
        InputError: they do not; the message gives their shapes.
    """
    try:
        np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError as error:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.shape)
        raise InputError(f"arrays of shapes {shapes} do not broadcast together.") from error


def where(bad: NDArray[Any]) -> str:
    """Describe the first invalid element of an array for a message.

    Args:
        bad: boolean array, true where the value is invalid.

    Returns:
        " (element [i, j])", or "" for a single number.
    """
    if bad.ndim == 0:
        return ""
    index = ", ".join(str(i) for i in np.argwhere(bad)[0])
    return f" (element [{index}])"
