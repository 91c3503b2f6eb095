"""What a trade study has to show, and the files that it writes."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from sinssim import exhibits
from sinssim.charts import TIME, Axis, Band, Bars, Cells, Chart, Charts, Color, Dots, Line, Mark, Remark, in_rows
from sinssim.data import Array
from sinssim.exhibits import Column, Exhibits, Interactive, Item, Section, Sentence, Table, Verbatim
from sinssim.experiments.studies.trade_cells import Cell, CellNumbers, place_name
from sinssim.experiments.studies.trade_result import (
    TradeResult,
    Unit,
    cell_table,
    definitions,
    failure_lines,
    headline,
    instants,
    label_of,
    requirement_lines,
    unit_for,
    what_if,
)
from sinssim.experiments.studies.trade_schema import Axis as GridAxis
from sinssim.recording import style
from sinssim.recording.result import plain, software, versions, write_json, write_shown
from sinssim.recording.streams import write_table
from sinssim.statistics.percentiles import runs_for_band
from sinssim.statistics.requirements import Quantity, Requirement
from sinssim.system.files import write_text
from sinssim.units import capital, fixed, number_text

MOST_PANELS = 12
"""Most panels of a picture, one for each place on the axes beyond the second."""
_ACROSS = 3
_WIDE, _WIDE_ALONG = 30.0, 5.0
"""Ratio of the largest to the smallest value from which a logarithmic scale is used, and beside a logarithmic axis."""
_WIDE_SHADES = 5.0
_FAR = 3.0
"""A limit is drawn if it is less than this multiple of the largest value, and more than its inverse of the least."""
_LINES = 10
"""Most cells whose growth is shown, so that their colours can be told apart."""


def pictures(result: TradeResult) -> Iterator[Charts]:
    """Yield for each drawn quantity its curves or bars and, with two axes, its heat map; and the growth."""
    if result.finished:
        for quantity in result.study.drawn:
            yield curves(result, quantity)
            if len(result.axes) > 1:
                yield heat_map(result, quantity)
    yield from growth(result)


@dataclass(frozen=True)
class Panel:
    """What one panel shows: a quantity over one or two axes, its band, and whether each cell meets the requirements.

    The title is the place on the other axes.
    """

    title: str
    value: Array
    low: Array
    high: Array
    met: NDArray[np.bool_]
    status: NDArray[np.str_]


@dataclass(frozen=True)
class GridOf:
    """A quantity of a study over its last two axes, a panel for each place on the others, of which some are drawn."""

    quantity: Quantity
    unit: Unit
    axes: tuple[GridAxis, ...]
    all_panels: tuple[Panel, ...]
    limits: tuple[Requirement, ...]

    @property
    def panels(self) -> tuple[Panel, ...]:
        """The panels that are drawn."""
        return self.all_panels[:MOST_PANELS]

    @property
    def key(self) -> str:
        """Name of its picture."""
        return re.sub(r"_(m|mps|rad|nmi_h)$", "", self.quantity.column)

    @property
    def label(self) -> str:
        """The quantity in words."""
        return capital(label_of(self.quantity))

    def limit(self, requirement: Requirement) -> float:
        """Return a limit in the unit of the values."""
        return requirement.limit / (1852.0 / 3600.0 if self.quantity.quantity == "rate" else 1.0)

    @property
    def finite(self) -> Array:
        """All finite positive values."""
        values = np.concatenate([panel.value.ravel() for panel in self.panels])
        return np.asarray(values[np.isfinite(values) & (values > 0.0)])

    @property
    def logarithmic(self) -> bool:
        """Whether a logarithmic scale suits the values."""
        along = self.axes[0] if len(self.axes) == 1 else self.axes[1 - families(self.axes)]
        ratio = _WIDE_ALONG if along.logarithmic else _WIDE
        return bool(len(self.finite) and self.finite.max() > ratio * self.finite.min())


def grid_of(result: TradeResult, quantity: Quantity) -> GridOf:
    """Return a quantity of a study, ready to be drawn."""
    study, inner = result.study, min(len(result.axes), 2)
    value, (low, high) = result.values(quantity), result.band(quantity)
    limits = tuple(
        requirement for requirement in study.requirements
        if (requirement.quantity, requirement.when) == (quantity.quantity, quantity.when)
        and (requirement.when != "at" or requirement.time == quantity.time)
    )  # fmt: skip
    met = np.full(study.shape, bool(limits))
    for requirement in limits:
        met &= result.verdicts(requirement.text) == "met"
    status = np.array([cell.status for cell in result.cells]).reshape(study.shape)
    panels = [
        Panel(place_name(study, place), *(part[place] for part in (value, low, high, met, status)))
        for place in itertools.product(*map(range, study.shape[:-inner]))
    ]
    return GridOf(quantity, unit_for(result, quantity), study.axes[-inner:], tuple(panels), limits)


def grids(result: TradeResult, quantity: Quantity) -> Iterator[Table]:
    """Yield a quantity over the last two axes, a table for each place on the others; "*" marks that limits are met."""
    grid = grid_of(result, quantity)
    down, across = grid.axes
    columns = (Column(f"{down.heading} \\ {across.heading}", words=True),
               *(Column(across.name_of(k)) for k in range(len(across.values))))  # fmt: skip
    star = "; * meets " + " and ".join(r.text for r in grid.limits) if grid.limits else ""
    for panel in grid.all_panels:
        rows = [
            [down.name_of(i), *((grid.unit.text(v) if status == "finished" else status) + (" *" if met else "")
                                for v, met, status in zip(*cells, strict=True))]
            for i, cells in enumerate(zip(panel.value, panel.met, panel.status, strict=True))
        ]  # fmt: skip
        fixed_by = f": {panel.title}" if panel.title else ""
        yield Table(columns, rows, f"{grid.label}, {grid.unit.name}{fixed_by}{star}")


def families(axes: Sequence[GridAxis]) -> int:
    """Return which of two axes gives a curve, or a colour of bars, each."""
    if axes[0].numeric != axes[1].numeric:
        return 1 if axes[0].numeric else 0
    return 1 if len(axes[0].values) > len(axes[1].values) else 0


def family_colors(axis: GridAxis) -> list[style.Rgb]:
    """Return a colour for each value of an axis: shades of one in the order of numbers, others for choices."""
    count = len(axis.values)
    if not axis.numeric or count <= 2:
        return choice_colors(count)
    light, dark = np.array([150.0, 200.0, 235.0]), np.array([10.0, 45.0, 95.0])
    order = np.argsort(np.argsort(np.array(axis.values, dtype=np.float64)))
    shades = [light + (dark - light) * place / (count - 1) for place in order]
    return [(round(r), round(g), round(b)) for r, g, b in shades]


def choice_colors(count: int) -> list[style.Rgb]:
    """Return colours for choices, without that of the limits."""
    more = style.colors([f"choice {k}" for k in range(2 * count + 8)])
    return [color for color in more if color != style.COLORS["limit"]][:count]


def curves(result: TradeResult, quantity: Quantity) -> Charts:
    """Return a quantity over the grid.

    One axis of numbers gives a curve, one of choices bars. Two axes give curves by colour if one of them has numbers,
    else groups of bars. Further axes give panels.
    """
    grid = grid_of(result, quantity)
    y = Axis(label=grid.label, units=fixed(grid.unit.name, grid.unit.size), log=grid.logarithmic,
             low=None if grid.logarithmic else 0.0)  # fmt: skip
    charts = []
    for number, panel in enumerate(grid.panels):
        x, marks = _family(grid, panel)
        charts.append(Chart(key=f"{grid.key}/{number}", title=panel.title, x=x, y=y, marks=tuple(marks), room=1.12))
    rows, named = in_rows(charts, _ACROSS), grid.axes[families(grid.axes)].heading if len(grid.axes) == 2 else ""
    size = (max(4.6 * len(rows[0]), 6.4) + 2.2, 3.1 * len(rows) + 0.9)
    return Charts(grid.key, rows, size, title=grid.label, note=_band_note(grid), legend="right", share="xy",
                  named=named)  # fmt: skip


def _family(grid: GridOf, panel: Panel) -> tuple[Axis, list[Mark]]:
    """Return the horizontal axis and the marks of a panel."""
    colors: Sequence[Color]
    if len(grid.axes) == 1:
        along, names, colors = grid.axes[0], [""], ["r95" if grid.quantity.quantity != "cep" else "cep"]
        rows = [(panel.value, panel.low, panel.high)]
    else:
        family = families(grid.axes)
        along, by = grid.axes[1 - family], grid.axes[family]
        names, colors = [by.name_of(k) for k in range(len(by.values))], family_colors(by)
        rows = list(zip(*(np.moveaxis(part, family, 0) for part in (panel.value, panel.low, panel.high)), strict=True))
    marks: list[Mark] = []
    for number, ((value, low, high), name, color) in enumerate(zip(rows, names, colors, strict=True)):
        here = _curve if along.numeric else _choices
        marks += here(grid, along, (value, low, high), name, color, (number, len(rows)))
    if along.numeric:
        x = np.sort(np.array(along.values, dtype=np.float64))
        scaled = np.log(x) if along.logarithmic else x
        apart = len(x) > 1 and np.diff(scaled).min() > 0.06 * (scaled[-1] - scaled[0])
        axis = Axis(label=along.title, units=fixed(along.unit), log=along.logarithmic, ticks=tuple(x) if apart else ())
        ends = x[[0, -1]]
    else:
        names = [along.name_of(k) for k in range(len(along.values))]
        axis, ends = Axis(label=along.heading, names=tuple(names), grid=False), np.array([-0.5, len(names) - 0.5])
    return axis, [*marks, *_limits(grid, ends)]


Row = tuple[Array, Array, Array]
"""Values of a curve or of bars of one colour, and the ends of their bands."""


def _curve(grid: GridOf, along: GridAxis, row: Row, name: str, color: Color, _: tuple[int, int]) -> Iterator[Mark]:
    x = np.array(along.values, dtype=np.float64)
    order, (value, low, high) = np.argsort(x), row
    if np.isfinite(low).any():  # too few runs have no upper end
        yield Band(x=x[order], low=low[order], high=np.where(np.isfinite(high), high, value)[order], color=color)
    y = np.where(np.isfinite(value), value, np.nan)[order]
    yield Line(label=name, x=x[order], y=y, color=color, marker="o")


def _choices(grid: GridOf, along: GridAxis, row: Row, name: str, color: Color, of: tuple[int, int]) -> Iterator[Mark]:
    """Yield bars, or dots where a logarithmic scale leaves a bar without a foot."""
    (number, count), (value, low, high) = of, row
    width = 0.8 / count
    there = np.isfinite(value)
    at = np.arange(float(len(value)))[there] + (number - 0.5 * (count - 1)) * width
    value, low, high = value[there], low[there], high[there]
    bands = np.isfinite(low) & np.isfinite(high)
    few = count * len(along.values) <= 12
    texts = tuple(number_text(float(v) / grid.unit.size) for v in value) if few else ()
    if grid.logarithmic:
        gap = np.full(int(bands.sum()), np.nan)
        ends = np.column_stack([low[bands], high[bands], gap]).ravel()
        yield Line(x=np.repeat(at[bands], 3), y=ends, color="ink", weight="thin")
        yield Dots(label=name, x=at, y=value, color=color, size=7.0)
        for x, y, text in zip(at, value, texts, strict=False):
            yield Remark(x=float(x), y=float(y), text=text)
    else:
        low, high = (np.where(bands, end, value) if bands.any() else np.empty(0) for end in (low, high))
        yield Bars(label=name, places=at, values=value, color=color, texts=texts, across=False, width=0.92 * width,
                   low=low, high=high)  # fmt: skip


def _limits(grid: GridOf, ends: Array) -> Iterator[Mark]:
    """Yield the lines of requirements on the quantity; one that is far away is named alone."""
    there = grid.finite
    for requirement in grid.limits:
        limit = grid.limit(requirement)
        near = not len(there) or there.min() / _FAR <= limit <= _FAR * there.max()
        where = "" if near else f" ({'above' if limit > there.max() else 'below'} the plot)"
        x, y = (ends, np.full(2, limit)) if near else (np.empty(0), np.empty(0))
        yield Line(label=f"{requirement.text}{where}", x=x, y=y, color="limit", dash="--", weight="thin")


def _band_note(grid: GridOf) -> str:
    """Return what the bands are; "" without any."""
    low, high = (np.concatenate([getattr(panel, k).ravel() for panel in grid.panels]) for k in ("low", "high"))
    if not np.isfinite(low).any():
        return ""
    few = f"; no upper end of R95 from fewer than {runs_for_band(0.95)} runs"
    return f"bands: 95 % confidence{few if np.isinf(high[np.isfinite(low)]).any() else ''}"


def heat_map(result: TradeResult, quantity: Quantity) -> Charts:
    """Return a quantity over two axes as coloured cells with their numbers; a frame means that requirements are met."""
    grid = grid_of(result, quantity)
    down, across = grid.axes
    there = grid.finite if len(grid.finite) else np.array([1.0])
    least, most = float(there.min()), float(there.max())
    log = most > _WIDE_SHADES * least
    x, y = (Axis(label=axis.heading, names=tuple(axis.name_of(k) for k in range(len(axis.values))), grid=False)
            for axis in (across, down))  # fmt: skip
    charts = []
    for number, panel in enumerate(grid.panels):
        texts = [[grid.unit.text(v) for v in row] for row in panel.value]
        marks = Cells(values=panel.value, texts=texts, low=least if log else min(least, 0.999 * most), high=most,
                      log=log, framed=panel.met)  # fmt: skip
        charts.append(Chart(key=f"{grid.key}_map/{number}", title=panel.title, x=x, y=y, marks=(marks,)))
    rows = in_rows(charts, _ACROSS)
    size = (
        min(max(0.85 * len(across.values) * len(rows[0]) + 2.4, 5.5), 14.0),
        max((0.42 * len(down.values) + 0.75) * len(rows) + 0.8, 2.4),
    )
    met = " and ".join(requirement.text for requirement in grid.limits)
    return Charts(f"{grid.key}_map", rows, size, title=f"{grid.label} [{grid.unit.name}], cell by cell",
                  note=f"framed: meets {met}" if met else "", share="xy",)  # fmt: skip


def shown_cells(result: TradeResult) -> list[tuple[Cell, CellNumbers]]:
    """Return the cells whose growth is shown, in order: all, or some from the least to the largest R95."""
    there = [(cell, cell.numbers) for cell in result.cells if cell.numbers is not None and len(cell.numbers.time) > 1]
    if len(there) <= _LINES:
        return there
    ranked = sorted(range(len(there)), key=lambda k: (np.nan_to_num(there[k][1].r95[-1], nan=np.inf), k))
    places = np.unique(np.round(np.linspace(0, len(ranked) - 1, _LINES)).astype(int))
    return [there[k] for k in sorted(ranked[place] for place in places)]


def growth(result: TradeResult) -> Iterator[Charts]:
    """Yield R95 over time in each cell, or in some from the best to the worst, and CEP for the recording."""
    shown = shown_cells(result)
    if not shown:
        return
    unit = unit_for(result, Quantity("r95", "end"), Quantity("cep", "end"))
    last = np.array([numbers.r95[-1] for _, numbers in shown])
    log, low = is_wide(last), 0.1 * float(last.min())
    colors = _colors(result, [cell.number for cell, _ in shown])
    names = [place_name(result.study, cell.place, titled=False) for cell, _ in shown]
    whole = len(shown) == sum(cell.numbers is not None and len(cell.numbers.time) > 1 for cell in result.cells)
    for key, title in (("r95", "Growth of R95 in each cell" if whole else ""), ("cep", "")):
        marks = tuple(
            Line(label=name, x=numbers.time, y=np.where(np.isfinite(v), v, np.nan), color=color)
            for name, (_, numbers), color in zip(names, shown, colors, strict=True)
            for v in (numbers.r95 if key == "r95" else numbers.cep,)
        )
        y = Axis(label=key.upper(), units=fixed(unit.name, unit.size), log=log, low=low if log else 0.0)
        on = ("page", "recording") if title else ("recording",)
        group = "growth" if key == "r95" else "growth_cep"
        yield Charts(group, ((Chart(key=key, x=TIME, y=y, marks=marks),),), (10.5, 4.0), title=title, legend="right",
                     on=on, named=", ".join(axis.title for axis in result.axes))  # fmt: skip


def _colors(result: TradeResult, numbers: Sequence[int]) -> list[style.Rgb]:
    """Return a colour for each cell: shades along a single axis of numbers, else others for each."""
    if len(result.axes) == 1:
        shades = family_colors(result.axes[0])
        return [shades[number - 1] for number in numbers]
    return choice_colors(len(numbers))


def is_wide(last: Array) -> bool:
    """Return whether the errors at the end of several cells differ so much that their growth needs a logarithm."""
    return bool(len(last) and np.isfinite(last).all() and 0.0 < _WIDE * last.min() < last.max())


_MOST_ROWS, _MOST_ACROSS, _MOST_GRIDS, _MOST_WIDTH = 40, 10, 4, 118
"""On the console: cells in a table, columns of a grid, grids, and characters of a row beside which verdicts stand."""
_PAGE: Any = ("page", "recording")


def exhibits_of(result: TradeResult) -> Exhibits:
    """Return what a trade study has to show."""
    study, judged = result.study, requirement_lines(result)
    shown, drawn = shown_cells(result), [*pictures(result)]
    sentences, panels = [*map(Sentence, judged)], math.prod(result.shape[:-2])
    few = f"The figures show {MOST_PANELS} of {panels} panels; the table has all."
    left = [Sentence(few, "note")] if panels > MOST_PANELS else []
    items: list[Item] = [
        *([Sentence(" ".join(study.description.split()), "lead", on=_PAGE)] if study.description else []),
        Sentence(headline(result), "note", on=_PAGE),
        *(Sentence(note, "strong", on=_PAGE) for note in result.notes),
        *([Section("Requirements", sentences, on=_PAGE)] if judged else []),
        *_grids(result),
        Section("Trade-offs", [*left, *drawn], on=_PAGE),
        *([Section("What if", [Interactive("trade_what_if", lambda: what_if(result))], on=("page",))]
          if any(cell.numbers is not None and cell.numbers.sources for cell in result.cells) else []),
        Section("Cells", [item for when in (None, *instants(result)) for item in _cells(result, when)]),
        *(Sentence(line, on=("console",)) for line in judged),
        *([Section("Failed cells", [*map(Sentence, failure_lines(result))])] if result.failures else []),
        *(Sentence(f"{name}: {text}.", on=("console",)) for name, text in definitions(result).items()),
        exhibits.definitions(definitions(result), _PAGE),
        Section("How it was computed", [*_method(result)], on=_PAGE),
    ]  # fmt: skip
    ends = [float(numbers.time[-1]) for _, numbers in shown]
    titled = [item for item in drawn if item.title]
    shots = json.dumps([(f"trade/figures/{item.key}", item.title) for item in titled])
    labels = {"shown": str(len(shown)), "cells": str(len(result)), "pictures": shots}
    return Exhibits(
        f"{study.name}: a trade study", items, f"{study.name}: {headline(result)}", name=study.name, kind="trade",
        root="trade", span=(0.0, max(ends, default=1.0)), labels=labels, pictures=tuple(item.key for item in titled),
    )  # fmt: skip


def _grids(result: TradeResult) -> Iterator[Item]:
    """Yield a quantity over the last two axes as tables; on the console a few that are not too wide."""
    if len(result.axes) > 1:
        most = _MOST_GRIDS if len(result.axes[-1].values) <= _MOST_ACROSS else 0
        tables = itertools.chain.from_iterable(grids(result, quantity) for quantity in result.study.drawn)
        for number, table in enumerate(tables):
            yield replace(table, on=("console", "recording") if number < most else ("recording",))


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
    yield Verbatim("Commands of the cells", "\n".join(result.command(cell.number) for cell in result.cells))
    yield Sentence(software(), "note")


def to_json(result: TradeResult) -> dict[str, Any]:
    """Return the contents of `results.json`; unknown numbers are None."""
    study = result.study
    cells = [
        {
            "cell": cell.number,
            "settings": study.settings(cell.place),
            "status": cell.status,
            "failure": cell.failure,
            "values": {} if cell.numbers is None else cell.numbers.values,
            "requirements": [] if cell.numbers is None else [vars(verdict) for verdict in cell.numbers.verdicts],
            "digest": cell.digest,
            "command": result.command(cell.number),
        }
        for cell in result.cells
    ]
    axes = [
        {"name": axis.title, "keys": list(axis.paths), "unit": axis.unit, "values": list(axis.values),
         "labels": list(axis.labels)}
        for axis in study.axes
    ]  # fmt: skip
    contents = {
        "study": study.name,
        "description": study.description,
        "status": result.status,
        "scenario": study.scenario,
        "set": list(study.set),
        "cell": study.cell,
        "axes": axes,
        "finished": result.finished,
        "failed": len(result.failures),
        "definitions": definitions(result),
        "cells": cells,
        "notes": result.notes,
        "computed": result.computed,
        "seconds": round(result.seconds, 2),
        "versions": versions(),
    }
    return dict(plain(contents))


def write_trade(result: TradeResult, folder: Path) -> None:
    """Write the report of a trade study, its pictures, its numbers and its recording."""

    from sinssim.recording.figures import figure_of, save
    from sinssim.recording.rerun_exhibits import markdown

    shown = exhibits_of(result)
    write_text(folder / "study.toml", tomli_w.dumps(result.study.model_dump(exclude_none=True)))
    write_json(folder / "results.json", to_json(result))
    write_table(result.to_table(), folder / "results.parquet")
    write_text(folder / "summary.md", markdown(shown))
    for key in shown.pictures:
        picture = figure_of(shown.chosen(key))
        for ending in (".svg", ".png"):
            save(picture, folder / f"{key}{ending}")
    write_shown(shown, folder)
