"""Errors of a navigation solution against the truth: position, velocity and attitude in true north, east, down.

In numbers, an error is given at the end, as its root mean square and as its largest value.

Axes near a pole. North-east-down turns without bound there. An error of navigation compares velocity and attitude at
two places, that of the solution and the true one. Each has its own north. Between places one metre apart the two norths
differ by tan φ/R, 1.6e-7 rad/m at 45° and 1/d at the distance d from a pole, where the difference says nothing about
the navigation. There the true values are carried to the solution's place along the great circle instead, without a turn
about the vertical (parallel transport), and compared in the solution's north, east, down. Nothing in such an error is
singular; its components are along north and east of the solution's place, as long as that is not the pole itself, where
they are along those of its longitude.

The great circle between two places has the azimuths α₀ and α₁ at its ends. A vector that is carried along it turns
relative to north by ψ = α₁ − α₀ (Napier's analogies for the triangle with the pole):

    tan ψ/2 = sin ½(φ₀+φ₁) sin ½Δλ / (cos ½(φ₁−φ₀) cos ½Δλ)                                                          (1)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim import rotation, units
from sinssim.data import Array, NavSolution, NavState, blocks, short_repr
from sinssim.earth import geodetic_to_ecef
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError, RunError, check_name
from sinssim.jit import strict_kernel
from sinssim.rotation.quaternions import multiply_k, rotation_vector_from_quaternion_k
from sinssim.strapdown.frames import AXES, FRAME_REGISTRY


@short_repr
@dataclass(frozen=True)
class NavError:
    """Errors of a navigation solution, row by row, in the local level of the true position.

    In transported axes (`sinssim.strapdown.navigation_error`) north and east are those of the solution's position,
    and velocity and attitude are compared with the true values, transported to this position without a rotation about
    the vertical.

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

    def at(self, rows: slice) -> NavError:
        """Return the errors in some rows, views of the arrays."""
        return NavError(self.time[rows], self.position_ned[rows], self.velocity_ned[rows], self.attitude[rows])

    def rows(self, rows: NDArray[np.intp]) -> NavError:
        """Return the errors in some rows, copies."""
        return NavError(self.time[rows], self.position_ned[rows], self.velocity_ned[rows], self.attitude[rows])

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


def unknown_error(time: Array) -> NavError:
    """Return errors at times, (N,) s, that are all NaN."""
    return NavError(time, *(np.full((len(time), 3), np.nan) for _ in range(3)))


def navigation_error(
    truth: NavState, solution: NavSolution, ellipsoid: Ellipsoid = WGS84, axes: str = "north"
) -> NavError:
    """Return the errors of a navigation solution.

    North and east come from the difference of the Earth-fixed positions, resolved at the true position: no wrap of
    longitude, no division by cos φ at a pole. Velocity and attitude are compared component by component, as in the
    error equations; within kilometres of a pole, the components change with the direction of north, unless
    the axes are transported.

    Args:
        truth: true states at the solution's times, arrays of N rows.
        solution: N rows.
        ellipsoid: reference ellipsoid of both heights.
        axes: "north", or "transported" for motions near a pole; see `sinssim.strapdown.frames.AXES`.

    Returns:
        The errors, N rows.

    Raises:
        InputError: truth and solution have different numbers of rows, one of them has the wrong type, or the axes are
            unknown.
    """
    if not isinstance(solution, NavSolution):
        raise InputError(
            f"solution, the second argument of navigation_error, is a {type(solution).__name__}; it takes the true "
            "states, a NavState, first and the navigation solution, a NavSolution, second."
        )
    if not isinstance(truth, NavState):
        raise InputError(
            f"truth, the first argument of navigation_error, is a {type(truth).__name__}; it takes the true states, "
            "a NavState such as trajectory.state(solution.time), first and the solution, a NavSolution, second."
        )
    if truth.latitude.shape != solution.latitude.shape:
        raise InputError(
            f"truth has {truth.latitude.shape} rows and the {solution.algorithm} solution {solution.latitude.shape}; "
            "give the true state at each of the solution's times."
        )
    check_name("axes of errors", axes, AXES)
    error = NavError(solution.time, *(np.empty((len(solution.time), 3)) for _ in range(3)))
    for part in blocks(len(solution.time)):
        _fill(error, truth, solution, ellipsoid, part)
        if axes == "transported":
            _transport(error, truth, solution, part)
    return error


