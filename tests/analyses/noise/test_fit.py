"""Identification of noise terms from noise that was made independently of the package."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve, toeplitz
from scipy.optimize import minimize
from scipy.signal import butter, lfilter
from scipy.stats import binom

from sinssim.analyses.noise_fit import fit_noise
from sinssim.errors import InputError
from tests.oracles import noise
from tests.slow import slow

HOURS = 36_000.0  # ten hours
T = 1.0
COUNT = int(HOURS / T)
TRUTH = {"Q": 3e-3, "N": 1e-3, "B": 2e-4, "K": 8e-6, "R": 4e-7}
"""All five visible in ten hours."""


def made(seed, truth, count=COUNT, interval=T):
    return noise.everything(np.random.default_rng(seed), count, interval, truth)


def covers(estimate, truth):
    return estimate.low <= truth <= estimate.high


# Each term alone


@pytest.mark.parametrize("symbol", ["Q", "N", "B", "K", "R"])
@pytest.mark.parametrize("seed", [1, 3])
def test_each_term_alone(symbol, seed):
    fit = fit_noise(made(seed, {symbol: TRUTH[symbol]}, 200_000, 0.18) + 0.01, 0.18)
    assert fit.likely[symbol] == pytest.approx(TRUTH[symbol], rel=0.02)
    assert fit.estimates[symbol].value == fit.likely[symbol]
    for other in set("QNBKR") - {symbol}:
        assert fit.estimates[other].value is None
        assert fit.likely[other] == 0.0
        # what is not there shows as an upper limit well below what would be seen
        size = max(abs(fit.estimates[other].low), abs(fit.estimates[other].high))
        m = np.array([1.0, 30.0, 1000.0]) * 0.18
        parts = {"Q": np.sqrt(3.0) / m, "N": 1 / np.sqrt(m), "B": 0.664 + 0 * m, "K": np.sqrt(m / 3.0), "R": m / 2**0.5}
        assert np.min(size * parts[other] / (TRUTH[symbol] * parts[symbol])) < 0.5
    assert fit.misfit == 0.0
    assert fit.aside == ()
    assert fit.mean * 0.18 == pytest.approx(0.01, rel=0.3)


def test_a_ramp_has_its_sign():
    fit = fit_noise(made(1, {"N": 1e-3, "R": -4e-7}), T)
    ramp = fit.estimates["R"]
    assert ramp.low < -4e-7 < ramp.high < 0.0
    assert ramp.value == pytest.approx(-4e-7, rel=0.1)


# All together


def test_all_together():
    fit = fit_noise(made(7, TRUTH), T)
    for symbol, truth in TRUTH.items():
        estimate = fit.estimates[symbol]
        half = 0.5 * (estimate.high - estimate.low)
        assert abs(fit.likely[symbol] - truth) < max(0.05 * truth, 2.0 / 1.96 * half), symbol
    tau = np.array([1.0, 100.0, 5000.0])
    parts = [fit.allan_deviation(tau, symbol) for symbol in "QNBKR"]
    np.testing.assert_allclose(fit.allan_deviation(tau), np.sqrt(np.sum(np.square(parts), axis=0)), rtol=1e-12)
    expected = {
        "Q": np.sqrt(3.0) / tau,
        "N": 1.0 / np.sqrt(tau),
        "B": np.sqrt(2.0 * np.log(2.0) / np.pi) * tau**0,
        "K": np.sqrt(tau / 3.0),
        "R": tau / np.sqrt(2.0),
    }
    for symbol, part in zip("QNBKR", parts, strict=True):
        np.testing.assert_allclose(part, fit.likely[symbol] * expected[symbol], rtol=1e-12)


def coverage(truth, seeds, symbols="QNBKR", **options):
    """Return how often each band holds the truth, and the values found."""
    inside = dict.fromkeys(symbols, 0)
    found = {symbol: [] for symbol in symbols}
    for seed in range(seeds):
        fit = fit_noise(made(1000 + seed, truth), T, **options)
        for symbol in symbols:
            inside[symbol] += covers(fit.estimates[symbol], truth.get(symbol, 0.0))
            found[symbol].append(fit.likely[symbol])
    return inside, {symbol: np.array(values) for symbol, values in found.items()}


@pytest.mark.parametrize("n", [12, *slow(50)])
def test_bands_cover_the_truth(n):
    """Of a 95 % band as many hold the truth as must, but by a chance of 1 in 1000; no term is biased."""
    inside, found = coverage(TRUTH, n)
    fewest = binom.ppf(1e-3, n, 0.95)
    for symbol, hits in inside.items():
        assert hits >= fewest, symbol
        mean, spread = found[symbol].mean(), found[symbol].std(ddof=1) / np.sqrt(n)
        assert abs(mean - TRUTH[symbol]) < 4.0 * spread + 0.02 * TRUTH[symbol], symbol
    # bands are no wider than they need be: the spread of the estimates is that of the bands
    estimates = fit_noise(made(1, TRUTH), T).estimates
    for symbol in "QNB":
        one = estimates[symbol]
        low, high = np.percentile(found[symbol], [15.87, 84.13])
        assert 0.5 * (high - low) == pytest.approx((one.high - one.low) / 3.92, rel=0.35 * np.sqrt(50 / n))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "options"),
    [
        (TRUTH, {}),
        ({"N": 1e-3, "K": 5e-6}, {}),
        ({"N": 1e-3, "B": 1e-4, "K": 5e-6, "R": 2e-7}, {}),
        ({"N": 1e-3, "sigma_b": 3e-4, "tau_b": 3600.0}, {"correlation_time": 3600.0}),
        ({"N": 1e-3, "sigma_b": 3e-4, "tau_b": 300.0}, {}),
    ],
    ids=["all", "N and K", "N, B, K, R", "Gauss-Markov, time known", "Gauss-Markov, time found"],
)
def test_bands_cover_the_truth_in_90_to_98_of_100_records(truth, options):
    """A thousand records of ten hours; of terms that are not there, the band may hold the zero more often.

    A band that holds the truth in 95 % is found outside 90 to 98 % by a chance of 1 in 3 million, one that holds it in
    87 % is found inside by one of 1 in 400.
    """
    present = [s for s in ("Q", "N", "B", "K", "R", "sigma_b") if s in truth]
    symbols = dict.fromkeys([*present, *"QNBKR"])
    inside, found = coverage(truth, 1000, symbols=symbols, **options)
    for symbol in symbols:
        print(
            f"{symbol}: truth {truth.get(symbol, 0.0):.4g}, in the band {inside[symbol]} of 1000, "
            f"mean {found[symbol].mean():.4g}, spread {found[symbol].std():.2g}"
        )
    for symbol in symbols:
        assert inside[symbol] >= 900, symbol
        if symbol in present:
            assert inside[symbol] <= 980, symbol
            spread = found[symbol].std(ddof=1) / np.sqrt(1000)
            assert abs(found[symbol].mean() - truth[symbol]) < 4.0 * spread + 0.02 * truth[symbol], symbol


@pytest.mark.parametrize("times", [10, pytest.param(100, marks=pytest.mark.slow)])
def test_a_ramp_does_not_depend_on_the_rate(times):
    """Ten hours at 10 or 100 Hz, and their sums at 1 Hz, tell the same of what is slower than any sample."""
    fine = made(5, TRUTH, COUNT * times, T / times)
    often, sums = (fit_noise(y, T * COUNT / len(y)).estimates["R"] for y in (fine, fine.reshape(-1, times).sum(axis=1)))
    np.testing.assert_allclose(
        [often.low, often.high], [sums.low, sums.high], rtol=0, atol=0.1 * (sums.high - sums.low)
    )


# The likelihood


def dense(count, interval):
    """Return covariances of increments with coefficients of one, by definition, and mean and ramp."""
    j = np.arange(count, dtype=float)
    first = np.zeros(count)
    first[:2] = 2.0, -1.0
    walk = interval**3 * (np.minimum(j[:, None], j) + 0.5)
    walk[np.diag_indices(count)] = interval**3 * (j + 1.0 / 3.0)
    k = np.arange(0.0, count + 1.0)
    double = -(0.5 * k**2 * np.log(np.maximum(k, 1e-9)) - 0.75 * k**2)
    lags = np.concatenate([[2.0 * double[1]], double[2:] - 2.0 * double[1:-1] + double[:-2]])
    # an infinite constant is added to the flicker's; the mean, which is free, takes it up
    flicker = interval**2 / np.pi * (toeplitz(lags[:count]) + 2.0 * np.log(count))
    covariances = {"Q": toeplitz(first), "N": interval * np.eye(count), "B": flicker, "K": walk}
    return covariances, np.stack([np.ones(count), j + 0.5], axis=1)


def restricted(covariance, means, y):
    """Return the restricted log-likelihood of normal numbers with free means."""
    factor = cho_factor(covariance)
    solved = cho_solve(factor, means)
    normal = means.T @ solved
    rest = y - means @ np.linalg.solve(normal, solved.T @ y)
    return -0.5 * (
        2.0 * np.sum(np.log(np.diag(factor[0]))) + np.linalg.slogdet(normal)[1] + rest @ cho_solve(factor, rest)
    )


@pytest.mark.parametrize(("seed", "compared"), [(3, "N"), *slow((3, "NBK"), (4, "NBK"))])
def test_the_same_as_the_exact_likelihood(seed, compared):
    """Dense covariance matrices of 260 increments: at the ends of a band it has lost 1.92 of its maximum, nearly."""
    truth = {"Q": 1.0, "N": 0.6, "K": 0.02}
    y = made(seed, truth, 260, 1.0)
    covariances, means = dense(260, 1.0)
    symbols = list(covariances)

    def lowest(**held):
        free = [s for s in symbols if s not in held]

        def loss(x):
            c = held | dict(zip(free, np.abs(x), strict=True))
            # what keeps the matrix positive where all else is zero
            return -restricted(sum(c[s] ** 2 * covariances[s] for s in symbols) + 1e-9 * np.eye(260), means, y)

        starts = ({"Q": 1.0, "N": 0.6, "B": 0.05, "K": 0.01}, {"Q": 1.0, "N": 0.2, "B": 0.2, "K": 0.01})
        options = {"xatol": 1e-3, "fatol": 1e-3}
        return min(minimize(loss, [s[f] for f in free], method="Nelder-Mead", options=options).fun for s in starts)

    fit = fit_noise(y, 1.0)
    top = lowest()
    for symbol in compared:
        for end in (fit.estimates[symbol].low, fit.estimates[symbol].high):
            if end > 0.0:
                assert lowest(**{symbol: end}) - top == pytest.approx(1.92, abs=0.5), (symbol, end)


@pytest.mark.slow
def test_estimates_reach_the_cramer_rao_bound():
    """Spread over 300 records against the inverse of Fisher's information of the dense matrices, with free means."""
    count, truth = 2000, {"Q": 1.0, "N": 0.6, "K": 0.05}
    covariances, means = dense(count, 1.0)
    v = sum(truth[s] ** 2 * covariances[s] for s in truth)
    inverse = np.linalg.inv(v)
    p = inverse - inverse @ means @ np.linalg.solve(means.T @ inverse @ means, means.T @ inverse)
    products = {s: p @ covariances[s] for s in truth}
    information = np.array([[0.5 * np.sum(products[a] * products[b].T) for b in truth] for a in truth])
    bound = np.sqrt(np.diag(np.linalg.inv(information)))  # of c², with no other terms in the model
    found = np.array([[fit_noise(made(s, truth, count, 1.0), 1.0).likely[t] ** 2 for t in truth] for s in range(300)])
    low, high = np.percentile(found, [15.87, 84.13], axis=0)
    ratio = 0.5 * (high - low) / bound
    print(f"spread over the bound: Q² {ratio[0]:.3f}, N² {ratio[1]:.3f}, K² {ratio[2]:.3f}")
    # uniform rounding errors are known better than the normal ones of the bound; in one record of twenty flicker is
    # taken for a part of the others, which these percentiles do not count
    assert 0.6 < ratio[0] < 1.1
    np.testing.assert_allclose(ratio[1:], 1.0, atol=0.2)
    error = np.median(found, axis=0) - np.square(list(truth.values()))
    assert np.all(np.abs(error) < 4.0 * 1.25 * bound / np.sqrt(300))  # spread of a median of normal numbers


