"""`sinssim ensemble`, `compare` and `budget`: many runs, studies, and covariances of the errors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sinssim.cli.command_line import (
    AtTimes,
    Debug,
    GradeOption,
    Json,
    OutFolder,
    Quiet,
    ScenarioName,
    Settings,
    command,
    console,
    has_bars,
    out_option,
    overwrite_option,
    print_json,
    print_places,
    print_result,
    program_name,
    remarks,
    require_option,
    starts_programs,
    threads_option,
    with_grade,
)
from sinssim.errors import InputError

if TYPE_CHECKING:
    from sinssim.experiments.studies.study_schema import Study
    from sinssim.experiments.studies.trade_schema import TradeStudy


Runs = Annotated[
    int | None, typer.Option("--runs", "-n", metavar="N", help="Number of runs.", show_default="ensemble.runs, or 1000")
]
Resume = Annotated[bool, typer.Option("--resume", help="Continue an ensemble, or extend it to more runs.")]
Threads = Annotated[int | None, threads_option("parallel runs on this machine: threads, or processes for a filter")]
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


@command
@starts_programs
def ensemble(
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
    from sinssim.experiments.ensembles.ensemble_summary import ensemble_numbers, summary_of

    numbers = ensemble_numbers(result)
    if as_json:
        from sinssim.recording.result import plain

        print_json(plain(summary_of(result, numbers)))
    elif not quiet:
        from sinssim.experiments.ensembles.ensemble_exhibits import exhibits_of, sheet_of
        from sinssim.recording.console import show

        show((sheet_of if sheet else exhibits_of)(result, numbers), console(least_width=120))
        for run in () if sheet else numbers.named_runs:
            if run.rank in ("worst", "median", "best"):
                print(f"{run.rank:<7}{result.command(run.run, program_name())}")
        print_places(directory)


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
RequireOfCells = Annotated[
    list[str] | None,
    require_option(
        'Test a requirement in every cell of a trade study, in addition to those of the file: "r95(3600 s) <= 1852 '
        'm", "heading(end) <= 3 arcmin"'
    ),
]
ResumeStudy = Annotated[
    bool, typer.Option("--resume", help="Continue a study, or extend it by further parts, or values of its axes.")
]
StudyThreads = Annotated[
    int | None,
    threads_option("parallel navigations, or runs in the ensembles of a trade study", "2, or the number of cores"),
]
LimitMinutes = Annotated[
    float, typer.Option("--limit-minutes", min=0.0, help="Refuse a study that would take longer than this.")
]


@command
@starts_programs
def compare(
    study: StudyName,
    vary: Vary = None,
    out: OutFolder = None,
    settings: StudySettings = None,
    require: RequireOfCells = None,
    resume: ResumeStudy = False,
    threads: StudyThreads = None,
    limit_minutes: LimitMinutes = 30.0,
    overwrite: Annotated[bool, overwrite_option("an existing study")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Compare algorithms, rates, frames and sensors on identical samples, or vary keys of a scenario in a grid.

    A study with [[parts]] compares algorithms, and recommends engines. It writes a report (report.html,
    self-contained), all results (results.json, results.parquet), a recording for the view *comparison*
    (recording.rrd), the study with all default values (study.toml) and the finished navigations (navigations/).

    A trade study has a scenario and [[axes]]: every combination of their values is a cell, a covariance budget or an
    ensemble of runs. It writes a report with figures (report.html; also as SVG and PNG), the tables
    (summary.md, results.json, results.parquet), a recording for the view *trade* (recording.rrd) and the finished cells
    (cells/). With --vary, the study needs no file: it is that of a scenario and these keys. See docs/trades.md.

    After Ctrl-C, what has finished and its report remain; --resume continues.

    Examples:

        sinssim compare coning
        sinssim compare my_study.toml -o runs/mine --set seed=3
        sinssim compare gyro_trade --require "r95(3600 s) <= 1 nmi"
        sinssim compare first_flight --vary imu.grade=laser-navigation,laser-standard --vary imu.rate_hz=50:200:50
    """
    plan = _study(study, vary, settings or (), require or ())
    directory = out or Path("runs") / plan.name
    from sinssim.experiments.study import compare

    result = compare(
        plan, directory, resume=resume, overwrite=overwrite, limit_minutes=limit_minutes, threads=threads,
        progress=has_bars(quiet), say=remarks(quiet),
    )  # fmt: skip
    if print_result(result, as_json=as_json, quiet=quiet, least_width=120):
        print_places(directory, (directory / "recording.rrd").exists())


