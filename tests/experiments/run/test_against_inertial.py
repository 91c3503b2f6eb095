"""A run says when its aided solution is worse than an inertial one, over the time of the filter."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.experiments.run.error_exhibits import horizontal_of, worse_than_inertial
from sinssim.strapdown.navigation_error import NavError


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


def test_the_whole_sentence() -> None:
    """Over 2 to 4 s: aided 5, 13 and 7 m, quaternion 3, 9 and 6 m; σ of (3, 4), (6, 8) and (5, 12) m."""
    time = np.array([2.0, 3.0, 4.0])
    own = NavError(
        time, np.array([[3.0, -4.0, 9.0], [5.0, 12.0, 9.0], [0.0, 7.0, 9.0]]), np.zeros((3, 3)), np.zeros((3, 3))
    )
    sigma = np.array([[3.0, 4.0, 99.0], [6.0, 8.0, 99.0], [5.0, 12.0, 99.0]])
    filter_ = SimpleNamespace(
        estimate=SimpleNamespace(time=time, sigma=sigma),
        error_blocks=lambda: iter([own.at(slice(0, 2)), own.at(slice(2, 3))]),
    )
    instants = np.array([1.99, 2.0, 3.0, 4.0, 4.01])
    inertial = {"quaternion": (instants, np.array([900.0, 3.0, 9.0, 6.0, 900.0]))}
    assert list(worse_than_inertial(filter_, inertial)) == [
        "From 2 s to 4 s the aided solution is worse than quaternion: its horizontal error is 9.00 m (rms), that of "
        "quaternion 6.48 m. The filter's own 1σ is 9.90 m. The error is within what the filter states, so that this "
        "may be the chance of one run; `sinssim ensemble` and `sinssim budget` compare both over all runs."
    ]  # √(243/3), √(126/3), √(294/3)
    late = SimpleNamespace(estimate=SimpleNamespace(time=time[:1], sigma=sigma[:1]))
    assert list(worse_than_inertial(late, inertial)) == []


def test_rows_of_an_inertial_solution_are_thinned() -> None:
    time = np.arange(7.0, 6007.0)
    found, horizontal = horizontal_of({"euler": errors(time, 3.0)})["euler"]
    np.testing.assert_array_equal(found, np.arange(7.0, 6007.0, 3.0))
    assert horizontal.tolist() == [3.0] * 2000
