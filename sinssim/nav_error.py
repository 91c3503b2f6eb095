"""Errors of a navigation solution against the truth: position, velocity and attitude in true north, east, down."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin

import numpy as np

from sinssim.data import Array, NavSolution, NavState
from sinssim.earth import WGS84, EarthParameters, Ellipsoid, geodetic_to_ecef_k, parameters
from sinssim.errors import InputError
from sinssim.jit import strict_kernel
from sinssim.rotation import multiply_k, rotation_vector_from_quaternion_k


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
    position, velocity, attitude = np.empty((3, len(solution.time), 3))
    _error_rows(parameters(ellipsoid), _rows(truth), _rows(solution), position, velocity, attitude)
    return NavError(solution.time, position, velocity, attitude)


def _rows(state: NavState | NavSolution) -> tuple[Array, Array, Array, Array, Array]:
    """Return latitude, longitude, height, velocity and quaternion as a kernel reads them."""
    fields = (state.latitude, state.longitude, state.height, state.velocity_ned, state.q_nb)
    latitude, longitude, height, velocity, q_nb = (np.ascontiguousarray(field) for field in fields)
    return latitude, longitude, height, velocity, q_nb


@strict_kernel
def _error_rows(
    p: EarthParameters,
    truth: tuple[Array, Array, Array, Array, Array],
    solution: tuple[Array, Array, Array, Array, Array],
    position: Array,
    velocity: Array,
    attitude: Array,
) -> None:
    """Fill in the errors."""
    latitude, longitude, height, velocity_ned, q_nb = truth
    latitude1, longitude1, height1, velocity1_ned, q1_nb = solution
    for i in range(latitude.shape[0]):
        x, y, z = geodetic_to_ecef_k(p, latitude[i], longitude[i], height[i])
        x1, y1, z1 = geodetic_to_ecef_k(p, latitude1[i], longitude1[i], height1[i])
        x, y, z = x1 - x, y1 - y, z1 - z
        sin_lat, cos_lat = sin(latitude[i]), cos(latitude[i])
        sin_lon, cos_lon = sin(longitude[i]), cos(longitude[i])
        position[i, 0] = cos_lat * z - sin_lat * (cos_lon * x + sin_lon * y)
        position[i, 1] = cos_lon * y - sin_lon * x
        position[i, 2] = height[i] - height1[i]
        for axis in range(3):
            velocity[i, axis] = velocity1_ned[i, axis] - velocity_ned[i, axis]
        a, b = q_nb[i], q1_nb[i]
        q0, q1, q2, q3 = multiply_k(a[0], a[1], a[2], a[3], b[0], -b[1], -b[2], -b[3])
        attitude[i] = rotation_vector_from_quaternion_k(q0, q1, q2, q3)


def _norm(rows: Array) -> Array:
    """Euclidean norm of each row, (N,)."""
    norm: Array = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norm
