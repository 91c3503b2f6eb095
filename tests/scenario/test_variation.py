"""The keys that an ensemble varies: what is refused, by key, value and what is right."""

from __future__ import annotations

import pytest

from sinssim.errors import InputError
from sinssim.scenario.load import load_scenario
from sinssim.scenario.plan_summary import plan_lines
from sinssim.scenario.schema import Scenario

HEAD = """\
name = "standing"
[parked]
latitude_deg = 50.0
duration_s = 60.0
[[ensemble.vary]]
"""


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ('type = "uniform"\nkey = "parked.headin_deg"\nlow = 0.0\nhigh = 1.0', ("parked.headin_deg", "'heading_deg'")),
        ('type = "normal"\nkey = "imu.grade"\nmean = 0.0\nsigma = 1.0', ("imu.grade", "not a number")),
        ('type = "normal"\nkey = "imu"\nmean = 0.0\nsigma = 1.0', ("a table, not a number",)),
        ('type = "choice"\nkey = "seed"\nvalues = [1, 2]', ("'seed' cannot be varied", "ensemble's seed")),
        ('type = "choice"\nkey = "ensemble.runs"\nvalues = [1, 2]', ("does not vary itself",)),
        ('type = "normal"\nkey = "flight.start.heading_deg"\nmean = 0.0\nsigma = 1.0', ("no value for flight",)),
        (
            'type = "normal"\nkey = "imu.gyro_bias_deg_h"\nmean = 0.0\nsigma = 1.0',
            ("write gyro_bias_deg_h = [0.0, 0.0, 0.0] in [imu]", "imu.gyro_bias_deg_h.1 to", "gyro_bias_sigma_deg_h"),
        ),
        (
            'type = "normal"\nkey = "imu.accel_bias_ug.2"\nmean = 0.0\nsigma = 1.0',
            ("no value for imu.accel_bias_ug: write accel_bias_ug = [0.0, 0.0, 0.0] in [imu]",),
        ),
        (
            'type = "normal"\nkey = "navigation.rates_hz.2"\nmean = 0.0\nsigma = 1.0',
            ("give rates_hz its 3 numbers in [navigation] first",),
        ),
        ('type = "normal"\nkey = "parked.heading_deg.1"\nmean = 0.0\nsigma = 1.0', ("a value, not a table",)),
        ('type = "uniform"\nkey = "parked.heading_deg"\nlow = 0.0\nhigh = 900.0', ("high = 900", "at most 360")),
        ('type = "uniform"\nkey = "parked.heading_deg"\nlow = 9.0\nhigh = 9.0', ("low = 9", "less than high")),
        ('type = "normal"\nkey = "parked.heading_deg"\nmean = 0.0\nsigma = -1.0', ("sigma = -1.0", "greater than 0")),
        ('type = "normal"\nkey = "parked.heading_deg"\nmean = nan\nsigma = 1.0', ("mean", "finite")),
        ('type = "choice"\nkey = "parked.duration_s"\nvalues = []', ("values", "at least 1")),
        ('type = "choice"\nkey = "parked.duration_s"\nvalues = [10.0, -5.0]', ("values.2 = -5", "greater than 0")),
        (
            'type = "choice"\nkey = "parked.duration_s"\nvalues = [1, "x"]',
            ("vary.1.values.2 must be a number, not the text 'x'.",),
        ),
        (
            'type = "choice"\nkey = "parked.duration_s"\nvalues = [true]',
            ("vary.1.values.1 must be a number, not true.",),
        ),
        ('type = "lognormal"\nkey = "parked.heading_deg"', ("'lognormal'", "normal, uniform, choice")),
    ],
)
def test_refused_by_name(table: str, words: tuple[str, ...], tmp_path) -> None:
    file = tmp_path / "s.toml"
    file.write_text(HEAD + table + "\n", encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_scenario(file)
    for word in ("ensemble", *words):
        assert word in str(error.value)


def test_a_key_twice(tmp_path) -> None:
    file = tmp_path / "s.toml"
    table = 'type = "uniform"\nkey = "parked.heading_deg"\nlow = 0.0\nhigh = 1.0\n'
    file.write_text(f"{HEAD}{table}[[ensemble.vary]]\n{table}", encoding="utf-8")
    with pytest.raises(InputError, match="twice"):
        load_scenario(file)


def test_an_unknown_solution(tmp_path) -> None:
    file = tmp_path / "s.toml"
    file.write_text(HEAD.replace("[[ensemble.vary]]", '[ensemble]\nsolution = "aided"'), encoding="utf-8")
    with pytest.raises(InputError, match=r"ensemble\.solution: unknown solution 'aided'"):
        load_scenario(file)


def test_contents_make_an_equal_scenario(tmp_path) -> None:
    file = tmp_path / "s.toml"
    table = 'type = "uniform"\nkey = "parked.heading_deg"\nlow = 0.0\nhigh = 1.0\n'
    file.write_text(HEAD + table, encoding="utf-8")
    scenario = load_scenario(file)
    assert Scenario.model_validate(scenario.contents()) == scenario


def test_check_shows_what_varies(tmp_path) -> None:
    file = tmp_path / "s.toml"
    table = 'type = "uniform"\nkey = "parked.heading_deg"\nlow = 0.0\nhigh = 1.5\n'
    file.write_text(HEAD + table, encoding="utf-8")
    lines = list(plan_lines(load_scenario(file)))
    assert any(line.startswith("ensemble    runs = 1000") for line in lines)
    assert "  varied    parked.heading_deg: uniform, low = 0, high = 1.5" in lines


def test_what_the_refusal_says_to_write_is_accepted(tmp_path) -> None:
    file = tmp_path / "s.toml"
    table = 'type = "normal"\nkey = "imu.gyro_bias_deg_h.1"\nmean = 0.0\nsigma = 1.0\n'
    file.write_text(HEAD + table + "[imu]\ngyro_bias_deg_h = [0.0, 0.0, 0.0]\n", encoding="utf-8")
    assert load_scenario(file).ensemble.vary[0].key == "imu.gyro_bias_deg_h.1"
    file.write_text(HEAD + table.replace("h.1", "h") + "[imu]\ngyro_bias_deg_h = [0.0, 0.0, 0.0]\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"has 3 entries; vary one of them: imu\.gyro_bias_deg_h\.1 to "):
        load_scenario(file)
