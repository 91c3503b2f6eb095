"""Linearises a segment of inertial navigation: Φ, Q, H and residuals of all its epochs at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sinssim.data import Array, Measurements, NavSolution, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.estimation.dynamics import dynamics, transition
from sinssim.estimation.intake import CheckedMeasurements, Epochs
from sinssim.estimation.measurements.kind import Prediction, measurement_kind, observe
from sinssim.estimation.model import ErrorModel
from sinssim.estimation.nominal import MeanGyroRates, at, motion, rows_of
from sinssim.sensors.imu.errors import ImuErrors


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
        c_nb: attitude in the middle of the interval, (K, 3, 3).
        observed: readings of each epoch that has any, in order of arrival.
    """

    first: int
    state: NavState
    interval: Array
    phi: Array
    q: Array
    c_nb: Array
    observed: dict[int, list[Observed]]


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
    """

    model: ErrorModel
    density: Array
    epochs: Epochs
    readings: list[CheckedMeasurements]
    gyros: MeanGyroRates
    gravity: str
    ellipsoid: Ellipsoid


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
    state = _at(nominal, time, around.ellipsoid)
    middle = _at(nominal, time[:-1] + 0.5 * interval, around.ellipsoid)
    rate = np.zeros((len(interval), 3))
    if "gyro scale" in model.slices or "gyro misalignment" in model.slices:
        lasts = interval > 0.0
        rate[lasts] = around.gyros.mean(time[:-1][lasts], time[1:][lasts], calibration)
    moving = motion(state, middle, interval, rate, around.gravity, around.ellipsoid)
    phi, q = transition(dynamics(model, moving, around.gravity, around.ellipsoid), around.density, interval)
    here = rows_of(state, slice(1, None))
    observed: dict[int, list[Observed]] = {}
    for sensor, readings in enumerate(around.readings):
        _observe(around, sensor, readings, first, last, here, calibration, parameters, observed)
    for at_once in observed.values():
        at_once.sort(key=lambda o: float(around.readings[o.sensor].data.arrival[o.row]))
    return Linearisation(first, here, interval, phi, q, moving.c_nb, observed)


def _at(nominal: NavSolution, time: Array, ellipsoid: Ellipsoid) -> NavState:
    # an instant this close before an edge counts as on it
    edge = np.searchsorted(nominal.time, time + 1e-7, side="right") - 1
    step = nominal.time[np.minimum(edge + 1, len(nominal.time) - 1)] - nominal.time[edge]
    passed = time - nominal.time[edge]
    passed[np.abs(passed) < 1e-7] = 0.0
    return at(nominal, edge, np.divide(passed, step, out=np.zeros_like(passed), where=step > 0.0), ellipsoid)


def _observe(
    around: Surroundings,
    sensor: int,
    readings: CheckedMeasurements,
    first: int,
    last: int,
    here: NavState,
    calibration: ImuErrors,
    parameters: Mapping[str, Array],
    observed: dict[int, list[Observed]],
) -> None:
    """Add one sensor's readings at the epochs first … last."""
    rows = readings.between(first, last)
    if not len(rows):
        return
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
