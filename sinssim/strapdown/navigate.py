"""`navigate`: increments and an initial state in, a navigation solution out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from sinssim.algorithms import REGISTRY
from sinssim.checks import checked_increments, checked_initial, not_finite_in
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth import ellipsoid_by_name, gravity_number, parameters
from sinssim.errors import InputError, RunError, unknown_name
from sinssim.names import ALGORITHMS, CURVATURES, FRAMES, SLOW_QUANTITIES
from sinssim.rates import check_parts, schedule
from sinssim.strapdown import azimuth, inertial, level, three_rate
from sinssim.strapdown.fit import is_uniform, weight_table
from sinssim.strapdown.parts import own_engine
from sinssim.strapdown.singularity import singularity_events
from sinssim.strapdown.vertical import NUMBERS, height_reference

_AZIMUTH_RULES = {
    "wander": azimuth.WANDER,
    "free-azimuth": azimuth.FREE_AZIMUTH,
    "transverse": azimuth.TRANSVERSE,
}

POLAR_LIMIT = math.radians(89.9)
"""Beyond this latitude [rad] a north-pointing frame turns too fast about the vertical to be navigated in."""


def navigate(
    imu: ImuData,
    initial: NavState,
    *,
    algorithm: str = "quaternion",
    frame: str = "level",
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
    curvature: str = "exact",
    rates_hz: tuple[float, float, float] | None = None,
    vertical: str = "free",
    height: ArrayLike | None = None,
    baro_time_constant: float = 50.0,
    route: tuple[float, float, float, float] | None = None,
    slow_quantities: str = "hold",
) -> NavSolution:
    """Navigate on inertial increments from a given initial state.

    Rate and specific force are fitted over five neighbouring intervals, two of them ahead of the one that is being
    integrated, so the solution belongs to recorded (or delayed) data.

    Args:
        imu: increments, N intervals; equal or unequal ones.
        initial: state at imu.time[0], scalars.
        algorithm: attitude algorithm, one of `ALGORITHMS`.
        frame: navigation frame, one of `FRAMES`.
        gravity: one of `GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid, one of `ELLIPSOIDS`.
        curvature: "exact" radii of curvature or "simplified", eq. (8.16).
        rates_hz: rates of the fast, medium and slow part, Hz, each a whole fraction of the one before and the fast
            one of the data's; None runs everything at the data's rate, to a higher order. See `three_rate`.
        vertical: "free" (pure inertial), "baro-loop" (third order) or "truth" (height held to the reference).
        height: reference height above the ellipsoid at every imu.time, (N+1,) m; for the last two.
        baro_time_constant: time constant τ of the baro loop, s; k₁ = 3/τ, k₂ = 3/τ² + 2g/R, k₃ = 1/τ³.
        route: for the transverse frame, latitude and longitude of A and of B, rad: its equator is the great circle
            from A to B; None takes the great circle along the initial velocity.
        slow_quantities: with rates_hz, what becomes of them between slow instants, one of `SLOW_QUANTITIES`.

    Returns:
        The solution at every imu.time, N+1 rows, the first being the initial state. An algorithm that advances by n
        samples at once has a row at every n-th imu.time, and with rates_hz there is one at every slow instant;
        samples left over at the end are not navigated.

    Raises:
        InputError: for data that cannot be used (NaN, unordered times, wrong shapes) or an unknown name.
        RunError: when the frame cannot follow the flight (over a pole) or the numbers overflow.
    """
    for kind, name, known in (
        ("algorithm", algorithm, ALGORITHMS),
        ("frame", frame, FRAMES),
        ("curvature", curvature, CURVATURES),
        ("treatment of slow quantities", slow_quantities, SLOW_QUANTITIES),
    ):
        if name not in known:
            raise unknown_name(kind, name, known)
    if not (math.isfinite(baro_time_constant) and baro_time_constant > 0.0):
        raise InputError(f"baro_time_constant = {baro_time_constant} s must be positive.")
    earth = parameters(ellipsoid_by_name(ellipsoid))
    gravity_model = gravity_number(gravity)
    time, dtheta, dvel = checked_increments(imu)
    lat0, lon0, h0, v0, q0 = checked_initial(initial)
    reference, climb = height_reference(vertical, height, time)

    uniform = is_uniform(time)
    entry = REGISTRY[algorithm]
    if entry.needs_equal_intervals and not uniform:
        raise InputError(
            f"{algorithm} needs equal sampling intervals, for which its coefficients hold; those of this data run from "
            f"{np.min(np.diff(time)):.6g} s to {np.max(np.diff(time)):.6g} s."
        )
    per_row, per_medium, per_slow = entry.samples, 1, 1
    if rates_hz is not None:
        check_parts(algorithm, frame)
        if not uniform:
            raise InputError("rates_hz: the three-rate schedule needs equal sampling intervals.")
        ratio, per_medium, per_slow = schedule(rates_hz, len(dtheta) / float(time[-1] - time[0]))
        dtheta, dvel = three_rate.summed(dtheta, ratio), three_rate.summed(dvel, ratio)
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

    rows = len(time)
    # one block of memory: the system hands it out in large pages, where separate arrays would cost a fifth of the time
    room = np.empty(11 * rows)
    latitude, longitude, height_out, defect = room[: 4 * rows].reshape(4, rows)
    velocity, q_nb = room[4 * rows : 7 * rows].reshape(rows, 3), room[7 * rows :].reshape(rows, 4)
    latitude[0], longitude[0], height_out[0], velocity[0], q_nb[0] = lat0, lon0, h0, v0, q0
    data = (time, dtheta, dvel, weights, uniform, earth, gravity_model)
    channel = (NUMBERS[vertical], reference, climb, baro_time_constant)
    out = (latitude, longitude, height_out, velocity, q_nb, defect)
    simplified = curvature == "simplified"
    rule = _AZIMUTH_RULES.get(frame, azimuth.WANDER)
    pole = _route_pole(route, lat0, lon0, v0) if frame == "transverse" else np.zeros(3)
    own = own_engine(algorithm, frame)
    if rates_hz is not None:
        three_rate.engine(algorithm)(
            time, dtheta, dvel, weights, earth, gravity_model, simplified, *channel, per_medium, per_slow,
            slow_quantities == "extrapolate", *out,
        )  # fmt: skip
    elif own is not None:
        own(time, dtheta, dvel, uniform, earth, gravity_model, simplified, *channel, rule, pole, *out)
    elif frame == "level":
        level.engine(algorithm)(*data[:5], 0, *data[5:], simplified, *channel, *out)
    elif frame == "inertial":
        inertial.engine(algorithm)(*data, *channel, *out)
    else:
        azimuth.engine(algorithm)(*data, simplified, *channel, rule, pole, *out)
    check_solution(frame, algorithm, time, latitude, height_out, velocity, q_nb, dtheta, dvel)
    solution = NavSolution(time, latitude, longitude, height_out, velocity, q_nb, defect, algorithm)
    if algorithm != "euler":
        return solution

    def without_singularity(first: int, last: int, state: NavState) -> NavSolution:
        start, end = first * per_row, last * per_row
        return navigate(
            ImuData(sample_time[start : end + 1], dtheta[start:end], dvel[start:end]),
            state,
            gravity=gravity,
            ellipsoid=ellipsoid,
        )

    return replace(solution, events=singularity_events(solution, without_singularity))


def _normal(latitude: float, longitude: float) -> Array:
    """Return the ellipsoid's outward normal in Earth-fixed axes."""
    c = math.cos(latitude)
    return np.array([c * math.cos(longitude), c * math.sin(longitude), math.sin(latitude)])


def _route_pole(route: tuple[float, float, float, float] | None, lat0: float, lon0: float, v0: Array) -> Array:
    """Return the pole of the route's great circle, to the left of the route, in Earth-fixed axes."""
    if route is None:
        north = np.array([-math.sin(lat0) * math.cos(lon0), -math.sin(lat0) * math.sin(lon0), math.cos(lat0)])
        east = np.array([-math.sin(lon0), math.cos(lon0), 0.0])
        ahead = v0[0] * north + v0[1] * east
        if not float(np.linalg.norm(ahead)) > 0.0:
            ahead = east
        pole = np.cross(_normal(lat0, lon0), ahead)
    else:
        values = np.asarray(route, dtype=np.float64)
        if values.shape != (4,) or not np.all(np.isfinite(values)):
            raise InputError(f"route = {route} must be latitude and longitude of A and of B: four finite numbers, rad.")
        pole = np.cross(_normal(values[0], values[1]), _normal(values[2], values[3]))
        if float(np.linalg.norm(pole)) < 1e-9:
            raise InputError(f"route = {route}: A and B coincide or lie opposite; they fix no great circle.")
    return np.asarray(pole / np.linalg.norm(pole))


def check_solution(
    frame: str,
    algorithm: str,
    time: Array,
    latitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    dtheta: Array,
    dvel: Array,
) -> None:
    """Raise if the frame met a pole or the numbers ran away.

    Args:
        frame: navigation frame.
        algorithm: attitude algorithm.
        time: of the rows, (N+1,) s.
        latitude, height, velocity, q_nb: the solution, N+1 rows.
        dtheta, dvel: the increments that it comes from.

    Raises:
        RunError: it did.
    """
    if frame == "level" and not max(float(np.max(latitude)), -float(np.min(latitude))) <= POLAR_LIMIT:
        row = int(np.argmax(~(np.abs(latitude) <= POLAR_LIMIT)))
        if not abs(latitude[row]) <= 0.5 * math.pi:  # no step of a vehicle leads from 89.9° to beyond the pole
            raise _ran_away("latitude", row, algorithm, time, dtheta, dvel)
        raise RunError(
            f"the north-pointing level frame cannot be used within {90.0 - math.degrees(POLAR_LIMIT):.1f}° of a pole, "
            f"where north turns as fast as the vehicle moves: latitude {math.degrees(latitude[row]):.4f}° at "
            f"t = {time[row]:.2f} s. The frames wander, free-azimuth, transverse and inertial pass the poles.",
            time=float(time[row]),
        )
    if found := not_finite_in(height, velocity, q_nb):
        raise _ran_away(*found, algorithm, time, dtheta, dvel)


def _ran_away(name: str, row: int, algorithm: str, time: Array, dtheta: Array, dvel: Array) -> RunError:
    """Return the error for a solution that leaves all bounds at a row."""
    before = max(1, row * len(dtheta) // (len(time) - 1))
    turn, push = (float(np.hypot.reduce(array[:before], axis=1).max()) for array in (dtheta, dvel))
    return RunError(
        f"the navigation's {name} ran away and is no usable number at t = {time[row]:.2f} s. The increments before it "
        f"turn the body by up to {math.degrees(turn):.3g}° and push it by up to {push:.3g} m/s in one interval: if "
        f"that is right (rad and m/s are expected), {algorithm} does not converge on so long an interval, and a higher "
        "rate or another algorithm is needed.",
        time=float(time[row]),
    )
