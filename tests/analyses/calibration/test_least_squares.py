"""The least squares of a calibration on problems that can be solved by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.calibration_problem import Solution, nuisances, solve, unobservable

NONE = np.zeros((3, 0)), np.zeros(0)


def test_one_direction_is_seen_and_one_is_not() -> None:
    """In sizes of 2 and 5 the singular values are 2 and 0.5: the second parameter is set to zero, with its size."""
    a, r = np.array([[1.0, 0.0], [0.0, 0.1], [0.0, 0.0]]), np.array([4.0, 3.0, 2.0])
    found = solve(r, a, *NONE, np.array([2.0, 5.0]), np.array([0.3, 0.7]))
    np.testing.assert_allclose(found.correction, [4.0, -0.7], rtol=1e-12)
    np.testing.assert_allclose(found.covariance, np.diag([1.0, 25.0]), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found.singular, [2.0, 0.5], rtol=1e-12)
    np.testing.assert_allclose(np.abs(found.directions), np.eye(2), rtol=0, atol=1e-15)
    assert (found.rank, found.observable.tolist(), found.degrees) == (1, [True, False], 2)
    assert found.chi_square == pytest.approx(3.07**2 + 4.0, rel=1e-12)
    # on the way both are drawn to zero by their sizes: 1 (4 − x) = (0.3 + x)/4 and 0.1 (3 − 0.1 y) = (0.7 + y)/25
    found = solve(r, a, *NONE, np.array([2.0, 5.0]), np.array([0.3, 0.7]), final=False)
    np.testing.assert_allclose(found.correction, [3.14, 5.44], rtol=1e-12)


def test_fewer_observations_than_parameters() -> None:
    """3x + 4y = 10: the shortest solution (1.2, 1.6), and nothing left of the values across it."""
    found = solve(
        np.array([10.0]), np.array([[3.0, 4.0]]), np.zeros((1, 0)), np.zeros(0), np.ones(2), np.array([-8.0, 6.0])
    )
    np.testing.assert_allclose(np.array([-8.0, 6.0]) + found.correction, [1.2, 1.6], rtol=1e-12)
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    np.testing.assert_allclose(found.covariance, np.outer(along, along) / 25.0 + np.outer(across, across), rtol=1e-12)
    assert (found.rank, found.degrees, found.observable.tolist()) == (1, 0, [False, False])
    assert found.chi_square == pytest.approx(0.0, abs=1e-20)


def test_nuisances_are_noise_of_known_covariance() -> None:
    """Against generalised least squares with 1 + B Bᵀ; known residuals of the nuisances shift the observations."""
    rng = np.random.default_rng(4)
    a, b, r, prior = rng.normal(size=(9, 2)), rng.normal(size=(9, 3)), rng.normal(size=9), np.array([0.5, -0.3, 0.8])
    weight = np.linalg.inv(np.eye(9) + b @ b.T)
    size, shifted = np.array([20.0, 30.0]), r - b @ prior
    covariance = np.linalg.inv(a.T @ weight @ a)
    best = covariance @ a.T @ weight @ shifted
    found = solve(r, a, b, prior, size, np.zeros(2))
    np.testing.assert_allclose(found.correction, best, rtol=1e-10)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-10)
    left = shifted - a @ best
    assert found.chi_square == pytest.approx(left @ weight @ left, rel=1e-10)
    assert found.degrees == 7
    np.testing.assert_allclose(nuisances(r - a @ best, b, prior), prior + b.T @ weight @ left, rtol=1e-10)


def test_combinations_are_named_by_their_largest_part() -> None:
    names = ["gyro bias x", "gyro bias y", "accel bias x", "accel bias y", "accel scale z"]
    lost = np.array([[0.0, 0.0, -0.5, 1.0, -0.06], [-1.0, 0.0, 0.0, 0.0, 0.0]]).T
    seen = np.array([[0.0, 1.0, 0.0, 0.0, 0.0]] * 3).T
    nothing = np.zeros(5)
    directions = np.hstack([seen, lost / np.linalg.norm(lost, axis=0)])
    solution = Solution(nothing, np.eye(5), nothing, directions, 3, nothing > 0.0, 0.0, 0)
    assert unobservable(solution, names) == ["gyro bias x", "accel bias y − 0.5 accel bias x"]
    mixed = np.array([[0.0, 0.72, 0.0, 1.0, 0.0]]).T
    directions = np.hstack([np.hstack([seen, seen[:, :1]]), mixed / np.linalg.norm(mixed)])
    solution = Solution(nothing, np.eye(5), nothing, directions, 4, nothing > 0.0, 0.0, 0)
    assert unobservable(solution, names) == ["accel bias y + 0.7 gyro bias y"]
