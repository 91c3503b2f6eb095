"""The section of a run's report about the phases of a mission: what each of them added to the errors."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from sinssim.experiments.run.store.summaries.phase_summary import (
    HEADS,
    NOTE,
    SOURCE_HEADS,
    SOURCE_NOTE,
    phase_tables,
    source_tables,
)
from sinssim.recording.report.page import table, words

_TEXT = 'style="text-align: left; white-space: normal"'
"""Of cells with the names of sources, which may take two lines."""
_COMMAND = re.compile("`([^`]*)`")


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
    said = False
    for name, found in source_tables(summary):
        if isinstance(found, str):
            unknown = f"{name}: the sources of the phases’ errors are unknown (no budget). {found}"
            yield f'<p class="note">{words(unknown)}</p>'
            continue
        lines = [
            (f'<td class="name">{words(phase)}</td>', *(f"<td {_TEXT}>{_together(cell)}</td>" for cell in cells))
            for phase, *cells in found
        ]
        yield f"<h3>{words(name)}: sources</h3>" + table(("phase", *SOURCE_HEADS), lines, 1 + len(SOURCE_HEADS))
        said = True
    if said:
        note = _COMMAND.sub(r"<code>\1</code>", words(SOURCE_NOTE))
        yield f'<p class="note">{note}</p>'


def _together(cell: str) -> str:
    """Return a cell as HTML whose per cent signs stay in the line of their numbers."""
    return words(cell).replace(" %", "&nbsp;%")
