"""What a trade study has to show: which cells meet what, pictures over the grid, tables of the cells."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any

from sinssim.exhibits import Column, Exhibits, Item, Section, Sentence, Table, Verbatim
from sinssim.experiments.trades.result import TradeResult
from sinssim.experiments.trades.summary import (
    cell_table,
    definitions,
    failure_lines,
    grids,
    headline,
    instants,
    requirement_lines,
)
from sinssim.experiments.trades.trade_charts import MOST_PANELS, pictures, shown_cells
from sinssim.formatting import capital
from sinssim.recording.store.summary import software
from sinssim.scales import fixed
from sinssim.statistics.requirements.quantity import Quantity

_MOST_ROWS, _MOST_ACROSS, _MOST_GRIDS, _MOST_WIDTH = 40, 10, 4, 118
"""On the console: cells in a table, columns of a grid, grids, and characters of a row beside which verdicts stand."""
_PAGE: Any = ("page", "recording")


def exhibits_of(result: TradeResult) -> Exhibits:
    """Return what a trade study has to show."""
    study, judged = result.study, requirement_lines(result)
    shown, drawn = shown_cells(result), [*pictures(result)]
    sentences = [*map(Sentence, judged)]
    items: list[Item] = [
        *([Sentence(study.description, "lead", on=_PAGE)] if study.description else []),
        Sentence(headline(result), "note", on=_PAGE),
        *(Sentence(note, "strong", on=_PAGE) for note in result.notes),
        *([Section("Requirements", sentences, on=_PAGE)] if judged else []),
        *_grids(result),
        Section("Trade-offs", [*_panels_left(result), *drawn], on=_PAGE),
        Section("Cells", [one for when in (None, *instants(result)) for one in _cells(result, when)]),
        *(Sentence(line, on=("console",)) for line in judged),
        *([Section("Failed cells", [*map(Sentence, failure_lines(result))])] if result.failures else []),
        *(Sentence(f"{name}: {text}.", on=("console",)) for name, text in definitions(result).items()),
        Section("Definitions", [Table((Column("", words=True), Column("definition", words=True)),
                                      list(definitions(result).items()))], on=_PAGE),
        Section("How it was computed", [*_method(result)], on=_PAGE),
    ]  # fmt: skip
    ends = [float(numbers.time[-1]) for _, numbers in shown]
    own = [one for one in drawn if one.title]
    shots = json.dumps([(f"trade/figures/{one.key}", one.title) for one in own])
    labels = {"shown": str(len(shown)), "cells": str(len(result)), "pictures": shots}
    return Exhibits(
        f"{study.name}: a trade study", items, f"{study.name}: {headline(result)}", name=study.name, kind="trade",
        root="trade", span=(0.0, max(ends, default=1.0)), labels=labels, pictures=tuple(one.key for one in own),
    )  # fmt: skip


def _grids(result: TradeResult) -> Iterator[Item]:
    """Yield a quantity over the last two axes as tables; on the console a few that are not too wide."""
    if len(result.axes) > 1:
        found = [grid for quantity in result.study.drawn for grid in grids(result, quantity)]
        room = _MOST_GRIDS if len(result.axes[-1].values) <= _MOST_ACROSS else 0
        for number, one in enumerate(found):
            columns = (Column(one.corner, words=True), *map(Column, one.across))
            on: Any = ("console", "recording") if number < room else ("recording",)
            yield Table(columns, one.rows, one.title, on=on)


def _panels_left(result: TradeResult) -> Iterator[Item]:
    panels = math.prod(result.shape[:-2])
    if panels > MOST_PANELS:
        yield Sentence(f"The figures show {MOST_PANELS} of {panels} panels; the table has all.", "note")


def _cells(result: TradeResult, when: Quantity | None) -> Iterator[Item]:
    """Yield the tables with a row for each cell; verdicts in a table of their own if there is no room beside."""
    title = "At the end" if when is None else capital(when.instant)
    judged = len(result.study.requirements) if when is None else 0
    for bands in (False, True):
        heads, rows, words = cell_table(result, when, bands=bands)
        columns = [_column(head, number < words) for number, head in enumerate(heads)]
        parts_of = ([*re.split(", | <=? | ≤ ", head), *(row[k] for row in rows)] for k, head in enumerate(heads))
        width = sum(2 + max(map(len, parts)) for parts in parts_of)
        apart = judged > 0 and (result.study.cell == "ensemble" if bands else width > _MOST_WIDTH)
        first = range(len(heads) - judged if apart else len(heads))
        parts = [(title, [*first]), *([("Verdicts", [*range(words), *range(len(first), len(heads))])] if apart else [])]
        shown = rows if bands else rows[:_MOST_ROWS]
        more = f"… and {len(rows) - len(shown)} more cells, in summary.md and report.html." if shown != rows else ""
        for name, places in parts:
            yield Table(tuple(columns[k] for k in places), [[row[k] for k in places] for row in shown], name, more,
                        on=_PAGE if bands else ("console",))  # fmt: skip


def _column(head: str, words: bool) -> Column:
    name, _, unit = head.partition(", ")
    return Column(name, fixed(unit) if unit else None, words=words)


def _method(result: TradeResult) -> Iterator[Item]:
    yield Sentence(
        "Every cell has the numbers of its separate command, bit for bit. Cells on the same true motion share it. "
        f"{result.computed} cells were computed in {result.seconds:.1f} s by this call."
    )
    yield Verbatim("Commands of the cells", "\n".join(result.command(one.cell.number) for one in result.cells))
    yield Sentence(software(), "note")
