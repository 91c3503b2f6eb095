"""Expected squares of cosine coefficients against the transform of the exact covariance of increments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import dct
from scipy.integrate import quad
from scipy.linalg import toeplitz

from sinssim.analyses.allan_deviation import (
    FLICKER,
    QUANTISATION,
    RANDOM_WALK,
    RATE_WALK,
    end_effects,
    gauss_markov_term,
    ramp_coefficients,
)

N, T = 300, 0.4
K = np.arange(1.0, N)


def transformed(covariance):
    """Return the covariance of the cosine coefficients."""
    return dct(dct(covariance, axis=0, norm="ortho"), axis=1, norm="ortho")


def test_white_noise_is_exact():
    np.testing.assert_allclose(RANDOM_WALK.power(K, N, T), np.diag(transformed(T * np.eye(N)))[1:], rtol=1e-12)


def test_quantisation_is_exact_with_its_ends():
    """Rounding errors at N + 1 edges: the interior has the spectrum, the two ends the shape of `end_effects`."""
    difference = np.diff(np.eye(N + 1), axis=0)  # increments of unit errors
    interior = transformed(difference[:, 1:-1] @ difference[:, 1:-1].T)
    np.testing.assert_allclose(np.diag(interior)[1:], QUANTISATION.power(K, N, T), rtol=1e-10)
    off = interior - np.diag(np.diag(interior))
    assert np.max(np.abs(off[1:, 1:])) < 1e-12
    first, last = (dct(difference[:, edge], norm="ortho") for edge in (0, N))
    ends, sign = end_effects(N), (-1.0) ** np.arange(N)
    np.testing.assert_allclose(first[1:], -ends[1:], atol=1e-12)
    np.testing.assert_allclose(last[1:], (sign * ends)[1:], atol=1e-12)


def test_rate_walk_is_exact_and_independent():
    """Integrals of a Wiener process over intervals: covariance by definition, ∫∫ min(s, t)."""
    j = np.arange(N, dtype=float)
    low = np.minimum(j[:, None], j[None, :])
    covariance = T**3 * (low + 0.5)
    covariance[np.diag_indices(N)] = T**3 * (j + 1.0 / 3.0)
    found = transformed(covariance)[1:, 1:]
    np.testing.assert_allclose(np.diag(found), RATE_WALK.power(K, N, T), rtol=1e-3)
    scale = np.sqrt(np.diag(found))
    assert np.max(np.abs(found / np.outer(scale, scale) - np.eye(N - 1))[:50, :50]) < 1e-3


def test_flicker_with_its_ends():
    edges = np.arange(0.0, N + 1.0)
    double = -(0.5 * edges**2 * np.log(np.maximum(edges, 1e-9)) - 0.75 * edges**2)
    lags = np.concatenate([[2.0 * double[1]], double[2:] - 2.0 * double[1:-1] + double[:-2]])
    found = transformed(T**2 / np.pi * toeplitz(lags))[1:, 1:]
    np.testing.assert_allclose(np.diag(found)[:200], FLICKER.power(K, N, T)[:200], rtol=5e-3)
    np.testing.assert_allclose(np.diag(found)[:5], FLICKER.power(K, N, T)[:5], rtol=2e-4)
    scale = np.sqrt(np.diag(found))
    assert np.max(np.abs(found / np.outer(scale, scale) - np.eye(N - 1))) < 0.121  # as the module says


@pytest.mark.parametrize("correlation_time", [1.0, 20.0, 300.0, 1e5])
def test_gauss_markov_with_its_ends(correlation_time):
    """Covariances of integrals over two intervals by quadrature of exp(−|t|/τ) with the triangle of their overlap."""
    lags = [
        quad(
            lambda u, j=j: (T - abs(u - j * T)) * np.exp(-abs(u) / correlation_time),
            (j - 1) * T,
            (j + 1) * T,
            points=[0.0, j * T],
            epsrel=1e-13,
        )[0]
        for j in range(3)
    ]
    decay = np.exp(-T / correlation_time)
    lags += [lags[2] * decay ** (j - 2) for j in range(3, N)]
    found = transformed(toeplitz(lags))[1:, 1:]
    term = gauss_markov_term(correlation_time)
    # at the longest time what is left of the record is 3e-6 of its covariance
    rtol = 2e-3 if correlation_time > 1.0 else 0.02
    np.testing.assert_allclose(np.diag(found)[:60], term.power(K, N, T)[:60], rtol=rtol)
    np.testing.assert_allclose(term.power(np.array([250.0]), N, T)[0], found[249, 249], rtol=0.03)


def test_gauss_markov_between_walk_and_white_noise():
    long, short = gauss_markov_term(1e7), gauss_markov_term(1e-3)
    k = np.array([5.0, 100.0, 290.0])
    # σ_b √(2/τ_b) far below, σ_b √(2τ_b) far above
    np.testing.assert_allclose(long.power(k, N, T), 2.0 / 1e7 * RATE_WALK.power(k, N, T), rtol=1e-4)
    np.testing.assert_allclose(short.power(k, N, T), 2e-3 * RANDOM_WALK.power(k, N, T), rtol=1e-2)
    # both sides of the switch to a series
    for tau_b in (1000.0, 40.0):
        below, above = gauss_markov_term(tau_b * (1 - 1e-9)), gauss_markov_term(tau_b * (1 + 1e-9))
        np.testing.assert_allclose(below.power(k, N, tau_b * 0.01), above.power(k, N, tau_b * 0.01), rtol=1e-6)
        tau = np.array([1e-3 * tau_b])
        np.testing.assert_allclose(below.allan_variance(tau), above.allan_variance(tau), rtol=1e-6)


@pytest.mark.parametrize("count", [256, 301])
def test_ramp(count):
    increments = T**2 * (np.arange(count) + 0.5)
    found = dct(increments, norm="ortho")
    found[0] = 0.0
    np.testing.assert_allclose(ramp_coefficients(count, T), found, atol=1e-9 * np.max(np.abs(found)))
