"""`sinssim compare`: runs a study and writes its report."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json, OutFolder, Quiet
from sinssim.cli.terminal import console, notes_of, one_bar, print_json, program_name


# Long: every option is a parameter, and the docstring is the help.
def command(
    study: Annotated[
        str,
        typer.Argument(
            metavar="STUDY",
            help="A study's TOML file, or a name from `sinssim list studies`.",
            show_default=False,
        ),
    ],
    out: OutFolder = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Replace a value of the study; may be given several times. Parts and motions are counted from 1: "
            '`--set parts.1.rates_hz="[50.0, 100.0]"`.',
            show_default=False,
        ),
    ] = None,
    limit_minutes: Annotated[
        float, typer.Option("--limit-minutes", min=0.0, help="Refuse a study that would take longer than this.")
    ] = 30.0,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing study; your own files stay.")
    ] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Compare algorithms, rates, frames and sensors on identical samples, and recommend engines.

    Writes a directory with the report (report.html, self-contained), all results (results.json, results.parquet), a
    recording for the view *comparison* (recording.rrd), and the study with all its defaults (study.toml). Ctrl-C leaves
    a report of the navigations finished until then.

    Examples:

        sinssim compare coning
        sinssim compare my_study.toml -o runs/mine --set seed=3
    """
    from sinssim.studies.load import load_study

    plan = load_study(study, settings or ())
    directory = out or Path("runs") / plan.name
    from sinssim.studies.compare import compare

    def say(text: str) -> None:
        if not quiet:
            print(text, file=sys.stderr)

    try:
        with one_bar(show=not quiet) as progress:
            comparison = compare(
                plan, directory, overwrite=overwrite, limit_minutes=limit_minutes, progress=progress, say=say
            )
    except KeyboardInterrupt as interrupt:
        if not notes_of(interrupt):
            interrupt.add_note("No navigation had finished.")
        raise
    if as_json:
        from sinssim.recording.store.study import results

        print_json(results(comparison))
    elif not quiet:
        from sinssim.recording.tables.study import show

        show(comparison, console())
        print(f"Report: {directory / 'report.html'}    (in any browser)")
        print(f"View:   {program_name()} view {directory}    (--web: in a browser)")
