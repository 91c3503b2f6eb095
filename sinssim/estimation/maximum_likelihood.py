"""Maximum likelihood of a filter's innovations: parameters of the filter with their confidence intervals.

The innovations ν of a filter with the covariances S have the log likelihood of the readings (Bar-Shalom, Li and
Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 11.2),

    L = −½ Σ (νᵀS⁻¹ν + ln det S)                                                                                    (1)

Its maximum is sought by the trust-region method of scipy with Fisher's information in place of the Hessian,

    I_ij = Σ [½ tr(S⁻¹ S_i S⁻¹ S_j) + ν_iᵀ S⁻¹ ν_j]                                                                 (2)

(Gupta and Mehra, Computational aspects of maximum likelihood estimation, IEEE Trans. Automatic Control 19, 1974, 774),
whose derivatives ν_i and S_i are differences of two replays of the filter. The parameters x are logarithms of noises.
The inverse of (2) is the covariance of the estimates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.estimation.linear_replay import Series, nis_of

Replay = Callable[[Array], Sequence[Series]]
"""Returns the innovations of the filter for B sets of parameters, (B, n)."""

_STEP = 1e-3
"""Step of the differences, whose error of first order is removed with (2): what is left is far below a σ."""

_NEAR, _REACH = 0.02, 2.0
"""gᵀI⁻¹g below which the maximum is reached, 14 % of a standard deviation; longest step, beyond which a slope does not
count."""

_MOST = 40
"""Most steps."""

_FLAT = 1e-6
"""Eigenvalue of (2) below which the likelihood is flat: a σ of a factor of e^1000."""


def log_likelihood(innovations: Sequence[Series], rows: Callable[[Series], Array] | None = None) -> Array:
    """Return L of (1), without its constant, for each set of parameters, (B,), over some readings or all of them."""
    total = np.zeros(len(innovations[0].value)) if innovations else np.zeros(1)
    for sensor in innovations:
        part = slice(None) if rows is None else rows(sensor)
        value, s = sensor.value[:, part], sensor.covariance[:, part]
        total -= 0.5 * np.sum(nis_of(value, s) + np.linalg.slogdet(s)[1], axis=1)
    return total


def information(innovations: Sequence[Series], step: float) -> Array:
    """Return (2), (n, n), from the innovations at x, and at x with each parameter larger by a step, B = n + 1."""
    parts = [np.zeros((len(innovations[0].value) - 1, 0))]
    for sensor in innovations:
        root = np.linalg.cholesky(sensor.covariance[0])
        u = np.linalg.solve(root, (sensor.value[1:] - sensor.value[0])[..., None])
        half = np.linalg.solve(root, sensor.covariance[1:] - sensor.covariance[0])
        a = np.linalg.solve(root, np.swapaxes(half, -1, -2))
        both = (u.reshape(len(u), u[0].size), math.sqrt(0.5) * a.reshape(len(a), a[0].size)) if len(u) else ()
        parts += [part / step for part in both]
    whole = np.concatenate(parts, axis=1)
    return np.asarray(whole @ whole.T)


@dataclass(frozen=True)
class Maximum:
    """The maximum of the likelihood."""

    x: Array  # (n,)
    value: float  # L there
    sigma: Array  # 1σ of x, (n,); infinite where the likelihood is flat
    innovations: Sequence[Series]  # there, B = 1
    steps: int  # replays


class _Reached(Exception):  # noqa: N818 - it ends the search, and is no error
    """The maximum is reached."""


def maximum(replay: Replay, start: Array, low: Array, high: Array, progress: Callable[[int], None]) -> Maximum:
    """Return the maximum of the likelihood by scoring from a start, x (n,), within the limits `low` and `high`, (n,)
    each, beyond which L is that at the limit. `progress` is called with the number of replays."""
    search = _Search(replay, low, high, progress)
    start = np.asarray(start, dtype=np.float64)
    if len(start):
        with suppress(_Reached):
            minimize: Any = scipy.optimize.minimize
            minimize(
                search.loss, start, jac=search.slope, hess=search.hessian, method="trust-exact", callback=search.look,
                options={"initial_trust_radius": 1.0, "max_trust_radius": _REACH, "maxiter": _MOST},
            )  # fmt: skip
    best = np.clip(search.best if search.best is not None else start, low, high)
    value, _, fisher, innovations = search.at(best)
    at_best = [Series(s.sensor, s.time, s.row, s.value[:1], s.covariance[:1]) for s in innovations]
    return Maximum(best, value, sigma_of(fisher), at_best, search.count)


OUTLIER = 1e-4
"""Probability of a correct measurement beyond which one is an outlier."""

_ROUNDS = 4
"""Most fits with fresh outliers left out."""

WIDE = math.log(100.0) / (2.0 * 1.96)
"""1σ of the logarithm from which the data cannot tell a noise: its 95 % interval spans a factor of a hundred."""


def drop_outliers(dropped: Mapping[str, NDArray[np.bool_]], innovations: Sequence[Series]) -> bool:
    """Leave out measurements that are too far off for chance, by sensor; return whether there are new ones."""
    fresh = False
    for series in innovations:
        nis = nis_of(series.value, series.covariance)[0]
        far, expected = nis > scipy.special.chdtri(series.value.shape[2], OUTLIER), OUTLIER * len(nis)
        if np.count_nonzero(far) > expected + 3.0 * math.sqrt(expected) + 1.0:
            dropped[series.sensor][series.row[far]] = fresh = True
    return fresh


def maximum_without_outliers(
    replay: Replay, dropped: Mapping[str, NDArray[np.bool_]], start: Array, low: Array, high: Array,
    progress: Callable[[int], None] = lambda _: None,
) -> Maximum:  # fmt: skip
    """Return the maximum of the likelihood as `maximum`, with a replay that leaves out what is dropped, by sensor;
    outliers are dropped, and the rest is fitted again."""
    steps = 0
    for last in (*[False] * (_ROUNDS - 1), True):
        best = maximum(replay, start, low, high, progress)
        steps, start = steps + best.steps, best.x
        if last or not drop_outliers(dropped, best.innovations):
            break
    return replace(best, steps=steps)


def sigma_of(fisher: Array) -> Array:
    """Return 1σ of each parameter, the root of the diagonal of the inverse of (2); infinite where it is flat."""
    size, vectors = np.linalg.eigh(fisher)
    flat = size < _FLAT
    variance = np.sum(vectors**2 / np.where(flat, np.inf, size), axis=1)
    return np.asarray(np.where(np.sum(vectors**2 * flat, axis=1) > 1e-3, np.inf, np.sqrt(variance)))


class _Search:
    """The replays of a search: L, its gradient and (2) at the last x."""

    def __init__(self, replay: Replay, low: Array, high: Array, progress: Callable[[int], None]) -> None:
        self._replay, self._low, self._high, self._progress = replay, low, high, progress
        self._known: tuple[bytes, tuple[float, Array, Array, Sequence[Series]]] | None = None
        self.count, self._most, self.best = 0, -math.inf, None

    best: Array | None

    def at(self, x: Array) -> tuple[float, Array, Array, Sequence[Series]]:
        """Return L, its gradient, (2), and the innovations."""
        x = np.clip(x, self._low, self._high)
        if self._known is None or self._known[0] != x.tobytes():
            self.count += 1
            self._progress(self.count)
            innovations = self._replay(np.vstack([x, x + _STEP * np.eye(len(x))]))
            value = log_likelihood(innovations)
            fisher = information(innovations, _STEP)
            gradient = (value[1:] - value[0]) / _STEP + 0.5 * _STEP * fisher.diagonal()
            self._known = x.tobytes(), (float(value[0]), gradient, fisher, innovations)
            if value[0] > self._most:
                self.best, self._most = x.copy(), float(value[0])
        return self._known[1]

    def loss(self, x: Array) -> float:
        """Return −L."""
        return -self.at(x)[0]

    def slope(self, x: Array) -> Array:
        """Return the gradient of −L, zero along a limit that it leads beyond."""
        slope = -self.at(x)[1]
        blocked = ((x <= self._low) & (slope > 0.0)) | ((x >= self._high) & (slope < 0.0))
        return np.where(blocked, 0.0, slope)

    def hessian(self, x: Array) -> Array:
        """Return (2)."""
        return self.at(x)[2]

    def look(self, x: Array) -> None:
        """End the search where the next step would be short."""
        slope, fisher = self.slope(x), self.hessian(x)
        free = (x > self._low) & (x < self._high)
        slope, fisher = slope[free], fisher[np.ix_(free, free)]
        size, vectors = np.linalg.eigh(fisher)
        along = np.abs(vectors.T @ slope)
        if float(np.sum(np.minimum(along**2 / np.maximum(size, _FLAT), 2.0 * _REACH * along))) < _NEAR:
            raise _Reached
