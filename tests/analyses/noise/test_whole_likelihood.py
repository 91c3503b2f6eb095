"""Bands, likelihood and confidence of one record against dense linear algebra and closed forms of white noise."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.fft import dct
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.stats import chi2

from sinssim.analyses import noise_fit
from sinssim.analyses.allan_deviation import FLICKER, QUANTISATION, RANDOM_WALK, RATE_WALK, gauss_markov_term
from sinssim.analyses.noise_fit import NoiseFit, _ranges, is_constant
from sinssim.analyses.noise_likelihood import Bands, Likelihood, _departures, _misfit, rounding

N, T = 400, 0.25
RNG = np.random.default_rng(12)
RECORD = 0.3 * RNG.standard_normal(N) + 2e-4 * np.arange(N)
RECORD -= RECORD.mean()


def shapes() -> np.ndarray:
    """Ramp and both ends as columns: integrals of t over intervals, and steps of the angle at both ends, transformed.

    Even and odd coefficients of the ends are columns of their own.
    """
    first, last = np.zeros(N), np.zeros(N)
    first[0], last[-1] = 1.0, 1.0
    ramp = T**2 * (np.arange(N) + 0.5)
    both = np.array([dct(x, norm="ortho") for x in (ramp - ramp.mean(), 0.5 * (first + last), 0.5 * (first - last))])
    return np.asarray(both[:, 1:].T)


def band_of() -> np.ndarray:
    """Number of the band of each coefficient, 1 to N − 1."""
    bands = Bands(RECORD, T, 1.0)
    return np.searchsorted(bands.edges, np.arange(1, N), side="right") - 1


def test_bands_of_a_record() -> None:
    """64 single coefficients, then bands whose ends are 4 % apart; power is that of the cosine transform."""
    bands = Bands(RECORD, T, 2.5)
    assert (bands.count, bands.interval) == (N, T)
    assert bands.edges[:63].tolist() == list(range(1, 64))
    assert bands.edges[-1] == N
    wide = bands.edges[63:-1].astype(float)
    assert wide[0] == 64.0
    assert np.all(wide[1:] <= np.maximum(1.04 * wide[:-1] + 1.04, wide[:-1] + 1.0))
    assert wide[-1] * 1.04 >= N - 2
    np.testing.assert_array_equal(bands.number, np.diff(bands.edges))
    z = dct(RECORD, norm="ortho")[1:] - bands.ramp * shapes()[:, 0]
    of = band_of()
    np.testing.assert_allclose(bands.power, np.bincount(of, z**2), rtol=1e-9)
    products = np.einsum("ki,kj->ijk", shapes(), shapes())
    for i in range(3):
        weights = shapes()[:, i] * z
        np.testing.assert_allclose(np.abs(bands.shapes_z[i]), np.abs(np.bincount(of, weights)), atol=1e-10)
        for j in range(3):
            found, expected = bands.shapes[i, j], np.bincount(of, products[i, j])
            np.testing.assert_allclose(
                np.abs(found), np.abs(expected), atol=1e-12 * np.abs(products[i, j]).max() + 1e-15
            )
    middle = 0.5 * (bands.edges[:-1] + bands.edges[1:] - 1)
    np.testing.assert_allclose(bands.angle, np.pi * middle / N)
    assert bands.floor == pytest.approx((4.0 * 2.220446049250313e-16 * N * 2.5) ** 2, abs=0.0)
    assert not bands.rounded
    assert Bands(RECORD, T, 1e15).rounded
    second = np.diff(RECORD)
    assert bands.fourth == pytest.approx((np.mean(second**4) - 3.0 * np.mean(second**2) ** 2) / 18.0)


def test_columns_are_means_over_bands() -> None:
    bands = Bands(RECORD, T, 1.0)
    k = np.arange(1.0, N)
    for term in (QUANTISATION, RANDOM_WALK, FLICKER, RATE_WALK, gauss_markov_term(7.0)):
        means = np.bincount(band_of(), term.power(k, N, T)) / bands.number
        np.testing.assert_allclose(bands.column(term)[:63], means[:63], rtol=1e-9)
        np.testing.assert_allclose(bands.column(term)[63:], means[63:], rtol=2e-3)


def test_a_ramp_is_taken_off() -> None:
    """A record that is a ramp alone has no power left, and its size."""
    bands = Bands(3e-3 * T**2 * (np.arange(N) - 0.5 * (N - 1)), T, 1.0)
    assert bands.ramp == pytest.approx(3e-3, rel=1e-9)
    assert bands.power.sum() < 1e-20


def test_the_likelihood_is_that_of_dense_algebra() -> None:
    """Coefficients of any variances beside three shapes of unknown sizes: generalised least squares, REML."""
    bands = Bands(RECORD, T, 1.0)
    model = Likelihood(bands, [RANDOM_WALK], bands.column(RANDOM_WALK)[None], bands.number)
    v = 0.1 * (1.0 + np.sin(np.arange(len(bands.number))) ** 2) + bands.floor
    z = dct(RECORD, norm="ortho")[1:] - bands.ramp * shapes()[:, 0]
    x, each = shapes(), v[band_of()]
    normal = x.T @ (x / each[:, None])
    sizes = np.linalg.solve(normal, x.T @ (z / each))
    found, covariance = model.ramp_and_ends(v)
    np.testing.assert_allclose(np.abs(found), np.abs(sizes), rtol=1e-8)
    assert found[0] == pytest.approx(sizes[0], rel=1e-8)
    np.testing.assert_allclose(np.diag(covariance), np.diag(np.linalg.inv(normal)), rtol=1e-8)
    rest = z - x @ sizes
    expected = -0.5 * (np.sum(np.log(each) + rest**2 / each) + np.linalg.slogdet(normal)[1])
    power, top = model.evaluate(v)
    assert top == pytest.approx(expected, rel=1e-9)
    taken = np.einsum("ki,ij,kj->k", x, np.linalg.inv(normal), x)
    np.testing.assert_allclose(power, np.bincount(band_of(), rest**2 + taken) / bands.number, rtol=1e-7)


def white() -> tuple[Likelihood, float, int]:
    """Return the likelihood of white noise alone, its variance by least squares, and the degrees of freedom."""
    bands = Bands(RECORD, T, 1.0)
    model = Likelihood(bands, [RANDOM_WALK], bands.column(RANDOM_WALK)[None], bands.number)
    z = dct(RECORD, norm="ortho")[1:]
    _, squares, *_ = np.linalg.lstsq(shapes(), z, rcond=None)
    freedom = N - 1 - 3
    return model, float(squares[0]) / freedom, freedom


def test_white_noise_alone_has_a_closed_form() -> None:
    """N²T is the residual variance; the loss at x times it is ν(ln x + 1/x − 1), and 3.84 at the ends of the band."""
    model, variance, freedom = white()
    assert model.best[0] * T == pytest.approx(variance, rel=2e-5)
    for x in (0.7, 0.9, 1.2, 1.5):
        loss = freedom * (np.log(x) + 1.0 / x - 1.0)
        assert model.loss({0: x * variance / T}) == pytest.approx(loss, abs=2e-3)
    assert pytest.approx(chi2.ppf(0.95, 1), rel=1e-12) == noise_fit.LIMIT
    low, high = noise_fit._band(model, 0)
    ends = [
        brentq(lambda x: freedom * (np.log(x) + 1.0 / x - 1.0) - noise_fit.LIMIT, a, b)
        for a, b in ((0.5, 1.0), (1.0, 2.0))
    ]
    np.testing.assert_allclose([low**2, high**2], np.array(ends) * variance / T, rtol=2e-3)
    assert noise_fit.coefficient_bands(model, [])["N"] == (low, high)


def test_a_term_that_is_not_there_has_an_upper_limit_only() -> None:
    model, variance, freedom = white()
    bands = model.bands
    terms = [QUANTISATION, RANDOM_WALK]
    both = Likelihood(bands, terms, np.stack([bands.column(term) for term in terms]), bands.number)
    low, high = noise_fit.coefficient_bands(both, [])["Q"]
    if both.best[0] == 0.0:
        assert low == 0.0
        assert both.loss({0: high**2}) == pytest.approx(noise_fit.LIMIT, rel=0.02)
    assert 0.0 < high < np.sqrt(variance)
    assert both.index("N") == 1
    assert freedom == 396


def test_uniform_rounding_errors_are_known_better() -> None:
    """The variance of their mean square is (κ₄ + 2Q⁴)/n with κ₄ = −1.2 Q⁴: 0.4 of that of normal numbers."""
    rng = np.random.default_rng(1)
    record = np.diff(rng.uniform(-0.5, 0.5, 3001))
    bands = Bands(record - record.mean(), T, 1.0)
    model = Likelihood(bands, [QUANTISATION], bands.column(QUANTISATION)[None], bands.number)
    assert np.sqrt(model.best[0]) == pytest.approx(1.0 / np.sqrt(12.0), rel=0.02)
    bands.fourth = -1.2 * float(model.best[0]) ** 2
    assert noise_fit._uniformity(model) == pytest.approx(0.4, abs=1e-3)
    bands.fourth = -0.6 * float(model.best[0]) ** 2
    assert noise_fit._uniformity(model) == pytest.approx(0.7, abs=1e-3)
    bands.fourth = -5.0
    assert noise_fit._uniformity(model) == pytest.approx(0.4, abs=1e-3)
    bands.fourth = 5.0
    assert noise_fit._uniformity(model) == 1.0


def test_departures_of_bands_and_their_sum() -> None:
    """Signed roots of ν(r − 1 − ln r); their squares less the mean and over the spread of chi-square variables."""
    number, v = np.array([1.0, 4.0, 10.0]), np.array([2.0, 3.0, 5.0])
    ratio, weight = np.array([0.25, 1.5, 1.2]), np.array([1.0, 3.0, 8.0])
    taken = np.array([0.25, 0.5, 1.0])
    model = SimpleNamespace(
        best=np.array([1.0, 0.0, 2.0]), bands=SimpleNamespace(number=number), variance=lambda best: v, weight=weight,
        eliminated=lambda given: (ratio * number * given - taken, taken, 0.0),
    )  # fmt: skip
    expected = np.sign(ratio - 1.0) * np.sqrt(weight * (ratio - 1.0 - np.log(ratio)))
    np.testing.assert_allclose(_departures(model, weight), expected, rtol=1e-12)  # type: ignore[arg-type]
    mean = variance = 0.0
    for nu in weight:

        def deviance(x: float, nu: float = nu) -> float:
            return float(nu * (x / nu - 1.0 - np.log(x / nu)))

        one = quad(lambda x, nu=nu: deviance(x, nu) * chi2.pdf(x, nu), 0.0, np.inf, limit=400)[0]
        two = quad(lambda x, nu=nu: deviance(x, nu) ** 2 * chi2.pdf(x, nu), 0.0, np.inf, limit=400)[0]
        mean, variance = mean + one, variance + two - one**2
    assert _misfit(model) == pytest.approx((np.sum(expected**2) + 2.0 - mean) / np.sqrt(variance), rel=1e-5)  # type: ignore[arg-type]


def test_ranges_of_frequency() -> None:
    """Coefficient k is at k/(2nT): of 400 intervals of 0.25 s at k/200 Hz; neighbours are joined."""
    bands = SimpleNamespace(edges=np.array([1, 2, 4, 7, 10, 20]), count=400, interval=0.25)
    aside = np.array([True, False, True, True, False])
    assert _ranges(bands, aside) == ((0.005, 0.01), (0.02, 0.05))  # type: ignore[arg-type]
    assert _ranges(bands, np.array([False] * 4 + [True])) == ((0.05, 0.1),)  # type: ignore[arg-type]


def test_a_constant_but_for_rounding() -> None:
    assert rounding(1000) == pytest.approx(4000.0 * 2.220446049250313e-16, abs=0.0)
    few = np.full(1000, 3.0)
    few[7] += 0.9 * 3.0 * rounding(1000)
    assert is_constant(few)
    few[7] = 3.0 + 1.2 * 3.0 * rounding(1000)
    assert not is_constant(few)


def test_the_curve_of_a_fit() -> None:
    """At 4 s: 3Q²/16, N²/4, 0.441 B², 4K²/3, 8R², in the order of the definitions; and the sum of all."""
    likely = {"Q": 2.0, "N": 3.0, "B": 5.0, "K": 7.0, "R": -11.0, "sigma_b": 13.0}
    fit = NoiseFit({}, likely, 8.0, None, 0.5, 100, 0.0, 0.0, (), (), None)
    x = 0.5
    squares = {
        "Q": 12.0 / 16.0, "N": 9.0 / 4.0, "B": 2.0 * np.log(2.0) / np.pi * 25.0, "K": 4.0 * 49.0 / 3.0,
        "R": 8.0 * 121.0,
        "sigma_b": 169.0 * (2.0 / x) * (1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x)),
    }  # fmt: skip
    for symbol, square in squares.items():
        assert fit.allan_deviation(np.array([4.0]), symbol)[0] == pytest.approx(np.sqrt(square), rel=1e-10)
    assert fit.allan_deviation(np.array([4.0]))[0] == pytest.approx(np.sqrt(sum(squares.values())), rel=1e-10)
    assert [(term.symbol, size) for term, size in fit.terms] == [
        ("Q", 2.0), ("N", 3.0), ("B", 5.0), ("K", 7.0), ("sigma_b", 13.0),
    ]  # fmt: skip
