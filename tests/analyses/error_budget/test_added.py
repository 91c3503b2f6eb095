"""What the intervals between marks add, by source, against closed forms of a parked vehicle."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.experiments.ensembles.ensemble_execution import errors_of_runs
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan
from sinssim.units import DEG_H, DEG_SQRT_H
from tests.analyses.error_budget.worlds import scenario


def test_intervals_of_a_parked_vehicle() -> None:
    """N²T and bT of the heading, b (t₂² − t₁²)/2 of the position, which the sum up to t₁ does not touch."""
    plan = scenario(
        parked={"latitude_deg": 0.0, "duration_s": 120.0},
        imu={
            "rate_hz": 5.0, "gyro_bias_sigma_deg_h": 2.0, "gyro_arw_deg_sqrt_h": 0.1, "accel_bias_sigma_ug": 100.0,
            "accel_bias_ug": [50.0, 0.0, 0.0],
        },
    )  # fmt: skip
    added = budget(plan, marks=(20.0, 50.0, 120.0)).added
    assert added is not None
    assert added.begin == pytest.approx([0.0, 20.0, 50.0])
    assert added.end == pytest.approx([20.0, 50.0, 120.0])
    length, square = added.end - added.begin, 0.5 * (added.end**2 - added.begin**2)
    heading = {name: p[:, 8, 8] for name, p in added.covariance.items()}
    assert heading["gyro_arw"] == pytest.approx((0.1 * DEG_SQRT_H) ** 2 * length, rel=1e-3)
    assert heading["gyro_bias"] == pytest.approx((2.0 * DEG_H * length) ** 2, rel=1e-3)
    force = 9.80665e-6
    assert added.covariance["accel_bias"][:, 0, 0] == pytest.approx((100.0 * force * square) ** 2, rel=0.01)
    assert added.mean["accel_bias_given"][:, 0] == pytest.approx(50.0 * force * square, rel=0.01)
    whole, shares = added.shares(1, (8,))
    assert whole == pytest.approx(np.sqrt(sum(p[1] for p in heading.values())))
    assert sum(share for _, share in shares) == pytest.approx(1.0)
    assert [name for name, _ in shares][:2] == ["gyro_bias", "gyro_arw"]


def test_what_phases_add_after_an_alignment_is_that_of_an_ensemble() -> None:
    """The change of each error over a phase, with what the alignment left; 14 mean squares of 60 runs.

    By chance it fails with 0.2 %.
    """
    runs = 60
    plan = scenario(
        parked={"latitude_deg": 50.0, "altitude_m": 300.0, "heading_deg": 30.0, "pitch_deg": 3.0, "duration_s": 500.0},
        navigation={"alignment": {"duration_s": 200.0}},
        imu={"grade": "laser-standard", "rate_hz": 5.0},
    )
    truths = TruthCache()
    made = make_plan(plan, truths)
    since = made.epochs - made.start
    errors = errors_of_runs(made, range(runs), truths)
    found = np.concatenate([errors.position_ned, errors.velocity_ned, errors.attitude], axis=2)
    marks = [float(since[np.argmin(np.abs(since - t))]) for t in (200.0, 320.0)]
    added = budget(plan, marks=[*marks, float(since[-1])]).added
    assert added is not None
    for row, (begin, end) in enumerate(zip(added.begin, added.end, strict=True)):
        first, last = np.searchsorted(since, [begin - 1e-6, end - 1e-6])
        change = found[:, last] - found[:, first]
        square = np.diag(sum(p[row] for p in added.covariance.values()))[:9]
        free = [0, 1, 3, 4, 6, 7, 8]  # the height is held
        ratio = np.mean(change[:, free] ** 2, axis=0) / square[free]
        assert np.abs(ratio - 1.0).max() < 4.5 * np.sqrt(2.0 / runs)
