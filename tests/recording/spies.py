"""Stand-ins for what draws: they keep every curve, label, unit and limit, to be compared with what was written down."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from sinssim.recording.report.plot import Line


@dataclass
class Plot:
    """One call of `plot.plot`."""

    title: str
    unit: str
    lines: list[Line]
    span: tuple[float, float]
    options: dict[str, Any]

    @property
    def marks(self) -> list[tuple[float, str, bool]]:
        """Times, texts and faintness of its vertical lines."""
        return [(mark.time, mark.text, mark.faint) for mark in self.options.get("marks", ())]

    def shows(self, title: str, unit: str, *curves: tuple[str, str, Sequence[float], Sequence[float]]) -> None:
        """Assert title, unit and curves: label, colour, times and values in the plot's unit."""
        assert (self.title, self.unit) == (title, unit)
        assert [(line.label, line.color) for line in self.lines] == [curve[:2] for curve in curves]
        for line, (label, _, time, values) in zip(self.lines, curves, strict=True):
            np.testing.assert_allclose(line.time, time, rtol=1e-12, err_msg=label)
            np.testing.assert_allclose(line.values / line.size, values, rtol=1e-9, atol=1e-12, err_msg=label)


class Plots(list[Plot]):
    """Stands in for `plot.plot`; a page shows "plot K" where the K-th plot is."""

    def __call__(self, title: str, unit: str, lines: Sequence[Line], span: tuple[float, float], **options: Any) -> str:
        self.append(Plot(title, unit, list(lines), span, options))
        return f"plot {len(self) - 1}"


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

    def points(
        self, entity: str, rows: int, time: Any, values: Any, names: Any, color: Any, *, marker: str, size: float
    ) -> None:
        every = slice(0, rows)
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


@pytest.fixture
def plots(monkeypatch: pytest.MonkeyPatch) -> Plots:
    """The plots that a report draws, which are not rendered."""
    from sinssim.recording.report import plot

    found = Plots()
    monkeypatch.setattr(plot, "plot", found)
    return found
