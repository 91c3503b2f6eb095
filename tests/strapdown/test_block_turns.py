"""The turns of a block of intervals, computed side by side, are those of the intervals one by one."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.strapdown.coning_sculling import (
    BLOCK,
    empty_turns_k,
    fill_fitted_turns,
    fitted_turn_k,
    is_uniform,
    turn_in_block_k,
    weight_table,
)

COUNTS = [1, 2, 4, 5, 6, BLOCK - 1, BLOCK, BLOCK + 1, BLOCK + 2, BLOCK + 3, 3 * BLOCK + 7]


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize(("uniform", "angle"), [(True, 0.01), (True, 0.2), (True, 1.2), (False, 0.01)])
def test_a_block_is_its_intervals(count: int, uniform: bool, angle: float) -> None:
    """With 0.2 rad some rotations pass the bound of the block's series, 0.245 rad; with 1.2 rad they would be wrong."""
    rng = np.random.default_rng(count)
    time = np.arange(count + 1.0) if uniform else np.cumsum(rng.uniform(0.9, 1.1, count + 1))
    assert is_uniform(time) is (uniform or count == 1)
    weights = weight_table(time, uniform)
    # a smooth motion: the fit's higher moments must stay smaller than what they correct
    phase = np.arange(count)[:, None] * 0.1 + np.arange(6)
    increments = np.sin(phase) * np.array([angle] * 3 + [10.0] * 3)
    dtheta, dvel = np.ascontiguousarray(increments[:, :3]), np.ascontiguousarray(increments[:, 3:])
    turns = empty_turns_k()
    large = 0
    for first in range(0, count, BLOCK):
        turns[:] = np.nan
        last = min(first + BLOCK, count)
        fill_fitted_turns(dtheta, dvel, weights, uniform, first, last, turns)
        for k in range(first, last):
            alone = fitted_turn_k(dtheta, dvel, weights, uniform, k)
            large += np.linalg.norm(alone[:3]) > 0.245
            np.testing.assert_allclose(turn_in_block_k(turns, k - first), alone, rtol=0, atol=1e-14)
    assert (large > 0) == (angle >= 0.2)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_block_about_one_axis_or_none(axis: int) -> None:
    """Rates of exactly zero, as a simulated vehicle has them, are rates like any other."""
    count = BLOCK
    weights = weight_table(np.arange(count + 1.0), True)
    dvel = np.sin(0.1 * np.arange(count)[:, None] + np.arange(3))
    for angle in (0.0, 0.01):
        dtheta = np.zeros((count, 3))
        dtheta[:, axis] = angle
        turns = empty_turns_k()
        fill_fitted_turns(dtheta, dvel, weights, True, 0, count, turns)
        for k in range(count):
            alone = fitted_turn_k(dtheta, dvel, weights, True, k)
            np.testing.assert_allclose(turn_in_block_k(turns, k), alone, rtol=0, atol=1e-14)
