"""Texts of scenarios in the workbench: mistakes beside their lines, the plan, keys with units and values."""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from sinssim.cli.app import main
from sinssim.cli.workbench_scenario import (
    checked_text,
    found_by_command,
    keys_of_scenarios,
    plan_html,
    unit_of,
)
from tests.scenario.examples import FLIGHT, PARKED

FILE = Path("/nowhere/mine.toml")


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (PARKED.replace("rate_hz", "rate_khz"), 8, "use 'rate_hz' (rate_hz = 20000)"),
        (PARKED.replace("latitude_deg = 56.0", "latitude_deg = 156.0"), 4, "must be at most 90"),
        (PARKED.replace("[imu]", "[imu"), 7, "TOML syntax"),
        (PARKED + "[filter]\n", 9, "filter"),
        (FLIGHT.replace('"737"', '"739"'), 5, "Did you mean '737'?"),
        (FLIGHT.replace("altitude_m = 4000.0", "altitude_m = 19000.0"), 14, "ceiling"),
        ("", 0, "exactly one of [flight], [parked]"),
    ],
)
def test_a_mistake_is_at_its_line(text: str, line: int, words: str) -> None:
    (mistake, *_) = checked_text(text, FILE)["mistakes"]
    assert mistake["line"] == line
    assert words in mistake["text"]
    assert "mine.toml" not in mistake["text"]


def test_all_mistakes_of_a_text() -> None:
    text = PARKED.replace("rate_hz = 20.0", "rate_hz = -20.0\nsed = 3").replace("20.0\n\n", '"long"\n\n')
    assert [(found["line"], found["text"].split()[0]) for found in checked_text(text, FILE)["mistakes"]] == [
        (5, "parked.duration_s"), (8, "imu.rate_hz"), (9, "unknown"),
    ]  # fmt: skip


def test_a_line_that_is_being_written_hides_no_other_mistakes() -> None:
    text = PARKED.replace("rate_hz", "rate_khz").replace("[parked]", "[parked]\nlongi")
    found = checked_text(text, FILE)["mistakes"]
    assert [(mistake["line"], mistake["text"].split()[0]) for mistake in found] == [(4, "TOML"), (9, "unknown")]
    found = checked_text(PARKED.replace("[imu]", "x[imu]"), FILE)["mistakes"]  # a header: what follows is unknown
    assert [mistake["line"] for mistake in found] == [7]


