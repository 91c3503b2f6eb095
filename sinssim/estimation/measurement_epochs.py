"""Checks the readings, sorts them by their time of validity, and lays out the filter's epochs.

Measurements that no filter could use raise an error: an unknown kind, inconsistent shapes, a standard deviation that is
not positive (R would not be positive definite), a reading that arrives before it is valid. Single unusable readings are
skipped, each with a reason.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from sinssim.arguments import POSITIVE, doubles, first_not_finite, number
from sinssim.data import Array, Measurements
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.estimation.filter_result import Reasons
from sinssim.estimation.state_model import BLOCKS, ErrorModel, of_sensors
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.system.process import shared

Numbers = NDArray[np.int32]
"""Numbers of epochs and edges, half as long in memory as indices usually are."""

_SAME = 1e-6
"""Instants closer together than this are one epoch, s; a jet moves by less than a millimetre in that time."""


@dataclass(frozen=True)
class CheckedMeasurements:
    """The readings of one sensor in the order of their validity."""

    data: Measurements  # all of them
    reason: Reasons  # why a reading cannot be used, "" if it can, M sentences
    epoch: Numbers  # number of each usable reading's epoch, (M,); −1 for the others
    interval: Array  # averaging interval of a zero-rate reading, (M,) s; zero for other kinds

    @cached_property
    def usable(self) -> NDArray[np.intp] | slice:
        """The usable readings: their numbers, (U,), or a slice if all are."""
        if not self.reason.sentences:
            return slice(None)
        return np.delete(np.arange(len(self.reason)), list(self.reason.sentences))

    @cached_property
    def _epoch_of_usable(self) -> Numbers:
        return self.epoch[self.usable]

    def between(self, first: int, last: int) -> NDArray[np.intp]:
        """Return the numbers of the usable readings at the epochs first … last."""
        begin, end = np.searchsorted(self._epoch_of_usable, np.array((first, last + 1), dtype=np.int32))
        return np.arange(begin, end) if isinstance(self.usable, slice) else self.usable[begin:end]

    def variance(self, rows: NDArray[np.intp], model: ErrorModel) -> Array:
        """Return the diagonal of R for some readings, (R, k), with inertial noise that no state describes."""
        noise = measurement_kind(self.data.kind).noise(model, np.maximum(self.interval[rows], _SAME))
        return np.asarray(self.data.sigma[rows] ** 2 + noise[:, None])

    def covariance(self, row: int, variance: Array) -> Array:
        """Return R of a reading, (k, k), from its diagonal; the correlations are those of the sensor's own errors."""
        r = np.diag(variance)
        if self.data.correlation is not None:
            sigma = self.data.sigma[row]
            r += np.outer(sigma, sigma) * (self.data.correlation[row] - np.eye(len(sigma)))
        return r


@dataclass(frozen=True)
class Epochs:
    """The instants at which the filter predicts."""

    time: Array  # (E,) s, the first being the start of the data
    edge: Numbers  # number of the last edge of the IMU's intervals at or before each epoch, (E,)
    on_edge: NDArray[np.bool_]  # whether the epoch is at that edge, (E,)
    second: NDArray[np.bool_]  # whether the epoch is at a whole second, (E,)


def take_in(
    measurements: Sequence[Measurements], model: ErrorModel, time: Array, rate_hz: float
) -> tuple[list[CheckedMeasurements], Epochs]:
    """Check readings and lay out the epochs: the instants of prediction, and all instants of validity.

    `time` are the edges of the IMU's intervals, (N+1,) s; the interval of the prediction is rounded to whole samples.
    """
    rate_hz = number("rate_hz", rate_hz, "predictions of the covariance a second", low=POSITIVE)
    if isinstance(measurements, Measurements):
        raise InputError(
            "measurements must be a sequence with one entry per sensor; write [measurements] for a single sensor."
        )
    if not isinstance(measurements, Sequence) or not all(isinstance(m, Measurements) for m in measurements):
        raise InputError(f"measurements must be a list of Measurements, not {shortened(repr(measurements))}.")
    for m in measurements:
        measurement_kind(m.kind)
        if not isinstance(m.name, str):
            raise InputError(f"name = {shortened(repr(m.name))} of measurements of {m.kind!r} must be text.")
    _check_blocks(measurements, model)
    count = len(time) - 1
    stride = max(round(min(count / float(time[-1] - time[0]) / rate_hz, count)), 1)
    grid = np.unique(np.append(np.arange(0, count, stride), count))
    readings = [_checked(m, time) for m in measurements]
    wanted = [r.data.time[r.usable] for r in readings]
    wanted += [(r.data.time - r.interval)[r.usable] for r in readings if measurement_kind(r.data.kind).mean_rate]
    instants = np.unique(np.concatenate([time[:1], *wanted]))
    near = np.clip(np.searchsorted(time, instants), 1, count)
    near -= time[near] - instants > instants - time[near - 1]
    snapped = np.abs(time[near] - instants) <= _SAME
    edges = np.union1d(grid, near[snapped])
    loose = instants[~snapped]
    loose = loose[np.diff(loose, prepend=-np.inf) > _SAME]

    instant = np.concatenate([time[edges], loose])
    order = np.argsort(instant)
    edge = np.concatenate([edges, np.searchsorted(time, loose, side="right") - 1])[order]
    on_edge = (np.arange(len(instant)) < len(edges))[order]
    per_second = max(round(count / float(time[-1] - time[0]) / stride), 1) * stride
    second = on_edge & ((edge % per_second == 0) | (edge == count))
    epochs = Epochs(shared(instant[order], [time]), edge.astype(np.int32), on_edge, second)
    numbers: list[Numbers] = []  # sensors of one rate are read at the same epochs
    for k, reading in enumerate(readings):
        reading.epoch[reading.usable] = _nearest(epochs.time, reading.data.time[reading.usable])
        readings[k] = replace(reading, epoch=shared(reading.epoch, numbers))
    return readings, epochs


