"""`sinssim compare` as a stranger meets it: results, bad input, Ctrl-C."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sinssim.cli import app as cli

pytestmark = pytest.mark.usefixtures("hardly_counted")

STUDY = """\
description = "a parked vehicle"

[[parts]]
title = "one"
algorithms = ["quaternion"]
rates_hz = [50.0, 100.0]

[[parts.motions]]
parked = { latitude_deg = 50.0, duration_s = 5.0 }
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current folder with a study."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    code = stopped.value.code
    return code if isinstance(code, int) else 0


def test_table_and_files(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("compare", "mine.toml") == 0
    out, err = capsys.readouterr()
    assert "parked" in out
    assert "report.html" in out
    assert err == ""
    assert (folder / "runs" / "mine" / "report.html").is_file()


def test_json_and_settings(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("compare", "mine.toml", "--json", "-o", "here", "--set", "parts.1.rates_hz=[20.0]") == 0
    results = json.loads(capsys.readouterr().out)
    assert [case["rate_hz"] for case in results["cases"]] == [20.0]
    assert (folder / "here" / "results.json").is_file()


def test_quiet_and_overwrite(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("compare", "mine.toml", "-q") == 0
    assert call("compare", "mine.toml", "-q") == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "--overwrite" in err
    assert call("compare", "mine.toml", "-q", "--overwrite") == 0


def test_a_study_in_the_folder_has_a_name(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "scenarios" / "studies").mkdir(parents=True)
    (folder / "mine.toml").rename(folder / "scenarios" / "studies" / "mine.toml")
    assert call("list", "studies") == 0
    assert re.search(r"^mine +a parked vehicle$", capsys.readouterr().out, re.MULTILINE)
    assert call("compare", "mine", "-q") == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["mine.toml", "--set", "parts.1.rates_hz=[30.0, 100.0]"], "30 Hz does not divide the highest rate"),
        (["mine.toml", "--set", 'parts.1.algorithms=["quarternion"]'], "Did you mean 'quaternion'"),
        (["mine.toml", "--set", 'parts.1.algorithms=["euler", "euler"]'], "'euler' 2 times"),
        (
            ["mine.toml", "--set", "parts.1.algorithms=functional-iteration", "--set", "parts.1.rates_hz=[1.0]"],
            "must be an array",
        ),
        (
            ["mine.toml", "--set", 'parts.1.algorithms=["functional-iteration"]', "--set", "parts.1.rates_hz=[1.0]"],
            "functional-iteration at 1 Hz needs at least 8 s, 8 samples",
        ),
        (["mine.toml", "--set", "parts.1.motions.1.duration_s=60.0"], "lasts 5.0 s, less than its duration_s = 60 s"),
        (["mine.toml", "--set", "parts.1.motions.1.parked.duration_s=9e7"], "--limit-minutes"),
        (
            ["mine.toml", "--set", "parts.1.rates_hz=[1e-6, 100.0]"],
            "lasts 5 s; quaternion at 1e-06 Hz needs at least 1e+06 s",
        ),
        (["conning"], "Did you mean 'coning'"),
        (["elsewhere/coning.toml"], "no study file"),
    ],
)
def test_bad_input(folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str) -> None:
    assert call("compare", *arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert "Traceback" not in err
    assert {p.name for p in folder.iterdir()} == {"mine.toml"}


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_done(folder: Path) -> None:
    """On a terminal there is a bar; interrupted in its second motion, the study leaves a report of the first."""
    longer = STUDY + "\n[[parts.motions]]\nname = 'long'\nparked = { latitude_deg = 50.0, duration_s = 200000.0 }\n"
    (folder / "mine.toml").write_text(longer, encoding="utf-8")
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "sinssim", "compare", "mine.toml"],
        stdin=slave, stdout=slave, stderr=slave, cwd=folder, start_new_session=True,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    )  # fmt: skip
    os.close(slave)
    seen = b""
    deadline = time.monotonic() + 120.0
    while b"long" not in seen and time.monotonic() < deadline:
        seen += os.read(master, 4096)
    os.kill(process.pid, signal.SIGINT)
    try:
        while chunk := os.read(master, 4096):
            seen += chunk
    except OSError:  # the terminal is closed when the process ends
        pass
    assert process.wait(60) == 130, seen.decode(errors="replace")[-2000:]
    text = seen.decode(errors="replace")
    assert "Interrupted. 2 navigations were finished" in " ".join(text.split())
    results = json.loads((folder / "runs" / "mine" / "results.json").read_text(encoding="utf-8"))
    assert results["status"] == "interrupted"
    assert {case["motion"] for case in results["cases"]} == {"parked"}
