"""Keys of a sensor block without effect are reported."""

from __future__ import annotations

import re
from typing import Any

import pytest

from sinssim.scenario.notes import keys_without_effect
from sinssim.sensors.imu.imu_section import Imu

RING = {
    "perimeter_mm": 420.0,
    "area_mm2": 8487.0,
    "lock_in_deg_h": 360.0,
    "dither_amplitude_arcsec": 140.0,
    "dither_frequency_hz": 400.0,
    "gas_flow_mps": 0.001,
    "gain_percent": 0.8,
}


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"gyro_bias_temperature_sigma_deg_h_per_c": 0.01}, "imu.gyro_bias_temperature_sigma_deg_h_per_c has no eff"),
        ({"accel_scale_temperature_ppm_per_c": [0.0, 1.0, 0.0]}, "imu.accel_scale_temperature_ppm_per_c has no eff"),
        ({"laser_gyro": RING}, "imu.laser_gyro.gas_flow_mps has no effect: temperature_start_c and"),
        ({"warm_up_time_s": 60.0}, "imu.warm_up_time_s has no effect: .* are equal"),
        (
            {"gyro_correlation_time_s": 60.0},
            "imu.gyro_correlation_time_s has no effect: there is no gyro_instability",
        ),
        (
            {"grade": "consumer", "gyro_instability_deg_h": 0.0, "gyro_correlation_time_s": 60.0},
            "there is no gyro_instability_deg_h",
        ),
        (
            {"faults": [{"type": "dropout", "from_s": 5.0, "to_s": 500.0}]},
            r"imu.faults.1.to_s = 500: the dropout ends with the run, at 100 s\.",
        ),
    ],
)
def test_what_changes_nothing_is_said(keys: dict[str, Any], said: str) -> None:
    (sentence,) = keys_without_effect(Imu.model_validate(keys), 100.0)
    assert re.search(said, sentence), sentence


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"grade": "consumer", "gyro_correlation_time_s": 60.0},
        {"gyro_instability_deg_h": 0.1, "gyro_correlation_time_s": 60.0},
        {"gyro_bias_temperature_sigma_deg_h_per_c": 0.01, "temperature_start_c": -10.0, "warm_up_time_s": 60.0},
        {"gyro_bias_temperature_deg_h_per_c": [0.0, 0.0, 0.0]},
        {"faults": [{"type": "dropout", "from_s": 5.0}, {"type": "spike", "at_s": 5.0, "accel_mm_s": [1.0, 0.0, 0.0]}]},
    ],
)
def test_the_others_are_not(keys: dict[str, Any]) -> None:
    assert list(keys_without_effect(Imu.model_validate(keys), 100.0)) == []
