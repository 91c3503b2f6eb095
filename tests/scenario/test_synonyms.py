"""Other words for keys, sensors, grades and units lead to those of sinssim; height is understood everywhere."""

from __future__ import annotations

import pytest

from sinssim.errors import InputError, nearest, respelled
from sinssim.scenario import load_scenario


def mistake(scenario: str, setting: str) -> str:
    with pytest.raises(InputError) as error:
        load_scenario(scenario, [setting])
    return str(error.value)


@pytest.mark.parametrize(
    ("scenario", "setting", "meant"),
    [
        ("voyage", "track.waypoints.1.altitude_m=3", "'track.waypoints.1.height_m'?"),
        ("voyage", "track.waypoints.1.altitude_ft=3", "use 'height_m' (height_m = 0.9144)"),
        ("parked", "parked.elevation_m=3", "'parked.altitude_m'?"),
        ("parked", "parked.height_ft=1000", "use 'altitude_m' (altitude_m = 304.8)"),
        ("aided_airliner", "aiding.barometer.rate_hz=1", "'aiding.baro'?"),
        ("aided_airliner", "aiding.compass.rate_hz=1", "'aiding.magnetometer'?"),
        ("aided_airliner", "aiding.gps.rate_hz=1", "'aiding.gnss'?"),
        ("parked", "imu.grade=STIM300", "'stim300'?"),
        ("parked", "imu.grade=HG-1700", "'hg1700'?"),
        ("parked", "imu.gyro_bias_in_run_stability_deg_h=1", "it is gyro_flicker_deg_h, the lowest point"),
        ("parked", "imu.gyro_bias_in_run_stability_deg_per_hr=1", "it is gyro_flicker_deg_h, the lowest point"),
        ("parked", "imu.gyro_bias_deg_hr=1", "'imu.gyro_bias_deg_h'?"),
        ("parked", "imu.gyro_bias_sigma_deg_per_hr=1", "'imu.gyro_bias_sigma_deg_h'?"),
        ("parked", "imu.gyro_arw_deg_rt_hr=1", "'imu.gyro_arw_deg_sqrt_h'?"),
        ("parked", "imu.gyro_arw_deg_per_root_hour=1", "'imu.gyro_arw_deg_sqrt_h'?"),
        ("parked", "parked.duration_seconds=3", "'parked.duration_s'?"),
        ("parked", "navigation.algorithms=quaternion", """--set 'navigation.algorithms=["quaternion"]'"""),
    ],
)
def test_other_words_lead_to_the_right_one(scenario: str, setting: str, meant: str) -> None:
    assert meant in mistake(scenario, setting)


def test_the_hints_can_be_followed() -> None:
    """What a message tells the user to write is accepted."""
    load_scenario("voyage", ["track.waypoints.1.height_m=3"])
    settings = ["imu.grade=stim300", "imu.gyro_arw_deg_sqrt_h=0.1", "imu.gyro_flicker_deg_h=1.0"]
    assert load_scenario("parked", [*settings, 'navigation.algorithms=["quaternion"]']).imu.gyro_arw_deg_sqrt_h == 0.1


@pytest.mark.parametrize(
    ("scenario", "table"),
    [("parked", "parked"), ("closure", "flight.start"), ("drive", "track.waypoints.1")],
)
def test_height_is_understood_everywhere(scenario: str, table: str) -> None:
    """`height_m` is a key of every table with a height; the former keys stay, and the files keep them."""
    found: object = load_scenario(scenario, [f"{table}.height_m=123.0"])
    for name in table.split("."):
        found = found[int(name) - 1] if name.isdecimal() else getattr(found, name)  # type: ignore[index]
    assert getattr(found, "altitude_m", None) == 123.0 or getattr(found, "height_m", None) == 123.0


def test_a_height_under_two_names_is_refused() -> None:
    from sinssim.truth.motions.parked_and_great_circle import ParkedVehicle

    with pytest.raises(InputError, match="height_m and altitude_m are one quantity: keep one of them"):
        ParkedVehicle(latitude_deg=50.0, duration_s=1.0, height_m=1.0, altitude_m=2.0)


def test_words_and_spellings() -> None:
    assert respelled("Gyro ARW [deg/rt-hr]") == "gyro_arw_deg_sqrt_h"
    assert respelled("time_ms") == "time_ms"  # milliseconds are no speed
    assert nearest("", ["a", "b"]) is None
    assert nearest("xyz", ["a", "b"]) is None
