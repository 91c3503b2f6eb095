"""Sentences of a diagnosis: each cause has its size, its key, and the value to set."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from sinssim.estimation.filter_result import Diagnosis, Hypothesis
from sinssim.experiments.run.filter_remedies import _explained, what_to_try
from sinssim.scenario.schema import Scenario
from tests.recording.spies import html


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    file = str(tmp_path / "x.csv")
    gnss = {"file": file, "lever_arm_m": [2.3, 0.0, -1.0], "time_offset_s": 0.1, "sigma_factor": 2.0}
    meter = {"value": 1.0, "unit": "m"}
    baro = {"file": file, "name": "baro", "kind": "baro-height", "reading": {"column": "h", "unit": "m"}}
    log = {"imu": {"file": file}, "gnss": gnss, "others": [{**baro, "sigma": meter, "bias_sigma": meter}]}
    log["start"] = {"heading_deg": 310.0}
    return Scenario.model_validate(
        {"name": "x", "log": log, "imu": {"grade": "tactical"}, "filter": {"states": ["gyro bias"]},
         "aiding": {"magnetometer": {}}}
    )  # fmt: skip


def told(hypotheses: Sequence[Hypothesis], scenario: Scenario, until: float) -> list[str]:
    return list(_explained(Diagnosis(until, (), {}, tuple(hypotheses)), {}, scenario))


@pytest.mark.parametrize(
    ("name", "kind", "value", "words"),
    [
        ("gnss lever arm", "state", (-2.0, 0.0, 0.0), ("-2 ± 0.1", "log.gnss.lever_arm_m = [0.3, 0, -1]")),
        ("gnss time offset", "state", (0.2,), ("too late by", "log.gnss.time_offset_s = -0.1")),
        ("gyro scale", "state", (0.03, 0.0, 0.0), ("30000", 'filter.states = ["gyro bias", "gyro scale"]')),
        ("gyro", "bias walk", (2.424068e-4,), ("3000 °/h/√h", "imu.gyro_rrw_deg_h_sqrt_h = 3000")),
        ("inertial noise", "inertial noise", (10.0,), ("filter.inertial_noise_factor = 10",)),
        ("gnss-position", "measurement noise", (3.0,), ("3.00 times", "log.gnss.sigma_factor = 6")),
        ("baro", "measurement noise", (3.0,), ('log.others.1.sigma = { value = 3, unit = "m" }',)),
        ("baro bias", "state", (40.0,), ("40 ± 0.1 m", 'log.others.1.bias_sigma = { value = 120, unit = "m" }')),
        ("baro scale", "state", (0.04,), ("40000", "log.others.1.scale_sigma_ppm = 120000")),
        ("baro", "bias walk", (0.1,), ("0.1 m/√s", "log.others.1.bias_correlation_time_s = 200")),
        ("magnetometer bias", "state", (0.1,), ("5.73", "aiding.magnetometer.bias_sigma_deg = 17")),
        ("radar bias", "state", (0.1,), ('a state "radar bias"',)),
        ("initial heading", "initial state", (0.1,), ("5.73", "heading_deg other than 310", "heading_arcmin = 1000")),
        ("initial position", "initial state", (30.0, 0.0, 2.0), ("position_m = 90 and ", "height_m = 6")),
    ],
)
def test_causes_have_keys(
    scenario: Scenario, name: str, kind: Any, value: tuple[float, ...], words: tuple[str, ...]
) -> None:
    sigma = (0.1,) * len(value) if kind in ("state", "initial state") else ()
    (sentence,) = told([Hypothesis(name, kind, value, sigma, 100.0, 14.0)], scenario, 300.0)
    for word in words:
        assert word in sentence, sentence


def test_a_component_that_the_readings_do_not_show_stays(scenario: Scenario) -> None:
    """A drive on level ground does not show the antenna's height."""
    found = Hypothesis("gnss lever arm", "state", (-2.0, 0.1, 2.0), (0.1, 0.1, 2.1), 100.0, 14.0)
    (sentence,) = told([found], scenario, 149.98)
    assert "log.gnss.lever_arm_m = [0.3, 0, -1], or log.gnss.lever_arm_sigma_m = 6," in sentence
    assert "2 ± 2.1] m" in sentence
    assert "until 150 s" in sentence


def test_causes_that_are_alike_are_both_told(scenario: Scenario) -> None:
    one = Hypothesis("gnss lever arm", "state", (3.0, 0.0, 0.0), (0.1, 0.1, 0.1), 1283.8, 14.0)
    other = Hypothesis("gnss time offset", "state", (0.06,), (0.002,), 1285.5, 14.0)
    far = Hypothesis("gyro bias", "state", (1.0, 0.0, 0.0), (0.1, 0.1, 0.1), 900.0, 14.0)
    first, second = told([other, one, far], scenario, 300.0)
    assert "Most likely cause: the time stamps of the fixes are too late" in first
    assert "Equally likely for this motion: the lever arm" in second


def test_planted_faults_are_told_before_any_cause() -> None:
    """No key of a filter mends a receiver that a scenario lets jump."""
    scenario = Scenario.model_validate(
        {
            "name": "x", "parked": {"latitude_deg": 50.0, "duration_s": 60.0},
            "imu": {"grade": "tactical"}, "aiding": {"gnss": {"jumps": [{"from_s": 20.0, "north_m": 9.0}]}},
            "filter": {},
        }
    )  # fmt: skip
    found = Hypothesis("inertial noise", "inertial noise", (10.0,), (), 100.0, 14.0)
    (sentence,) = told([found], scenario, 60.0)
    assert "aiding.gnss.jumps from 20 s on" in sentence
    (sentence,) = told([found], scenario, 10.0)
    assert "Most likely cause" in sentence


def test_the_part_of_the_report() -> None:
    one = {"name": "gnss lever arm", "kind": "state", "value": [2.0], "sigma": [0.1], "gain": 40.0, "needed": 14.0}
    found: Any = {
        "what_to_try": ["Try <this>."],
        "cause": "gnss lever arm",
        "hypotheses": [one, {**one, "name": "a, b", "kind": "measurement noise", "sigma": [], "gain": 30.0}],
        "until_s": 300.0,
        "false_alarm": 0.01,
    }
    page = html(*what_to_try(found))
    assert "<strong>40</strong>" in page
    assert "<strong>30</strong>" not in page  # more than chance, but not the cause
    assert "σ of a and b" in page
    assert "Try &lt;this&gt;." in page
