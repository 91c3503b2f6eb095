"""The curves of a budget in the viewer, from a budget whose σ are chosen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from sinssim.analyses.error_budget.budget_exhibits import exhibits_of
from sinssim.charts import Axis, Chart, Dots, Line, Rule
from sinssim.recording.rerun_exhibits import markdown, record_chart
from sinssim.units import fixed
from tests.recording.made_budget import HALF, MOST, OTHERS, TIME, answer, budget
from tests.recording.spies import Drawn

NORTH, EAST, DOWN = (213, 94, 0), (0, 158, 115), (86, 180, 233)
MET, NOT_MET = (0, 158, 115), (213, 94, 0)
ARCMIN = np.pi / 10_800.0


def test_curves_and_limits_in_the_units_of_their_titles() -> None:
    drawn: Any = Drawn()
    answers = (
        answer("r95(end) <= 500 km", 600e3, 7200.0), answer("cep(1800 s) <= 800 km", 588705.0, 1800.0),
        answer("velocity_east(run) <= 0.025 m/s", 0.02, 7200.0), answer("rate(end) <= 70 m/s", 60.0, 7200.0),
        answer("heading(1800 s) <= 2 arcmin", 3.0 * ARCMIN, 1800.0), answer("cep(run) <= 4000 km", 1.0, 1800.0),
        answer("r95(run) <= 1500 km", 1.0, 1800.0),
    )  # fmt: skip
    for charts in exhibits_of(budget(), answers).charts():
        for chart in charts:
            record_chart(drawn, f"budget/{chart.key}", chart, 0.0)
    total = np.array([0.0, 500.0, 250.0])
    circles = np.column_stack([MOST * total, HALF * total])
    names = ["R95: 95 % of all runs", "CEP: half of all runs"]
    drawn.shows("budget/circles", names, TIME, circles, [(0, 114, 178), (0, 158, 115)])
    third = np.array([0.0, 1.0 / 3.0, 1.0])
    position = np.column_stack([total, total, third * OTHERS[0] / 1e3])
    drawn.shows("budget/sigma/position", ["north", "east", "down"], TIME, position, [NORTH, EAST, DOWN])
    velocity = np.outer(third, OTHERS[1:4]) * 1e3
    drawn.shows("budget/sigma/velocity", ["north", "east", "down"], TIME, velocity, [NORTH, EAST, DOWN])
    attitude = np.outer(third, OTHERS[4:]) / ARCMIN
    drawn.shows("budget/sigma/attitude", ["tilt north", "tilt east", "heading"], TIME, attitude, [NORTH, EAST, DOWN])
    # shares of the mean square: 0.36 and 0.64 at 1800 s, 0.64 and 0.36 at the end; none at an exact start
    names, share = drawn.lines["budget/shares"][2], drawn.lines["budget/shares"][1]
    of = {name: share[:, k].tolist() for k, name in enumerate(names)}
    np.testing.assert_allclose(of["gyros: bias"], [36.0, 64.0], rtol=1e-12)
    np.testing.assert_allclose(of["accelerometers: bias <b>"], [64.0, 36.0], rtol=1e-12)
    alone = drawn.lines["budget/r95_alone"]
    by_name = dict(zip(alone[2], alone[1].T, strict=True))
    np.testing.assert_allclose(by_name["gyros: bias"], MOST * np.array([0.0, 300.0, 200.0]))
    np.testing.assert_allclose(by_name["accelerometers: bias <b>"], MOST * np.array([0.0, 400.0, 150.0]))
    assert dict(zip(alone[2], alone[3], strict=True)).items() <= dict(zip(names, drawn.lines["budget/shares"][3],
                                                                         strict=True)).items()  # fmt: skip
    dots = {name: (one[0].tolist(), one[1].tolist(), one[2], one[3], one[4]) for name, one in drawn.dots.items()}
    # 70 m/s over two hours are 504 km
    assert dots == {
        "budget/circles/limit_1": ([7200.0], [[500.0]], ["r95(end) <= 500 km: not met"], NOT_MET, "down"),
        "budget/circles/limit_2": ([1800.0], [[800.0]], ["cep(1800 s) <= 800 km: met"], MET, "down"),
        "budget/circles/limit_3": ([7200.0], [[504.0]], ["rate(end) <= 70 m/s: met"], MET, "down"),
        "budget/sigma/attitude/limit_1": (
            [1800.0], [[2.0]], ["heading(1800 s) <= 2 arcmin: not met"], NOT_MET, "down"),
    }  # fmt: skip
    drawn.shows("budget/sigma/velocity/limit_1", ["velocity_east(run) <= 0.025 m/s: met"], [0.0, 7200.0],
                [[25.0], [25.0]], [MET])  # fmt: skip
    assert "budget/circles/limit_4" not in drawn.lines  # beyond 1.5 times the highest curve
    drawn.shows("budget/circles/limit_5", ["r95(run) <= 1500 km: met"], [0.0, 7200.0], [[1500.0], [1500.0]], [MET])
    np.testing.assert_allclose(drawn.ranges["budget/circles"], (0.0, 1500.0))
    np.testing.assert_allclose(drawn.ranges["budget/sigma/attitude"], (0.0, 2.0))


def test_the_tables_in_words() -> None:
    """CEP 1.17741 σ and R95 2.44775 σ of 250 km; the columns source, value and unit, share, R95 alone."""
    text = markdown(exhibits_of(budget(), (answer("r95(end) <= 500 km", 600e3, 7200.0),)))
    lines = text.splitlines()
    assert lines[:2] == ["# sea & air: covariance budget", ""]
    assert lines[2].startswith(
        "After 7200 s, half of all runs are within **294.4 km** (CEP) and 95 % within **611.9 km**"
    )
    assert "It is 600 km at 7200 s, 100 km (20 %) above the limit." in text
    at = lines.index("## What to improve first, at the end, 7200 s")
    assert lines[at + 2 : at + 6] == [
        "| source | value | unit | share | R95 alone, km |",
        "|---|---:|---|---:|---:|",
        "| gyro_bias | 0.03 | deg/h | 64.00 % | 489.5 |",
        "| accel_bias | 450 | µg | 36.00 % | 367.2 |",
    ]
    assert "## What to improve first, where R95 is largest, at 1800 s" in lines


def test_a_line_without_a_label_has_that_of_its_colour() -> None:
    drawn: Any = Drawn()
    sigma = Line(label="±3σ", x=TIME, y=TIME, color="bound")
    chart = Chart(key="k", y=Axis(), marks=(sigma, replace(sigma, label="", y=-TIME), Rule(at=1.0, color="bound")))
    record_chart(drawn, "k", chart, 0.0)
    assert [name for _, _, names, *_ in drawn.lines.values() for name in names] == ["±3σ", "±3σ", "±3σ"]


def test_lines_and_dots_begin_with_the_run() -> None:
    drawn: Any = Drawn()
    marks = Line(label="a", x=TIME, y=TIME), Dots(label="b", x=TIME, y=2.0 * TIME)
    record_chart(drawn, "k", Chart(key="k", y=Axis(units=fixed("km", 1e3)), marks=marks), 100.0)
    for (time, values, *_), slope in ((drawn.lines["k"], 1e-3), (drawn.dots["k/dots_0"], 2e-3)):
        np.testing.assert_array_equal(time, 100.0 + TIME)
        np.testing.assert_allclose(values[:, 0], slope * TIME, rtol=1e-15)


def test_the_ends_of_axes_and_of_rules() -> None:
    """Given ends are in the unit of the axis, and so is the least extent; a rule is as long as all curves together."""
    drawn: Any = Drawn()
    share, km = Axis(units=fixed("%", 0.01), low=0.0, high=1.0), Axis(units=fixed("km", 1e3), least=5.0)
    for key, y, values in (("a", share, [0.2, 0.3]), ("b", km, [2000.0, 2100.0]), ("c", km, [2000.0, 2001.0])):
        line = Line(label=key, x=TIME[:2], y=np.array(values))
        record_chart(drawn, key, Chart(key=key, y=y, marks=(line,)), 0.0)
    assert drawn.ranges["a"] == (0.0, 100.0)
    assert drawn.ranges["b"] == (2.0, 2.1)
    assert drawn.ranges["c"] == (1.5, 2.501)
    early, late = (Line(label="d", x=np.array(x), y=np.zeros(2)) for x in ([1.0, 5.0], [3.0, 9.0]))
    record_chart(drawn, "d", Chart(key="d", y=km, marks=(late, early, Rule(at=3000.0, label="e"))), 100.0)
    drawn.shows("d/2", ["e"], [101.0, 109.0], [[3.0], [3.0]])
