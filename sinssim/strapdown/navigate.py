"""Navigation by increments from an initial state: a whole run by `navigate`, or in segments that a filter corrects.

`updates` arranges the increments of a run in the updates of a mechanization: fast intervals, fits within them, rows of
the solution. A segment is navigated as a part of the whole: the fit of rate and specific force uses the samples on both
sides of its ends and has the same order there as elsewhere. Segments begin and end at the engine's rows: at any sample,
or with rates or an algorithm of several samples at the slow instants or the ends of updates. `singularity_events` finds
the passages of Euler angles through their singular attitude and the resulting attitude errors.

An engine computes with normal gravity. Navigation with a model of the field is the same engine on increments to which
the disturbance is added, ∫C_bn δg dt, with the attitude and at the position of the navigator itself. Position and
disturbance depend on each other, so the path is found by repetition: navigate, evaluate the disturbance along the
solution, add it to the increments, navigate again. A position error δr changes the disturbance by its gradient, some
1e-9 1/s² times δr, and this changes the position within a Schuler period by a thousandth of δr: every pass gains three
digits. No engine is changed, and without a model nothing is computed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import asin, cos, degrees, radians, sin
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim import earth, rotation
from sinssim.arguments import checked_increments, checked_initial
from sinssim.data import Array, ImuData, NavSolution, NavState, SingularityEvent
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.gravity_disturbance import DisturbingField, disturbance_along
from sinssim.errors import InputError, RunError, check_name
from sinssim.jit import kernel
from sinssim.rotation.quaternions import multiply_k, quaternion_from_rotation_vector_k, rotate_k
from sinssim.strapdown.attitude import ALGORITHMS, REGISTRY, schedule, three_rates
from sinssim.strapdown.coning_sculling import WINDOW, is_uniform, weight_table
from sinssim.strapdown.engine_assembly import frame_file, own_engine, three_rate_file
from sinssim.strapdown.frames import check_correctable
from sinssim.strapdown.frames.navigation_problem import Problem, check_solution
from sinssim.strapdown.frames.vertical_channel import HeightReadings, height_reference
from sinssim.strapdown.mechanization import Mechanization, Options, chosen

CLOSE = 1e-3
"""Change of the position from pass to pass at which the path is found, m."""
_PASSES = 20
_COMPARED = 4096
"""Largest number of rows whose positions are compared from pass to pass: the change is smooth."""
_LOWEST, _HIGHEST = -20e3, 1000e3
"""Heights between which the field is evaluated, m: that of a diverging height channel is no place."""
_KNOT = 2.0
"""Interval between knots within a segment, s."""


def navigate_in_field(
    imu: ImuData, field: DisturbingField, ellipsoid: Ellipsoid, navigate: Callable[[ImuData], NavSolution]
) -> NavSolution:
    """Navigate with the disturbance of gravity at the navigator's own position, on its ellipsoid."""
    solution = navigate(imu)
    compared = np.unique(np.linspace(0, len(solution.time) - 1, _COMPARED).astype(np.intp))
    before = _positions(solution, ellipsoid, compared)
    for _ in range(_PASSES):
        along = disturbance_along(field, _path(solution, ellipsoid), float(solution.time[0]), float(solution.time[-1]))
        felt = disturbance_in_body(imu, solution, along.panels, along.start, along.step, ellipsoid)
        solution = navigate(ImuData(imu.time, imu.dtheta, imu.dvel + felt))
        now = _positions(solution, ellipsoid, compared)
        moved = float(np.abs(now - before).max())
        if moved < CLOSE:
            return solution
        before = now
    raise RunError(
        f"navigation.gravity_degree: after {_PASSES} passes the position still changes by {moved:.3g} m between them; "
        "the errors of the sensors, or of a free height channel, are too large to compensate gravity: use vertical = "
        '"baro-loop", or no gravity_degree.'
    )


