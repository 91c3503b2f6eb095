"""`sinssim calibrate` as a stranger meets it: tables, files, the compensation file, logs, bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sinssim import calibrate, load_scenario
from sinssim.cli import app as cli
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.emulation import emulate

TABLE = """
[turntable]
latitude_deg = 50.0
sequence = "six-positions-and-rates"
dwell_s = 30.0
"""
SCENARIO = f"""\
name = "mine"
description = "a unit on a table"
seed = 2
{TABLE}
[imu]
rate_hz = 20.0

[calibration]
method = "separate"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current folder with a scenario."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    code = stopped.value.code
    return code if isinstance(code, int) else 0


def test_tables_files_and_the_way_to_compensation(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("calibrate", "mine.toml") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "calibration, separate method, 12 positions" in out
    assert "The sequence determines every parameter." in out
    made = folder / "runs" / "mine-calibration"
    page = (made / "report.html").read_text(encoding="utf-8")
    assert page.count('role="img"') == 5
    assert "Titterton" in page
    found = json.loads((made / "calibration.json").read_text(encoding="utf-8"))
    (bias,) = (one for one in found["parameters"] if one["name"] == "accel bias x")
    assert bias["unit"] == "µg"
    assert abs(bias["error_over_sigma"]) < 5.0
    assert np.array(found["covariance_si"]).shape == (24, 24)
    assert load_scenario(made / "scenario.toml").turntable == load_scenario("mine.toml").turntable
    user = folder / "user.toml"
    user.write_text(
        'name = "u"\n[parked]\nlatitude_deg = 1.0\nduration_s = 9.0\n[compensation]\n'
        'file = "runs/mine-calibration/compensation.toml"\n'
    )
    own = load_scenario(user).compensation
    assert own.accel_bias_ug[0] == pytest.approx(bias["value"])
    assert own.accel_asymmetry_ppm == (0.0, 0.0, 0.0)
    assert own.file is None
    capsys.readouterr()
    assert call("calibrate", "mine.toml") == 2
    assert "--overwrite" in capsys.readouterr().err
    assert call("calibrate", "mine.toml", "--overwrite", "--method", "systematic", "--json") == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["method"] == "systematic"
    assert len(shown["parameters"]) == 21


def write_log(folder: Path) -> Path:
    """Write a log of the sequence of SCENARIO, and a scenario on it; return the scenario."""
    described = load_scenario("mine.toml")
    measured = emulate(fly(described).increments(20.0), described.imu, described.seed)
    rows = np.column_stack([measured.time[1:], measured.dtheta, measured.dvel])
    names = "t,gx,gy,gz,ax,ay,az"
    np.savetxt(folder / "imu.csv", rows, delimiter=",", header=names, comments="", fmt="%.17g")
    log = """
[log.imu]
file = "imu.csv"
format = "text"
time = "t"
gyro = { columns = ["gx", "gy", "gz"], unit = "rad" }
accel = { columns = ["ax", "ay", "az"], unit = "m/s" }
"""
    text = f'name = "log"\n{log}{TABLE}\n[imu]\ngrade = "laser-standard"\n[calibration]\nmethod = "separate"\n'
    (folder / "log.toml").write_text(text, encoding="utf-8")
    return folder / "log.toml"


def test_a_log_gives_what_the_simulation_gives(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The dwells are found, a second shorter at both ends: the estimates agree within their 1σ."""
    path = write_log(folder)
    simulated, recorded = calibrate("mine.toml"), calibrate(path)
    assert recorded.truth is None
    assert recorded.names == simulated.names
    assert (np.abs(recorded.values - simulated.values) < 1.5 * simulated.sigma).all()
    spans = simulated.dwells + np.array(
        [0.2, -0.2]
    )  # the log's time 0 is its first stamp, the end of the first interval
    given = calibrate(path, overrides=[f"calibration.dwells_s={spans.tolist()}"])
    assert (np.abs(given.values - simulated.values) < 0.5 * simulated.sigma).all()
    assert call("calibrate", "log.toml") == 0
    assert "true" not in capsys.readouterr().out
    for setting, words in (
        ('turntable.sequence="six-positions"', "spans at rest, but the sequence of [turntable] has 6 dwells"),
        ("turntable.rate_deg_s=0.01", "the log has no spans at rest"),
        ("calibration.dwells_s=[[0.0, 9.0]]", "has 1 dwells, but the sequence of [turntable] has 12"),
    ):
        extra = ["--set", "turntable.ramp_s=0.01"] if "rate" in setting else []
        assert call("calibrate", "log.toml", "-o", "bad", "--set", setting, *extra) == 2
        assert words in " ".join(capsys.readouterr().err.split())
    assert not (folder / "bad").exists()


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("turntable.sequence=seven-positions", "seven-positions"),
        (
            "turntable.dwell_s=0.1",
            "turntable.dwell_s = 0.1 is shorter than three samples at imu.rate_hz = 20; give at least 0.15 s.",
        ),
        ("turntable.dwell_s=-1", "greater than 0"),
        ("turntable.rate_deg_s=0", "at least 0.001"),
        ("turntable.ramp_s=60", "give a ramp_s of at most 9"),
        ("turntable.turns=[{axis=[0.0,0.0,1.0], angle_deg=0.0}]", "0 is no turn"),
        ("calibration.method=best", "systematic"),
        ("calibration.dwells_s=[[0.0, 5.0]]", "dwells_s is for recorded sensors"),
    ],
)
def test_bad_input_writes_nothing(folder: Path, capsys: pytest.CaptureFixture[str], setting: str, words: str) -> None:
    assert call("calibrate", "mine.toml", "--set", setting) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not (folder / "runs").exists()


def test_a_scenario_without_a_sequence(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("calibrate", "parked") == 2
    assert "add [turntable]" in capsys.readouterr().err
    assert call("calibrate", "calibration_table", "--method", "best") == 2
    assert "method of calibration" in capsys.readouterr().err


def test_a_compensation_file_that_is_none(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, words in (("mine.toml", "has no table [compensation]"), ("nothing.toml", "cannot be read")):
        assert call("check", "mine.toml", "--set", f'compensation.file="{name}"') == 2
        assert words in " ".join(capsys.readouterr().err.split())
