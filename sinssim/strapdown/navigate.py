"""Navigates by increments from an initial state: `navigate`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from sinssim.algorithms import ALGORITHMS, REGISTRY, schedule, three_rates
from sinssim.arguments import number
from sinssim.checks import checked_increments, checked_initial
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.gravity import gravity_number
from sinssim.earth.kernels import parameters
from sinssim.earth.models import ellipsoid_by_name
from sinssim.errors import InputError, check_name
from sinssim.frames import (
    BARO_TIME_CONSTANT,
    CURVATURES,
    FRAME_REGISTRY,
    FRAMES,
    SLOW_QUANTITIES,
    check_curvature,
    check_three_rates,
    frames_that,
    listed,
)
from sinssim.own_content.registry import ensure
from sinssim.strapdown.assemble import own_engine
from sinssim.strapdown.attitude.singularity import singularity_events
from sinssim.strapdown.files import frame_file, three_rate_file
from sinssim.strapdown.frames.problem import Problem, check_solution
from sinssim.strapdown.frames.vertical import NUMBERS, HeightReadings, checked_channel, height_reference
from sinssim.strapdown.increments.fit import is_uniform, weight_table


# Long: the public function checks every option by name before it chooses the engine.
def navigate(
    imu: ImuData,
    initial: NavState,
    *,
    algorithm: str = "quaternion",
    frame: str = "level",
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
    curvature: str = "exact",
    rates_hz: tuple[float, ...] | None = None,
    vertical: str = "free",
    height: ArrayLike | HeightReadings | None = None,
    baro_time_constant: float = BARO_TIME_CONSTANT,
    route: tuple[float, float, float, float] | None = None,
    slow_quantities: str = "hold",
    azimuth: float = 0.0,
) -> NavSolution:
    """Navigate by inertial increments from a given initial state.

    Rate and specific force are fitted over five neighbouring intervals, two of them after the current one, so the
    solution is for recorded (or delayed) data.

    Args:
        imu: increments, N intervals; equal or unequal ones.
        initial: state at imu.time[0], scalars.
        algorithm: attitude algorithm, one of `ALGORITHMS`.
        frame: navigation frame, one of `FRAMES`.
        gravity: one of `GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid, one of `ELLIPSOIDS`.
        curvature: radii of curvature, one of `sinssim.frames.CURVATURES`: "exact", "simplified" (8.16), or with e² or
            the height dropped.
        rates_hz: rates of the fast, medium and slow part, Hz; each divides the previous one, and the first divides
            the data's rate. Two rates are those of attitude, and of velocity and position. None computes everything at
            the data's rate, to a higher order. See `three_rate`.
        vertical: "free" (pure inertial), "baro-loop" (third order) or "truth" (height held to the reference).
        height: reference height above the ellipsoid at every imu.time, (N+1,) m, for the last two; for the loop also
            the measurements of an altimeter, which apply from their arrival on.
        baro_time_constant: time constant τ of the baro loop, s; k₁ = 3/τ, k₂ = 3/τ² + 2g/R, k₃ = 1/τ³.
        route: for the transverse frame, latitude and longitude of A and of B, rad: its equator is the great circle from
            A to B; None for the great circle along the initial velocity.
        slow_quantities: with rates_hz, treatment of slow quantities between slow updates, one of `SLOW_QUANTITIES`.
        azimuth: for the frames wander and free-azimuth, direction of their x axis at the start, clockwise from north,
            rad.

    Returns:
        The solution at every imu.time, N+1 rows, the first of which is the initial state. An algorithm that advances by
        n samples has a row at every n-th imu.time, and with rates_hz there is a row at every slow update; remaining
        samples at the end are not navigated.

    Raises:
        InputError: the data cannot be used (NaN, unordered times, wrong shapes), a name is unknown, or an option would
            have no effect, such as simplified radii in the inertial frame.
        RunError: the frame cannot follow the flight (over a pole, for the transverse frame over its route's pole), or
            the numbers overflow.
    """
    ensure("algorithms", algorithm)
    ensure("frames", frame)
    for kind, name, known in (
        ("algorithm", algorithm, ALGORITHMS),
        ("frame", frame, FRAMES),
        ("curvature", curvature, CURVATURES),
        ("treatment of slow quantities", slow_quantities, SLOW_QUANTITIES),
    ):
        check_name(kind, name, known)
    check_used(frame, curvature, rates_hz, slow_quantities, route, azimuth)
    baro_time_constant = checked_channel(vertical, height, baro_time_constant)
    earth = parameters(ellipsoid_by_name(ellipsoid))
    gravity_model = gravity_number(gravity)
    time, dtheta, dvel = checked_increments(imu)
    lat0, lon0, h0, v0, q0 = checked_initial(initial)
    reference, climb = height_reference(vertical, height, time)

    uniform = is_uniform(time)
    entry = REGISTRY[algorithm]
    if entry.needs_equal_intervals and not uniform:
        raise InputError(
            f"{algorithm} needs equal sampling intervals, for which its coefficients hold; those of the data range "
            f"from {np.min(np.diff(time)):.6g} s to {np.max(np.diff(time)):.6g} s."
        )
    per_row, per_medium, per_slow = entry.samples, 1, 1
    if rates_hz is not None:
        rates_hz = three_rates(rates_hz)
        check_three_rates(algorithm, frame)
        if not uniform:
            raise InputError("rates_hz: the three-rate schedule needs equal sampling intervals.")
        ratio, per_medium, per_slow = schedule(rates_hz, len(dtheta) / float(time[-1] - time[0]))
        dtheta, dvel = summed(dtheta, ratio), summed(dvel, ratio)
        edges = slice(0, len(dtheta) * ratio + 1, ratio)
        time, reference, climb = (np.ascontiguousarray(array[edges]) for array in (time, reference, climb))
        per_row = per_medium * per_slow
    if len(dtheta) < per_row:
        raise InputError(
            f"the data, {len(imu)} samples, are shorter than one update of {algorithm}"
            + (f", which takes {per_row}." if rates_hz is None else f" at the slow rate, {rates_hz[2]:g} Hz.")
        )
    weights, sample_time = weight_table(time, uniform), time
    if per_row > 1:
        edges = slice(0, len(dtheta) // per_row * per_row + 1, per_row)
        time, reference, climb = (np.ascontiguousarray(array[edges]) for array in (time, reference, climb))

    if isinstance(height, HeightReadings):  # no passage is lost between the rows
        reference = height.at(time)
    rows = len(time)
    # one block of memory, which the system provides in large pages; separate arrays would take a fifth more time
    has_azimuth = FRAME_REGISTRY[frame].has_azimuth
    room = np.empty((12 if has_azimuth else 11) * rows)
    latitude, longitude, height_out, defect = room[: 4 * rows].reshape(4, rows)
    velocity, q_nb = room[4 * rows : 7 * rows].reshape(rows, 3), room[7 * rows : 11 * rows].reshape(rows, 4)
    of_x = room[11 * rows :]
    of_x[:1] = azimuth
    latitude[0], longitude[0], height_out[0], velocity[0], q_nb[0] = lat0, lon0, h0, v0, q0
    problem = Problem(
        algorithm, time, dtheta, dvel, weights, uniform, earth, gravity_model, curvature,
        NUMBERS[vertical], reference, climb, baro_time_constant, route,
        latitude, longitude, height_out, velocity, q_nb, defect, of_x,
    )  # fmt: skip
    in_frame, own = frame_file(frame), own_engine(algorithm, frame)
    if rates_hz is not None:
        three_rate_file(frame).solve(problem, frame, per_medium, per_slow, slow_quantities == "extrapolate")
    elif own is not None:
        own(problem, frame)
    else:
        in_frame.solve(problem, frame)
    in_frame.check(problem, frame)
    check_solution(problem)
    solution = NavSolution(
        time, latitude, longitude, height_out, velocity, q_nb, defect, algorithm, azimuth=of_x if has_azimuth else None
    )
    if algorithm != "euler":
        return solution

    def without_singularity(first: int, last: int, state: NavState) -> NavSolution:
        start, end = first * per_row, last * per_row
        return navigate(
            ImuData(sample_time[start : end + 1], dtheta[start:end], dvel[start:end]),
            state,
            frame=frame,
            gravity=gravity,
            ellipsoid=ellipsoid,
            curvature=curvature,
            route=route,
        )

    return replace(solution, events=singularity_events(solution, without_singularity))


def summed(increments: Array, ratio: int) -> Array:
    """Return sums of consecutive increments.

    Args:
        increments: (N, 3).
        ratio: number of them in a sum.

    Returns:
        (N // ratio, 3); remaining samples at the end are dropped.
    """
    whole = len(increments) // ratio
    return np.ascontiguousarray(increments[: whole * ratio].reshape(whole, ratio, 3).sum(axis=1))


def check_used(
    frame: str,
    curvature: str,
    rates_hz: tuple[float, ...] | None,
    slow_quantities: str,
    route: tuple[float, float, float, float] | None,
    azimuth: float = 0.0,
) -> None:
    """Raise for an option that would have no effect with the others.

    Args:
        frame, curvature, rates_hz, slow_quantities, route, azimuth: as for `navigate`.

    Raises:
        InputError: an option has no effect; the message names it and its requirement.
    """
    if number("azimuth", azimuth, "rad") and not FRAME_REGISTRY[frame].takes_azimuth:
        able = listed(frames_that(lambda entry: entry.takes_azimuth))
        raise InputError(f'azimuth would have no effect: it is for the frames {able}; here frame = "{frame}".')
    check_curvature(frame, curvature)
    if route is not None and not FRAME_REGISTRY[frame].takes_route:
        able = listed(frames_that(lambda entry: entry.takes_route))
        raise InputError(f'route would have no effect: it is for frame = "{able}"; here frame = "{frame}".')
    if slow_quantities != "hold" and rates_hz is None:
        raise InputError(
            f'slow_quantities = "{slow_quantities}" would have no effect: it belongs to a schedule, and rates_hz is '
            "not given."
        )
