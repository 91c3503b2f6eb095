"""Scored solutions and axes of views, from numbers that are chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.run import run_scores
from sinssim.recording.rerun_views import RunInfo
from sinssim.strapdown.navigation_error import NavError
from tests.recording.spies import record

ARCSEC = np.pi / 648_000.0
TIME = np.array([5.0, 6.0, 8.0])
PLACE = np.array([[3.0, 4.0, 9.0], [-6.0, 8.0, -7.0], [5.0, -12.0, 2.0]])
SPEED = np.array([[0.01, 0.02, -0.03], [0.02, -0.04, 0.01], [0.03, 0.01, 0.02]])
TILT = np.array([[2.0, 3.0, 6.0], [-4.0, 8.0, 50.0], [20.0, -40.0, 30.0]])
KEYS = ("position_north", "position_east", "height", "velocity_north", "velocity_east", "velocity_down", "tilt_north",
        "tilt_east", "azimuth")  # fmt: skip


def test_errors_and_sigmas_of_scored_solutions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Height upwards; m, mm/s and arcsec; ±3σ in the same units."""
    error = NavError(TIME, PLACE, SPEED, TILT * ARCSEC)
    sigma = np.abs(np.column_stack((PLACE, SPEED, TILT * ARCSEC)))
    monkeypatch.setattr(run_scores, "_drawing_order", lambda of: ["mine", "run"])
    monkeypatch.setattr(run_scores, "_sigma", lambda of, name: (TIME, sigma) if name == "run" else None)
    monkeypatch.setattr(run_scores.style, "colors", lambda names: [{"mine": (1, 2, 3), "run": (0, 100, 200)}[n]
                                                                   for n in names])  # fmt: skip
    drawn: Any = SimpleNamespace(errors={"mine": error, "run": error})
    of: Any = SimpleNamespace(numbers=["run", "mine"], theirs={"mine": None}, drawn=drawn, span=(5.0, 8.0))
    found = record([run_scores.score_charts(of)])
    units = {key: found.labels[f"score/{key}"] for key in KEYS}
    assert [units[key] for key in KEYS] == ["m"] * 3 + ["mm/s"] * 3 + ["arcsec"] * 3
    values = np.column_stack((PLACE[:, :2], -PLACE[:, 2], 1e3 * SPEED, TILT))
    size = [1.0, 1.0, 1.0, 1e3, 1e3, 1e3, *[1.0 / ARCSEC] * 3]
    pale, colors = (90, 130, 170), [(1, 2, 3), (0, 100, 200)]
    for k, key in enumerate(KEYS):
        bound = 3.0 * sigma[:, k] * size[k]
        both = np.stack((bound, -bound, values[:, k], values[:, k]), 1)
        found.shows(f"score/{key}", ["run, ±3σ", "run, ±3σ", "mine", "run"], TIME, both, [pale, pale, *colors])
    horizontal = np.array([[5.0], [10.0], [13.0]]) * [1.0, 1.0]
    found.shows("score/horizontal", ["mine", "run"], TIME, horizontal, colors)
    assert found.lines["score/height"][4][2] < found.lines["score/height"][4][3]


def test_the_order_of_drawing() -> None:
    """The largest error lies below; of two that are alike, the run's own."""
    numbers: Any = {name: {"rms_horizontal_error_m": rms} for name, rms in
                    (("a", 10.0), ("theirs", 100.0), ("own", 101.0), ("b", 5000.0))}  # fmt: skip
    of: Any = SimpleNamespace(numbers=numbers, theirs={"theirs": None})
    assert run_scores._drawing_order(of) == ["b", "own", "theirs", "a"]


def test_axes_of_views() -> None:
    """A quarter of room after the run; the range of several entities; the legend in the corner away from zero."""
    run = RunInfo("x", 20.0, 120.0, (), ranges={"a": (-3.0, 2.0), "b": (-1.0, 5.5)})
    assert run.range_of("a", "b", "c") == (-3.0, 5.5)
    assert run.range_of("c") == (0.0, 0.0)
    span = run.axis_x(0.25).view_range.as_arrow_array().to_pylist()[0]
    assert (span["start"], span["end"]) == (20 * 10**9, 145 * 10**9)
    assert (run.corner("a").name, run.corner("a", "b").name) == ("LeftBottom", "LeftTop")
    assert run.application == "sinssim x"
    axis = run.axis_y("a", "b")
    assert axis is not None
    # from −3 to 5.5 with a margin of a twentieth at both ends
    np.testing.assert_allclose(axis.range.as_arrow_array().to_pylist()[0], [-3.425, 5.925])