def _nearest(sorted_times: Array, instants: Array) -> NDArray[np.intp]:
    if len(sorted_times) == 1:
        return np.zeros(len(instants), dtype=np.intp)
    after = np.clip(np.searchsorted(sorted_times, instants), 1, len(sorted_times) - 1)
    before_is_nearer = sorted_times[after] - instants > instants - sorted_times[after - 1]
    return np.asarray(after - before_is_nearer)


def _check_blocks(measurements: Sequence[Measurements], model: ErrorModel) -> None:
    """Raise for two sensors of one name, and for blocks of unknown sensors."""
    labels = [m.label for m in measurements]
    if len(set(labels)) < len(labels):
        twice = next(label for label in labels if labels.count(label) > 1)
        raise InputError(f"two sensors are called {twice!r}; give each a unique name.")
    for block in model.blocks:
        if block.name in BLOCKS:
            continue
        what = next(end for end in of_sensors() if block.name.endswith(end))
        sensor = block.name.removesuffix(what)
        if sensor not in labels:
            raise unknown_name(f"sensor of the block {block.name!r}", sensor, labels)
        name = measurements[labels.index(sensor)].kind
        kind = measurement_kind(name)
        sizes = {" bias": kind.errors} | {f" {error}": len(axes) for error, (axes, _) in kind.own_errors.items()}
        sizes |= {" scale": 1} if kind.components == 1 else {}
        sizes |= {} if kind.mean_rate else {" delay": 1}
        if block.size != sizes.get(what):
            fitting = ", ".join(f"{sensor}{error!s} ({size})" for error, size in sizes.items())
            raise InputError(
                f"block {block.name!r} has {block.size} states; measurements of {sensor!r} are of kind {name!r}, whose "
                f"blocks of states are {fitting}."
            )


def _checked(m: Measurements, imu_time: Array) -> CheckedMeasurements:
    kind, label = measurement_kind(m.kind), m.label
    time, arrival, value, arm = (
        doubles(f"measurements of {label!r}: {name}", getattr(m, name))
        for name in ("time", "arrival", "value", "lever_arm")
    )
    # one row that stands for all readings stays one row in memory
    sigma = m.sigma if _is_one_row(m.sigma) else doubles(f"measurements of {label!r}: sigma", m.sigma)
    count = len(time)
    shapes = ((count,), (count,), (count, kind.components), (count, kind.errors), (3,))
    given = (time.shape, arrival.shape, value.shape, sigma.shape, arm.shape)
    if given != shapes:
        raise InputError(
            f"measurements of {label!r}: time, arrival, value, sigma and lever_arm have the shapes {given}; {count} "
            f"measurements of kind {m.kind!r} have {shapes}."
        )
    for name, array in (("time", time), ("arrival", arrival), ("lever_arm", arm)):
        row = first_not_finite(array)
        if row is not None:
            raise InputError(f"measurements of {label!r}: {name}[{row}] = {array[row]} is not a finite number.")
    bad = ~(np.isfinite(sigma) & (sigma > 0.0)).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(
            f"measurements of {label!r}: sigma[{row}] = {sigma[row]} at t = {time[row]:.6g} s; every 1σ must be a "
            "positive number, or R is not positive definite."
        )
    if m.correlation is not None:
        _check_correlation(doubles(f"measurements of {label!r}: correlation", m.correlation), label, sigma.shape)
    if np.any(arrival < time):
        row = int(np.argmax(arrival < time))
        raise InputError(
            f"measurements of {label!r}: measurement {row} is valid at t = {time[row]:.6f} s and arrives at "
            f"{arrival[row]:.6f} s, which is earlier; a measurement must not arrive before it is valid."
        )
    if np.any(time[1:] < time[:-1]):
        order = np.argsort(time, kind="stable")
        time, arrival, value, sigma = time[order], arrival[order], value[order], sigma[order]
        m = m if m.correlation is None else replace(m, correlation=m.correlation[order])
    data = replace(m, time=time, arrival=arrival, value=value, sigma=sigma, lever_arm=arm)
    interval = np.broadcast_to(0.0, count)
    if kind.mean_rate and count:
        interval = averaging_intervals(time, float(imu_time[0]))
    return CheckedMeasurements(data, _reasons(data, imu_time), np.full(count, -1, dtype=np.int32), interval)


