"""docs/api.md lists every public name, and its code gives what it says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim

PAGE = (Path(__file__).parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
CODE = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_every_public_name_is_listed() -> None:
    listed = {name for row in re.findall(r"^\| (.+?) \|", PAGE, re.MULTILINE) for name in re.findall(r"`(\w+)`", row)}
    assert listed == set(sinssim.__all__)


def test_the_first_example(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    exec(CODE[0], names)
    assert capsys.readouterr().out.startswith("Run(parked: finished; 0 … 60 s;")
    np.testing.assert_array_equal(names["truth"]["height_m"], names["run"].truth.state.height)


def test_a_motion_of_ones_own() -> None:
    """The velocity is the meridian's radius times the rate of the latitude; the solution returns to the motion."""
    names: dict[str, Any] = {}
    exec(CODE[1], names)
    curve, latitude = names["curve"], np.radians(50.0) + 0.5e-7 * 60.0**2
    e2, a = 0.00669437999014, 6378137.0
    meridian = a * (1.0 - e2) / (1.0 - e2 * np.sin(latitude) ** 2) ** 1.5
    north, east, down = curve.state(60.0).velocity_ned
    assert north == pytest.approx((meridian + 300.0) * 1e-7 * 60.0, rel=1e-7)
    assert abs(east) < 1e-6
    assert abs(down) < 1e-4
    assert names["error"].horizontal.max() < 1e-4
