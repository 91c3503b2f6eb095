"""`sinssim workbench`: a page that edits scenarios, starts commands and shows their results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, command


@command
def workbench(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="A folder with scenarios; results go to its runs.")
    ] = Path("."),
    port: Annotated[
        int | None, typer.Option("--port", metavar="N", min=1, max=65535, help="Port.", show_default="a free one")
    ] = None,
    debug: Debug = False,
) -> None:
    """Work on the scenarios of a folder in a browser, on a page that is served to this machine only.

    The page lists the scenarios of the folder and the shipped ones, checks a text while it is written, completes its
    keys, draws the plan, starts runs, ensembles and budgets, and lists what has finished with reports and views.
    Everything that it makes is a file that the other commands make, too: runs are in FOLDER/runs. Ctrl-C ends the page
    and the commands that it has started. Needs the extra `workbench`.

    Example:

        sinssim workbench my_project
    """
    import os

    from sinssim.cli.workbench.workbench_server import serve
    from sinssim.errors import InputError

    try:
        os.chdir(folder)  # names and paths are then those of the commands that it starts there
    except OSError as error:
        raise InputError(f"{folder} is no folder that can be opened: {error.strerror}.") from error
    serve(Path.cwd(), port or 0, ready=lambda address: print(f"Open {address}\nStop with Ctrl-C.", flush=True))
