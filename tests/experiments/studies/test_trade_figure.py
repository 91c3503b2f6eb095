"""The pictures of trade studies: what is drawn is the numbers, and nothing overlaps."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.studies.trade_cells import CellNumbers, cells_of
from sinssim.experiments.studies.trade_exhibits import curves, families, grid_of, growth, pictures
from sinssim.experiments.studies.trade_exhibits import heat_map as map_of
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.experiments.studies.trade_schema import Axis
from sinssim.recording.figures import figure_of
from sinssim.recording.style import COLORS, css
from sinssim.statistics.requirements import Quantity, VerdictInUnit
from tests.experiments.studies.trade_examples import ACCEL, AXES, BIAS, GRADE, study
from tests.slow import slow

R95 = Quantity("r95", "end")
NUMBERS = {"key": BIAS, "values": (0.01, 0.02, 0.04)}
CHOICES = {"key": GRADE, "values": ("laser-navigation", "laser-standard", "tactical")}
SWITCH = {"key": "navigation.vertical", "values": ("free", "baro-loop")}


def made(
    folder: Path, *axes: dict[str, Any], values: Any = None, band: float = 0.0, limit: float = 35.0
) -> TradeResult:
    """Return a study whose R95 is ten times the number of the cell, or as given."""
    plan = study(folder, axes=axes, require=(f"r95(end) <= {limit} m",))
    results = []
    for cell in cells_of(plan):
        r95 = 10.0 * cell.number if values is None else values[cell.number - 1]
        verdict = VerdictInUnit(plan.require[0], "met" if r95 <= limit else "not met", r95, limit, "m", 60.0)
        numbers = {q.column: r95 for q in plan.quantities}
        if band:
            numbers |= {"r95_end_m_low": r95 * (1.0 - band), "r95_end_m_high": r95 * (1.0 + band)}
        time = np.array([0.0, 30.0, 60.0])
        found = CellNumbers(numbers, (verdict,), time, 0.2 * r95 * time / 60.0, r95 * time / 60.0)
        results.append(replace(cell, numbers=found))
    return TradeResult(plan, tuple(results), media=TradeMedia())


def trade_figure(result: TradeResult, quantity: Quantity) -> Any:
    return figure_of(curves(result, quantity))


def heat_map(result: TradeResult, quantity: Quantity) -> Any:
    return figure_of(map_of(result, quantity))


def growth_figure(result: TradeResult) -> Any:
    """Return the growth of R95, None without any."""
    return next((figure_of(charts) for charts in growth(result) if charts.title), None)


def test_one_axis_of_numbers_is_a_curve_with_its_band_and_the_limit(tmp_path: Path) -> None:
    figure = trade_figure(made(tmp_path, NUMBERS, band=0.1), R95)
    (panel,) = figure.axes
    curve, limit = panel.lines
    np.testing.assert_array_equal(curve.get_xydata(), [[0.01, 10.0], [0.02, 20.0], [0.04, 30.0]])
    assert set(limit.get_ydata()) == {35.0}
    assert limit.get_color() == css(COLORS["limit"])
    (band,) = panel.collections
    np.testing.assert_allclose(band.get_paths()[0].get_extents().bounds[1::2], [9.0, 33.0 - 9.0])
    assert panel.get_xlabel() == "gyro bias σ [deg/h]"
    assert panel.get_ylabel() == "R95 at the end [m]"
    assert [tick.get_text() for tick in panel.get_xticklabels()] == ["0.01", "0.02", "0.04"]
    assert figure._supxlabel.get_text() == "bands: 95 % confidence"  # type: ignore[attr-defined]


def test_choices_are_bars(tmp_path: Path) -> None:
    (panel,) = trade_figure(made(tmp_path, CHOICES), R95).axes
    assert [bar.get_height() for bar in panel.patches] == [10.0, 20.0, 30.0]
    assert [tick.get_text() for tick in panel.get_xticklabels()] == list(CHOICES["values"])
    assert [text.get_text() for text in panel.texts] == ["10.0", "20.0", "30.0"]
    assert panel.get_ylim()[0] == 0.0


def test_choices_of_many_sizes_are_dots(tmp_path: Path) -> None:
    """A bar on a logarithmic scale has no foot."""
    (panel,) = trade_figure(made(tmp_path, CHOICES, values=[1.0, 10.0, 1000.0]), R95).axes
    assert panel.get_yscale() == "log"
    assert len(panel.patches) == 0
    np.testing.assert_array_equal(panel.collections[0].get_offsets()[:, 1], [1.0, 10.0, 1000.0])


@pytest.mark.parametrize(("axes", "lines", "bars"), [((NUMBERS, SWITCH), 2, 0), ((SWITCH, NUMBERS), 2, 0),
                                                     ((CHOICES, SWITCH), 0, 6)])  # fmt: skip
def test_two_axes(tmp_path: Path, axes: tuple[dict[str, Any], ...], lines: int, bars: int) -> None:
    """Numbers go along, choices give colours."""
    figure = trade_figure(made(tmp_path, *axes), R95)
    (panel,) = figure.axes
    assert len(panel.lines) == lines + 1  # and the limit
    assert len(panel.patches) == bars
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["free", "baro-loop", "r95(end) <= 35.0 m"]
    assert legend.get_title().get_text() == "vertical"


def test_which_axis_gives_the_colours() -> None:
    many, few = Axis(key=BIAS, values=(1, 2, 3)), Axis(key=ACCEL, values=(1, 2))
    choice = Axis(key=GRADE, values=("a", "b", "c", "d"))
    assert families((many, few)) == 1
    assert families((few, many)) == 0
    assert families((choice, few)) == 0
    assert families((few, choice)) == 1


def test_further_axes_are_panels(tmp_path: Path) -> None:
    figure = trade_figure(made(tmp_path, SWITCH, *AXES), R95)
    assert [panel.get_title(loc="left") for panel in figure.axes] == ["vertical free", "vertical baro-loop"]
    assert len(heat_map(made(tmp_path, SWITCH, *AXES), R95).axes) == 2


def test_the_heat_map_has_the_numbers_in_the_order_of_the_table(tmp_path: Path) -> None:
    figure = heat_map(made(tmp_path, *AXES), R95)
    panel = figure.axes[0]
    texts = {tuple(text.get_position()): text.get_text() for text in panel.texts}
    assert [[texts[k, i] for k in range(3)] for i in range(2)] == [
        ["10.0", "20.0", "30.0"],
        ["40.0", "50.0", "60.0"],
    ]
    assert panel.get_ylim() == (1.5, -0.5)
    assert sum(not patch.get_fill() for patch in panel.patches) == 3  # frames of the cells that meet the requirement
    assert figure._supxlabel.get_text() == "framed: meets r95(end) <= 35.0 m"  # type: ignore[attr-defined]


def test_a_cell_without_numbers(tmp_path: Path) -> None:
    whole = made(tmp_path, *AXES)
    cells = list(whole.cells)
    cells[4] = replace(cells[4], numbers=None, failure="it failed.")
    result = TradeResult(whole.study, tuple(cells), media=TradeMedia())
    texts = [text.get_text() for text in heat_map(result, R95).axes[0].texts]
    assert texts == ["10.0", "20.0", "30.0", "40.0", "–", "60.0"]
    assert np.isnan(trade_figure(result, R95).axes[0].lines[1].get_ydata()[1])
    assert growth_figure(result) is not None
    unreached = tuple(replace(one, numbers=None, failure="") for one in cells)
    nothing = TradeResult(whole.study, unreached, "interrupted", media=TradeMedia())
    assert not list(pictures(nothing))
    for figure in (trade_figure(nothing, R95), heat_map(nothing, R95)):
        figure.draw_without_rendering()
    assert growth_figure(nothing) is None


def test_a_limit_far_away_is_named(tmp_path: Path) -> None:
    (panel,) = trade_figure(made(tmp_path, NUMBERS, limit=1000.0), R95).axes
    assert panel.get_legend_handles_labels()[1] == ["r95(end) <= 1000.0 m (above the plot)"]
    assert panel.get_ylim()[1] < 50.0


def test_requirements_of_other_quantities_are_not_drawn(tmp_path: Path) -> None:
    assert grid_of(made(tmp_path, NUMBERS), Quantity("cep", "end")).limits == ()
    assert not grid_of(made(tmp_path, NUMBERS), Quantity("cep", "end")).panels[0].met.any()
    assert grid_of(made(tmp_path, NUMBERS), R95).panels[0].met.tolist() == [True, True, True]


def test_all_pictures(tmp_path: Path) -> None:
    assert [one.key for one in pictures(made(tmp_path, *AXES))] == ["r95_end", "r95_end_map", "growth", "growth_cep"]
    assert [one.key for one in pictures(made(tmp_path, NUMBERS))] == ["r95_end", "growth", "growth_cep"]


@pytest.mark.parametrize("axes", [(SWITCH, *AXES), *slow(((NUMBERS,),), ((CHOICES,),), (AXES,))])
def test_labels_do_not_overlap(tmp_path: Path, axes: tuple[dict[str, Any], ...]) -> None:
    for one in pictures(made(tmp_path, *axes)):
        figure = figure_of(one)
        figure.draw_without_rendering()
        renderer = figure._get_renderer()  # type: ignore[attr-defined]
        for panel in figure.axes:
            boxes = [tick.get_window_extent(renderer) for tick in panel.get_xticklabels() if tick.get_text()]
            turned = any(tick.get_rotation() for tick in panel.get_xticklabels())
            assert turned or all(a.x1 < b.x0 for a, b in pairwise(boxes)), one.key


def test_growth_ends_with_the_longest_run(tmp_path: Path) -> None:
    """Cells of 60, 300 and 7200 s: minutes, to the end of the longest."""
    whole = made(tmp_path, NUMBERS)
    ends = (60.0, 300.0, 7200.0)
    cells = []
    for one, end in zip(whole.cells, ends, strict=True):
        assert one.numbers is not None
        cells.append(replace(one, numbers=replace(one.numbers, time=np.array([0.0, 0.5 * end, end]))))
    figure = growth_figure(replace(whole, cells=tuple(cells)))
    assert figure is not None
    (panel,) = figure.axes
    assert panel.get_xlabel() == "time [min]"
    assert panel.get_xlim() == (0.0, 120.0)
    assert [line.get_xdata()[-1] for line in panel.lines] == pytest.approx([1.0, 5.0, 120.0])
