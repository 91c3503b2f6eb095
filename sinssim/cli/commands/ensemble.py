"""`sinssim ensemble`: many runs of a scenario, and the statistics of their errors."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, GradeOption, Json, Quiet, ScenarioName, Settings, with_grade
from sinssim.cli.terminal import console, has_bars, print_json, program_name


# Long: every option is a parameter, and the docstring is the help.
def command(
    scenario: ScenarioName,
    runs: Annotated[
        int | None,
        typer.Option("--runs", "-n", metavar="N", help="Number of runs.", show_default="ensemble.runs, or 1000"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Output directory.", show_default="runs/<name>-ensemble"),
    ] = None,
    settings: Settings = None,
    grade: GradeOption = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue an ensemble, or extend it to more runs.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing ensemble; your own files are kept.")
    ] = False,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            metavar="N",
            help="Number of parallel runs on this machine: threads, or processes for a filter.",
            show_default="the number of cores",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", metavar="N", help="Workers of a dask cluster on this machine, instead of threads."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Dask scheduler to use, for example tcp://10.0.0.1:8786."),
    ] = None,
    require: Annotated[
        list[str] | None,
        typer.Option(
            "--require",
            metavar="REQUIREMENT",
            help='Test a requirement, which is met, not met or undecided at 95 %: "r95(3600 s) <= 1852 m", '
            '"heading(end) <= 3 '
            'arcmin"; may be given several times.',
            show_default=False,
        ),
    ] = None,
    until_decided: Annotated[
        bool,
        typer.Option(
            "--until-decided",
            help="Double the number of runs, up to 16 times --runs, until every requirement is decided.",
        ),
    ] = False,
    at: Annotated[
        list[float] | None,
        typer.Option(
            "--at", metavar="S", help="A further time for the table, s; may be given several times.", show_default=False
        ),
    ] = None,
    sheet: Annotated[
        bool, typer.Option("--sheet", help="Print the performance of the IMU in the form of a data sheet.")
    ] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Run a scenario many times with different random numbers, and give the statistics of the errors.

    Writes a directory with a report (report.html, self-contained), a figure for publications (ensemble.svg,
    ensemble.png), all numbers (summary.json), a recording for the view *ensemble* (recording.rrd) and the errors of
    every run at the epochs (runs/, Parquet). After Ctrl-C, the finished groups of runs and their report remain;
    --resume continues.

    Run i is `sinssim run SCENARIO --set seed=S_i`, bit for bit; the commands of the worst, the median and the best run
    are printed. The scenario lists the keys that vary from run to run in [[ensemble.vary]].

    Examples:

        sinssim ensemble first_flight --runs 1000
        sinssim ensemble gyrocompassing --runs 50 --sheet
        sinssim ensemble first_flight --runs 200 --require "r95(3600 s) <= 1 nmi" --until-decided
    """
    from sinssim.scenario import load_scenario
    from sinssim.statistics.requirements import parse_requirements

    wanted = parse_requirements(require or ())
    plan = load_scenario(scenario, with_grade(settings, grade))
    directory = out or Path("runs") / f"{plan.name}-ensemble"
    from sinssim.experiments.ensembles.ensemble_run import ensemble

    def say(text: str) -> None:
        if not quiet:
            print(text, file=sys.stderr)

    result = ensemble(
        plan, runs, directory, resume=resume, overwrite=overwrite, threads=threads, workers=workers,
        scheduler=scheduler, require=wanted, until_decided=until_decided, times=at or (),
        progress=has_bars(quiet), say=say,
    )  # fmt: skip
    from sinssim.experiments.ensembles.ensemble_statistics import ensemble_numbers

    numbers = ensemble_numbers(result)
    if as_json:
        from sinssim.recording.run_directory import plain

        print_json(plain(numbers))
    elif not quiet:
        from sinssim.experiments.ensembles.ensemble_exhibits import exhibits_of, sheet_of
        from sinssim.recording.console import show

        show((sheet_of if sheet else exhibits_of)(result, numbers), console(least_width=120))
        for one in () if sheet else numbers["named_runs"]:
            if one["rank"] in ("worst", "median", "best"):
                print(f"{one['rank']:<7}{result.command(one['run'], program_name())}")
        print(f"Report: {directory / 'report.html'}    (in any browser)")
        print(f"View:   {program_name()} view {directory}    (--web: in a browser)")
