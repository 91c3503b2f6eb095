"""`sinssim ensemble`: many runs of a scenario, and the statistics of their errors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import (
    AtTimes,
    Debug,
    GradeOption,
    Json,
    Quiet,
    ScenarioName,
    Settings,
    out_option,
    overwrite_option,
    require_option,
    with_grade,
)
from sinssim.cli.terminal import console, has_bars, print_json, print_places, program_name, remarks

Runs = Annotated[
    int | None, typer.Option("--runs", "-n", metavar="N", help="Number of runs.", show_default="ensemble.runs, or 1000")
]
Resume = Annotated[bool, typer.Option("--resume", help="Continue an ensemble, or extend it to more runs.")]
Threads = Annotated[
    int | None,
    typer.Option(
        "--threads",
        metavar="N",
        help="Number of parallel runs on this machine: threads, or processes for a filter.",
        show_default="the number of cores",
    ),
]
Workers = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", help="Workers of a dask cluster on this machine, instead of threads."),
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Dask scheduler to use, for example tcp://10.0.0.1:8786."),
]
Require = Annotated[
    list[str] | None,
    require_option(
        'Test a requirement, which is met, not met or undecided at 95 %: "r95(3600 s) <= 1852 m", "heading(end) <= 3 '
        'arcmin"'
    ),
]
UntilDecided = Annotated[
    bool,
    typer.Option(
        "--until-decided", help="Double the number of runs, up to 16 times --runs, until every requirement is decided."
    ),
]
Sheet = Annotated[bool, typer.Option("--sheet", help="Print the performance of the IMU in the form of a data sheet.")]


def command(
    scenario: ScenarioName,
    runs: Runs = None,
    out: Annotated[Path | None, out_option("runs/<name>-ensemble")] = None,
    settings: Settings = None,
    grade: GradeOption = None,
    resume: Resume = False,
    overwrite: Annotated[bool, overwrite_option("an existing ensemble")] = False,
    threads: Threads = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    require: Require = None,
    until_decided: UntilDecided = False,
    at: AtTimes = None,
    sheet: Sheet = False,
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

    requirements = parse_requirements(require or ())
    plan = load_scenario(scenario, with_grade(settings, grade))
    directory = out or Path("runs") / f"{plan.name}-ensemble"
    from sinssim.experiments.ensembles.ensemble_run import ensemble

    result = ensemble(
        plan, runs, directory, resume=resume, overwrite=overwrite, threads=threads, workers=workers,
        scheduler=scheduler, require=requirements, until_decided=until_decided, times=at or (),
        progress=has_bars(quiet), say=remarks(quiet),
    )  # fmt: skip
    from sinssim.experiments.ensembles.ensemble_statistics import ensemble_numbers, summary_of

    numbers = ensemble_numbers(result)
    if as_json:
        from sinssim.recording.run_directory import plain

        print_json(plain(summary_of(result, numbers)))
    elif not quiet:
        from sinssim.experiments.ensembles.ensemble_exhibits import exhibits_of, sheet_of
        from sinssim.recording.console import show

        show((sheet_of if sheet else exhibits_of)(result, numbers), console(least_width=120))
        for run in () if sheet else numbers.named_runs:
            if run.rank in ("worst", "median", "best"):
                print(f"{run.rank:<7}{result.command(run.run, program_name())}")
        print_places(directory)
