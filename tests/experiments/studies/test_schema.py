"""Study files: what may be written, and what is said of a mistake."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sinssim import ALGORITHMS
from sinssim.content import list_content
from sinssim.errors import InputError
from sinssim.experiments.study import load_study
from sinssim.strapdown.attitude import whole_ratio

PART = """\
[[parts]]
title = "one"
algorithms = ["quaternion", "euler"]
rates_hz = [10.0, 50.0, 100.0]

[[parts.motions]]
parked = { latitude_deg = 50.0, duration_s = 10.0 }
"""


def load(folder: Path, text: str, *overrides: str):
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return load_study(file, overrides)


def refused(folder: Path, text: str, *overrides: str) -> str:
    with pytest.raises(InputError) as refusal:
        load(folder, text, *overrides)
    message = str(refusal.value)
    assert "\n\n" not in message
    return message


def test_defaults(tmp_path: Path) -> None:
    study = load(tmp_path, PART)
    part = study.parts[0]
    assert study.name == "mine"
    assert part.sensors == ("ideal",)
    assert part.frames == ("level",)
    assert part.highest_hz == 100.0
    assert part.pace == ((10.0, None, ""), (50.0, None, ""), (100.0, None, ""))
    assert part.motions[0].label == "parked"


def test_patterns_stand_for_algorithms(tmp_path: Path) -> None:
    everything = load(tmp_path, PART, 'parts.1.algorithms=["*"]').parts[0].algorithms
    assert everything == tuple(ALGORITHMS)
    family = load(tmp_path, PART, 'parts.1.algorithms=["poisson-?"]').parts[0].algorithms
    assert family == ("poisson-1", "poisson-2", "poisson-3", "poisson-4")


@pytest.mark.parametrize(
    "name", sorted(set(list_content("studies")) - {"gyro_trade"})
)  # tests/experiments/studies/test_trade_load.py
def test_shipped_studies_load(name: str) -> None:
    study = load_study(name)
    assert study.name == name
    assert study.description


def test_studies_are_no_scenarios() -> None:
    assert not set(list_content("studies")) & set(list_content("scenarios"))


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("parts.1.rates_hz=[30.0, 100.0]", ["30 Hz does not divide", "100 Hz", "33.3333333 Hz does"]),
        ("parts.1.rates_hz=[]", ["rates_hz"]),
        ("parts.1.rates_hz=[100.0, 100.0]", ["rates_hz", "100.0 Hz 2 times"]),
        ("parts.1.rates_hz=[0.0]", ["at least 1e-06"]),
        (
            "parts.1.schedules_hz=[[100.0, 40.0, 10.0]]",
            ["medium rate, 40 Hz, does not divide the fast rate, 100 Hz", "use 50 or 33.3333333 Hz"],
        ),
        ('parts.1.algorithms=["quaternoin"]', ["unknown algorithm 'quaternoin'", "Did you mean 'quaternion'"]),
        ('parts.1.algorithms=["euler", "euler"]', ["'euler' 2 times"]),
        ('parts.1.algorithms=["measured-attitude"]', ['variants = ["attitude-sensor"]']),
        ('parts.1.algorithms=["poisson-1", "poisson-*"]', ["'poisson-1' 2 times"]),
        ('parts.1.sensors=["laser-standart"]', ["parts.1.sensors", "Did you mean 'laser-standard'"]),
        ('parts.1.frames=["polar"]', ["unknown frame 'polar'"]),
        ('parts.1.decides=["quaternions-rule"]', ["unknown claim", "attitude-rate"]),
        ('parts.1.variants=["no-sensors"]', ["unknown sensor-set variant"]),
        ('parts.1.slow_quantities=["extrapolate"]', ['slow_quantities = ["extrapolate"] would have no effect']),
        ("parts.1.motions.1.scenario=parked", ["exactly one of", "scenario and parked"]),
        ('parts.1.motions.1.set=["imu.rate_hz=5"]', ["set overrides values of a scenario"]),
        ("parts.1.motions.1.parked.latitude_deg=91.0", ["at most 90"]),
        ("parts.1.algorithm=euler", ["unknown key 'parts.1.algorithm'", "parts.1.algorithms"]),
    ],
)
def test_mistakes_are_named(tmp_path: Path, setting: str, said: list[str]) -> None:
    message = refused(tmp_path, PART, setting)
    for words in said:
        assert words in message


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (
            ('frames=["level", "inertial"]', 'curvatures=["exact", "simplified"]'),
            'have no effect in frames = ["inertial"]',
        ),
        (('variants=["attitude-sensor"]', 'algorithms=["poisson-*"]'), "algorithms would have no effect with variants"),
        (('variants=["attitude-sensor"]', 'frames=["wander"]'), "frames would have no effect with variants"),
        (
            ('variants=["attitude-sensor"]', 'curvatures=["simplified"]'),
            "curvatures would have no effect with variants",
        ),
    ],
)
def test_what_would_change_nothing_is_refused(tmp_path: Path, settings: tuple[str, str], said: str) -> None:
    assert said in refused(tmp_path, PART, *(f"parts.1.{setting}" for setting in settings))


def test_a_mistake_has_its_line(tmp_path: Path) -> None:
    assert "line 4: parts.1" in refused(tmp_path, PART.replace("10.0, 50.0", "50.0, 50.0"))


def test_a_scenario_beside_the_study_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = PART.replace("parked = { latitude_deg = 50.0, duration_s = 10.0 }", 'scenario = "mine_too.toml"')
    (tmp_path / "mine_too.toml").write_text('name = "x"\n', encoding="utf-8")
    assert load(tmp_path, text).parts[0].motions[0].scenario == str((tmp_path / "mine_too.toml").resolve())
    assert load(tmp_path, text).parts[0].motions[0].label == "mine_too"
    monkeypatch.chdir(tmp_path)
    assert load(tmp_path, text).parts[0].motions[0].scenario == "mine_too.toml"
    assert "must be an array" in refused(tmp_path, "parts = 3\n")


def test_two_parts_of_one_title(tmp_path: Path) -> None:
    assert "2 parts have the title 'one'" in refused(tmp_path, PART + PART)


def test_two_motions_of_one_name(tmp_path: Path) -> None:
    again = "\n[[parts.motions]]\nparked = { latitude_deg = 10.0, duration_s = 10.0 }\n"
    assert "2 motions have the name 'parked'" in refused(tmp_path, PART + again)


@pytest.mark.parametrize("rate", [7.0, 30.0, 44.0, 61.0, 99.0, 0.003])
def test_the_rate_that_is_said_to_divide_does(tmp_path: Path, rate: float) -> None:
    message = refused(tmp_path, PART, f"parts.1.rates_hz=[{rate}, 100.7]")
    near = float(re.findall(r"; (\S+) Hz does", message)[0])
    assert load(tmp_path, PART, f"parts.1.rates_hz=[{near}, 100.7]").parts[0].rates_hz[0] == near


@pytest.mark.parametrize(
    ("slow", "fast", "whole"),
    [
        (10.0, 400.0, 40), (100.0 / 3.0, 100.0, 3), (33.3333, 100.0, 3), (33.33, 100.0, None), (30.0, 100.0, None),
        (200.0, 100.0, None), (0.003, 100.7, None), (0.01, 400.0, 40000),
    ],
)  # fmt: skip
def test_whole_ratio(slow: float, fast: float, whole: int | None) -> None:
    assert whole_ratio(fast, slow) == whole


def test_the_documented_study_loads(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "docs" / "comparing.md").read_text(encoding="utf-8")
    study = load(tmp_path, text.split("```toml\n")[1].split("```")[0])
    assert [len(part.motions) for part in study.parts] == [2, 1]
    assert study.block("good-gyros").gyro_bias_deg_h == (0.002, 0.002, 0.002)


@pytest.mark.parametrize("value", ["[0.1, 0.2]", "[]"])
def test_numbers_that_lack_in_a_block_are_counted(tmp_path: Path, value: str) -> None:
    message = refused(tmp_path, f"{PART}\n[blocks.mine]\ngyro_bias_deg_h = {value}\n")
    assert f"blocks.mine.gyro_bias_deg_h must have 3 entries, and has {value.count('0.')}" in message
