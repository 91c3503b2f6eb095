"""Axes of other programs: east-north-up and forward-left-up, right-front-up; positions in metres about an origin."""

from __future__ import annotations

import math

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import ecef_to_geodetic, geodetic_to_ecef

_R = math.sqrt(0.5)
Q_ENU_NED = np.array([0.0, _R, _R, 0.0])
"""Takes vectors from north-east-down to east-north-up (half a turn about the middle of north and east)."""
Q_FRD_FLU = np.array([0.0, 1.0, 0.0, 0.0])
"""Takes vectors from forward-left-up to forward-right-down (half a turn about forward)."""


def swapped(v: Array) -> Array:
    """Return vectors from north-east-down in east-north-up, from forward-right-down in right-front-up, or reverse.

    Args:
        v: (N, 3).

    Returns:
        (N, 3): second component, first, minus third.
    """
    return np.column_stack((v[:, 1], v[:, 0], -v[:, 2]))


def flipped(v: Array) -> Array:
    """Return vectors from forward-right-down in forward-left-up, or the reverse.

    Args:
        v: (N, 3).

    Returns:
        (N, 3): the first component, minus the second, minus the third.
    """
    return np.asarray(v * np.array([1.0, -1.0, -1.0]))


def q_enu_flu(q_nb: Array) -> Array:
    """Return the attitude of ROS (REP 103): from forward-left-up to east-north-up.

    Args:
        q_nb: from forward-right-down to north-east-down, scalar first, (N, 4).

    Returns:
        (N, 4), scalar first.
    """
    return rotation.multiply(rotation.multiply(Q_ENU_NED, q_nb), Q_FRD_FLU)


def q_nb_from_enu_flu(q: Array) -> Array:
    """Return the attitude from that of ROS; reverse of `q_enu_flu`.

    Args:
        q: from forward-left-up to east-north-up, scalar first, (N, 4).

    Returns:
        (N, 4), scalar first.
    """
    return rotation.multiply(rotation.multiply(Q_ENU_NED, q), Q_FRD_FLU)


def _enu_axes(latitude: float, longitude: float) -> Array:
    """East, north and up at a place as rows, in Earth-fixed axes, (3, 3)."""
    s, c, sl, cl = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
    return np.array([[-sl, cl, 0.0], [-s * cl, -s * sl, c], [c * cl, c * sl, s]])


def enu_about(origin: tuple[float, float, float], latitude: Array, longitude: Array, height: Array) -> Array:
    """Return positions in the plane axes east, north, up at an origin: (N, 3) m.

    Args:
        origin: latitude, longitude, rad, and height, m.
        latitude, longitude: (N,) rad.
        height: (N,) m.
    """
    difference = geodetic_to_ecef(latitude, longitude, height) - geodetic_to_ecef(*origin)
    return difference @ _enu_axes(*origin[:2]).T


def geodetic_about(origin: tuple[float, float, float], enu: Array) -> tuple[Array, Array, Array]:
    """Return the geodetic coordinates of positions in plane axes; reverse of `enu_about`.

    Args:
        origin: latitude, longitude, rad, and height, m.
        enu: east, north, up, (N, 3) m.

    Returns:
        Latitude, longitude, (N,) rad each, and height, (N,) m.
    """
    return ecef_to_geodetic(enu @ _enu_axes(*origin[:2]) + geodetic_to_ecef(*origin))


def level_turn(origin: tuple[float, float, float], latitude: Array, longitude: Array) -> Array:
    """Return the rotation from the local level of each place to the plane axes of an origin.

    Args:
        origin: latitude, longitude, rad, and height, m.
        latitude, longitude: (N,) rad.

    Returns:
        Quaternions from east-north-up at the place to east-north-up at the origin, scalar first, (N, 4).
    """
    from sinssim.earth.geodetic_coordinates import q_en

    q_en_here, q_en_origin = q_en(latitude, longitude), q_en(*origin[:2])
    ned = rotation.multiply(rotation.conjugate(q_en_origin), q_en_here)
    return rotation.multiply(rotation.multiply(Q_ENU_NED, ned), rotation.conjugate(Q_ENU_NED))
