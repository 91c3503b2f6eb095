"""Navigation on a run's readings: what it refuses."""

from __future__ import annotations

import pytest

import sinssim
from sinssim.simulation.navigation_stage import solve
from sinssim.simulation.truth_and_sensors import truth_along


def test_a_platform_needs_the_errors_of_its_sensors() -> None:
    settings = ["parked.duration_s=5", "imu.sensor_set.type=platform", "navigation.algorithms=['platform']"]
    scenario = sinssim.load_scenario("parked", settings)
    truth = truth_along(sinssim.fly(scenario), scenario)
    with pytest.raises(sinssim.InputError, match=r"platform computes its own loop .* give errors"):
        solve(scenario, truth, truth.ideal, None, None)
