"""The pictures of trade studies whose every number is written by hand: lines, bands, bars, cells, ticks, words."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.charts import Cells, in_rows
from sinssim.experiments.studies import trade_exhibits as trade
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.experiments.studies.trade_schema import Axis
from sinssim.recording.style import COLORS, ON_DARK, ON_LIGHT, css
from sinssim.statistics.requirements import Quantity
from tests.experiments.studies.test_trade_figure import growth_figure, heat_map, trade_figure
from tests.experiments.studies.trade_examples import BIAS, study
from tests.experiments.studies.trades_by_hand import ASK, OTHER, RISING, UNITS, made, without
from tests.recording.drawn import check_band, check_line, legend, texts, ticks, words


def test_curves_in_the_order_of_the_numbers(tmp_path: Path) -> None:
    """A line for each unit; the numbers 0.01, 0.02 and 0.05 in order; bands; a requirement in km drawn in m."""
    figure = trade_figure(made(tmp_path), Quantity("r95", "end"))
    (panel,) = figure.axes
    first, second = (css(color) for color in trade.choice_colors(2))
    check_line(panel.lines[0], "A", [0.01, 0.02, 0.05], [200.0, 100.0, 300.0], first)
    check_line(panel.lines[1], "B", [0.01, 0.02, 0.05], [500.0, 400.0, 600.0], second)
    check_line(panel.lines[2], ASK[0], [0.01, 0.05], [300.0, 300.0], css(COLORS["limit"]), "--")
    check_band(panel.collections[0], [0.01, 0.02, 0.05], [160.0, 80.0, 240.0], [300.0, 150.0, 450.0])
    check_band(panel.collections[1], [0.01, 0.02, 0.05], [400.0, 320.0, 480.0], [750.0, 600.0, 900.0])
    assert words(panel) == ("", "gyro bias σ [deg/h]", "R95 at the end [m]")
    assert ticks(panel, "x") == [(0.01, "0.01"), (0.02, "0.02"), (0.05, "0.05")]
    assert panel.get_ylim()[0] == 0.0
    assert legend(figure) == ["A", "B", ASK[0]]
    assert figure.legends[0].get_title().get_text() == "unit"
    assert figure._supxlabel.get_text() == "bands: 95 % confidence"
    few = made(tmp_path)
    few.cells[0].numbers.values["r95_end_m_high"] = inf  # of the middle one of the first line
    panel = trade_figure(few, Quantity("r95", "end")).axes[0]
    check_band(panel.collections[0], [0.01, 0.02, 0.05], [160.0, 80.0, 240.0], [300.0, 100.0, 450.0])
    alone = trade_figure(made(tmp_path, (RISING,)), Quantity("cep", "at", 30.0)).axes[0]
    check_line(alone.lines[0], "", [0.01, 0.02, 0.05], [100.0 / 3.0, 50.0 / 3.0, 50.0], css(COLORS["cep"]))
    assert len(alone.lines) == 1
    assert words(alone)[2] == "CEP at 30 s [m]"


def test_bars_of_choices(tmp_path: Path) -> None:
    """The heading error in arcsec as bars; error bars from 0.8 to 1.5 times; the numbers above them."""
    (panel,) = trade_figure(made(tmp_path, (UNITS,)), Quantity("heading", "run")).axes
    assert [bar.get_height() for bar in panel.patches] == pytest.approx([10.0, 20.0])
    assert [bar.get_x() + 0.5 * bar.get_width() for bar in panel.patches] == pytest.approx([0.0, 1.0])
    lines = [one for one in panel.collections if hasattr(one, "get_segments")]
    ends = [segment.tolist() for one in lines for segment in one.get_segments()]
    assert ends == [[[0.0, pytest.approx(8.0)], [0.0, pytest.approx(15.0)]],
                    [[1.0, pytest.approx(16.0)], [1.0, pytest.approx(30.0)]]]  # fmt: skip
    assert texts(panel) == ["10.0", "20.0"]
    assert [text.xy[1] for text in panel.texts] == pytest.approx([15.0, 30.0])
    assert ticks(panel, "x") == [(0.0, "A"), (1.0, "B")]
    assert words(panel)[2] == "Heading error largest of the run, rms [arcsec]"
    check_line(panel.lines[-1], ASK[2], [-0.5, 1.5], [30.0, 30.0])
    twice = {"key": "navigation.vertical", "values": ("free", "baro-loop")}
    (both,) = trade_figure(made(tmp_path, (UNITS, twice)), Quantity("cep", "end")).axes
    assert [bar.get_height() for bar in both.patches] == [50.0, 100.0, 150.0, 200.0]
    assert [bar.get_x() + 0.5 * bar.get_width() for bar in both.patches] == pytest.approx([-0.2, 0.8, 0.2, 1.2])
    assert ticks(both, "x") == [(0.0, "free"), (1.0, "baro-loop")]


def test_a_limit_far_away_is_named_with_its_side(tmp_path: Path) -> None:
    """Drawn from a third of the least to three times the largest value; a rate's limit in nmi/h."""
    for limit, shown in ((0.02, "(below the plot)"), (0.04, ""), (1.75, ""), (1.85, "(above the plot)")):
        plan = study(tmp_path, axes=(UNITS, RISING), require=(f"r95(end) <= {limit} km",))
        result = TradeResult(plan, made(tmp_path).cells, media=TradeMedia())
        panel = trade_figure(result, Quantity("r95", "end")).axes[0]
        assert panel.lines[2].get_label() == f"r95(end) <= {limit} km {shown}".strip()
        assert len(panel.lines[2].get_xdata()) == (0 if shown else 2)
        if not shown:
            assert set(panel.lines[2].get_ydata()) == {1000.0 * limit}
    rate = TradeResult(
        study(tmp_path, axes=(UNITS, RISING), require=("rate(end) <= 0.5 kt",)),
        made(tmp_path).cells,
        media=TradeMedia(),
    )
    panel = trade_figure(rate, Quantity("rate", "end")).axes[0]
    assert panel.lines[2].get_ydata() == pytest.approx([0.5, 0.5])
    assert words(panel)[2] == "Rate at the end [nmi/h]"


