"""Arguments and options that several commands share."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

_traceback = False
_quiet = False


def traceback_wanted() -> bool:
    """Return whether --debug was given."""
    return _traceback


def want_traceback(value: bool) -> bool:
    """Set what `traceback_wanted` returns; the callback of --debug.

    Args:
        value: whether an error shows Python's traceback.
    """
    global _traceback
    _traceback = value
    return value


def scenario_names(incomplete: str) -> list[str]:
    """Return the names of scenarios for the shell's completion, which adds files where none of them fits."""
    from sinssim.content import list_content

    return [name for name in list_content("scenarios") if name.startswith(incomplete)]


def quiet_wanted() -> bool:
    """Return whether --quiet was given."""
    return _quiet


def want_quiet(value: bool) -> bool:
    """Set what `quiet_wanted` returns; the callback of --quiet."""
    global _quiet
    _quiet = value
    return value


ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=scenario_names,
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
GradeOption = Annotated[
    str | None,
    typer.Option(
        "--grade",
        metavar="NAME|FILE",
        help="Replace imu.grade: a name from `sinssim list grades`, or a grade's TOML file.",
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
        help="TOML file that describes the columns, units and axes of a log.",
        show_default="the columns of imu_measured.parquet",
    ),
]
FromTime = Annotated[float | None, typer.Option("--from", metavar="S", help="Start of the part to use, s.")]
ToTime = Annotated[float | None, typer.Option("--to", metavar="S", help="End of the part to use, s.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", callback=want_quiet, help="Print only errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print only the result, as JSON.")]
Debug = Annotated[
    bool, typer.Option("--debug", callback=want_traceback, help="Show Python's traceback if an error occurs.")
]


def with_grade(settings: Sequence[str] | None, grade: str | None) -> list[str]:
    """Return the settings of a scenario with that of --grade.

    Returns:
        The settings; that of --grade is the last one.
    """
    return [*(settings or ()), *([] if grade is None else [f"imu.grade={json.dumps(grade)}"])]
