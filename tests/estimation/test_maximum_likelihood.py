"""The maximum of the likelihood against closed forms: a σ of white readings, and a random walk that is read."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from sinssim.data import Array
from sinssim.estimation.linear_replay import Series
from sinssim.estimation.maximum_likelihood import log_likelihood, maximum, sigma_of

COUNT = 400
WIDE = np.full(2, 9.0)


def series(value: Array, covariance: Array) -> list[Series]:
    return [Series("any", np.arange(value.shape[1], dtype=float), np.arange(value.shape[1]), value, covariance)]


def test_sigma_of_white_readings() -> None:
    """σ̂² is the mean square, and ln σ̂ has the variance 1/(2Mk); a second parameter that changes nothing is flat."""
    read = 0.37 * np.random.default_rng(1).standard_normal((COUNT, 3))

    def replay(sets: Array) -> list[Series]:
        size = np.exp(2.0 * sets[:, 0])[:, None, None, None] * np.eye(3)
        return series(np.tile(read, (len(sets), 1, 1)), np.tile(size, (1, COUNT, 1, 1)))

    best = maximum(replay, np.array([1.5, 0.3]), -WIDE, WIDE, lambda _: None)
    assert best.x[0] == pytest.approx(0.5 * np.log(np.mean(read**2)), abs=0.2 * best.sigma[0])
    assert best.sigma[0] == pytest.approx(1.0 / np.sqrt(2.0 * COUNT * 3.0), rel=2e-3)
    assert best.sigma[1] == np.inf
    mean = np.mean(read**2)
    expected = -0.5 * COUNT * 3.0 * (np.log(np.exp(2.0 * best.x[0])) + mean / np.exp(2.0 * best.x[0]))
    assert best.value == pytest.approx(expected)
    assert best.steps < 12


def walk(sets: Array, read: Array) -> list[Series]:
    """Innovations of a scalar random walk with white readings, by the recursion of a Kalman filter."""
    q, r = np.exp(2.0 * sets).T
    x, p = np.zeros(len(sets)), np.full(len(sets), 100.0)
    value, s = np.empty((2, len(sets), len(read)))
    for k, z in enumerate(read):
        p = p + q
        value[:, k], s[:, k] = z - x, p + r
        gain = p / s[:, k]
        x, p = x + gain * value[:, k], (1.0 - gain) * p
    return series(value[..., None], s[..., None, None])


def test_two_noises_of_a_random_walk() -> None:
    """Against a search along each of both by the density of all readings at once, and the spread of its maxima."""
    rng = np.random.default_rng(5)
    read = np.cumsum(0.3 * rng.standard_normal(COUNT)) + 1.0 * rng.standard_normal(COUNT)
    best = maximum(lambda sets: walk(sets, read), np.array([1.0, -1.5]), -WIDE, WIDE, lambda _: None)

    def whole(x: Array) -> float:
        """−2 ln of the density of the readings, a normal distribution, by its covariance matrix."""
        at = np.minimum.outer(np.arange(1, COUNT + 1), np.arange(1, COUNT + 1))
        matrix = 100.0 + np.exp(2.0 * x[0]) * at + np.exp(2.0 * x[1]) * np.eye(COUNT)
        return float(np.linalg.slogdet(matrix)[1] + read @ np.linalg.solve(matrix, read))

    assert best.value == pytest.approx(-0.5 * whole(best.x), rel=1e-9)
    for k in range(2):
        other = minimize_scalar(lambda v, k=k: whole(np.where(np.arange(2) == k, v, best.x)), (-2.0, 0.5)).x
        assert other == pytest.approx(best.x[k], abs=0.2 * best.sigma[k])
    np.testing.assert_allclose(best.x, np.log([0.3, 1.0]), atol=3.0 * best.sigma.max())
    first, second, both = (
        (whole(best.x + step) + whole(best.x - step) - 2.0 * whole(best.x)) / 0.02
        for step in 0.1 * np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    )
    cross = 0.5 * (both - first - second)
    hessian = np.array([[first, cross], [cross, second]])
    np.testing.assert_allclose(best.sigma, np.sqrt(np.linalg.inv(hessian).diagonal()), rtol=0.15)  # expected, observed


def test_a_limit_holds() -> None:
    read = np.random.default_rng(2).standard_normal((COUNT, 1))

    def replay(sets: Array) -> list[Series]:
        size = np.exp(2.0 * sets[:, 0])[:, None, None, None] * np.eye(1)
        return series(np.tile(read, (len(sets), 1, 1)), np.tile(size, (1, COUNT, 1, 1)))

    best = maximum(replay, np.array([-3.0]), np.array([-4.0]), np.array([-1.0]), lambda _: None)
    assert best.x.tolist() == [-1.0]


def test_readings_that_count() -> None:
    value, covariance = np.full((2, 3, 1), 2.0), np.full((2, 3, 1, 1), 4.0)
    assert log_likelihood(series(value, covariance)).tolist() == pytest.approx([-1.5 * (1.0 + np.log(4.0))] * 2)
    assert sigma_of(np.diag([4.0, 0.0])).tolist() == [0.5, np.inf]
