"""A key with another unit is answered by the right key and the converted number; factors of published definitions."""

from __future__ import annotations

import math

import pytest

from sinssim.errors import InputError
from sinssim.scenario.load import load_scenario

TURN = 180.0 / math.pi


@pytest.mark.parametrize(
    ("scenario", "key", "value", "right", "converted"),
    [
        ("parked", "parked.duration_min", 7.0, "duration_s", 420.0),
        ("parked", "parked.duration_h", 1.5, "duration_s", 5400.0),
        ("parked", "parked.duration_ms", 1500.0, "duration_s", 1.5),
        ("parked", "parked.altitude_km", 2.5, "altitude_m", 2500.0),
        ("parked", "parked.altitude_nmi", 3.0, "altitude_m", 5556.0),
        ("parked", "parked.altitude_ft", 7.0, "altitude_m", 2.1336),
        ("parked", "parked.latitude_rad", 0.5, "latitude_deg", 0.5 * TURN),
        ("parked", "parked.latitude_mrad", 20.0, "latitude_deg", 0.02 * TURN),
        ("parked", "parked.heading_arcmin", 90.0, "heading_deg", 1.5),
        ("parked", "parked.heading_arcsec", 900.0, "heading_deg", 0.25),
        ("parked", "imu.rate_khz", 0.4, "rate_hz", 400.0),
        ("parked", "navigation.initial_error.tilt_sigma_deg", 0.5, "tilt_sigma_arcmin", 30.0),
        ("parked", "navigation.initial_error.velocity_north_kt", 2.0, "velocity_north_mps", 3704.0 / 3600.0),
        ("parked", "navigation.initial_error.velocity_north_kmh", 9.0, "velocity_north_mps", 2.5),
        ("parked", "navigation.initial_error.velocity_north_fps", 3.0, "velocity_north_mps", 0.9144),
        ("parked", "navigation.initial_error.velocity_north_fpm", 300.0, "velocity_north_mps", 1.524),
        ("one_component", "one_component.accelerometer_x.bias_mg", 0.3, "bias_ug", 300.0),
        ("one_component", "one_component.accelerometer_x.scale_percent", 0.2, "scale_ppm", 2000.0),
        ("one_component", "one_component.gyro.bias_deg_s", 0.25, "bias_deg_h", 900.0),
        ("one_component", "one_component.gyro.bias_rad_s", 1e-6, "bias_deg_h", 3600e-6 * TURN),
    ],
)
def test_the_right_key_and_the_converted_number(
    scenario: str, key: str, value: float, right: str, converted: float
) -> None:
    with pytest.raises(InputError) as error:
        load_scenario(scenario, [f"{key}={value}"])
    text = str(error.value)
    assert f"unknown key '{key}': the unit is part of the name, use '{right}' ({right} = " in text
    number = float(text.partition(f"use '{right}' ({right} = ")[2].partition(")")[0])
    assert number == pytest.approx(converted, rel=1e-9)
