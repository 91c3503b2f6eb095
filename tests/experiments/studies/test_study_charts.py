"""The charts of a study from rows written by hand: which error over which time or cost, limits, ticks, words."""

from __future__ import annotations

from math import log10, pi
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex

from sinssim.experiments.studies import study_charts as study
from sinssim.experiments.studies.step_cost import Cost, Operations
from sinssim.experiments.studies.study_results import ErrorGrowth, Heading, Order, Row
from sinssim.recording.figures import figure_of
from sinssim.recording.style import COLORS, colors, css
from tests.recording.drawn import bars, check_band, check_line, legend, texts, ticks, words

PAINT = {"euler": "#112233", "poisson-3-ortho": "#445566"}


def row(motion: str, algorithm: str, rate: float, size: float, **changes: Any) -> Row:
    """Return a row with errors of 3, 5 and 7 times the size: horizontal [m], attitude [arcsec] and defect."""
    kept = {"max_horizontal_error_m": 3.0 * size, "max_attitude_error_arcsec": 5.0 * size, "max_defect": 7.0 * size,
            "ns_per_step": 250.0} | changes  # fmt: skip
    return Row("part", motion, "rate-gyros", "ideal", algorithm, "level", "normal", "exact", rate, (), "hold", **kept)


ROWS = [row(motion, name, rate, size * factor / rate) for motion, size in (("cone", 1.0), ("spin", 10.0))
        for name, factor in (("euler", 2.0), ("poisson-3-ortho", 4.0)) for rate in (100.0, 10.0, 50.0)]  # fmt: skip


def label(one: Row) -> str:
    return one.algorithm


def test_errors_over_the_rate() -> None:
    """Attitude above, position below; a column for each motion; rates in order; 0.3′ are 18″."""
    figure = figure_of(study.against_rate([*ROWS, row("cone", "euler", 20.0, 1.0, status="failed")], label, PAINT))
    rates = np.array([10.0, 50.0, 100.0])
    names = ("largest attitude error [″]", "largest horizontal error [m]")
    panels = {(panel.get_subplotspec().rowspan.start, panel.get_subplotspec().colspan.start): panel
              for panel in figure.axes}  # fmt: skip
    assert sorted(panels) == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for (line, column), panel in panels.items():
        size = (5.0, 3.0)[line] * (1.0, 10.0)[column]
        check_line(panel.lines[0], "euler", rates, 2.0 * size / rates, "#112233", "-")
        check_line(panel.lines[1], "poisson-3-ortho", rates, 4.0 * size / rates, "#445566", "--")
        assert [one.get_marker() for one in panel.lines[:2]] == ["*", "^"]
        title = ("cone", "spin")[column] if line == 0 else ""
        assert words(panel) == (title, "sample rate [Hz]", names[line] if column == 0 else "")
        assert (panel.get_xscale(), panel.get_yscale()) == ("log", "log")
        assert ticks(panel, "x") == [(10.0, "10"), (20.0, "20"), (50.0, "50"), (100.0, "100")]
        assert len(panel.lines) == 3 - line
    check_line(panels[0, 0].lines[2], "", [0.0, 1.0], [18.0, 18.0])
    assert texts(panels[0, 0]) == ["0.3′"]
    assert texts(panels[0, 1]) == []
    assert legend(figure) == ["euler", "poisson-3-ortho"]


def test_errors_over_the_cost_and_defects() -> None:
    """250 ns a step, 10 to 100 steps a second: 2.5 to 25 µs; a zero is drawn at 1e-16."""
    (panel, _) = figure_of(study.against_cost([*ROWS, row("cone", "euler", 200.0, 0.0)], label, PAINT)).axes
    check_line(panel.lines[0], "euler", [2.5, 12.5, 25.0, 50.0], [1.0, 0.2, 0.1, 1e-16])
    assert words(panel) == ("cone", "processor time per second of motion [µs]", "largest attitude error [″]")
    without = [*ROWS, row("cone", "euler", 200.0, 0.0)]
    (panel, _) = figure_of(study.defect_against_rate(without, label, PAINT)).axes
    check_line(panel.lines[1], "poisson-3-ortho", [10.0, 50.0, 100.0], [2.8, 0.56, 0.28])
    check_line(panel.lines[0], "euler", [10.0, 50.0, 100.0], [1.4, 0.28, 0.14])
    assert words(panel) == ("cone", "sample rate [Hz]", "largest defect of norm or orthogonality")


