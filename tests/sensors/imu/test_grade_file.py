"""Grades in files: the numbers in SI by hand, the terms in a run, mistakes by line and key, paths of scenarios."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.scenario.load import load_scenario
from sinssim.sensors import draw
from sinssim.sensors.imu.datasheet_lines import in_words
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.grades import find_grade, grade_name
from sinssim.sensors.imu.imu_section import Imu

HEAD = 'description = "the unit of the test"\nsource = "certificate 12 of 3 March 2026"\n'
BODY = """gyro_bias_sigma_deg_s = 0.001
gyro_scale_sigma_percent = 0.05
gyro_misalignment_sigma_mrad = 1
gyro_g_sensitivity_sigma_deg_h_per_g = 1
gyro_arw_deg_sqrt_h = 0.15
gyro_flicker_deg_h = 0.5
gyro_correlation_time_s = 300
gyro_range_deg_s = 400
accel_bias_sigma_mg = 0.75
accel_vrw_mps_sqrt_h = 0.06
"""


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    """Return a grade's file."""
    file = tmp_path / "my_unit.toml"
    file.write_text(HEAD + 'assumed = ["misalignment of the class"]\n' + BODY, encoding="utf-8")
    return file


def test_numbers_in_si_worked_out_by_hand(unit: Path) -> None:
    grade, degree = find_grade(str(unit)), math.pi / 180.0
    assert grade.description == "the unit of the test"
    assert grade.source == (
        "certificate 12 of 3 March 2026; assumed: misalignment of the class; not given and therefore zero: "
        "accel_scale, accel_misalignment"
    )
    gyro, accel = grade.gyro, grade.accel
    assert (gyro.bias, gyro.scale, gyro.misalignment) == pytest.approx((0.001 * degree, 5e-4, 1e-3), rel=1e-14)
    assert (gyro.random_walk, gyro.instability) == pytest.approx((0.15 * degree / 60.0, 0.0), rel=1e-14)
    assert dict(gyro.others) == pytest.approx(
        {
            "g_sensitivity": degree / 3600.0 / 9.80665,
            "flicker": 0.5 * degree / 3600.0,
            "correlation_time": 300.0,
            "limit": 400.0 * degree,
        },
        rel=1e-14,
    )
    assert (accel.bias, accel.random_walk) == pytest.approx((0.75e-3 * 9.80665, 1e-3), rel=1e-14)
    assert (accel.scale, accel.misalignment, accel.instability, dict(accel.others)) == (0.0, 0.0, 0.0, {})


def test_a_file_gives_the_same_errors_as_the_keys_of_imu(unit: Path) -> None:
    keys = dict(line.split(" = ") for line in BODY.splitlines())
    written_out = Imu(grade="ideal", **{key: float(value) for key, value in keys.items()})
    of_file = Imu(grade=str(unit))
    for term in TERMS:
        for one, other in zip(of_file.stated(term), written_out.stated(term), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-14, err_msg=term.name)
    one, other = draw(of_file, 5), draw(written_out, 5)
    np.testing.assert_allclose(one.gyro.g_sensitivity, other.gyro.g_sensitivity, rtol=1e-14)
    assert np.all(one.gyro.g_sensitivity != 0.0)


def test_a_key_of_imu_replaces_that_of_the_file(unit: Path) -> None:
    assert draw(Imu(grade=str(unit), gyro_range_deg_s=100.0)).gyro.limit == pytest.approx(math.radians(100.0))


