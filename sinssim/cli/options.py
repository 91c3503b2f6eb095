"""Arguments and options that several commands share."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

_traceback = False
_quiet = False


def traceback_wanted() -> bool:
    """Return whether --debug was given."""
    return _traceback


def want_traceback(value: bool) -> bool:
    """Set what `traceback_wanted` returns; the callback of --debug."""
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
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the scenario; may be given several times. A key is a path with dots; legs are "
        "counted from 1: `--set imu.grade=tactical --set flight.legs.2.altitude_m=9000`.",
    ),
]
GradeOption = Annotated[
    str | None,
    typer.Option(
        "--grade",
        metavar="NAME|FILE",
        help="Replace imu.grade: a name from `sinssim list grades`, or a grade's TOML file.",
    ),
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
AtTimes = Annotated[
    list[float] | None,
    typer.Option("--at", metavar="S", help="A further time for the table, s; may be given several times."),
]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", callback=want_quiet, help="Print only errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print only the result, as JSON.")]
Debug = Annotated[
    bool, typer.Option("--debug", callback=want_traceback, help="Show Python's traceback if an error occurs.")
]


def out_option(folder: str) -> Any:
    """Return the option --out of a command that writes to a `folder` by default."""
    return typer.Option("--out", "-o", metavar="DIR", help="Output directory.", show_default=folder)


OutFolder = Annotated[Path | None, out_option("runs/<name>")]


def overwrite_option(results: str) -> Any:
    """Return the option --overwrite of a command, whose `results` in words are "an existing run"."""
    return typer.Option("--overwrite", help=f"Replace {results}; your own files are kept.")


def require_option(what: str) -> Any:
    """Return the option --require of a command, whose help begins with `what` it does."""
    return typer.Option("--require", metavar="REQUIREMENT", help=f"{what}; may be given several times.")


def start_option(help_text: str) -> Any:
    """Return the option --start, the date of a run's time 0."""
    from sinssim.logs.formats.registry import DEFAULT_START

    usual = f"{DEFAULT_START}, or the date of a recorded log"
    return typer.Option("--start", metavar="DATE", help=help_text, show_default=usual)


def with_grade(settings: Sequence[str] | None, grade: str | None) -> list[str]:
    """Return the settings of a scenario with that of --grade, which is the last one."""
    return [*(settings or ()), *([] if grade is None else [f"imu.grade={json.dumps(grade)}"])]
