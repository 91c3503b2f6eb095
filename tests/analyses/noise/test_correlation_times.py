"""The correlation times for which bands are taken, on a likelihood that is a known function of the time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses import noise_fit
from sinssim.analyses.noise_fit import correlation_times

QUANTILE = 1.959963984540054
"""97.5 % point of the normal distribution, √3.8415."""


class Known:
    """The likelihood without the last term, to which that of a correlation time is added."""

    def __init__(self, bands: Any, terms: Any, columns: Any, weight: Any) -> None:
        assert (bands.interval, terms, columns, weight) == (0.3, ("white", "walk"), (1.0, 2.0), "weight")

    def extended(self, time: float) -> Any:
        """Twice the loss is the square of the distance in the logarithm: 1σ is 0.3 below 40 s, and 0.5 above it."""
        off = np.log(time / 40.0)
        return SimpleNamespace(top=-7.0 - 0.5 * (off / (0.3 if off < 0.0 else 0.5)) ** 2)


def model() -> Any:
    return SimpleNamespace(
        bands=SimpleNamespace(interval=0.3), terms=("white", "walk", "bias"), columns=(1.0, 2.0, 3.0), weight="weight",
        top=-7.0,
    )  # fmt: skip


def test_the_band_of_a_correlation_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five times, evenly in the logarithm, between the 95 % points on both sides; xtol is 0.02 of the logarithm."""
    monkeypatch.setattr(noise_fit, "Likelihood", Known)
    monkeypatch.setattr(noise_fit, "gauss_markov_term", lambda time: time)
    first, *others = correlation_times(model(), 40.0)
    assert first == 40.0
    expected = np.linspace(np.log(40.0) - 0.3 * QUANTILE, np.log(40.0) + 0.5 * QUANTILE, 5)
    np.testing.assert_allclose(np.log(others), expected, rtol=0.0, atol=0.021)


def test_a_time_that_the_data_do_not_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """From below the samples' interval to beyond a thousand times the likeliest: steps of 0.2 · 1.6ⁿ reach them."""
    monkeypatch.setattr(noise_fit, "Likelihood", Known)
    monkeypatch.setattr(noise_fit, "gauss_markov_term", lambda time: 40.0)
    found = correlation_times(model(), 40.0)
    below = above = 0.2
    while below < np.log(40.0 / 0.3):
        below *= 1.6
    while above < np.log(1e3):
        above *= 1.6
    np.testing.assert_allclose(np.log(np.array(found[1:]) / 40.0), np.linspace(-below, above, 5), atol=1e-12)
