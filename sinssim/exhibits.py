"""What a result has to show: sentences, tables and charts in sections, which every medium renders.

A text may have parts in `**bold**`, and commands between backticks. Numbers are in SI; the medium takes
the unit that suits them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from sinssim.charts import Charts, Cloud, Color
from sinssim.formatting import number_text
from sinssim.units import Scale, suiting

Medium = Literal["console", "page", "recording"]
EVERYWHERE: tuple[Medium, ...] = ("console", "page", "recording")
Verdict = Literal["", "met", "not met", "undecided", "confirmed", "partly", "refuted"]


@dataclass(frozen=True)
class Sentence:
    """A paragraph.

    Attributes:
        text: whole sentences.
        kind: "lead" below a title, "note" for a remark, "strong" for what must not be overlooked, "warning" for what
            is wrong.
        on: the media that show it.
    """

    text: str
    kind: Literal["", "lead", "note", "strong", "warning"] = ""
    on: tuple[Medium, ...] = EVERYWHERE


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        head: what it holds, without the unit.
        units: units of its numbers; None for texts, and for numbers that are shown as they are.
        words: whether it holds words, which begin at the left.
        digits: significant digits of its numbers; 0 for `four_digits`.
        on: the media that show it.
    """

    head: str
    units: Scale | None = None
    words: bool = False
    digits: int = 0
    on: tuple[Medium, ...] = EVERYWHERE


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        columns: its columns.
        rows: a text, or a number in SI in a column with units, for each column.
        title: above it; the console takes that of the section if it is empty.
        note: below it.
        colors: of the rows, shown by a square before each; empty for none.
        shaded: whether the numbers are shaded by their logarithm, the least most.
        rising: whether its columns of numbers belong to rising values, of which a narrow console leaves some out.
        on: the media that show it.
    """

    columns: tuple[Column, ...]
    rows: Sequence[Sequence[str | float]]
    title: str = ""
    note: str = ""
    colors: Sequence[Color] = ()
    shaded: bool = False
    rising: bool = False
    on: tuple[Medium, ...] = EVERYWHERE

    def shown(self, medium: Medium) -> tuple[list[Column], list[tuple[str, str]], list[list[str]]]:
        """Return what a medium shows.

        Returns:
            The columns, their heads and units, and the texts of the rows. Columns of one quantity have one unit.
        """
        places = [k for k, column in enumerate(self.columns) if medium in column.on]
        found: dict[int, list[float]] = {}
        for k in places:
            values = [row[k] for row in self.rows if not isinstance(row[k], str)]
            found.setdefault(id(self.columns[k].units), []).extend(v for v in values if math.isfinite(v))  # type: ignore[misc,arg-type]
        chosen = {
            k: ("", 1.0) if (units := self.columns[k].units) is None else suiting(units, np.array(found[id(units)]))
            for k in places
        }
        texts = [[_text(row[k], chosen[k][1], self.columns[k].digits) for k in places] for row in self.rows]
        columns = [self.columns[k] for k in places]
        return columns, [(self.columns[k].head, chosen[k][0]) for k in places], texts


def _text(cell: str | float, size: float, digits: int) -> str:
    if isinstance(cell, str):
        return cell
    return number_text(float(cell) / size, digits) if digits else four_digits(float(cell) / size)


def four_digits(value: float) -> str:
    """Write a number with four significant digits, a small one without an exponent.

    Returns:
        For example "0.01235", "12,346", "–" for NaN.
    """
    if 1e-7 < abs(value) < 1e-4:
        return f"{value:.{3 - math.floor(math.log10(abs(value)))}f}"
    return "–" if math.isnan(value) else f"{value:,.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"


@dataclass(frozen=True)
class Verbatim:
    """A text whose white space counts, such as a file.

    Attributes:
        title: its name.
        text: the text.
        on: the media that show it.
    """

    title: str
    text: str
    on: tuple[Medium, ...] = ("page", "recording")


@dataclass(frozen=True)
class Points:
    """A list.

    Attributes:
        texts: its entries; one may begin with a verdict and a colon.
        on: the media that show it.
    """

    texts: Sequence[str]
    on: tuple[Medium, ...] = EVERYWHERE


@dataclass(frozen=True)
class Diagram:
    """A drawing of `recording.diagrams`, on pages.

    Attributes:
        name: of the function that draws it.
        key: a name that is unique on the page.
    """

    name: str
    key: str
    on: tuple[Medium, ...] = ("page",)


@dataclass(frozen=True)
class Beside:
    """Exhibits side by side where there is room.

    Attributes:
        items: what stands beside each other, from the left.
        on: the media that show it.
    """

    items: Sequence[Item]
    on: tuple[Medium, ...] = EVERYWHERE


@dataclass(frozen=True)
class Section:
    """Exhibits under a heading.

    Attributes:
        title: the heading; "" for none.
        items: what it contains, in this order.
        verdict: written after the heading.
        fold: whether a page folds it under its heading, and shows it "open" or "closed" at first.
        on: the media that show it.
    """

    title: str
    items: Sequence[Item]
    verdict: Verdict = ""
    fold: Literal["", "open", "closed"] = ""
    on: tuple[Medium, ...] = EVERYWHERE


Item = Sentence | Table | Verbatim | Points | Diagram | Charts | Cloud | Beside | Section


@dataclass(frozen=True)
class Exhibits:
    """All that a result has to show.

    Attributes:
        title: of the page.
        items: what it contains, in this order.
        plain: the title on the console; that of the page if empty.
        name: of the recording, for which the viewer keeps a layout.
        kind: of the recording, which chooses its views.
        root: entity above all charts of the recording.
        span: first and last instant of the recording, s; charts over the time since the start begin at the first.
        figure: key of the charts that `plot()` draws.
        labels: further words for the recording's views.
        pictures: keys of groups of charts that the recording shows as pictures, too.
    """

    title: str
    items: Sequence[Item]
    plain: str = ""
    name: str = ""
    kind: str = ""
    root: str = ""
    span: tuple[float, float] = (0.0, 0.0)
    figure: str = ""
    labels: dict[str, str] = field(default_factory=dict)
    pictures: tuple[str, ...] = ()

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