def disturbance_of_segment(
    field: DisturbingField, ellipsoid: Ellipsoid, samples: ImuData, nominal: NavSolution
) -> Array:
    """Return ∫C_bn δg dt over a segment's samples and their neighbours, (N, 3) m/s.

    `nominal` is a solution over the segment, of one row if only the start is known.
    """
    start, end = float(nominal.time[0]), float(nominal.time[-1])
    count = max(1, int(np.ceil((end - start) / _KNOT)))
    panels = np.zeros((count, 4, 3))
    if len(nominal.time) == 1:
        panels[0, 0] = field.potential_and_gradient(_positions(nominal, ellipsoid, np.zeros(1, np.intp)))[1][0]
        step = 1.0
    else:
        knots = np.linspace(start, end, count + 1)
        values = field.potential_and_gradient(_path(nominal, ellipsoid)(knots))[1]
        step = (end - start) / count
        panels[:, 0], panels[:, 1] = values[:-1], np.diff(values, axis=0) / step
    return disturbance_in_body(samples, nominal, panels, start, step, ellipsoid)


def disturbance_in_body(
    imu: ImuData, solution: NavSolution, panels: Array, start: float, step: float, ellipsoid: Ellipsoid
) -> Array:
    """Return ∫C_bn δg dt over N samples, (N, 3) m/s, with the attitude of a solution at some of their edges.

    `panels` are cubics of the disturbance in Earth-fixed axes, see `DisturbanceAlong`, from `start` in intervals of
    `step`, s. Between rows the attitude follows the rotation of the ellipsoid.
    """
    q_eb = rotation.multiply(earth.q_en(solution.latitude, solution.longitude), solution.q_nb)
    if np.array_equal(solution.time, imu.time):
        rows = np.arange(len(imu.time))
    else:
        rows = np.searchsorted(imu.time, solution.time - 1e-9)
    out = np.empty((len(imu.dtheta), 3))
    _felt_rows(
        np.ascontiguousarray(imu.time), np.ascontiguousarray(imu.dtheta), rows, q_eb, panels, start, step,
        ellipsoid.omega, out,
    )  # fmt: skip
    return out


def _positions(solution: NavSolution, ellipsoid: Ellipsoid, rows: NDArray[np.intp]) -> Array:
    """Return Earth-fixed positions in R of the rows, (R, 3) m."""
    height = np.clip(solution.height[rows], _LOWEST, _HIGHEST)
    return earth.geodetic_to_ecef(solution.latitude[rows], solution.longitude[rows], height, ellipsoid)


def _path(solution: NavSolution, ellipsoid: Ellipsoid) -> Callable[[Array], Array]:
    """Return positions on the straight lines between rows: at a row a second they miss an arc of 1 g by 1 m."""
    time = solution.time

    def at(t: Array) -> Array:
        row = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(time) - 2)
        share = ((t - time[row]) / (time[row + 1] - time[row]))[:, None]
        here, there = (_positions(solution, ellipsoid, index) for index in (row, row + 1))
        return np.asarray(here + share * (there - here))

    return at


