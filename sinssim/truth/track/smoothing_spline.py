"""The smoothing spline through noisy samples, and the choice of its one parameter.

The curve s minimises

    Σ Δtᵢ wᵢ |rᵢ − s(tᵢ)|² + τ⁶ ∫ |s‴|² dt

over quintic (C⁴) splines; Δtᵢ is the time that sample i stands for. Far from the ends it is a filter without delay,
whose gain at the angular frequency ω is 1/(1 + (ωτ)⁶): motion slower than a period of 2πτ is kept, quicker motion is
removed. The same curve is the mean of a Kalman smoother for white jerk. Unlike a cubic smoothing spline
(`scipy.interpolate.make_smoothing_spline`), whose acceleration has corners, it has a smooth specific force.

τ is given, or follows from a given rms distance from the samples (C. H. Reinsch, Numer. Math. 10, 1967), or from the
samples by generalised cross-validation (G. Wahba, Spline Models for Observational Data, 1990, eq. 4.3.1).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from sinssim.data import Array

_DEGREE = 5
_KNOTS = 4.0
"""Knots of the spline within τ; more would only make the equations ill-conditioned."""
_LEAST, _MOST, _STEP = 0.25, 128.0, 2.0**0.5
"""Values of τ that are tried, in median intervals of the samples. Below the least, the spline interpolates."""
_PROBES = 8
"""Random vectors of the trace of the influence matrix: its relative error is below √(2/(8 n))."""
_AS_GOOD = 1.05
"""Factor of the best score up to which the least τ is as good, and the samples are interpolated."""
_FEWEST = 30
"""Samples below which there are too few to tell noise from motion, and the spline interpolates."""
_ROWS = 20_000
"""Samples in the middle of a track from which τ is chosen."""

Misfit = Callable[[Array, slice], Array]
"""Returns of vectors from curve to samples, (n, m), the components that count, (n, k); the slice says which samples."""


class SmoothingSpline:
    """The least-squares problem of one set of sample times and one τ.

    Args:
        time: samples, increasing, (n,) s.
        tau: τ, more than 0, s.
        weight: wᵢ, (n,).
    """

    def __init__(self, time: Array, tau: float, weight: Array) -> None:
        from scipy.interpolate import BSpline
        from scipy.linalg import cholesky_banded

        inner = _thinned(time, tau / _KNOTS)
        self.knots = np.concatenate([[time[0]] * _DEGREE, inner, [time[-1]] * _DEGREE])
        self._design = BSpline.design_matrix(time, self.knots, _DEGREE)
        self._weight = weight * _durations(time)
        normal = self._design.T @ self._design.multiply(self._weight[:, None])
        third, gauss = _third_derivatives(self.knots, inner)
        normal = normal + tau**6 * (third.T @ third.multiply(gauss[:, None]))
        lower = np.zeros((_DEGREE + 1, normal.shape[0]))
        for k in range(_DEGREE + 1):
            diagonal = normal.diagonal(-k)
            lower[k, : len(diagonal)] = diagonal
        self._factor = cholesky_banded(lower, lower=True)

    def coefficients(self, values: Array) -> Array:
        """Return the coefficients of the spline for samples (n, m), (K, m)."""
        from scipy.linalg import cho_solve_banded

        right: Any = self._design.T @ (self._weight[:, None] * values)
        return np.asarray(cho_solve_banded((self._factor, True), right))

    def fitted(self, values: Array) -> Array:
        """Return the spline at the samples, (n, m)."""
        return np.asarray(self._design @ self.coefficients(values))

    def spline(self, values: Array) -> Any:
        """Return the spline, a `scipy.interpolate.BSpline`."""
        from scipy.interpolate import BSpline

        return BSpline(self.knots, self.coefficients(values), _DEGREE)


def interpolating_spline(time: Array, values: Array) -> Any:
    """Return the spline through samples: quintic, of lower degree through less than six.

    Args:
        time: samples, increasing, (n,) s, n ≥ 2.
        values: (n, m).

    Returns:
        A `scipy.interpolate.BSpline`.
    """
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(time, values, k=min(_DEGREE, len(time) - 1))


def smooth_spline(time: Array, values: Array, tau: float, weight: Array) -> Any:
    """Return the spline of a given τ; the interpolating one for τ = 0."""
    if tau == 0.0:
        return interpolating_spline(time, values)
    return SmoothingSpline(time, tau, weight).spline(values)


def tau_by_cross_validation(time: Array, values: Array, weight: Array, misfit: Misfit | None = None) -> float:
    """Return τ by generalised cross-validation, s; 0 if the samples are best interpolated (time in (n,) s; values: (n,
    m); weight: (n,); misfit: components that count; all if not given)."""
    first = max(0, (len(time) - _ROWS) // 2)
    rows = slice(first, first + _ROWS)
    t, y, w = time[rows], values[rows], weight[rows]
    tried = _tried(t)
    if len(t) < _FEWEST or not len(tried):
        return 0.0
    probes = np.random.default_rng(1).choice((-1.0, 1.0), (len(t), _PROBES))
    scores = []
    for tau in tried:
        problem = SmoothingSpline(t, tau, w)
        both = problem.fitted(np.concatenate([y, probes], axis=1))
        left = float(np.mean(probes * (probes - both[:, y.shape[1] :])))  # 1 − trace/n
        scores.append(_mean_square(y - both[:, : y.shape[1]], w, misfit, rows) / left**2)
    best = int(np.argmin(scores))
    return 0.0 if scores[0] <= _AS_GOOD * scores[best] else float(tried[best])


def tau_by_distance(time: Array, values: Array, weight: Array, rms: float, misfit: Misfit | None = None) -> float:
    """Return the τ whose curve passes the samples at a given rms distance, s; 0 if even the least does not reach it;
    the largest that is tried if no curve is as far as that from the samples (time in (n,) s; values: (n, m); weight:
    (n,); rms: the distance, in the unit of the values; misfit: components that count; all if not given)."""

    def distance(tau: float) -> float:
        fitted = SmoothingSpline(time, tau, weight).fitted(values)
        return math.sqrt(_mean_square(values - fitted, weight, misfit, slice(None)))

    tried = _tried(time)
    if rms <= 0.0 or len(time) < _FEWEST or not len(tried) or distance(tried[0]) > rms:
        return 0.0
    low: float = float(tried[0])
    high: float = float(tried[-1])
    if distance(high) < rms:
        return high
    while high / low > 1.001:
        middle = (low * high) ** 0.5
        low, high = (low, middle) if distance(middle) > rms else (middle, high)
    return low


def _mean_square(rest: Array, weight: Array, misfit: Misfit | None, rows: slice) -> float:
    counted = rest if misfit is None else misfit(rest, rows)
    return float(np.sum(weight * np.sum(counted**2, axis=1)) / np.sum(weight))


def _tried(time: Array) -> Array:
    interval = float(np.median(np.diff(time)))
    most = min(_MOST * interval, float(time[-1] - time[0]) / 6.0)
    count = int(np.floor(np.log(max(most / (_LEAST * interval), 1e-9)) / np.log(_STEP))) + 1
    return np.asarray(_LEAST * interval * _STEP ** np.arange(max(count, 0)))


def _durations(time: Array) -> Array:
    """Return the time that each sample stands for, at most three median intervals, (n,) s."""
    step = np.minimum(np.diff(time), 3.0 * np.median(np.diff(time)))
    return np.asarray(0.5 * (np.append(step, step[-1]) + np.insert(step, 0, step[0])))


def _thinned(time: Array, spacing: float) -> Array:
    """Return the times of which none follows the one before by less than a spacing; both ends stay."""
    if float(np.min(np.diff(time))) >= spacing:
        return time
    cells = np.floor((time - time[0]) / spacing)
    instants = time[np.concatenate([[True], np.diff(cells) > 0])]
    far = np.concatenate([[True], np.diff(instants) >= 0.5 * spacing])
    instants = instants[far]
    return np.append(instants[instants < time[-1] - 0.5 * spacing], time[-1])


def _third_derivatives(knots: Array, inner: Array) -> tuple[Any, Array]:
    """Return third derivatives of the basis at Gauss points between the knots, and the points' weights."""
    from scipy.interpolate import BSpline
    from scipy.sparse import csr_array, diags_array, eye_array

    nodes, weights = np.polynomial.legendre.leggauss(3)  # exact for the square of a quadratic
    half = 0.5 * np.diff(inner)
    points = (inner[:-1, None] + half[:, None] * (1.0 + nodes)).ravel()
    # derivatives of B-splines: differences of coefficients, one degree less each time
    size, t = len(knots) - _DEGREE - 1, knots
    matrix: Any = eye_array(size)
    for k in range(_DEGREE, _DEGREE - 3, -1):
        scale = k / (t[k + 1 : -1] - t[1 : -k - 1])
        n = size - 1
        matrix = diags_array(np.stack([-scale, scale]), offsets=[0, 1], shape=(n, size)) @ matrix
        size, t = n, t[1:-1]
    basis = BSpline.design_matrix(points, t, _DEGREE - 3)
    return csr_array(basis @ matrix), (half[:, None] * weights).ravel()