def test_rates_that_crowd_have_no_tick() -> None:
    rows = [row("cone", "euler", rate, 1.0) for rate in (10.0, 11.0, 100.0, 1000.0)]
    panel = figure_of(study.against_rate(rows, label, PAINT)).axes[0]
    assert ticks(panel, "x") == [(10.0, "10"), (100.0, "100"), (1000.0, "1000")]
    assert len(panel.lines) == 1  # 0.3′ are drawn where algorithms are compared


def test_motions_beyond_three_continue_below() -> None:
    rows = [row(f"m{k}", "euler", rate, 1.0 + k) for k in range(4) for rate in (10.0, 20.0, 30.0)]
    figure = figure_of(study.against_rate(rows, label, PAINT))
    place = {words(panel)[0]: panel.get_subplotspec() for panel in figure.axes if words(panel)[0]}
    assert {name: (spec.rowspan.start, spec.colspan.start) for name, spec in place.items()} == {
        "m0": (0, 0), "m1": (0, 1), "m2": (0, 2), "m3": (2, 0),
    }  # fmt: skip
    assert len(figure.axes) == 8


def test_errors_as_bars() -> None:
    """From below the least to beyond the largest error; names from above; a bar has the colour of its line."""
    rows = [row("cone", "euler", 10.0, 0.5), row("cone", "poisson-3-ortho", 10.0, 4000.0),
            row("spin", "euler", 10.0, 7.0), row("spin", "poisson-3-ortho", 10.0, 1.0, status="failed")]  # fmt: skip
    left, right = figure_of(study.bars(rows, label, lambda one: one.algorithm, PAINT)).axes
    assert bars(left) == [(0.0, pytest.approx(1.5), "#112233"), (1.0, pytest.approx(12_000.0), "#445566")]
    assert bars(right) == [(0.0, pytest.approx(21.0), "#112233")]
    assert texts(left) == ["1.5", "12000"]
    assert words(left) == ("cone", "largest horizontal error [m]", "")
    assert words(right)[0] == "spin"
    low, high = np.floor(log10(1.5) - 0.3), 5.0
    assert low == -1.0
    assert left.get_xlim() == (pytest.approx(0.1), pytest.approx(10.0 ** (high + 0.18 * 6.0)))
    assert right.get_xlim() == (pytest.approx(10.0), pytest.approx(10.0 ** (2.0 + 0.18)))
    assert left.get_ylim() == (1.5, -0.5)
    assert ticks(left, "y") == [(0.0, "euler"), (1.0, "poisson-3-ortho")]


def test_motions_beyond_a_row_leave_no_empty_panel() -> None:
    """Four motions in rows of three: of the second row, one panel is left."""
    motions = ("a", "b", "c", "d")
    rows = [row(motion, "euler", 10.0, 0.5 + k) for k, motion in enumerate(motions)]
    drawn = figure_of(study.bars(rows, label, lambda one: one.algorithm, PAINT))
    history = ErrorGrowth(np.array([0.0, 1.0, 2.0]), np.array([0.0, 3.0, 4.0]), np.zeros(3))
    grown = figure_of(study.growth({motion: [("euler", history)] for motion in motions}, PAINT))
    for figure in (drawn, grown):
        assert [words(axes)[0] for axes in figure.axes] == list(motions)
        places = [(spec.rowspan.start, spec.colspan.start) for axes in figure.axes if (spec := axes.get_subplotspec())]
        assert places == [(0, 0), (0, 1), (0, 2), (1, 0)]
    assert [words(axes)[2] for axes in grown.axes] == ["horizontal error [m]", "", "", "horizontal error [m]"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.00123456, "0.00123"), (999.4, "999"), (1000.6, "1001"), (0.00099, "9.9e-04"), (2e7, "2.0e+07")],
)
def test_short_numbers(value: float, text: str) -> None:
    assert study._short(value) == text