def _transport(error: NavError, truth: NavState, solution: NavSolution, part: slice) -> None:
    """Put a block of errors into the axes of the solution's place, with the true motion carried there."""
    here = truth.latitude[part], truth.longitude[part]
    psi = turn_of_north(*here, solution.latitude[part], solution.longitude[part])
    error.position_ned[part] = turned(error.position_ned[part], psi)
    error.velocity_ned[part] = solution.velocity_ned[part] - turned(truth.velocity_ned[part], psi)
    error.attitude[part] = rotation.rotation_vector_from_quaternion(
        rotation.multiply(turned_attitude(truth.q_nb[part], psi), rotation.conjugate(solution.q_nb[part])),
    )


def _fill(error: NavError, truth: NavState, solution: NavSolution, ellipsoid: Ellipsoid, part: slice) -> None:
    """Compute the errors of a block of rows."""
    latitude, longitude, height = truth.latitude[part], truth.longitude[part], truth.height[part]
    difference = geodetic_to_ecef(solution.latitude[part], solution.longitude[part], solution.height[part], ellipsoid)
    difference -= geodetic_to_ecef(latitude, longitude, height, ellipsoid)
    _place_errors(latitude, longitude, height, solution.height[part], difference, error.position_ned[part])
    np.subtract(solution.velocity_ned[part], truth.velocity_ned[part], out=error.velocity_ned[part])
    _attitude_errors(truth.q_nb[part], solution.q_nb[part], error.attitude[part])


@strict_kernel
def _place_errors(
    latitude: Array, longitude: Array, height: Array, solution_height: Array, xyz: Array, ned: Array
) -> None:
    """Resolve differences of Earth-fixed positions at the true positions; down is from the heights."""
    for k in range(len(latitude)):
        x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
        sin_lat, cos_lat = sin(latitude[k]), cos(latitude[k])
        sin_lon, cos_lon = sin(longitude[k]), cos(longitude[k])
        ned[k, 0] = cos_lat * z - sin_lat * (cos_lon * x + sin_lon * y)
        ned[k, 1] = cos_lon * y - sin_lon * x
        ned[k, 2] = height[k] - solution_height[k]


@strict_kernel
def _attitude_errors(true: Array, q_solution: Array, phi: Array) -> None:
    """Set the rotation vectors of q_true ⊗ q_solution*."""
    for k in range(len(phi)):
        t0, t1, t2, t3 = true[k, 0], true[k, 1], true[k, 2], true[k, 3]
        q = multiply_k(t0, t1, t2, t3, q_solution[k, 0], -q_solution[k, 1], -q_solution[k, 2], -q_solution[k, 3])
        phi[k, 0], phi[k, 1], phi[k, 2] = rotation_vector_from_quaternion_k(*q)


def _norm(rows: Array) -> Array:
    """Euclidean norm of each row, (N,)."""
    norm: Array = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norm


_QUANTITIES: dict[str, Callable[[NavError], Array]] = {
    "horizontal_error_m": lambda error: error.horizontal,
    "height_error_m": lambda error: error.height,
    "velocity_error_mps": lambda error: error.speed,
    "attitude_error_arcsec": lambda error: error.angle / units.ARCSEC,
}
NO_NUMBERS: dict[str, float] = {f"{kind}_{q}": math.nan for q in _QUANTITIES for kind in ("final", "rms", "max")}
"""The errors of an algorithm without a solution, in the form of `error_numbers`."""


def error_numbers(error: NavError) -> dict[str, float]:
    """Return `final_`, `rms_` and `max_` of the errors of one algorithm.

    They are those of `horizontal_error_m`, `height_error_m`, `velocity_error_mps` and `attitude_error_arcsec`. The
    final height error has a sign, positive if the solution is too high; all others are magnitudes.
    """
    return error_numbers_of(lambda: [error])


def error_numbers_of(blocks: Callable[[], Iterable[NavError]]) -> dict[str, float]:
    """Return `error_numbers` of errors that come block by block; only one quantity is in memory at a time."""
    numbers = {}
    for name, quantity in _QUANTITIES.items():
        values = np.concatenate([quantity(block) for block in blocks()])  # a copy
        numbers[f"final_{name}"] = float(values[-1])
        largest = float(np.abs(values, out=values).max())
        with np.errstate(over="ignore", invalid="ignore"):
            numbers[f"rms_{name}"] = float(np.sqrt(np.mean(np.multiply(values, values, out=values))))
        numbers[f"max_{name}"] = largest
    return numbers


