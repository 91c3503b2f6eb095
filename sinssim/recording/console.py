"""Exhibits on the console."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from rich.console import Console

from sinssim.exhibits import Beside, Exhibits, Item, Points, Section, Sentence, Table

if TYPE_CHECKING:
    from rich import table as rich_table


_LONG = 64
"""Characters from which the words of a cell may be broken into lines."""


def show(exhibits: Exhibits, console: Console) -> None:
    """Print the tables and sentences of a result."""
    if exhibits.plain:
        console.print(f"{exhibits.plain}\n", markup=False)
    show_items(exhibits.items, console)


def show_items(items: Iterable[Item], console: Console, title: str = "") -> None:
    """Print tables and sentences."""
    for item in items:
        match item:
            case Sentence() if "console" in item.on:
                console.print(_bare(item.text), markup=False)
            case Table() if "console" in item.on:
                _print(_fitting(item, console.width), item.title or title, console)
            case Points() if "console" in item.on:
                for text in item.texts:
                    console.print(f"- {_bare(text)}", markup=False)
            case Beside() if "console" in item.on:
                show_items(item.items, console, title)
            case Section() if "console" in item.on:
                if item.verdict:
                    console.print()
                show_items(item.items, console, item.title)
            case _:
                pass


def _print(table: Table, title: str, console: Console) -> None:
    """Print a table on a console that is widened for it: no digit is cut off."""
    from rich.measure import Measurement

    drawn, before = table_of(table), console.width
    if title:
        console.print(title, markup=False)
    console.width = max(before, Measurement.get(console, console.options.update(width=1000), drawn).minimum)
    console.print(drawn)
    console.width = before
    if table.note:
        console.print(f"{table.note}\n", markup=False)


def _fitting(table: Table, width: int) -> Table:
    """Return a table with as many of its rising columns as fit, the first and the last among them."""
    columns, heads, rows = table.shown("console")
    widths = [max(map(len, (head, *(row[k] for row in rows)))) + 2 for k, (head, _) in enumerate(heads)]
    numbers = [k for k, column in enumerate(columns) if not column.words]
    if not table.rising or not numbers:
        return table
    words = sum(widths[k] for k in range(len(columns)) if k not in numbers)
    count = max(2, (width - 2 - words) // max(widths[k] for k in numbers))
    if len(numbers) <= count:
        return table
    left = {id(columns[numbers[round(i * (len(numbers) - 1) / (count - 1))]]) for i in range(count)}
    return replace(table, columns=tuple(
        column if column.words or id(column) in left else replace(column, on=()) for column in table.columns
    ))  # fmt: skip


def _bare(text: str) -> str:
    return text.replace("**", "").replace("`", "")


def table_of(table: Table) -> rich_table.Table:
    """Return a table in the style of all tables on the console."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    columns, heads, rows = table.shown("console")
    group, grouped = "", any(column.group for column in columns)
    drawn = RichTable(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for place, (column, (head, unit)) in enumerate(zip(columns, heads, strict=True)):
        lines = [*filter(None, (*re.sub(r" (<=?|≤) ", r"\n\1 ", head).split("\n"), unit))]
        if grouped:
            lines = ["" if column.group == group else column.group, ", ".join(filter(None, (head, unit)))]
        group = column.group
        head_width, widest = (
            max(map(len, lines), default=0),
            max((len(line) for row in rows for line in row[place].split("\n")), default=0),
        )
        # words of a cell are broken into lines if they are long; a head that is longer than its numbers, too
        whole = widest < _LONG if column.words else head_width <= widest
        word = max((len(word) for line in lines for word in line.split()), default=0)
        least = max(head_width if whole else word, widest) if whole or not column.words else None
        side: Literal["left", "right"] = "left" if column.words else "right"
        drawn.add_column(Text("\n".join(lines)), justify=side, no_wrap=whole, min_width=least)
    for row in rows:
        drawn.add_row(*(Text(_bare(cell)) for cell in row))
    return drawn
