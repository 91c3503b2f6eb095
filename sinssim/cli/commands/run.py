"""`sinssim run`: simulates one scenario, or navigates on recorded sensors, and writes a run directory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json, OutFolder, Quiet, ScenarioName, Settings
from sinssim.cli.terminal import console, notes_of, print_json, program_name, stage_bars


def command(
    scenario: ScenarioName,
    out: OutFolder = None,
    settings: Settings = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing run; your own files stay.")
    ] = False,
    view: Annotated[
        str | None,
        typer.Option(
            "--view", metavar="NAME", help="Open this view afterwards: a name from `sinssim list views`, or a file."
        ),
    ] = None,
    outages: Annotated[
        list[str] | None,
        typer.Option(
            "--outage",
            metavar="SPAN",
            help="Withhold recorded satellites: 40:55 from 40 s to 55 s; 15/45 for 15 s every 45 s; 15/45@60 the "
            "same, the first at 60 s. May be repeated. For scenarios with [log].",
        ),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Simulate one scenario: fly, sense, navigate and record.

    Writes a run directory with a report (report.html, self-contained), the recording (recording.rrd), every stream as
    Parquet (streams/), the error statistics (summary.json) and the scenario with all its defaults (scenario.toml). A
    flight that was computed before comes from the cache.

    Examples:

        sinssim run first_flight
        sinssim run my_flight.toml -o runs/tactical --set imu.grade=tactical --set seed=3
        sinssim run my_drive.toml --outage 15/45
    """
    from sinssim.errors import InputError
    from sinssim.scenario import find_content, load_scenario
    from sinssim.scenario.outages import outage_settings

    plan = load_scenario(scenario, settings or ())
    if outages:
        if plan.log is None:
            raise InputError(
                "--outage withholds recorded satellites ([log]); in a simulation, aiding.gnss.outages_s has outages."
            )
        plan = load_scenario(scenario, [*(settings or ()), *outage_settings(outages)])
    if view is not None:
        find_content("viz", view)
    directory = out or Path("runs") / plan.name
    from sinssim.simulation.execute import run

    try:
        with stage_bars(show=not quiet) as progress:
            result = run(plan, directory, overwrite=overwrite, progress=progress)
    except KeyboardInterrupt as interrupt:
        if not notes_of(interrupt):
            interrupt.add_note("Nothing had been recorded.")
        raise
    if as_json:
        print_json(result.summary)
    elif not quiet:
        if plan.one_component is not None:
            from sinssim.recording.tables.one_component import show
        else:
            from sinssim.recording.tables.run import show

        show(plan, result.summary, console(least_width=120))
        print(f"Report: {directory / 'report.html'}    (in any browser)")
        print(f"View:   {program_name()} view {directory}    (--web: in a browser)")
    if view is not None:
        from sinssim.recording.rerun.viewer import open_viewer

        open_viewer(directory, view=view)
