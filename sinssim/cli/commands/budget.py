"""`sinssim budget`: covariances of the navigation errors by source, and the largest sources that meet a requirement."""

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
from sinssim.cli.terminal import console, has_bars, print_json, print_places

Require = Annotated[
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


def command(
    scenario: ScenarioName,
    out: Annotated[Path | None, out_option("runs/<name>-budget")] = None,
    settings: Settings = None,
    grade: GradeOption = None,
    require: Require = None,
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
    if as_json:
        print_json(result.summary)
    elif not quiet:
        from sinssim.recording.console import show

        assert result.directory is not None
        show(result.exhibits, console(least_width=120))
        print_places(result.directory)


def _sources(free: str | None, required: bool) -> list[str]:
    """Return the names of --free."""
    from sinssim.errors import InputError

    names = [name.strip() for name in (free or "").split(",") if name.strip()]
    if free is not None and not names:
        raise InputError(
            f"--free {free!r} names no source. Give names of the budget's sources, separated by commas: "
            "--free gyro_bias,accel_bias."
        )
    if names and not required:
        raise InputError(f"--free {free} needs a --require: the factor is that with which a requirement is just met.")
    return names