@kernel
def _felt_rows(
    time: Array, dtheta: Array, rows: NDArray[np.intp], q_eb: Array, panels: Array, start: float, step: float,
    omega: float, out: Array,
) -> None:  # fmt: skip
    """Simpson's rule over each interval, from the attitude at the last row before it turned on by the gyros."""
    row = 0
    q0, q1, q2, q3 = q_eb[0, 0], q_eb[0, 1], q_eb[0, 2], q_eb[0, 3]
    begin = rows[0]
    for k in range(begin - 1, -1, -1):  # the neighbours before the first row: back by their turns
        q0, q1, q2, q3 = multiply_k(
            q0, q1, q2, q3, *quaternion_from_rotation_vector_k(-dtheta[k, 0], -dtheta[k, 1], -dtheta[k, 2])
        )
    for k in range(len(dtheta)):
        if row < len(rows) and rows[row] == k:
            q0, q1, q2, q3 = q_eb[row, 0], q_eb[row, 1], q_eb[row, 2], q_eb[row, 3]
            begin = k
            row += 1
        dt = time[k + 1] - time[k]
        m0, m1, m2, m3 = multiply_k(
            q0, q1, q2, q3,
            *quaternion_from_rotation_vector_k(0.5 * dtheta[k, 0], 0.5 * dtheta[k, 1], 0.5 * dtheta[k, 2]),
        )  # fmt: skip
        e0, e1, e2, e3 = multiply_k(
            q0, q1, q2, q3, *quaternion_from_rotation_vector_k(dtheta[k, 0], dtheta[k, 1], dtheta[k, 2])
        )
        x = y = z = 0.0
        for part in range(3):
            t = time[k] + 0.5 * part * dt
            i = min(max(int((t - start) / step), 0), len(panels) - 1)
            u = t - start - i * step
            gx = panels[i, 0, 0] + u * (panels[i, 1, 0] + u * (panels[i, 2, 0] + u * panels[i, 3, 0]))
            gy = panels[i, 0, 1] + u * (panels[i, 1, 1] + u * (panels[i, 2, 1] + u * panels[i, 3, 1]))
            gz = panels[i, 0, 2] + u * (panels[i, 1, 2] + u * (panels[i, 2, 2] + u * panels[i, 3, 2]))
            # in the inertial axes that coincide with the Earth-fixed ones at the row
            s, c = sin(omega * (t - time[begin])), cos(omega * (t - time[begin]))
            ix, iy = c * gx - s * gy, s * gx + c * gy
            if part == 0:
                a, b, d = rotate_k(q0, -q1, -q2, -q3, ix, iy, gz)
                w = 1.0
            elif part == 1:
                a, b, d = rotate_k(m0, -m1, -m2, -m3, ix, iy, gz)
                w = 4.0
            else:
                a, b, d = rotate_k(e0, -e1, -e2, -e3, ix, iy, gz)
                w = 1.0
            x, y, z = x + w * a, y + w * b, z + w * d
        out[k, 0], out[k, 1], out[k, 2] = dt / 6.0 * x, dt / 6.0 * y, dt / 6.0 * z
        q0, q1, q2, q3 = e0, e1, e2, e3


@dataclass(frozen=True)
class Updates:
    """Increments in the intervals of the fast part, and the rows that a solution has."""

    sample_time: Array  # edges of the given increments, (N+1,) s
    time: Array  # edges of the fast intervals, (M+1,) s; the given ones without a schedule
    dtheta: Array
    dvel: Array  # dtheta, dvel: increments in them, (M, 3) rad and m/s
    uniform: bool  # whether all intervals are equal
    weights: Array  # weights of the fit of rate and specific force, see `coning_sculling.weight_table`
    ratio: int  # number of given increments in a fast interval
    per_row: int  # number of fast intervals between two rows of the solution
    rates: tuple[int, int, bool] | None
    """Intervals per medium and per slow update, and whether slow quantities are extrapolated; None without a schedule.
    """

    def at_rows(self, at_samples: Array) -> Array:
        """Return values at the edges of the given increments at the rows of the solution; empty ones stay empty."""
        rows = len(self.dtheta) // self.per_row
        step = self.ratio * self.per_row
        return np.ascontiguousarray(at_samples[: rows * step + 1 : step])  # kernels are compiled for such arrays


