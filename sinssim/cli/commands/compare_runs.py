"""`sinssim compare-runs`: overlays the errors of finished runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json, OutFolder, Quiet
from sinssim.cli.terminal import console, print_json


def command(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run directories.")],
    solution: Annotated[
        str | None,
        typer.Option(
            "--solution",
            metavar="NAME",
            help="Solution that all runs have: an algorithm, aided, backward or smoothed.",
            show_default="of each run the aided one, or else the first algorithm",
        ),
    ] = None,
    out: OutFolder = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing comparison.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Compare finished runs: tables of their errors, errors on common axes, and the keys that differ.

    The runs may be of different scenarios; their errors are compared at the same times. Writes report.html and
    comparison.json to runs/compare-A-B.

    Examples:

        sinssim compare-runs runs/first_flight runs/tactical
        sinssim compare-runs runs/gnss runs/gnss_baro --solution aided -o runs/with_and_without_baro
    """
    from sinssim.experiments.run.run_comparison import compare_runs, write_comparison

    compared = compare_runs(runs, solution)
    target = out or Path("runs") / ("compare-" + "-".join(run.name for run in compared.runs.values()))[:120]

    contents, place = write_comparison(compared, target, overwrite=overwrite)
    if as_json:
        print_json(contents)
    elif not quiet:
        from sinssim.experiments.run.run_comparison import comparison_exhibits
        from sinssim.recording.console import show

        show(comparison_exhibits(compared), console(least_width=110))
        print(f"Report: {place / 'report.html'}    (in any browser)")