def test_the_plan_is_that_of_the_command(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(FLIGHT)
    printed = io.StringIO()
    with redirect_stdout(printed), pytest.raises(SystemExit):
        main(["check", str(file)])
    found = checked_text(FLIGHT, file)
    assert found == {"mistakes": [], "plan": printed.getvalue().splitlines(), "left": ""}


def test_studies() -> None:
    """Two algorithms at two rates are four navigations; two axes of two and three values, six cells."""
    part = '[[parts]]\ntitle = "one"\nalgorithms = ["euler", "quaternion"]\nrates_hz = [50.0, 100.0]\n'
    text = part + "[[parts.motions]]\nparked = { latitude_deg = 50.0, duration_s = 5.0 }\n"
    found = checked_text(text, FILE)
    assert found["plan"] == ["study       mine", "part        one: 4 navigations of each motion"]
    assert plan_html(text, FILE, 600.0) == ""
    trade = 'scenario = "parked"\n[[axes]]\nkey = "imu.rate_hz"\nvalues = [50.0, 100.0]\n'
    trade += '[[axes]]\nkey = "imu.grade"\nvalues = ["ideal", "tactical", "mems"]\n'
    cells = "cells       6, each a budget: imu rate (2) × grade (3)"
    assert checked_text(trade, FILE)["plan"] == ["study       mine", "scenario    parked", cells]
    (mistake,) = checked_text(text.replace("rates_hz", "rate_hz"), FILE)["mistakes"]
    assert mistake["line"] == 4
    assert "rates_hz" in mistake["text"]
    used = checked_text('use = ["mine"]\n' + text, FILE)
    assert (used["plan"], "not run while you write" in used["left"]) == ([], True)


def test_a_text_without_a_name_has_that_of_its_file() -> None:
    assert checked_text(PARKED.replace('name = "standing"\n', ""), FILE)["plan"][0].startswith("mine")


def test_the_findings_of_the_command() -> None:
    output = "WARNING: something\nsinssim: mine.toml: 2 mistakes:\n  - line 3: a is b.\n  - imu.rate_hz is c.\n"
    assert found_by_command(output, 2, "mine.toml", PARKED)["mistakes"] == [
        {"line": 3, "text": "a is b."}, {"line": 8, "text": "imu.rate_hz is c."},
    ]  # fmt: skip
    assert found_by_command("one\ntwo", 0, "mine.toml", PARKED)["plan"] == ["one", "two"]


def test_code_of_the_scenario_is_not_run(tmp_path: Path) -> None:
    (tmp_path / "algorithms").mkdir()
    (tmp_path / "aiding").mkdir()
    for kind in ("algorithms", "aiding"):
        (tmp_path / kind / "mine.py").write_text(f"open({str(tmp_path / 'was_run')!r}, 'w')\n")
    text = f'use = ["."]\n{PARKED}[navigation]\nalgorithms = ["mine"]\n'.replace('name = "standing"\n', "")
    found = checked_text(text, tmp_path / "mine.toml")
    assert found["mistakes"] == found["plan"] == []
    assert "press Check" in found["left"]
    assert plan_html(text, tmp_path / "mine.toml", 700.0) == ""
    assert not (tmp_path / "was_run").exists()


def test_recorded_files_are_left_to_the_command() -> None:
    file = Path(__file__).parents[2] / "data" / "drive" / "drive.toml"
    assert checked_text(file.read_text(), file)["left"].startswith("The recorded files")


WAYPOINTS = """
[track]
vehicle = "land"

[[track.waypoints]]
latitude_deg = 50.0
longitude_deg = 14.0
height_m = 200.0
speed_mps = 20.0
name = "<img src=x onerror=alert(1)>"

[[track.waypoints]]
latitude_deg = 50.1
longitude_deg = 14.1
height_m = 200.0

[imu]
rate_hz = 50.0
"""


def test_the_plan_is_drawn_and_names_are_texts() -> None:
    html = plan_html(WAYPOINTS, FILE, 400.0)
    assert html.count('<figure class="live_map"') == 1
    assert html.count('<figure class="live"') == 2  # height and speed
    assert "&lt;img src=x" in html
    assert "<img" not in html
    assert plan_html(WAYPOINTS.replace("50.1", "150.0"), FILE, 400.0) == ""


@pytest.mark.parametrize(
    ("key", "unit"),
    [("gyro_arw_deg_sqrt_h", "°/√h"), ("accel_vrw_ug_sqrt_hz", "µg/√Hz"), ("rate_hz", "Hz"), ("speed_mps", "m/s"),
     ("velocity_ned_mps", "m/s"), ("acceleration_mps2", "m/s²"), ("gyro_bias_deg_h", "°/h"), ("seed", ""), ("s", ""),
     ("gyro_g_sensitivity_deg_h_per_g", "°/h/g"), ("position_sigma_arcsec", "″"), ("gyro_axis", ""),
     ("accel_quadratic_ug_per_g2", "µg/g²"), ("gyro_bias_temperature_deg_h_per_c", "°/h/°C")],
)  # fmt: skip
def test_a_unit_is_written_as_usual(key: str, unit: str) -> None:
    assert unit_of(key) == unit


def test_keys_with_unit_default_sentence_and_values() -> None:
    tables = keys_of_scenarios()
    (imu,) = [table for table in tables if table["path"] == "imu"]
    keys = {key["name"]: key for key in imu["keys"]}
    assert keys["rate_hz"]["unit"] == "Hz"
    assert keys["rate_hz"]["default"] == "100.0"
    assert '"laser-standard"' in keys["grade"]["values"]
    assert keys["gyro_bias_deg_h"]["about"]
    legs = {table["tag"]: table for table in tables if table["path"] == "flight.legs"}
    climb = {key["name"]: key for key in legs["climb"]["keys"]}
    assert climb["altitude_m"]["required"]
    assert climb["altitude_m"]["default"] is None
    assert legs["climb"]["array"]
    (navigation,) = [table for table in tables if table["path"] == "navigation"]
    algorithms = next(key for key in navigation["keys"] if key["name"] == "algorithms")
    assert {'"quaternion"', '"euler"'} <= set(algorithms["values"])
