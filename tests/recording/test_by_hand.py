"""Figures of budgets, calibrations, alignments and noise from numbers written by hand: lines, bars, limits, words."""

from __future__ import annotations

from math import inf, pi, sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.error_budget import budget_exhibits as budget
from sinssim.analyses.error_budget.budget_exhibits import BudgetMedia
from sinssim.analyses.error_budget.budget_result import Allowance, Answer, BudgetResult
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.charts import Axis, Chart, Charts, Line
from sinssim.recording.figures import figure_of
from sinssim.recording.style import COLORS, css
from sinssim.statistics.requirements import limits_of, parse_requirement
from sinssim.units import fixed
from tests.recording.by_hand import ARCMIN, CEP, R95, hand_budget
from tests.recording.drawn import bars, check_band, check_line, figure, legend, limits, linear, texts, ticks, words

NONE = Allowance((), inf, 0.0)
DEG_H, UG = pi / 648_000.0, 9.80665e-6


def answer(text: str, value: float) -> Answer:
    return Answer(parse_requirement(text), value, 0.0, (), None, NONE)


def test_the_growth_of_a_budget() -> None:
    """R95 grows by 50 · 2.4477 m an hour, CEP by 50 · 1.1774 m; sources have 64, 36 and 0.0004 % of the square."""
    asked = [answer("r95(run) <= 0.15 km", 160.0), answer("cep(30 min) <= 40 m", 30.0), answer("heading <= 1 deg", 0.0)]
    above, below = figure(budget.exhibits_of(hand_budget(), asked), "growth").axes
    minutes = linear(0.0, 120.0, 13)
    grown = np.array(linear(0.0, 2.0, 13)) * 2500.01**0.5
    check_line(above.lines[0], "R95: 95 % of all runs", minutes, grown * R95, css(COLORS["r95"]))
    check_line(above.lines[1], "CEP: half of all runs", minutes, grown * CEP, css(COLORS["cep"]))
    check_line(above.lines[2], "r95(run) <= 0.15 km: not met", [0.0, 1.0], [150.0] * 2, css(COLORS["measured"]), "--")
    check_line(above.lines[3], "cep(30 min) <= 40 m: met", [30.0], [40.0], css(COLORS["truth"]))
    assert len(above.lines) == 4
    assert words(above) == ("CEP and R95", "", "horizontal error [m]")
    assert above.get_xlim() == (0.0, 120.0)
    assert above.get_ylim()[0] == 0.0
    assert above.get_ylim()[1] == pytest.approx(1.05 * grown[-1] * R95)
    assert words(below) == ("Horizontal position: shares of the sources", "time [min]", "share of the mean square [%]")
    assert below.get_ylim() == (0.0, 100.0)
    assert legend(below) == ["gyros: random walk", "accelerometers: bias", "gyros: bias"]  # from the top down
    whole = 2500.01
    ends = np.cumsum([0.0, 160_000.0 / whole, 90_000.0 / whole, 1.0 / whole])
    for low, high, part in zip(ends[:-1], ends[1:], below.collections, strict=True):
        check_band(part, minutes[1:], [low] * 12, [high] * 12)


@pytest.mark.parametrize(
    ("end", "unit"), [(600.0, ("s", 1.0)), (612.0, ("min", 60.0)), (14_400.0, ("min", 60.0)), (15_600.0, ("h", 3600.0))]
)
def test_the_time_axis_of_a_budget(end: float, unit: tuple[str, float]) -> None:
    charts = budget.exhibits_of(hand_budget(end)).chosen("sigma")
    assert [chart.unit(False) for chart in charts] == [unit] * 3


def test_shares_of_errors_that_are_equal_in_every_run() -> None:
    """A given error of 30 m north and 40 m east beside σ of 0 to 100 m: after an hour half of 2 · 50² + 50²."""
    found = hand_budget()
    found.mean["height"][:, :2] = 30.0, 40.0
    names, parts = budget.shares(found)
    # by their mean share plus that at the end: 0.36 + 0.57, 0.44 + 0.11 and 0.20 + 0.32
    assert names == ["gyros: bias", "errors equal in every run", "accelerometers: bias", "gyros: random walk"]
    whole = 7500.02
    np.testing.assert_allclose(parts[:, 6], [3200.0 / whole, 2500.0 / whole, 1800.0 / whole, 0.02 / whole], rtol=1e-12)
    np.testing.assert_allclose(parts[:, 0], [0.0, 1.0, 0.0, 0.0])
    assert len(set(budget._palette([str(k) for k in range(8)]))) == 8
    assert budget._palette(["x", budget.OTHERS])[1] == (170, 170, 170)


def test_the_smallest_of_many_sources_are_one() -> None:
    """Ten sources of 1 to 10 m: eight have a colour of their own; 1 and 2 m are together 5/385 of the square."""
    sources = tuple(Source(f"s{k}", f"error {k}", "gyros", "random", 1.0, "m") for k in range(1, 11))
    covariance = {f"s{k}": np.tile(np.diag([k * k, *[0.0] * 8]), (2, 1, 1)) for k in range(1, 11)}
    result = BudgetResult(
        SimpleNamespace(name="many", description=""),
        "inertial",
        np.array([1.0, 2.0]),
        sources,
        covariance,
        {},
        media=BudgetMedia(),
    )
    names, parts = budget.shares(result)
    assert names == [*(f"gyros: error {k}" for k in range(10, 2, -1)), "all others"]
    np.testing.assert_allclose(parts[:, 1], [*(k * k / 385.0 for k in range(10, 2, -1)), 5.0 / 385.0])
    left, right = figure(budget.exhibits_of(result), "ranking0").axes
    assert (len(left.patches), len(right.patches)) == (10, 10)
    assert [length for _, length, _ in bars(right)] == pytest.approx([1.959964 * k for k in range(10, 0, -1)], rel=1e-4)


