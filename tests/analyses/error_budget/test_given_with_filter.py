"""Errors that are the same in every run, with a filter: the difference of two runs of the same seed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget.covariance_budget import budget
from tests.analyses.error_budget.worlds import SHORT_TURN, aided_ensemble, scenario
from tests.slow import slow

_START = {"position_sigma_m": 0.5, "velocity_sigma_mps": 0.01, "tilt_sigma_arcmin": 0.02, "heading_sigma_arcmin": 0.2}
_GIVEN: dict[str, dict[str, Any]] = {
    "baro bias": {"aiding": {"baro": {"bias_m": 4.0}}},
    "jump": {"aiding": {"gnss": {"jumps": [{"from_s": 20.0, "to_s": 30.0, "north_m": 2.0, "up_m": -1.0}]}}},
    "ramp": {"aiding": {"gnss": {"ramps": [{"from_s": 15.0, "east_mps": 0.05}]}}},
    "fault": {"imu": {"faults": [{"type": "bias-step", "from_s": 12.0, "to_s": 40.0, "accel_ug": [900.0, 0.0, 0.0]}]}},
}


def _plan(**given: Any) -> sinssim.Scenario:
    aiding = given.get("aiding", {})
    return scenario(
        motion=SHORT_TURN,
        imu={"grade": "laser-standard", "rate_hz": 20.0, **given.get("imu", {})},
        navigation={"vertical": "free", "initial_error": _START},
        aiding={
            "gnss": {"latency_s": 0.2, "lever_arm_m": [1.0, 0.0, -1.0], **aiding.get("gnss", {})},
            "baro": {"bias_sigma_m": 3.0, **aiding.get("baro", {})},
        },
        filter={"gate": 0.0, "rate_hz": 10.0},
    )


@pytest.mark.parametrize("name", ["jump", *slow("fault", "baro bias", "ramp")])
def test_the_difference_of_two_runs(name: str) -> None:
    """To 0.1 % of the largest: products of the given error with the small random ones remain."""
    with_it, without = _plan(**_GIVEN[name]), _plan()
    result, plain = budget(with_it), budget(without)
    expected = result.bias - plain.bias
    difference = (aided_ensemble(with_it, result, 1) - aided_ensemble(without, result, 1))[0]
    assert np.abs(difference[:, :3]).max() > 0.01
    for part in (slice(0, 3), slice(3, 6), slice(6, 9)):
        largest = np.abs(difference[:, part]).max()
        assert np.abs(expected[:, part] - difference[:, part]).max() <= 0.001 * largest
    assert result.sigma() == pytest.approx(plain.sigma(), rel=1e-9)
