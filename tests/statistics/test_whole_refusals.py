"""Arguments that cannot be, by their number or shape."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.statistics.chi_square import compare_systems, detection_probability, extreme, mean_square_band
from sinssim.statistics.circular_error import share_in_circle
from sinssim.statistics.percentiles import percentile, spread


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: mean_square_band([3.0, -2.0, 5.0]), "freedom = -2 must not be negative."),
        (lambda: share_in_circle(np.eye(2), [1.0, -3.5, np.nan]), "radius = -3.5 must not be negative."),
        (lambda: spread(np.ones((0, 4))), "values has the shape (0, 4); give (N, …) with at least one run."),
        (lambda: detection_probability(np.ones(3), np.ones((3, 1, 1)), 0.01),
         "effect has the shape (3,); it must be instants × components."),
        (lambda: detection_probability(np.ones((3, 2)), np.ones((3, 1, 1)), 0.01),
         "covariance has the shape (3, 1, 1); the outputs need (3, 2, 2)."),
        (lambda: detection_probability(np.ones((3, 1)), np.ones((3, 1, 1)), 1.0),
         "false_alarm = 1 must be a probability between 0 and 1."),
        (lambda: compare_systems(np.ones((4, 1, 3, 2)), np.ones((3, 2, 2)), 0.01),
         "outputs has the shape (4, 1, 3, 2); it must be teams × systems × instants × components with two systems or "
         "more."),
        (lambda: compare_systems(np.ones((4, 2, 3)), np.ones((3, 2, 2)), 0.01),
         "outputs has the shape (4, 2, 3); it must be teams × systems × instants × components with two systems or "
         "more."),
    ],
)  # fmt: skip
def test_what_cannot_be(call: Callable[[], Any], said: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        call()


def test_nothing_to_judge() -> None:
    assert extreme([np.nan, 3.0], [2.0, 0.0], [False, True], 0.01) is None
    none = percentile(np.full((3, 2), np.nan), 0.5)
    assert np.isnan([none.value, none.low, none.high]).all()
    assert none.runs.tolist() == [0.0, 0.0]
