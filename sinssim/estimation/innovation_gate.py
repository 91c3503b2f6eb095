"""The χ² gate of the innovations of each sensor, their monitor over minutes, and the contradiction of all sensors."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from sinssim.data import Array
from sinssim.estimation.filter_result import Divergence, Innovations, Reasons

if TYPE_CHECKING:
    from sinssim.estimation.measurement_epochs import CheckedMeasurements


class Innovation(NamedTuple):
    """Innovation ν, its covariance S, and νᵀS⁻¹ν."""

    value: Array
    covariance: Array
    nis: float

    @classmethod
    def of(cls, value: Array, covariance: Array) -> Innovation:
        """Return an innovation with its covariance; its square is NaN where that is singular."""
        try:
            squares = float(value @ np.linalg.solve(covariance, value))
        except np.linalg.LinAlgError:  # readings more accurate than doubles resolve beside P
            squares = np.nan
        return cls(value, covariance, squares)


CONTRADICTION_S, CONTRADICTION = 30.0, 10
"""Time, s, and number of readings, over which all readings must be rejected for a contradiction."""


_FALSE_ALARM = 1e-6
"""Probability that the innovations of one interval of a right filter alarm its monitor."""


WITHDRAWN = "withdrawn by the monitor of the innovations"
"""Reason of a reading that the filter no longer takes."""


class InnovationMonitor:
    """The sum of the accepted innovations of one sensor over minutes, in which an error shows that grows slowly.

    The innovations of a right filter are white. The sum of n normalised ones, z = L⁻¹ν with S = L Lᵀ, then has the
    covariance n, and its square over n is χ² distributed with the degrees of freedom of one.
    """

    def __init__(self, components: int, interval: float) -> None:
        self._interval = interval
        self._past: deque[tuple[float, Array]] = deque()
        self._sum = np.zeros(components)
        self._bound = float(scipy.special.chdtri(components, _FALSE_ALARM))

    def alarms(self, time: float, innovation: Innovation) -> bool:
        """Take an innovation, and return whether the sum over the interval before it contradicts a right filter."""
        lower = np.linalg.cholesky(innovation.covariance)
        z = scipy.linalg.solve_triangular(lower, innovation.value, lower=True)
        self._past.append((time, z))
        self._sum += z
        while self._past[0][0] < time - self._interval:
            self._sum -= self._past.popleft()[1]
        # at the beginning there are few innovations, whose sum would show the gate's work
        whole = time - self._past[0][0] > 0.5 * self._interval
        return whole and float(self._sum @ self._sum) / len(self._past) > self._bound


class InnovationGate:
    """The χ² gate of one sensor, which rejects a correct reading with a probability, and its record of innovations.

    Attributes:
        withdrawn: instant from which on no reading is taken, s.
    """

    def __init__(self, readings: CheckedMeasurements, probability: float | None, monitor_s: float = 0.0) -> None:
        count, k = readings.data.sigma.shape
        self._data, self.withdrawn = readings.data, math.inf
        self._monitor = InnovationMonitor(k, monitor_s) if monitor_s else None
        self._reasons = dict(readings.reason.sentences)
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
        self._reasons.pop(row, None)
        if not passed:
            self._reasons[row] = f"NIS {innovation.nis:.3g} is beyond the gate, {self._bound:.3g}"
        return passed

    def alarms(self, row: int, innovation: Innovation) -> bool:
        """Return whether the innovations until this reading, which has passed, contradict a right filter."""
        return self._monitor is not None and self._monitor.alarms(float(self._data.time[row]), innovation)

    def admits(self, innovation: Innovation) -> bool:
        """Return whether a reading would update the filter; nothing is recorded."""
        return innovation.nis <= self._bound

    def skip(self, row: int, reason: str) -> None:
        """Record why a reading is not compared with the prediction."""
        self._reasons[row] = reason

    def innovations(self) -> Innovations:
        """Return the record."""
        return Innovations(
            self._data.label, self._data.kind, self._data.time, self._value, self._lower, self._nis,
            self._accepted, Reasons(len(self._nis), self._reasons), self._bound, self.withdrawn,
        )  # fmt: skip


def contradiction(innovations: Sequence[Innovations]) -> Divergence | None:
    """Return the first period in which the gate rejected every reading of every sensor; None if there is none."""
    refused = [np.flatnonzero(~i.accepted & ~np.isnan(i.nis)) for i in innovations]
    time = np.concatenate([i.time[rows] for i, rows in zip(innovations, refused, strict=True)] or [np.zeros(0)])
    if not len(time):
        return None
    sensor = np.repeat(np.arange(len(innovations)), [len(rows) for rows in refused])
    order = np.argsort(time, kind="stable")
    time, sensor, row = time[order], sensor[order], np.concatenate(refused)[order]
    # rejected readings with as many accepted ones before them follow one another; of simultaneous readings, the one of
    # the earlier sensor is the first
    before = np.zeros(len(time), dtype=np.intp)
    for number, i in enumerate(innovations):
        accepted = i.time[i.accepted]
        later = sensor > number
        before += np.where(later, np.searchsorted(accepted, time, "right"), np.searchsorted(accepted, time, "left"))
    edges = np.flatnonzero(np.diff(before, prepend=-1, append=-1)).tolist()
    for begin, end in pairwise(edges):
        lasting = time[end - 1] - time[begin]
        if end - begin >= CONTRADICTION and lasting >= CONTRADICTION_S:
            which = f"{innovations[sensor[begin]].sensor} {row[begin]} (valid at {time[begin]:.3f} s)"
            return Divergence(
                float(time[begin]),
                which,
                f"from this measurement on, the gate rejected all {end - begin} measurements in {lasting:.0f} s: "
                "either the sensors are wrong, or the filter is overconfident",
            )
    return None
