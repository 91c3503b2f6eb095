"""An engine in segments, between which a filter can correct state and increments.

A segment is navigated as a part of the whole: the fit of rate and specific force uses the samples on both sides of its
ends and has the same order there as elsewhere. Segments begin and end at the engine's rows: at any sample, or with
rates or an algorithm of several samples at the slow instants or the ends of updates.
"""

from __future__ import annotations

from typing import Unpack

import numpy as np

from sinssim.algorithms import ALGORITHMS
from sinssim.checks import checked_initial
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.gravity import gravity_number
from sinssim.earth.harmonics.field import DisturbingField
from sinssim.earth.kernels import parameters
from sinssim.errors import InputError, check_name
from sinssim.frames import check_correctable
from sinssim.strapdown.disturbance import disturbance_of_segment
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.increments.fit import WINDOW, weight_table
from sinssim.strapdown.mechanization import Mechanization, Options, chosen
from sinssim.strapdown.navigate import solve_problem
from sinssim.strapdown.updates import updates

_NO_REFERENCE = np.empty(0)


class Segments:
    """Pure inertial navigation with a free vertical channel over any segment of the data from any state.

    Args:
        imu: increments of the whole run.
        mechanization: algorithm, frame, models and rates; the algorithm is a set of parts, any but
            functional-iteration. Slow quantities have no earlier value at the start of a segment and are held for one
            slow interval; without a route, the transverse frame follows the great circle along the velocity at the
            start of each segment.
        field: the disturbing field that the navigator knows beside normal gravity; None for none.

    Attributes:
        time: times of the rows at which segments may begin and end, (N+1,) s.

    Raises:
        InputError: the data cannot be used, a name is unknown, an option would have no effect, or the algorithm
            navigates by windows.
    """

    def __init__(
        self,
        imu: ImuData,
        mechanization: Mechanization | None = None,
        *,
        field: DisturbingField | None = None,
        **options: Unpack[Options],
    ) -> None:
        of = chosen(mechanization, options)
        check_name("algorithm", of.algorithm, ALGORITHMS)
        check_correctable(of.algorithm)
        if of.vertical != "free" or of.azimuth:
            raise InputError("segments have a free vertical channel, and begin with x to the north (azimuth = 0).")
        self._of, self._field, self._data = of, field, updates(imu, of)
        self._earth, self._gravity = parameters(of.earth), gravity_number(of.gravity)
        self.time = self._data.at_rows(self._data.sample_time)
        # samples around a segment that its fit uses; an algorithm of several samples uses its own alone
        across = self._data.rates is not None or (of.samples == 1 and of.in_frame.starts_anywhere)
        self._around = WINDOW - 1 if across else 0

    def _start(self, first: int) -> int:
        """Return the number of the first sample that the segment from a row on depends on."""
        return max(first * self._data.per_row - self._around, 0)

    def samples(self, first: int, last: int) -> tuple[int, ImuData]:
        """Return the increments that a segment depends on: its own and those of neighbours in the fit.

        Args:
            first, last: numbers of the rows at its ends, `time[first]` … `time[last]`.
        """
        data = self._data
        start, end = self._start(first), min(last * data.per_row + self._around, len(data.dtheta))
        samples = ImuData(data.time[start : end + 1], data.dtheta[start:end], data.dvel[start:end])
        return first * data.per_row - start, samples

    def navigate(self, first: int, last: int, state: NavState, samples: ImuData) -> NavSolution:
        """Navigate over one segment.

        Args:
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
            np.atleast_2d(state.q_nb), np.zeros(1), self._of.algorithm,
        )  # fmt: skip
        for _ in range(2):  # the path from the disturbance at the start, and the disturbance along this path
            felt = disturbance_of_segment(self._field, self._of.earth, samples, nominal)
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
        problem = Problem(
            self._of, time, dtheta, dvel, self._weights_of(start, len(dtheta)), self._data.uniform, self._earth,
            self._gravity, _NO_REFERENCE, _NO_REFERENCE, latitude, longitude, height, velocity, q_nb, defect,
            np.zeros(rows if self._of.in_frame.has_azimuth else 0), first * self._data.per_row - start,
        )  # fmt: skip
        solve_problem(problem, self._data.rates)
        return NavSolution(time, latitude, longitude, height, velocity, q_nb, defect, self._of.algorithm)

    def _weights_of(self, start: int, count: int) -> Array:
        """Return the weights of the fits within some samples."""
        data = self._data
        if self._around:
            return data.weights if data.uniform else data.weights[start : start + count]
        if data.uniform and count >= WINDOW:
            return data.weights
        return weight_table(data.time[start : start + count + 1], data.uniform)
