"""`sinssim compare` with a trade study, as a stranger meets it: results, bad input, Ctrl-C."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from sinssim.cli import app as cli
from tests.experiments.studies.trade_examples import SCENARIO

STUDY = """\
description = "a parked vehicle"
scenario = "standing.toml"
require = ["r95(end) <= 1 km"]

[[axes]]
key = "imu.grade"
values = ["laser-standard", "tactical"]

[[axes]]
key = "imu.gyro_bias_sigma_deg_h"
values = [0.01, 0.1]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current folder with a study."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "standing.toml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path


def call(*arguments: str) -> int:
    """Run the command line, and return its exit code."""
    with pytest.raises(SystemExit) as end:
        cli.main(["compare", *arguments])
    code = end.value.code
    return code if isinstance(code, int) else 0


def test_a_study(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Tables and files; a second call needs --resume or --overwrite, and computes nothing with --resume."""
    assert call("mine.toml", "--require", "heading(end) <= 1 deg") == 0
    out = capsys.readouterr().out
    for part in ("4 covariance budgets of standing.toml", "R95 at the end", "r95(end) <= 1 km: met in 4 of 4 cells.",
                 "heading(end) <= 1 deg: met in", "All 2 requirements together:", "report.html"):  # fmt: skip
        assert part in out
    assert "View:" in out
    place = folder / "runs" / "mine"
    names = {p.name for p in place.iterdir() if not p.name.startswith(".")}
    assert {"report.html", "results.json", "results.parquet", "summary.md", "study.toml", "cells", "trade.json",
            "r95_end.svg", "r95_end.png", "r95_end_map.svg", "heading_end.png", "growth.svg"} <= names  # fmt: skip
    assert pq.read_table(place / "results.parquet").num_rows == 4
    assert call("mine.toml", "-q") == 2
    assert "--resume" in capsys.readouterr().err
    assert call("mine.toml", "--resume", "--json", "--require", "heading(end) <= 1 deg") == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["finished"], found["failed"], found["computed"]) == (4, 0, 0)
    assert found["cells"][3]["settings"] == {"imu.grade": "tactical", "imu.gyro_bias_sigma_deg_h": 0.1}
    assert call(str(place / "study.toml"), "-q", "-o", "again") == 0  # the study with its defaults is a study


SWEEP = (
    "standing.toml",
    "--vary",
    "imu.grade=laser-standard,tactical",
    "--vary",
    "imu.gyro_bias_sigma_deg_h=0.01:1:log3",
)
REQUIRE = ("--require", "r95(end) <= 1 km", "--set", "times_s=[30.0]", "--set", "imu.rate_hz=4")


def test_a_sweep_is_the_study_of_a_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same numbers, files and report; the file's study continues the sweep, and has no cell to compute."""
    (folder / "file.toml").write_text(
        'name = "standing-trade"\nscenario = "standing.toml"\nset = ["imu.rate_hz=4"]\ntimes_s = [30.0]\n'
        'require = ["r95(end) <= 1 km"]\n[[axes]]\nkey = "imu.grade"\nvalues = ["laser-standard", "tactical"]\n'
        '[[axes]]\nkey = "imu.gyro_bias_sigma_deg_h"\nvalues = [0.01, 0.1, 1.0]\n',
        encoding="utf-8",
    )
    assert call(*SWEEP, *REQUIRE, "--json") == 0
    swept = json.loads(capsys.readouterr().out)
    assert call("file.toml", "-o", "of_file", "--json") == 0
    of_file = json.loads(capsys.readouterr().out)
    assert (swept["finished"], of_file["computed"]) == (6, 6)
    for found in (swept, of_file):
        del found["seconds"]
    assert swept == of_file
    place = folder / "runs" / "standing-trade"
    files = [
        {str(p.relative_to(base)): p.read_bytes() for p in base.rglob("*") if p.is_file()}
        for base in (place, folder / "of_file")
    ]
    assert files[0].keys() == files[1].keys()
    for each in files:  # all but the time that the call took
        each["summary.md"] = re.sub(rb"computed in [\d.]+ s", b"computed", each["summary.md"])
    same = {name for name in files[0] if files[0][name] == files[1][name]}
    assert {name for name in files[0] if name.startswith("cells")} | {"study.toml", "summary.md", "r95_end.svg"} <= same
    assert call("file.toml", "-o", str(place), "--resume", "--json") == 0
    assert json.loads(capsys.readouterr().out)["computed"] == 0


def test_an_ensemble_by_sweep(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("standing.toml", "--vary", "seed=1:2:1", "--set", "cell=ensemble", "--set", "runs=3", "--threads", "1",
                "--json", "-o", "there") == 0  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    assert [cell["settings"] for cell in found["cells"]] == [{"seed": 1}, {"seed": 2}]
    assert [cell["values"]["runs"] for cell in found["cells"]] == [3.0, 3.0]


def test_settings_of_the_study(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("mine.toml", "--set", "cell=ensemble", "--set", "runs=3", "--threads", "1", "--json",
                "--set", "axes.1.values=[\"tactical\"]") == 0  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    assert [cell["values"]["runs"] for cell in found["cells"]] == [3.0, 3.0]
    assert found["cell"] == "ensemble"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["mine.toml", "--set", "axes.1.key=imu.grde"], "Did you mean 'imu.grade'"),
        (["mine.toml", "--set", "axes.2.values=[0.1, -1.0]"], "cell 2 (grade laser-standard, gyro bias σ −1 deg/h)"),
        (["mine.toml", "--set", "axes.2.values=[]"], "must have at least 1 entry"),
        (["mine.toml", "--set", "axes=[]"], "must have at least 1 entry"),
        (["mine.toml", "--set", "axes.2.values=[0.1, 0.1]"], "values.1 and values.2 are both 0.1"),
        (["mine.toml", "--set", 'set=["imu.grade=ideal"]'], "is fixed by set"),
        (["mine.toml", "--set", "cell=ensemble", "--set", "runs=0"], "runs = 0 must be at least 1"),
        (["mine.toml", "--set", "cell=ensemble", "--set", "runs=-3"], "runs = -3 must be at least 1"),
        (["mine.toml", "--set", "cell=budgets"], "cell"),
        (["mine.toml", "--set", "runs=5"], "has no effect on budgets"),
        (["mine.toml", "--set", "scenario=standing"], "unknown scenario 'standing'"),
        (["mine.toml", "--require", "r95 < 3"], "no unit follows the number 3"),
        (["mine.toml", "--resume", "--overwrite"], "exclude each other"),
        (["coning", "--require", "r95 <= 3 m"], "belongs to trade studies"),
        (["gyro_trad"], "Did you mean 'gyro_trade'"),
        (["parked"], "parked is a scenario, not a study; vary its keys with --vary"),
        (["gyro_trade", "--vary", "seed=1,2"], "but gyro_trade is a study, which has its own values"),
        (["mine.toml", "--vary", "seed=1,2"], "but mine.toml is a study, which has its own values"),
        (["standing.toml", "--vary", "imu.rte_hz=5,10"], "Did you mean 'imu.rate_hz'"),
        (["standing.toml", "--vary", "imu.rate_hz=5,abc"], "imu.rate_hz must be a number, not the text 'abc'"),
        (["standing.toml", "--vary", "imu.rate_hz=5 Hz"], "has a unit, 'Hz'; the unit is part of the key's name"),
        (["standing.toml", "--vary", "imu.rate_hz=5,5"], "--vary imu.rate_hz: values.1 and values.2 are both 5"),
        (
            ["standing.toml", "--vary", "seed=1,2", "--vary", "imu.rate_hz=5,5"],
            "--vary imu.rate_hz: values.1 and values.2 are both 5",
        ),
        (
            ["standing.toml", "--vary", "seed=1:600:1", "--vary", "imu.rate_hz=5,10"],
            "600 × 2 = 1200 cells, which take 20 min at one second each, and at most 1000 are allowed",
        ),
    ],
)
def test_bad_input(folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str) -> None:
    assert call(*arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert "Traceback" not in err
    assert {p.name for p in folder.iterdir()} == {"mine.toml", "standing.toml"}


def test_the_folder_of_another_study(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("mine.toml", "-q", "-o", "there") == 0
    assert call("mine.toml", "-q", "-o", "there", "--resume", "--set", "name=other") == 2
    assert "it is the study mine, not other" in capsys.readouterr().err


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done(folder: Path) -> None:
    """Interrupted after its first cells, a study leaves these and their report; --resume goes on."""
    values = ", ".join(f"{0.001 * k:.3f}" for k in range(1, 100))
    (folder / "mine.toml").write_text(STUDY.replace("[0.01, 0.1]", f"[{values}]"), encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, "-m", "sinssim", "compare", "mine.toml"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        cwd=folder, start_new_session=True, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 120.0
    while len(list(folder.glob("runs/mine/cells/*.json"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert "of 198 cells are finished, in" in " ".join(err.split())
    assert "Traceback" not in out + err
    found = json.loads((folder / "runs" / "mine" / "results.json").read_text(encoding="utf-8"))
    assert found["status"] == "interrupted"
    assert found["finished"] == len(list(folder.glob("runs/mine/cells/*.json"))) >= 3
