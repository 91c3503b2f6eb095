"""`sinssim calibrate`: errors of gyros and accelerometers from a sequence on a turntable."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import (
    Debug,
    GradeOption,
    Json,
    Quiet,
    ScenarioName,
    Settings,
    out_option,
    overwrite_option,
    with_grade,
)
from sinssim.cli.terminal import console, has_bars, print_json


def command(
    scenario: ScenarioName,
    out: Annotated[Path | None, out_option("runs/<name>-calibration")] = None,
    settings: Settings = None,
    grade: GradeOption = None,
    method: Annotated[
        str | None,
        typer.Option("--method", metavar="METHOD", help="separate or systematic.", show_default="the scenario's"),
    ] = None,
    overwrite: Annotated[bool, overwrite_option("an existing calibration")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Calibrate an IMU on a turntable.

    Estimates biases, scale factors, misalignments and, on request, the positions of the accelerometers from the
    sequence of the table [turntable]: by separate tests in known positions, or from the navigation errors. Reports the
    parameters that the sequence does not determine. The data are simulated, or recorded data of [log]. See
    docs/calibration.md.

    Writes a directory with the report (report.html, self-contained), the numbers (calibration.json), the file for
    [compensation] (compensation.toml) and the scenario with all default values (scenario.toml).

    Examples:

        sinssim calibrate calibration_table
        sinssim calibrate calibration_systematic --set turntable.dwell_s=60
    """
    from sinssim.analyses.calibration.turntable_calibration import calibrate
    from sinssim.scenario import load_scenario

    plan = load_scenario(scenario, with_grade(settings, grade))
    directory = out or Path("runs") / f"{plan.name}-calibration"
    result = calibrate(plan, directory, method=method, overwrite=overwrite, progress=has_bars(quiet))
    if as_json:
        print_json(result.summary)
    elif not quiet:
        from sinssim.recording.console import show

        show(result.exhibits, console(least_width=110))
        print(f"Report:       {result.directory}/report.html    (in any browser)")
        print(f'Compensation: {result.directory}/compensation.toml    ([compensation] with file = "…")')