def updates(imu: ImuData, of: Mechanization) -> Updates:
    """Return the increments of a run in the updates of a mechanization; samples that do not fill a row stay."""
    sample_time, dtheta, dvel = checked_increments(imu)
    time, uniform, entry = sample_time, is_uniform(sample_time), REGISTRY[of.algorithm]
    if entry.needs_equal_intervals and not uniform:
        raise InputError(
            f"{of.algorithm} needs equal sampling intervals, for which its coefficients hold; those of the data range "
            f"from {np.min(np.diff(time)):.6g} s to {np.max(np.diff(time)):.6g} s."
        )
    ratio, per_row, rates, at_rate = 1, entry.samples, None, ""
    if of.rates_hz is not None:
        if not uniform:
            raise InputError("rates_hz: the three-rate schedule needs equal sampling intervals.")
        hz = three_rates(of.rates_hz)
        ratio, per_medium, per_slow = schedule(hz, len(dtheta) / float(time[-1] - time[0]))
        dtheta, dvel = _summed(dtheta, ratio), _summed(dvel, ratio)
        time = np.ascontiguousarray(time[: len(dtheta) * ratio + 1 : ratio])
        per_row, rates = per_medium * per_slow, (per_medium, per_slow, of.slow_quantities == "extrapolate")
        at_rate = f" at the slow rate, {hz[2]:g} Hz"
    if len(dtheta) < per_row:
        raise InputError(
            f"the data, {len(imu)} samples, are shorter than one update of {of.algorithm}"
            f"{at_rate or f', which takes {per_row}'}."
        )
    return Updates(
        sample_time, time, dtheta, dvel, uniform, weight_table(time, uniform), ratio, per_row, rates
    )  # fmt: skip


def _summed(increments: Array, ratio: int) -> Array:
    """Return sums of consecutive increments, (N // ratio, 3); remaining samples at the end are dropped."""
    whole = len(increments) // ratio
    return np.ascontiguousarray(increments[: whole * ratio].reshape(whole, ratio, 3).sum(axis=1))


NEAR = radians(85.0)
"""Pitch above which a passage lasts [rad]."""


def _steep_rows(q_nb: Array) -> tuple[list[tuple[int, int]], Array]:
    """Return first and last row of every passage, and |sin pitch| of all rows."""
    sine = np.abs(2.0 * (q_nb[:, 0] * q_nb[:, 2] - q_nb[:, 1] * q_nb[:, 3]))
    steep = np.concatenate(([False], sine > sin(NEAR), [False]))
    edges = np.flatnonzero(steep[1:] != steep[:-1])
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)], sine


def singularity_events(
    solution: NavSolution, navigate_again: Callable[[int, int, NavState], NavSolution]
) -> tuple[SingularityEvent, ...]:
    """Return the passages through pitch ±90° of a solution that is singular there, and their damage.

    The damage of a passage is measured on its increments: `navigate_again` navigates without the singularity from the
    solution just before it, and the two attitudes are compared just after it.
    """
    passages, sine = _steep_rows(solution.q_nb)
    events = []
    for steep_first, steep_last in passages:
        first, last = max(steep_first - 1, 0), min(steep_last + 1, len(solution.time) - 1)
        if last == first:
            continue
        reference = navigate_again(first, last, solution.state(first))
        difference = rotation.multiply(rotation.conjugate(reference.q_nb[-1]), solution.q_nb[last])
        damage = float(np.linalg.norm(rotation.rotation_vector_from_quaternion(difference)))
        nearest = 90.0 - degrees(asin(min(1.0, float(np.max(sine[first : last + 1])))))
        start, end = float(solution.time[first]), float(solution.time[last])
        events.append(
            SingularityEvent(
                start,
                end,
                damage,
                f"{solution.algorithm}: pitch came within {nearest:.2f}° of ±90° between {start:.2f} s and "
                f"{end:.2f} s; the resulting attitude error is {float(f'{degrees(damage) * 3600.0:.3g}'):g}″.",
            )
        )
    return tuple(events)


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
    problem = Problem(
        of, time, data.dtheta, data.dvel, data.weights, data.uniform,
        reference, climb, *_solution_arrays(len(time), at_start, of),
    )  # fmt: skip
    solve_problem(problem, data.rates)
    solution = problem.navigated
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


