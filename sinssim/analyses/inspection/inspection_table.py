"""The findings of an inspection on the console: by subject, doubts and errors marked."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.analyses.inspection.stream_inspection import Inspection

_MARKS = {"fact": ("", ""), "doubt": ("doubt", "yellow"), "wrong": ("WRONG", "bold red")}


def show(inspection: Inspection, console: Console) -> None:
    """Print the findings."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column("subject", no_wrap=True, max_width=28)
    table.add_column("mark", no_wrap=True)
    table.add_column("finding", overflow="fold")
    before = ""
    for finding in inspection.findings:
        mark, style = _MARKS[finding.grade]
        text = Text(finding.text)
        if finding.fix:
            text.append(f" {finding.fix}", style="bold")
        subject = finding.subject.rsplit("/", 1)[-1]
        table.add_row(Text(subject if subject != before else ""), Text(mark, style=style), text)
        before = subject
    console.print(table)
    doubts = sum(f.grade == "doubt" for f in inspection.findings)
    errors = sum(f.grade == "wrong" for f in inspection.findings)
    console.print(
        f"\n{errors} error{'s' * (errors != 1)}, {doubts} doubt{'s' * (doubts != 1)}."
        + (" Results from data with errors are worthless." if errors else ""),
        markup=False,
    )
