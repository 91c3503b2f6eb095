"""The lock-in study as a user runs it: every closed form met, every file written."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest

STUDY = Path(__file__).parents[3] / "scenarios" / "lock_in.py"


def study(folder: Path, monkeypatch: pytest.MonkeyPatch, *options: str) -> dict[str, Any]:
    """Run the study and return its summary."""
    monkeypatch.setattr(sys, "argv", ["lock_in.py", "-o", str(folder), *options])
    monkeypatch.syspath_prepend(str(STUDY.parent))
    runpy.run_path(str(STUDY), run_name="__main__")
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return summary


def check(summary: dict[str, Any]) -> None:
    """The random walk within its standard errors of the formula, and the responses those of the closed forms."""
    dithers = [row["dither_deg_s"] for row in summary["random_walk"] if row["frequency_hz"] == 400.0]
    assert max(dithers) / min(dithers) == pytest.approx(10.0)
    for row in summary["random_walk"]:
        assert abs(row["ratio"] - 1.0) < 3.5 * row["standard_error"]
        assert row["ratio"] == pytest.approx(1.0, abs=max(0.10, 3.0 * row["standard_error"]))
    assert summary["transfer"]["undithered_departure"] < 2e-3
    assert summary["transfer"]["dithered_score"] < 4.0
    # locked: what turns is not seen; random: the square root of time
    growth = summary["growth"]
    assert growth["none_arcsec"] > 0.9 * growth["locked_arcsec"]
    assert growth["both_arcsec"] == pytest.approx(growth["random_walk_arcsec"], rel=0.6)


@pytest.mark.slow
def test_quick_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    # drawing takes a third of the time
    monkeypatch.setattr("sinssim.recording.figures.save", lambda figure, path: None)
    check(study(tmp_path, monkeypatch, "--quick"))
    assert (tmp_path / "recording.rrd").stat().st_size > 10_000
    assert "| 1.61482 |" in (tmp_path / "summary.md").read_text()
    assert "sinssim view" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.rendered
def test_whole_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    summary = study(tmp_path, monkeypatch)
    check(summary)
    assert len(summary["random_walk"]) == 10
    for kind, zone in (("both", 0.0), ("one", 6.083), ("none", 10.735)):
        row = summary["dead_zones"][kind]
        assert row["half_width_arcsec_s"] == pytest.approx(zone, abs=1e-3)
        assert row["departure_arcsec_s"] < 1.2
    assert summary["growth"]["one_arcsec"] > 0.9 * summary["growth"]["locked_arcsec"]
    for name in ("response", "growth", "random_walk"):
        for suffix in ("png", "svg"):
            assert (tmp_path / f"{name}.{suffix}").stat().st_size > 10_000
