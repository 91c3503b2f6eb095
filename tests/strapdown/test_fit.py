"""The fits of rate and force against polynomials, and tables longer than the blocks in which they are computed."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from sinssim.strapdown.coning_sculling import UNIFORM, is_uniform, moment_weights, weight_table


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_moments_of_a_polynomial_through_all_increments(count: int) -> None:
    """a₂ = 12 A₁ and a₃ = 180 A₂ − 15 A₀ of Aᵢ = ∫ sⁱ rate T ds over the interval's own −½…½, by antiderivatives."""
    rng = np.random.default_rng(count)
    edges = np.cumsum(rng.uniform(0.5, 1.5, count + 1))
    rate = Polynomial(rng.normal(size=count))
    increments = np.diff(rate.integ()(edges))
    table = moment_weights(np.tile(edges, (count, 1)), np.arange(count))
    assert table.shape == (count, 10)
    for k, row in enumerate(table):
        left, right = edges[k], edges[k + 1]
        s = Polynomial([-0.5 * (left + right), 1.0]) / (right - left)
        a0, a1, a2 = (np.diff((rate * s**power).integ()([left, right]))[0] for power in range(3))
        assert row[:count] @ increments == pytest.approx(12.0 * a1, rel=1e-9, abs=1e-12)
        assert row[5 : 5 + count] @ increments == pytest.approx(180.0 * a2 - 15.0 * a0, rel=1e-9, abs=1e-11)
        assert not row[count:5].any()
        assert not row[5 + count :].any()


def test_one_unequal_interval_is_found_wherever_it_is() -> None:
    """65 536 intervals are looked at at once; a difference counts from a millionth on."""
    even = np.arange(70_001.0)
    assert is_uniform(even)
    for k in (0, 65_534, 65_535, 65_536, 69_999):
        for fraction in (0.5, 1.5):
            time = even.copy()
            time[k + 1 :] += fraction * UNIFORM
            assert is_uniform(time) == (fraction < 1.0)


def test_a_long_table_is_that_of_each_interval() -> None:
    """Rows are computed 8192 at a time; windows are centred but at the ends of the data."""
    time = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 8196))
    table = weight_table(time, uniform=False)
    assert table.shape == (8195, 10)
    for k in (0, 1, 2, 8191, 8192, 8193, 8194):
        first = min(max(k - 2, 0), 8190)
        expected = moment_weights(time[None, first : first + 6], np.array([k - first]))
        np.testing.assert_allclose(table[k], expected[0], rtol=1e-12)


def test_a_uniform_table_has_a_row_for_each_position() -> None:
    for count in (1, 3, 5, 9):
        n = min(count, 5)
        table = weight_table(0.01 * np.arange(count + 1), uniform=True)
        np.testing.assert_allclose(table, moment_weights(np.tile(np.arange(n + 1.0), (n, 1)), np.arange(n)), rtol=1e-12)
