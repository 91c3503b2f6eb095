"""An engine in segments, between which a filter can correct state and increments.

A segment is navigated as a part of the whole: the fit of rate and specific force uses the samples on both sides of its
ends and has the same order there as elsewhere. Segments begin and end at the engine's rows: at any sample, or with
rates or an algorithm of several samples at the slow instants or the ends of updates.
"""

from __future__ import annotations

import numpy as np

from sinssim.algorithms import ALGORITHMS, REGISTRY, schedule, three_rates
from sinssim.checks import checked_increments, checked_initial
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.gravity import gravity_number
from sinssim.earth.harmonics.field import DisturbingField
from sinssim.earth.kernels import parameters
from sinssim.earth.models import ellipsoid_by_name
from sinssim.errors import InputError, check_name
from sinssim.frames import (
    CURVATURES,
    FRAME_REGISTRY,
    FRAMES,
    SLOW_QUANTITIES,
    check_correctable,
    check_three_rates,
)
from sinssim.own_content.registry import ensure
from sinssim.strapdown.disturbance import disturbance_of_segment
from sinssim.strapdown.files import frame_file, three_rate_file
from sinssim.strapdown.frames.problem import Problem, check_solution
from sinssim.strapdown.frames.vertical import FREE
from sinssim.strapdown.increments.fit import WINDOW, is_uniform, weight_table
from sinssim.strapdown.navigate import check_used, summed

_NO_REFERENCE = np.empty(0)


