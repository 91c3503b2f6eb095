"""The functions of the package take a scenario, its file or its name, settings, and show progress when asked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError

SHORT = ["parked.duration_s=20", "imu.rate_hz=10", "seed=5"]


def test_a_name_a_file_and_a_scenario_give_the_same_run(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(sinssim.load_scenario("parked", SHORT).to_toml(), encoding="utf-8")
    runs = [
        sinssim.run("parked", overrides=SHORT),
        sinssim.run(file),
        sinssim.run(str(file)),
        sinssim.run(sinssim.load_scenario("parked"), overrides=SHORT),
        sinssim.run(sinssim.load_scenario("parked", SHORT)),
    ]
    first = runs[0].solutions["quaternion"]
    assert len(first.time) == 201
    for other in runs[1:]:
        np.testing.assert_array_equal(other.solutions["quaternion"].latitude, first.latitude)
    longer = sinssim.run(file, overrides="parked.duration_s=30")  # a single setting needs no list
    assert longer.solutions["quaternion"].time[-1] == 30.0


def test_ensembles_and_budgets_take_a_name_too() -> None:
    by_name = sinssim.ensemble("parked", 3, overrides=SHORT, threads=1)
    by_scenario = sinssim.ensemble(sinssim.load_scenario("parked", SHORT), 3, threads=1)
    np.testing.assert_array_equal(by_name.errors.position_ned, by_scenario.errors.position_ned)
    budget = sinssim.budget("parked", overrides=SHORT)
    assert budget.time[-1] == 20.0


@pytest.mark.parametrize("function", [sinssim.run, sinssim.ensemble, sinssim.budget, sinssim.calibrate, sinssim.align])
@pytest.mark.parametrize(
    ("scenario", "overrides", "message"),
    [
        (None, (), "scenario = None must be a Scenario, or its file or name"),
        ("parkd", (), "Did you mean"),
        ("parked", ["imu.rate=1"], "imu.rate"),
        ("parked", [3], "overrides = [3] must be a list of settings"),
    ],
)
def test_what_is_no_scenario_is_refused(function: Any, scenario: Any, overrides: Any, message: str) -> None:
    with pytest.raises(InputError) as info:
        function(scenario, overrides=overrides)
    assert message in str(info.value)


@pytest.mark.parametrize(
    ("function", "source"),
    [(sinssim.run, "parked"), (sinssim.ensemble, "parked"), (sinssim.budget, "parked"), (sinssim.align, "parked"),
     (sinssim.calibrate, "calibration_table"), (sinssim.compare, "gyro_trade")],
)  # fmt: skip
def test_settings_are_no_directory(function: Any, source: str) -> None:
    with pytest.raises(InputError, match=r"directory = \['seed=3'\] must be a path; settings .*, as overrides"):
        function(source, directory=["seed=3"])


def test_a_loaded_scenario_names_the_wrong_setting() -> None:
    with pytest.raises(InputError, match=r"parked: imu\.rate_hz = -3 must be .* \(set from outside the file\)"):
        sinssim.run(sinssim.load_scenario("parked"), overrides=["imu.rate_hz=-3"])


def test_overrides_belong_to_the_file_of_a_study() -> None:
    from sinssim.experiments.study import load_study

    study = load_study("gyro_trade")
    with pytest.raises(InputError, match="overrides change the file of a study"):
        sinssim.compare(study, overrides=["axes.1.values=[1.0]"])


def test_progress_is_shown_if_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    sinssim.run("parked", overrides=SHORT)
    assert capsys.readouterr().err == ""
    sinssim.run("parked", overrides=SHORT, progress=True)
    shown = capsys.readouterr().err
    assert "Navigating" in shown
    assert "100%" in shown


def test_progress_is_a_function_or_true() -> None:
    progress: Any = "yes"
    with pytest.raises(InputError, match="progress = 'yes' must be a function of a text and a fraction, or True"):
        sinssim.run("parked", overrides=SHORT, progress=progress)
