"""Radii of curvature, geodetic, Earth-fixed and inertial coordinates over arrays, and axes of other programs.

Other programs have axes east-north-up and forward-left-up or right-front-up, and positions in metres about an origin.
"""

from __future__ import annotations

import math
from math import atan2, cos, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from sinssim import rotation
from sinssim.arguments import as_columns, as_vectors, numbers
from sinssim.data import Array
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.earth.gravity import EarthParameters, geodetic_sincos_k, parameters
from sinssim.errors import InputError
from sinssim.jit import inline, kernel
from sinssim.rotation.quaternions import Quaternion, Vector


@inline
def radii_k(p: EarthParameters, sin_lat: float) -> tuple[float, float]:
    """Radii of curvature of the meridian, R₁, and of the prime vertical, R₂ (section 8.2 of the chapter)."""
    w = 1.0 / (1.0 - p.e2 * sin_lat * sin_lat)
    r2 = p.a * sqrt(w)
    return r2 * (1.0 - p.e2) * w, r2


@inline
def geodetic_to_ecef_k(p: EarthParameters, latitude: float, longitude: float, height: float) -> Vector:
    """Earth-centred Earth-fixed coordinates."""
    s, c = sin(latitude), cos(latitude)
    r2 = p.a / sqrt(1.0 - p.e2 * s * s)
    rho = (r2 + height) * c
    return rho * cos(longitude), rho * sin(longitude), (r2 * (1.0 - p.e2) + height) * s


@inline
def ecef_to_geodetic_k(p: EarthParameters, x: float, y: float, z: float) -> Vector:
    """Geodetic latitude, longitude and height."""
    s, c, height = geodetic_sincos_k(p, sqrt(x * x + y * y), z)
    return atan2(s, c), atan2(y, x), height


@inline
def q_en_k(latitude: float, longitude: float) -> Quaternion:
    """Quaternion from north-east-down to Earth-fixed coordinates: v_e = C_en v_n."""
    # rotation about z by the longitude, then about y by −(90° + latitude)
    half_lon = 0.5 * longitude
    half_lat = -0.5 * latitude - 0.7853981633974483
    cl, sl = cos(half_lon), sin(half_lon)
    cp, sp = cos(half_lat), sin(half_lat)
    return cl * cp, -sl * sp, cl * sp, sl * cp


@kernel
def _radii_rows(p: EarthParameters, latitude: Array, r1: Array, r2: Array) -> None:
    for i in range(latitude.shape[0]):
        r1[i], r2[i] = radii_k(p, sin(latitude[i]))


@kernel
def _to_ecef_rows(p: EarthParameters, latitude: Array, longitude: Array, height: Array, out: Array) -> None:
    for i in range(latitude.shape[0]):
        out[i] = geodetic_to_ecef_k(p, latitude[i], longitude[i], height[i])


@kernel
def _to_geodetic_rows(p: EarthParameters, r: Array, latitude: Array, longitude: Array, height: Array) -> None:
    for i in range(latitude.shape[0]):
        latitude[i], longitude[i], height[i] = ecef_to_geodetic_k(p, r[i, 0], r[i, 1], r[i, 2])


