"""The level engine in segments, between which a filter can correct state and increments.

A segment is navigated as a part of the whole: the fit of rate and specific force uses the samples on both sides of its
ends and has the same order there as elsewhere.
"""

from __future__ import annotations

import numpy as np

from sinssim.algorithms import ALGORITHMS, REGISTRY
from sinssim.checks import checked_increments, checked_initial
from sinssim.data import ImuData, NavSolution, NavState
from sinssim.earth.gravity import gravity_number
from sinssim.earth.kernels import parameters
from sinssim.earth.models import ellipsoid_by_name
from sinssim.errors import InputError, check_name
from sinssim.strapdown.frames import level
from sinssim.strapdown.frames.problem import Problem, check_solution
from sinssim.strapdown.frames.vertical import FREE
from sinssim.strapdown.increments.fit import WINDOW, is_uniform, weight_table

_NO_REFERENCE = np.empty(0)


class Segments:
    """Pure inertial navigation with a free vertical channel over any segment of the data from any state.

    Args:
        imu: increments of the whole run.
        algorithm: an attitude algorithm that advances sample by sample.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid.

    Raises:
        InputError: the data cannot be used, a name is unknown, or the algorithm takes several samples per update.
    """

    def __init__(
        self, imu: ImuData, *, algorithm: str = "quaternion", gravity: str = "normal", ellipsoid: str = "wgs84"
    ) -> None:
        check_name("algorithm", algorithm, ALGORITHMS)
        if not REGISTRY[algorithm].sample_by_sample:
            raise InputError(
                f"{algorithm} advances by several samples at once and cannot be corrected in between; use quaternion, "
                "poisson, euler or one of their variants, or rotation-vector-1p."
            )
        self._time, self._dtheta, self._dvel = checked_increments(imu)
        self._algorithm = algorithm
        self._gravity = gravity_number(gravity)
        self._earth = parameters(ellipsoid_by_name(ellipsoid))
        self._uniform = is_uniform(self._time)
        if REGISTRY[algorithm].needs_equal_intervals and not self._uniform:
            raise InputError(f"{algorithm} needs equal sampling intervals, for which its coefficients hold.")
        self._weights = weight_table(self._time, self._uniform)

    def samples(self, first: int, last: int) -> tuple[int, ImuData]:
        """Return the increments that a segment depends on: its own and those of neighbours in the fit.

        Args:
            first, last: numbers of the edges of the segment, `imu.time[first]` … `imu.time[last]`.

        Returns:
            Number of samples before the segment, and the samples (views of the data).
        """
        start, end = max(first - WINDOW + 1, 0), min(last + WINDOW - 1, len(self._dtheta))
        return first - start, ImuData(self._time[start : end + 1], self._dtheta[start:end], self._dvel[start:end])

    def navigate(self, first: int, last: int, state: NavState, samples: ImuData) -> NavSolution:
        """Navigate over one segment.

        Args:
            first, last: numbers of its edges.
            state: state at `imu.time[first]`.
            samples: the samples of `samples(first, last)`, compensated.

        Returns:
            The solution at the edges first … last.

        Raises:
            InputError: the state is invalid.
            RunError: the frame cannot follow the flight (over a pole), or the numbers overflow.
        """
        start = max(first - WINDOW + 1, 0)
        rows = last - first + 1
        latitude, longitude, height, defect = (np.empty(rows) for _ in range(4))
        velocity, q_nb = np.empty((rows, 3)), np.empty((rows, 4))
        latitude[0], longitude[0], height[0], velocity[0], q_nb[0] = checked_initial(state)
        time = self._time[first : last + 1]
        dtheta, dvel = np.ascontiguousarray(samples.dtheta), np.ascontiguousarray(samples.dvel)
        weights = self._weights if self._uniform else self._weights[start : start + len(dtheta)]
        problem = Problem(
            self._algorithm, time, dtheta, dvel, weights, self._uniform, self._earth, self._gravity, "exact",
            FREE, _NO_REFERENCE, _NO_REFERENCE, 1.0, None, latitude, longitude, height, velocity, q_nb, defect,
            np.empty(0), first - start,
        )  # fmt: skip
        level.solve(problem, "level")
        level.check(problem, "level", "A filter navigates only in this frame.")
        check_solution(problem)
        return NavSolution(time, latitude, longitude, height, velocity, q_nb, defect, self._algorithm)