def _study(
    name: str, vary: Sequence[str] | None, settings: Sequence[str], require: Sequence[str]
) -> Study | TradeStudy:
    """Return the study of a file, or that of a scenario and varied keys."""
    from sinssim.experiments.studies.trade_schema import TradeStudy
    from sinssim.experiments.studies.trade_sweep import sweep
    from sinssim.experiments.study import load_study

    plan = sweep(name, vary, settings) if vary else load_study(name, settings)
    if isinstance(plan, TradeStudy):
        return plan.with_requirements(require)
    if require:
        from sinssim.errors import InputError

        raise InputError(
            f"--require belongs to trade studies, which have axes; the study {plan.name} compares algorithms."
        )
    return plan


RequireOfSources = Annotated[
    list[str] | None,
    require_option(
        'Test a requirement, and give the largest value of every source with which it is met: "r95(3600 s) '
        '<= 1852 m", "heading(end) <= 3 arcmin", "rate <= 0.8 nmi/h"'
    ),
]
Free = Annotated[
    str | None,
    typer.Option(
        "--free",
        metavar="SOURCES",
        help="Sources with a common factor in the results, separated by commas: gyro_bias,accel_bias.",
    ),
]
Inertial = Annotated[
    bool, typer.Option("--inertial", help="Budget of inertial navigation without the filter of the scenario.")
]


@command
@starts_programs
def budget(
    scenario: ScenarioName,
    out: Annotated[Path | None, out_option("runs/<name>-budget")] = None,
    settings: Settings = None,
    grade: GradeOption = None,
    require: RequireOfSources = None,
    free: Free = None,
    at: AtTimes = None,
    inertial: Inertial = False,
    overwrite: Annotated[bool, overwrite_option("an existing budget")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Compute the covariances of a scenario's navigation errors by source, without random numbers.

    Every error of the sensors and of the initial state is propagated separately along the true motion; with a filter,
    by the gains of the filter. The result gives the size of the errors over all runs, the contribution of each source,
    and a ranking of improvements. For a requirement, it gives the largest allowed value of each source. See
    docs/budgets.md.

    Writes a directory with the report (report.html, self-contained), the numbers (budget.json, budget.parquet), the
    recording (recording.rrd) and the scenario with all default values (scenario.toml).

    Examples:

        sinssim budget first_flight
        sinssim budget first_flight --require "r95(3600 s) <= 1852 m" --free gyro_bias,accel_bias
    """
    from sinssim.scenario import load_scenario
    from sinssim.statistics.requirements import parse_requirements

    requirements, sources = parse_requirements(require or ()), _sources(free, bool(require))
    plan = load_scenario(scenario, with_grade(settings, grade))
    directory = out or Path("runs") / f"{plan.name}-budget"
    from sinssim.analyses.error_budget.covariance_budget import budget

    result = budget(
        plan, directory, overwrite=overwrite, times=at or (), require=requirements, free=sources,
        solution="inertial" if inertial else None, progress=has_bars(quiet),
    )  # fmt: skip
    if print_result(result, as_json=as_json, quiet=quiet, least_width=120):
        print_places(result.directory or directory)


def _sources(free: str | None, required: bool) -> list[str]:
    """Return the names of --free."""
    names = [name.strip() for name in (free or "").split(",") if name.strip()]
    if free is not None and not names:
        raise InputError(
            f"--free {free!r} names no source. Give names of the budget's sources, separated by commas: "
            "--free gyro_bias,accel_bias."
        )
    if names and not required:
        raise InputError(f"--free {free} needs a --require: the factor is that with which a requirement is just met.")
    return names