# Gauss-Markov bias


def test_gauss_markov_bias_of_known_time():
    fit = fit_noise(made(4, {"N": 1e-3, "sigma_b": 1e-3, "tau_b": 200.0}), T, correlation_time=200.0)
    assert fit.correlation_time == 200.0
    assert fit.correlation_band is None
    assert fit.estimates["B"].value is None
    assert fit.estimates["sigma_b"].value == pytest.approx(1e-3, rel=0.15)
    assert covers(fit.estimates["sigma_b"], 1e-3)


def test_gauss_markov_bias_alone_is_told_to_five_per_cent_if_its_time_is_known():
    fit = fit_noise(made(2, {"sigma_b": 1e-3, "tau_b": 3600.0}, 360_000, 0.1), 0.1, correlation_time=3600.0)
    assert fit.likely["sigma_b"] == pytest.approx(1e-3, rel=0.05)
    assert fit.likely["K"] == 0.0
    # a rate random walk of σ_b √(2/τ_b) would look nearly the same in ten correlation times, and the fit says so
    assert fit.exchangeable == ("sigma_b",)
    assert fit.estimates["K"].high == pytest.approx(1e-3 * np.sqrt(2.0 / 3600.0), rel=0.05)


def test_gauss_markov_bias_is_found():
    truth = {"N": 1e-3, "sigma_b": 1e-3, "tau_b": 150.0}
    fit = fit_noise(made(3, truth), T)
    low, high = fit.correlation_band
    assert low < 150.0 < high
    assert high / low < 3.0
    assert covers(fit.estimates["sigma_b"], 1e-3)
    assert fit.estimates["sigma_b"].low > 5e-4
    # at its top, τ = 1.89 τ_b, the Allan deviation is 0.617 σ_b
    tau = np.array([1.89 * fit.correlation_time])
    assert fit.allan_deviation(tau, "sigma_b")[0] == pytest.approx(0.617 * fit.likely["sigma_b"], rel=1e-3)


