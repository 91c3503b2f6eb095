"""Monitors the sensors of a redundant set against each other: detection, isolation and exclusion of faults.

At every epoch the last sample and the last samples of each longer window are tested (`parity_kernel`). The statistic
pᵀC⁻¹p, which is pᵀp/σ² if all sensors have the same σ, exceeds its threshold with the stated probability if no sensor
is faulty; C follows from the scenario's 1σ of all errors (`uncertainty`). Above the threshold, the fault is credited
to the sensor that explains most of the statistic. A fault of another sensor is less likely by the factor exp(−½ Δ),
where Δ is the difference of the two largest credits; a sensor is excluded once this factor is at most 1/1000. Until
then the fault is detected but not isolated, and all sensors remain in use. An excluded sensor is not used again.

The readings from the epoch of the exclusion on are estimated without the sensor. Those before are not corrected: a slow
fault has acted on the solution until it was found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from sinssim.data import Array
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.sets.detection import smallest_fault, threshold
from sinssim.sensors.sets.geometry import FEWEST, along, estimator, parity_matrix
from sinssim.sensors.sets.sensor_set import Redundant
from sinssim.sensors.sets.single_sensors import SingleSensors
from sinssim.sensors.sets.uncertainty import Inputs, accumulated_inputs, noise_variance

WRONG_ISOLATION = 1e-3
"""Largest probability of another sensor's fault, relative to that of the one that is excluded."""


@dataclass(frozen=True)
class Alarm:
    """A fault that was detected.

    Attributes:
        detected: time of the first test above its threshold, s.
        window: length of the window that detected it, s; one interval for a single sample.
        statistic: its statistic.
        threshold: the threshold.
        last: time of the last test above its threshold, s; of the isolation, if the fault was isolated.
        isolated: time from which the sensor is excluded, s; None if the fault was not isolated.
        sensor: number of the sensor, from 1; None if the fault was not isolated.
    """

    detected: float
    window: float
    statistic: float
    threshold: float
    last: float
    isolated: float | None = None
    sensor: int | None = None


@dataclass(frozen=True)
class Monitored:
    """What the monitoring found for the sensors of one kind.

    Attributes:
        kind: "gyro" or "accel".
        windows: length of each window, s, (W,); the first is one interval.
        statistic: statistic of each window at the end of each sample, (W, N); NaN before a window is complete, and
            where no redundancy is left. At the epoch of an exclusion, it is the one that led to it.
        threshold: threshold of the statistic, (N,); NaN where no redundancy is left.
        smallest: smallest constant fault of each sensor that each window finds with the stated probability, at the
            start of the run, (W, m) rad/s or m/s²; NaN for windows longer than the run.
        alarms: faults detected, in order.
        used: whether each sensor is used in each sample, (N, m).
    """

    kind: str
    windows: Array
    statistic: Array
    threshold: Array
    smallest: Array
    alarms: tuple[Alarm, ...]
    used: Array

    @property
    def excluded(self) -> tuple[Alarm, ...]:
        """The alarms that excluded a sensor."""
        return tuple(alarm for alarm in self.alarms if alarm.sensor is not None)


@dataclass
class _Kind:
    """The sensors of one kind while they are monitored."""

    kind: str
    set: Redundant
    imu: Imu
    time: Array
    increments: Array
    force: Array
    active: list[int] = field(default_factory=list)


def combine(increments: Array, directions: Array, used: Array | None = None) -> Array:
    """Return the least-squares estimate from the sensors that are used in each sample.

    Args:
        increments: readings of the single sensors, (N, m).
        directions: sensitive axes, (m, 3).
        used: whether each sensor is used in each sample, (N, m); default: all.

    Returns:
        Increments in the block's axes, (N, 3).

    Raises:
        InputError: the sensors that are used do not span three dimensions.
    """
    if used is None or used.all():
        return along(increments, estimator(directions))
    estimate = np.empty((len(increments), 3))
    cuts = np.flatnonzero(np.any(np.diff(used, axis=0), axis=1)) + 1
    edges = [0, *cuts.tolist(), len(increments)]
    for begin, end in pairwise(edges):
        weights = used[begin].astype(np.float64)
        estimate[begin:end] = along(increments[begin:end], estimator(directions, weights))
    return estimate


def monitor(imu: Imu, time: Array, readings: SingleSensors) -> tuple[Monitored, Monitored]:
    """Test the readings of a redundant set against each other.

    Args:
        imu: the sensor block, whose sensor set is redundant and monitored.
        time: edges of the samples, (N+1,) s.

    Raises:
        InputError: an error is stated of which the test does not know the effect.
    """
    own = imu.sensor_set
    assert isinstance(own, Redundant)
    force = combine(readings.dvel, own.axes)
    return (
        _monitor(_Kind("gyro", own, imu, time, readings.dtheta, force)),
        _monitor(_Kind("accel", own, imu, time, readings.dvel, force)),
    )


