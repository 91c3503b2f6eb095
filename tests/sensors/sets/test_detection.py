"""Probabilities of the parity test against published tables, closed forms and draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from sinssim.errors import InputError
from sinssim.sensors.fault_detection import missed_detection, smallest_fault, smallest_noncentrality, threshold
from sinssim.sensors.sensor_set_section import READY, parity_matrix


@pytest.mark.parametrize(
    ("freedom", "probability", "published"),
    [(1, 0.05, 3.841), (1, 0.001, 10.828), (2, 0.01, 9.210), (3, 0.05, 7.815), (3, 0.001, 16.266)],
)
def test_thresholds_of_the_published_table(freedom: int, probability: float, published: float) -> None:
    assert threshold(probability, freedom) == pytest.approx(published, abs=5e-4)


def test_two_degrees_of_freedom_in_closed_form() -> None:
    assert threshold(1e-9, 2) == pytest.approx(-2.0 * math.log(1e-9), rel=1e-12)


@pytest.mark.parametrize("noncentrality", [0.0, 4.0, 30.0])
def test_one_degree_of_freedom_in_closed_form(noncentrality: float) -> None:
    """A squared normal number of mean √λ is below T with Φ(√T − √λ) − Φ(−√T − √λ)."""
    root, mean = math.sqrt(threshold(1e-3, 1)), math.sqrt(noncentrality)
    expected = stats.norm.cdf(root - mean) - stats.norm.cdf(-root - mean)
    assert missed_detection(noncentrality, 1e-3, 1) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("freedom", [1, 2, 3, 6])
def test_the_smallest_fault_is_missed_as_stated(freedom: int) -> None:
    """Against draws of the sum of squares itself: 10⁵ draws, 95 % band, fails by chance in 5 %: the seed is fixed."""
    least = smallest_noncentrality(0.1, 1e-4, freedom)
    z = np.random.default_rng(6).standard_normal((100_000, freedom))
    z[:, 0] += math.sqrt(least)
    missed = np.mean(np.sum(z * z, axis=1) < threshold(1e-4, freedom))
    assert missed == pytest.approx(0.1, abs=1.96 * math.sqrt(0.1 * 0.9 / 1e5))


def test_the_smallest_fault_of_a_sensor_in_units_of_sigma() -> None:
    """f = σ √λ/|v_i| with |v_i|² = 1/2 for every sensor of the dodecahedron, 1/4 for one of four on a cone."""
    for name, size in (("dodecahedron", 0.5), ("cone-4", 0.25)):
        v = parity_matrix(READY[name])
        sigma = 3.0
        found = smallest_fault(v, sigma**2 * np.eye(len(v)), 1e-6, 1e-2)
        expected = sigma * math.sqrt(smallest_noncentrality(1e-2, 1e-6, len(v)) / size)
        np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_fault_that_is_not_seen_would_have_to_be_infinite() -> None:
    s = math.sqrt(0.5)
    axes = np.array([(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0, s, s), (0, s, -s)])
    found = smallest_fault(parity_matrix(axes), np.eye(2), 1e-6, 1e-2)
    assert np.isinf(found[0])
    assert np.all(np.isfinite(found[1:]))


@pytest.mark.parametrize("call", [lambda: threshold(0.0, 3), lambda: threshold(1.0, 3), lambda: threshold(0.1, 0)])
def test_probabilities_that_cannot_be(call) -> None:
    with pytest.raises(InputError, match=r"must be a"):
        call()
    with pytest.raises(InputError, match=r"missed = 0\.95 must be between 0 and 1 − false_alarm = 0\.9"):
        smallest_noncentrality(0.95, 0.1, 3)
