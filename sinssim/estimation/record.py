"""Records estimates, covariances and innovations during the filter's run and assembles them into the result."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.estimation.intake import CheckedMeasurements, Epochs
from sinssim.estimation.kalman import Innovation
from sinssim.estimation.model import NAVIGATION, ErrorModel
from sinssim.estimation.nominal import rows_of, solution_of
from sinssim.estimation.result import History, Innovations, Reasons, corrected
from sinssim.sensors.aiding.base.measurement import CORE


class InnovationGate:
    """The χ² gate of one sensor and the record of its innovations.

    Args:
        readings: the sensor's readings.
        probability: probability that a correct reading is rejected; None for no gate.
    """

    def __init__(self, readings: CheckedMeasurements, probability: float | None) -> None:
        count, k = readings.data.sigma.shape
        self._data = readings.data
        self._told = dict(readings.reason.told)
        self._accepted = np.zeros(count, dtype=bool)
        self._value = np.full((count, k), np.nan)
        self._triangle = np.tril_indices(k)
        self._lower = np.full((count, len(self._triangle[0])), np.nan)
        self._nis = np.full(count, np.nan)
        self._bound = math.inf if probability is None else float(scipy.special.chdtri(k, probability))

    def passes(self, row: int, innovation: Innovation) -> bool:
        """Decide whether a reading may update the filter, and record the decision."""
        self._value[row], self._nis[row] = innovation.value, innovation.nis
        self._lower[row] = innovation.covariance[self._triangle]
        passed = self.admits(innovation)
        self._accepted[row] = passed
        self._told.pop(row, None)
        if not passed:
            self._told[row] = f"NIS {innovation.nis:.3g} is beyond the gate, {self._bound:.3g}"
        return passed

    def admits(self, innovation: Innovation) -> bool:
        """Return whether a reading would update the filter; nothing is recorded."""
        return innovation.nis <= self._bound

    def skip(self, row: int, reason: str) -> None:
        """Record why a reading is not compared with the prediction."""
        self._told[row] = reason

    def innovations(self) -> Innovations:
        """Return the record."""
        return Innovations(
            self._data.label, self._data.kind, self._data.time, self._value, self._lower, self._nis,
            self._accepted, Reasons(len(self._nis), self._told), self._bound,
        )  # fmt: skip


@dataclass
class HistoryRow:
    """The filter at one epoch after all of its readings, late ones included; see `History`."""

    covariance: Array
    state: Array
    transition: Array
    noise: Array
    information: Array
    decay: Array
    fed_back: Array


class _Rows:
    """Arrays of one shape, gathered one by one in one block of memory.

    Args:
        shape: shape of one array.
        expected: expected number of arrays.
    """

    def __init__(self, shape: tuple[int, ...], expected: int) -> None:
        self._all, self.count = np.empty((expected, *shape)), 0

    def append(self, row: Array) -> None:
        """Add one array."""
        if self.count == len(self._all):
            more = np.empty((1 + self.count // 8, *self._all.shape[1:]))
            self._all = np.concatenate([self._all, more])
        self._all[self.count] = row
        self.count += 1

    def first(self, count: int) -> Array:
        """Return the first `count` arrays, (count, …)."""
        return self._all[:count]


class Record:
    """The record of the estimate at all epochs, and of the covariance at some.

    Args:
        model: the error model.
        epochs: epochs of the filter.
        ellipsoid: reference ellipsoid.
        expected: expected number of stored rows.
        history: whether the rows have a history.
    """

    def __init__(
        self, model: ErrorModel, epochs: Epochs, ellipsoid: Ellipsoid, expected: int, *, history: bool
    ) -> None:
        count, n = len(epochs.time), model.size
        self._model, self._epochs, self._ellipsoid = model, epochs, ellipsoid
        self._sensors, self._variance = np.zeros((count, n - CORE)), np.zeros((count, n))
        self._stretch: list[tuple[Array, Array]] = []  # estimate and variances at the epochs of the current segment
        self._solution = NavState(*(np.empty((count, *shape)) for shape in ((), (), (), (3,), (4,))))
        self._rows: list[int] = []
        self._expected = expected if history else 0
        self._covariance = _Rows((n, n), expected)
        self._complete = self._covariance  # with all readings; it differs only where a late one is pending
        vectors, matrices = ("state", "fed_back", "compensated"), ("transition", "noise", "information", "decay")
        self._history = {name: _Rows((n,), self._expected) for name in vectors}
        self._history |= {name: _Rows((n, n), self._expected) for name in matrices}
        self._navigation: list[NavState] = []

    def note(self, x: Array, covariance: Array) -> None:
        """Record the estimate at the next epoch of the segment; the arrays must not change afterwards."""
        self._stretch.append((x, covariance.diagonal()))

    def keep(self, epoch: int, covariance: Array, row: HistoryRow | None) -> None:
        """Keep the covariance at an epoch, and the row of the history."""
        if row is not None:
            if self._complete is self._covariance and row.covariance is not covariance:
                self._complete = _Rows(covariance.shape, self._expected)
                for earlier in self._covariance.first(len(self._rows)):
                    self._complete.append(earlier)
            if self._complete is not self._covariance:
                self._complete.append(row.covariance)
            for name in ("transition", "noise", "information", "decay", "state", "fed_back"):
                self._history[name].append(getattr(row, name))
        self._rows.append(epoch)
        self._covariance.append(covariance)

    def end_stretch(
        self,
        first: int,
        navigation: NavState,
        compensated: Array,
        fed_back: Array,
        corrected_end: NavState,
        turn: Array | None = None,
    ) -> None:
        """Record the solution of a segment.

        Args:
            compensated: values of all compensated parameters in it, in the order of the states, (n,).
            fed_back: errors fed back at its end, (n,).
            turn: matrix into the axes there, (n, n); None if they are the same.
        """
        count = len(navigation.latitude)
        part = slice(first, first + count)
        errors = np.array([x for x, _ in self._stretch])
        self._variance[part] = [variance for _, variance in self._stretch]
        self._stretch = []
        for name, value in vars(corrected(navigation, errors[:, :CORE], self._ellipsoid, self._model.axes)).items():
            getattr(self._solution, name)[part] = value
        self._sensors[part] = errors[:, CORE:] + compensated[CORE:]
        history = self._history
        for row in range(len(self._navigation), history["state"].count):
            k = self._rows[row] - first
            if k < count - 1:
                self._navigation.append(rows_of(navigation, np.array([k])))  # a copy: a slice would keep all rows
                history["compensated"].append(compensated)
            else:
                self._navigation.append(corrected_end)
                history["compensated"].append(compensated + np.where(np.arange(len(fed_back)) < CORE, 0.0, fed_back))
                history["fed_back"].first(row + 1)[row] += fed_back
                history["state"].first(row + 1)[row] -= fed_back
        if turn is not None and self._rows and self._rows[-1] == first + count - 1:
            self._turn_last(turn)

    def _turn_last(self, turn: Array) -> None:
        """Refer the last row to other axes."""
        for rows in {id(r): r for r in (self._covariance, self._complete)}.values():
            last = rows.first(rows.count)[-1]
            last[...] = turn @ last @ turn.T
        if not self._history["state"].count:
            return
        for name in ("state", "fed_back", "transition", "decay"):
            last = self._history[name].first(self._history[name].count)[-1]
            last[...] = turn @ last
        last = self._history["noise"].first(self._history["noise"].count)[-1]
        last[...] = turn @ last @ turn.T

    def solution(self, count: int, algorithm: str) -> NavSolution:
        """Return the solution at the first `count` epochs."""
        return solution_of(self._epochs.time[:count], rows_of(self._solution, slice(0, count)), algorithm)

    def parameters(self, count: int) -> dict[str, Array]:
        """Return the estimated parameters at the first `count` epochs, by block."""
        blocks = self._model.blocks[len(NAVIGATION) :]
        at = ((block.name, self._model.slices[block.name]) for block in blocks)
        return {name: self._sensors[:count, part.start - CORE : part.stop - CORE] for name, part in at}

    def sigma(self, count: int) -> Array:
        """Return 1σ of every state at the first `count` epochs; it overwrites the variances, so call it once."""
        return np.asarray(np.sqrt(self._variance[:count], out=self._variance[:count]))

    def rows(self, count: int) -> tuple[NDArray[np.intp], Array]:
        """Return which of the first `count` epochs have a stored covariance, and the covariances."""
        kept = np.array([row for row in self._rows if row < count], dtype=np.intp)
        return kept, self._covariance.first(len(kept))

    def history(self) -> History:
        """Return the history of the stored rows."""
        count = len(self._navigation)
        names = vars(self._navigation[0])
        return History(
            time=self._epochs.time[self._rows[:count]],
            on_edge=self._epochs.on_edge[self._rows[:count]],
            covariance=self._complete.first(count),
            navigation=NavState(*(np.concatenate([getattr(n, name) for n in self._navigation]) for name in names)),
            **{name: rows.first(count) for name, rows in self._history.items()},
        )
