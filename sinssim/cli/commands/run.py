"""`sinssim run`: simulates one scenario, or navigates on recorded sensors, and writes a run directory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from sinssim.cli.options import Debug, GradeOption, Json, OutFolder, Quiet, ScenarioName, Settings, with_grade
from sinssim.cli.terminal import console, notes_of, print_json, program_name, stage_bars

Keep = Literal["summary", "report", "streams", "all"]
Detail = Literal["full", "light", "none"]


def command(
    scenario: ScenarioName,
    out: OutFolder = None,
    settings: Settings = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing run; your own files are kept.")
    ] = False,
    grade: GradeOption = None,
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
            help="Withhold recorded GNSS fixes: 40:55 from 40 s to 55 s; 15/45 for 15 s every 45 s; 15/45@60 the "
            "same, the first at 60 s; 15/45@30,45,60 with one pass of the filter for each start time, evaluated "
            "together. May be repeated. Only for scenarios with [log].",
        ),
    ] = None,
    keep: Annotated[
        Keep | None,
        typer.Option(
            "--keep",
            help="Contents of the run directory: scenario and summary; also the report; also every stream as Parquet; "
            "also the recording.",
            show_default="recording.keep: all",
        ),
    ] = None,
    recording: Annotated[
        Detail | None,
        typer.Option(
            "--recording",
            help="Streams in the recording: every row, the rows that a screen can show, or no recording.",
            show_default="recording.detail: light",
        ),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Simulate one scenario: motion, sensors, navigation and recording.

    Writes a run directory with a report (report.html, self-contained), the recording (recording.rrd), every stream as
    Parquet (streams/), the error statistics (summary.json) and the scenario with all default values (scenario.toml). A
    flight that was computed before is taken from the cache.

    Examples:

        sinssim run first_flight
        sinssim run my_flight.toml -o runs/tactical --set imu.grade=tactical --set seed=3
        sinssim run first_flight --grade my_unit.toml
        sinssim run my_drive.toml --outage 15/45
        sinssim run first_flight --keep report
    """
    from sinssim.errors import InputError
    from sinssim.scenario import find_content, load_scenario
    from sinssim.scenario.outages import outage_settings

    settings = [*with_grade(settings, grade), *_kept(keep, recording)]
    plan = load_scenario(scenario, settings)
    if outages:
        if plan.log is None:
            raise InputError(
                "--outage withholds recorded GNSS fixes ([log]); in a simulation, use aiding.gnss.outages_s."
            )
        plan = load_scenario(scenario, [*settings, *outage_settings(outages)])
    if view is not None:
        if not plan.recording.has_recording:
            raise InputError(
                "--view shows the recording, but this run keeps none (--keep, --recording; in the scenario "
                'recording.keep, recording.detail): use keep = "all" and detail = "light" or "full".'
            )
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
        if plan.recording.has_report:
            print(f"Report: {directory / 'report.html'}    (in any browser)")
        else:
            print(f"Summary: {directory / 'summary.json'}")
        if plan.recording.has_recording:
            print(f"View:   {program_name()} view {directory}    (--web: in a browser)")
    if view is not None:
        from sinssim.recording.rerun.viewer import open_viewer

        open_viewer(directory, view=view)


def _kept(keep: str | None, recording: str | None) -> list[str]:
    """Return the settings of a scenario that the options stand for."""
    if keep not in (None, "all") and recording not in (None, "none"):
        raise typer.BadParameter(
            f"--keep {keep} keeps no recording, so that --recording {recording} would have no effect; give one of them"
        )
    return [f'recording.{key}="{value}"' for key, value in (("keep", keep), ("detail", recording)) if value is not None]
