"""Kalman filter by filterpy, with cross-covariance and branches for late readings.

filterpy's class has no gate. State and residual are one-dimensional here: with a column as state and a one-dimensional
residual, filterpy would silently turn the state into a matrix.

P is never symmetrised, because rounding does not accumulate. A prediction turns an asymmetry A of P into Φ A Φᵀ; an
update (Joseph form, or with a cross-covariance) turns it into (I − K H) A (I − K H)ᵀ to first order. Both transform A
as they transform P, so that A stays at rounding level relative to P.

The filter processes every reading at its instant of validity. Until a late reading arrives, a second filter runs in
parallel without that reading and processes all others that arrive before it. The solution published at an instant
therefore holds exactly the readings that had arrived by then, and a late sensor delays no other sensor. Each pending
arrival costs one additional filter.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from typing import Self

import numpy as np
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.estimation.filter_result import Divergence
from sinssim.estimation.innovation_gate import Innovation
from sinssim.estimation.linearisation import Linearisation, Observed
from sinssim.sensors.measurement_kind import PHI, V, skew


class ErrorFilter:
    """Estimate x and covariance P, (n, n), of a state that starts at zero, both moved to first order.

    Other kinds of filters are derived from it (`sinssim.estimation.unscented_cubature_ensemble`).
    """

    def __init__(self, covariance: Array) -> None:
        self._filter = KalmanFilter(dim_x=len(covariance), dim_z=1)
        self._filter.x = np.zeros(len(covariance))
        self._filter.P = covariance.copy()

    @property
    def x(self) -> Array:
        """Estimate, (n,)."""
        return self._filter.x  # type: ignore[no-any-return]

    @x.setter
    def x(self, value: Array) -> None:
        self._filter.x = value

    @property
    def covariance(self) -> Array:
        """P, (n, n)."""
        return self._filter.P  # type: ignore[no-any-return]

    @property
    def gain(self) -> Array:
        """Gain K of the last update, (n, k)."""
        return self._filter.K  # type: ignore[no-any-return]

    def feed(self, fed: Array, turn: Array | None, refer: Callable[[Array], Array]) -> None:
        """Go on relative to the solution after errors, (n,), were fed back: `turn` is the matrix into the axes there,
        (n, n), None if they are the same, and `refer` returns errors of any size, (N, n), relative to that solution."""
        self.x = self.x - fed
        if turn is not None:
            self._filter.x = turn @ self._filter.x
            self._filter.P = turn @ self._filter.P @ turn.T

    def predict(self, phi: Array, q: Array) -> None:
        """Predict over one interval by Φ and Q, (n, n)."""
        self._filter.F, self._filter.Q = phi, q  # as arguments they would take filterpy longer
        self._filter.predict()

    def predict_along(self, line: Linearisation, k: int) -> None:
        """Predict over the interval before the epoch `k` of a segment."""
        self.predict(line.phi[k], line.q[k])

    def linearised(self, reading: Observed) -> Observed:
        """Return a reading linearised at the estimate, if it is that of a velocity of zero.

        Zero is zero in any axes, also in those of the body, in which a velocity does not depend on the heading:
        Cᵀv = 0 has H = (1, −v×) for δv and φ. With H = (1, 0) the error of the heading times a velocity that the
        corrections removed would remain in the covariance, and the filter would take each correction for news of the
        heading (compare G. Huang, A. Mourikis and S. Roumeliotis, Int. J. Robotics Research 29, 2010, 502).
        """
        if reading.still is None:
            return reading
        h = reading.h.copy()
        h[:, PHI] = -skew((reading.still - self.x[V])[None])[0]
        return reading._replace(h=h, residual=reading.residual + h[:, PHI] @ self.x[PHI])

    def innovation(self, reading: Observed, r: Array, cross: Array | None = None) -> Innovation:
        """Return the innovation of a reading with R, (k, k).

        `cross` is the covariance of the state's error with the reading's noise, (n, k); None if they are independent.
        """
        reading = self.linearised(reading)
        h = reading.h
        covariance = h @ self.covariance @ h.T + r
        if cross is not None:
            both = h @ cross
            covariance = covariance + both + both.T
        return Innovation.of(reading.residual - h @ self.x, covariance)

    def update(self, reading: Observed, r: Array, cross: Array | None = None) -> Array | None:
        """Update the estimate with a reading; the arguments are those of `innovation`.

        Returns:
            The matrix by which the correction of a velocity of zero changed what a heading error does to the velocity,
            (n, n); None for another reading.
        """
        reading, before = self.linearised(reading), self.x[V]
        self._filter.R = r
        if cross is None:
            self._filter.update(reading.residual, H=reading.h)
        else:
            self._filter.M = cross
            self._filter.update_correlated(reading.residual, H=reading.h)
        if reading.still is None:
            return None
        moved = np.eye(len(self.x))
        moved[V, PHI] = skew((before - self.x[V])[None])[0]
        self._filter.P = moved @ self._filter.P @ moved.T
        return moved

    def copy(self) -> Self:
        """Return the same estimate, to go on by itself; its arrays are replaced, never changed."""
        out = copy(self)
        out._filter = copy(self._filter)
        return out


@dataclass
class Branch:
    """The estimate from the readings that arrive before an instant."""

    until: float  # that instant, s; infinity for the estimate from all readings
    filter: ErrorFilter  # x and P
    cross: dict[int, Array]
    """Covariance of the state's error with the gyros' noise since the last zero-rate reading, (n, 3), by number of the
    zero-rate sensor.
    """

    @classmethod
    def start(cls, of: ErrorFilter, zero_rate: set[int]) -> Branch:
        """Return the estimate from all readings at the start, with the numbers of the zero-rate sensors."""
        return cls(np.inf, of, {sensor: np.zeros((len(of.x), 3)) for sensor in zero_rate})

    def fork(self, until: float) -> Branch:
        """Return a copy of the estimate that continues with the readings that arrive before an instant, s."""
        return Branch(until, self.filter.copy(), dict(self.cross))

    def feed(self, fed: Array, turn: Array | None, refer: Callable[[Array], Array]) -> None:
        """Go on relative to the solution after a feedback; the arguments are those of the filter's."""
        self.filter.feed(fed, turn, refer)
        if turn is not None:
            self.cross = {sensor: turn @ noise for sensor, noise in self.cross.items()}

    def predict(self, line: Linearisation, k: int, came: dict[int, Array]) -> None:
        """Predict over the interval before the epoch `k`; `came` is the increase of `cross` by the gyros' noise in it,
        by sensor."""
        self.filter.predict_along(line, k)
        for sensor, noise in came.items():
            self.cross[sensor] = line.phi[k] @ self.cross[sensor] + noise

    def innovation(self, reading: Observed, r: Array, interval: float) -> Innovation:
        """Return the innovation of a reading with R, (k, k), and the averaging interval of a zero-rate reading, s."""
        return self.filter.innovation(reading, r, self._common(reading, interval))

    def take(self, reading: Observed, r: Array, interval: float) -> Array | None:
        """Update the estimate with a reading; the arguments are those of `innovation`, the result is the filter's."""
        moved = self.filter.update(reading, r, self._common(reading, interval))
        for sensor in self.cross:
            rest = self.cross[sensor] - self.filter.gain @ (reading.h @ self.cross[sensor])
            self.cross[sensor] = rest if moved is None else moved @ rest
        return moved

    def _common(self, reading: Observed, interval: float) -> Array | None:
        return self.cross[reading.sensor] / interval if reading.sensor in self.cross else None


