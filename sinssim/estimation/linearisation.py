"""The nominal motion, inertial navigation over a segment, and the model linearised about it.

Φ, Q, H and residuals of all epochs of a segment are computed at once, for any aiding sensor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array, Measurements, NavSolution, NavState, rows_of
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.estimation.error_dynamics import (
    NominalMotion,
    dynamics,
    earth_dynamics,
    noise_at_speed,
    reading_error,
    refer_to_transported,
    transition,
    transport_rate,
    transported_transition,
)
from sinssim.estimation.large_errors import PointMotion
from sinssim.estimation.measurement_epochs import CheckedMeasurements, Epochs
from sinssim.estimation.state_model import INERTIAL, ErrorModel
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.imu.compensation import MeanGyroRates
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.rotation_encoder import Encoders
from sinssim.sensors.measurement_kind import CORE, PHI, Comparison, MeasurementKind, V, earth_rate
from sinssim.sensors.vibration_noise import AddedNoise
from sinssim.strapdown.navigation_error import POLAR_LIMIT, carried
from sinssim.units import G0


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


@dataclass(frozen=True)
class Prediction:
    """Inertial navigation at the instants of some readings."""

    state: NavState  # M rows
    rate_b: Array  # inertial rate of the body, or its mean over the reading's interval, (M, 3) rad/s
    ellipsoid: Ellipsoid  # reference ellipsoid
    sensed: tuple[Array, Array] | None = None
    """Of a block that turns in the vehicle, the rate that its gyros sense, (M, 3) rad/s, and C_vb, which takes its axes
    into the vehicle's, (M, 3, 3); None for a block that does not turn.
    """

    def rate_error(self, model: ErrorModel) -> Array:
        """Return the matrix of the rate's error by the gyros' states, (M, 3, n)."""
        up = rotation.dcm_from_quaternion(self.state.q_nb)[:, 2] * -G0  # the specific force without acceleration
        if self.sensed is None:
            return reading_error(model, "gyro", self.rate_b, up)
        rate, c_vb = self.sensed
        return np.asarray(c_vb @ reading_error(model, "gyro", rate, np.einsum("kij,ki->kj", c_vb, up)))


def observe(
    measurements: Measurements, prediction: Prediction, model: ErrorModel, parameters: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Return residuals, prediction less reading, (M, k), and H, (M, k, n), of readings.

    `parameters` are the values of the sensors' compensated parameters, by block.
    """
    kind, p = measurement_kind(measurements.kind), prediction
    arm = np.asarray(measurements.lever_arm, dtype=np.float64)
    if kind.at_antenna and "gnss lever arm" in model.slices:
        arm = arm + parameters["gnss lever arm"]
    at = Comparison(
        p.state, p.rate_b, lambda: p.rate_error(model), p.ellipsoid, model, parameters, measurements.label, arm
    )
    residual, h = kind.observe(at, measurements.value)
    if model.axes == "transported" and kind.turns_with_north:
        refer_to_transported(h, p.state, p.ellipsoid)
    return residual, h


def delays(kind: MeasurementKind, label: str, model: ErrorModel) -> list[str]:
    """Return the names of the blocks that describe by how much readings of a sensor are stamped too late."""
    names = [f"{label} delay", *(["gnss time offset"] if kind.on_gnss_clock else [])]
    return [name for name in names if name in model.slices]


class Observed(NamedTuple):
    """One reading, linearised: `residual` = H x + noise."""

    sensor: int  # number of the sensor among the readings
    row: int  # number of the reading among the sensor's
    residual: Array  # (k,)
    h: Array  # H, (k, n)
    variance: Array  # diagonal of R, (k,)
    interval: float  # averaging interval of a zero-rate reading, s
    residuals: Callable[[Array], Array]
    """Function that returns the residuals, (N, k), if the solution has errors of any size, (N, n)."""
    still: Array | None = None
    """The computed velocity, (3,) m/s, if the reading is that of a velocity of zero; see `ErrorFilter.linearised`."""


