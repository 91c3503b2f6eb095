"""Words for keys and values."""

from __future__ import annotations

import tomllib

import pytest

from sinssim.experiments.studies.trade_schema import label_of, toml_text, unit_of, value_text


@pytest.mark.parametrize(
    ("key", "label", "unit"),
    [
        ("imu.gyro_bias_sigma_deg_h", "gyro bias σ", "deg/h"),
        ("imu.gyro_arw_deg_sqrt_h", "gyro arw", "deg/√h"),
        ("imu.accel_vrw_ug_sqrt_hz", "accel vrw", "µg/√Hz"),
        ("imu.gyro_g_sensitivity_deg_h_per_g", "gyro g sensitivity", "deg/h/g"),
        ("imu.grade", "grade", ""),
        ("seed", "seed", ""),
        ("aiding.gnss.position_sigma_m", "gnss position σ", "m"),
        ("imu.rate_hz", "imu rate", "Hz"),
        ("flight.legs.2.altitude_m", "legs 2 altitude", "m"),
        ("filter.rate_hz", "filter rate", "Hz"),
        ("navigation.initial_error.heading_sigma_arcmin", "initial error heading σ", "arcmin"),
    ],
)
def test_label_and_unit(key: str, label: str, unit: str) -> None:
    assert (label_of(key), unit_of(key)) == (label, unit)


@pytest.mark.parametrize(
    "value",
    [1, -2.5, 1e-300, 0.1 + 0.2, True, False, "a word", 'quotes " and \\ and \n', [1.0, [2, 3]], {"a b": 1, "c": ["x"]},
     "ü\x7f\x01", []],
)  # fmt: skip
def test_toml_loads_back(value: object) -> None:
    text = toml_text(value)
    assert "\n" not in text
    assert tomllib.loads(f"value = {text}")["value"] == value


def test_values_as_people_read_them() -> None:
    assert [value_text(v) for v in (0.01, -3, True, "tactical", (1.0, 2.5))] == [
        "0.01",
        "−3",
        "on",
        "tactical",
        "[1, 2.5]",
    ]