def averaging_intervals(time: Array, start: float) -> Array:
    """Return the time since the previous zero-rate reading, over which the gyros are averaged, (M,) s.

    After a pause, or at the time of a reading that is not used, it is the usual interval.
    """
    interval = np.diff(time, prepend=start)
    usual = float(np.min(interval[interval > _SAME], initial=np.inf))
    return np.where((interval > 1.5 * usual) | (interval <= _SAME), usual, interval)


def _check_correlation(correlation: Array, label: str, shape: tuple[int, ...]) -> None:
    """Raise for correlations that are none."""
    if correlation.shape != (*shape, shape[-1]):
        raise InputError(
            f"measurements of {label!r}: correlation has the shape {correlation.shape}; with sigma it is "
            f"{(*shape, shape[-1])}."
        )
    if not len(correlation):
        return
    unit = np.abs(np.einsum("mii->mi", correlation) - 1.0).max(axis=1) < 1e-9
    even = np.abs(correlation - np.swapaxes(correlation, 1, 2)).max(axis=(1, 2)) < 1e-9
    bad = ~(unit & even & (np.linalg.eigvalsh(np.nan_to_num(correlation)).min(axis=1) > 0.0))
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(
            f"measurements of {label!r}: correlation[{row}] is not a correlation matrix: it must be symmetric and "
            "positive definite, with ones on the diagonal."
        )


def _is_one_row(sigma: Array) -> bool:
    """Return whether an array of doubles repeats one row that it holds in memory once."""
    return type(sigma) is np.ndarray and sigma.dtype == np.float64 and sigma.ndim == 2 and sigma.strides[0] == 0


def _reasons(data: Measurements, imu_time: Array) -> Reasons:
    """Return why each reading cannot be used, "" for one that can."""
    finite = np.asarray(np.isfinite(data.value).all(axis=1))
    begin = float(imu_time[0]) - _SAME
    kind = measurement_kind(data.kind)
    if kind.mean_rate:
        begin = float(imu_time[0]) + _SAME  # there is no earlier interval to compare it with
    reasons: dict[int, str] = {}
    last = -np.inf
    for k, t in enumerate(data.time.tolist()):
        if not finite[k]:
            reason = "not a finite number"
        elif t < begin:
            reason = "valid before the inertial data begin"
        elif t > imu_time[-1] + _SAME:
            reason = "valid after the inertial data end"
        elif t - last <= _SAME:
            reason = "a second measurement at the same time"
        else:
            reason = kind.fault(data.value[k])
            last = last if reason else t
        if reason:
            reasons[k] = reason
    return Reasons(len(data), reasons)


class Waiting(Protocol):
    """An estimate from the readings that arrive before an instant, s; infinity for the one from all readings."""

    until: float

    def fork(self, until: float) -> Self:
        """Return a copy that continues with the readings that arrive before an instant, s."""


B = TypeVar("B", bound=Waiting)


class Branches(Generic[B]):
    """The estimate from all readings, and one for each instant at which a late reading has yet to arrive."""

    def __init__(self, main: B) -> None:
        self.main = main
        self.waiting: list[B] = []  # in the order of their arrivals

    def every(self) -> list[B]:
        """Return all branches; the one with all readings is last."""
        return [*self.waiting, self.main]

    def wait(self, arrival: float) -> None:
        """Open a branch that lacks the readings arriving at an instant, until that instant."""
        branches = self.every()
        k = next(k for k, branch in enumerate(branches) if branch.until > arrival - _SAME)
        if branches[k].until > arrival + _SAME:
            self.waiting.insert(k, branches[k].fork(arrival))

    def holding(self, arrival: float) -> Iterator[B]:
        """Yield the waiting branches that hold a reading with this arrival time."""
        return (branch for branch in self.waiting if arrival < branch.until - _SAME)

    def known(self, now: float) -> B:
        """Return the estimate from the readings that have arrived, and drop branches that are no longer needed."""
        while self.waiting and self.waiting[0].until <= now + _SAME:
            self.waiting.pop(0)
        return self.waiting[0] if self.waiting else self.main