@pytest.mark.parametrize("truth", [{"N": 1e-3}, {"N": 1e-3, "B": 2e-4}, {"N": 1e-3, "K": 8e-6}, TRUTH])
def test_no_gauss_markov_bias_is_invented(truth):
    assert all(fit_noise(made(seed, truth), T).correlation_time is None for seed in range(2))


@pytest.mark.parametrize("seeds", [[0, 5, 6], *slow(range(8))], ids=["few", "many"])
def test_a_gauss_markov_bias_that_the_record_hints_at_is_mentioned(seeds):
    """Thirty correlation times beside white noise: some records hint at it, some show it, none gets both."""
    truth = {"N": 1e-3, "sigma_b": 3e-4, "tau_b": 1200.0}
    fits = [fit_noise(made(seed, truth), T) for seed in seeds]
    hinted = [fit.possible for fit in fits if fit.possible is not None]
    assert len(hinted) > len(seeds) // 4
    for sigma, time in hinted:
        assert 1e-4 < sigma < 9e-4
        assert 200.0 < time <= 18_000.0
    assert all(fit.possible is None for fit in fits if fit.correlation_time is not None)


# What the terms do not describe


def test_a_vibration_is_left_out():
    base = made(1, {"N": 1e-3, "K": 8e-6}, 200_000, 0.1)
    clean = fit_noise(base, 0.1)
    line = fit_noise(base + 3e-4 * np.sin(2.0 * np.pi * 1.03 * 0.1 * np.arange(200_000)), 0.1)
    ((low, high),) = line.aside
    assert low < 1.03 < high < 1.1 * low
    assert line.misfit == 0.0
    for symbol in "NK":
        assert line.likely[symbol] == pytest.approx(clean.likely[symbol], rel=2e-3)


