"""Fault detection, isolation and exclusion in a redundant set by the parity test, and its probabilities.

The statistic D = pᵀ C⁻¹ p of a parity vector p of n components with the covariance C has a χ² distribution with n
degrees of freedom as long as the errors are normal. C follows from the scenario's 1σ of all errors
(`redundant_errors`). A fault that adds f v_i to p makes the distribution non-central,

    (1) λ = f² v_iᵀ C⁻¹ v_i

With errors of one variance, C = σ² I, these are pᵀp/σ² and λ = f² |v_i|²/σ². The threshold T has the probability of
false alarm P{χ²_n > T}, and a fault is missed with the probability P{χ²_n(λ) < T}.

At every epoch the last sample and the last samples of each longer window are tested. Above the threshold, the fault is
credited to the sensor that explains most of the statistic. A fault of another sensor is less likely by the factor
exp(−½ Δ), where Δ is the difference of the two largest credits; a sensor is excluded once this factor is at most
1/1000. Until then the fault is detected but not isolated, and all sensors remain in use. An excluded sensor is not used
again. The readings from the epoch of the exclusion on are estimated without it. Those before are not corrected: a slow
fault has acted on the solution until it was found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.jit import strict_kernel
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.redundant_set_errors import Inputs, accumulated_inputs, noise_variance
from sinssim.sensors.sensor_set_section import FEWEST, Redundant, along, estimator, parity_matrix
from sinssim.sensors.single_sensors import SingleSensors


def threshold(false_alarm: float, freedom: int) -> float:
    """Return the threshold of the statistic with m − 3 degrees of freedom, which it exceeds without a fault with the
    probability `false_alarm`."""
    from scipy.special import chdtri

    if not 0.0 < false_alarm < 1.0:
        raise InputError(f"false_alarm = {false_alarm:g} must be a probability between 0 and 1.")
    if freedom < 1:
        raise InputError(f"freedom = {freedom} must be at least 1: three sensors have no redundancy.")
    return float(chdtri(freedom, false_alarm))


def missed_detection(noncentrality: float, false_alarm: float, freedom: int) -> float:
    """Return P{χ²(λ) < T}, the probability that a test misses a fault of the non-centrality λ (1)."""
    from scipy.special import chndtr

    return float(chndtr(threshold(false_alarm, freedom), freedom, noncentrality))


def smallest_noncentrality(missed: float, false_alarm: float, freedom: int) -> float:
    """Return the non-centrality of the smallest fault that a test misses with a probability, between 0 and 1 −
    false_alarm."""
    from scipy.optimize import brentq

    if not 0.0 < missed < 1.0 - false_alarm:
        raise InputError(f"missed = {missed:g} must be between 0 and 1 − false_alarm = {1.0 - false_alarm:g}.")
    most = 2.0 * threshold(false_alarm, freedom) + 200.0
    return float(brentq(lambda x: missed_detection(x, false_alarm, freedom) - missed, 0.0, most, xtol=1e-10))


def smallest_fault(columns: Array, covariance: Array, false_alarm: float, missed: float) -> Array:
    """Return the smallest fault of each sensor that a test finds with a probability: f of (1), (m,), in the unit of the
    readings; infinite for a sensor whose fault is not seen. V is (m − 3, m), the covariance that of the parity
    vector."""
    seen = np.einsum("ai,ab,bi->i", columns, np.linalg.inv(covariance), columns)
    least = smallest_noncentrality(missed, false_alarm, len(columns))
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(least / np.where(seen < 1e-12 * seen.max(), 0.0, seen)))


WRONG_ISOLATION = 1e-3
"""Largest probability of another sensor's fault, relative to that of the one that is excluded."""


@dataclass(frozen=True)
class Alarm:
    """A fault that was detected."""

    detected: float  # time of the first test above its threshold, s
    window: float  # length of the window that detected it, s; one interval for a single sample
    statistic: float
    threshold: float
    last: float  # time of the last test above its threshold, s; of the isolation, if the fault was isolated
    isolated: float | None = None  # time from which the sensor is excluded, s; None if the fault was not isolated
    sensor: int | None = None  # number of the sensor, from 1; None if the fault was not isolated


@dataclass(frozen=True)
class Monitored:
    """What the monitoring found for the sensors of one kind."""

    kind: str  # "gyro" or "accel"
    windows: Array  # length of each window, s, (W,); the first is one interval
    # statistic of each window at the end of each sample, (W, N); NaN before a window is complete, and where no
    # redundancy is left. At the epoch of an exclusion, it is the one that led to it.
    statistic: Array
    threshold: Array  # threshold of the statistic, (N,); NaN where no redundancy is left
    # smallest constant fault of each sensor that each window finds with the stated probability, at the start of the
    # run, (W, m) rad/s or m/s²; NaN for windows longer than the run
    smallest: Array
    alarms: tuple[Alarm, ...]  # faults detected, in order
    used: Array  # whether each sensor is used in each sample, (N, m)

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
    """Return the least-squares estimate (N, 3), in the axes of the block, from increments (N, m) of the sensors that
    are used in each sample, (N, m), by default all."""
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
    """Test the readings of a redundant set against each other, gyros and accelerometers; `time` are the edges of the
    samples, (N+1,) s."""
    sensor_set = imu.sensor_set
    assert isinstance(sensor_set, Redundant)
    force = combine(readings.dvel, sensor_set.axes)
    return (
        _monitor(_Kind("gyro", sensor_set, imu, time, readings.dtheta, force)),
        _monitor(_Kind("accel", sensor_set, imu, time, readings.dvel, force)),
    )