def known_error_numbers_of(blocks: Callable[[], Iterable[NavError]]) -> dict[str, float]:
    """Return `error_numbers_of` over the rows where errors are known, not NaN; NaN for a quantity without any."""
    numbers = {}
    for name, quantity in _QUANTITIES.items():
        values = np.concatenate([quantity(block) for block in blocks()])
        values = values[np.isfinite(values)]
        numbers[f"final_{name}"] = float(values[-1]) if len(values) else math.nan
        numbers[f"rms_{name}"] = float(np.sqrt(np.mean(values * values))) if len(values) else math.nan
        numbers[f"max_{name}"] = float(np.abs(values).max()) if len(values) else math.nan
    return numbers


def diverged(errors: Mapping[str, NavError]) -> dict[str, RunError]:
    """Return an error, with message and instant, for each algorithm whose errors are not finite."""
    failures = {}
    for name, error in errors.items():
        if all(map(math.isfinite, error_numbers(error).values())):
            continue
        with np.errstate(over="ignore", invalid="ignore"):
            finite = np.isfinite(error.horizontal**2 + error.height**2 + error.speed**2 + error.angle**2)
        time = float(error.time[int(np.argmin(finite))])
        failures[name] = RunError(f"its errors are not finite from t = {time:.2f} s on: it diverged.", time=time)
    return failures


POLAR_LIMIT = math.radians(89.9)
"""Latitude beyond which a frame that points north turns too fast, and a reading relative to north has no meaning."""

POLAR_REGION = math.radians(89.0)
"""Latitude beyond which a run's errors are compared in transported axes: 1 m turns north by 1.9″ there."""


def axes_of(frame: str, *latitudes: ArrayLike) -> str:
    """Return the axes in which the errors of a run that reaches some latitudes, rad, are compared.

    They are "transported" for a frame that passes the poles and a run that enters a polar region, else "north".
    """
    polar = any(np.any(np.abs(latitude) > POLAR_REGION) for latitude in latitudes)
    return "transported" if polar and FRAME_REGISTRY[frame].passes_poles else "north"


def axes_along(frame: str, state: Callable[[Array], NavState], start: float, end: float) -> str:
    """Return `axes_of` a run along a known motion, a function of times, which is looked at once a second."""
    if not FRAME_REGISTRY[frame].passes_poles:
        return "north"
    return axes_of(frame, state(np.append(np.arange(start, end), end)).latitude)


def turn_of_north(latitude0: Array, longitude0: Array, latitude1: Array, longitude1: Array) -> Array:
    """Return ψ of (1), clockwise from north, (N,) rad: the turn of a vector carried from place to place."""
    half = 0.5 * (longitude1 - longitude0)
    across = np.sin(0.5 * (latitude0 + latitude1)) * np.sin(half)
    return np.asarray(2.0 * np.arctan2(across, np.cos(0.5 * (latitude1 - latitude0)) * np.cos(half)))


def turned(vector: Array, psi: Array) -> Array:
    """Return vectors, (N, 3), turned about the vertical by ψ, clockwise from north, (N,) rad."""
    c, s = np.cos(psi), np.sin(psi)
    north, east, down = vector.T
    return np.stack([c * north - s * east, s * north + c * east, down], axis=1)


def turned_attitude(q_nb: Array, psi: Array) -> Array:
    """Return attitudes q_nb, (N, 4), turned about the vertical by ψ, clockwise from north, (N,) rad."""
    none = np.zeros_like(psi)
    return rotation.multiply(np.stack([np.cos(0.5 * psi), none, none, np.sin(0.5 * psi)], axis=1), q_nb)


def carried(state: NavState, latitude: Array, longitude: Array, height: Array) -> NavState:
    """Return states at other places, (N,) rad and m, with velocity and attitude carried there."""
    psi = turn_of_north(state.latitude, state.longitude, latitude, longitude)
    return NavState(latitude, longitude, height, turned(state.velocity_ned, psi), turned_attitude(state.q_nb, psi))