def _monitor(one: _Kind) -> Monitored:
    """Test the sensors of one kind, excluding one after the other."""
    from sinssim.sensors.sets.parity_kernel import BY_WINDOW, DETECTED, ISOLATED, LAST, SENSOR, first_event

    directions, rate = one.set.axes, one.imu.rate_hz
    epochs, count = one.increments.shape
    counts = np.unique([1, *(max(round(window * rate), 2) for window in one.set.windows_s)])
    statistic = np.full((len(counts), epochs), np.nan)
    limit, used = np.full(epochs, np.nan), np.ones((epochs, count), dtype=bool)
    start, exclude = one.time - one.time[0], one.set.mode == "exclude"
    one.active = list(range(count))
    alarms: list[Alarm] = []
    event = np.empty(5, np.int64)
    smallest = _smallest(one, counts)
    kept: list[tuple[int, Array]] = []
    first, tested = 0, 0
    while first < epochs and len(one.active) >= FEWEST:
        if tested != len(one.active):  # at first, and after an exclusion
            tested = len(one.active)
            columns = parity_matrix(directions[one.active])
            bound = threshold(one.set.false_alarm_probability, len(columns))
            limit[first:] = bound
            residual, base, coefficients, noise = _prepared(one, counts)
            scratch = np.zeros((len(columns) + 4, tested))
        isolable = exclude and tested > FEWEST
        first = first_event(
            first, isolable, 2.0 * math.log(1.0 / WRONG_ISOLATION), np.full(len(counts), bound), counts, start,
            residual, base, coefficients, noise, columns, scratch, statistic, event,
        )  # fmt: skip
        if event[DETECTED] < 0:
            break
        at, window = int(event[DETECTED]), int(event[BY_WINDOW])
        found = Alarm(
            float(one.time[at + 1]), counts[window] / rate, float(statistic[window, at]), bound,
            float(one.time[event[LAST] + 1]),
        )  # fmt: skip
        if event[ISOLATED] >= 0:
            sensor = one.active.pop(int(event[SENSOR]))
            used[first:, sensor] = False
            kept.append((first, statistic[:, first].copy()))
            found = Alarm(
                found.detected, found.window, found.statistic, bound, found.last, float(one.time[first + 1]), sensor + 1
            )
            if len(one.active) < FEWEST:
                limit[first:] = np.nan
        alarms.append(found)
    for epoch, column in reversed(kept):  # what led to the exclusion, instead of the test of the others at this epoch
        statistic[:, epoch] = column
    return Monitored(one.kind, counts / rate, statistic, limit, smallest, tuple(alarms), used)


def _prepared(one: _Kind, counts: Array) -> tuple[Array, Array, Array, Array]:
    """Return what the kernel tests: accumulated residuals and inputs of the sensors in use, and their 1σ."""
    axes = one.set.axes[one.active]
    readings = np.ascontiguousarray(one.increments[:, one.active])
    own = along(readings, estimator(axes))
    residual = np.zeros((len(readings) + 1, len(axes)))
    np.cumsum(readings - along(own, axes), axis=0, out=residual[1:])  # V y = V (y − H x̂), without the large part of y
    inputs = Inputs(one.time - one.time[0], own, one.force)
    base, coefficients = accumulated_inputs(one.imu, one.kind, axes, inputs)
    largest = float(np.abs(readings).max(initial=0.0))
    return residual, base, coefficients, noise_variance(one.imu, one.kind, counts, largest)


def _smallest(one: _Kind, counts: Array) -> Array:
    """Return the smallest fault that each window finds at the start of the run, (W, m)."""
    directions = one.set.axes
    columns = parity_matrix(directions)
    rows = min(int(counts[-1]), len(one.increments))
    part = replace(
        one, time=one.time[: rows + 1], increments=one.increments[:rows], force=one.force[:rows], active=one.active
    )
    _, base, coefficients, noise = _prepared(part, counts)
    least = np.full((len(counts), len(directions)), np.nan)
    for w, samples in enumerate(counts):
        if samples < len(base):
            constant = np.einsum("kib,b->ki", coefficients, base[samples] - base[0])
            variance = noise[w, 0] + np.sum(constant**2, axis=0)
            covariance = (columns * variance) @ columns.T
            fault = smallest_fault(
                columns, covariance, one.set.false_alarm_probability, one.set.missed_detection_probability
            )
            least[w] = fault * one.imu.rate_hz / samples
    return least
