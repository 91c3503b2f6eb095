"""A run says when its aided solution is worse than an inertial one, over the time of the filter."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.recording.store.summaries.against_inertial import horizontal_of, worse_than_inertial
from sinssim.strapdown.nav_error import NavError


def errors(time: np.ndarray, north: float) -> NavError:
    zero = np.zeros((len(time), 3))
    return NavError(time, zero + np.array([north, 0.0, 0.0]), zero, zero)


def aided(north: float, sigma: float) -> SimpleNamespace:
    time = np.arange(100.0, 200.0)
    states = np.tile([sigma / np.sqrt(2.0), sigma / np.sqrt(2.0), 1.0], (100, 1))
    return SimpleNamespace(
        estimate=SimpleNamespace(time=time, sigma=states), error_blocks=lambda: iter([errors(time, north)])
    )


@pytest.mark.parametrize(
    ("north", "sigma", "words"), [(6.0, 5.0, "may be the chance of one run"), (60.0, 5.0, "its model is wrong")]
)
def test_only_what_is_worse_within_the_time_of_the_filter_is_reported(north: float, sigma: float, words: str) -> None:
    time = np.arange(0.0, 300.0, 0.05)
    best, worst = errors(time, 4.0), errors(time, 1000.0)
    best.position_ned[(time < 100.0) | (time > 199.0)] = 1e6  # outside of the time of the filter
    (sentence,) = worse_than_inertial(aided(north, sigma), horizontal_of({"quaternion": best, "euler": worst}))
    assert f"its horizontal error is {north:g}" in sentence
    assert "that of quaternion 4.00 m" in sentence
    assert "1σ is 5.00 m" in sentence
    assert words in sentence
    assert not list(worse_than_inertial(aided(3.0, sigma), horizontal_of({"quaternion": best, "euler": worst})))
    unknown = errors(time, np.nan)
    assert not list(worse_than_inertial(aided(north, sigma), horizontal_of({"quaternion": unknown})))
