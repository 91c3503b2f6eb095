"""The study of a recorded drive and its simulated twin, as a user runs it."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet

from sinssim.scenario import load_scenario

ROOT = Path(__file__).parents[3]
STUDY = ROOT / "scenarios" / "recorded_and_simulated.py"
DRIVE = ROOT / "tests" / "data" / "drive" / "drive.toml"


def study(folder: Path, monkeypatch: pytest.MonkeyPatch, *arguments: object) -> dict[str, Any]:
    """Run the study and return its summary."""
    monkeypatch.syspath_prepend(str(STUDY.parent))
    monkeypatch.setattr(sys, "argv", [STUDY.name, *map(str, arguments), "-o", str(folder)])
    runpy.run_path(str(STUDY), run_name="__main__")
    return dict(json.loads((folder / "summary.json").read_text()))


@pytest.mark.slow
def test_a_short_part_of_the_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Twenty-four seconds, one outage, the noise as told: both sides are run, written and compared."""
    (tmp_path / "log.toml").write_text(load_scenario(DRIVE, ["log.to_s=24"]).to_toml(), encoding="utf-8")
    monkeypatch.setattr("sinssim.recording.figures.save", lambda figure, path: None)
    out = tmp_path / "out"
    options = ("--as-told", "--runs", 1, "--length-s", 5, "--every-s", 60, "--first-s", 18)
    summary = study(out, monkeypatch, tmp_path / "log.toml", *options)
    assert (summary["recorded"]["outages"], summary["simulated"]["outages"]) == (1, 1)
    twin = load_scenario(out / "simulated.toml")
    assert twin.log is None
    assert twin.track is not None
    assert twin.imu.gyro_arw_deg_sqrt_h == 6.0
    assert twin.aiding is not None
    # the simulated readings are those of the same motion: the same rotation within a second
    turn = []
    for side in ("simulated", "recorded"):
        rows = parquet.read_table(out / side / "streams" / "imu_measured.parquet").to_pydict()
        turn.append(np.interp(np.arange(1.0, 23.0), rows["time_s"], np.cumsum(rows["dtheta_z_rad"])))
    apart = np.diff(turn[0]) - np.diff(turn[1])
    assert np.abs(np.diff(turn[1])).max() > 0.1, "the car turns"
    assert np.sqrt(np.mean(apart**2)) < 0.01  # biases of some 0.2 °/s, and 0.1 ° of random walk
    shown = capsys.readouterr().out
    assert "| horizontal error at the end, median [m] |" in shown


@pytest.mark.slow
@pytest.mark.rendered
def test_outage_errors_of_both_sides_are_of_one_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The whole slice, with the search for the noise: medians within a factor of 1.5 (docs/validation.md)."""
    summary = study(tmp_path, monkeypatch)
    assert summary["recorded"]["outages"] == 10
    ratio = summary["simulated"]["median_m"] / summary["recorded"]["median_m"]
    assert 1.0 / 1.5 < ratio < 1.5
    spread = summary["simulated"]["sigma_rms_m"] / summary["recorded"]["sigma_rms_m"]
    assert spread == pytest.approx(1.0, abs=0.1)
    for sensor, value in summary["recorded"]["innovation_over_sigma"].items():
        assert 0.7 < value < 1.3, sensor
    for suffix in ("png", "svg"):
        assert (tmp_path / f"recorded_and_simulated.{suffix}").stat().st_size > 10_000
