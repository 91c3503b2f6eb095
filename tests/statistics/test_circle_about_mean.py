"""Circles that hold a share of normal distributions, against closed forms, scipy's distributions and quadrature."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, stats

from sinssim.errors import InputError
from sinssim.statistics.circular_error import circle_radius, radius_about_mean


@pytest.mark.parametrize("share", [0.01, 0.5, 0.95, 0.9999, 1.0 - 1e-12])
def test_equal_axes_have_a_closed_form(share: float) -> None:
    radius = circle_radius(9.0 * np.eye(2), share)
    assert float(radius) == pytest.approx(3.0 * math.sqrt(-2.0 * math.log1p(-share)), rel=1e-13)


def test_the_customary_factors() -> None:
    assert float(circle_radius(np.eye(2), 0.5)) == pytest.approx(1.1774, abs=5e-5)
    assert float(circle_radius(np.eye(2), 0.95)) == pytest.approx(2.4477, abs=5e-5)


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_one_axis_is_a_normal_distribution(share: float) -> None:
    radius = circle_radius(np.diag([0.0, 4.0]), share)
    assert float(radius) == pytest.approx(2.0 * stats.norm.ppf(0.5 + 0.5 * share), rel=1e-12)


@pytest.mark.parametrize("ratio", [0.9, 0.3, 0.05, 1e-3])
@pytest.mark.parametrize("share", [0.5, 0.95])
def test_probability_inside_by_quadrature(ratio: float, share: float) -> None:
    """The density is integrated over the circle in Cartesian coordinates, in another way than the function does it."""
    turn = math.radians(35.0)
    c = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    radius = float(circle_radius(c @ np.diag([1.0, ratio**2]) @ c.T, share))

    def strip(t: float) -> float:  # x = R sin t, so that the ends of the circle are smooth
        across = 2.0 * stats.norm.cdf(radius * math.cos(t) / ratio) - 1.0
        return float(stats.norm.pdf(radius * math.sin(t)) * across * radius * math.cos(t))

    edge = 0.5 * math.pi - 10.0 * ratio
    ends = (0.0, edge, 0.5 * math.pi) if edge > 0.0 else (0.0, 0.5 * math.pi)
    inside = 2.0 * sum(integrate.quad(strip, *pair, epsabs=1e-13, limit=400)[0] for pair in pairwise(ends))
    assert inside == pytest.approx(share, abs=1e-9)


def test_many_covariances_at_once() -> None:
    covariance = np.array([np.eye(2), np.diag([1.0, 0.0]), np.zeros((2, 2))])
    assert circle_radius(covariance, 0.5) == pytest.approx([1.17741002, 0.67448975, 0.0], abs=1e-8)


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, float("nan")])
def test_a_share_that_is_none_is_refused(share: float) -> None:
    with pytest.raises(InputError, match="share = "):
        circle_radius(np.eye(2), share)


def test_another_shape_is_refused() -> None:
    with pytest.raises(InputError, match="shape"):
        circle_radius(np.eye(3), 0.5)


@pytest.mark.parametrize("off", [0.1, 1.0, 5.0, 200.0])
@pytest.mark.parametrize("share", [0.5, 0.95])
def test_a_mean_gives_the_noncentral_distribution(off: float, share: float) -> None:
    """For equal axes r²/σ² is noncentral χ² with two degrees of freedom."""
    radius = radius_about_mean(4.0 * np.eye(2)[None], np.array([[0.6, -0.8]]) * 2.0 * off, share)
    assert radius[0] == pytest.approx(2.0 * math.sqrt(stats.ncx2.ppf(share, 2, off**2)), rel=1e-7)


def test_a_mean_with_unequal_axes_by_sampling() -> None:
    """One million samples: the share inside is wrong by at most 5σ = 0.0011, by chance with 6e-7."""
    covariance, mean = np.array([[4.0, 1.5], [1.5, 1.0]]), np.array([3.0, -1.0])
    radius = radius_about_mean(covariance[None], mean[None], 0.95)[0]
    samples = np.random.default_rng(5).multivariate_normal(mean, covariance, 1_000_000)
    assert np.mean(np.hypot(*samples.T) <= radius) == pytest.approx(0.95, abs=0.0011)


def test_a_mean_without_spread_is_the_radius() -> None:
    assert radius_about_mean(np.zeros((1, 2, 2)), np.array([[3.0, 4.0]]), 0.5)[0] == pytest.approx(5.0)


def test_a_vanishing_mean_joins_the_central_radius() -> None:
    covariance = np.array([[[4.0, 1.5], [1.5, 1.0]]])
    central = circle_radius(covariance, 0.95)
    assert radius_about_mean(covariance, np.array([[1e-9, 0.0]]), 0.95) == pytest.approx(central, rel=1e-9)
