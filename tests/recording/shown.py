"""What exhibits hold, as numbers and words."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sinssim.charts import Chart
from sinssim.exhibits import Exhibits, Item, Medium, Section, Sentence, Table

M = TypeVar("M")


def chart_of(exhibits: Exhibits, key: str) -> Chart:
    """Return the chart with a key."""
    return next(chart for charts in exhibits.charts() for chart in charts if chart.key == key)


def marks_of(chart: Chart, kind: type[M]) -> list[M]:
    """Return the marks of a kind."""
    return [mark for mark in chart.marks if isinstance(mark, kind)]


def same(found: Any, wanted: Any) -> None:
    """Compare numbers."""
    np.testing.assert_allclose(np.asarray(found, dtype=float), np.asarray(wanted, dtype=float), rtol=1e-9, atol=1e-12)


def items_of(items: Sequence[Item], medium: Medium) -> list[Item]:
    """Return sentences, tables and texts that a medium shows, those of sections, too."""
    found: list[Item] = []
    for item in items:
        if medium in item.on:
            found += items_of(item.items, medium) if isinstance(item, Section) else [item]
    return found


def sentences(exhibits: Exhibits, medium: Medium) -> list[str]:
    """Return the sentences that a medium shows."""
    return [item.text for item in items_of(exhibits.items, medium) if isinstance(item, Sentence)]


def titles(exhibits: Exhibits, medium: Medium = "page") -> list[str]:
    """Return the titles of the sections of a medium."""
    return [item.title for item in exhibits.items if isinstance(item, Section) and medium in item.on]


def tables(exhibits: Exhibits, medium: Medium) -> list[Table]:
    """Return the tables that a medium shows."""
    return [item for item in items_of(exhibits.items, medium) if isinstance(item, Table)]


def still(page: str) -> str:
    """Return a page without what its script reads and draws."""
    return re.sub(r' data-chart="[^"]*"|<script>.*?</script>', "", page, flags=re.DOTALL)


def curves_of(page: str | Path) -> list[dict[str, Any]]:
    """Return the data of the curves of a page, a text or a file, that can be zoomed."""
    text = page if isinstance(page, str) else page.read_text(encoding="utf-8")
    return [json.loads(html.unescape(found)) for found in re.findall(r'data-chart="([^"]*)"', text)]