def test_the_growth_of_the_cells(tmp_path: Path) -> None:
    figure = growth_figure(made(tmp_path))
    (panel,) = figure.axes
    for k, line in enumerate(panel.lines):
        name = f"{'AB'[k // 3]}, {(0.02, 0.01, 0.05)[k % 3]:g} deg/h"
        check_line(line, name, [0.0, 30.0, 60.0], np.array([0.0, 50.0, 100.0]) * (k + 1.0))
    assert words(panel)[1:] == ("time [s]", "R95 [m]")
    assert panel.get_xlim() == (0.0, 60.0)
    assert figure.legends[0].get_title().get_text() == "unit, gyro bias σ"
    wide = made(tmp_path)
    wide.cells[0].numbers.r95[:] = [1.0, 5.0, 600.0 / 31.0]
    panel = growth_figure(wide).axes[0]
    assert panel.get_yscale() == "log"
    assert panel.get_ylim()[0] == pytest.approx(60.0 / 31.0)
    assert growth_figure(made(tmp_path, (OTHER, UNITS, RISING))) is None  # twelve cells
    assert not trade.is_wide(np.array([1.0, 30.0]))
    assert trade.is_wide(np.array([31.0, 1.0, 2.0]))


def test_the_map(tmp_path: Path) -> None:
    """Rows downwards are the first axis; frames where the requirement is met; shades from the least to the largest."""
    figure = heat_map(without(made(tmp_path), 6), Quantity("r95", "end"))
    panel = figure.axes[0]
    found = {tuple(text.get_position()): text.get_text() for text in panel.texts}
    assert found == {(0, 0): "100", (1, 0): "200", (2, 0): "300", (0, 1): "400", (1, 1): "500", (2, 1): "–"}
    # white numbers beyond 0.55 of the way from 100 to 500: 400 and 500
    white = [text.get_text() for text in panel.texts if text.get_color() == ON_DARK]
    assert white == ["400", "500"]
    assert {text.get_color() for text in panel.texts if text.get_text() not in white} == {ON_LIGHT}
    frames = [(round(one.get_x() + 0.46, 9), round(one.get_y() + 0.46, 9)) for one in panel.patches
              if not one.get_fill()]  # fmt: skip
    assert frames == [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]
    (chart,) = trade.heat_map(without(made(tmp_path), 6), Quantity("r95", "end"))
    (mesh,) = chart.marks
    assert isinstance(mesh, Cells)
    assert (mesh.low, mesh.high, mesh.log) == (100.0, 500.0, False)
    np.testing.assert_allclose(mesh.shades, [[0.0, 0.25, 0.5], [0.75, 1.0, np.nan]])
    (wider,) = trade.heat_map(made(tmp_path), Quantity("r95", "end"))
    assert wider.marks[0].log  # type: ignore[union-attr]  # beyond a ratio of 5
    np.testing.assert_allclose(wider.marks[0].shades[0, 1], np.log(2.0) / np.log(6.0))  # type: ignore[union-attr]
    assert ticks(panel, "x") == [(0.0, "0.02"), (1.0, "0.01"), (2.0, "0.05")]
    assert ticks(panel, "y") == [(0.0, "A"), (1.0, "B")]
    assert words(panel) == ("", "gyro bias σ, deg/h", "unit")
    assert figure._suptitle.get_text() == "R95 at the end [m], cell by cell"
    assert figure._supxlabel.get_text() == f"framed: meets {ASK[0]}"


