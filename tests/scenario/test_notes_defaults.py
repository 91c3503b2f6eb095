"""What is taken by default for the slow noises, and how far flicker reaches, is said."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim.scenario.notes import defaults_taken
from sinssim.scenario.plan_summary import plan_lines
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.imu_section import Imu


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (
            {"gyro_instability_deg_h": 0.5},
            "imu.gyro_instability_deg_h = 0.5 is given without gyro_correlation_time_s: 3600",
        ),
        (
            {"accel_instability_ug": 9.0},
            "imu.accel_instability_ug = 9 is given without accel_correlation_time_s: 3600 s",
        ),
        (
            {"gyro_flicker_deg_h": 0.5},
            "imu.gyro_flicker_deg_h = 0.5 is flicker noise up to 2.5e+06 samples, 2.5e+04 s at",
        ),
    ],
)
def test_what_is_taken_is_said(keys: dict[str, Any], said: str) -> None:
    """A run of 25 001 s at 100 Hz has a hundred samples more than flicker reaches."""
    (sentence,) = defaults_taken(Imu.model_validate({"rate_hz": 100.0, **keys}), 25_001.0)
    assert sentence.startswith(said)
    parked = {"latitude_deg": 50.0, "duration_s": 25_001.0}
    plan = Scenario.model_validate({"name": "n", "parked": parked, "imu": {"rate_hz": 100.0, **keys}})
    assert f"note        {sentence}" in list(plan_lines(plan))


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"grade": "consumer"},
        {"gyro_instability_deg_h": 0.0},
        {"gyro_instability_deg_h": 0.5, "gyro_correlation_time_s": 60.0},
        {"gyro_flicker_deg_h": 0.5, "rate_hz": 99.0},
    ],
)
def test_nothing_is_said_where_nothing_is_taken(keys: dict[str, Any]) -> None:
    assert list(defaults_taken(Imu.model_validate({"rate_hz": 100.0, **keys}), 25_001.0)) == []