def test_a_changed_file_is_read_again(unit: Path) -> None:
    assert find_grade(str(unit)).accel.bias == pytest.approx(0.75e-3 * 9.80665)
    unit.write_text(HEAD + "accel_bias_sigma_mg = 11.5\n", encoding="utf-8")
    assert find_grade(str(unit)).accel.bias == pytest.approx(11.5e-3 * 9.80665)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("gyro_arw = 0.1", ["line 3", "gyro_arw_deg_sqrt_h"]),
        ("gyro_bias_repeatability_deg_h = 3", ["line 3", "gyro_bias_sigma_deg_h"]),
        ("gyro_bias_deg_h = [1.0, 1.0, 1.0]", ["line 3", "gyro_bias_sigma_deg_h"]),
        ("accel_vrw_parsec = 3", ["line 3", "accel_vrw cannot be given in 'parsec'", "mps_sqrt_h"]),
        ("gyro_bais_sigma_deg_h = 3", ["line 3", "Did you mean 'gyro_bias_sigma_deg_h'"]),
        ("gyro_bias_sigma_deg_h = -3", ["line 3", "must be at least 0"]),
        ("gyro_bias_sigma_deg_h = 1e9", ["larger than that of any sensor"]),
        ('gyro_bias_sigma_deg_h = "3"', ["line 3", "must be a number"]),
        ("rate_hz = 100", ["rate_hz is not part of a grade", "[imu]"]),
        ("accel_quantum_mm_s = 1", ["accel_quantum_mm_s is not part of a grade"]),
        ("gyro_range_deg_s = 0", ["greater than 0"]),
        ("gyro_bias_sigma_deg_h = 1\ngyro_bias_sigma_deg_s = 1", ["given twice"]),
        ("gyro_bias_sigma_deg_h 1", ["line 3", "TOML syntax"]),
    ],
)
def test_mistakes_by_line_and_key(tmp_path: Path, line: str, said: list[str]) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(HEAD + line + "\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        find_grade(str(file))
    assert "mine.toml" in str(caught.value)
    for words in said:
        assert words in str(caught.value)


def test_a_grade_without_a_source_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('description = "mine"\ngyro_arw_deg_sqrt_h = 1\n', encoding="utf-8")
    with pytest.raises(InputError, match="source is missing"):
        find_grade(str(tmp_path / "mine.toml"))


def test_relative_to_the_scenario_and_its_mistakes_by_its_own_lines(unit: Path, monkeypatch) -> None:
    scenario = unit.parent / "mine.toml"
    scenario.write_text(
        '[parked]\nlatitude_deg = 50.0\nlongitude_deg = 8.0\nduration_s = 5.0\n[imu]\ngrade = "my_unit.toml"\n',
        encoding="utf-8",
    )
    monkeypatch.chdir("/")
    section = load_scenario(scenario).imu
    assert (section.grade, grade_name(section.grade)) == (str(unit), "my_unit")
    master = '[filter]\n[aiding.master]\ngrade = "my_unit.toml"\n'
    scenario.write_text(scenario.read_text(encoding="utf-8") + master, encoding="utf-8")
    aiding = load_scenario(scenario).aiding
    assert aiding is not None
    assert aiding.master.grade == str(unit)
    unit.write_text(HEAD + "gyro_arw = 1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"my_unit\.toml, line 3: unknown key 'gyro_arw'"):
        load_scenario(scenario)
    with pytest.raises(InputError, match=r"there is no grade file '/nowhere/unit\.toml'"):
        load_scenario(scenario, ['imu.grade="/nowhere/unit.toml"'])


@pytest.mark.parametrize(
    ("word", "key"),
    [
        ("gyro_bias_instability_deg_h", "gyro_flicker_deg_h"),
        ("gyro_bias_instability_deg_h", "divided by 0.664"),
        ("accel_in_run_bias_ug", "accel_flicker_ug"),
        ("gyro_in_run_bias_stability_deg_h", "gyro_instability_deg_h"),
        ("gyro_bias_repeatability_deg_h", "gyro_bias_sigma_deg_h"),
        ("accelerometer_bias_repeatability_mg", "accel_bias_sigma_mg"),
        ("gyro_scale_factor_repeatability_ppm", "gyro_scale_sigma_ppm"),
        ("scale_factor_ppm", "gyro_scale_sigma_ppm or accel_scale_sigma_ppm"),
        ("arw_deg_sqrt_h", "gyro_arw_deg_sqrt_h"),
        ("vrw", "accel_vrw_ug_sqrt_hz"),
        ("gyro_noise_density_deg_s_sqrt_hz", "gyro_arw_deg_s_sqrt_hz"),
        ("noise_density", "gyro_arw_deg_s_sqrt_hz or accel_vrw_mps_sqrt_h"),
        ("gyro_g_sensitivity", "gyro_g_sensitivity_sigma_deg_h_per_g"),
        ("gyro_g2_term", "sinssim has no error of gyros in the square of the acceleration"),
        ("accel_g2_term_ug_per_g2", "accel_quadratic_sigma_ug_per_g2"),
        ("axis_misalignment_mrad", "gyro_misalignment_sigma_mrad or accel_misalignment_sigma_mrad"),
        ("gyro_non_linearity_ppm", "gyro_quadratic_sigma_ppm_per_deg_s"),
    ],
)
def test_words_of_data_sheets_name_their_key(word: str, key: str) -> None:
    assert key in str(in_words(word, Imu.model_fields))
    with pytest.raises(InputError) as caught:
        Imu(**{word: 1.0})
    assert key in str(caught.value)


def test_every_key_in_an_answer_is_known() -> None:
    for word in ("bias_stability", "bias", "scale_factor", "noise", "tco", "tcs", "range", "resolution", "rrw", "k2"):
        for triad in ("gyro", "accel"):
            answer = str(in_words(f"{triad}_{word}", Imu.model_fields))
            keys = [key.strip(",:;") for key in answer.split() if key.startswith(triad)]
            assert keys
            assert all(key in Imu.model_fields or key.endswith(("_hz", "_h")) for key in keys), answer


def test_other_words_have_no_answer() -> None:
    assert in_words("gyro_colour", Imu.model_fields) is None
    assert in_words("noise_density", ("latency_s",)) is None
