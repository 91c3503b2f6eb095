"""What height goes by where a scenario does not say, and in what words it is told."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim import Scenario, run
from sinssim.scenario.navigation_section import NavigationSection
from sinssim.scenario.notes import height_words
from sinssim.scenario.plan_summary import plan_lines

CIRCLE = {"latitude_deg": 45.0, "course_deg": 60.0, "speed_mps": 230.0, "altitude_m": 9000.0, "duration_s": 3960.0}
FLIGHT = {"aircraft": "737", "start": {"on": "air", "latitude_deg": 50.0, "longitude_deg": 14.0, "altitude_m": 5000.0,
          "heading_deg": 0.0}, "legs": [{"type": "hold", "duration_s": 60.0}]}  # fmt: skip
PARKED = {"latitude_deg": 45.0, "duration_s": 60.0}
CONING = {"type": "coning", "half_angle_deg": 1.0, "frequency_hz": 5.0, "duration_s": 10.0}
BARO, BOTH = {"baro": {}}, {"baro": {}, "gnss": {}}


def scenario(**tables: Any) -> Scenario:
    return Scenario.model_validate({"name": "height", **tables})


@pytest.mark.parametrize(
    ("tables", "vertical", "words"),
    [
        ({"flight": FLIGHT}, "baro-loop", "perfect altimeter"),
        ({"great_circle": CIRCLE}, "baro-loop", "perfect altimeter"),
        ({"great_circle": CIRCLE, "navigation": {"frame": "inertial"}}, "baro-loop", "perfect altimeter"),
        ({"great_circle": CIRCLE, "aiding": {"gnss": {}}, "filter": {}}, "baro-loop", "perfect altimeter"),
        ({"great_circle": CIRCLE, "aiding": BARO}, "baro-loop", "that of [aiding.baro]"),
        ({"flight": FLIGHT, "aiding": BOTH, "filter": {}}, "baro-loop", "that of [aiding.baro]"),
        ({"parked": PARKED, "aiding": BARO}, "baro-loop", "that of [aiding.baro]"),
        ({"parked": PARKED}, "free", "grow e-fold in 9.5 min"),
        ({"parked": PARKED, "aiding": {"gnss": {}}, "filter": {}}, "free", "grow e-fold"),
        ({"motion": CONING}, "free", "grow e-fold"),
        ({"great_circle": CIRCLE, "navigation": {"vertical": "free"}}, "free", "degrade the horizontal solution, too"),
        ({"flight": FLIGHT, "navigation": {"vertical": "truth"}}, "truth", "the true height: the height has no error"),
    ],
)
def test_height_is_held_in_the_air_and_where_a_barometer_is(tables: dict, vertical: str, words: str) -> None:
    found = scenario(**tables)
    assert found.navigation.vertical == vertical
    assert words in height_words(found)
    assert any(line.startswith("height      ") and words in line for line in plan_lines(found))
    assert f'vertical = "{vertical}"' in found.to_toml()


def test_a_section_that_is_built_in_python_is_filled_in_too() -> None:
    navigation = NavigationSection(algorithms=("poisson",))
    assert scenario(great_circle=CIRCLE, navigation=navigation).navigation.vertical == "baro-loop"
    told = NavigationSection(vertical="free")
    assert scenario(great_circle=CIRCLE, navigation=told).navigation.vertical == "free"


def test_an_hour_of_a_navigation_grade_unit_stays_in_its_class() -> None:
    """66 min with laser-navigation: free, the height is off by some 100 km, and the horizontal by miles."""
    table = {"great_circle": CIRCLE, "imu": {"grade": "laser-navigation", "rate_hz": 10.0}, "seed": 4}
    by_default = run(scenario(**table)).summary["algorithms"]["quaternion"]
    free = run(scenario(**table, navigation={"vertical": "free"})).summary["algorithms"]["quaternion"]
    assert by_default["max_height_error_m"] < 10.0
    assert by_default["max_horizontal_error_m"] < 1852.0
    assert free["max_height_error_m"] > 100.0 * by_default["max_height_error_m"]
