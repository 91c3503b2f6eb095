"""The [one_component] table: its defaults, and the mistakes that it names."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.plan_summary import plan_lines
from sinssim.scenario.true_motion import fly

PLAIN: dict[str, Any] = {"variant": "one-integral", "duration_s": 100.0, "gyro": {}}
ARM = {"variant": "two-integrals", "duration_s": 100.0}


def made(**keys: Any) -> Scenario:
    return Scenario(name="x", one_component=keys)


def test_little_has_to_be_said() -> None:
    section = made(**PLAIN).one_component
    assert section is not None
    assert (section.rate_hz, section.radius_m, section.gravity_mps2) == (20.0, 6371000.0, 9.81)
    assert section.motion.velocity_mps == ((0.0, 0.0),)
    assert not section.altitude_effects


def test_written_scenario_has_no_table_of_three_dimensions_and_loads_back() -> None:
    scenario = load_scenario("one_component")
    text = scenario.to_toml()
    assert {"one_component", "recording"} == {
        name for name, value in tomllib.loads(text).items() if isinstance(value, dict)
    }
    assert Scenario.model_validate(tomllib.loads(text)) == scenario


def test_plan() -> None:
    lines = list(plan_lines(load_scenario("one_component", "one_component.altitude_effects=true")))
    assert "pitch by one integral of a gyro's rate" in lines[1]
    assert "velocity           0 to 230 m/s, 6 rows" in lines
    assert "gyro               bias_deg_h = -0.01" in lines
    assert any("160,000 samples; the Schuler period is 84.39 min" in line for line in lines)
    assert any(line.startswith("altitude") for line in lines)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (
            {"variant": "measured", "duration_s": 1.0},
            r'"measured" needs the table \[one_component.attitude_s',
        ),
        ({"variant": "one-integral", "duration_s": 1.0}, r"needs the table \[one_component.gyro\]"),
        (ARM, r"needs the table \[one_component.arm_accelerometer\]: add it, with arm_m"),
        (ARM | {"arm_accelerometer": {}}, "arm_m is missing"),
        (ARM | {"arm_accelerometer": {"arm_m": 0.0}}, "arm_m = 0 gives no angular acceleration; give a distance of at"),
        (PLAIN | {"attitude_sensor": {}}, r'\[one_component.attitude_sensor\] is the sensor of variant = "measured"'),
        (PLAIN | {"initial_error": {"rate_deg_h": 1.0}}, r"rate_deg_h = 1 has no effect with variant = .one-integral"),
        (
            {"variant": "measured", "duration_s": 9.0, "attitude_sensor": {}, "initial_error": {"pitch_arcmin": 2.0}},
            "pitch_arcmin = 2 has no effect .*: give attitude_sensor.bias_arcsec",
        ),
        (PLAIN | {"motion": {"velocity_mps": "fast"}}, "velocity_mps: give a number, or rows of time in s and value"),
        (PLAIN | {"motion": {"velocity_mps": [0.0, 5.0]}}, r"velocity_mps: row 1 must be time in s and value"),
        (PLAIN | {"motion": {"velocity_mps": []}}, "velocity_mps must have at least 1 entry"),
        (PLAIN | {"motion": {"velocity_mps": 13_000.0}}, "the value 13000 of row 1 must be from -12000 to 12000"),
        (PLAIN | {"motion": {"height_m": [[5.0, 0.0]]}}, "the first row is at 5 s; it must be at 0 s"),
        (PLAIN | {"motion": {"height_m": [[0.0, 0.0], [0.0, 1.0]]}}, "row 2 at 0 s must be at least 0.001 s after row"),
        (
            PLAIN | {"motion": {"pitch_deg": [[0.0, 0.0], [50.0, 1.0]]}},
            "motion.pitch_deg ends at 50 s, before the run, at duration_s = 100: add a row",
        ),
        (PLAIN | {"gravity_mps2": 0.0}, "gravity_mps2 = 0.0 must be at least 0.001"),
        (PLAIN | {"rate_hz": 0.0}, "rate_hz = 0.0 must be at least 1e-06"),
        (PLAIN | {"rate_hz": 0.01}, "rate_hz = 0.01 gives intervals of 100 s, .* period of 5063.* at least 0.0197"),
        (PLAIN | {"variant": "both"}, "variant = 'both' is not known. Known: measured, one-integral, two-integrals"),
    ],
)
def test_mistakes(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        made(**keys)


def test_no_table_of_three_dimensions_beside_it(tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_text('[one_component]\nvariant = "one-integral"\nduration_s = 9.0\n[one_component.gyro]\n')
    assert load_scenario(file).one_component is not None
    with pytest.raises(InputError, match=r"\[imu\] and \[navigation\] do not apply to \[one_component\]"):
        load_scenario(file, ["imu.rate_hz=50", 'navigation.frame="level"'])
    with pytest.raises(InputError, match=r"there are \[parked\] and \[one_component\]"):
        load_scenario(file, ["parked.latitude_deg=50", "parked.duration_s=9"])


def test_too_short_and_too_long() -> None:
    with pytest.raises(InputError, match=r"gives no sample in a run of 0.01 s; at least 100 would give one"):
        list(plan_lines(made(**PLAIN | {"duration_s": 0.01})))
    with pytest.raises(InputError, match=r"GB of memory; this machine has .* GB. Use at most"):
        list(plan_lines(made(**PLAIN | {"duration_s": 1e9, "rate_hz": 1e6})))


def test_it_is_no_motion_for_other_uses() -> None:
    with pytest.raises(InputError, match=r"has \[one_component\], a motion in a vertical plane"):
        fly(made(**PLAIN))