def test_a_low_pass_filter_is_left_out():
    base = made(1, {"N": 1e-3, "K": 8e-6}, 200_000, 0.1)
    filtered = fit_noise(lfilter(*butter(2, 0.3), base), 0.1)
    assert filtered.aside[-1][1] == pytest.approx(5.0, rel=1e-3)
    assert filtered.aside[0][0] > 0.7  # the filter's corner is at 1.5 Hz
    assert filtered.likely["N"] == pytest.approx(1e-3, rel=0.03)
    assert covers(filtered.estimates["K"], 8e-6)


def test_a_record_of_another_kind_widens_the_bands():
    """A slow rocking over many frequencies, in place of a sensor at rest."""
    rng = np.random.default_rng(1)
    t = T * np.arange(COUNT)
    rocking = sum(2e-3 * np.sin(2.0 * np.pi * f * t + rng.uniform(0, 6)) for f in rng.uniform(1e-4, 0.4, 400))
    fit = fit_noise(made(1, {"N": 1e-3}) + rocking, T)
    quiet = fit_noise(made(1, {"N": 1e-3}), T).estimates["N"]
    assert fit.misfit > 0.3
    assert fit.estimates["N"].high - fit.estimates["N"].low > 5.0 * (quiet.high - quiet.low)


def test_the_rounding_of_a_computer_is_no_noise():
    fit = fit_noise(np.diff(0.5 * 3e-6 * (np.arange(10_001) * 0.01) ** 2), 0.01)
    assert fit.estimates["R"].value == pytest.approx(3e-6, rel=1e-9)
    assert all(fit.estimates[symbol].value is None for symbol in "QNBK")


