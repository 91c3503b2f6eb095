"""Rows of a solution at which a study takes errors."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.experiments.studies.algorithm_comparison import instants


@pytest.mark.parametrize("count", [2, 3, 50, 5000, 400_001])
def test_rows(count):
    found = instants(count)
    assert np.all(np.diff(found.taken) > 0)
    even = found.taken[found.even]
    assert (even[0], even[-1]) == (0, count - 1)
    assert len(even) == min(count, 4096)
    assert np.ptp(np.diff(even)) <= 1  # evenly spread
    kept = found.taken[found.kept]
    assert (kept[0], kept[-1]) == (0, count - 1)
    assert len(kept) <= 512 + 128


def test_plots_begin_with_the_first_rows():
    """Over decades of time a plot needs early rows: evenly spread ones would begin at 35 s of five hours."""
    kept = instants(36_001).taken[instants(36_001).kept]
    assert kept[1] == 1
    assert np.count_nonzero(kept < 70) > 10
