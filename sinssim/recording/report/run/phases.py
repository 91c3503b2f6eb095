"""The section of a run's report about the phases of a mission: what each of them added to the errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.recording.report.page import table, words
from sinssim.recording.store.summaries.phase_summary import HEADS, NOTE, phase_tables


def phase_section(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield a table for each solution.

    Args:
        summary: contents of `summary.json`.

    Yields:
        HTML; nothing for a motion without phases.
    """
    heads = ("phase", "from … to [s]", *(f"{name} [{unit}]" for name, unit in HEADS.values()))
    for name, rows in phase_tables(summary):
        lines = [
            (f'<td class="name">{words(phase)}</td>', *(f"<td>{words(cell)}</td>" for cell in cells))
            for phase, *cells in rows
        ]
        yield f"<h3>{words(name)}</h3>" + table(heads, lines)
    if summary.get("phases"):
        yield f'<p class="note">{words(NOTE)}</p>'
