"""Tails of weighted sums of χ² against closed forms: equal weights, and pairs, whose sum is hypoexponential."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.data import Array
from sinssim.statistics.chi_square import quantile, upper_tail


@pytest.mark.parametrize("freedom", [1, 3, 10, 300])
@pytest.mark.parametrize("tail", [0.5, 0.025, 1e-3, 1e-6, 1e-12])
def test_equal_weights_are_chi_square(freedom: int, tail: float) -> None:
    """The saddlepoint's relative error is at most 12 % with one degree of freedom, 1 % with ten."""
    weights = np.full(freedom, 2.5)
    value = 2.5 * float(chi2.isf(tail, freedom))
    assert upper_tail(weights, value) == pytest.approx(tail, rel=0.12 / freedom, abs=0.0)
    assert quantile(weights, tail) == pytest.approx(value, rel=0.02 / freedom)


def exceeds(values: Array, q: float) -> float:
    """Return P(Σ a Eᵢ > q) for independent exponential variables Eᵢ of mean 2, by partial fractions."""
    return float(sum(np.exp(-q / (2.0 * a)) * np.prod([a / (a - b) for b in values if b != a]) for a in values))


@pytest.mark.parametrize("q", [1.0, 3.5, 10.0, 20.0, 40.0])
def test_unequal_weights_in_pairs_are_hypoexponential(q: float) -> None:
    """A χ² of the same mean and variance says 1.4e-10 at q = 40, where the probability is 5.4e-9."""
    values = np.array([1.0, 0.5, 0.2, 0.05])
    assert upper_tail(np.repeat(values, 2), q) == pytest.approx(exceeds(values, q), rel=0.05)


@pytest.mark.parametrize("value", [-1.0, 0.0, np.inf])
def test_ends(value: float) -> None:
    assert upper_tail(np.ones(3), value) == (0.0 if value > 0.0 else 1.0)
