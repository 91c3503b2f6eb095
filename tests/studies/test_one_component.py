"""Figure 8.4: what it shows, and that it is drawn whole."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from sinssim.studies.one_component import ACCELEROMETER_BIAS, GYRO_DRIFT, error_runs


def test_runs_show_the_closed_forms() -> None:
    time, by_accelerometer, by_gyro = error_runs()
    assert time[-1] == 8000.0
    w = np.sqrt(9.81 / 6371000.0)
    expected = ACCELEROMETER_BIAS / 9.81 * (1.0 - np.cos(w * time))
    assert np.abs(by_accelerometer - expected).max() < 1e-6 * expected.max()
    expected = GYRO_DRIFT * (time - np.sin(w * time) / w)
    assert np.abs(by_gyro - expected).max() < 1e-6 * expected.max()


def test_the_script_says_how_near_they_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    script = Path(__file__).parents[2] / "scenarios" / "one_component.py"
    monkeypatch.setattr("sys.argv", ["one_component.py", "-o", str(tmp_path / "figures")])
    runpy.run_path(str(script), run_name="__main__")
    apart = [float(x) for x in re.findall(r"differ by (\S+) of", capsys.readouterr().out)]
    assert len(apart) == 2
    assert max(apart) < 1e-6
    svg, png = (tmp_path / "figures" / f"figure_8_4.{kind}" for kind in ("svg", "png"))
    assert ElementTree.parse(svg).getroot().tag.endswith("svg")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in svg.parent.iterdir()) == ["figure_8_4.png", "figure_8_4.svg"]
