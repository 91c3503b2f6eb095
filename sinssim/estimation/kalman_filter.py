"""Kalman filter by filterpy with gate, cross-covariance and branches for late readings, and the RTS smoother.

filterpy's class has no gate. State and residual are one-dimensional here: with a column as state and a one-dimensional
residual, filterpy would silently turn the state into a matrix.

P is never symmetrised, because rounding does not accumulate. A prediction turns an asymmetry A of P into Φ A Φᵀ; an
update (Joseph form, or with a cross-covariance) turns it into (I − K H) A (I − K H)ᵀ to first order. Both transform A
as they transform P, so that A stays at rounding level relative to P.

The filter processes every reading at its instant of validity. Until a late reading arrives, a second filter runs in
parallel without that reading and processes all others that arrive before it. The solution published at an instant
therefore holds exactly the readings that had arrived by then, and a late sensor delays no other sensor. Each pending
arrival costs one additional filter.

The smoother is that of Rauch, Tung and Striebel for the total state of the closed loop. Between two rows the filter's
error state propagates linearly, x⁻ₖ₊₁ = Φ xₖ. At a row errors are fed back, and from there on the state is the error of
another trajectory. Referred to one trajectory, the smoother's recursion (Rauch, Tung and Striebel, AIAA Journal 3,
1965, 1445) is

    x̂ₖ ← xₖ + Kₖ (x̂ₖ₊₁ + cₖ₊₁ − Φ xₖ),   Kₖ = Pₖ Φᵀ (P⁻ₖ₊₁)⁻¹,   P̂ₖ ← Pₖ + Kₖ (P̂ₖ₊₁ − P⁻ₖ₊₁) Kₖᵀ

with cₖ₊₁ the feedback at row k+1; without it the feedback would count as an innovation. filterpy's smoother does not
provide for it. The covariance of gyro noise with zero-rate readings is neglected here.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
import scipy
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.estimation.consistency import scaled_solve
from sinssim.estimation.filter_result import Divergence, History, Innovations, Reasons, Smoothed, corrected
from sinssim.estimation.linearisation import Linearisation, Observed, solution_of
from sinssim.estimation.state_model import NAVIGATION, ErrorModel

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


class ErrorFilter:
    """Estimate x and covariance P, (n, n), of a state that starts at zero, both moved to first order.

    Other kinds of filters are derived from it (`sinssim.estimation.filter_kinds`).
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
        """Go on relative to the solution after a feedback.

        Args:
            fed: errors that were fed back, (n,).
            turn: matrix into the axes there, (n, n); None if they are the same.
            refer: returns errors of any size, (N, n), relative to that solution.
        """
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

    def innovation(self, reading: Observed, r: Array, cross: Array | None = None) -> Innovation:
        """Return the innovation of a reading with R, (k, k).

        `cross` is the covariance of the state's error with the reading's noise, (n, k); None if they are independent.
        """
        h = reading.h
        covariance = h @ self.covariance @ h.T + r
        if cross is not None:
            both = h @ cross
            covariance = covariance + both + both.T
        return Innovation.of(reading.residual - h @ self.x, covariance)

    def update(self, reading: Observed, r: Array, cross: Array | None = None) -> None:
        """Update the estimate with a reading; the arguments are those of `innovation`."""
        self._filter.R = r
        if cross is None:
            self._filter.update(reading.residual, H=reading.h)
        else:
            self._filter.M = cross
            self._filter.update_correlated(reading.residual, H=reading.h)

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

    def take(self, reading: Observed, r: Array, interval: float) -> None:
        """Update the estimate with a reading; the arguments are those of `innovation`."""
        self.filter.update(reading, r, self._common(reading, interval))
        for sensor in self.cross:
            self.cross[sensor] = self.cross[sensor] - self.filter.gain @ (reading.h @ self.cross[sensor])

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
        whole = (
            time - self._past[0][0] > 0.5 * self._interval
        )  # few of them, at its beginning, would see the gate's work
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


def smooth(model: ErrorModel, history: History, ellipsoid: Ellipsoid, algorithm: str) -> Smoothed:
    """Smooth a closed or open loop; return the estimate at the rows from all readings."""
    x, p = history.state.copy(), history.covariance.copy()
    gain, predicted = _gains(history)
    for k in range(len(x) - 2, -1, -1):
        x[k] += gain[k] @ (x[k + 1] + history.fed_back[k + 1] - history.transition[k + 1] @ x[k])
        p[k] += gain[k] @ (p[k + 1] - predicted[k]) @ gain[k].T
    state = corrected(history.navigation, x, ellipsoid, model.axes)
    total = history.compensated + x
    blocks = model.blocks[len(NAVIGATION) :]
    return Smoothed(
        history.time,
        solution_of(history.time, state, algorithm),
        {block.name: total[:, model.slices[block.name]] for block in blocks},
        p,
    )


def _gains(history: History) -> tuple[Array, Array]:
    """Return Kₖ and P⁻ₖ₊₁ for all rows but the last, (R−1, n, n) each."""
    phi = history.transition[1:]
    across = history.covariance[:-1] @ phi.transpose(0, 2, 1)
    predicted = phi @ across + history.noise[1:]
    return scaled_solve(predicted, across.transpose(0, 2, 1)).transpose(0, 2, 1), predicted
