"""Branches of the filter for late readings: the estimate published at an instant holds only what has arrived.

The filter takes every reading in at its instant of validity. While a late one is on its way, a second filter goes on
beside it without that reading, and takes in all others that arrive before it. So the solution that is published at an
instant holds every reading that had arrived by then and no other: a late sensor delays no other sensor. There is one
filter more for each arrival that lies ahead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.estimation.kalman import ErrorFilter, Innovation
from sinssim.estimation.linearisation import Observed

_SAME = 1e-6
"""Arrivals nearer than this are one, s."""


@dataclass
class Branch:
    """The estimate by the readings that arrive before an instant.

    Attributes:
        until: that instant, s; infinity for the estimate by all readings.
        filter: x and P.
        cross: covariance of the state's error with the gyros' noise since the last zero-rate reading, (n, 3), by number
            of the zero-rate sensor.
    """

    until: float
    filter: ErrorFilter
    cross: dict[int, Array]

    def fork(self, until: float) -> Branch:
        """Return the same estimate, to go on with the readings that arrive before an instant.

        Args:
            until: the instant, s.
        """
        copied = ErrorFilter(self.filter.covariance)
        copied.x = self.filter.x.copy()
        return Branch(until, copied, dict(self.cross))

    def holds(self, arrival: float) -> bool:
        """Say whether a reading that arrives at an instant belongs to it."""
        return arrival < self.until - _SAME

    def predict(self, phi: Array, q: Array, came: dict[int, Array]) -> None:
        """Predict over one interval.

        Args:
            phi: Φ, (n, n).
            q: Q, (n, n).
            came: what is added to `cross` by the gyros' noise in the interval, by sensor.
        """
        self.filter.predict(phi, q)
        for sensor, noise in came.items():
            self.cross[sensor] = phi @ self.cross[sensor] + noise

    def innovation(self, one: Observed, r: Array, interval: float) -> Innovation:
        """Return what a reading would tell.

        Args:
            one: the reading.
            r: R, (k, k).
            interval: over which a zero-rate reading is a mean, s.
        """
        return self.filter.innovation(one.residual, one.h, r, self._common(one, interval))

    def take(self, one: Observed, r: Array, interval: float) -> None:
        """Take a reading into the estimate; arguments as of `innovation`."""
        self.filter.update(one.residual, one.h, r, self._common(one, interval))
        for sensor in self.cross:
            self.cross[sensor] = self.cross[sensor] - self.filter.gain @ (one.h @ self.cross[sensor])

    def _common(self, one: Observed, interval: float) -> Array | None:
        return self.cross[one.sensor] / interval if one.sensor in self.cross else None


class Branches:
    """The estimate by all readings, and one for each instant at which a late reading is still to arrive.

    Args:
        covariance: P at the start, (n, n).
        zero_rate: numbers of the zero-rate sensors.
    """

    def __init__(self, covariance: Array, zero_rate: set[int]) -> None:
        cross = {sensor: np.zeros((len(covariance), 3)) for sensor in zero_rate}
        self.main = Branch(np.inf, ErrorFilter(covariance), cross)
        self.waiting: list[Branch] = []  # in the order of their arrivals

    def every(self) -> list[Branch]:
        """Return all of them, that of all readings last."""
        return [*self.waiting, self.main]

    def wait(self, arrival: float) -> None:
        """Go on without the readings that arrive at an instant, until then."""
        found = self.every()
        k = next(k for k, branch in enumerate(found) if branch.until > arrival - _SAME)
        if found[k].until > arrival + _SAME:
            self.waiting.insert(k, found[k].fork(arrival))

    def known(self, now: float) -> ErrorFilter:
        """Return the estimate by the readings that have arrived; those that wait for no other are forgotten."""
        while self.waiting and self.waiting[0].until <= now + _SAME:
            self.waiting.pop(0)
        return self.every()[0].filter