@dataclass(frozen=True)
class Linearisation:
    """The linearised model over a segment of K epochs."""

    first: int  # number of its first epoch
    state: NavState  # inertial navigation at the epochs, K rows
    interval: Array  # time from the previous epoch to each, (K,) s
    phi: Array  # Φ over the interval, (K, n, n)
    q: Array  # Q over the interval, (K, n, n)
    c_nb: Array  # attitude in the middle of the interval, in the axes of its end, (K, 3, 3)
    turn: Array | None  # from the axes of its end into those of its start, (K, 3, 3); None where they do not turn
    added: Array | None
    """Roots of the added noise's spectral densities, gyros and accelerometers, (K, 2, 3, 3); None for none."""
    observed: dict[int, list[Observed]]  # readings of each epoch that has any, in order of arrival
    skipped: list[tuple[int, int]]  # sensor and row of readings of north where there is none
    motion: Callable[[], PointMotion]  # function that returns the motion of states with errors of any size


@dataclass(frozen=True)
class Surroundings:
    """Data that stay the same throughout a run."""

    model: ErrorModel
    density: Array  # density of the driving noise over time, (n,)
    epochs: Epochs  # of the filter
    readings: list[CheckedMeasurements]  # of all sensors
    gyros: MeanGyroRates  # source of mean rates
    gravity: str  # name of the engine's gravity model
    ellipsoid: Ellipsoid  # reference ellipsoid
    long_rows: bool  # whether a row of the engine has several samples: between rows the attitude follows the gyros
    added: AddedNoise | None = None  # noise of the inertial sensors in addition to the model's; None for none
    encoders: Encoders | None = None
    """Of a block that turns in the vehicle, whose readings are those of the vehicle; None for another."""


class Segment(NamedTuple):
    """Inertial navigation over consecutive epochs, which readings are compared with."""

    first: int  # number of the first epoch
    nominal: NavSolution
    state: NavState  # of the nominal motion at the epochs, K rows
    interval: Array  # of the linearisation
    phi: Array  # likewise
    calibration: ImuErrors  # compensated errors of the inertial sensors
    parameters: Mapping[str, Array]  # compensated parameters of the aiding sensors, by block
    motion: Callable[[], PointMotion]  # of states with errors of any size


def linearise(
    around: Surroundings,
    first: int,
    last: int,
    nominal: NavSolution,
    calibration: ImuErrors,
    parameters: Mapping[str, Array],
) -> Linearisation:
    """Linearise about a segment from the epoch `first` to `last`; `nominal` begins at the epoch before the first."""
    model, epochs = around.model, around.epochs
    time = epochs.time[max(first - 1, 0) : last + 1]
    if first == 0:
        time = np.concatenate([time[:1], time])  # no interval precedes the first epoch
    interval = np.diff(time)
    state = _at(nominal, time, around, calibration)
    middle = _at(nominal, time[:-1] + 0.5 * interval, around, calibration)
    rate = np.zeros((len(interval), 3))
    if any(name in INERTIAL and name.startswith("gyro ") for name in model.slices):
        lasts = interval > 0.0
        rate[lasts] = around.gyros.mean(time[:-1][lasts], time[1:][lasts], calibration)
    moving = motion(state, middle, interval, rate, around.gravity, around.ellipsoid, model.axes)
    phi, q, c_nb, turn = _dynamics(around, state, middle, interval, moving)

    @cache
    def points() -> PointMotion:
        readings = moving.rate_b, moving.force_b
        return PointMotion.along(model, state, interval, readings, around.gravity, around.ellipsoid)

    added = None
    if around.added is not None:
        added = around.added.roots(time[:-1])
        q = q + added_noise(phi, c_nb, turn, added, interval)
        for k, states, covariance in around.added.of_states(time, model.slices):
            q[k, states, states] += covariance
    here = rows_of(state, slice(1, None))
    observed: dict[int, list[Observed]] = {}
    skipped: list[tuple[int, int]] = []
    for sensor, readings in enumerate(around.readings):
        rows = readings.between(first, last)
        if model.axes == "transported" and measurement_kind(readings.data.kind).of_north:
            polar = np.abs(here.latitude[readings.epoch[rows] - first]) > POLAR_LIMIT
            skipped += [(sensor, row) for row in rows[polar].tolist()]
            rows = rows[~polar]
        if len(rows):
            segment = Segment(first, nominal, here, interval, phi, calibration, parameters, points)
            for epoch, reading in _observe(around, segment, sensor, rows):
                observed.setdefault(epoch, []).append(reading)
    for at_once in observed.values():
        at_once.sort(key=lambda o: float(around.readings[o.sensor].data.arrival[o.row]))
    return Linearisation(first, here, interval, phi, q, c_nb, turn, added, observed, skipped, points)


