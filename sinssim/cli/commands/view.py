"""`sinssim view`: shows a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug


def command(
    run_or_recording: Annotated[Path, typer.Argument(metavar="DIR_OR_RRD", help="A run directory or a recording.")],
    name: Annotated[
        str | None,
        typer.Option("--view", metavar="NAME", help="View to show first: a name from `sinssim list views`, or a file."),
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Show it in a browser, served to this machine only.")] = False,
    screenshot: Annotated[
        Path | None,
        typer.Option("--screenshot", metavar="FILE", help="Write a picture (PNG) instead of opening a window."),
    ] = None,
    debug: Debug = False,
) -> None:
    """Show a run in the Rerun viewer or in a browser, or write a picture.

    The viewer opens in a window unless --web or --screenshot is given.

    Examples:

        sinssim view runs/first_flight --view navigation
        sinssim view runs/first_flight --web
        sinssim view runs/first_flight --view sensors --screenshot sensors.png
    """
    if web and screenshot is not None:
        raise typer.BadParameter("--web and --screenshot exclude each other; give one of them")
    from sinssim.recording.rerun import viewer

    if screenshot is not None:
        viewer.screenshot(run_or_recording, screenshot, view=name)
    elif web:
        viewer.serve(run_or_recording, view=name)
    else:
        viewer.open_viewer(run_or_recording, view=name)
