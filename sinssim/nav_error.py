"""Errors of a navigation solution against the truth: position, velocity and attitude in true north, east, down."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth import WGS84, Ellipsoid, geodetic_to_ecef
from sinssim.errors import InputError


@dataclass(frozen=True)
class NavError:
    """What a navigation solution got wrong, row by row, in the local level of the true position.

    Attributes:
        time: (N,) s.
        position_ned: solution minus truth, (N, 3) m; down is exactly minus the difference of the heights.
        velocity_ned: solution minus truth, each in its own local level, (N, 3) m/s.
        attitude: rotation vector φ of the error equations, q_true = q(φ) ⊗ q_solution, so that to first order
            C_solution = (I − [φ×]) C_true: φ_north and φ_east are the tilts, and for a level body −φ_down is the
            error of heading (solution minus truth); (N, 3) rad.
    """

    time: Array
    position_ned: Array
    velocity_ned: Array
    attitude: Array

    @cached_property
    def horizontal(self) -> Array:
        """Horizontal distance between solution and truth, (N,) m."""
        return np.hypot(self.position_ned[:, 0], self.position_ned[:, 1])

    @property
    def height(self) -> Array:
        """Height of the solution minus true height, (N,) m."""
        return -self.position_ned[:, 2]

    @cached_property
    def speed(self) -> Array:
        """Magnitude of the velocity error, (N,) m/s."""
        return _norm(self.velocity_ned)

    @cached_property
    def angle(self) -> Array:
        """Angle of the single rotation that takes the solution's attitude to the true one, (N,) rad."""
        return _norm(self.attitude)


def navigation_error(truth: NavState, solution: NavSolution, ellipsoid: Ellipsoid = WGS84) -> NavError:
    """Return the errors of a navigation solution.

    North and east come from the difference of the Earth-fixed positions, resolved at the true position: no wrap of
    longitude, no division by cos φ at a pole. Velocity and attitude are compared component by component, as the
    error equations have them; within kilometres of a pole, where north itself turns, so do they.

    Args:
        truth: true states at the solution's times, arrays of N rows.
        solution: N rows.
        ellipsoid: reference ellipsoid of both heights.

    Returns:
        The errors, N rows.

    Raises:
        InputError: truth and solution have different numbers of rows.
    """
    if truth.latitude.shape != solution.latitude.shape:
        raise InputError(
            f"truth has {truth.latitude.shape} rows and the {solution.algorithm} solution {solution.latitude.shape}; "
            "errors need the true state at each of the solution's times."
        )
    difference = geodetic_to_ecef(solution.latitude, solution.longitude, solution.height, ellipsoid)
    difference -= geodetic_to_ecef(truth.latitude, truth.longitude, truth.height, ellipsoid)
    x, y, z = difference.T
    sin_lat, cos_lat = np.sin(truth.latitude), np.cos(truth.latitude)
    sin_lon, cos_lon = np.sin(truth.longitude), np.cos(truth.longitude)
    position = np.empty_like(difference)
    position[:, 0] = cos_lat * z - sin_lat * (cos_lon * x + sin_lon * y)
    position[:, 1] = cos_lon * y - sin_lon * x
    position[:, 2] = truth.height - solution.height
    return NavError(
        solution.time,
        position,
        solution.velocity_ned - truth.velocity_ned,
        rotation.rotation_vector_from_quaternion(
            rotation.multiply(truth.q_nb, rotation.conjugate(solution.q_nb)),
        ),
    )


def _norm(rows: Array) -> Array:
    """Euclidean norm of each row, (N,)."""
    norm: Array = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norm