class Segments:
    """Pure inertial navigation with a free vertical channel over any segment of the data from any state.

    Args:
        imu: increments of the whole run.
        algorithm: an attitude algorithm that is a set of parts: all but functional-iteration.
        frame: navigation frame, one of `sinssim.FRAMES`.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid.
        curvature: radii of curvature, one of `sinssim.frames.CURVATURES`.
        rates_hz: rates of the fast, medium and slow part, Hz, as for `navigate`.
        slow_quantities: treatment of slow quantities between slow instants, one of `SLOW_QUANTITIES`. At the start of a
            segment they have no earlier value and are held for one slow interval.
        route: for the transverse frame, latitude and longitude of A and of B, rad; without it the frame follows the
            great circle along the velocity at the start of each segment.
        field: the disturbing field that the navigator knows beside normal gravity; None for none.

    Attributes:
        time: times of the rows at which segments may begin and end, (N+1,) s.

    Raises:
        InputError: the data cannot be used, a name is unknown, an option would have no effect, or the algorithm
            navigates by windows.
    """

    # Long: every option is checked by name, and the rows follow from algorithm and rates.
    def __init__(
        self,
        imu: ImuData,
        *,
        algorithm: str = "quaternion",
        frame: str = "level",
        gravity: str = "normal",
        ellipsoid: str = "wgs84",
        curvature: str = "exact",
        rates_hz: tuple[float, ...] | None = None,
        slow_quantities: str = "hold",
        route: tuple[float, float, float, float] | None = None,
        field: DisturbingField | None = None,
    ) -> None:
        ensure("algorithms", algorithm)
        ensure("frames", frame)
        for kind, name, known in (
            ("algorithm", algorithm, ALGORITHMS),
            ("frame", frame, FRAMES),
            ("curvature", curvature, CURVATURES),
            ("treatment of slow quantities", slow_quantities, SLOW_QUANTITIES),
        ):
            check_name(kind, name, known)
        check_used(frame, curvature, rates_hz, slow_quantities, route)
        check_correctable(algorithm)
        self._time, self._dtheta, self._dvel = checked_increments(imu)
        self._algorithm, self._frame, self._route = algorithm, frame, route
        self._gravity, self._curvature = gravity_number(gravity), curvature
        self._ellipsoid, self._field = ellipsoid_by_name(ellipsoid), field
        self._earth = parameters(self._ellipsoid)
        self._uniform = is_uniform(self._time)
        entry = REGISTRY[algorithm]
        if entry.needs_equal_intervals and not self._uniform:
            raise InputError(f"{algorithm} needs equal sampling intervals, for which its coefficients hold.")
        self._rates: tuple[int, int, bool] | None = None
        self._per_row = entry.samples
        if rates_hz is not None:
            check_three_rates(algorithm, frame)
            if not self._uniform:
                raise InputError("rates_hz: the three-rate schedule needs equal sampling intervals.")
            count = len(self._dtheta)
            ratio, medium, slow = schedule(three_rates(rates_hz), count / float(self._time[-1] - self._time[0]))
            self._dtheta, self._dvel = summed(self._dtheta, ratio), summed(self._dvel, ratio)
            self._time = np.ascontiguousarray(self._time[: len(self._dtheta) * ratio + 1 : ratio])
            self._rates, self._per_row = (medium, slow, slow_quantities == "extrapolate"), medium * slow
        if len(self._dtheta) < self._per_row:
            raise InputError(f"the data, {len(imu)} samples, are shorter than one row of the solution.")
        self.time = np.ascontiguousarray(self._time[:: self._per_row])  # kernels are compiled for such arrays
        # samples around a segment that its fit uses; an algorithm of several samples uses its own alone
        across = self._rates is not None or (entry.samples == 1 and FRAME_REGISTRY[frame].starts_anywhere)
        self._around = WINDOW - 1 if across else 0
        self._weights = weight_table(self._time, self._uniform)

    def _start(self, first: int) -> int:
        """Return the number of the first sample that the segment from a row on depends on."""
        return max(first * self._per_row - self._around, 0)

    def samples(self, first: int, last: int) -> tuple[int, ImuData]:
        """Return the increments that a segment depends on: its own and those of neighbours in the fit.

        Args:
            first, last: numbers of the rows at its ends, `time[first]` … `time[last]`.

        Returns:
            Number of samples before the segment, and the samples (views of the data).
        """
        start, end = self._start(first), min(last * self._per_row + self._around, len(self._dtheta))
        samples = ImuData(self._time[start : end + 1], self._dtheta[start:end], self._dvel[start:end])
        return first * self._per_row - start, samples

    def navigate(self, first: int, last: int, state: NavState, samples: ImuData) -> NavSolution:
        """Navigate over one segment.

        Args:
            first, last: numbers of the rows at its ends.
            state: state at `time[first]`.
            samples: the samples of `samples(first, last)`, compensated.

        Returns:
            The solution at the rows first … last.

        Raises:
            InputError: the state is invalid.
            RunError: the frame cannot follow the flight (over a pole), or the numbers overflow.
        """
        if self._field is None:
            return self._navigate(first, last, state, samples)
        latitude, longitude, height = (np.atleast_1d(x) for x in (state.latitude, state.longitude, state.height))
        nominal = NavSolution(
            self.time[first : first + 1], latitude, longitude, height, np.atleast_2d(state.velocity_ned),
            np.atleast_2d(state.q_nb), np.zeros(1), self._algorithm,
        )  # fmt: skip
        for _ in range(2):  # the path from the disturbance at the start, and the disturbance along this path
            felt = disturbance_of_segment(self._field, self._ellipsoid, samples, nominal)
            nominal = self._navigate(first, last, state, ImuData(samples.time, samples.dtheta, samples.dvel + felt))
        return nominal

    def _navigate(self, first: int, last: int, state: NavState, samples: ImuData) -> NavSolution:
        """Navigate over one segment with normal gravity; see `navigate`."""
        start, rows = self._start(first), last - first + 1
        latitude, longitude, height, defect = (np.empty(rows) for _ in range(4))
        velocity, q_nb = np.empty((rows, 3)), np.empty((rows, 4))
        latitude[0], longitude[0], height[0], velocity[0], q_nb[0] = checked_initial(state)
        time = self.time[first : last + 1]
        dtheta, dvel = np.ascontiguousarray(samples.dtheta), np.ascontiguousarray(samples.dvel)
        entry = FRAME_REGISTRY[self._frame]
        problem = Problem(
            self._algorithm, time, dtheta, dvel, self._weights_of(start, len(dtheta)), self._uniform, self._earth,
            self._gravity, self._curvature, FREE, _NO_REFERENCE, _NO_REFERENCE, 1.0, self._route, latitude, longitude,
            height, velocity, q_nb, defect, np.zeros(rows if entry.has_azimuth else 0),
            first * self._per_row - start,
        )  # fmt: skip
        file = frame_file(self._frame)
        if self._rates is not None:
            three_rate_file(self._frame).solve(problem, self._frame, *self._rates)
        else:
            file.solve(problem, self._frame)
        file.check(problem, self._frame)
        check_solution(problem)
        return NavSolution(time, latitude, longitude, height, velocity, q_nb, defect, self._algorithm)

    def _weights_of(self, start: int, count: int) -> Array:
        """Return the weights of the fits within some samples."""
        if self._around:
            return self._weights if self._uniform else self._weights[start : start + count]
        if self._uniform and count >= WINDOW:
            return self._weights
        return weight_table(self._time[start : start + count + 1], self._uniform)
