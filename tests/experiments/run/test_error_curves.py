"""Tables and plots of the errors: every component, unit, sign, mark and limit from errors that are chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.charts import Line
from sinssim.experiments.run.error_exhibits import (
    _explanation,
    error_exhibits,
    error_table,
    failure_exhibits,
    note_on_errors,
    singularity_exhibits,
)
from sinssim.strapdown.navigation_error import NavError
from tests.recording.spies import Shown, cells, html, read

BLUE, ORANGE, GREY = "#56b4e9", "#e69f00", "#8c8c8c"
ARCSEC, ARCMIN = np.pi / 648_000.0, np.pi / 10_800.0
TIME = np.array([100.0, 1900.0, 7300.0])
FIRST = NavError(
    TIME,
    np.array([[3.0, -4.0, 7.0], [-60.0, 80.0, -30.0], [500.0, 1200.0, 45.0]]),
    np.array([[0.02, -0.03, 0.06], [0.2, 0.3, -0.6], [-0.4, 0.6, 1.2]]),
    np.array([[2.0, 3.0, 6.0], [-4.0, 8.0, 80.0], [20.0, -40.0, 160.0]]) * ARCSEC,
)
OTHER = NavError(TIME[::2], 2.0 * FIRST.position_ned[::2], 3.0 * FIRST.velocity_ned[::2], 0.5 * FIRST.attitude[::2])


def run(*errors: NavError, axes: str = "north") -> Any:
    return SimpleNamespace(time=TIME, axes=axes, errors=dict(zip(("quaternion", "poisson"), errors, strict=False)))


def test_every_component_has_its_plot_and_unit() -> None:
    """√(3² + 4²) = 5 …; √(0.02² + 0.03² + 0.06²) = 0.07 …; 7″, √(4² + 8² + 80²) = 80.498447″ …"""
    shown = Shown(error_exhibits(run(FIRST, OTHER), 5000.0))
    page, plots = shown.html, list(shown.charts.values())
    a, b = ("quaternion", BLUE, TIME), ("poisson", ORANGE, TIME[::2])
    angle = np.array([7.0, np.sqrt(6480.0), np.sqrt(27600.0)]) / 60.0
    expected = [
        ("Horizontal position error", "m", [5.0, 100.0, 1300.0], [10.0, 2600.0]),
        ("North position error", "m", [3.0, -60.0, 500.0], [6.0, 1000.0]),
        ("East position error", "m", [-4.0, 80.0, 1200.0], [-8.0, 2400.0]),
        ("North velocity error", "m/s", [0.02, 0.2, -0.4], [0.06, -1.2]),
        ("East velocity error", "m/s", [-0.03, 0.3, 0.6], [-0.09, 1.8]),
        ("Tilt about north, φN", "arcsec", [2.0, -4.0, 20.0], [1.0, 10.0]),
        ("Tilt about east, φE", "arcsec", [3.0, 8.0, -40.0], [1.5, -20.0]),
        ("Azimuth misalignment, φD", "arcmin", np.array([6.0, 80.0, 160.0]) / 60.0, np.array([3.0, 80.0]) / 60.0),
        ("Height error (positive: too high)", "m", [-7.0, 30.0, -45.0], [-14.0, -90.0]),
        ("Velocity error, magnitude", "m/s", [0.07, 0.7, 1.4], [0.21, 4.2]),
        ("Attitude error, angle", "arcmin", angle, 0.5 * angle[::2]),
    ]
    assert len(plots) == 13
    down = plots.pop(11)  # only in the recording
    shown.curves(
        down.key, "Down velocity error", "m/s", (*a, [0.06, -0.6, 1.2]), (*b, [0.18, 3.6]),
    )  # fmt: skip
    for found, (title, unit, one, two) in zip(plots, expected, strict=False):
        # 1 nmi/h from the beginning of the run: two hours are 3704 m
        mile = [("1 nmi/h", GREY, [100.0, 7300.0], [0.0, 3704.0])] if title.startswith("Horizontal") else []
        shown.curves(found.key, title, unit, *mile, (*a, one), (*b, two))
        assert shown.span(found.key) == (100.0, 7300.0)
        assert shown.rules(found.key) == [(2600.0, "T/2 = 41.7 min"), (5100.0, "T = 83.3 min")]
        assert (found.y.low == 0.0) == any(w in title for w in ("Horiz", "magnitude", "angle"))
        assert [line.dash for line in found.marks if isinstance(line, Line)][-2:] == ["", "--"]
    assert not plots[0].marks[0].counts  # type: ignore[union-attr]
    apart = plots[11]  # the instants common to both; ‖(3, −4, 7)‖ = √74, ‖(500, 1200, 45)‖ = √1692025
    shown.curves(apart.key, "Distance of poisson from quaternion", "m", (*b, np.sqrt([74.0, 1692025.0])))
    assert apart.y.low == 0.0
    assert apart.marks[0].dash == "--"  # type: ignore[union-attr]
    assert "is 83.33 min here; dotted lines mark it and its half." in page
    assert "within 1° of a pole" not in page


def test_one_solution_of_millimetres_near_a_pole() -> None:
    small = NavError(TIME, 1e-4 * FIRST.position_ned, 0.01 * FIRST.velocity_ned, np.full((3, 3), np.nan))
    shown = Shown(error_exhibits(run(small, axes="transported"), 5000.0))
    assert "The run comes within 1° of a pole" in shown.html
    assert [(found.title, found.unit(True)[0]) for found in shown.charts.values()] == [
        ("Horizontal position error", "mm"), ("North position error", "mm"), ("East position error", "mm"),
        ("North velocity error", "mm/s"), ("East velocity error", "mm/s"), ("Height error (positive: too high)", "mm"),
        ("Velocity error, magnitude", "mm/s"), ("Down velocity error", "mm/s"),
    ]  # fmt: skip
    shown.curves(
        "navigation/horizontal", "Horizontal position error", "mm", ("quaternion", BLUE, TIME, [0.5, 10.0, 130.0])
    )


@pytest.mark.parametrize(
    ("length", "words"),
    [
        (2499.0, "the run is shorter than half a period."),
        (2500.0, "dotted lines mark it and its half."),
        (29_999.0, "dotted lines mark it and its half."),
        (30_000.0, "dotted lines mark its multiples."),
    ],
)
def test_what_the_dotted_lines_are(length: float, words: str) -> None:
    assert words in next(_explanation(5000.0, length)).text


def statistics(horizontal: Any, height: Any, velocity: Any, attitude: Any) -> dict[str, Any]:
    keys = ("horizontal_error_m", "height_error_m", "velocity_error_mps", "attitude_error_arcsec")
    groups = zip(keys, (horizontal, height, velocity, attitude), strict=True)
    return {f"{kind}_{key}": value for key, three in groups
            for kind, value in zip(("final", "rms", "max"), three, strict=True)}  # fmt: skip


def test_the_table_of_errors_is_in_the_units_of_its_plots() -> None:
    """mm up to 0.5 m, km beyond 100 km; arcmin from a minute to two degrees."""
    numbers = {
        "poisson": statistics((90_000.0, 60_000.0, 150_000.0), (-0.02, 0.03, 0.05), (0.011, 0.012, 0.013),
                              (30.0, 60.0, 7200.0)),
        "quaternion": statistics((1.0, 2.0, 3.0), (0.1, 0.2, 0.45), (None,) * 3, (6.0, 12.0, 18.0)),
    }  # fmt: skip
    page = html(error_table(numbers), note_on_errors("reference", "x.json"))
    heads, kinds, *rows = cells(page)
    assert heads == ["", "horizontal [km]", "height [mm]", "velocity [mm/s]", "attitude [arcmin]"]
    assert kinds == ["algorithm", *["final", "rms", "max"] * 4]
    assert rows == [
        ["poisson", "90", "60", "150", "−20", "30", "50", "11", "12", "13", "0.5", "1", "120"],
        ["quaternion", "0.001", "0.002", "0.003", "100", "200", "450", "–", "–", "–", "0.1", "0.2", "0.3"],
    ]  # fmt: skip
    assert page.index(ORANGE) < page.index("poisson") < page.index(BLUE) < page.index("quaternion")
    text = read(page)
    assert "Solution minus reference, in the local level of the latter." in text
    assert text.endswith("Full precision: x.json.")


def test_passages_and_failures() -> None:
    found: Any = {
        "euler": [
            {"start_s": 1.234, "end_s": 5.678, "damage_arcsec": 90.0, "text": "euler: pitch went through 90°"},
            {"start_s": 61.0, "end_s": 62.5, "damage_arcsec": None, "text": "once <more>"},
        ],
        "other": [{"start_s": 7.0, "end_s": 8.0, "damage_arcsec": 3.0, "text": "other: too"}],
    }
    assert cells(html(*singularity_exhibits(found))) == [
        ["algorithm", "from, s", "to, s", "damage, arcmin", ""],
        ["euler", "1.23", "5.68", "1.5", "pitch went through 90°"],
        ["euler", "61.00", "62.50", "–", "once &lt;more&gt;"],
        ["other", "7.00", "8.00", "0.05", "too"],
    ]
    assert "No algorithm passed" in html(*singularity_exhibits({}))
    assert (
        read(html(*failure_exhibits({"a<b": {"time_s": None, "text": "its errors grew."}})))
        == "a&lt;b has no result. Its errors grew."
    )
