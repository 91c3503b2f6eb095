"""Navigates by increments from an initial state: `navigate`."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from sinssim.algorithms import ALGORITHMS
from sinssim.checks import checked_initial
from sinssim.data import ImuData, NavSolution, NavState
from sinssim.earth.gravity import gravity_number
from sinssim.earth.kernels import parameters
from sinssim.errors import check_name
from sinssim.strapdown.assemble import own_engine
from sinssim.strapdown.attitude.singularity import singularity_events
from sinssim.strapdown.files import frame_file, three_rate_file
from sinssim.strapdown.frames.problem import Problem, check_solution
from sinssim.strapdown.frames.vertical import HeightReadings, height_reference
from sinssim.strapdown.mechanization import Mechanization, Options, chosen
from sinssim.strapdown.updates import updates


def navigate(
    imu: ImuData,
    initial: NavState,
    mechanization: Mechanization | None = None,
    *,
    height: ArrayLike | HeightReadings | None = None,
    **options: Unpack[Options],
) -> NavSolution:
    """Navigate by inertial increments from a given initial state.

    Rate and specific force are fitted over five neighbouring intervals, two of them after the current one, so the
    solution is for recorded (or delayed) data.

    Args:
        imu: increments, N intervals; equal or unequal ones.
        initial: state at imu.time[0], scalars.
        mechanization: algorithm, frame, models, rates and vertical channel.
        height: reference height above the ellipsoid at every imu.time, (N+1,) m, for the vertical channels "baro-loop"
            and "truth"; for the loop also the measurements of an altimeter, which apply from their arrival on.
        **options: fields of `Mechanization` by name instead, such as algorithm="euler", frame="wander".

    Returns:
        The solution at every imu.time, N+1 rows, the first of which is the initial state. An algorithm that advances by
        n samples has a row at every n-th imu.time, and with rates_hz there is a row at every slow update; remaining
        samples at the end are not navigated.

    Raises:
        InputError: the data cannot be used (NaN, unordered times, wrong shapes), or as for `Mechanization`.
        RunError: the frame cannot follow the flight (over a pole, for the transverse frame over its route's pole), or
            the numbers overflow.
    """
    of = chosen(mechanization, options)
    check_name("algorithm", of.algorithm, ALGORITHMS)
    at_start = checked_initial(initial)
    data = updates(imu, of)
    reference, climb = map(data.at_rows, height_reference(of.vertical, height, data.sample_time))
    time = data.at_rows(data.sample_time)
    if isinstance(height, HeightReadings):  # no passage is lost between the rows
        reference = height.at(time)
    rows = len(time)
    # one block of memory, which the system provides in large pages; separate arrays would take a fifth more time
    has_azimuth = of.in_frame.has_azimuth
    room = np.empty((12 if has_azimuth else 11) * rows)
    latitude, longitude, height_out, defect = room[: 4 * rows].reshape(4, rows)
    velocity, q_nb = room[4 * rows : 7 * rows].reshape(rows, 3), room[7 * rows : 11 * rows].reshape(rows, 4)
    of_x = room[11 * rows :]
    of_x[:1] = of.azimuth
    latitude[0], longitude[0], height_out[0], velocity[0], q_nb[0] = at_start
    problem = Problem(
        of, time, data.dtheta, data.dvel, data.weights, data.uniform, parameters(of.earth), gravity_number(of.gravity),
        reference, climb, latitude, longitude, height_out, velocity, q_nb, defect, of_x,
    )  # fmt: skip
    solve_problem(problem, data.rates)
    solution = NavSolution(
        time, latitude, longitude, height_out, velocity, q_nb, defect, of.algorithm,
        azimuth=of_x if has_azimuth else None,
    )  # fmt: skip
    if of.algorithm != "euler":
        return solution
    quaternion = Mechanization(
        frame=of.frame, gravity=of.gravity, ellipsoid=of.ellipsoid, curvature=of.curvature, route=of.route
    )

    def without_singularity(first: int, last: int, state: NavState) -> NavSolution:
        start, end = first * data.per_row, last * data.per_row
        around = ImuData(data.time[start : end + 1], data.dtheta[start:end], data.dvel[start:end])
        return navigate(around, state, quaternion)

    return replace(solution, events=singularity_events(solution, without_singularity))


def solve_problem(problem: Problem, rates: tuple[int, int, bool] | None) -> None:
    """Fill the rows of a problem's solution by its engine, and check them.

    Args:
        problem: with the state at its start in the first rows.
        rates: those of `Updates`.

    Raises:
        InputError: an algorithm or a frame outside the package cannot be used.
        RunError: the frame cannot follow the flight, or the numbers overflow.
    """
    of = problem.mechanization
    file, own = frame_file(of.frame), own_engine(of.algorithm, of.frame)
    if rates is not None:
        three_rate_file(of.frame).solve(problem, of.frame, *rates)
    elif own is not None:
        own(problem, of.frame)
    else:
        file.solve(problem, of.frame)
    file.check(problem, of.frame)
    check_solution(problem)
