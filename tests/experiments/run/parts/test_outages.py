"""Outages in a run's report: table, growth since the last fix, errors at the ends."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.charts import Dots
from sinssim.experiments.run.parts.judged_outages import JudgedOutages, Outages
from tests.recording.spies import Shown, cells, read

AIDED, BOUND = "#0072b2", "#969696"


def outage(begin: float, end: float, at: float, *values: float | None, smoothed: float | None = None) -> Any:
    keys = ("horizontal_error_m", "horizontal_sigma_m", "height_error_m", "velocity_error_mps")
    more = {} if smoothed is None else {"smoothed_max_horizontal_error_m": smoothed}
    return {"from_s": begin, "to_s": end, "at_s": at, **dict(zip(keys, values, strict=True)), **more}


EACH = [
    outage(300.0, 345.5, 345.0, 30.0, 12.5, -4.25, 0.75, smoothed=2.125),
    outage(100.0, 130.0, 129.0, 8.0, 6.5, 1.75, None, smoothed=1.5),
]
NUMBERS = {
    "each": EACH, "against": "the <fixes>", "error_over_sigma": 1.7,
    "median": {"horizontal_error_m": 19.0, "horizontal_sigma_m": 9.5, "height_error_m": 3.0, "velocity_error_mps": 0.75,
               "smoothed_max_horizontal_error_m": 1.8125},
    "p90": {"horizontal_error_m": 27.8, "horizontal_sigma_m": 11.9, "height_error_m": 4.0, "velocity_error_mps": None,
            "smoothed_max_horizontal_error_m": 2.0625},
}  # fmt: skip


def shown(numbers: dict[str, Any], *growth: tuple[list[float], list[float]]) -> Shown:
    navigated: Any = SimpleNamespace(time=np.array([50.0, 200.0, 400.0]))
    part = Outages(navigated, entry=numbers)
    vars(part)["judged"] = JudgedOutages({}, tuple((np.array(time), np.array(error)) for time, error in growth))
    return Shown(part.exhibits())


def test_table_and_plots() -> None:
    growth = [([0.0, 20.0], [1.0, 7.0]), ([3.0], [9.0]), ([0.0, 10.0, 45.0], [2.0, 5.0, 33.0])]
    found = shown(NUMBERS, *growth)
    assert cells(found.html) == [
        ["from … to, s", "horizontal, m", "1σ of the filter, m", "height, m", "velocity, m/s", "smoothed, largest, m"],
        ["100 … 130", "8.00", "6.50", "1.75", "–", "1.50"],
        ["300 … 345.5", "30.0", "12.5", "−4.25", "0.750", "2.12"],
        ["median", "19.0", "9.50", "3.00", "0.750", "1.81"],
        ["90 %", "27.8", "11.9", "4.00", "–", "2.06"],
    ]  # fmt: skip
    assert "at which the &lt;fixes&gt; is known" in found.html
    assert read(found.html).startswith("2 outages: horizontal error at the end 19.0 m (median), 27.8 m (90 %)")
    found.curves("outages/growth", "Horizontal error since the last fix", "m",
                 ("one line an outage", AIDED, *growth[0]), ("", AIDED, *growth[2]))  # fmt: skip
    assert found.span("outages/growth") == (0.0, 45.5)
    found.curves("outages/ends", "Horizontal error at the end of each outage", "m",
                 ("at the end", AIDED, [345.0, 129.0], [30.0, 8.0]),
                 ("1σ of the filter", BOUND, [345.0, 129.0], [12.5, 6.5]))  # fmt: skip
    assert found.span("outages/ends") == (50.0, 400.0)
    assert {chart.y.low for chart in found.charts.values()} == {0.0}
    assert all(isinstance(mark, Dots) for mark in found.charts["outages/ends"].marks)


def test_nothing_known() -> None:
    assert read(shown({**NUMBERS, "each": []}).html).startswith("No outage could be evaluated")
    one = {**NUMBERS, "each": EACH[:1], "median": {k: v for k, v in NUMBERS["median"].items() if "smoothed" not in k}}
    found = shown(one)
    assert cells(found.html)[0][-1] == "velocity, m/s"
    assert len(found.charts) == 1