def test_pulses_as_a_counter_gives_them():
    """A real quantiser: pulses of a noisy angle; Q is a pulse over √12."""
    rng = np.random.default_rng(6)
    truth = noise.random_walk(rng, 200_000, 0.01, 1.5e-4) + 1e-6
    fit = fit_noise(noise.quantised(rng, truth, 2e-5), 0.01)
    assert fit.likely["Q"] == pytest.approx(2e-5 / np.sqrt(12.0), rel=0.02)
    assert covers(fit.estimates["Q"], 2e-5 / np.sqrt(12.0))
    assert fit.likely["N"] == pytest.approx(1.5e-4, rel=0.01)


def test_how_drift_passes_within_a_sample_does_not_matter():
    """A walk that steps at the samples, or is taken at their middle as a trapezoid, in place of exact integrals."""
    rng = np.random.default_rng(2)
    edges = np.concatenate([[0.0], np.cumsum(5e-6 * np.sqrt(0.1) * rng.standard_normal(360_000))])
    for increments in (0.1 * edges[:-1], 0.05 * (edges[1:] + edges[:-1])):
        fit = fit_noise(increments, 0.1)
        assert fit.likely["K"] == pytest.approx(5e-6, rel=0.05)
        assert fit.estimates["N"].value is None


def test_a_bias_that_never_forgets_is_a_walk():
    """Correlation times beyond all bounds: the two terms are alike, and together what the walk is alone."""
    y = made(1, {"N": 1e-3, "K": 2e-5})
    alone = fit_noise(y, T)
    for time in (1e7, 3e10):
        both = fit_noise(y, T, correlation_time=time)
        walk = np.hypot(both.likely["K"], both.likely["sigma_b"] * np.sqrt(2.0 / time))
        assert walk == pytest.approx(alone.likely["K"], rel=1e-3)
        assert both.estimates["K"].low == 0.0


# Refusals


@pytest.mark.parametrize(
    ("increments", "options", "said"),
    [
        (np.random.default_rng(0).standard_normal(255), {}, "255 samples are too few .* at least 256"),
        (np.where(np.arange(400) == 123, np.nan, 1.0), {}, "sample 123 is nan, not a finite number"),
        (np.full(1000, 0.3), {}, "all 1000 samples are 0.3: a constant channel"),
        (np.zeros(1000), {}, "all 1000 samples are 0: a constant channel"),
        (
            np.random.default_rng(0).standard_normal(300),
            {"correlation_time": 0.0},
            "correlation_time = 0.0 must be one positive number",
        ),
        (
            np.random.default_rng(0).standard_normal(300),
            {"correlation_time": float("nan")},
            "correlation_time = nan must be one positive",
        ),
        (np.random.default_rng(0).standard_normal(300), {"correlation_time": 0.009}, "at least the interval, 0.01 s"),
        (np.random.default_rng(0).standard_normal(300), {"correlation_time": 3.1e6}, "at most .* 3e.06 s"),
        (1e60 * np.random.default_rng(0).standard_normal(300), {}, "are impossible for a sensor; use SI units"),
        (1e-60 * np.random.default_rng(0).standard_normal(300), {}, "are impossible for a sensor"),
    ],
)
def test_what_cannot_be_identified(increments, options, said):
    with pytest.raises(InputError, match=said):
        fit_noise(increments, 0.01, **options)