def added_noise(phi: Array, c_nb: Array, turn: Array | None, roots: Array, interval: Array) -> Array:
    """Return the covariance, (K, n, n), by noise with `roots`, (K, 2, 3, 3), in the middle of each interval."""
    whole, parts = np.eye(phi.shape[1]), []
    for k, where in enumerate((PHI, V)):
        at_start = phi[:, :, where] if turn is None else phi[:, :, where] @ turn
        half_way = 0.5 * (at_start + whole[:, where]) @ c_nb
        root = roots[:, k]
        parts.append(half_way @ np.copysign(np.sqrt(root**2 * interval[:, None, None]), root))  # element by element
    root = np.concatenate(parts, axis=2)
    return np.asarray(root @ root.transpose(0, 2, 1))


def _dynamics(
    around: Surroundings, state: NavState, middle: NavState, interval: Array, moving: NominalMotion
) -> tuple[Array, Array, Array, Array | None]:
    """Return Φ and Q over intervals, and `c_nb` and `turn` of the linearisation."""
    model, gravity, ellipsoid = around.model, around.gravity, around.ellipsoid
    density = noise_at_speed(model, around.density, moving.velocity)
    if model.axes == "north":
        phi, q = transition(dynamics(model, moving, gravity, ellipsoid), density, interval)
        return phi, q, moving.c_nb, None
    f = earth_dynamics(model, moving, middle.longitude, gravity, ellipsoid)
    phi, q = transported_transition(f, density, interval, state, ellipsoid)
    ends = [
        rotation.dcm_from_quaternion(carried(middle, s.latitude, s.longitude, s.height).q_nb)
        for s in (rows_of(state, slice(0, -1)), rows_of(state, slice(1, None)))
    ]
    return phi, q, ends[1], ends[0] @ ends[1].transpose(0, 2, 1)


def _at(nominal: NavSolution, time: Array, around: Surroundings, calibration: ImuErrors) -> NavState:
    # an instant this close before an edge counts as on it
    edge = np.searchsorted(nominal.time, time + 1e-7, side="right") - 1
    step = nominal.time[np.minimum(edge + 1, len(nominal.time) - 1)] - nominal.time[edge]
    passed = time - nominal.time[edge]
    passed[np.abs(passed) < 1e-7] = 0.0
    fraction = np.divide(passed, step, out=np.zeros_like(passed), where=step > 0.0)
    bend = None
    inside = np.flatnonzero(fraction)
    if around.long_rows and len(inside):
        bend, begin, rate = np.zeros((len(time), 3)), nominal.time[edge[inside]], around.gyros.mean
        now, whole = (rate(begin, begin + length[inside], calibration) for length in (passed, step))
        bend[inside] = passed[inside, None] * (now - whole)
    return at(nominal, edge, fraction, around.ellipsoid, around.model.axes, bend)


