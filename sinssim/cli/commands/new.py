"""`sinssim new`: lays out a project folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug


def command(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="The folder to create; it must not exist, or must be empty.")
    ],
    debug: Debug = False,
) -> None:
    """Create a project folder: a scenario with your own sensors, algorithm and view, ready to run.

    The README.md of the folder describes each file and the commands. No existing file is changed.

    Example:

        sinssim new my_project
    """
    from sinssim.content import new_project

    files = new_project(folder)
    width = max(len(file) for file, _ in files)
    print(f"{folder} is ready:")
    for file, sentence in files:
        print(f"  {file:<{width}}  {sentence}")
    print(f"Next: cd {folder}, then sinssim run scenario.toml")
