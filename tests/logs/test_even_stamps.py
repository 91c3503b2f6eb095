"""Even instants of samples whose stamps are coarse, come in packets, lack samples, and drift."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import Array
from sinssim.logs.recorded_streams import even_stamps

RNG = np.random.default_rng(7)


def _kept(rate: float, share: float) -> Array:
    number = np.arange(round(60.0 * rate))
    return number[RNG.random(len(number)) >= share] / rate


def test_coarse_stamps_of_a_clock_that_drifts_and_lost_samples() -> None:
    """400 Hz in whole milliseconds, 2 % lost, 50 ppm: losses are placed to a few samples, and all of them counted."""
    true = _kept(400.0, 0.02)
    stamps = np.round(100.0 + true * (1.0 + 50e-6) + RNG.normal(0.0, 0.6e-3, len(true)), 3)
    assert (np.diff(stamps) <= 0.0).any()
    time, interval = even_stamps(stamps)
    off = np.abs(time - 100.0 - true * (1.0 + 50e-6))
    assert np.median(off) < 0.1e-3  # jitter of 0.7 ms, averaged over 30 s
    assert np.mean(off > 0.5 * interval) < 0.02  # where a loss is placed some samples off
    assert interval == pytest.approx(0.0025 * (1.0 + 50e-6), rel=2e-6)
    assert round((time[-1] - time[0]) / interval) == round((true[-1] - true[0]) * 400.0)


@pytest.mark.parametrize("size", [5, 10])
def test_packets_of_one_stamp(size: int) -> None:
    true = np.arange(6000) / 100.0
    stamps = true[np.arange(6000) // size * size + size - 1]
    time, interval = even_stamps(stamps)
    assert interval == pytest.approx(0.01, rel=1e-4)
    np.testing.assert_allclose(np.diff(time), 0.01, rtol=1e-3)
    assert abs(float(np.mean(time - true)) - 0.005 * (size - 1)) < 1e-3  # a packet is stamped at its end
