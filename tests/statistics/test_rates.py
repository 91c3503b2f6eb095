"""Rates in both definitions, spread, and χ² bands against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.statistics import end_rate, mean_rate, mean_square_band, share_inside, spread, to_nmi_h


def test_a_straight_line_has_one_rate() -> None:
    time = np.linspace(0.0, 3600.0, 361)
    errors = np.outer([0.5, 1.0], time) * 1852.0 / 3600.0
    np.testing.assert_allclose(to_nmi_h(mean_rate(time, errors)), [0.5, 1.0], rtol=1e-14)
    np.testing.assert_allclose(to_nmi_h(end_rate(time, errors)), [0.5, 1.0], rtol=1e-14)


def test_the_definitions_differ_for_an_oscillation() -> None:
    """r = A(1 − cos ωt) over a whole period: Σtr/Σt² → 3A(1/2 − 0)/T … by the integrals ∫t² and ∫t(1 − cos)."""
    period = 5064.0
    time = np.linspace(0.0, period, 200_001)
    error = 1000.0 * (1.0 - np.cos(2.0 * np.pi * time / period))
    assert float(mean_rate(time, error)) == pytest.approx(1000.0 * 1.5 / period, rel=1e-4)  # (T²/2)/(T³/3)
    assert float(end_rate(time, error)) == pytest.approx(0.0, abs=1e-9)


def test_least_squares_by_numpy() -> None:
    rng = np.random.default_rng(3)
    time, error = np.arange(50.0), rng.rayleigh(size=50)
    wanted = np.linalg.lstsq(time[:, None], error, rcond=None)[0][0]
    assert float(mean_rate(time, error)) == pytest.approx(wanted, rel=1e-13)


def test_failed_and_shorter_runs() -> None:
    time = np.array([0.0, 10.0, 20.0])
    errors = np.array([[np.inf, np.inf, np.inf], [0.0, 10.0, np.nan], [np.nan, np.nan, np.nan]])
    found = mean_rate(time, errors)
    assert found[:2].tolist() == [np.inf, 1.0]
    assert np.isnan(found[2])
    assert end_rate(time, errors)[:2].tolist() == [np.inf, 1.0]


def test_arrays_belong_together() -> None:
    with pytest.raises(InputError, match="shape"):
        mean_rate(np.arange(3.0), np.zeros((2, 4)))
    with pytest.raises(InputError, match="not negative"):
        end_rate(np.array([-1.0, 1.0]), np.zeros(2))


def test_spread_and_its_standard_error() -> None:
    """Over 4000 ensembles of 50 runs the scatter of σ is σ/√(2N) to 5 % (its own error is 1.1 %)."""
    values = np.random.default_rng(4).normal(3.0, 2.0, size=(50, 4000))
    found = spread(values)
    assert np.mean(found.sigma**2) == pytest.approx(4.0, rel=0.02)
    assert np.std(found.sigma) == pytest.approx(2.0 / np.sqrt(100.0), rel=0.05)
    np.testing.assert_allclose(found.sigma, np.std(values, axis=0, ddof=1), rtol=1e-12)
    with_failure = spread(np.array([1.0, 3.0, np.inf, np.nan]))
    assert (float(with_failure.mean), float(with_failure.sigma), float(with_failure.runs)) == (2.0, np.sqrt(2.0), 2.0)


def test_band_of_mean_squares() -> None:
    """Bar-Shalom, Li and Kirubarajan, section 5.4: 50 runs, 2 states: [1.5, 2.6], here per state."""
    band = mean_square_band(100.0)
    assert (2.0 * float(band.low), 2.0 * float(band.high)) == (
        pytest.approx(1.484, abs=1e-3),
        pytest.approx(2.591, abs=1e-3),
    )
    squares = np.random.default_rng(5).normal(size=(50, 2, 20_000)) ** 2
    assert share_inside(squares.mean(axis=(0, 1)), band) == pytest.approx(0.95, abs=0.008)  # five standard errors
    assert np.isnan(mean_square_band(0.0).low)