def _solution_arrays(
    rows: int, at_start: tuple[float, float, float, Array, Array], of: Mechanization
) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    """Return the arrays of a solution as a problem has them, with the state at the start in their first rows."""
    # one block of memory, which the system provides in large pages; separate arrays would take a fifth more time
    room = np.empty((12 if of.in_frame.has_azimuth else 11) * rows)
    latitude, longitude, height, defect = room[: 4 * rows].reshape(4, rows)
    velocity, q_nb = room[4 * rows : 7 * rows].reshape(rows, 3), room[7 * rows : 11 * rows].reshape(rows, 4)
    of_x = room[11 * rows :]
    of_x[:1] = of.azimuth
    latitude[0], longitude[0], height[0], velocity[0], q_nb[0] = at_start
    return latitude, longitude, height, velocity, q_nb, defect, of_x


def solve_problem(problem: Problem, rates: tuple[int, int, bool] | None) -> None:
    """Fill the rows of a problem's solution by its engine, at the rates of `Updates`, and check them."""
    of = problem.mechanization
    file, engine = frame_file(of.frame), own_engine(of.algorithm, of.frame)
    if rates is not None:
        three_rate_file(of.frame).solve_three_rates(problem, of.frame, *rates)
    elif engine is not None:
        engine(problem, of.frame)
    else:
        file.solve(problem, of.frame)
    file.check(problem, of.frame)
    check_solution(problem)


_NO_REFERENCE = np.empty(0)


class Segments:
    """Pure inertial navigation with a free vertical channel over any segment of the data from any state.

    The algorithm is a set of parts, any but functional-iteration. Slow quantities have no earlier value at the start of
    a segment and are held for one slow interval; without a route, the transverse frame follows the great circle along
    the velocity at the start of each segment. `field` is the disturbing field that the navigator knows beside normal
    gravity. Segments begin and end at the rows `time`, s.
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
        self.time = self._data.at_rows(self._data.sample_time)
        # samples around a segment that its fit uses; an algorithm of several samples uses its own alone
        across = self._data.rates is not None or (of.samples == 1 and of.in_frame.starts_anywhere)
        self._around = WINDOW - 1 if across else 0

    def _start(self, first: int) -> int:
        """Return the number of the first sample that the segment from a row on depends on."""
        return max(first * self._data.per_row - self._around, 0)

    def samples(self, first: int, last: int) -> tuple[int, ImuData]:
        """Return the number of a segment's first sample among the increments that it depends on, and these increments.

        They are its own, from the row `first` to `last`, and those of neighbours in the fit.
        """
        data = self._data
        start, end = self._start(first), min(last * data.per_row + self._around, len(data.dtheta))
        samples = ImuData(data.time[start : end + 1], data.dtheta[start:end], data.dvel[start:end])
        return first * data.per_row - start, samples

    def navigate(self, first: int, last: int, state: NavState, samples: ImuData) -> NavSolution:
        """Navigate from the row `first` to `last` from a state, on the compensated `samples(first, last)`."""
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
        start = self._start(first)
        time = self.time[first : last + 1]
        dtheta, dvel = np.ascontiguousarray(samples.dtheta), np.ascontiguousarray(samples.dvel)
        problem = Problem(
            self._of, time, dtheta, dvel, self._weights_of(start, len(dtheta)), self._data.uniform,
            _NO_REFERENCE, _NO_REFERENCE,
            *_solution_arrays(len(time), checked_initial(state), self._of), first=first * self._data.per_row - start,
        )  # fmt: skip
        solve_problem(problem, self._data.rates)
        return replace(problem.navigated, azimuth=None)

    def _weights_of(self, start: int, count: int) -> Array:
        """Return the weights of the fits within some samples."""
        data = self._data
        if self._around:
            return data.weights if data.uniform else data.weights[start : start + count]
        if data.uniform and count >= WINDOW:
            return data.weights
        return weight_table(data.time[start : start + count + 1], data.uniform)