def test_the_ranking_of_a_budget() -> None:
    left, right = figure(budget.exhibits_of(hand_budget()), "ranking0").axes
    blue = css(COLORS["aided"])

    def less(a: float, b: float, walk: float) -> float:
        return 2.0 * R95 * (sqrt(2500.01) - sqrt(a * a + b * b + walk * walk))

    gains = [less(30.0, 20.0, 0.1), less(15.0, 40.0, 0.1), less(30.0, 40.0, 0.05)]
    alone = [80.0 * R95, 60.0 * R95, 0.2 * R95]
    for panel, values, title in ((left, gains, "Decrease of R95 if this source were halved"),
                                 (right, alone, "R95 from this source alone")):  # fmt: skip
        assert bars(panel) == [(float(k), pytest.approx(value), blue) for k, value in enumerate(values)]
        assert words(panel) == (title, "m", "")
        assert panel.get_xlim() == (0.0, pytest.approx(1.18 * values[0]))
        first = [t.xy for t in panel.texts]
        assert first == [(pytest.approx(v), k) for k, v in enumerate(values)]
    assert ticks(left, "y") == [(0.0, "gyros: bias"), (1.0, "accelerometers: bias"), (2.0, "gyros: random walk")]
    assert texts(left) == [f"{gains[0]:.1f}", f"{gains[1]:.1f}", "0"]
    assert texts(right) == ["196", "147", "0.490"]
    early = figure_of(budget._bars(hand_budget(), 3600.0, "early")).axes[1]
    assert bars(early)[0] == (0.0, pytest.approx(40.0 * R95), blue)


def test_the_sigmas_of_a_budget() -> None:
    """σ without the mean: 20 m/h down. The filter's own σ are 1 to 9 of the SI units an hour."""
    asked = [answer("tilt_north <= 1 arcmin", 0.0)]
    drawn = figure(budget.exhibits_of(hand_budget(filtered=True), asked), "sigma")
    hours, minutes = np.array(linear(0.0, 2.0, 13)), linear(0.0, 120.0, 13)
    grown = ((50.0001, 50.0001, 20.0), (5.0, 5.0, 13.0), (0.25, 0.5, 1.1))
    names = (("north", "east", "down"), ("north", "east", "down"), ("tilt north", "tilt east", "heading"))
    titles = (("σ of the position", "m", 1.0), ("σ of the velocity", "mm/s", 1e-3),
              ("σ of the attitude", "arcmin", ARCMIN))  # fmt: skip
    assert len(drawn.axes) == 3
    for row, panel in enumerate(drawn.axes):
        title, unit, size = titles[row]
        assert words(panel) == (title, "time [min]", unit)
        top = 1.25 * 2.0 * max(grown[row])
        assert limits(panel) == ((0.0, 120.0), (0.0, pytest.approx(top, rel=1e-5)))
        for k, axis in enumerate(("north", "east", "down")):
            check_line(panel.lines[2 * k], names[row][k], minutes, hours * sqrt(2500.01) if grown[row][k] == 50.0001
                       else hours * grown[row][k], css(COLORS[axis]))  # fmt: skip
            own = (3.0 * row + k + 1.0) / size * hours
            check_line(panel.lines[2 * k + 1], "filter's own" if k == 2 else "", minutes, own, None, ":")
    check_line(drawn.axes[2].lines[-1], "tilt_north <= 1 arcmin: met", [0.0, 1.0], [1.0, 1.0])
    assert legend(drawn.axes[2])[3:] == ["filter's own", "tilt_north <= 1 arcmin: met"]


def test_limits_over_time() -> None:
    """A mark at its time, a line throughout the run; the limit of a rate is that of its time; far ones are named."""
    judged = [(parse_requirement(text), verdict) for text, verdict in
              (("rate(300 s) <= 2 m/s", "met"), ("r95(run) <= 400 m", "undecided"), ("cep(end) <= 750 m", "not met"),
               ("cep(end) <= 751 m", "met"), ("cep(120 s) <= 20 m", "met"))]  # fmt: skip
    marks = limits_of(judged, ("rate", "r95", "cep"), 900.0)
    curve = Line(x=np.array([0.0, 900.0]), y=np.array([0.0, 500.0]))
    y = Axis(units=fixed("decametres", 10.0), low=0.0, high=500.0)
    chart = Chart(key="limits", x=Axis(label="time", units=fixed("min", 60.0)), y=y, marks=(curve, *marks))
    (axes,) = figure_of(Charts("limits", ((chart,),), (4.0, 3.0))).axes
    good, bad, grey = (css(COLORS[name]) for name in ("truth", "measured", "run"))
    check_line(axes.lines[1], "rate(300 s) <= 2 m/s: met", [5.0], [60.0], good)
    check_line(axes.lines[2], "r95(run) <= 400 m: undecided", [0.0, 1.0], [40.0, 40.0], grey, "--")
    check_line(axes.lines[3], "cep(end) <= 750 m: not met", [15.0], [75.0], bad)
    check_line(axes.lines[4], "cep(end) <= 751 m: met (above the plot)", [], [], good)
    check_line(axes.lines[5], "cep(120 s) <= 20 m: met", [2.0], [2.0], good)
    assert axes.get_ylim() == (0.0, pytest.approx(82.5))
    (rate,) = limits_of([(parse_requirement("rate(end) <= 2 m/s"), "met")], ("rate",), 900.0)
    assert (rate.height, rate.at) == (1800.0, 900.0)
    assert limits_of(judged, ("rate", "heading"), 900.0) == marks[:1]
    assert (marks[0].height, marks[0].at) == (600.0, 300.0)
