"""The biases by a window: the normal equations against differences of the least sum over all rotations."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sinssim.analyses.inspection.velocity_match import _Window
from sinssim.data import Array

RNG = np.random.default_rng(5)
COUNT = 9
ALPHA, G, THETA = RNG.normal(0.0, 3.0, (COUNT, 3)), RNG.normal(0.0, 2.0, (COUNT, 3, 3)), RNG.normal(size=(COUNT, 3, 3))
BIAS = np.array([0.02, -0.03, 0.05, 0.1, -0.2, 0.3])
TURN = Rotation.from_rotvec([0.4, -1.1, 0.7])


def moved(bias: Array) -> Array:
    """α + G b_g − Θ b_a, where G follows the attitude in the middle: the fifth of nine."""
    turned = np.array([g - np.cross(a, THETA[COUNT // 2].T).T for a, g in zip(ALPHA, G, strict=True)])
    return np.asarray(ALPHA + turned @ bias[:3] - THETA @ bias[3:])


def window(noise: float) -> _Window:
    beta = TURN.apply(moved(BIAS)) + np.array([5.0, 7.0, -3.0]) + noise * RNG.normal(size=(COUNT, 3))
    return _Window(beta, np.column_stack([ALPHA, G.reshape(-1, 9), THETA.reshape(-1, 9)]))


def least(one: _Window, bias: Array) -> float:
    """Return the least Σ|β − C α|² over all rotations, by SciPy's solution of Wahba's problem."""
    alpha = moved(bias) - moved(bias).mean(axis=0)
    return float(Rotation.align_vectors(one.beta, alpha)[1] ** 2)


def test_the_fit_of_a_window_without_noise() -> None:
    error, c, second, alpha = window(0.0).fit(BIAS)
    np.testing.assert_allclose(error, 0.0, atol=1e-12)
    np.testing.assert_allclose(c, TURN.as_matrix(), atol=1e-13)
    centred = moved(BIAS) - moved(BIAS).mean(axis=0)
    np.testing.assert_allclose(alpha, centred, atol=1e-12)
    assert second == np.float64(second)
    np.testing.assert_allclose(second, np.linalg.svd(centred.T @ centred)[1][1], rtol=1e-12)


def test_the_equations_of_the_biases() -> None:
    """At any biases the right side is minus half the slope of the least sum; without residuals, the matrix is half its
    curvature."""
    noisy, h = window(0.4), 1e-5
    start = BIAS + 0.05
    slope = [(least(noisy, start + h * e) - least(noisy, start - h * e)) / (2.0 * h) for e in np.eye(6)]
    np.testing.assert_allclose(noisy.of_biases(start)[1], -0.5 * np.array(slope), rtol=1e-6, atol=1e-6)
    clean = window(0.0)
    normal, right = clean.of_biases(BIAS)
    np.testing.assert_allclose(right, 0.0, atol=1e-10)
    h = 1e-3
    for i, a in enumerate(h * np.eye(6)):
        for k, b in enumerate(h * np.eye(6)):
            sums = least(clean, BIAS + a + b) - least(clean, BIAS + a - b) - least(clean, BIAS - a + b)
            curvature = (sums + least(clean, BIAS - a - b)) / (4.0 * h * h)
            np.testing.assert_allclose(normal[i, k], 0.5 * curvature, rtol=2e-3, atol=2e-3 * normal.max())
