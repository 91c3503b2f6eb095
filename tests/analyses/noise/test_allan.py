"""The overlapping Allan deviation against published numbers and its definition, its band against repeated draws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from sinssim.analyses.allan_deviation import (
    FLICKER,
    QUANTISATION,
    RANDOM_WALK,
    RATE_WALK,
    allan_deviation,
    averaging_samples,
    confidence_band,
    degrees_of_freedom,
    gauss_markov_term,
)
from tests.oracles import allan, noise

TERMS = [QUANTISATION, RANDOM_WALK, FLICKER, RATE_WALK, gauss_markov_term(30.0)]


def test_published_numbers():
    """The 1000-point suite of NIST Special Publication 1065 (2008), section 12.4, table 31."""
    n, suite = 1234567890, []
    for _ in range(1000):
        suite.append(n / 2147483647.0)
        n = 16807 * n % 2147483647
    found = allan_deviation(np.array(suite), 1.0, [1, 10, 100])
    np.testing.assert_allclose(found.deviation, [2.922319e-1, 9.159953e-2, 3.241343e-2], rtol=3e-7)


def test_against_the_definition_over_block_borders():
    rng = np.random.default_rng(3)
    increments = rng.standard_normal(70_000) + 1e5
    found = allan_deviation(increments, 0.25)
    assert found.samples[0] == 1
    assert found.samples[-1] == 70_000 // 3
    for i in (0, 7, 20, -1):
        direct = allan.allan_deviation(increments - increments.mean(), 0.25, int(found.samples[i]))
        assert found.deviation[i] == pytest.approx(direct, rel=1e-9)
    np.testing.assert_allclose(found.tau, found.samples * 0.25)


def test_a_ramp_has_its_closed_form_whatever_the_mean():
    increments = noise.ramp(5000, 0.1, 3e-6) + 0.1
    found = allan_deviation(increments, 0.1)
    np.testing.assert_allclose(found.deviation, 3e-6 * found.tau / np.sqrt(2.0), rtol=1e-7)


def test_averaging_times():
    np.testing.assert_array_equal(averaging_samples(12), [1, 2, 3, 4])
    samples = averaging_samples(3_600_000)
    assert np.all(np.diff(samples) > 0)
    assert samples[0] == 1
    assert samples[-1] == 1_200_000
    # ten in every decade from 10 up
    assert np.sum((samples >= 100) & (samples < 1000)) in (9, 10, 11)


@pytest.mark.parametrize("term", TERMS, ids=lambda term: term.symbol)
def test_allan_variance_is_the_integral_over_the_spectrum(term):
    """σ²(τ) = 4 ∫₀^∞ S(f) sin⁴(πfτ)/(πfτ)² df (IEEE Std 952), S from the table of `noise_terms`."""
    spectra = {
        "N": lambda f: 1.0,
        "B": lambda f: 1.0 / (2.0 * np.pi * f),
        "K": lambda f: 1.0 / (2.0 * np.pi * f) ** 2,
        "sigma_b": lambda f: 60.0 / (1.0 + (2.0 * np.pi * f * 30.0) ** 2),
    }
    for tau in (1.0, 40.0, 1000.0):
        if term.symbol == "Q":
            # angles at both ends of two neighbouring averages, the middle one twice: (1 + 4 + 1)/(2τ²)
            expected = 3.0 / tau**2
        else:
            # in x = πfτ, and far out in u = 1/x with the mean 3/8 of sin⁴
            def integrand(x, tau=tau):
                return spectra[term.symbol](x / (np.pi * tau)) * np.sin(x) ** 4 / x**2

            body = sum(quad(integrand, k * np.pi, (k + 1) * np.pi)[0] for k in range(400))

            def far(u, tau=tau):
                return 0.375 * spectra[term.symbol](1.0 / (u * np.pi * tau))

            tail = quad(far, 0.0, 1.0 / (400 * np.pi))[0]
            expected = 4.0 / (np.pi * tau) * (body + tail)
        assert float(term.allan_variance(np.array([tau]))[0]) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("term", TERMS, ids=lambda term: term.symbol)
def test_covariance_and_allan_variance_belong_together(term):
    """The variance of second differences, 6g(0) − 8g(τ) + 2g(2τ), is 2τ²σ²(τ)."""
    for tau in (1e-3, 0.5, 30.0, 2000.0):
        lags = np.array([0.0, tau, 2.0 * tau])
        variance = float(term.covariance(lags, 1e-4) @ [6.0, -8.0, 2.0])
        assert variance == pytest.approx(
            2.0 * tau**2 * float(term.allan_variance(np.array([tau]))[0]), rel=1e-6, abs=0.0
        )


def test_degrees_of_freedom_against_published_approximations():
    """Howe, Allan and Barnes (1981), as in NIST SP 1065, table 5: good to a few per cent, exact for white noise."""
    n = 10_001  # angles
    m = np.array([1, 2, 10, 100, 1000])
    white = (3.0 * (n - 1) / (2.0 * m) - 2.0 * (n - 2) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0)
    found = degrees_of_freedom(n - 1, 0.1, m, [(RANDOM_WALK, 2.0)])
    np.testing.assert_allclose(found, white, rtol=0.02)
    np.testing.assert_allclose(found[:3], white[:3], rtol=1e-3)
    walk = (n - 2) / m * ((n - 1) ** 2 - 3.0 * m * (n - 1) + 4.0 * m**2) / (n - 3) ** 2
    np.testing.assert_allclose(degrees_of_freedom(n - 1, 0.1, m, [(RATE_WALK, 2.0)])[1:], walk[1:], rtol=0.09)
    angle = (n + 1) * (n - 2.0 * m) / (2.0 * (n - m))
    np.testing.assert_allclose(degrees_of_freedom(n - 1, 0.1, m, [(QUANTISATION, 2.0)]), angle, rtol=0.05)
    flicker = 5.0 * n**2 / (4.0 * m * (n + 3.0 * m))
    np.testing.assert_allclose(degrees_of_freedom(n - 1, 0.1, m, [(FLICKER, 2.0)])[1:], flicker[1:], rtol=0.1)


def test_long_sums_are_sampled_finely_enough():
    """Averaging times just below and above the number of lags from which a sum is sampled, per degree of freedom."""
    for term in TERMS:
        m = np.array([100, 150])
        found = degrees_of_freedom(200_000, 0.01, m, [(term, 1.0)]) * (m if term.symbol != "Q" else 1.0)
        assert found[0] == pytest.approx(found[1], rel=0.01)


def test_variance_and_band_of_a_mixture():
    """Of 1500 records: variance of the Allan variance within its own 4.5 σ, truth in the band in 95 ± 2 %."""
    count, interval, runs = 400, 1.0, 1500
    q, n, k, r = 1.0, 0.5, 0.02, 2e-3
    rng = np.random.default_rng(8)
    m = np.array([1, 5, 20, 60, 130])
    found = np.array(
        [
            allan_deviation(
                noise.rounding(rng, count, interval, q)
                + noise.random_walk(rng, count, interval, n)
                + noise.rate_walk(rng, count, interval, k)
                + noise.ramp(count, interval, r),
                interval,
                m,
            ).deviation
            for _ in range(runs)
        ]
    )
    expected = 3 * q**2 / m**2 + n**2 / m + k**2 * m / 3.0 + r**2 * m**2 / 2.0
    terms = [(QUANTISATION, q), (RANDOM_WALK, n), (RATE_WALK, k)]
    freedom = degrees_of_freedom(count, interval, m, terms, r)
    np.testing.assert_allclose((found**2).mean(axis=0), expected, rtol=5.0 * np.sqrt(2.0 / freedom / runs).max())
    # uniform rounding errors make the first averages a little better than normal ones would
    ratio = (found**2).var(axis=0) / (2.0 * expected**2 / freedom)
    spread = np.sqrt((2.0 + 12.0 / freedom) / runs)  # of a sample variance of χ²
    assert np.all(np.abs(ratio[1:] - 1.0) < 4.5 * spread[1:])
    assert 0.4 < ratio[0] < 1.0
    low, high = confidence_band(found, np.broadcast_to(freedom, found.shape))
    inside = np.mean((low**2 < expected) & (expected < high**2), axis=0)
    assert np.all(inside[1:] > 0.93)
    assert np.all(inside[1:] < 0.97)


def test_without_noise_there_is_no_band():
    freedom = degrees_of_freedom(100, 1.0, np.array([1, 5]), [], 1e-3)
    assert np.all(np.isinf(freedom))
    low, high = confidence_band(np.array([1.0, 2.0]), freedom)
    np.testing.assert_array_equal(low, high)
