"""The gate of a filter: which readings may update it, and whether more are rejected than chance explains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy

from sinssim.estimation.consistency import FALSE_ALARM
from sinssim.estimation.filter_result import Divergence, Innovations, Reasons, Refusals

if TYPE_CHECKING:
    from sinssim.estimation.kalman_filter import Innovation
    from sinssim.estimation.measurement_epochs import CheckedMeasurements

CONTRADICTION_S, CONTRADICTION = 30.0, 10
"""Time, s, and number of readings, over which all readings must be rejected for a contradiction."""


class InnovationGate:
    """The χ² gate of one sensor, which rejects a correct reading with a probability, and its record of innovations."""

    def __init__(self, readings: CheckedMeasurements, probability: float | None) -> None:
        count, k = readings.data.sigma.shape
        self._data = readings.data
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
            self._accepted, Reasons(len(self._nis), self._reasons), self._bound,
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


def refusals(innovations: Innovations) -> Iterator[Refusals]:
    """Yield the spans in which the gate refused one reading after the other.

    A gate that refuses the share α of correct readings refuses m in a row somewhere among N with a probability of at
    most N αᵐ. Spans of which that is below `FALSE_ALARM` are named.
    """
    tested = np.flatnonzero(np.isfinite(innovations.nis))
    if not len(tested) or not math.isfinite(innovations.bound):
        return
    share = float(scipy.special.chdtrc(innovations.value.shape[1], innovations.bound))
    if not 0.0 < share < 1.0:
        return
    least = max(math.ceil(math.log(FALSE_ALARM / len(tested)) / math.log(share)), 2)
    refused = ~innovations.accepted[tested]
    edges = np.flatnonzero(np.diff(refused.astype(np.int8), prepend=0, append=0))
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if end - begin >= least:
            rows = tested[begin:end]
            off = tuple(float(value) for value in -np.mean(innovations.value[rows], axis=0))
            first, last = innovations.time[rows[[0, -1]]]
            yield Refusals(innovations.sensor, float(first), float(last), end - begin, off)
