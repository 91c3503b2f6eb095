"""Statistics of few numbers, each result worked out by hand from its definition."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from sinssim.statistics.chi_square import (
    compare_systems,
    detection_probability,
    extreme,
    mean_square_band,
    mid_value,
    share_inside,
    upper_tail,
)
from sinssim.statistics.circular_error import (
    circle_radius,
    end_rate,
    mean_rate,
    rate_uncertainty,
    share_in_circle,
    to_nmi_h,
)
from sinssim.statistics.circular_error import share_inside as share_about_mean
from sinssim.statistics.percentiles import percentile, runs_for_band, spread

NAN = math.nan


def test_rates_and_their_standard_error() -> None:
    """Σtr = 361 and 351, Σt² = 155 and 130; the squared residuals Σr² − (Σtr)²/Σt² are 17394/155 and 169/130."""
    time, errors = np.array([3.0, 5.0, 11.0]), np.array([[7.0, 2.0, 30.0], [7.0, NAN, 30.0], [7.0, 2.0, NAN]])
    assert mean_rate(time, errors) == pytest.approx([361.0 / 155.0, 2.7, 31.0 / 34.0], rel=1e-14)
    wanted = [math.sqrt(17394.0) / 155.0, 0.1, math.sqrt(53.0 - 31.0**2 / 34.0) / math.sqrt(34.0)]
    assert rate_uncertainty(time, errors) == pytest.approx(wanted, rel=1e-12)
    assert float(rate_uncertainty(time, errors[1])) == pytest.approx(0.1, rel=1e-12)
    assert end_rate(time, errors) == pytest.approx([30.0 / 11.0, 30.0 / 11.0, 2.0 / 5.0], rel=1e-14)
    assert np.isnan(end_rate([0.0], [4.0]))
    assert end_rate([1.0, 2.0, 4.0], [3.0, np.inf, np.nan]) == np.inf  # infinitely far off at its end
    assert to_nmi_h([463.0, 926.0]) == pytest.approx([900.0, 1800.0])  # 1852 m/s are 3600 nmi/h


def test_mean_and_spread_of_three_and_of_two_runs() -> None:
    """2, 5, 11: mean 6 and variance (16 + 1 + 25)/2 = 21; of σ it is σ/√6. 4 and 10: 7, 18, σ/2."""
    found = spread([[2.0, 4.0, 8.0], [5.0, NAN, NAN], [11.0, 10.0, math.inf]])
    assert found.mean == pytest.approx([6.0, 7.0, 8.0], rel=1e-14)
    assert found.sigma == pytest.approx([math.sqrt(21.0), math.sqrt(18.0), NAN], rel=1e-14, nan_ok=True)
    assert found.standard_error == pytest.approx([math.sqrt(3.5), math.sqrt(4.5), NAN], rel=1e-14, nan_ok=True)
    assert found.runs.tolist() == [3.0, 2.0, 1.0]


def test_band_of_two_degrees_of_freedom_is_that_of_an_exponential() -> None:
    """P(χ² > x) = exp(−x/2), so that the ends per degree of freedom are −ln(1 − α/2) and −ln(α/2)."""
    for confidence, found in ((0.95, mean_square_band([[2.0, 0.0]])), (0.8, mean_square_band([[2.0, 0.0]], 0.8))):
        tail = 0.5 * (1.0 - confidence)
        assert found.low == pytest.approx(np.array([[-math.log(1.0 - tail), NAN]]), rel=1e-12, nan_ok=True)
        assert found.high == pytest.approx(np.array([[-math.log(tail), NAN]]), rel=1e-12, nan_ok=True)
        assert found.confidence == confidence
    band = mean_square_band([2.0, 2.0, 2.0, 2.0, 2.0, 0.0])  # 0.0253 … 3.689
    assert share_inside([0.02, 0.03, 3.6, 3.7, NAN, 1.0], band) == 0.5
    assert np.isnan(share_inside([NAN, 1.0], mean_square_band([2.0, 0.0])))


@pytest.mark.parametrize(
    ("values", "both", "place", "single", "limit"),
    [
        # of three tests with two degrees of freedom: P = exp(−x), limit −ln(level/3) on one side
        ([0.4, 7.0, 5.0, NAN], [False] * 4, 1, math.exp(-7.0), -math.log(0.03 / 3.0)),
        ([1e-3, 7.0, 5.0, NAN], [False] * 4, 1, math.exp(-7.0), -math.log(0.03 / 3.0)),
        ([0.4, 7.0, 5.0, NAN], [True] * 4, 1, 2.0 * math.exp(-7.0), -math.log(0.03 / 6.0)),
        ([1e-4, 7.0, 5.0, NAN], [True] * 4, 0, -2.0 * math.expm1(-1e-4), -math.log1p(-0.03 / 6.0)),
        ([1.1, 0.7, 0.9, NAN], [False] * 4, 0, math.exp(-1.1), -math.log(0.03 / 3.0)),
    ],
)  # fmt: skip
def test_least_probable_of_several(
    values: list[float], both: list[bool], place: int, single: float, limit: float
) -> None:
    found = extreme(values, [2.0, 2.0, 2.0, 2.0], both, 0.03)
    assert found is not None
    assert (found.place, found.tests, found.level) == (place, 3, 0.03)
    assert found.probability == pytest.approx(min(3.0 * single, 1.0), rel=1e-9)
    assert found.limit == pytest.approx(limit, rel=1e-9)


def test_a_value_without_a_degree_of_freedom_does_not_count() -> None:
    found = extreme([3.0, 9.0], [2.0, 0.0], [False, False], 0.05)
    assert found is not None
    assert (found.place, found.tests) == (0, 1)
    assert found.probability == pytest.approx(math.exp(-3.0))


def test_percentiles_of_three_runs_with_their_bands() -> None:
    """Binomial with ½: 1, 3, 3, 1 eighths; with ¼: 27, 27, 9, 1 sixty-fourths. Tails of a quarter.

    Median: l = 1 + (2 − 1)/(4 − 1), u = 3 − 1/3. Quarter: place (3 + ⅓)/4 + ⅓ = 7/6; no lower end, as P(B < 1) is
    27/64; u = 2 − (16 − 10)/(37 − 10).
    """
    values = np.array([[50.0, 3.0], [10.0, NAN], [20.0, NAN]])
    half, quarter = percentile(values, 0.5, 0.5), percentile(values[:, 0], 0.25, 0.5)
    assert [half.value[0], half.low[0], half.high[0]] == pytest.approx([20.0, 10.0 + 10.0 / 3.0, 40.0], rel=1e-12)
    assert [half.value[1], half.low[1], half.high[1]] == [3.0, -math.inf, math.inf]
    assert half.runs.tolist() == [3.0, 1.0]
    assert (half.share, half.confidence, quarter.share) == (0.5, 0.5, 0.25)
    assert [float(x) for x in (quarter.value, quarter.low, quarter.high)] == pytest.approx(
        [10.0 + 10.0 / 6.0, -math.inf, 10.0 + 70.0 / 9.0], rel=1e-12
    )


def test_least_number_of_runs_for_both_ends() -> None:
    """0.5⁵ = 0.031 and 0.8¹⁴ = 0.044 are at most 0.05, 0.5⁴ and 0.8¹³ = 0.055 are not."""
    assert [runs_for_band(share, 0.9) for share in (0.5, 0.2, 0.8)] == [5, 14, 14]


def test_circles_about_zero_and_of_a_mean() -> None:
    """Equal axes: 1 − exp(−r²/2σ²), and with a mean a noncentral χ² of two degrees of freedom."""
    p = 4.0 * np.eye(2)
    assert share_in_circle(p, [1.0, 3.0]) == pytest.approx([-math.expm1(-0.125), -math.expm1(-1.125)], rel=1e-13)
    mean, radius = np.array([[1.2, -3.1], [0.0, 0.0], [3.0, 4.0], [3.0, 4.0]]), np.array([5.0, 3.0, 4.9, 5.1])
    covariance = np.stack([p, p, 0.0 * p, 0.0 * p])
    wanted = [ncx2.cdf(25.0 / 4.0, 2, (1.2**2 + 3.1**2) / 4.0), -math.expm1(-1.125), 0.0, 1.0]
    assert share_about_mean(radius, covariance, mean) == pytest.approx(wanted, abs=1e-12)
    long = np.array([[9.0, 0.0], [0.0, 0.0]])  # one axis alone: a normal distribution of σ = 3
    assert float(share_in_circle(long, 3.0)) == pytest.approx(math.erf(math.sqrt(0.5)), abs=1e-12)
    assert float(circle_radius(long, math.erf(math.sqrt(0.5)))) == pytest.approx(3.0, rel=1e-10)


def test_tail_of_a_sum_of_squares_at_its_mean() -> None:
    """Where formula (1) is 0/0, by the skewness √(8/n): χ² of 300 degrees of freedom at 300."""
    assert upper_tail(np.full(300, 2.5), 750.0) == pytest.approx(float(chi2.sf(300.0, 300)), abs=2e-5)


def test_comparison_of_three_systems() -> None:
    """C = diag(2, 8) m²: s = dₓ²/4 + d_y²/16. A threshold of two degrees of freedom is −2 ln α."""
    outputs = np.array([[[[1.0, 2.0]], [[5.0, -6.0]], [[2.0, 6.0]]]])
    found = compare_systems(outputs, np.array([[[2.0, 0.0], [0.0, 8.0]]]), 0.02)
    assert found.pairs == ((0, 1), (0, 2), (1, 2))
    assert found.statistic == pytest.approx(np.array([[[8.0], [1.25], [11.25]]]), rel=1e-13)
    assert found.threshold == pytest.approx(-2.0 * math.log(0.02), rel=1e-12)  # 7.8
    assert found.alarms.tolist() == [[[True], [False], [True]]]
    assert found.identified.tolist() == [[1]]
    assert mid_value(outputs).tolist() == [[[2.0, 2.0]]]
    covariance = np.array([[[2.0, 0.0], [0.0, 8.0]], [[0.0, 0.0], [0.0, 0.0]]])
    probability = detection_probability([[4.0, -8.0], [4.0, -8.0]], covariance, 0.02)  # λ = 4 + 4, and no test
    assert probability == pytest.approx([ncx2.sf(-2.0 * math.log(0.02), 2, 8.0), 0.02], rel=1e-9)
