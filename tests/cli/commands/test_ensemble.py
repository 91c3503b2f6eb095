"""`sinssim ensemble`: what it prints, what it leaves, and how it refuses."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sinssim.cli import main
from tests.ensembles.examples import AIDED, scenario


def run_cli(*arguments: str) -> int:
    """Run the command line in this process; return its exit code."""
    try:
        main(["ensemble", *arguments])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


@pytest.fixture
def file(tmp_path) -> Path:
    path = tmp_path / "standing.toml"
    path.write_text(scenario(ensemble={"epoch_s": 5.0}).to_toml(), encoding="utf-8")
    return path


def test_tables_and_files(file: Path, tmp_path, capsys) -> None:
    assert run_cli(str(file), "--runs", "80", "-o", str(tmp_path / "e")) == 0
    out = capsys.readouterr().out
    for words in ("80 runs", "CEP (95 % band)", "Σ t r / Σ t²", "14 CFR Part 121", "worst", "median", "best"):
        assert words in out
    assert f"run {tmp_path / 'e' / 'scenario.toml'} --set seed=" in out
    for name in ("report.html", "ensemble.svg", "ensemble.png", "recording.rrd", "summary.json", "scenario.toml"):
        assert (tmp_path / "e" / name).is_file()


def test_a_command_that_is_printed_gives_that_run(file: Path, tmp_path, capsys) -> None:
    assert run_cli(str(file), "--runs", "5", "-o", str(tmp_path / "e"), "--json") == 0
    worst = json.loads(capsys.readouterr().out)["named_runs"][0]
    command = ["run", str(tmp_path / "e" / "scenario.toml"), "-o", str(tmp_path / "r"), "--json"]
    with pytest.raises(SystemExit) as end:
        main([*command, *(part for setting in worst["settings"] for part in ("--set", setting))])
    assert not end.value.code
    found = json.loads(capsys.readouterr().out)["algorithms"]["euler"]["final_horizontal_error_m"]
    assert found == worst["final_horizontal_m"]


def test_sheet(file: Path, tmp_path, capsys) -> None:
    assert run_cli(str(file), "--runs", "5", "-o", str(tmp_path / "e"), "--sheet") == 0
    out = capsys.readouterr().out
    for words in ("position rate, CEP", "nmi/h", "velocity", "roll and pitch", "heading", "Definitions", "rms"):
        assert words in out


def test_a_filter_is_judged_by_its_ensemble(tmp_path, capsys) -> None:
    path = tmp_path / "aligning.toml"
    path.write_text(scenario(AIDED).to_toml(), encoding="utf-8")
    assert run_cli(str(path), "--runs", "4", "--threads", "1", "-o", str(tmp_path / "e")) == 0
    out = capsys.readouterr().out
    for words in ("ANEES, gyro bias", "NIS, gnss-velocity", "epochs in band"):
        assert words in out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--runs", "0"), "runs = 0 must be a whole number from 1"),
        (("--runs", "-5"), "runs = -5"),
        (("--threads", "0"), "threads = 0"),
        (("--set", "ensemble.epoch_s=-1.0"), "ensemble.epoch_s = -1.0 must be greater than 0"),
        (("--set", "ensemble.runs=0"), "ensemble.runs = 0 must be at least 1"),
    ],
)
def test_wrong_input(options: tuple[str, ...], words: str, file: Path, tmp_path, capsys) -> None:
    assert run_cli(str(file), "-o", str(tmp_path / "e"), *options) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "e").exists()


def test_runs_that_are_no_number(file: Path) -> None:
    assert run_cli(str(file), "--runs", "many") == 2


def test_ctrl_c_leaves_a_directory_that_can_be_continued(file: Path, tmp_path) -> None:
    place = tmp_path / "e"
    command = [sys.executable, "-m", "sinssim", "ensemble", str(file), "--runs", "100000", "-q", "-o", str(place)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    end = time.monotonic() + 60.0
    while not list((place / "runs").glob("*.parquet")) and process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"of 100000 runs are finished" in told
    assert b"--resume" in told
    assert (place / "report.html").is_file()
    done = sum(1 for _ in (place / "runs").iterdir()) * 64
    assert run_cli(str(file), "--runs", str(done), "-o", str(place), "--resume", "-q") == 0
    summary = json.loads((place / "summary.json").read_text(encoding="utf-8"))
    assert (summary["runs"], summary["computed"], summary["status"]) == (done, 0, "finished")
