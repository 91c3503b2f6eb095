"""Linearises a segment of inertial navigation: Φ, Q, H and residuals of all its epochs at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, Measurements, NavSolution, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.estimation.dynamics import dynamics, transition
from sinssim.estimation.earth_dynamics import earth_dynamics, transported_transition
from sinssim.estimation.intake import CheckedMeasurements, Epochs
from sinssim.estimation.measurements.kind import Prediction, measurement_kind, observe
from sinssim.estimation.model import ErrorModel
from sinssim.estimation.nominal import MeanGyroRates, at, motion, rows_of
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.strapdown.polar import POLAR_LIMIT, carried


class Observed(NamedTuple):
    """One reading, linearised: `residual` = H x + noise.

    Attributes:
        sensor: number of the sensor among the readings.
        row: number of the reading among the sensor's.
        residual: (k,).
        h: H, (k, n).
        variance: diagonal of R, (k,).
        interval: averaging interval of a zero-rate reading, s.
    """

    sensor: int
    row: int
    residual: Array
    h: Array
    variance: Array
    interval: float


@dataclass(frozen=True)
class Linearisation:
    """The linearised model over a segment of K epochs.

    Attributes:
        first: number of its first epoch.
        state: inertial navigation at the epochs, K rows.
        interval: time from the previous epoch to each, (K,) s.
        phi: Φ over the interval, (K, n, n).
        q: Q over the interval, (K, n, n).
        c_nb: attitude in the middle of the interval, in the axes of its end, (K, 3, 3).
        turn: from the axes of its end into those of its start, (K, 3, 3); None where they do not turn.
        observed: readings of each epoch that has any, in order of arrival.
        skipped: sensor and row of readings of north where there is none.
    """

    first: int
    state: NavState
    interval: Array
    phi: Array
    q: Array
    c_nb: Array
    turn: Array | None
    observed: dict[int, list[Observed]]
    skipped: list[tuple[int, int]]


@dataclass(frozen=True)
class Surroundings:
    """Data that stay the same throughout a run.

    Attributes:
        model: the error model.
        density: density of the driving noise, (n,).
        epochs: of the filter.
        readings: of all sensors.
        gyros: source of mean rates.
        gravity: name of the engine's gravity model.
        ellipsoid: reference ellipsoid.
        long_rows: whether a row of the engine has several samples; between rows the attitude then follows the gyros.
    """

    model: ErrorModel
    density: Array
    epochs: Epochs
    readings: list[CheckedMeasurements]
    gyros: MeanGyroRates
    gravity: str
    ellipsoid: Ellipsoid
    long_rows: bool = False


def linearise(
    around: Surroundings,
    first: int,
    last: int,
    nominal: NavSolution,
    calibration: ImuErrors,
    parameters: Mapping[str, Array],
) -> Linearisation:
    """Linearise about a segment.

    Args:
        around: data that stay the same throughout the run.
        first, last: numbers of the segment's first and last epoch.
        nominal: inertial navigation from the epoch before the first to the last one.
        calibration: errors that are compensated in its increments.
        parameters: values of all compensated parameters, by block.

    Returns:
        The linearisation.
    """
    model, epochs = around.model, around.epochs
    time = epochs.time[max(first - 1, 0) : last + 1]
    if first == 0:
        time = np.concatenate([time[:1], time])  # no interval precedes the first epoch
    interval = np.diff(time)
    state = _at(nominal, time, around, calibration)
    middle = _at(nominal, time[:-1] + 0.5 * interval, around, calibration)
    rate = np.zeros((len(interval), 3))
    if "gyro scale" in model.slices or "gyro misalignment" in model.slices:
        lasts = interval > 0.0
        rate[lasts] = around.gyros.mean(time[:-1][lasts], time[1:][lasts], calibration)
    phi, q, c_nb, turn = _dynamics(around, state, middle, interval, rate)
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
            _observe(around, sensor, readings, rows, first, here, calibration, parameters, observed)
    for at_once in observed.values():
        at_once.sort(key=lambda o: float(around.readings[o.sensor].data.arrival[o.row]))
    return Linearisation(first, here, interval, phi, q, c_nb, turn, observed, skipped)


def _dynamics(
    around: Surroundings, state: NavState, middle: NavState, interval: Array, rate: Array
) -> tuple[Array, Array, Array, Array | None]:
    """Return Φ and Q over intervals, and `c_nb` and `turn` of the linearisation."""
    model, gravity, ellipsoid = around.model, around.gravity, around.ellipsoid
    moving = motion(state, middle, interval, rate, gravity, ellipsoid, model.axes)
    if model.axes == "north":
        phi, q = transition(dynamics(model, moving, gravity, ellipsoid), around.density, interval)
        return phi, q, moving.c_nb, None
    f = earth_dynamics(model, moving, middle.longitude, gravity, ellipsoid)
    phi, q = transported_transition(f, around.density, interval, state, ellipsoid)
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
    around: Surroundings,
    sensor: int,
    readings: CheckedMeasurements,
    rows: NDArray[np.intp],
    first: int,
    here: NavState,
    calibration: ImuErrors,
    parameters: Mapping[str, Array],
    observed: dict[int, list[Observed]],
) -> None:
    """Add some of one sensor's readings; the first row of `here` is the epoch `first`."""
    data, epoch = readings.data, readings.epoch[rows].astype(np.intp)
    time = around.epochs.time[epoch]
    if measurement_kind(data.kind).mean_rate:
        rate = around.gyros.mean(time - readings.interval[rows], time, calibration)
    elif data.lever_arm.any() or "gnss lever arm" in around.model.slices:
        rate = around.gyros.at(time, calibration)
    else:
        rate = np.zeros((len(rows), 3))
    some = Measurements(data.kind, time, time, data.value[rows], data.sigma[rows], data.lever_arm, data.name)
    now = Prediction(rows_of(here, epoch - first), rate, around.ellipsoid)
    residual, h = observe(some, now, around.model, parameters)
    variance, interval = readings.variance(rows, around.model), readings.interval[rows].tolist()
    for at_epoch, *one in zip(epoch.tolist(), rows.tolist(), residual, h, variance, interval, strict=True):
        observed.setdefault(at_epoch, []).append(Observed(sensor, *one))
