"""`sinssim run` and `sinssim check` on recorded sensors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sinssim.cli.app import app

DRIVE = str(Path(__file__).parents[2] / "data" / "drive" / "drive.toml")


def sinssim(*arguments: str) -> str:
    """Run a command, and return what it prints."""
    result = CliRunner().invoke(app, list(arguments))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0
    return result.output


SHORT = ["--set", "log.to_s=30.0", "--set", "filter.smooth=false"]


def test_a_run_with_an_outage(tmp_path: Path) -> None:
    shown = sinssim("run", DRIVE, "-o", str(tmp_path / "run"), "--outage", "15:20", *SHORT, "--keep", "report")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    (outage,) = summary["outages"]["each"]
    assert (outage["from_s"], outage["to_s"]) == (15.0, 20.0)
    assert outage["at_s"] == pytest.approx(20.0, abs=0.26)
    assert 0.0 < outage["horizontal_error_m"] < 5.0
    assert "Outages" in (tmp_path / "run" / "report.html").read_text()
    assert "errors against the reference gnss.pos" in shown
    assert "outages: errors at the end, against gnss.pos" in shown
    assert "it has no attitude" in shown


def test_check_reads_the_files() -> None:
    shown = sinssim("check", DRIVE, *SHORT)
    for words in (
        "recorded    gnss-position, 4",
        "gyro bias                   a state",
        "at rest",
        "quality 1 (fixed)",
    ):
        assert words in shown
    found = json.loads(sinssim("check", DRIVE, "--json", *SHORT))
    assert found["expected_duration_s"] == 30
    assert found["scenario"]["imu"]["rate_hz"] == 100.0


def test_an_outage_of_a_simulation_is_refused() -> None:
    from sinssim.errors import InputError

    with pytest.raises(InputError, match="--outage withholds recorded GNSS fixes"):
        sinssim("run", "parked", "--outage", "15:20")
