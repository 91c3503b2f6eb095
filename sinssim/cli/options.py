"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

_traceback = False


def traceback_wanted() -> bool:
    """Return whether --debug was given."""
    return _traceback


def want_traceback(value: bool) -> bool:
    """Set what `traceback_wanted` returns; the callback of --debug.

    Args:
        value: whether an error shows Python's traceback.

    Returns:
        The value.
    """
    global _traceback
    _traceback = value
    return value


ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="A scenario's TOML file, or a name from `sinssim list scenarios`.",
        show_default=False,
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the scenario; may be given several times. A key is a path with dots; legs are "
        "counted from 1: `--set imu.grade=tactical --set flight.legs.2.altitude_m=9000`.",
        show_default=False,
    ),
]
OutFolder = Annotated[
    Path | None,
    typer.Option("--out", "-o", metavar="DIR", help="Output directory.", show_default="runs/<name>"),
]
ColumnsFile = Annotated[
    Path | None,
    typer.Option(
        "--columns",
        metavar="FILE",
        help="TOML file that gives a log's columns, units and axes.",
        show_default="the columns of imu_measured.parquet",
    ),
]
FromTime = Annotated[float | None, typer.Option("--from", metavar="S", help="Start of the part to use, s.")]
ToTime = Annotated[float | None, typer.Option("--to", metavar="S", help="End of the part to use, s.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print only the result, as JSON.")]
Debug = Annotated[
    bool, typer.Option("--debug", callback=want_traceback, help="Show Python's traceback if an error occurs.")
]