def test_growth_over_time() -> None:
    """From the second instant on, since the start; at least a nanometre."""
    time = np.array([100.0, 101.0, 110.0, 200.0])
    one, other = (ErrorGrowth(time, np.array(errors), np.zeros(4)) for errors in ([5.0, 0, 3, 4], [5.0, 7, 8, 9]))
    panels = {"cone": [("euler", one)], "spin": [("poisson-3-ortho", other)]}
    figure = figure_of(study.growth(panels, PAINT))
    left, right = figure.axes
    check_line(left.lines[0], "euler", [1.0, 10.0, 100.0], [1e-9, 3.0, 4.0], "#112233")
    check_line(right.lines[0], "poisson-3-ortho", [1.0, 10.0, 100.0], [7.0, 8.0, 9.0], "#445566")
    assert words(left) == ("cone", "time [s]", "horizontal error [m]")
    assert words(right) == ("spin", "time [s]", "")
    assert (left.get_xscale(), left.get_yscale()) == ("log", "log")
    assert legend(figure) == ["euler", "poisson-3-ortho"]


def test_costs() -> None:
    """Operations 34 and 80, and 250 and 400 ns; the axis ends at 1.12 times the largest."""
    found = {"one": Cost("quaternion", "level", 250.0, Operations(10.0, 15.0, 2.0, 3.0, 4.0), (200.0, 50.0, 10.0)),
             "two": Cost("euler", "level", 400.0, Operations(20.0, 30.0, 5.0, 10.0, 15.0))}  # fmt: skip
    totals = [one.operations.total for one in found.values()]
    left, right = figure_of(study.costs(SimpleNamespace(costs=found))).axes
    shades = [css(COLORS[name]) for name in ("quaternion", "euler")]
    assert [(place, color) for place, _, color in bars(left)] == [(0.0, shades[0]), (1.0, shades[1])]
    assert [length for _, length, _ in bars(left)] == totals
    assert [length for _, length, _ in bars(right)] == pytest.approx([250.0, 400.0])
    assert texts(right) == ["250", "400"]
    assert texts(left) == [f"{total:.0f}" for total in totals]
    assert right.get_xlim() == (0.0, pytest.approx(448.0))
    assert left.get_xlim() == (0.0, pytest.approx(1.12 * totals[1]))
    assert left.get_ylim() == (1.5, -0.5)
    assert words(left)[1] == "floating-point operations per step"
    assert words(right)[1] == "processor time per step [ns]"
    assert ticks(left, "y") == [(0.0, "quaternion · 200/50/10"), (1.0, "euler · every sample")]


def test_orders() -> None:
    given = (("cone", "euler", 2.25, 0.5), ("cone", "poisson", 4.125, 0.25), ("spin", "euler", 1.75, 0.125))
    fits = [Order("part", motion, name, "q", order, apart, 5, 10.0, 100.0) for motion, name, order, apart in given]
    figure = figure_of(study.orders(fits))
    (panel,) = figure.axes
    assert panel.get_xlim() == (0.0, pytest.approx(4.825))
    assert panel.get_ylim() == (1.5, -0.5)
    assert ticks(panel, "y") == [(0.0, "euler"), (1.0, "poisson")]
    assert [at for at, _ in ticks(panel, "x")] == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert words(panel)[1] == "order of convergence of the attitude: error ~ intervalᵖ, p"
    lines = [one for one in panel.collections if hasattr(one, "get_segments")]
    marks = [one for one in panel.collections if one not in lines and len(one.get_offsets())]
    assert [one.get_offsets().tolist() for one in marks] == [[[2.25, 0.0], [4.125, 1.0]], [[1.75, 0.0]]]
    ends = [segment.tolist() for one in lines for segment in one.get_segments()]
    assert ends == [[[1.75, 0.0], [2.75, 0.0]], [[3.875, 1.0], [4.375, 1.0]], [[1.625, 0.0], [1.875, 0.0]]]
    assert legend(panel) == ["cone", "spin"]
    assert [to_hex(color) for color in marks[0].get_facecolor()] == [css(COLORS["euler"]), css(COLORS["poisson"])]


def test_the_colours_of_a_study() -> None:
    parts = [SimpleNamespace(title=title, schedules_hz=()) for title in ("a", "b")]
    of_part = {"a": ROWS[:6], "b": [row("cone", "quaternion", 10.0, 1.0)]}
    found = study.palette(SimpleNamespace(study=SimpleNamespace(parts=parts), of_part=of_part.get))
    assert list(found) == ["euler", "poisson-3-ortho", "quaternion"]
    assert found["euler"] == css(COLORS["euler"])
    assert study.colors_of(["quaternion"]) == [css(COLORS["quaternion"])]


