"""Branches of the filter for late readings: the estimate published at an instant holds only what has arrived.

The filter processes every reading at its instant of validity. Until a late reading arrives, a second filter runs in
parallel without that reading and processes all others that arrive before it. The solution published at an instant
therefore holds exactly the readings that had arrived by then, and a late sensor delays no other sensor. Each pending
arrival costs one additional filter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.estimation.kalman import ErrorFilter, Innovation
from sinssim.estimation.linearisation import Observed

_SAME = 1e-6
"""Arrivals closer together than this count as simultaneous, s."""


@dataclass
class Branch:
    """The estimate from the readings that arrive before an instant.

    Attributes:
        until: that instant, s; infinity for the estimate from all readings.
        filter: x and P.
        cross: covariance of the state's error with the gyros' noise since the last zero-rate reading, (n, 3), by number
            of the zero-rate sensor.
    """

    until: float
    filter: ErrorFilter
    cross: dict[int, Array]

    def fork(self, until: float) -> Branch:
        """Return a copy of the estimate that continues with the readings that arrive before an instant.

        Args:
            until: the instant, s.
        """
        copied = ErrorFilter(self.filter.covariance)
        copied.x = self.filter.x.copy()
        return Branch(until, copied, dict(self.cross))

    def turn(self, matrix: Array) -> None:
        """Refer the estimate to other axes, by the matrix from the present ones, (n, n)."""
        self.filter.turn(matrix)
        self.cross = {sensor: matrix @ noise for sensor, noise in self.cross.items()}

    def holds(self, arrival: float) -> bool:
        """Return whether a reading with this arrival time belongs to the branch."""
        return arrival < self.until - _SAME

    def predict(self, phi: Array, q: Array, came: dict[int, Array]) -> None:
        """Predict over one interval.

        Args:
            phi: Φ, (n, n).
            q: Q, (n, n).
            came: increase of `cross` by the gyros' noise in the interval, by sensor.
        """
        self.filter.predict(phi, q)
        for sensor, noise in came.items():
            self.cross[sensor] = phi @ self.cross[sensor] + noise

    def innovation(self, one: Observed, r: Array, interval: float) -> Innovation:
        """Return the innovation of a reading.

        Args:
            r: R, (k, k).
            interval: averaging interval of a zero-rate reading, s.
        """
        return self.filter.innovation(one.residual, one.h, r, self._common(one, interval))

    def take(self, one: Observed, r: Array, interval: float) -> None:
        """Update the estimate with a reading; the arguments are those of `innovation`."""
        self.filter.update(one.residual, one.h, r, self._common(one, interval))
        for sensor in self.cross:
            self.cross[sensor] = self.cross[sensor] - self.filter.gain @ (one.h @ self.cross[sensor])

    def _common(self, one: Observed, interval: float) -> Array | None:
        return self.cross[one.sensor] / interval if one.sensor in self.cross else None


class Branches:
    """The estimate from all readings, and one for each instant at which a late reading has yet to arrive.

    Args:
        covariance: P at the start, (n, n).
        zero_rate: numbers of the zero-rate sensors.
    """

    def __init__(self, covariance: Array, zero_rate: set[int]) -> None:
        cross = {sensor: np.zeros((len(covariance), 3)) for sensor in zero_rate}
        self.main = Branch(np.inf, ErrorFilter(covariance), cross)
        self.waiting: list[Branch] = []  # in the order of their arrivals

    def every(self) -> list[Branch]:
        """Return all branches; the one with all readings is last."""
        return [*self.waiting, self.main]

    def wait(self, arrival: float) -> None:
        """Open a branch that lacks the readings arriving at an instant, until that instant."""
        found = self.every()
        k = next(k for k, branch in enumerate(found) if branch.until > arrival - _SAME)
        if found[k].until > arrival + _SAME:
            self.waiting.insert(k, found[k].fork(arrival))

    def known(self, now: float) -> ErrorFilter:
        """Return the estimate from the readings that have arrived, and drop branches that are no longer needed."""
        while self.waiting and self.waiting[0].until <= now + _SAME:
            self.waiting.pop(0)
        return (self.waiting[0] if self.waiting else self.main).filter
