"""The nominal motion that errors are linearised about: inertial navigation over a segment, at any of its instants."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.estimation.error_dynamics import NominalMotion, transport_rate
from sinssim.sensors.imu.compensation import MeanGyroRates
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.measurement_kind import earth_rate
from sinssim.strapdown.polar_axes import carried


def rows_of(state: NavState | NavSolution, rows: NDArray[np.intp] | slice) -> NavState:
    """Return some rows of states."""
    s = state
    return NavState(s.latitude[rows], s.longitude[rows], s.height[rows], s.velocity_ned[rows], s.q_nb[rows])


def solution_of(time: Array, state: NavState, algorithm: str) -> NavSolution:
    """Return navigation states at times, (N,) s, as a solution."""
    s = state
    return NavSolution(time, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, np.zeros(len(time)), algorithm)


def at(
    solution: NavSolution,
    edge: NDArray[np.intp],
    fraction: Array,
    ellipsoid: Ellipsoid,
    axes: str = "north",
    bend: Array | None = None,
) -> NavState:
    """Interpolate a solution between its rows: velocity and attitude linearly, position with the acceleration.

    The instants, (K,), lie a `fraction` 0 … 1 of the way from the row `edge` to the next. "transported" axes of the
    error model are interpolated across a pole. `bend` is the rotation of the body beyond the linear one, in the axes of
    the row before, (K, 3) rad.
    """
    before = rows_of(solution, edge)
    if not fraction.any():
        return before
    after = rows_of(solution, np.minimum(edge + 1, len(solution.time) - 1))
    interval = solution.time[np.minimum(edge + 1, len(solution.time) - 1)] - solution.time[edge]
    if axes == "transported":
        return _across(before, after, interval, fraction, ellipsoid, bend)
    part = fraction[:, None]
    gained = after.velocity_ned - before.velocity_ned
    sag = (0.5 * fraction * (1.0 - fraction) * interval)[:, None] * gained
    r1, r2 = earth.radii(before.latitude, ellipsoid)
    east = np.mod(after.longitude - before.longitude + np.pi, 2.0 * np.pi) - np.pi
    turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(before.q_nb), after.q_nb))
    return NavState(
        before.latitude + fraction * (after.latitude - before.latitude) - sag[:, 0] / (r1 + before.height),
        before.longitude + fraction * east - sag[:, 1] / ((r2 + before.height) * np.cos(before.latitude)),
        before.height + fraction * (after.height - before.height) + sag[:, 2],
        before.velocity_ned + part * gained,
        rotation.multiply(before.q_nb, rotation.quaternion_from_rotation_vector(_bent(part * turn, bend))),
    )


def near(
    solution: NavSolution,
    time: Array,
    gyros: MeanGyroRates,
    calibration: ImuErrors,
    ellipsoid: Ellipsoid,
    axes: str = "north",
) -> NavState:
    """Interpolate a solution at (K,) s, or extrapolate it a little with constant acceleration and rate."""
    inside = np.clip(time, solution.time[0], solution.time[-1])
    last = len(solution.time) - 1
    edge = np.clip(np.searchsorted(solution.time, inside, side="right") - 1, 0, max(last - 1, 0))
    step = solution.time[np.minimum(edge + 1, last)] - solution.time[edge]
    fraction = np.divide(inside - solution.time[edge], step, out=np.zeros_like(inside), where=step > 0.0)
    state = at(solution, edge, fraction, ellipsoid, axes)
    beyond = time - inside
    out = np.flatnonzero(beyond)
    if not len(out):
        return state
    span = min(max(round(_EXTRAPOLATED / float(np.mean(np.diff(solution.time)))), 1), last) if last else 0
    by = beyond[out, None]
    pushed = np.zeros((len(out), 3))
    if span:
        first = np.where(by[:, 0] > 0.0, last - span, 0)
        lasting = solution.time[first + span] - solution.time[first]
        pushed = (solution.velocity_ned[first + span] - solution.velocity_ned[first]) / lasting[:, None]
    here = rows_of(state, out)
    moved = by * (here.velocity_ned + 0.5 * by * pushed)
    latitude, longitude = earth.displaced(
        here.latitude, here.longitude, here.height, moved[:, 0], moved[:, 1], ellipsoid
    )
    turn = rotation.quaternion_from_rotation_vector(by * gyros.at(inside[out], calibration))
    there = (latitude, longitude, here.height - moved[:, 2], here.velocity_ned + by * pushed)
    for old, new in zip(vars(state).values(), (*there, rotation.multiply(here.q_nb, turn)), strict=True):
        old[out] = new
    return state


_EXTRAPOLATED = 0.1
"""Time over which the acceleration at the end of a solution is taken, s."""


def _bent(turn: Array, bend: Array | None) -> Array:
    """Return rotation vectors with a small addition, if there is one."""
    return turn if bend is None else turn + bend


def _across(
    before: NavState, after: NavState, interval: Array, fraction: Array, ellipsoid: Ellipsoid, turned: Array | None
) -> NavState:
    """Interpolate between rows in the local level of the first, which is regular at a pole."""
    places = [earth.geodetic_to_ecef(s.latitude, s.longitude, s.height, ellipsoid) for s in (before, after)]
    q_ne = rotation.conjugate(earth.q_en(before.latitude, before.longitude))
    moved = rotation.rotate(q_ne, places[1] - places[0])
    after = carried(after, before.latitude, before.longitude, after.height)
    gained, part = after.velocity_ned - before.velocity_ned, fraction[:, None]
    sag = (0.5 * fraction * (1.0 - fraction) * interval)[:, None] * gained
    turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(before.q_nb), after.q_nb))
    there = NavState(
        before.latitude,
        before.longitude,
        before.height,
        before.velocity_ned + part * gained,
        rotation.multiply(before.q_nb, rotation.quaternion_from_rotation_vector(_bent(part * turn, turned))),
    )
    north, east, _ = (part * moved - sag).T
    latitude, longitude = earth.displaced(before.latitude, before.longitude, before.height, north, east, ellipsoid)
    return carried(there, latitude, longitude, before.height + fraction * (after.height - before.height) + sag[:, 2])


def motion(
    state: NavState,
    middle: NavState,
    interval: Array,
    rate_b: Array,
    gravity: str,
    ellipsoid: Ellipsoid,
    axes: str = "north",
) -> NominalMotion:
    """Return the mean motion over the intervals between K+1 epochs, with the states half-way between them.

    In "transported" axes the velocities at both ends are carried to the middle. The specific force is the change of
    velocity less gravity and the Coriolis acceleration.
    """
    lat, h, v = middle.latitude, middle.height, middle.velocity_ned
    gained, transport = np.diff(state.velocity_ned, axis=0), transport_rate(lat, h, v, ellipsoid)
    if axes == "transported":
        ends = [carried(rows_of(state, s), lat, middle.longitude, h) for s in (slice(1, None), slice(0, -1))]
        gained = ends[0].velocity_ned - ends[1].velocity_ned
        transport[:, 2] = 0.0
    gained /= np.where(interval > 0.0, interval, 1.0)[:, None]
    turning = 2.0 * earth_rate(lat, ellipsoid) + transport
    force = gained + np.cross(turning, v) - earth.gravity_ned(lat, h, gravity, ellipsoid)
    c_nb = rotation.dcm_from_quaternion(middle.q_nb)
    return NominalMotion(lat, h, v, c_nb, force, rate_b, np.einsum("kji,kj->ki", c_nb, force))
