"""Percentiles over runs: known order statistics, failed runs, coverage of the bands."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom, lognorm, rayleigh

from sinssim.errors import InputError
from sinssim.statistics import cep, percentile, r95, runs_for_band
from tests.slow import slow


def test_estimate_is_the_median_unbiased_one_of_numpy() -> None:
    values = np.random.default_rng(1).rayleigh(size=(137, 5))
    for share in (0.05, 0.5, 0.9, 0.95, 0.99):
        wanted = np.percentile(values, 100.0 * share, axis=0, method="median_unbiased")
        np.testing.assert_allclose(percentile(values, share).value, wanted, rtol=1e-14)


def test_textbook_bands() -> None:
    """W. J. Conover, Practical Nonparametric Statistics, section 3.2: N = 16, median, x₍₄₎ … x₍₁₃₎ holds 97.9 %."""
    held = float(binom.pmf(np.arange(4, 13), 16, 0.5).sum())
    assert held == pytest.approx(0.9787, abs=5e-5)
    band = cep(np.arange(1.0, 17.0), confidence=held)
    assert (float(band.low), float(band.high)) == (pytest.approx(4.0, abs=1e-9), pytest.approx(13.0, abs=1e-9))


def test_bands_hold_the_neighbouring_order_statistics() -> None:
    """Each end lies between the two whole ranks whose exact probabilities enclose 2.5 %."""
    values = np.arange(1.0, 501.0)
    found = r95(values)
    low, high = int(np.floor(found.low)), int(np.ceil(found.high))
    assert binom.cdf(low - 1, 500, 0.95) <= 0.025 < binom.cdf(low, 500, 0.95)
    assert binom.sf(high - 1, 500, 0.95) <= 0.025 < binom.sf(high - 2, 500, 0.95)


def test_no_upper_end_from_few_runs() -> None:
    assert runs_for_band(0.95) == 72  # 0.95⁷² = 0.0249
    assert runs_for_band(0.5) == 6
    values = np.arange(100.0)
    assert np.isinf(r95(values[:71]).high)
    assert 70.0 < float(r95(values[:72]).high) <= 71.0
    assert float(r95(values[:1]).value) == 0.0


def test_failed_runs_are_infinitely_far_off() -> None:
    values = np.array([*np.arange(1.0, 97.0), np.inf, np.inf, np.inf, np.inf])
    found = r95(values)
    assert float(found.value) == pytest.approx(np.percentile(np.arange(1.0, 101.0), 95.0, method="median_unbiased"))
    assert np.isinf(found.high)  # 4 % failed: the true 95th percentile may be among the failures
    assert np.isinf(r95(np.array([*np.arange(1.0, 90.0), *[np.inf] * 11])).value)
    assert np.isfinite(cep(values).high)


def test_missing_values_do_not_count() -> None:
    values = np.array([[1.0, 5.0], [2.0, np.nan], [3.0, 7.0], [4.0, np.nan]])
    found = cep(values)
    assert found.runs.tolist() == [4.0, 2.0]
    assert found.value.tolist() == [2.5, 6.0]
    assert np.isnan(cep(np.array([np.nan])).value)


@pytest.mark.parametrize("law", [rayleigh(), lognorm(1.0)], ids=["rayleigh", "lognormal"])
@pytest.mark.parametrize(("share", "runs"), [(0.5, 40), (0.5, 1000), (0.95, 200), (0.95, 1000)])
@pytest.mark.parametrize("thousands", [2, *slow(10)])
def test_coverage_over_thousands_of_ensembles(law, share: float, runs: int, thousands: int) -> None:
    """The share of bands that hold the true percentile is 95 ± 1 %; its standard error over 10⁴ ensembles is 0.2 %."""
    rng, true = np.random.default_rng(2), law.ppf(share)
    held = 0
    for _ in range(thousands):
        found = percentile(law.rvs(size=(runs, 1000), random_state=rng), share)
        held += int(np.count_nonzero((found.low <= true) & (true <= found.high)))
    assert abs(held / (1e3 * thousands) - 0.95) < 0.01 * np.sqrt(10 / thousands)


@pytest.mark.parametrize("wrong", [0.0, 1.0, -0.1, 95.0, np.nan])
def test_a_share_is_between_zero_and_one(wrong: float) -> None:
    with pytest.raises(InputError, match="share"):
        percentile(np.arange(5.0), wrong)
    with pytest.raises(InputError, match="at least one run"):
        percentile(np.zeros((0, 3)), 0.5)
