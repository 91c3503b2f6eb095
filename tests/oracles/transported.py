"""A state that is wrong by given errors in transported axes, by rotations of vectors in Earth-fixed axes.

The true velocity and attitude are carried by the smallest rotation that takes the true normal of the ellipsoid into the
solution's; nothing here knows of azimuths.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.oracles import integrator as oracle

Array = NDArray[np.float64]
Place = tuple[float, float, float]


def geodetic(position: Array, near: Place) -> Place:
    """Return latitude, longitude and height of a position, from the geocentric latitude on."""
    x, y, z = position
    rho, e2 = np.hypot(x, y), oracle.F * (2.0 - oracle.F)
    lat = np.arctan2(z, rho * (1.0 - e2))
    for _ in range(30):
        radius = oracle.A / np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
        lat = np.arctan2(z + e2 * radius * np.sin(lat), rho)
    lon = np.arctan2(y, x) if rho > 0.0 else near[1]
    radius = oracle.A / np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
    height = rho * np.cos(lat) + z * np.sin(lat) - oracle.A**2 / radius
    return float(lat), float(lon), float(height)


def smallest_rotation(first: Array, second: Array) -> Rotation:
    """Return the smallest rotation that takes one unit vector into another."""
    axis = np.cross(first, second)
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:
        return Rotation.identity()
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, first @ second))


def wrong_by(place: Place, velocity: Array, c_nb: Rotation, error: Array) -> tuple[Place, Array, Rotation]:
    """Return place, velocity and attitude of a solution with errors of position, velocity and attitude, (9,)."""
    axes = oracle.ned_axes(place[0], place[1])
    moved = oracle.geodetic_to_ecef(*place) + axes.T @ np.array([error[0], error[1], 0.0])
    lat, lon, _ = geodetic(moved, place)
    there = lat, lon, place[2] - error[2]
    own = oracle.ned_axes(lat, lon)
    carry = smallest_rotation(-axes[2], -own[2])
    level = Rotation.from_matrix(own) * carry * Rotation.from_matrix(axes.T)  # about the vertical alone
    attitude = level * Rotation.from_rotvec(-error[6:9]) * c_nb
    return there, level.apply(velocity + error[3:6]), attitude
