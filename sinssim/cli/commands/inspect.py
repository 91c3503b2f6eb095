"""`sinssim inspect`: checks recorded files before they are used, and prints the findings by subject."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from sinssim.cli.options import Debug, Json, Quiet
from sinssim.cli.terminal import console, print_json

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.analyses.inspection.stream_inspection import Inspection


def command(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Recorded files of an IMU, a GNSS receiver, or both: any format of `sinssim list "
            "formats`, a text file with unknown columns, or a scenario with [log] that describes them.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="Write the suggested scenario, or the corrected one of a given scenario, to this file (.toml).",
        ),
    ] = None,
    vehicle: Annotated[
        Literal["any", "land"],
        typer.Option(
            "--vehicle",
            help="land: a wheeled vehicle; the suggested scenario then contains the nonholonomic constraint and the "
            "detection of stops.",
        ),
    ] = "any",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Inspect recorded files: contents, doubtful data, and a suggested scenario.

    Examines format, columns, rate, jitter, gaps, repeated times, saturation and resolution; compares the specific force
    at rest with gravity; and compares the inertial data with the GNSS velocities. The comparison needs neither the
    attitude nor the mounting. It gives the offset of the clocks, the age of the velocities, wrong units, signs and
    axes, and the mounting of the IMU in a vehicle that moves along its longitudinal axis.

    The exit code is 2 if an error would make the results worthless.

    Examples:

        sinssim inspect imu.csv gnss.pos
        sinssim inspect imu.csv gnss.pos --vehicle land --out drive.toml
    """
    from sinssim.analyses.inspection.inspected_files import inspect
    from sinssim.errors import InputError
    from sinssim.system.outputs import write_text

    if out is not None:
        if out.suffix != ".toml":
            raise InputError(f"--out {out}: a scenario's file ends with .toml.")
        if out.exists() and not overwrite:
            raise InputError(f"--out {out}: there is such a file already. Choose another name, or add --overwrite.")
    result = inspect(files, Path() if out is None else out.parent, land=vehicle == "land")
    if out is not None and result.scenario is not None:  # before printing, which may end early
        write_text(out, result.scenario)
    if as_json:
        print_json({**result.inspection.as_dict(), "scenario": result.scenario, "why_no_scenario": result.why or None})
    elif not quiet:
        show(result.inspection, console(least_width=100))
        if result.scenario is not None and out is None:
            print(f"\nA scenario to start from (--out FILE writes it):\n\n{result.scenario}", end="")
        if result.why:
            print(f"\n{result.why}")
    if out is not None and result.scenario is not None and not (quiet or as_json):
        print(f"\nScenario: {out}")
    if not result.inspection.usable:
        raise typer.Exit(2)


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
