"""The tables of a study: verdicts, recommended engines, errors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from sinssim.experiments.studies.naming import Label, labeller, one_draw, over_rates, sensors_of
from sinssim.experiments.studies.results import Pick, Row, StudyResult, Verdict
from sinssim.formatting import number_text

if TYPE_CHECKING:
    from rich.console import Console


_CELL = 10
"""Width of a number in a console table, including padding."""


def show(comparison: StudyResult, console: Console) -> None:
    """Print the verdicts, the recommended engines, and a table for each motion of the parts that decide no claim."""
    if comparison.verdicts:
        _show_verdicts(comparison.verdicts, console)
    if comparison.picks:
        _show_picks(comparison.picks, console)
    for part in comparison.study.parts:
        rows = comparison.of_part(part.title)
        for motion in dict.fromkeys(row.motion for row in rows if not part.decides):
            here = [row for row in rows if row.motion == motion]
            if over_rates(part):
                _show_rates(f"{part.title}: {motion}, largest attitude error in arcsec", here, labeller(rows), console)
            else:
                _show_cases(f"{part.title}: {motion}, largest errors", here, labeller(rows, pace=True), console)
        if said := one_draw(part, comparison.study):
            console.print(f"{part.title}: {said}", markup=False)
    failed = sum(row.status == "failed" for row in comparison.rows)
    if failed:
        console.print(
            f"{failed} of {len(comparison.rows)} navigations failed; the report gives the reasons.", markup=False
        )


def _show_verdicts(verdicts: list[Verdict], console: Console) -> None:
    """Print a line for each claim: in words, verdict, the measured figure, and the figure if it held."""
    table = _console_table()
    table.add_column("claim", no_wrap=True)
    for heading in ("verdict", "measured", "expected"):
        table.add_column(heading, overflow="fold")
    for verdict in verdicts:
        table.add_row(verdict.title, verdict.verdict, verdict.measured or "–", verdict.expected or "–")
    console.print(table, markup=False)


def _show_picks(picks: list[Pick], console: Console) -> None:
    """Print a line for each recommended engine."""
    table = _console_table()
    for heading in ("part", "sensors", "recommended engine"):
        table.add_column(heading, overflow="fold")
    for heading in ("horizontal\nm", "attitude\narcsec/h", "µs per s\nof motion"):
        table.add_column(heading, justify="right", no_wrap=True)
    for pick in picks:
        keys = ("max_horizontal_error_m", "attitude_drift_arcsec_h", "us_per_second")
        errors = (number_text(pick.numbers.get(key, math.nan)) for key in keys)
        table.add_row(pick.part, sensors_of(pick), pick.choice or pick.reason, *errors)
    console.print(table, markup=False)


def _show_rates(title: str, rows: list[Row], label: Label, console: Console) -> None:
    names = list(dict.fromkeys(label(row) for row in rows))
    rates = sorted({row.rate_hz for row in rows})
    # As many rates as fit, the lowest and the highest among them; no number is truncated.
    room = max(2, (console.width - max(map(len, names)) - 2) // _CELL)
    if len(rates) > room:
        rates = [rates[round(i * (len(rates) - 1) / (room - 1))] for i in range(room)]
    console.print(title, markup=False)
    console_table = _console_table()
    console_table.add_column("", no_wrap=True)
    for rate in rates:
        console_table.add_column(f"{rate:g} Hz", justify="right", no_wrap=True)
    values = {(label(row), row.rate_hz): row.max_attitude_error_arcsec for row in rows}
    for name in names:
        console_table.add_row(name, *(number_text(values.get((name, rate), math.nan), 2) for rate in rates))
    console.print(console_table)


def _show_cases(title: str, rows: list[Row], label: Label, console: Console) -> None:
    console.print(title, markup=False)
    console_table = _console_table()
    console_table.add_column("", overflow="fold")
    for heading in ("horizontal\nm", "velocity\nm/s", "attitude\narcsec"):
        console_table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        errors = (row.max_horizontal_error_m, row.max_velocity_error_mps, row.max_attitude_error_arcsec)
        console_table.add_row(label(row), *(map(number_text, errors) if row.status == "done" else ("failed", "", "")))
    console.print(console_table)


def _console_table() -> Table:
    return Table(box=box.SIMPLE_HEAD, pad_edge=False)
