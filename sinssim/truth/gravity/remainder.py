"""The part of gravity that no model has, as a random process along the way.

Each of ξ, η and the anomaly is a stationary Gauss-Markov process of the second or third order over the distance d
travelled, with the correlation

    2nd order: (1 + βd) e^−βd         3rd order: (1 + βd + β²d²/3) e^−βd

(Kasper, A second-order Markov gravity anomaly model, JGR 76, 1971, 7844-7849; Jordan, Self-consistent statistical
models for the gravity anomaly, vertical deflections, and undulation of the geoid, JGR 77, 1972, 3660-3670). Values and
derivatives are drawn at equal distances, exactly, and joined by cubic Hermite polynomials. The process depends on the
distance alone: over a place that is passed twice, it has two values; a vehicle at rest has constant ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.jit import kernel
from sinssim.statistics.random_numbers import normals

AT_1_OVER_E = {2: 2.1461932206205825, 3: 2.904629975029914}
"""βd at which the correlation of the order is 1/e."""
KNOTS_PER_DISTANCE = 40
"""Knots in a correlation distance: Hermite polynomials between them miss 1e-5 of the variance at most."""


@dataclass(frozen=True)
class RemainderModel:
    """Statistics of the remainder.

    Attributes:
        order: 2 or 3.
        sigma: 1σ of ξ, rad, η, rad, and the anomaly, m/s².
        distance: distance at which the correlation is 1/e, m.
    """

    order: int
    sigma: tuple[float, float, float]
    distance: float

    @property
    def beta(self) -> float:
        """β, 1/m."""
        return AT_1_OVER_E[self.order] / self.distance

    def correlation(self, d: Array) -> Array:
        """Return the correlation at distances.

        Args:
            d: distances, (...) m.
        """
        x = self.beta * np.abs(d)
        return np.asarray((1.0 + x + (x * x / 3.0 if self.order == 3 else 0.0)) * np.exp(-x))

    def dynamics(self) -> tuple[Array, Array]:
        """Return the process of variance 1 as a linear system over the distance.

        Returns:
            F of dx/dd = F x + w, (order, order), x the value and its derivatives by the distance, and the stationary
            covariance of x, (order, order).
        """
        b = self.beta
        if self.order == 2:
            return np.array([[0.0, 1.0], [-b * b, -2.0 * b]]), np.diag([1.0, b * b])
        third = b * b / 3.0
        f = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-(b**3), -3.0 * b * b, -3.0 * b]])
        return f, np.array([[1.0, 0.0, -third], [0.0, third, 0.0], [-third, 0.0, b**4]])


class Remainder:
    """One realisation of the remainder along a way.

    Args:
        model: its statistics.
        distance: length of the way, m.
        seed: seed of the run; the remainder has random numbers of its own.
    """

    def __init__(self, model: RemainderModel, distance: float, seed: int) -> None:
        from scipy.linalg import expm

        if model.order not in AT_1_OVER_E:
            raise InputError(f"a remainder of order {model.order} is not known; the orders are 2 and 3.")
        self.model = model
        self.spacing = model.distance / KNOTS_PER_DISTANCE
        count = int(np.ceil(distance / self.spacing)) + 2
        f, stationary = model.dynamics()
        scale = np.sqrt(np.diag(stationary))  # components of about one size, or the Cholesky factor loses digits
        stationary = stationary / np.outer(scale, scale)
        step = expm(f * self.spacing) * scale[None, :] / scale[:, None]
        root_start = np.linalg.cholesky(stationary)
        root_step = _root(stationary - step @ stationary @ step.T)
        self.values, self.slopes = np.empty((count, 3)), np.empty((count, 3))
        for axis, sigma in enumerate(model.sigma):
            noise = np.column_stack(
                [normals(seed, "gravity remainder", 3 * axis + j, count) for j in range(model.order)]
            )
            x = np.empty((count, model.order))
            x[0] = root_start @ noise[0]
            _advance(step, noise @ root_step.T, x)
            self.values[:, axis], self.slopes[:, axis] = sigma * x[:, 0], sigma * scale[1] * x[:, 1]

    def at(self, distance: Array) -> Array:
        """Return ξ, η and the anomaly at distances travelled.

        Args:
            distance: from the start, (N,) m.

        Returns:
            ξ and η, rad, and the anomaly, m/s², (N, 3).
        """
        out = np.empty((len(distance), 3))
        _hermite_rows(np.ascontiguousarray(distance), self.spacing, self.values, self.slopes, out)
        return out


def _root(covariance: Array) -> Array:
    """Return a matrix whose product with its transpose is a covariance that may be nearly singular."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


@kernel
def _advance(step: Array, fresh: Array, x: Array) -> None:
    """x_k = step x_(k−1) + fresh_k, from the first row on."""
    order = len(step)
    for k in range(1, len(x)):
        for i in range(order):
            total = fresh[k, i]
            for j in range(order):
                total += step[i, j] * x[k - 1, j]
            x[k, i] = total


@kernel
def _hermite_rows(distance: Array, spacing: float, values: Array, slopes: Array, out: Array) -> None:
    last = len(values) - 2
    for i in range(len(distance)):
        x = distance[i] / spacing
        k = min(max(int(x), 0), last)
        u = x - k
        v = 1.0 - u
        a, b = v * v * (1.0 + 2.0 * u), u * u * (1.0 + 2.0 * v)
        c, d = spacing * v * v * u, spacing * u * u * v
        for j in range(3):
            out[i, j] = a * values[k, j] + b * values[k + 1, j] + c * slopes[k, j] - d * slopes[k + 1, j]
