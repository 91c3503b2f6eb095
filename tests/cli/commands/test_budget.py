"""`sinssim budget` as a stranger meets it: tables, files, JSON, requirements, bad input."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from sinssim.cli import app as cli

SCENARIO = """\
name = "mine"
description = "a parked vehicle"

[parked]
latitude_deg = 50.0
duration_s = 600.0

[imu]
rate_hz = 1.0

[navigation]
vertical = "truth"
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


def test_tables_and_files(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ask = ("--require", "r95(500 s) <= 20 m", "--require", "heading(end) <= 1 arcmin", "--free", "gyro_bias,accel_bias")
    assert call("budget", "mine.toml", *ask) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "What to improve first, at the end, 600 s" in out
    assert "R95 divided by the time since the start" in out
    assert "r95(500 s) <= 20 m: NOT MET" in out
    assert "heading(end) <= 1 arcmin: met" in out
    assert "by the common factor" in out
    made = folder / "runs" / "mine-budget"
    for name in ("report.html", "budget.json", "budget.parquet", "recording.rrd", "scenario.toml"):
        assert (made / name).is_file()
    page = (made / "report.html").read_text(encoding="utf-8")
    assert page.count('role="img"') == 8  # two of growth, the map, two of the ranking, three of σ
    assert "not met" in page
    rows = pq.read_table(made / "budget.parquet")
    sources = set(rows.column("source").to_pylist())
    assert {"total", "gyro_bias", "accel_bias", "gyro_arw"} <= sources
    total = rows.filter([name == "total" for name in rows.column("source").to_pylist()])
    numbers = json.loads((made / "budget.json").read_text(encoding="utf-8"))
    assert total.column("r95_m").to_pylist()[-1] == pytest.approx(numbers["r95_m"])
    assert total.column("time_s").to_pylist()[-1] == 600.0


def test_the_help_names_the_directory(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("budget", "--help") == 0
    assert "runs/<name>-budget" in " ".join(capsys.readouterr().out.split())


def test_json_says_the_same(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("budget", "mine.toml", "--json", "-o", "here", "--at", "100", "--require", "cep <= 1 km") == 0
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads((folder / "here" / "budget.json").read_text(encoding="utf-8"))
    assert 100.0 in [row["time_s"] for row in found["table"]]
    (answer,) = found["requirements"]
    assert answer["met"]
    assert answer["margin"] == pytest.approx(answer["limit"] - answer["value"])
    (bias,) = [one for one in answer["sources"] if one["sources"] == ["accel_bias"]]
    assert bias["possible"]
    assert bias["largest"][0]["unit"] == "µg"
    squares = sum(source["share_of_horizontal_mean_square"] for source in found["sources"])
    assert squares == pytest.approx(1.0)


def test_quiet_and_overwrite(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    short = ("--set", "parked.duration_s=30")
    assert call("budget", "mine.toml", "-q", *short) == 0
    assert call("budget", "mine.toml", "-q", *short) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "--overwrite" in err
    assert call("budget", "mine.toml", "-q", "--overwrite", *short) == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--require", "r95 1852"], "cannot be read"),
        (["--require", "r95(end) <= 3 deg"], "'deg' is a unit of angle"),
        (
            ["--require", "r95(1 h) <= 1 nmi"],
            "requirement 'r95(1 h) <= 1 nmi': 3600 s lies outside the run, which lasts 600 s",
        ),
        (["--require", "cep <= 1 m", "--free", ""], "--free '' names no source"),
        (["--free", " , "], "--free ' , ' names no source"),
        (["--free", "gyro_bias"], "needs a --require"),
        (["--require", "cep <= 1 m", "--free", "gyro_bais"], "gyro_bias"),
        (["--at", "700"], "700 s lies outside the run"),
        (["--set", "imu.grade=laser"], "laser-standard"),
    ],
)
def test_bad_input_is_refused_by_name(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str
) -> None:
    assert call("budget", "mine.toml", *arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert not (folder / "runs").exists()


def test_a_scenario_without_a_budget(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("budget", "one_component") == 2
    assert "[one_component]" in capsys.readouterr().err
