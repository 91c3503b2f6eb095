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
from tests.experiments.ensembles.examples import AIDED, scenario


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


def test_requirements(file: Path, tmp_path, capsys) -> None:
    """On the console, in JSON, in summary.json and in the report; the exit status is that of any finished ensemble."""
    wanted = ("r95(end) <= 1 nmi", "cep(12.5 s) <= 0.001 m", "position_down(run) <= 40 m")
    options = [str(file), "--runs", "80", "-o", str(tmp_path / "e"), *(x for one in wanted for x in ("--require", one))]
    assert run_cli(*options[:-1], "position_down <= 40 furlong") == 2
    assert "'furlong' is not a known unit" in capsys.readouterr().err
    assert not (tmp_path / "e").exists()
    assert run_cli(*options) == 0
    out = capsys.readouterr().out
    for words in ("<= 1 nmi: met, with 95 % confidence. ", "<= 0.001 m: NOT MET, with 95 % confidence. ", "at 12.5 s"):
        assert words in out
    report = (tmp_path / "e" / "report.html").read_text(encoding="utf-8")
    for words in (
        "<h2>Requirements</h2>",
        '<span class="met">met</span>',
        '<span class="missed">not met</span>',
        "It is met with 95 % confidence.",
    ):
        assert words in report
    assert run_cli(*options, "--resume", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    summary = json.loads((tmp_path / "e" / "summary.json").read_text(encoding="utf-8"))
    assert found["requirements"] == summary["requirements"]
    first, second, _ = found["requirements"]
    assert (first["verdict"], first["limit"], first["unit"], first["runs"]) == ("met", 1.0, "nmi", 80)
    assert first["value"] * 1852.0 == pytest.approx(found["final_horizontal_m"]["r95"]["value"], rel=1e-12)
    assert (second["verdict"], second["time_s"], second["more_runs"]) == ("not met", 12.5, 0)
    assert found["looks"] == []


def test_until_decided(file: Path, tmp_path, capsys) -> None:
    options = [str(file), "--runs", "3", "-o", str(tmp_path / "e"), "--require", "r95 <= 1 nmi", "--until-decided"]
    assert run_cli(*options) == 0
    out, told = capsys.readouterr()
    assert "Undecided after 24 runs; going on to 48." in told
    out = " ".join(out.split())
    assert "r95 <= 1 nmi: undecided. In 48 runs the largest value is " in out
    assert "About 56 more runs are needed for a decision if they are similar." in out
    assert "Tested after 3, 6, 12, 24 and 48 runs." in out


def test_a_filter_is_judged_by_its_ensemble(tmp_path, capsys) -> None:
    path = tmp_path / "aligning.toml"
    path.write_text(scenario(AIDED, ensemble={"epoch_s": 5.0}).to_toml(), encoding="utf-8")
    assert run_cli(str(path), "--runs", "4", "--threads", "1", "-o", str(tmp_path / "e")) == 0
    out = capsys.readouterr().out
    for words in ("ANEES by block", "gyro bias", "NIS by sensor", "gnss-velocity", "epochs within the band"):
        assert words in out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--runs", "0"), "runs = 0 must be a whole number from 1"),
        (("--runs", "-5"), "runs = -5"),
        (("--threads", "0"), "threads = 0"),
        (("--until-decided",), "needs a requirement"),
        (("--require", "r95(31 s) <= 1 m"), "31 s lies outside the run, which lasts 30 s"),
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


@pytest.mark.slow
def test_ctrl_c_leaves_a_directory_that_can_be_continued(file: Path, tmp_path) -> None:
    place = tmp_path / "e"
    command = [sys.executable, "-m", "sinssim", "ensemble", str(file), "--runs", "100000", "-q", "-o", str(place)]
    command += ["--threads", "1"]  # groups finish in their order
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