def test_headings_through_turns() -> None:
    """Heading in degrees; its error modulo a turn in arcsec: 2π + 10″, −20″ and nothing, which is drawn at 1e-10."""
    second = pi / 648_000.0
    time = np.array([50.0, 60.0, 80.0])
    truth = np.array([0.5, 3.0, 9.0])
    off = np.array([2.0 * pi + 10.0 * second, -20.0 * second, 0.0])
    found = [Heading("part", "turn", form, 20.0, 1.0, 0.0, 0.0, 0, 0.0, 0.0, time, truth + size * off, truth)
             for form, size in (("direct", 1.0), ("rates", 0.0), ("third", 0.0), ("unwrapped", 0.0))]  # fmt: skip
    figure = figure_of(study.turning(found))
    top, bottom = figure.axes
    since = [0.0, 10.0, 30.0]
    own, other = css(COLORS["euler"]), css(COLORS["quaternion"])
    check_line(top.lines[0], "direct", since, (truth + off) * 180.0 / pi, own, "-")
    check_line(top.lines[3], "unwrapped", since, truth * 180.0 / pi, other, "--")
    np.testing.assert_allclose(bottom.lines[0].get_ydata()[:2], [10.0, 20.0], rtol=1e-6)
    check_line(bottom.lines[3], "", since, [1e-10] * 3, other, "--")
    check_line(bottom.lines[4], "", [0.0, 1.0], [18.0, 18.0])
    assert words(top) == ("turn, 20 Hz", "time [s]", "heading [°]")
    assert words(bottom) == ("", "time [s]", "error of the heading [″]")
    assert texts(bottom) == ["0.3′"]
    assert legend(figure) == ["direct", "rates", "third", "unwrapped"]


def test_the_power_of_time() -> None:
    """An error that grows with the cube of time has the power 3 everywhere; the closed form begins at 4."""
    time = 70.0 + np.arange(0.0, 8001.0, 20.0)
    cubic = 1e-6 * (time - 70.0) ** 3
    found = {"block": (ErrorGrowth(time, cubic, np.zeros(len(time))), 0.05),
             "short": (ErrorGrowth(time, cubic, np.full(len(time), 1e6)), 0.05)}  # fmt: skip
    figure = figure_of(study.power_of_time(found))
    top, bottom = figure.axes
    since = time[1:] - 70.0  # at 20 s the error is 8 mm
    check_line(top.lines[0], "block", since, cubic[1:], css(colors(["block", "short"])[0]))
    line = bottom.lines[0]
    inside = since[(since > 20.0 * 1.08) & (since < 8000.0 / 1.08)]
    np.testing.assert_allclose(line.get_xdata(), inside)
    np.testing.assert_allclose(line.get_ydata(), 3.0, atol=2e-3)
    closed = bottom.lines[1]
    assert closed.get_label() == "closed form"
    assert (closed.get_xdata()[0], closed.get_xdata()[-1]) == (pytest.approx(5.0), pytest.approx(8000.0))
    assert closed.get_ydata()[0] == pytest.approx(4.0, abs=1e-4)
    period = 2.0 * pi * (6_371_000.0 / 9.81) ** 0.5
    check_band(bottom.collections[0], [5.0, 1000.0], [3.9, 3.9], [4.1, 4.1])
    check_band(bottom.collections[1], [period, 8000.0], [1.8, 1.8], [2.2, 2.2])
    assert bottom.get_xlim() == (5.0, pytest.approx(8400.0))
    assert bottom.get_ylim() == (1.0, 5.0)
    assert words(top)[2] == "horizontal error [m]"
    assert words(bottom)[1:] == ("time [s]", "power of time")
    assert [float(one.get_xdata()[0]) for one in top.lines[1:]] == [1000.0, pytest.approx(period)]
    named = {text.get_text(): text.xy[0] for text in top.texts}
    assert named == {"1000 s": 1000.0, "Schuler period": pytest.approx(period)}
    assert legend(figure) == ["block", "closed form"]


def test_the_ends_of_a_logarithmic_axis() -> None:
    """Beyond 1 and 100 by 4 % of the axis, a factor of 100^0.04; by 5 % of the number around a single one."""
    assert study._beyond([1.0, 100.0, 0.0, np.inf, 10.0]) == pytest.approx({"low": 10.0**-0.08, "high": 10.0**2.08})
    assert study._beyond([3.0]) == pytest.approx({"low": 3.0 / 1.05, "high": 3.15})
    assert study._beyond([0.0, -1.0]) == {}
