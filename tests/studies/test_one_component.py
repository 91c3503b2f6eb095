"""Figure 8.4: what it shows, and that it is drawn whole."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from sinssim.studies.one_component import ACCELEROMETER_BIAS, GYRO_DRIFT, draw_figure_8_4, error_runs


def test_runs_show_the_closed_forms() -> None:
    time, by_accelerometer, by_gyro = error_runs()
    assert time[-1] == 8000.0
    w = np.sqrt(9.81 / 6371000.0)
    expected = ACCELEROMETER_BIAS / 9.81 * (1.0 - np.cos(w * time))
    assert np.abs(by_accelerometer - expected).max() < 1e-6 * expected.max()
    expected = GYRO_DRIFT * (time - np.sin(w * time) / w)
    assert np.abs(by_gyro - expected).max() < 1e-6 * expected.max()


def test_the_script_says_how_near_they_are(tmp_path: Path) -> None:
    script = Path(__file__).parents[2] / "scenarios" / "one_component.py"
    command = [sys.executable, str(script), "-o", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    apart = [float(x) for x in re.findall(r"differ by (\S+) of", done.stdout)]
    assert len(apart) == 2
    assert max(apart) < 1e-6
    assert (tmp_path / "figure_8_4.png").is_file()


def test_figure_is_drawn(tmp_path: Path) -> None:
    svg, png = draw_figure_8_4(tmp_path / "figures")
    assert ElementTree.parse(svg).getroot().tag.endswith("svg")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in svg.parent.iterdir()) == ["figure_8_4.png", "figure_8_4.svg"]