def test_panels_of_a_grid(tmp_path: Path) -> None:
    picture = trade.grid_of(made(tmp_path, (OTHER, UNITS, RISING)), Quantity("r95", "at", 30.0))
    assert [panel.title for panel in picture.panels] == ["accel bias σ 10 µg", "accel bias σ 25 µg"]
    expected = [[700.0, 800.0, 900.0], [1000.0, 1100.0, 1200.0]]
    np.testing.assert_allclose(3.0 * picture.panels[1].value, expected)
    np.testing.assert_allclose(picture.panels[1].low, 0.8 * picture.panels[1].value)
    np.testing.assert_allclose(picture.panels[1].high, 1.5 * picture.panels[1].value)
    assert picture.panels[0].met.tolist() == [[True, True, True], [False, False, False]]
    assert [one.text for one in picture.limits] == [ASK[1]]
    assert (picture.label, picture.unit.name) == ("R95 at 30 s", "m")
    assert picture.limit(picture.limits[0]) == 100.0
    rows: Any = [in_rows(range(count), 3) for count in (1, 3, 4, 7)]  # type: ignore[arg-type]
    assert [tuple(map(len, one)) for one in rows] == [(1,), (3,), (3, 1), (3, 3, 1)]
    shades = trade.family_colors(Axis(key=BIAS, values=(2.0, 1.0, 5.0)))
    assert shades == [(80, 122, 165), (150, 200, 235), (10, 45, 95)]  # the second is the least


def test_the_scale_of_a_picture(tmp_path: Path) -> None:
    """Logarithmic beyond a ratio of 30, beside a logarithmic axis beyond 5."""

    def of(values: tuple[float, ...], sizes: tuple[float, ...]) -> bool:
        result = made(tmp_path, ({"key": BIAS, "values": values},))
        for one, size in zip(result.cells, sizes, strict=True):
            one.numbers.values["r95_end_m"] = size
        return trade.grid_of(result, Quantity("r95", "end")).logarithmic

    assert not of((0.01, 0.02, 0.05), (10.0, 20.0, 300.0))
    assert of((0.01, 0.02, 0.05), (10.0, 20.0, 301.0))
    assert not of((0.01, 0.02, 0.09), (10.0, 20.0, 50.0))
    assert of((0.01, 0.02, 0.09), (10.0, 20.0, 51.0))
    assert not Axis(key=BIAS, values=(0.01, 0.08)).logarithmic
    assert Axis(key=BIAS, values=(0.01, 0.081)).logarithmic
