"""Axes for errors near a pole, where north-east-down turns without bound.

An error of navigation compares velocity and attitude at two places, that of the solution and the true one. Each has its
own north. Between places one metre apart the two norths differ by tan φ/R, 1.6e-7 rad/m at 45° and 1/d at the distance
d from a pole, where the difference says nothing about the navigation. There the true values are carried to the
solution's place along the great circle instead, without a turn about the vertical (parallel transport), and compared in
the solution's north, east, down. Nothing in such an error is singular; its components are along north and east of the
solution's place, as long as that is not the pole itself, where they are along those of its longitude.

The great circle between two places has the azimuths α₀ and α₁ at its ends. A vector that is carried along it turns
relative to north by ψ = α₁ − α₀ (Napier's analogies for the triangle with the pole):

    tan ψ/2 = sin ½(φ₀+φ₁) sin ½Δλ / (cos ½(φ₁−φ₀) cos ½Δλ)                                                          (1)
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from sinssim import rotation
from sinssim.data import Array, NavState
from sinssim.frames import FRAME_REGISTRY

POLAR_LIMIT = math.radians(89.9)
"""Latitude beyond which a frame that points north turns too fast, and a reading relative to north has no meaning."""

POLAR_REGION = math.radians(89.0)
"""Latitude beyond which a run's errors are compared in transported axes: 1 m turns north by 1.9″ there."""


def axes_of(frame: str, *latitudes: ArrayLike) -> str:
    """Return the axes in which the errors of a run are compared.

    Args:
        frame: navigation frame, one of `sinssim.FRAMES`.
        *latitudes: latitudes that the run reaches, (...) rad.

    Returns:
        "transported" for a frame that passes the poles and a run that enters a polar region, else "north".
    """
    polar = any(np.any(np.abs(latitude) > POLAR_REGION) for latitude in latitudes)
    return "transported" if polar and FRAME_REGISTRY[frame].passes_poles else "north"


def axes_along(frame: str, state: Callable[[Array], NavState], start: float, end: float) -> str:
    """Return the axes in which the errors of a run along a known motion are compared: as `axes_of`.

    Args:
        frame: navigation frame, one of `sinssim.FRAMES`.
        state: the motion, a function of times, (N,) s.
        start, end: its ends, s; it is looked at once a second.
    """
    if not FRAME_REGISTRY[frame].passes_poles:
        return "north"
    return axes_of(frame, state(np.append(np.arange(start, end), end)).latitude)


def turn_of_north(latitude0: Array, longitude0: Array, latitude1: Array, longitude1: Array) -> Array:
    """Return the turn, relative to north, of a vector that is carried from one place to another.

    Args:
        latitude0, longitude0: of the first place, (N,) rad.
        latitude1, longitude1: of the second place, (N,) rad.

    Returns:
        ψ, clockwise from north, (N,) rad; equation (1).
    """
    half = 0.5 * (longitude1 - longitude0)
    across = np.sin(0.5 * (latitude0 + latitude1)) * np.sin(half)
    return np.asarray(2.0 * np.arctan2(across, np.cos(0.5 * (latitude1 - latitude0)) * np.cos(half)))


def turned(vector: Array, psi: Array) -> Array:
    """Return vectors turned about the vertical: (N, 3).

    Args:
        vector: north, east, down, (N, 3).
        psi: angle, clockwise from north, (N,) rad.
    """
    c, s = np.cos(psi), np.sin(psi)
    north, east, down = vector.T
    return np.stack([c * north - s * east, s * north + c * east, down], axis=1)


def turned_attitude(q_nb: Array, psi: Array) -> Array:
    """Return attitudes turned about the vertical: (N, 4).

    Args:
        q_nb: (N, 4).
        psi: angle, clockwise from north, (N,) rad.
    """
    none = np.zeros_like(psi)
    return rotation.multiply(np.stack([np.cos(0.5 * psi), none, none, np.sin(0.5 * psi)], axis=1), q_nb)


def carried(state: NavState, latitude: Array, longitude: Array, height: Array) -> NavState:
    """Return states at other places, with velocity and attitude carried there: N rows.

    Args:
        state: N rows.
        latitude, longitude, height: the places, (N,) rad and m.
    """
    psi = turn_of_north(state.latitude, state.longitude, latitude, longitude)
    return NavState(latitude, longitude, height, turned(state.velocity_ned, psi), turned_attitude(state.q_nb, psi))
