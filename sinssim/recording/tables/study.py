"""The tables of a study, and its verdicts in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from sinssim.formatting import capital, number_text
from sinssim.studies.naming import Label, labeller, one_draw, over_rates, sensors_of
from sinssim.studies.results import Row, StudyResult

if TYPE_CHECKING:
    from rich.console import Console


_CELL = 10
"""Width of a number in a console table, including padding."""


def show(comparison: StudyResult, console: Console) -> None:
    """Print a table for each motion of each part, and the verdicts.

    Args:
        comparison: results of the study.
        console: the console to print on.
    """
    for part in comparison.study.parts:
        rows = comparison.of_part(part.title)
        for motion in dict.fromkeys(row.motion for row in rows):
            here = [row for row in rows if row.motion == motion]
            if over_rates(part):
                _show_rates(f"{part.title}: {motion}, largest attitude error in arcsec", here, labeller(rows), console)
            else:
                _show_cases(f"{part.title}: {motion}, largest errors", here, labeller(rows, pace=True), console)
    failed = sum(row.status == "failed" for row in comparison.rows)
    if failed:
        console.print(
            f"{failed} of {len(comparison.rows)} navigations failed; the report gives the reasons.", markup=False
        )
    for pick in comparison.picks:
        console.print(f"RECOMMENDED, {pick.part}, sensors {sensors_of(pick)}: {pick.reason}", markup=False)
    for part in comparison.study.parts:
        if said := one_draw(part, comparison.study):
            console.print(f"{part.title}: {said}", markup=False)
    for verdict in comparison.verdicts:
        console.print(f"{verdict.verdict.upper()}: {capital(verdict.sentence)}. {verdict.reason}", markup=False)
        for point, judged in verdict.lines:
            console.print(f"  - {judged + ': ' if judged else ''}{point}", markup=False)


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
