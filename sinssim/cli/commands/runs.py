"""`sinssim runs`: lists the runs in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json
from sinssim.cli.terminal import console, print_json


def command(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder with runs.")] = Path("runs"),
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List the runs, ensembles, studies and budgets in a folder, the newest first.

    The list shows the scenario, the size and the date. For a run it also shows the rms horizontal error of the aided
    solution, or else of the first algorithm.

    Examples:

        sinssim runs
        sinssim runs results/2026 --json
    """
    from sinssim.experiments.run.finished_runs import runs_in

    entries = runs_in(folder)
    if as_json:
        print_json(
            [
                {**vars(entry), "path": str(entry.path), "date": entry.date.isoformat(timespec="seconds")}
                for entry in entries
            ]
        )
        return
    from sinssim.experiments.run.run_comparison import list_exhibits
    from sinssim.recording.console import show_items

    show_items(list_exhibits(entries, folder), console(least_width=110))
