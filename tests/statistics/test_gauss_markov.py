"""The Gauss-Markov process against its covariance, and the coefficients of its means in fifty digits."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest

from sinssim.statistics.random_numbers import gauss_markov, lost, mean_step

ULP = np.finfo(float).eps

INTERVALS = [1e-9, 3e-5, 1e-3, 0.01, 0.0199, 0.01999999, 0.02, 0.0200001, 0.03, 0.05, 0.3, 1.0, 2.5, 20.0]
"""Over the correlation time; up to 0.02 the series hold alone."""


def test_process_has_its_covariance_at_any_instants() -> None:
    interval = np.array([0.1, 2.0, 0.7, 30.0, 1e-3])
    root = np.stack([gauss_markov(interval, 3.0, unit) for unit in np.eye(6)], axis=1)
    time = np.concatenate([[0.0], np.cumsum(interval)])
    expected = np.exp(-np.abs(np.subtract.outer(time, time)) / 3.0)
    np.testing.assert_allclose(root @ root.T, expected, rtol=0, atol=4 * ULP)


@pytest.mark.parametrize("x", INTERVALS)
def test_what_has_decayed(x: float) -> None:
    with localcontext() as digits:
        digits.prec = 50
        exact = float(1 - (-Decimal(x)).exp())
    assert lost(x) == pytest.approx(exact, rel=4 * ULP, abs=0.0)


@pytest.mark.parametrize("x", INTERVALS)
def test_means_have_the_variance_and_the_covariance_of_the_process(x: float) -> None:
    """V = 2(x − 1 + d)/x² of each, and (1 − d)²/x² of neighbours: e² + g² and e(de + qg)."""
    d, q, e, g = mean_step(x)
    with localcontext() as digits:
        digits.prec = 50
        t, kept = Decimal(x), (-Decimal(x)).exp()
        variance, neighbours = 2 * (t - 1 + kept) / t**2, ((1 - kept) / t) ** 2
        fresh = (1 - kept**2).sqrt()
        assert d == pytest.approx(float(kept), rel=2 * ULP)
        assert q == pytest.approx(float(fresh), rel=4 * ULP)
        # the exact sum of squares of the rounded coefficients
        found = Decimal(e) ** 2 + Decimal(g) ** 2
        assert abs(found / variance - 1) < Decimal(6 * ULP if x < 0.02 else 100 * ULP)
        found = Decimal(e) * (Decimal(d) * Decimal(e) + Decimal(q) * Decimal(g))
        assert abs(found - neighbours) < Decimal(8 * ULP if x < 0.02 else 100 * ULP)
    assert g > 0.0
