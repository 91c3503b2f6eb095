"""Exhibits on the console."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Literal

from sinssim.exhibits import Beside, Exhibits, Item, Section, Sentence, Table

if TYPE_CHECKING:
    from rich import table as rich_table
    from rich.console import Console


def show(exhibits: Exhibits, console: Console) -> None:
    """Print the tables and sentences of a result.

    Args:
        exhibits: what it has to show.
        console: the console to print on.
    """
    if exhibits.plain:
        console.print(f"{exhibits.plain}\n", markup=False)
    show_items(exhibits.items, console)


def show_items(items: Iterable[Item], console: Console, title: str = "") -> None:
    """Print tables and sentences.

    Args:
        items: exhibits.
        console: the console to print on.
        title: of the tables that have no own.
    """
    for item in items:
        match item:
            case Sentence() if "console" in item.on:
                console.print(_bare(item.text), markup=False)
            case Table() if "console" in item.on:
                console.print(table_of(item, title))
            case Beside() if "console" in item.on:
                show_items(item.items, console, title)
            case Section() if "console" in item.on:
                if item.verdict:
                    console.print()
                show_items(item.items, console, item.title)
            case _:
                pass


def _bare(text: str) -> str:
    return text.replace("**", "").replace("`", "")


def table_of(table: Table, title: str = "") -> rich_table.Table:
    """Return a table in the style of all tables on the console.

    Args:
        table: the table.
        title: its title if it has no own.
    """
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    columns, heads, rows = table.shown("console")
    drawn = RichTable(
        title=table.title or title or None, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    stacked = any(unit for _, unit in heads)
    for place, (column, (head, unit)) in enumerate(zip(columns, heads, strict=True)):
        words = "\n".join(filter(None, (head, unit))) if stacked else head
        widest = max((len(row[place]) for row in rows), default=0)
        whole = not column.words and len(head) <= widest  # a longer head is broken where the console is narrow
        side: Literal["left", "right"] = "left" if column.words else "right"
        drawn.add_column(Text(words), justify=side, no_wrap=whole, min_width=None if column.words else widest)
    for row in rows:
        drawn.add_row(*(Text(_bare(cell)) for cell in row))
    if table.note:
        drawn.caption, drawn.caption_justify = table.note, "left"
    return drawn
