"""What a result has to show: sentences, tables and charts in sections, which every medium renders.

A text may have parts in `**bold**`, and commands between backticks. Numbers are in SI; the medium takes
the unit that suits them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from sinssim.charts import Charts, Cloud, Color
from sinssim.data import Array
from sinssim.units import Scale, number_text, suiting

Medium = Literal["console", "page", "recording"]
EVERYWHERE: tuple[Medium, ...] = ("console", "page", "recording")
Verdict = Literal["", "met", "not met", "undecided", "confirmed", "partly", "refuted"]


@dataclass(frozen=True)
class Sentence:
    """A paragraph."""

    text: str  # whole sentences
    # "lead" below a title, "note" for a remark, "strong" for what must not be overlooked, "warning" for what is wrong
    kind: Literal["", "lead", "note", "strong", "warning"] = ""
    on: tuple[Medium, ...] = EVERYWHERE  # the media that show it


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    head: str  # what it holds, without the unit
    units: Scale | None = None  # units of its numbers; None for texts, and for numbers that are shown as they are
    words: bool = False  # whether it holds words, which begin at the left
    digits: int = 0  # significant digits of its numbers; 0 for `four_digits`
    on: tuple[Medium, ...] = EVERYWHERE  # the media that show it
    group: str = ""  # a head that it shares with its neighbours of the same group, above its own


@dataclass(frozen=True)
class Table:
    """A table."""

    columns: tuple[Column, ...]
    rows: Sequence[Sequence[str | float]]  # a text, perhaps of several lines, or a number in SI for each column
    title: str = ""  # above it; the console takes that of the section if it is empty
    note: str = ""  # below it
    colors: Sequence[Color] = ()  # of the rows, shown by a square before each; empty for none
    shaded: bool = False  # whether the numbers are shaded by their logarithm, the least most
    # whether its columns of numbers belong to rising values, of which a narrow console leaves some out
    rising: bool = False
    on: tuple[Medium, ...] = EVERYWHERE  # the media that show it

    def shown(self, medium: Medium) -> tuple[list[Column], list[tuple[str, str]], list[list[str]]]:
        """Return what a medium shows: the columns, their heads and units, and the texts of the rows. Columns of one
        quantity have one unit."""
        places = [k for k, column in enumerate(self.columns) if medium in column.on]
        values_of: dict[int, list[float]] = {}
        for k in places:
            values = [row[k] for row in self.rows if not isinstance(row[k], str)]
            values_of.setdefault(id(self.columns[k].units), []).extend(v for v in values if math.isfinite(v))  # type: ignore[misc,arg-type]
        chosen = {
            k: ("", 1.0) if (units := self.columns[k].units) is None else _unit(units, np.array(values_of[id(units)]))
            for k in places
        }
        texts = [[_text(row[k], chosen[k][1], self.columns[k].digits) for k in places] for row in self.rows]
        columns = [self.columns[k] for k in places]
        return columns, [(self.columns[k].head, chosen[k][0]) for k in places], texts


def _unit(units: Scale, values: Array) -> tuple[str, float]:
    """Return the unit of numbers: that of the largest one, but SI if it hides a small one, as kilometres hide
    centimetres."""
    name, size = suiting(units, values)
    hidden = (np.abs(values) > _SMALL) & (np.abs(values) < 1e-3 * size)
    return suiting(units, np.ones(1)) if size > 1.0 and hidden.any() else (name, size)


_SMALL = 1e-6
"""Number in SI below which a value may be a rounding error, which no unit has to show."""


def _text(cell: str | float, size: float, digits: int) -> str:
    if isinstance(cell, str):
        return cell
    text = number_text(float(cell) / size, digits) if digits else four_digits(float(cell) / size)
    return "0" if text == "-0" else re.sub("^-", "−", text)


def four_digits(value: float) -> str:
    """Write a number with four significant digits, a small one without an exponent; return for example "0.01235",
    "12,346", "–" for NaN."""
    if 1e-7 < abs(value) < 1e-4:
        return f"{value:.{3 - math.floor(math.log10(abs(value)))}f}"
    return "–" if math.isnan(value) else f"{value:,.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"


@dataclass(frozen=True)
class Verbatim:
    """A text whose white space counts, such as a file."""

    title: str  # its name
    text: str
    on: tuple[Medium, ...] = ("page", "recording")  # the media that show it


@dataclass(frozen=True)
class Points:
    """A list."""

    texts: Sequence[str]  # its entries; one may begin with a verdict and a colon
    on: tuple[Medium, ...] = EVERYWHERE  # the media that show it


@dataclass(frozen=True)
class Picture:
    """A drawing that is no chart, such as a block diagram."""

    draw: Callable[[], str]  # returns an SVG element; it is called by the media that show it
    on: tuple[Medium, ...] = ("page",)  # the media that show it


@dataclass(frozen=True)
class Interactive:
    """Numbers from which a page answers the reader's questions, by a script of `recording.interactive`."""

    key: str  # name of the script
    data: Callable[[], tuple[Mapping[str, Any], Sequence[Array]]]  # called by the media that show it
    on: tuple[Medium, ...] = ("page",)  # the media that show it


@dataclass(frozen=True)
class Beside:
    """Exhibits side by side where there is room."""

    items: Sequence[Item]  # what stands beside each other, from the left
    on: tuple[Medium, ...] = EVERYWHERE  # the media that show it


@dataclass(frozen=True)
class Section:
    """Exhibits under a heading."""

    title: str  # the heading; "" for none
    items: Sequence[Item]  # what it contains, in this order
    verdict: Verdict = ""  # written after the heading
    # whether a page folds it under its heading, and shows it "open" or "closed" at first
    fold: Literal["", "open", "closed"] = ""
    on: tuple[Medium, ...] = EVERYWHERE  # the media that show it


def definitions(texts: Mapping[str, str], on: tuple[Medium, ...]) -> Section:
    """Return the section that says what each number means, by its name."""
    return Section("Definitions", [Table((Column("", words=True), Column("definition", words=True)),
                                         list(texts.items()))], on=on)  # fmt: skip


Item = Sentence | Table | Verbatim | Points | Picture | Interactive | Charts | Cloud | Beside | Section


@dataclass(frozen=True)
class Exhibits:
    """All that a result has to show."""

    title: str  # of the page
    items: Sequence[Item]  # what it contains, in this order
    plain: str = ""  # the title on the console; that of the page if empty
    heading: str = ""  # above the page; the title if empty
    name: str = ""  # of the recording, for which the viewer keeps a layout
    kind: str = ""  # of the recording, which chooses its views
    root: str = ""  # entity above all charts of the recording
    # first and last instant of the recording, s; charts over the time since the start begin at the first
    span: tuple[float, float] = (0.0, 0.0)
    figure: str = ""  # key of the charts that `plot()` draws
    labels: dict[str, str] = field(default_factory=dict)  # further words for the recording's views
    pictures: tuple[str, ...] = ()  # keys of groups of charts that the recording shows as pictures, too

    def charts(self) -> Iterator[Charts]:
        """Yield all charts, also those of inner sections."""
        return charts_in(self.items)

    def chosen(self, key: str) -> Charts:
        """Return the charts with a key."""
        return next(charts for charts in self.charts() if charts.key == key)


def charts_in(items: Iterable[Item]) -> Iterator[Charts]:
    """Yield all charts, also those of inner sections."""
    for item in items:
        if isinstance(item, Charts):
            yield item
        elif isinstance(item, Section | Beside):
            yield from charts_in(item.items)