@kernel
def _q_en_rows(latitude: Array, longitude: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = q_en_k(latitude[i], longitude[i])


def radii(latitude: ArrayLike, ellipsoid: Ellipsoid = WGS84) -> tuple[Array, Array]:
    """Return the radii of curvature.

    Args:
        latitude: geodetic latitude, (...) rad.
        ellipsoid: reference ellipsoid.

    Returns:
        Radius of the meridian R₁ and of the prime vertical R₂, (...) m.
    """
    shape, (lat,) = as_columns(latitude)
    r1, r2 = np.empty_like(lat), np.empty_like(lat)
    _radii_rows(parameters(ellipsoid), lat, r1, r2)
    return r1.reshape(shape), r2.reshape(shape)


def geodetic_to_ecef(
    latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike, ellipsoid: Ellipsoid = WGS84
) -> Array:
    """Return Earth-centred Earth-fixed coordinates.

    Args:
        latitude, longitude: geodetic, (...) rad.
        height: above the ellipsoid, (...) m.
        ellipsoid: reference ellipsoid.

    Returns:
        Positions, (..., 3) m.
    """
    shape, (lat, lon, h) = as_columns(latitude, longitude, height)
    out = np.empty((len(lat), 3))
    _to_ecef_rows(parameters(ellipsoid), lat, lon, h, out)
    return out.reshape(*shape, 3)


def ecef_to_geodetic(r: ArrayLike, ellipsoid: Ellipsoid = WGS84) -> tuple[Array, Array, Array]:
    """Return geodetic coordinates of Earth-fixed positions, exact to rounding (Bowring 1976).

    Args:
        r: positions, (..., 3) m, further than 1000 km from the Earth's centre.
        ellipsoid: reference ellipsoid.

    Returns:
        Latitude in [−π/2, π/2] and longitude in (−π, π], (...) rad; height, (...) m.

    Raises:
        InputError: a position is too near to the Earth's centre, where geodetic latitude has no meaning.
    """
    shape, rows = as_vectors(r)
    if len(rows) and not (np.min(np.einsum("ij,ij->i", rows, rows)) > 1e12):
        row = int(np.argmin(np.einsum("ij,ij->i", rows, rows)))
        raise InputError(
            f"position {rows[row]} m (row {row}) lies within 1000 km of the Earth's centre or is not a number, so that "
            "it has no geodetic latitude. Earth-fixed coordinates in metres are expected."
        )
    latitude, longitude, height = (np.empty(len(rows)) for _ in range(3))
    _to_geodetic_rows(parameters(ellipsoid), rows, latitude, longitude, height)
    return latitude.reshape(shape), longitude.reshape(shape), height.reshape(shape)


def q_en(latitude: ArrayLike, longitude: ArrayLike) -> Array:
    """Return the quaternion from north-east-down to Earth-fixed coordinates.

    Args:
        latitude, longitude: geodetic, (...) rad.

    Returns:
        Unit quaternions, (..., 4).
    """
    shape, (lat, lon) = as_columns(latitude, longitude)
    out = np.empty((len(lat), 4))
    _q_en_rows(lat, lon, out)
    return out.reshape(*shape, 4)


def displaced(
    latitude: Array, longitude: Array, height: Array, north: Array, east: Array, ellipsoid: Ellipsoid = WGS84
) -> tuple[Array, Array]:
    """Return latitude and longitude after small displacements in the local level, also at and across a pole.

    Args:
        latitude, longitude, height: the places, (N,) rad and m.
        north, east: displacement in the tangent plane, (N,) m.
        ellipsoid: reference ellipsoid.

    Returns:
        Latitude and longitude of the places' normals there, (N,) rad each.
    """
    s, c = np.sin(longitude), np.cos(longitude)
    poleward, up = north * np.sin(latitude), north * np.cos(latitude)
    step = np.stack([-poleward * c - east * s, -poleward * s + east * c, up], axis=-1)
    return ecef_to_geodetic(geodetic_to_ecef(latitude, longitude, height, ellipsoid) + step, ellipsoid)[:2]


def _about_z(r: ArrayLike, angle: ArrayLike) -> Array:
    v, turn = numbers("the array of vectors", r), numbers("the time", angle)
    if v.shape[-1:] != (3,):
        raise InputError(f"expected vectors of 3 components in the last axis, got an array of shape {v.shape}.")
    c, s = np.cos(turn), np.sin(turn)
    return np.stack(
        np.broadcast_arrays(c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1], v[..., 2]), axis=-1
    )


