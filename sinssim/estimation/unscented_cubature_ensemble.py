"""Kinds of filters on the same readings and states: error-state, invariant, unscented, cubature, ensemble.

All of them estimate the error of an inertial solution, whose errors are fed back in the closed loop. They differ in how
the distribution of the error is represented. The error-state filter and the invariant one have a covariance that F and
H move to first order; the two filters of points move points through the equations of any size of error
(`sinssim.estimation.large_errors`), and the ensemble filter moves members that it draws. Attitude errors are rotation
vectors relative to the solution, so that no filter averages quaternions.

The invariant filter is the left-invariant one of A. Barrau and S. Bonnabel (The invariant extended Kalman filter as a
stable observer, IEEE Trans. Automatic Control 62, 2017, 1797) on SE₂(3), with the sensors' parameters beside it. Its
errors are those in body axes, Ĉᵀδ, which the feedback does not change to first order. In the axes of the error model
the covariance therefore turns with the corrected attitude, and the correction is the exponential of the group:

    Ĉ⁺ = exp([φ×]) Ĉ,   v̂⁺ = v̂ − J(φ) δv,   r̂⁺ = r̂ − J(φ) δr,   P⁺ = D P Dᵀ,   D = exp([φ×]) for r, v and φ         (1)

with J the left Jacobian of the rotations. It feeds back after every reading.

The unscented filter has the scaled points of R. van der Merwe (Sigma-point Kalman filters, Oregon Health and Science
University, 2004), √3 standard deviations off the mean along each axis, where a normal distribution's fourth moment is
matched; the cubature filter (I. Arasaratnam and S. Haykin, IEEE Trans. Automatic Control 54, 2009, 1254) has points of
equal weight at √n, which are those of S. Julier with κ = 0. The ensemble filter is the square-root one of J. Whitaker
and T. Hamill (Monthly Weather Review 130, 2002, 1913), without perturbed readings. Its noise is drawn orthogonal to the
members, so that it adds Q to their covariance exactly: where the errors are small, the members have the covariance of a
Kalman filter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from typing import Self

import numpy as np
import scipy
from filterpy.kalman import JulierSigmaPoints, MerweScaledSigmaPoints, unscented_transform

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.estimation.innovation_gate import Innovation
from sinssim.estimation.kalman_filter import ErrorFilter
from sinssim.estimation.linearisation import Linearisation, Observed
from sinssim.sensors.measurement_kind import PHI, R, V, skew

MEMBERS = 200
"""Members of an ensemble: the scatter of a standard deviation is then 1/√(2·200), 5 %."""


def _root(matrix: Array) -> Array:
    """Return U with UᵀU = matrix, (n, n) positive semi-definite, of states in any units; rows are points."""
    scale = np.sqrt(np.maximum(matrix.diagonal(), 0.0))
    known = scale > 0.0
    factor = np.where(known, scale, 1.0)
    correlation = matrix / np.outer(factor, factor)
    correlation[~known] = correlation[:, ~known] = 0.0
    try:
        part = np.linalg.cholesky(correlation[np.ix_(known, known)])
    except np.linalg.LinAlgError:  # states that depend on each other
        value, vector = np.linalg.eigh(correlation[np.ix_(known, known)])
        part = vector * np.sqrt(np.maximum(value, 0.0))
    out = np.zeros_like(matrix)
    out[np.ix_(known, known)] = part.T
    return np.asarray(out * factor)


class PointFilter(ErrorFilter):
    """A filter by weighted points, drawn anew from mean and covariance at each step."""

    def __init__(self, covariance: Array, points: MerweScaledSigmaPoints | JulierSigmaPoints) -> None:
        super().__init__(covariance)
        self._points = points

    def predict_along(self, line: Linearisation, k: int) -> None:
        moved = line.motion().moved(k, self._drawn())
        self.x, self._filter.P = unscented_transform(moved, self._points.Wm, self._points.Wc, line.q[k])

    def feed(self, fed: Array, turn: Array | None, refer: Callable[[Array], Array]) -> None:
        self.x, self._filter.P = unscented_transform(refer(self._drawn()), self._points.Wm, self._points.Wc)

    def innovation(self, reading: Observed, r: Array, cross: Array | None = None) -> Innovation:
        if cross is not None:
            return super().innovation(reading, r, cross)
        value, covariance, _ = self._seen(reading, r)
        return Innovation.of(value, covariance)

    def update(self, reading: Observed, r: Array, cross: Array | None = None) -> Array | None:
        if cross is not None:  # a mean rate is linear in the state
            return super().update(reading, r, cross)
        value, covariance, across = self._seen(reading, r)
        gain = -scipy.linalg.solve(covariance, across.T, assume_a="pos").T  # a reading falls with the state
        self._filter.K = gain
        self.x = self.x + gain @ value
        self._filter.P = self.covariance - gain @ covariance @ gain.T
        return None

    def _drawn(self) -> Array:
        return np.asarray(self._points.sigma_points(self.x, self.covariance))

    def _seen(self, reading: Observed, r: Array) -> tuple[Array, Array, Array]:
        """Return the mean residual, its covariance with the reading's noise, and the state's with it, (n, k)."""
        errors = self._drawn()
        residual = reading.residuals(errors)
        mean, covariance = unscented_transform(residual, self._points.Wm, self._points.Wc, r)
        across = ((errors - self.x) * self._points.Wc[:, None]).T @ (residual - mean)
        return mean, covariance, across


class EnsembleFilter(ErrorFilter):
    """A filter by the members of an ensemble; mean and covariance are theirs."""

    def __init__(self, covariance: Array, seed: int) -> None:
        super().__init__(covariance)
        self._random = np.random.Generator(np.random.Philox(key=seed))
        self._members = self._drawn(np.ones((MEMBERS, 1)), covariance)
        self._refresh()

    def copy(self) -> Self:
        out = super().copy()
        out._random = deepcopy(self._random)
        return out

    def feed(self, fed: Array, turn: Array | None, refer: Callable[[Array], Array]) -> None:
        self._members = refer(self._members)
        self._refresh()

    def predict_along(self, line: Linearisation, k: int) -> None:
        moved = line.motion().moved(k, self._members)
        off = moved - moved.mean(axis=0)
        size = np.sqrt(np.mean(off**2, axis=0))
        there = np.column_stack([np.ones(MEMBERS), off / np.where(size > 0.0, size, 1.0)])
        self._members = moved + self._drawn(there, line.q[k])
        self._refresh()

    def innovation(self, reading: Observed, r: Array, cross: Array | None = None) -> Innovation:
        if cross is not None:
            return super().innovation(reading, r, cross)
        residual = reading.residuals(self._members)
        return Innovation.of(residual.mean(axis=0), np.atleast_2d(np.cov(residual.T)) + r)

    def update(self, reading: Observed, r: Array, cross: Array | None = None) -> None:
        if cross is not None:  # a mean rate is linear in the state
            super().update(reading, r, cross)
            self._members = self.x + self._drawn(np.ones((MEMBERS, 1)), self.covariance)
            return
        # one component after the other, of unit noise and independent
        white = scipy.linalg.solve_triangular(np.linalg.cholesky(r), reading.residuals(self._members).T, lower=True).T
        both = np.hstack([self._members, white])
        n = both.shape[1] - white.shape[1]
        for j in range(n, both.shape[1]):
            mean = both.mean(axis=0)
            off = both - mean
            variance = 1.0 + off[:, j] @ off[:, j] / (MEMBERS - 1)
            gain = off.T @ off[:, j] / ((MEMBERS - 1) * variance)
            both = mean - gain * mean[j] + off - np.outer(off[:, j], gain / (1.0 + math.sqrt(1.0 / variance)))
        self._members = both[:, :n]
        self._refresh()
        self._filter.K = self.covariance @ np.linalg.solve(r, reading.h).T

    def _drawn(self, there: Array, covariance: Array) -> Array:
        """Return what to add to members so that the covariance is added to theirs exactly, (N, n).

        `there` are the columns, (N, m), to which what is drawn is orthogonal: ones, and the members' deviations.
        """
        root = _root(covariance)
        root = root[np.any(root, axis=1)]
        basis, _ = np.linalg.qr(there)
        normal = self._random.standard_normal((MEMBERS, len(root)))
        unit, _ = np.linalg.qr(normal - basis @ (basis.T @ normal))
        return np.asarray(math.sqrt(MEMBERS - 1) * unit @ root)

    def _refresh(self) -> None:
        self._filter.x = self._members.mean(axis=0)
        self._filter.P = np.cov(self._members.T)


def by_group(errors: Array) -> tuple[Array, Array]:
    """Return what the invariant filter subtracts for an estimate, (n,), and the matrix D that turns P, (n, n): (1)."""
    phi = errors[PHI]
    angle, cross = float(np.linalg.norm(phi)), skew(phi)
    first, second = (0.5, 1.0 / 6.0) if angle < 1e-4 else (
        (1.0 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3,
    )  # fmt: skip
    jacobian = np.eye(3) + first * cross + second * cross @ cross
    turned, out, matrix = (
        rotation.dcm_from_quaternion(rotation.quaternion_from_rotation_vector(phi)),
        errors.copy(),
        (np.eye(len(errors))),
    )
    for part in (R, V):
        out[part] = jacobian @ errors[part]
    for part in (R, V, PHI):
        matrix[part, part] = turned
    return out, matrix


def filter_of(kind: str, covariance: Array, seed: int) -> ErrorFilter:
    """Return a filter of a kind at its start, with P₀, (n, n); InputError for an ensemble with too many states."""
    n = len(covariance)
    if kind == "unscented":
        return PointFilter(covariance, MerweScaledSigmaPoints(n, math.sqrt(3.0 / n), 2.0, 0.0, sqrt_method=_root))
    if kind == "cubature":
        return PointFilter(covariance, JulierSigmaPoints(n, 0.0, sqrt_method=_root))
    if kind == "ensemble" and 2 * n >= MEMBERS:  # what is drawn is orthogonal to n deviations
        raise InputError(f"{MEMBERS} members are too few for {n} states; an ensemble has fewer than {MEMBERS // 2}.")
    return EnsembleFilter(covariance, seed) if kind == "ensemble" else ErrorFilter(covariance)
