"""`sinssim budget`: covariances of the navigation errors by source, and the largest sources that meet a requirement."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, GradeOption, Json, Quiet, ScenarioName, Settings, with_grade
from sinssim.cli.terminal import console, has_bars, print_json, program_name


# Long: every option is a parameter, and the docstring is the help.
def command(
    scenario: ScenarioName,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Output directory.", show_default="runs/<name>-budget"),
    ] = None,
    settings: Settings = None,
    grade: GradeOption = None,
    require: Annotated[
        list[str] | None,
        typer.Option(
            "--require",
            metavar="REQUIREMENT",
            help='Test a requirement, and give the largest value of every source with which it is met: "r95(3600 s) '
            '<= 1852 m", "heading(end) <= 3 arcmin", "rate <= 0.8 nmi/h"; may be given several times.',
            show_default=False,
        ),
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(
            "--free",
            metavar="SOURCES",
            help="Sources with a common factor in the results, separated by commas: gyro_bias,accel_bias.",
            show_default=False,
        ),
    ] = None,
    at: Annotated[
        list[float] | None,
        typer.Option(
            "--at", metavar="S", help="A further time for the table, s; may be given several times.", show_default=False
        ),
    ] = None,
    inertial: Annotated[
        bool, typer.Option("--inertial", help="Budget of inertial navigation without the filter of the scenario.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing budget; your own files are kept.")
    ] = False,
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
    """  # fmt: skip
    from sinssim.errors import InputError
    from sinssim.scenario import load_scenario
    from sinssim.statistics.requirements import parse_requirements

    wanted = parse_requirements(require or ())
    names = [name.strip() for name in (free or "").split(",") if name.strip()]
    if free is not None and not names:
        raise InputError(
            f"--free {free!r} names no source. Give names of the budget's sources, separated by commas: "
            "--free gyro_bias,accel_bias."
        )
    if names and not wanted:
        raise InputError(f"--free {free} needs a --require: the factor is that with which a requirement is just met.")
    plan = load_scenario(scenario, with_grade(settings, grade))
    directory = out or Path("runs") / f"{plan.name}-budget"
    from sinssim.analyses.error_budget.covariance_budget import budget

    result = budget(
        plan,
        directory,
        overwrite=overwrite,
        times=at or (),
        require=wanted,
        free=names,
        solution="inertial" if inertial else None,
        progress=has_bars(quiet),
    )
    if as_json:
        print_json(result.summary)
    elif not quiet:
        from sinssim.recording.console import show

        show(result.exhibits, console(least_width=120))
        print(f"Report: {result.directory}/report.html    (in any browser)")
        print(f"View:   {program_name()} view {result.directory}    (--web: in a browser)")
