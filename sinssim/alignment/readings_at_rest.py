"""Readings of perfect instruments on a parked vehicle: Earth rate and the reaction to gravity, eqs. (3) and (4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.alignment.axes import Attitude, body_axes, checked_angles, paper_axes, where
from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.earth.models import OMEGA_IE
from sinssim.errors import InputError


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
    """Return g: the given value, or normal gravity on the ellipsoid.

    Args:
        latitude: (...) rad.
        gravity: (...) m/s², or None.

    Returns:
        (...) m/s².

    Raises:
        InputError: a given value is not a positive number.
    """
    if gravity is None:
        from sinssim.earth.gravity import surface_gravity

        return np.asarray(surface_gravity(latitude), dtype=np.float64)
    g = numbers("gravity", gravity)
    if not np.all(g > 0.0):
        raise InputError(f"gravity must be a positive number of m/s²{where(~(g > 0.0))}.")
    return g