def _observe(
    around: Surroundings, segment: Segment, sensor: int, rows: NDArray[np.intp]
) -> Iterator[tuple[int, Observed]]:
    """Yield some of one sensor's readings, each with its epoch."""
    readings, calibration, parameters = around.readings[sensor], segment.calibration, segment.parameters
    data, epoch, kind = readings.data, readings.epoch[rows].astype(np.intp), measurement_kind(readings.data.kind)
    time = around.epochs.time[epoch]
    some = Measurements(data.kind, time, time, data.value[rows], data.sigma[rows], data.lever_arm, data.name)
    turns = kind.needs_rate or data.lever_arm.any() or "gnss lever arm" in around.model.slices
    late = delays(kind, data.label, around.model)

    def rate_at(instant: Array) -> Array:
        if kind.mean_rate:
            return around.gyros.mean(instant - readings.interval[rows], instant, calibration)
        return around.gyros.at(instant, calibration) if turns else np.zeros((len(rows), 3))

    def compared(instant: Array, state: NavState, rate: Array, of: Measurements) -> tuple[Array, Array]:
        seen = Prediction(state, rate, around.ellipsoid)
        if around.encoders is not None:
            seen = of_vehicle(seen, around.encoders, instant)
        return observe(of, seen, around.model, parameters)

    if late:
        delay = sum(float(parameters[name][0]) for name in late)

        def shifted(by: float) -> tuple[Array, Array]:
            instant = time + by
            state = near(segment.nominal, instant, around.gyros, calibration, around.ellipsoid, around.model.axes)
            return compared(instant, state, rate_at(instant), some)

        residual, h = shifted(-delay)
        sooner, later = shifted(-delay - _SLOPE)[0], shifted(-delay + _SLOPE)[0]
        h = _carried_back(h, delay, segment, epoch - segment.first)
        for name in late:  # the quantity changes by its rate times the delay
            h[:, :, around.model.slices[name]] += ((later - sooner) / (2.0 * _SLOPE))[:, :, None]
    else:
        residual, h = compared(time, rows_of(segment.state, epoch - segment.first), rate_at(time), some)

    def residuals(k: int, errors: Array) -> Array:
        """Return the residuals of the k-th reading for errors of any size; those of parameters are to first order."""
        count, at_epoch = 1 + len(errors), int(epoch[k]) - segment.first
        states = segment.motion().states(at_epoch, np.vstack([np.zeros_like(errors[:1]), errors]))
        value, sigma = (np.broadcast_to(part[k], (count, part.shape[1])) for part in (some.value, some.sigma))
        instant, rate = np.full(count, time[k]), np.broadcast_to(rate_at(time)[k], (count, 3))
        again = replace(some, time=instant, arrival=instant, value=value, sigma=sigma)
        off = compared(instant, states, rate, again)[0]
        change = off[1:] - off[0]
        if kind.unit == "rad" and kind.errors == 1:  # across half a turn
            change = np.remainder(change + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(residual[k] + change - errors[:, CORE:] @ h[k, :, CORE:].T)

    variance, interval = readings.variance(rows, around.model), readings.interval[rows]
    if around.added is not None and kind.mean_rate:
        variance = variance + np.sum(around.added.roots(time - interval)[:, 0] ** 2, axis=2) / interval[:, None]
    still = segment.state.velocity_ned[epoch - segment.first] if kind.zero else [None] * len(rows)
    whole = map(partial(partial, residuals), range(len(rows)))
    of = (rows.tolist(), residual, h, variance, interval.tolist(), whole, still)
    for at_epoch, *parts in zip(epoch.tolist(), *of, strict=True):
        yield at_epoch, Observed(sensor, *parts)


def of_vehicle(block: Prediction, encoders: Encoders, time: Array) -> Prediction:
    """Return the prediction of the vehicle's motion from that of a block that turns in it, as the encoders give it."""
    q_vb = encoders.attitude(time)
    state = replace(block.state, q_nb=rotation.multiply(block.state.q_nb, rotation.conjugate(q_vb)))
    rate = rotation.rotate(q_vb, block.rate_b - encoders.mean_rate(time))
    return Prediction(state, rate, block.ellipsoid, (block.rate_b, rotation.dcm_from_quaternion(q_vb)))


_SLOPE = 0.05
"""Half of the time over which the rate of a quantity is taken for the H of a delay, s: longer than the periods of
vibration, whose accelerations would count as a signal, and short beside the time in which a vehicle turns."""


def _carried_back(h: Array, delay: float, segment: Segment, row: NDArray[np.intp]) -> Array:
    """Return H for the errors at the stated instants, from H for those a delay, s, earlier, (M, k, n).

    The errors change by F x over a second, and Φ = 1 + F T of the interval before an epoch gives F. `row` is the epoch
    of each reading, (M,).
    """
    row = np.where(segment.interval[row] > 0.0, row, row + 1)  # the run's first epoch has no interval before it
    part = delay / segment.interval[row]
    return np.asarray(h - part[:, None, None] * (h @ segment.phi[row] - h))
