"""Figure 8.4: what it shows, and that it is drawn whole."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from sinssim.charts import Line

SCRIPT = Path(__file__).parents[3] / "scenarios" / "one_component.py"


def test_runs_show_the_closed_forms() -> None:
    script = runpy.run_path(str(SCRIPT))
    time, by_accelerometer, by_gyro = script["error_runs"]()
    assert time[-1] == 8000.0
    w = np.sqrt(9.81 / 6371000.0)
    expected = script["ACCELEROMETER_BIAS"] / 9.81 * (1.0 - np.cos(w * time))
    assert np.abs(by_accelerometer - expected).max() < 1e-6 * expected.max()
    expected = script["GYRO_DRIFT"] * (time - np.sin(w * time) / w)
    assert np.abs(by_gyro - expected).max() < 1e-6 * expected.max()


def test_panel_b_has_both_components_of_8_15() -> None:
    """The line Δω₀ t and the oscillation −Δω₀ sin(ω_s t)/ω_s; their sum is the curve."""
    _, (chart,) = runpy.run_path(str(SCRIPT))["figure_8_4"]().rows
    lines = {mark.label: mark.y / chart.unit(True)[1] for mark in chart.marks if isinstance(mark, Line)}
    parts = [lines["Δω₀t"], lines["−Δω₀ sin ωₛt / ωₛ"]]
    assert np.abs(parts[0] + parts[1] - lines["simulation"]).max() < 1e-6
    assert abs(parts[0][-1] - 8000.0 / 3600.0 * 0.01 * 60.0) < 1e-9


@pytest.mark.rendered
def test_the_script_says_how_near_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [SCRIPT.name, "-o", str(tmp_path)])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    apart = [float(x) for x in re.findall(r"differ by (\S+) of", capsys.readouterr().out)]
    assert len(apart) == 2
    assert max(apart) < 1e-6
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure_8_4.png", "figure_8_4.svg"]
    assert ElementTree.parse(tmp_path / "figure_8_4.svg").getroot().tag.endswith("svg")
    assert (tmp_path / "figure_8_4.png").read_bytes().startswith(b"\x89PNG")
