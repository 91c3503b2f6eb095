"""Scenarios with own content: runs, copies, changes, other processes, and mistakes in the files."""

from __future__ import annotations

import hashlib
import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles import run_seed
from sinssim.experiments.studies.study_directory import digests
from sinssim.experiments.study import load_study
from sinssim.rotation import conjugate, multiply
from sinssim.scenario import load_scenario
from sinssim.scenario.plan_summary import own_digests
from sinssim.strapdown.attitude import ALGORITHMS
from sinssim.system.registries import forget
from tests.extending.pages import read_page

RADAR = next(block.code for block in read_page("aiding-sensor").files if block.path.endswith(".py"))
SEA = next(block.code for block in read_page("aiding-sensor").files if block.path.endswith(".toml"))
SHORT = ("motion.duration_s=10", "recording.keep=report")


def test_a_run_of_the_laid_out_project(project: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    scenario = load_scenario(project / "scenario.toml", SHORT)
    assert scenario.imu.grade == str(project / "grades" / "my_unit.toml")
    assert scenario.views == (str(project / "views" / "attitude.py"),)
    result = sinssim.run(scenario, tmp_path / "run")
    # Cayley's transform turns by 4 atan(φ/4) = φ − φ³/48: 500 steps of 90°/s at 50 Hz; the rocking adds 0.2 %
    own, exact = (result.solutions[name].q_nb[-1] for name in ("cayley", "quaternion"))
    apart = 2.0 * np.linalg.norm(multiply(conjugate(exact), own)[1:])
    assert apart == pytest.approx(500 * (np.radians(90.0) / 50.0) ** 3 / 48.0, rel=0.005)
    assert set(result.streams) >= {"nav_cayley", "error_cayley"}
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert [(own["kind"], own["name"]) for own in summary["own_content"]] == [
        ("algorithms", "cayley"),
        ("grades", "my_unit"),
    ]
    copy = tmp_path / "run" / "own_content" / "algorithms" / "cayley.py"
    assert copy.read_bytes() == (project / "algorithms" / "cayley.py").read_bytes()
    assert summary["own_content"][0]["sha256"] == hashlib.sha256(copy.read_bytes()).hexdigest()
    assert (
        f"cayley, SHA-256 {summary['own_content'][0]['sha256'][:12]}" in (tmp_path / "run" / "report.html").read_text()
    )
    assert load_scenario(tmp_path / "run" / "scenario.toml") == scenario  # nothing has changed, nothing is said
    assert caplog.text == ""
    forget()
    (project / "algorithms" / "cayley.py").write_text("import nothing\nstart_k = None\n")
    load_scenario(tmp_path / "run" / "scenario.toml")
    assert "cayley.py has changed since the run in" in caplog.text
    caplog.clear()
    forget()
    again = load_scenario(tmp_path / "run" / "scenario.toml", [f'use=["{tmp_path / "run" / "own_content"}"]'])
    assert caplog.text == ""
    assert own_digests(again) == own_digests_of(summary)


def own_digests_of(summary: dict[str, list[dict[str, str]]]) -> dict[str, str]:
    return {f"{own['kind']}/{Path(own['file']).name}": own["sha256"] for own in summary["own_content"]}


def test_a_scenario_in_another_process(project: Path) -> None:
    scenario = load_scenario(project / "scenario.toml")
    sent = pickle.dumps(scenario)
    forget()
    assert "cayley" not in ALGORITHMS
    assert pickle.loads(sent) == scenario
    assert "cayley" in ALGORITHMS


def test_the_written_scenario_names_what_was_registered_otherwise(project: Path) -> None:
    sinssim.use(project)
    scenario = load_scenario("parked", ['navigation.algorithms=["cayley"]'])
    assert scenario.use == ()
    assert scenario.as_written()["use"] == (str(project / "algorithms" / "cayley.py"),)


def test_a_study_with_an_own_algorithm(project: Path) -> None:
    study = project / "study.toml"
    part = '[[parts]]\ntitle = "Which one?"\nalgorithms = ["cay*", "quaternion"]\nrates_hz = [50.0]\n'
    study.write_text(f'use = ["."]\n{part}[[parts.motions]]\nscenario = "scenario.toml"\n', encoding="utf-8")
    plan = load_study(study)
    part = plan.parts[0]
    assert part.algorithms == ("cayley", "quaternion")
    before = {case.algorithm: name for case, name in digests(plan, part, part.motions[0]).items()}
    forget()
    with (project / "algorithms" / "cayley.py").open("a", encoding="utf-8") as file:
        file.write("# another one\n")
    plan = load_study(study)
    after = {case.algorithm: name for case, name in digests(plan, part, part.motions[0]).items()}
    assert before["cayley"] != after["cayley"]  # what was navigated with the old code is navigated again
    assert before["quaternion"] == after["quaternion"]


def test_an_own_aiding_sensor(tmp_path: Path) -> None:
    (tmp_path / "aiding").mkdir()
    (tmp_path / "aiding" / "radar_altimeter.py").write_text(RADAR, encoding="utf-8")
    (tmp_path / "sea.toml").write_text(f'use = ["."]\n{SEA}', encoding="utf-8")
    scenario = load_scenario(tmp_path / "sea.toml", ["aiding.radar_altimeter.sigma_m=0.25"])
    assert scenario.aiding.sensors()["radar_altimeter"].sigma_m == 0.25
    (tmp_path / "again.toml").write_text(scenario.to_toml(), encoding="utf-8")
    assert load_scenario(tmp_path / "again.toml") == scenario
    sent = pickle.dumps(scenario)
    forget()
    scenario = pickle.loads(sent)
    result = sinssim.run(scenario)
    (row,) = [one for one in result.aided.estimate.innovations if one.sensor == "radar-altimeter"]
    assert row.accepted.sum() > 70  # of 80
    # 20 m at first; then the height of the sea's surface, 1 m
    assert 0.5 < result.aided.estimate.sigma[-1, 2] < 1.3
    with pytest.raises(InputError, match=r"unknown key 'aiding.radar_altimeter.sigma': .* use 'sigma_m'"):
        load_scenario(tmp_path / "sea.toml", ["aiding.radar_altimeter.sigma=1.0"])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("def read", "def red", "RadarAltimeter needs a method read"),
        ("(AidingSensor)", "", "must have one class that derives from AidingSensor; there is none"),
        ('    """A radar altimeter over the sea, up to 2500 ft."""', "", "RadarAltimeter needs a docstring"),
        ("default=0.5,", "default=0.5 +,", "syntax error in line 19"),
        ("default=0.5,", "default=1 / 0,", "line 19: ZeroDivisionError: division by zero"),
    ],
)
def test_own_aiding_sensors_that_cannot_be_used(tmp_path: Path, old: str, new: str, said: str) -> None:
    (tmp_path / "aiding").mkdir()
    (tmp_path / "aiding" / "radar_altimeter.py").write_text(RADAR.replace(old, new), encoding="utf-8")
    (tmp_path / "sea.toml").write_text(f'use = ["."]\n{SEA}', encoding="utf-8")
    with pytest.raises(InputError, match=said):
        load_scenario(tmp_path / "sea.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "value = height",
            "value = 0.0 * surface / 0.0 + height",
            "80 of 80 measurements are not finite, the first",
        ),
        ("value = height", "value = height[:3]", "radar_altimeter.py, line 30: ValueError: operands could not"),
    ],
)
def test_own_aiding_sensors_that_fail(tmp_path: Path, old: str, new: str, said: str) -> None:
    (tmp_path / "aiding").mkdir()
    (tmp_path / "aiding" / "radar_altimeter.py").write_text(RADAR.replace(old, new), encoding="utf-8")
    (tmp_path / "sea.toml").write_text(f'use = ["."]\n{SEA}', encoding="utf-8")
    scenario = load_scenario(tmp_path / "sea.toml")
    with (
        np.errstate(invalid="ignore"),
        pytest.raises(RunError, match=rf"the aiding sensor radar_altimeter failed: .*{said}"),
    ):
        sinssim.run(scenario)


