"""The report of a budget: circles and rate at the end, ranking, requirements, in their units."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.error_budget.budget_exhibits import exhibits_of
from sinssim.charts import Ellipses
from sinssim.recording.page import page_of
from sinssim.recording.track_map import Track
from tests.recording.made_budget import answer, budget
from tests.recording.shown import chart_of, marks_of
from tests.recording.spies import cells, read


@pytest.fixture
def page() -> str:
    answers = (answer("r95(end) <= 500 km", 600e3, 7200.0), answer("cep(1800 s) <= 800 km", 588705.0, 1800.0))
    return page_of(exhibits_of(budget(), answers, (0.0,)))


def test_circles_and_rate_at_the_end(page: str) -> None:
    """σ = 250 km: CEP 1.17741 σ, R95 2.44775 σ; over two hours 611.94 km/1.852/2 = 165.2 nmi/h."""
    assert (
        "After 7200 s, half of all runs are within 294.4 km (CEP) and 95 % within 611.9 km (R95), 165.2 nmi/h as R95 "
        "divided by the time since the start." in read(page)
    )
    assert read(page).count("sea &amp; air: covariance budget") == 2  # title and heading
    assert "Errors of inertial navigation over all possible runs" in page
    assert "with the filter" not in page


def test_charts_in_their_places(page: str) -> None:
    """Each chart follows its heading."""
    places = [page.index(text) for text in (
        ">Growth of the error<", ">CEP and R95<", ">Horizontal position: shares of the sources<",
        ">What to improve first, at the end, 7200 s<", ">Decrease of R95 if this source were halved<",
        ">What to improve first, where R95 is largest, at 1800 s<", ">Position, velocity and attitude<",
        ">σ of the position [km]<",
    )]  # fmt: skip
    assert places == sorted(places)
    assert page.count(">R95 from this source alone<") == 2
    assert page.count('class="charts"') == 4


def test_the_ellipses_of_all_runs_on_the_map() -> None:
    """With σ = 250 km in all directions they are circles of R95, 611.94 km."""
    world = {"truth": SimpleNamespace(ellipsoid="wgs84"), "aiding": None, "flight": None, "track": None}
    track = Track("true", np.array([0.0, 7200.0]), np.array([0.8, 0.85]), np.zeros(2), "truth")
    scenario = SimpleNamespace(**vars(budget().scenario) | world)
    shown = exhibits_of(replace(budget(), scenario=scenario, track=track))
    (ellipses,) = marks_of(chart_of(shown, "map"), Ellipses)
    assert np.linalg.norm(ellipses.axes[-1], axis=1) == pytest.approx([611.94e3] * 2, rel=1e-4)
    assert "map" not in {chart.key for charts in exhibits_of(budget()).charts() for chart in charts}


def test_rankings_at_the_end_and_at_the_largest(page: str) -> None:
    """Without three quarters of 0.64 of the mean square, √0.52 of R95 is left; without those of 0.36, √0.73."""
    rows = cells(page)
    heads = ["source", "group", "value", "unit", "share", "R95 alone, km", "R95 decrease if halved, km", ""]
    at = [k for k, row in enumerate(rows) if row == heads]
    assert len(at) == 2
    assert rows[at[0] + 1 : at[0] + 3] == [
        ["gyro_bias", "gyros", "0.03", "deg/h", "64.00 %", "489.5", "170.7", ""],
        ["accel_bias", "accelerometers", "450", "µg", "36.00 %", "367.2", "89.1", ""],
    ]
    assert rows[at[1] + 1 : at[1] + 3] == [
        ["accel_bias", "accelerometers", "450", "µg", "64.00 %", "979.1", "341.3", ""],
        ["gyro_bias", "gyros", "0.03", "deg/h", "36.00 %", "734.3", "178.2", ""],
    ]
    assert page.count("1 source below 0.01 % of the mean square.") == 2


def test_requirements_and_what_each_source_may_be(page: str) -> None:
    text = read(page)
    assert "r95(end) &lt;= 500 km: not met Radius of the circle that contains 95 % of all runs" in text
    assert '<span class="missed">not met</span>' in page
    assert '<span class="met">met</span>' in page
    assert "It is 600 km at 7200 s, 100 km (20 %) above the limit." in text
    assert "It is 588.7 km at 1800 s, 211.3 km (26.4 %) below the limit." in text
    rows = cells(page)
    first = rows.index(["source", "now", "at most", ""])
    assert rows[first + 1 : first + 4] == [
        ["accel_bias", "450 µg", "337.5 µg", "0.75 times the present value"],
        ["gyro_bias", "0.03 deg/h", "–", "not even at zero, because the other sources give 120 km"],
        ["initial_height", "–", "any", "more than 1000 times the present value"],
    ]


def test_errors_at_selected_times(page: str) -> None:
    """Root mean squares: position in km, velocity in mm/s, attitude in arcmin (1e-4 rad is 0.3438′)."""
    rows = cells(page)
    first = next(k for k, row in enumerate(rows) if row[0] == "t, s")
    assert rows[first] == [
        "t, s", "CEP, km", "R95, km", "north, km", "east, km", "down, km", "v north, mm/s", "v east, mm/s",
        "v down, mm/s", "tilt n, arcmin", "tilt e, arcmin", "heading, arcmin",
    ]  # fmt: skip
    shown = {row[0]: row[1:] for row in rows[first + 1 : first + 4]}
    assert shown["0"] == ["0"] * 11
    assert shown["1800"] == ["588.7", "1224", "500", "500", "0.002333", "3.333", "6.667", "10", "0.1146", "0.2292",
                             "0.4584"]  # fmt: skip
    assert shown["7200"] == ["294.4", "611.9", "250", "250", "0.007", "10", "20", "30", "0.3438", "0.6875", "1.375"]


def test_the_notes_are_those_of_the_result(page: str) -> None:
    assert "Dotted: the covariance of the filter." not in page
    assert "Sources “from one run” are computed" in page
    aided = page_of(exhibits_of(budget("filter")))
    assert "Dotted: the covariance of the filter." in aided
