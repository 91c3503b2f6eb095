"""Stand-ins for what draws: they keep every curve, label, unit and limit, to be compared with what was written down."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sinssim.charts import Chart, Dots, Line, Rule
from sinssim.exhibits import Item, charts_in
from sinssim.recording import style
from sinssim.recording.page import parts_of
from sinssim.recording.rerun_exhibits import record_charts


@dataclass
class Plot:
    """A chart of a page."""

    chart: Chart

    @property
    def title(self) -> str:
        return self.chart.title

    @property
    def unit(self) -> str:
        return self.chart.unit(True)[0]

    @property
    def lines(self) -> list[Line | Dots]:
        """Its lines and dots, each with its colour in CSS."""
        marks = zip(self.chart.marks, style.of_marks(self.chart.marks), strict=True)
        return [replace(m, color=style.css_of(c)) for m, c in marks if isinstance(m, Line | Dots)]

    @property
    def span(self) -> tuple[float | None, float | None]:
        """Ends of its horizontal axis."""
        return self.chart.x.low, self.chart.x.high

    @property
    def marks(self) -> list[tuple[float, str, bool]]:
        """Times, texts and faintness of its vertical lines."""
        rules = [mark for mark in self.chart.marks if isinstance(mark, Rule) and mark.upright]
        return [(rule.at, rule.text, rule.color == "grid") for rule in rules]

    @property
    def levels(self) -> list[tuple[float, str]]:
        """Values and labels of its horizontal lines."""
        rules = [mark for mark in self.chart.marks if isinstance(mark, Rule) and not mark.upright]
        return [(rule.at, rule.label) for rule in rules]

    def shows(self, title: str, unit: str, *curves: tuple[str, str, Any, Any]) -> None:
        """Assert title, unit and curves: label, colour, times and values in the plot's unit."""
        assert (self.title, self.unit) == (title, unit)
        assert [(line.label, line.color) for line in self.lines] == [curve[:2] for curve in curves]
        for line, (label, _, time, values) in zip(self.lines, curves, strict=True):
            np.testing.assert_allclose(line.x[:], time, rtol=1e-12, err_msg=label)
            size = self.chart.unit(True)[1]
            np.testing.assert_allclose(line.y[:] / size, values, rtol=1e-9, atol=1e-12, err_msg=label)


def plots(items: Iterable[Item]) -> list[Plot]:
    """Return the charts that a page shows of some exhibits."""
    return [Plot(chart) for charts in charts_in(items) if "page" in charts.on for chart in charts]


def html(*items: Item) -> str:
    """Return exhibits as a page has them."""
    return "".join(parts_of(items, 3))


def record(items: Iterable[Item]) -> Any:
    """Return what a recording shows of some exhibits, with its labels."""
    drawn: Any = Drawn()
    drawn.labels = {}
    for charts in charts_in(items):
        drawn.labels |= record_charts(drawn, charts)
    return drawn


class Drawn:
    """Stands in for a recording of Rerun."""

    def __init__(self) -> None:
        self.lines: dict[str, tuple[Any, ...]] = {}
        self.dots: dict[str, tuple[Any, ...]] = {}
        self.fixed: dict[str, Any] = {}
        self.moving: dict[str, tuple[Any, Any]] = {}
        self.texts: dict[str, str] = {}
        self.ranges: dict[str, tuple[float, float]] = {}

    def series(self, entity: str, time: Any, values: Any, names: Any, *, colors: Any = None, widths: Any = 1.5) -> None:
        assert np.shape(values) == (len(time), len(names)), entity
        self.lines[entity] = (np.asarray(time), np.asarray(values), list(names), colors, widths)
        self.ranges[entity] = (float(np.nanmin(values)), float(np.nanmax(values)))

    def points(self, entity: str, time: Any, values: Any, names: Any, color: Any, *, marker: str, size: float) -> None:
        every = slice(0, len(time))
        self.dots[entity] = (np.asarray(time[every]), np.asarray(values[every]), list(names), color, marker, size)

    def static(self, entity: str, archetype: Any) -> None:
        self.fixed[entity] = archetype

    def columns(self, entity: str, time: Any, columns: Any) -> None:
        self.moving[entity] = (time, columns)

    def document(self, entity: str, markdown: str) -> None:
        self.texts[entity] = markdown

    def shows(self, entity: str, names: Sequence[str], time: Any, values: Any, colors: Any = None) -> None:
        """Assert the names, times and values of the lines of an entity, and their colours if given."""
        found = self.lines[entity]
        assert found[2] == list(names), entity
        np.testing.assert_allclose(found[0], time, rtol=1e-12, err_msg=entity)
        np.testing.assert_allclose(found[1], values, rtol=1e-9, atol=1e-12, err_msg=entity)
        if colors is not None:
            assert [tuple(color) for color in found[3]] == colors, entity


class Shown:
    """What exhibits have: the charts by key, the page's HTML and the recording."""

    def __init__(self, items: Iterable[Item]) -> None:
        self.items = list(items)
        groups = list(charts_in(self.items))
        self.charts = {chart.key: chart for charts in groups for chart in charts}
        self.html = "".join(parts_of(self.items, 3))
        self.drawn: Any = Drawn()
        self.labels = {key: unit for charts in groups for key, unit in record_charts(self.drawn, charts).items()}

    def curves(self, key: str, title: str, unit: str, *curves: tuple[str, str, Any, Any]) -> None:
        """Assert title, unit and lines of a chart: label, colour, times and values in the chart's unit."""
        chart = self.charts[key]
        assert (chart.title, chart.unit(True)[0]) == (title, unit)
        colors = [style.css_of(color) for color in style.of_marks(chart.marks)]
        lines = [(mark, color) for mark, color in zip(chart.marks, colors, strict=True) if hasattr(mark, "x")]
        assert [(line.label, color) for line, color in lines] == [curve[:2] for curve in curves]
        for (line, _), (label, _, x, y) in zip(lines, curves, strict=True):
            np.testing.assert_allclose(line.x[:], x, rtol=1e-12, err_msg=label)
            np.testing.assert_allclose(line.y[:] / chart.unit(True)[1], y, rtol=1e-9, atol=1e-12, err_msg=label)

    def rules(self, key: str) -> list[tuple[float, str]]:
        """Return place and text of the upright lines of a chart."""
        return [(mark.at, mark.text) for mark in self.charts[key].marks if isinstance(mark, Rule)]

    def span(self, key: str) -> tuple[float | None, float | None]:
        """Return the ends of a chart's horizontal axis."""
        return self.charts[key].x.low, self.charts[key].x.high


def values_of(batch: Any) -> Any:
    """Return the plain values of a component of one of Rerun's archetypes."""
    return batch.as_arrow_array().to_pylist()


def cells(html: str) -> list[list[str]]:
    """Return the texts of the cells of all rows of the tables of a page."""
    rows = re.findall(r"<tr>(.*?)</tr>", html, re.S)
    return [
        [re.sub("<[^>]*>", "", cell) for cell in re.findall(r"<t[dh]\b[^>]*>(.*?)</t[dh]>", row, re.S)] for row in rows
    ]


def read(html: str) -> str:
    """Return the text of a page."""
    return " ".join(re.sub("<[^>]*>", " ", html).split())
