"""The page that adds a part of a run: the numbers of a drive, a run without it, the files counted."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.extending.pages import Copy, read_page
from tests.slow import slow

RATE = """
import numpy as np

ideal = run.truth.ideal
rate = ideal.dtheta * scenario.imu.rate_hz
print(float(np.degrees(np.sqrt((rate**2).sum(axis=1)).max())))
"""
OTHERS = """
print("loads" in sinssim.run("parked", overrides=["parked.duration_s=5"]).summary)
aided = sinssim.run(scenario.model_copy(update={"aiding": None}), overrides=["filter={}", "aiding.gnss={}"])
print(aided.summary["loads"] == run.summary["loads"], "specific_force" in vars(aided.parts["loads"]))
"""


@pytest.mark.parametrize("others", [False, *slow(True)])
def test_page(tmp_path: Path, others: bool) -> None:
    """The force is gravity at rest and hardly more under way; arrays are let go of before a filter."""
    page = read_page("run-part")
    copy = Copy(tmp_path)
    copy.apply(page)
    assert copy.touched == ["sinssim/experiments/run/parts/__init__.py", "sinssim/experiments/run/parts/loads.py"]
    numbers, force, rate, *more = copy.run(page.snippets[0] + RATE + others * OTHERS).splitlines()
    found = ast.literal_eval(numbers)
    assert found["max_specific_force_g"] * 9.80665 == pytest.approx(float(force))
    assert 9.8 < float(force) < 12.0
    assert found["max_rate_deg_s"] == pytest.approx(float(rate), rel=1e-9)
    assert more == ["False", "True False"] * others