def ecef_to_eci(r_e: ArrayLike, time: ArrayLike, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return Earth-fixed vectors in the inertial frame that coincides with the Earth-fixed one at t = 0.

    Args:
        r_e: vectors, (..., 3).
        time: (...) s; broadcasts.
        ellipsoid: reference ellipsoid, with its rate of rotation.

    Returns:
        Vectors, (..., 3).
    """
    return _about_z(r_e, ellipsoid.omega * np.asarray(time, dtype=np.float64))


def eci_to_ecef(r_i: ArrayLike, time: ArrayLike, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return inertial vectors in the Earth-fixed frame, which coincides with the inertial one at t = 0.

    Args:
        r_i: vectors, (..., 3).
        time: (...) s; broadcasts.
        ellipsoid: reference ellipsoid, with its rate of rotation.

    Returns:
        Vectors, (..., 3).
    """
    return _about_z(r_i, -ellipsoid.omega * np.asarray(time, dtype=np.float64))


_R = math.sqrt(0.5)
Q_ENU_NED = np.array([0.0, _R, _R, 0.0])
"""Takes vectors from north-east-down to east-north-up (half a turn about the middle of north and east)."""
Q_FRD_FLU = np.array([0.0, 1.0, 0.0, 0.0])
"""Takes vectors from forward-left-up to forward-right-down (half a turn about forward)."""


def swapped(v: Array) -> Array:
    """Return vectors, (N, 3), from north-east-down in east-north-up, from forward-right-down in right-front-up, or
    reverse: second component, first, minus third."""
    return np.column_stack((v[:, 1], v[:, 0], -v[:, 2]))


def flipped(v: Array) -> Array:
    """Return vectors, (N, 3), from forward-right-down in forward-left-up, or the reverse: the first component, minus
    the second, minus the third."""
    return np.asarray(v * np.array([1.0, -1.0, -1.0]))


def q_enu_flu(q_nb: Array) -> Array:
    """Return the attitude of ROS (REP 103), from forward-left-up to east-north-up, from q_nb, scalar first, (N, 4)
    each."""
    return rotation.multiply(rotation.multiply(Q_ENU_NED, q_nb), Q_FRD_FLU)


def q_nb_from_enu_flu(q: Array) -> Array:
    """Return q_nb from the attitude of ROS, scalar first, (N, 4) each; reverse of `q_enu_flu`."""
    return rotation.multiply(rotation.multiply(Q_ENU_NED, q), Q_FRD_FLU)


def _enu_axes(latitude: float, longitude: float) -> Array:
    """East, north and up at a place as rows, in Earth-fixed axes, (3, 3)."""
    s, c, sl, cl = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
    return np.array([[-sl, cl, 0.0], [-s * cl, -s * sl, c], [c * cl, c * sl, s]])


def enu_about(origin: tuple[float, float, float], latitude: Array, longitude: Array, height: Array) -> Array:
    """Return positions, (N,) rad and m, in the plane axes east, north, up at an origin, (N, 3) m, of given latitude,
    longitude, rad, and height, m."""
    difference = geodetic_to_ecef(latitude, longitude, height) - geodetic_to_ecef(*origin)
    return difference @ _enu_axes(*origin[:2]).T


def geodetic_about(origin: tuple[float, float, float], enu: Array) -> tuple[Array, Array, Array]:
    """Return latitude, longitude, (N,) rad each, and height, (N,) m, of positions in plane axes, (N, 3) m; reverse of
    `enu_about`."""
    return ecef_to_geodetic(enu @ _enu_axes(*origin[:2]) + geodetic_to_ecef(*origin))


def level_turn(origin: tuple[float, float, float], latitude: Array, longitude: Array) -> Array:
    """Return the rotation from the local level of each place, (N,) rad, to the plane axes of an origin: quaternions
    from east-north-up at the place to east-north-up at the origin, scalar first, (N, 4)."""
    q_en_here, q_en_origin = q_en(latitude, longitude), q_en(*origin[:2])
    ned = rotation.multiply(rotation.conjugate(q_en_origin), q_en_here)
    return rotation.multiply(rotation.multiply(Q_ENU_NED, ned), rotation.conjugate(Q_ENU_NED))
