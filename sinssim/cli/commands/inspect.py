"""`sinssim inspect`: judges recorded files before anybody relies on them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from sinssim.cli.options import Debug, Json, Quiet
from sinssim.cli.terminal import console, print_json


def command(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Recorded files of an inertial unit, a satellite receiver, or both: any format of `sinssim list "
            "formats`, a text file of unknown columns, or a scenario with [log] that describes them.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help="Write the suggested scenario there (.toml).", show_default=False
        ),
    ] = None,
    vehicle: Annotated[
        Literal["any", "land"],
        typer.Option(
            "--vehicle",
            help="land: the vehicle moves on wheels; the suggested scenario then has their constraint, and stops.",
        ),
    ] = "any",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Inspect recorded files: what they are, what is doubtful, and a scenario to start from.

    Looks at format, columns, rate, jitter, gaps, repeated times, saturation and resolution; compares the specific force
    at rest with gravity; and compares the inertial readings with the velocities of satellites. The comparison needs no
    attitude and no mounting. It gives the offset of the clocks, the age of the velocities, wrong units, signs and axes,
    and the mounting of the unit in a vehicle that moves where it points.

    Exit code 2 if something is wrong that makes results worthless.

    Examples:

        sinssim inspect imu.csv gnss.pos
        sinssim inspect imu.csv gnss.pos --vehicle land --out drive.toml
    """
    from sinssim.errors import InputError
    from sinssim.inspection.files import inspect

    if out is not None:
        if out.suffix != ".toml":
            raise InputError(f"--out {out}: a scenario's file ends with .toml.")
        if out.exists() and not overwrite:
            raise InputError(f"--out {out}: there is such a file already. Choose another name, or add --overwrite.")
    result = inspect(files, Path() if out is None else out.parent, land=vehicle == "land")
    if as_json:
        print_json({**result.inspection.as_dict(), "scenario": result.scenario})
    elif not quiet:
        from sinssim.recording.tables.inspection import show

        show(result.inspection, console(least_width=100))
        if result.scenario is not None and out is None:
            print(f"\nA scenario to start from (--out FILE writes it):\n\n{result.scenario}", end="")
    if out is not None and result.scenario is not None:
        beside = out.with_name(f".{out.name}.partial")
        beside.write_text(result.scenario, encoding="utf-8")
        beside.replace(out)
        if not (quiet or as_json):
            print(f"\nScenario: {out}")
    if not result.inspection.usable:
        raise typer.Exit(2)
