"""Smoothing: as filterpy does where nothing is fed back, the same in the closed loop; what it is worth in an outage."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from sinssim.data import rows_of
from sinssim.estimation import error_model
from sinssim.estimation.consistency import scaled_solve
from sinssim.estimation.estimate import estimate
from sinssim.strapdown.navigation_error import navigation_error
from tests.estimation.worlds import biases_only, errors_of, one_run, positions, velocities, weaving
from tests.slow import slow

SIGMA = biases_only("laser-standard")
MODEL = error_model(SIGMA, position=(5.0, 5.0, 5.0), velocity=0.1, attitude=(3e-4, 3e-4, 3e-3))


def test_open_loop_is_filterpys_and_closed_loop_the_same() -> None:
    flight, ideal = weaving(300.0, 20.0)
    run = one_run(flight, ideal, MODEL, SIGMA, 0)
    time, rng = np.arange(1.0, 300.5), np.random.default_rng(0)
    time = time[(time < 100.0) | (time > 200.0)]
    given = [positions(flight, time, rng), velocities(flight, time, rng)]
    in_open = estimate(run.imu, run.initial, given, MODEL, rate_hz=5.0, loop="open", smooth=True, history=True)
    h, ours = in_open.history, in_open.smoothed
    assert h is not None
    assert ours is not None
    np.testing.assert_array_equal(h.fed_back, 0.0)
    # in units of the first standard deviations, or filterpy inverts matrices that span twenty powers of ten
    unit = MODEL.sigma
    over = unit[:, None] / unit
    theirs = KalmanFilter(dim_x=15, dim_z=3)
    x, p, _, _ = theirs.rts_smoother(
        h.state / unit, h.covariance / np.outer(unit, unit), h.transition / over, h.noise / np.outer(unit, unit)
    )
    scaled = ours.covariance / np.outer(unit, unit)
    assert np.abs(scaled - p).max() < 1e-7 * p.max()
    for name in ours.parameters:
        where = MODEL.slices[name]
        off = ours.parameters[name] - x[:, where] * unit[where]
        assert np.abs(off / ours.sigma[:, where]).max() < 1e-4
    moved = navigation_error(h.navigation, ours.solution)
    assert (
        np.abs((moved.position_ned + x[:, :3] * unit[:3]) / ours.sigma[:, :3]).max() < 0.01
    )  # 190 m on a curved Earth
    assert np.abs((moved.velocity_ned + x[:, 3:6] * unit[3:6]) / ours.sigma[:, 3:6]).max() < 1e-3

    # the closed loop feeds back in the middle of it all, and comes to the same
    closed = estimate(run.imu, run.initial, given, MODEL, rate_hz=5.0, feedback_s=7.0, smooth=True).smoothed
    assert closed is not None
    rows = np.searchsorted(ours.time, closed.time - 1e-6)
    both = np.abs(ours.time[np.minimum(rows, len(ours.time) - 1)] - closed.time) < 1e-6
    assert both.sum() >= len(ours.time)
    error = navigation_error(rows_of(ours.solution, rows[both]), _part(closed, both))
    assert np.abs(error.position_ned / ours.sigma[rows[both], :3]).max() < 0.05
    assert np.abs(error.attitude / ours.sigma[rows[both], 6:9]).max() < 0.1
    np.testing.assert_allclose(closed.sigma[both], ours.sigma[rows[both]], rtol=5e-3)


def _part(smoothed, rows):
    from sinssim.data import solution_of

    return solution_of(smoothed.time[rows], rows_of(smoothed.solution, rows), "")


@pytest.mark.parametrize("runs", [1, *slow(2, 20)])
def test_fifteen_minutes_without_satellites(runs: int) -> None:
    """The error at the end lies within the predicted σ, and smoothing at least halves the largest."""
    flight, ideal = weaving(2400.0, 20.0)
    time = np.arange(1.0, 2400.5)
    time = time[(time <= 1200.0) | (time > 2100.0)]
    at_end, inside = [], []
    for seed in range(runs):
        run, rng = one_run(flight, ideal, MODEL, SIGMA, seed), np.random.default_rng([5, seed])
        given = [positions(flight, time, rng), velocities(flight, time, rng)]
        result = estimate(run.imu, run.initial, given, MODEL, rate_hz=1.0, smooth=True)
        assert result.smoothed is not None
        errors = errors_of(MODEL, result, flight, run)
        smoothed = errors_of(MODEL, result.smoothed, flight, run)
        last = int(np.searchsorted(result.time, 2100.0))
        assert result.time[last] == 2100.0
        at_end.append(errors[last, :9] / result.sigma[last, :9])
        assert result.sigma[last, 0] < 150.0  # 1 nmi/h would be 460 m
        gap, smooth_gap = ((t > 1200.0) & (t < 2101.0) for t in (result.time, result.smoothed.time))
        peak = np.linalg.norm(errors[gap, :2], axis=1).max(), np.linalg.norm(smoothed[smooth_gap, :2], axis=1).max()
        assert peak[1] < 0.5 * peak[0]
        inside.append((smoothed[smooth_gap] / result.smoothed.sigma[smooth_gap]) ** 2)
        assert np.all(result.smoothed.sigma[:, :9] <= result.sigma[result.rows][:, :9] * (1.0 + 1e-9))
    assert np.abs(at_end).max() < (2.6 if runs <= 2 else 3.5)
    assert np.sqrt(np.mean(np.square(at_end))) < (1.4 if runs <= 2 else 1.15)
    assert np.sqrt(np.mean(inside)) < (1.4 if runs <= 2 else 1.1)


def test_scaled_solve_leaves_out_what_is_known_exactly() -> None:
    """The solution of the other states alone, and nothing for the state without variance; over twenty powers of ten."""
    rng = np.random.default_rng(7)
    root = rng.standard_normal((3, 4, 4)) * np.array([1e-10, 1.0, 1e-4, 1e6])[:, None]
    p, right = root @ root.transpose(0, 2, 1), root @ rng.standard_normal((3, 4, 2))
    known, wide = np.zeros((3, 5, 5)), np.zeros((3, 5, 2))
    others = np.array([0, 1, 3, 4])
    known[np.ix_(range(3), others, others)], wide[:, others] = p, right
    found = scaled_solve(known, wide)
    np.testing.assert_array_equal(found[:, 2], 0.0)
    back = p @ found[:, others]
    assert np.all(np.abs(back - right) < 1e-9 * np.abs(right).max(axis=(0, 2))[:, None])


def test_scaled_solve_of_a_singular_covariance_is_the_smallest_solution() -> None:
    """Two states tied to each other, P = D [[1, 1], [1, 1]] D: of P X = P (1, 0) all X with x₁ d₁ + x₂ d₂ = d₁ are
    solutions, and (½, ½ d₁/d₂) is the smallest in units of the variances."""
    tied = np.array([[4.0, 2.0], [2.0, 1.0]])
    free = np.diag([4.0, 1.0])
    found = scaled_solve(np.array([tied, free]), np.array([tied, free])[:, :, :1])
    np.testing.assert_allclose(found[:, :, 0], [[0.5, 1.0], [1.0, 0.0]], rtol=1e-14, atol=1e-15)