def _monitor(triad: _Kind) -> Monitored:
    """Test the sensors of one kind, excluding one after the other."""

    directions, rate = triad.set.axes, triad.imu.rate_hz
    epochs, count = triad.increments.shape
    counts = np.unique([1, *(max(round(window * rate), 2) for window in triad.set.windows_s)])
    statistic = np.full((len(counts), epochs), np.nan)
    limit, used = np.full(epochs, np.nan), np.ones((epochs, count), dtype=bool)
    start, exclude = triad.time - triad.time[0], triad.set.mode == "exclude"
    triad.active = list(range(count))
    alarms: list[Alarm] = []
    event = np.empty(5, np.int64)
    smallest = _smallest(triad, counts)
    kept: list[tuple[int, Array]] = []
    first, tested = 0, 0
    while first < epochs and len(triad.active) >= FEWEST:
        if tested != len(triad.active):  # at first, and after an exclusion
            tested = len(triad.active)
            columns = parity_matrix(directions[triad.active])
            bound = threshold(triad.set.false_alarm_probability, len(columns))
            limit[first:] = bound
            bounds = np.full(len(counts), bound)
            tests = Tests(bounds, counts, start, *_prepared(triad, counts), np.ascontiguousarray(columns))
        isolable = exclude and tested > FEWEST
        first = first_event(tests, first, isolable, 2.0 * math.log(1.0 / WRONG_ISOLATION), statistic, event)
        if event[DETECTED] < 0:
            break
        at, window = int(event[DETECTED]), int(event[BY_WINDOW])
        alarm = Alarm(
            float(triad.time[at + 1]), counts[window] / rate, float(statistic[window, at]), bound,
            float(triad.time[event[LAST] + 1]),
        )  # fmt: skip
        if event[ISOLATED] >= 0:
            sensor = triad.active.pop(int(event[SENSOR]))
            used[first:, sensor] = False
            kept.append((first, statistic[:, first].copy()))
            alarm = replace(alarm, isolated=float(triad.time[first + 1]), sensor=sensor + 1)
            if len(triad.active) < FEWEST:
                limit[first:] = np.nan
        alarms.append(alarm)
    for epoch, column in reversed(kept):  # what led to the exclusion, instead of the test of the others at this epoch
        statistic[:, epoch] = column
    return Monitored(triad.kind, counts / rate, statistic, limit, smallest, tuple(alarms), used)


def _prepared(triad: _Kind, counts: Array) -> tuple[Array, Array, Array, Array]:
    """Return what the kernel tests: accumulated residuals and inputs of the sensors in use, and their 1σ."""
    axes = triad.set.axes[triad.active]
    readings = np.ascontiguousarray(triad.increments[:, triad.active])
    combination = along(readings, estimator(axes))
    residual = np.zeros((len(readings) + 1, len(axes)))
    np.cumsum(
        readings - along(combination, axes), axis=0, out=residual[1:]
    )  # V y = V (y − H x̂), without the large part of y
    inputs = Inputs(triad.time - triad.time[0], combination, triad.force)
    base, coefficients = accumulated_inputs(triad.imu, triad.kind, axes, inputs)
    largest = float(np.abs(readings).max(initial=0.0))
    return residual, base, coefficients, noise_variance(triad.imu, triad.kind, counts, largest)


def _smallest(triad: _Kind, counts: Array) -> Array:
    """Return the smallest fault that each window finds at the start of the run, (W, m)."""
    directions = triad.set.axes
    columns = parity_matrix(directions)
    rows = min(int(counts[-1]), len(triad.increments))
    part = replace(
        triad,
        time=triad.time[: rows + 1],
        increments=triad.increments[:rows],
        force=triad.force[:rows],
        active=triad.active,
    )
    _, base, coefficients, noise = _prepared(part, counts)
    least = np.full((len(counts), len(directions)), np.nan)
    for w, samples in enumerate(counts):
        if samples < len(base):
            constant = np.einsum("kib,b->ki", coefficients, base[samples] - base[0])
            variance = noise[w, 0] + np.sum(constant**2, axis=0)
            covariance = (columns * variance) @ columns.T
            fault = smallest_fault(
                columns, covariance, triad.set.false_alarm_probability, triad.set.missed_detection_probability
            )
            least[w] = fault * triad.imu.rate_hz / samples
    return least


Whole = NDArray[np.int64]

DETECTED, BY_WINDOW, ISOLATED, SENSOR, LAST = range(5)
"""Entries of an event: epochs of detection, of isolation and of the last test over its threshold, −1 for none."""


