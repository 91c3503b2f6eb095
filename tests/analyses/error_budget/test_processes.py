"""Processes over long steps have the statistics of many short ones, and those of the theory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.analyses.error_budget.source_propagation import Flicker, GaussMarkov, Process, Walk
from sinssim.data import Array
from sinssim.sensors import flicker


def means(process: Process, interval: float, count: int) -> Array:
    """Return the covariance of the means over successive steps, (count, count)."""
    one = process.step(interval)
    states, fresh = one.fresh.shape
    # every mean as a combination of the start and of all numbers
    size = states + fresh * count
    now = np.zeros((states, size))
    now[:, :states] = np.linalg.cholesky(process.start + 1e-300 * np.eye(states))
    rows = []
    for k in range(count):
        own = np.zeros((fresh, size))
        own[:, states + k * fresh : states + (k + 1) * fresh] = np.eye(fresh)
        rows.append(one.mean_of_state @ now + one.mean_of_fresh @ own)
        now = one.keep @ now + one.fresh @ own
    found = np.array(rows)
    return np.asarray(found @ found.T)


@pytest.mark.parametrize("process", [GaussMarkov(7.0), Walk(), Flicker(0.01)], ids=["markov", "walk", "flicker"])
def test_one_long_step_is_many_short_ones(process: Process) -> None:
    """Means over 25 samples, from single samples and from steps of 25."""
    short = means(process, 0.01, 100)
    averaged = short.reshape(4, 25, 4, 25).mean(axis=(1, 3))
    assert means(process, 0.25, 4) == pytest.approx(averaged, rel=1e-9)


def test_the_covariance_of_a_gauss_markov_process() -> None:
    """V = 2(x − 1 + e^−x)/x², C = (1 − e^−x)²/x² e^−(j−1)x."""
    x = 0.3
    found = means(GaussMarkov(10.0), 3.0, 4)
    assert found.diagonal() == pytest.approx(2.0 * (x - 1.0 + math.exp(-x)) / x**2)
    lagged = (1.0 - math.exp(-x)) ** 2 / x**2 * np.exp(-x * np.arange(3))
    assert found[0, 1:] == pytest.approx(lagged)


def test_the_variance_of_the_mean_of_flicker_noise() -> None:
    for count in (1, 10, 1000):
        found = means(Flicker(0.01), 0.01 * count, 1)[0, 0]
        assert found == pytest.approx(float(flicker.variance_of_mean(count)), rel=1e-9)


def test_the_mean_of_a_walk() -> None:
    """The mean over the first step has the variance T/3, that of the second 4T/3."""
    found = means(Walk(), 2.0, 2)
    assert found.diagonal() == pytest.approx([2.0 / 3.0, 8.0 / 3.0])
    assert found[0, 1] == pytest.approx(1.0)  # T/2
