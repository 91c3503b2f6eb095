"""The tables of a trade study on the console."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

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
from sinssim.statistics.requirements.quantity import Quantity

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

_MOST_ROWS = 40
"""Cells in the table on the console; more are in the files."""
_MOST_ACROSS = 10
_MOST_GRIDS = 4


def show(result: TradeResult, console: Console) -> None:
    """Print a trade study: grids of the drawn quantities, a row for each cell, and what is met.

    Args:
        result: the study.
        console: the console to print on.
    """
    study = result.study
    console.print(f"{study.name}: {headline(result)}\n", markup=False)
    if len(study.axes) > 1 and len(study.axes[-1].values) <= _MOST_ACROSS:
        shown = [grid for quantity in study.drawn for grid in grids(result, quantity)]
        for grid in shown[:_MOST_GRIDS]:
            _print(grid.title, _table([grid.corner, *grid.across], grid.rows, 1), console)
    for when in (None, *instants(result)):
        _show_cells(result, when, console)
    for line in (*requirement_lines(result), *failure_lines(result)):
        console.print(line, markup=False)
    for name, text in definitions(result).items():
        console.print(f"{name}: {text}.", markup=False)


def _show_cells(result: TradeResult, when: Quantity | None, console: Console) -> None:
    """Print a row for each cell at an instant; verdicts in a table of their own if there is no room beside."""
    heads, rows, words = cell_table(result, when)
    judged = len(result.study.requirements) if when is None else 0
    title = "At the end:" if when is None else f"At {when.time:g} s:"

    def part(columns: Sequence[int]) -> Table:
        broken = [_broken(heads[k]) for k in columns]
        return _table(broken, [[row[k] for k in columns] for row in rows[:_MOST_ROWS]], words)

    whole = part(range(len(heads)))
    if judged and _width(whole, console) > console.width:
        _print(title, part(range(len(heads) - judged)), console)
        title, whole = "Requirements:", part([*range(words), *range(len(heads) - judged, len(heads))])
    _print(title, whole, console)
    if len(rows) > _MOST_ROWS:
        console.print(f"… and {len(rows) - _MOST_ROWS} more cells, in summary.md and report.html.\n", markup=False)


def _print(title: str, table: Table, console: Console) -> None:
    """Print a table on a console that is widened for it: no digit is cut off."""
    console.print(title, markup=False)
    before = console.width
    console.width = max(before, _width(table, console))
    console.print(table)
    console.width = before


def _width(table: Table, console: Console) -> int:
    """Return the width that a table needs, characters."""
    from rich.measure import Measurement

    return Measurement.get(console, console.options.update(width=1000), table).maximum


def _broken(head: str) -> str:
    """Return a head in two lines: its name, and its unit or the limit of a requirement."""
    for mark in (", ", " <= ", " < ", " ≤ "):
        name, found, rest = head.partition(mark)
        if found:
            return f"{name}\n{found.strip(' ,')} {rest}".replace("\n ", "\n")
    return head


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]], words: int) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for number, head in enumerate(heads):
        table.add_column(head, justify="left" if number < words else "right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    return table