class Tests(NamedTuple):
    """What is tested at every epoch, by W windows and m sensors.

    thresholds, counts: threshold of each window, and its samples, increasing, (W,).
    start: time of the edges since the start, (N+1,) s.
    residual: accumulated residuals of the readings, (N+1, m).
    base: accumulated inputs, (N+1, B).
    coefficients: 1σ of the errors per unit of input, (K, m, B).
    noise: variance of a window's noise, and its growth with the start of the window, (W, 2).
    columns: V, (n, m).
    """

    thresholds: Array
    counts: Whole
    start: Array
    residual: Array
    base: Array
    coefficients: Array
    noise: Array
    columns: Array


@strict_kernel
def _sum_window(of: Tests, w: int, since: int, end: int, readings: Array, variance: Array) -> None:
    """Write d and s² of the sensors for window w from edge `since` to edge `end`."""
    common = of.noise[w, 0] + of.noise[w, 1] * of.start[since]
    for i in range(len(readings)):
        readings[i] = of.residual[end, i] - of.residual[since, i]
        total = common
        for c in range(of.coefficients.shape[0]):
            part = 0.0
            for b in range(of.base.shape[1]):
                part += of.coefficients[c, i, b] * (of.base[end, b] - of.base[since, b])
            total += part * part
        variance[i] = total


@strict_kernel
def _whiten(factor: Array, a: int, total: float, z: Array) -> float:
    """Return element a of z = L⁻¹ x from x_a, `total`, and the elements before it."""
    for c in range(a):
        total -= factor[a, c] * z[c]
    return float(total / factor[a, a])


# By hand, at every epoch and window: numpy takes 6 to 19 times as long for one to five rows (0.4 to 0.9 µs).
@strict_kernel
def _statistic(columns: Array, readings: Array, variance: Array, factor: Array, parity: Array) -> float:
    """Return D; write the Cholesky factor L of C = V diag(s²) Vᵀ, and L⁻¹ p."""
    value = 0.0
    for a in range(len(columns)):
        for b in range(a + 1):
            total = 0.0
            for i in range(len(readings)):
                total += columns[a, i] * columns[b, i] * variance[i]
            for c in range(b):
                total -= factor[a, c] * factor[b, c]
            factor[a, b] = math.sqrt(total) if a == b else total / factor[b, b]
        total = 0.0
        for i in range(len(readings)):
            total += columns[a, i] * readings[i]
        parity[a] = _whiten(factor, a, total, parity)
        value += parity[a] * parity[a]
    return value


@strict_kernel
def _suspect(columns: Array, factor: Array, parity: Array, z: Array) -> tuple[int, float]:
    """Return the sensor with the largest credit, and by how much it exceeds the second; z is working memory."""
    best, second, suspect = -1.0, -1.0, -1
    for i in range(columns.shape[1]):
        above, below = 0.0, 0.0
        for a in range(len(columns)):
            z[a] = _whiten(factor, a, columns[a, i], z)
            above += z[a] * parity[a]
            below += z[a] * z[a]
        credit = above * above / below if below > 0.0 else 0.0
        if credit > best:
            best, second, suspect = credit, best, i
        elif credit > second:
            second = credit
    return suspect, best - second


@strict_kernel
def first_event(of: Tests, first: int, isolate: bool, gap: float, statistic: Array, event: Whole) -> int:
    """Test every window at every epoch until a fault is isolated, an alarm has ended, or the samples end.

    The parity vector p = V d of a window's summed readings d has the covariance C = V diag(s²) Vᵀ with

        s_i² = noise + Σ_k (Σ_b coefficients_kib Δbase_b)²

    where Δ is the difference between the window's end and its beginning. The statistic is D = pᵀ C⁻¹ p, and sensor i is
    credited with (v_iᵀ C⁻¹ p)²/(v_iᵀ C⁻¹ v_i), which is the part of D that a fault of this sensor explains. A fault is
    isolated if the largest credit exceeds the second by `gap`. D of each window and epoch, (W, N), and the event, (5,),
    are filled in.
    """
    freedom, sensors = of.columns.shape
    epochs = statistic.shape[1]
    factor, parity, z = np.empty((freedom, freedom)), np.empty(freedom), np.empty(freedom)
    readings, variance = np.empty(sensors), np.empty(sensors)
    event[:] = -1
    for k in range(first, epochs):
        over = False
        for w in range(len(of.counts)):
            since = k + 1 - of.counts[w]
            if since < 0:
                statistic[w, k] = np.nan
                continue
            _sum_window(of, w, since, k + 1, readings, variance)
            statistic[w, k] = _statistic(of.columns, readings, variance, factor, parity)
            if not statistic[w, k] > of.thresholds[w]:
                continue
            over = True
            if event[DETECTED] < 0:
                event[DETECTED], event[BY_WINDOW] = k, w
            if isolate:
                suspect, ahead = _suspect(of.columns, factor, parity, z)
                if ahead >= gap:
                    event[ISOLATED], event[SENSOR], event[LAST] = k, suspect, k
                    return k
        if over:
            event[LAST] = k
        elif event[DETECTED] >= 0 and k - event[LAST] > of.counts[-1]:
            return k
    return int(epochs)
