"""Scored solutions and axes of views, from numbers that are chosen."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.experiments.run import run_scores
from sinssim.recording.rerun.views import RunInfo
from sinssim.strapdown.navigation_error import NavError
from tests.recording.spies import Drawn

ARCSEC = np.pi / 648_000.0
TIME = np.array([5.0, 6.0, 8.0])
PLACE = np.array([[3.0, 4.0, 9.0], [-6.0, 8.0, -7.0], [5.0, -12.0, 2.0]])
SPEED = np.array([[0.01, 0.02, -0.03], [0.02, -0.04, 0.01], [0.03, 0.01, 0.02]])
TILT = np.array([[2.0, 3.0, 6.0], [-4.0, 8.0, 50.0], [20.0, -40.0, 30.0]])
KEYS = ("position_north", "position_east", "height", "velocity_north", "velocity_east", "velocity_down", "tilt_north",
        "tilt_east", "azimuth")  # fmt: skip


def test_errors_and_sigmas_of_scored_solutions() -> None:
    """Height upwards; m, mm/s and arcsec; ±3σ in the same units."""
    error = NavError(TIME, PLACE, SPEED, TILT * ARCSEC)
    drawn: Any = Drawn()
    colors = {"mine": (1, 2, 3), "run": (4, 5, 6)}
    labels = run_scores._draw_errors(drawn, {"mine": error, "run": error}, colors, {"mine"})
    assert labels == {"position": "m", "height": "m", "velocity": "mm/s", "attitude": "arcsec"}
    values = np.column_stack((PLACE[:, :2], -PLACE[:, 2], 1e3 * SPEED, TILT))
    for number, name in enumerate(("mine", "run")):
        for k, key in enumerate(KEYS):
            drawn.shows(f"score/{key}/{number}", [name], TIME, values[:, k : k + 1], [colors[name]])
        drawn.shows(f"score/horizontal/{number}", [name], TIME, [[5.0], [10.0], [13.0]], [colors[name]])
    assert [drawn.lines[f"score/height/{n}"][4] for n in (0, 1)] == [1.5, 2.7]
    sigma = np.abs(np.column_stack((PLACE, SPEED, TILT * ARCSEC)))
    run_scores._draw_sigma(drawn, 1, "run", TIME, sigma, labels, (0, 100, 200))
    size = [1.0, 1.0, 1.0, 1e3, 1e3, 1e3, *[1.0 / ARCSEC] * 3]
    for k, key in enumerate(KEYS):
        bound = 3.0 * sigma[:, k] * size[k]
        names = ["run, ±3σ", ""]
        drawn.shows(f"score/{key}/1_sigma", names, TIME, np.stack((bound, -bound), 1), [(90, 130, 170)] * 2)


def test_the_order_of_drawing() -> None:
    """The largest error lies below; of two that are alike, the run's own."""
    numbers: Any = {name: {"rms_horizontal_error_m": rms} for name, rms in
                    (("a", 10.0), ("theirs", 100.0), ("own", 101.0), ("b", 5000.0))}  # fmt: skip
    assert run_scores._drawing_order(numbers, {"theirs"}) == ["b", "own", "theirs", "a"]


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
