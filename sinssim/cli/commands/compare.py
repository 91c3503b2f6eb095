"""`sinssim compare`: runs a study, of algorithms or of a scenario's keys, and writes its report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sinssim.cli.options import Debug, Json, OutFolder, Quiet, overwrite_option, require_option
from sinssim.cli.terminal import console, has_bars, notes_of, print_json, print_places, remarks

if TYPE_CHECKING:
    from sinssim.experiments.studies.study_schema import Study
    from sinssim.experiments.studies.trade_schema import TradeStudy

StudyName = Annotated[
    str,
    typer.Argument(
        metavar="STUDY", help="A study's TOML file, or a name from `sinssim list studies`; with --vary, a scenario."
    ),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="KEY=VALUES",
        help="Vary a key of a scenario, without a study's file; may be given several times for every combination. "
        "Values: `imu.rate_hz=50,100,200`; a range START:STOP:STEP, with its stop if it lies on the grid, "
        "`0.5:2:0.25`; N values in equal ratios START:STOP:logN, `0.1:10:log5`.",
    ),
]
StudySettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the study; may be given several times. Parts, motions and axes are counted from "
        '1: `--set parts.1.rates_hz="[50.0, 100.0]"`, `--set cell=ensemble --set runs=500`. With --vary, also a '
        "value of the scenario in every cell.",
    ),
]
Require = Annotated[
    list[str] | None,
    require_option(
        'Test a requirement in every cell of a trade study, in addition to those of the file: "r95(3600 s) <= 1852 '
        'm", "heading(end) <= 3 arcmin"'
    ),
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Continue a trade study, or extend it by further values of its axes.")
]
Threads = Annotated[
    int | None,
    typer.Option(
        "--threads",
        metavar="N",
        help="Number of parallel runs in the ensembles of a trade study.",
        show_default="the number of cores",
    ),
]
LimitMinutes = Annotated[
    float, typer.Option("--limit-minutes", min=0.0, help="Refuse a study that would take longer than this.")
]


def command(
    study: StudyName,
    vary: Vary = None,
    out: OutFolder = None,
    settings: StudySettings = None,
    require: Require = None,
    resume: Resume = False,
    threads: Threads = None,
    limit_minutes: LimitMinutes = 30.0,
    overwrite: Annotated[bool, overwrite_option("an existing study")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Compare algorithms, rates, frames and sensors on identical samples, or vary keys of a scenario in a grid.

    A study with [[parts]] compares algorithms, and recommends engines. It writes a report (report.html,
    self-contained), all results (results.json, results.parquet), a recording for the view *comparison*
    (recording.rrd), and the study with all default values (study.toml). After Ctrl-C, the report contains the finished
    cases.

    A trade study has a scenario and [[axes]]: every combination of their values is a cell, a covariance budget or an
    ensemble of runs. It writes a report with figures (report.html; also as SVG and PNG), the tables
    (summary.md, results.json, results.parquet), a recording for the view *trade* (recording.rrd) and the finished cells
    (cells/). After Ctrl-C, the finished cells and their report remain; --resume continues. With --vary, the study
    needs no file: it is that of a scenario and these keys. See docs/trades.md.

    Examples:

        sinssim compare coning
        sinssim compare my_study.toml -o runs/mine --set seed=3
        sinssim compare gyro_trade --require "r95(3600 s) <= 1 nmi"
        sinssim compare first_flight --vary imu.grade=laser-navigation,laser-standard --vary imu.rate_hz=50:200:50
    """
    plan = _study(study, vary, settings or (), require or ())
    directory = out or Path("runs") / plan.name
    from sinssim.experiments.study import compare

    try:
        result = compare(
            plan, directory, resume=resume, overwrite=overwrite, limit_minutes=limit_minutes, threads=threads,
            progress=has_bars(quiet), say=remarks(quiet),
        )  # fmt: skip
    except KeyboardInterrupt as interrupt:
        if not notes_of(interrupt):
            interrupt.add_note("No navigation had finished.")
        raise
    if as_json:
        print_json(result.summary)
    elif not quiet:
        from sinssim.recording.console import show

        show(result.exhibits, console(least_width=120))
        print_places(directory, (directory / "recording.rrd").exists())


def _study(
    name: str, vary: Sequence[str] | None, settings: Sequence[str], require: Sequence[str]
) -> Study | TradeStudy:
    """Return the study of a file, or that of a scenario and varied keys."""
    from sinssim.experiments.studies.trade_schema import TradeStudy
    from sinssim.experiments.study import load_any_study, sweep

    plan = sweep(name, vary, settings) if vary else load_any_study(name, settings)
    if isinstance(plan, TradeStudy):
        return plan.with_requirements(require)
    if require:
        from sinssim.errors import InputError

        raise InputError(
            f"--require belongs to trade studies, which have axes; the study {plan.name} compares algorithms."
        )
    return plan