_ROUNDING = 1e-10
"""Eigenvalue of a correlation matrix that may be negative by rounding. States that depend linearly on each other, such
as the tilts and the velocity of a vehicle at rest with sensors without errors, have an eigenvalue of zero."""


class Diverged(Exception):  # noqa: N818 - not an error of the user: the run ends there and keeps its results
    """Signals that the filter cannot continue: when, s, at which reading, and why, without a full stop."""

    def __init__(self, time: float, measurement: str, reason: str) -> None:
        super().__init__(reason)
        self.divergence = Divergence(time, measurement, reason)


def check_covariance(covariance: Array, varying: NDArray[np.intp], time: float, measurement: str) -> None:
    """Raise `Diverged` for a covariance that is not positive definite in the states that are not known exactly."""
    p = covariance if len(varying) == len(covariance) else covariance[np.ix_(varying, varying)]
    variance = p.diagonal()
    if variance.min() > 0.0:
        scale = 1.0 / np.sqrt(variance)
        correlation = p * scale[:, None] * scale  # row by row: products of two scales may overflow
        try:
            np.linalg.cholesky(correlation)
        except np.linalg.LinAlgError:
            if np.linalg.eigvalsh(correlation)[0] > -_ROUNDING:
                return
        else:
            return
    raise Diverged(time, measurement, "the covariance is no longer positive definite")