def test_mistakes_in_use(project: Path) -> None:
    for paths, said in (
        ('["nothing"]', "use: there is no file or folder"),
        ('["README.md"]', "README.md is not a Python file"),
        ('"."', "use"),
    ):
        with pytest.raises(InputError, match=said):
            load_scenario(project / "scenario.toml", [f"use={paths}"])
    (project / "algorithms" / "euler.py").write_text("def step_k(): ...")
    with pytest.raises(InputError, match=r"line 6: use: .*sinssim itself has the attitude algorithm euler"):
        load_scenario(project / "scenario.toml")


@pytest.mark.slow
def test_an_ensemble_of_an_own_algorithm_in_processes(project: Path, tmp_path: Path) -> None:
    """The runs of a batch, in other processes, have the numbers of single runs; the batch compiles own functions."""
    scenario = load_scenario(project / "scenario.toml", [*SHORT, "ensemble.solution=cayley", "ensemble.runs=4"])
    result = sinssim.ensemble(scenario, directory=tmp_path / "ensemble", workers=2)
    assert not result.failed.any()
    single = sinssim.run(load_scenario(project / "scenario.toml", [*SHORT, f"seed={run_seed(1, 2)}"]))
    assert result.final_horizontal[2] == pytest.approx(single.errors["cayley"].horizontal[-1], rel=1e-9)
    (project / "algorithms" / "cayley.py").write_text(
        (project / "algorithms" / "cayley.py").read_text(encoding="utf-8") + "# changed\n", encoding="utf-8"
    )
    changed = load_scenario(project / "scenario.toml", [*SHORT, "ensemble.solution=cayley", "ensemble.runs=8"])
    with pytest.raises(InputError, match=r"own_content.algorithms/cayley.py was"):
        sinssim.ensemble(changed, directory=tmp_path / "ensemble", resume=True)
