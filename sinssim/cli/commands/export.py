"""`sinssim export`: writes a run in a format of another program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json, Quiet, RunFolder, start_option
from sinssim.cli.terminal import print_json
from sinssim.logs.formats.registry import WRITERS

To = Annotated[str, typer.Option("--to", metavar="FORMAT", help=f"{', '.join(WRITERS)}; see `sinssim list exports`.")]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        "-o",
        metavar="FILE",
        help="The file, or the folder if the format has several files.",
        show_default="next to the run",
    ),
]
Solutions = Annotated[
    list[str] | None,
    typer.Option(
        "--solution",
        metavar="NAME",
        help="Exported solution: truth, an algorithm, aided, backward, smoothed, or a GNSS receiver such as gnss; "
        "and measured, ideal or compensated for the inertial data. May be given twice.",
        show_default="truth, measured",
    ),
]
Rate = Annotated[
    float | None,
    typer.Option("--rate", metavar="HZ", help="Largest sampling rate of the solution.", show_default="all"),
]
Outages = Annotated[
    list[str] | None,
    typer.Option(
        "--outage",
        metavar="SPAN",
        help="Withhold GNSS fixes: 40:55 from 40 s to 55 s; 15/45 for 15 s every 45 s; 15/45@60 the same, the "
        "first at 60 s. May be repeated.",
    ),
]


def command(
    run: RunFolder,
    to: To,
    out: Out = None,
    solution: Solutions = None,
    start: Annotated[str | None, start_option("Date of time 0 of the run, UTC.")] = None,
    rate: Rate = None,
    outages: Outages = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Write a run in a format of another program: sensor data, fixes, truth and solutions.

    The output lists the file of each stream with its units, axes and clock. The simulated time of a run begins at 0;
    --start gives the date of this time.

    Another navigation program can be tested on the exported data; `sinssim score` computes the errors of its solution.

    Examples:

        sinssim export runs/first_flight --to kml
        sinssim export runs/mems_uav --to kf-gins -o kf_gins_input
        sinssim export runs/mems_uav --to kf-gins -o gaps --outage 15/45@60
        sinssim export runs/mems_uav --to sbet --solution aided --solution ideal
    """
    from sinssim.logs.formats.run_export import export

    done = export(
        run, to, out, solution=solution or [], start=start, rate_hz=rate, outages=outages or (), overwrite=overwrite
    )
    if as_json:
        print_json({"place": str(done.place), "files": [str(f) for f in done.files], "contents": list(done.sentences)})
    elif not quiet:
        print(f"{done.place}")
        for sentence in done.sentences:
            print(f"  {sentence}")
