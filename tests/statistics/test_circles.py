"""Circles of a normal distribution against closed forms, Marcum's Q, and an integral in other coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf
from scipy.stats import ncx2, norm

from sinssim.errors import InputError
from sinssim.statistics import circle_radius, share_in_circle


def test_equal_eigenvalues() -> None:
    covariance = 4.0 * np.eye(2)
    assert float(circle_radius(covariance, 0.5)) == pytest.approx(2.0 * 1.1774100225154747, rel=1e-13)
    assert float(circle_radius(covariance, 0.95)) == pytest.approx(2.0 * 2.447746830680816, rel=1e-13)


def test_one_axis_alone() -> None:
    covariance = np.array([[0.0, 0.0], [0.0, 9.0]])
    for share in (0.1, 0.5, 0.95, 0.999):
        assert float(circle_radius(covariance, share)) == pytest.approx(3.0 * norm.ppf(0.5 * (1.0 + share)), rel=1e-9)


@pytest.mark.parametrize("ratio", [0.9, 0.5, 0.1, 0.01, 1e-3])
def test_against_an_integral_over_one_axis(ratio: float) -> None:
    """P = ∫ φ(x) erf(√(R² − x²)/(√2 σ₂)) dx over |x| < R: another way to the same probability."""
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    covariance = turn @ np.diag([1.0, ratio**2]) @ turn.T
    for share in (0.5, 0.95):
        radius = float(circle_radius(covariance, share))
        found, _ = quad(
            lambda a, r=radius: norm.pdf(r * np.sin(a)) * erf(r * np.cos(a) / (np.sqrt(2.0) * ratio)) * r * np.cos(a),
            -0.5 * np.pi, 0.5 * np.pi, epsabs=1e-13, epsrel=1e-12, limit=400,
        )  # fmt: skip
        assert found == pytest.approx(share, abs=1e-10)


@pytest.mark.parametrize("ratio", [0.8, 0.4])
def test_against_marcum_q(ratio: float) -> None:
    """Hoyt's distribution by Marcum's Q (J. F. Paris, Electronics Letters 45, 2009): P = Q(a, b) − Q(b, a)."""
    radius = 1.3
    # with Q(a, b) = P(χ'² of 2 degrees of freedom and non-centrality a² > b²)
    a, b = ((1.0 + sign * ratio) / (2.0 * ratio) * radius for sign in (1.0, -1.0))
    q = [float(ncx2.sf(y * y, 2, x * x)) for x, y in ((a, b), (b, a))]
    assert float(share_in_circle(np.diag([1.0, ratio**2]), radius)) == pytest.approx(q[0] - q[1], abs=1e-12)


def test_many_at_once_and_the_edges() -> None:
    p = np.array([np.eye(2), np.zeros((2, 2)), np.full((2, 2), np.nan)])
    found = circle_radius(p, 0.95)
    assert found.shape == (3,)
    assert found[1] == 0.0
    assert np.isnan(found[2])
    assert np.isnan(circle_radius(np.full((2, 2), np.nan), 0.5))
    scales = circle_radius(np.eye(2) * np.array([1e-24, 1.0, 1e24])[:, None, None], 0.5)
    np.testing.assert_allclose(scales, 1.1774100225154747 * np.array([1e-12, 1.0, 1e12]), rtol=1e-13)


def test_wrong_covariances() -> None:
    with pytest.raises(InputError, match="positive"):
        circle_radius(np.diag([1.0, -1.0]), 0.5)
    with pytest.raises(InputError, match="symmetric"):
        circle_radius(np.array([[1.0, 0.5], [0.0, 1.0]]), 0.5)
    with pytest.raises(InputError, match="shape"):
        circle_radius(np.eye(3), 0.5)
    with pytest.raises(InputError, match="share"):
        circle_radius(np.eye(2), 95.0)
