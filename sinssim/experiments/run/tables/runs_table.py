"""The tables of finished runs: a list of them, and some beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from sinssim.experiments.run.finished.compared_runs import ComparedRuns
from sinssim.experiments.run.finished.run_list import Entry
from sinssim.experiments.run.tables.run_table import error_text
from sinssim.formatting import size_text
from sinssim.logs.stored.made_by import is_of_another

if TYPE_CHECKING:
    from rich.console import Console

_ERRORS = (
    ("horizontal\nfinal, m", "final_horizontal_error_m", 1.0),
    ("\nrms, m", "rms_horizontal_error_m", 1.0),
    ("\nmax, m", "max_horizontal_error_m", 1.0),
    ("height\nmax, m", "max_height_error_m", 1.0),
    ("velocity\nmax, m/s", "max_velocity_error_mps", 1.0),
    ("attitude\nmax, arcmin", "max_attitude_error_arcsec", 60.0),
)


def show_list(entries: Sequence[Entry], folder: Path, console: Console) -> None:
    """Print the runs in a folder."""
    if not entries:
        console.print(
            f"No runs in {folder}. `sinssim run SCENARIO` writes one to runs/SCENARIO, or to the folder given with -o; "
            "`sinssim runs DIR` lists those in another folder.",
            markup=False,
            highlight=False,
        )
        return
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading, side in (
        ("directory", "left"), ("kind", "left"), ("scenario", "left"), ("horizontal\nrms, m", "right"),
        ("\nof", "left"), ("\nsize", "right"), ("\ndate", "left"),
    ):  # fmt: skip
        table.add_column(heading, justify=side, no_wrap=heading != "directory", overflow="fold")  # type: ignore[arg-type]
    for entry in entries:
        kind = entry.kind if entry.status in ("", "finished") else f"{entry.kind}, {entry.status}"
        value = "" if entry.rms_horizontal_error_m is None else error_text(entry.rms_horizontal_error_m)
        table.add_row(
            str(entry.path), kind, entry.scenario, value, entry.solution, size_text(entry.size_bytes),
            f"{entry.date:%Y-%m-%d %H:%M}",
        )  # fmt: skip
    console.print(table)
    total = sum(entry.size_bytes for entry in entries)
    console.print(f"{len(entries)} in {folder}, {size_text(total)}.", markup=False, highlight=False)
    for entry in entries:
        if is_of_another(entry.path):
            console.print(f"{entry.path} was written by sinssim {entry.sinssim}.", markup=False, highlight=False)
        if entry.problem:
            console.print(f"Not read: {entry.problem}", markup=False, highlight=False)


def show_comparison(compared: ComparedRuns, console: Console) -> None:
    """Print the errors of finished runs beside each other."""
    start, end = compared.span
    table = Table(
        title=f"errors from {start:g} s to {end:g} s, which all runs have",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for heading in ("run", "solution"):
        table.add_column(heading, no_wrap=True)
    for heading, _, _ in _ERRORS:
        table.add_column(heading, justify="right", no_wrap=True)
    for label, numbers in compared.numbers.items():
        cells = [error_text(None if (v := numbers[key]) is None else v / size) for _, key, size in _ERRORS]
        table.add_row(label, compared.solutions[label], *cells)
    console.print(table)
    for label, run in compared.runs.items():
        if run.status != "finished":
            console.print(f"{label} {run.status}: {run.summary.get('message', '')}", markup=False)
