"""`sinssim run`: simulates one scenario, or navigates on recorded sensors, and writes a run directory."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sinssim.cli.options import Debug, GradeOption, Json, OutFolder, Quiet, Settings, scenario_names, with_grade
from sinssim.cli.terminal import console, has_bars, notes_of, print_json, program_name

if TYPE_CHECKING:
    from sinssim.analyses.inspection.inspected_files import Suggestion
    from sinssim.scenario import Scenario

Keep = Literal["summary", "report", "streams", "all"]
Detail = Literal["full", "light", "none"]


def command(
    scenario: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO | FILE...",
            autocompletion=scenario_names,
            help="A scenario's TOML file, a name from `sinssim list scenarios`, or recorded files: of an IMU and a "
            "receiver, or a track.",
            show_default=False,
        ),
    ],
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

    Recorded files are run with the scenario that `sinssim inspect` suggests: inertial data with fixes are navigated and
    filtered, and a file of fixes or of a solution is the track of a simulated IMU. The run directory then contains the
    scenario as suggested.toml.

    Examples:

        sinssim run first_flight
        sinssim run my_flight.toml -o runs/tactical --set imu.grade=tactical --set seed=3
        sinssim run first_flight --grade my_unit.toml
        sinssim run my_drive.toml --outage 15/45
        sinssim run imu.csv gnss.pos
        sinssim run drive.gpx -o runs/drive
        sinssim run first_flight --keep report
    """
    from sinssim.analyses.inspection.inspected_files import NAME, are_raw
    from sinssim.errors import InputError
    from sinssim.logs.gnss_outages import outage_settings
    from sinssim.scenario import find_content
    from sinssim.system.outputs import check_place

    settings = [*with_grade(settings, grade), *_kept(keep, recording)]
    suggestion = _suggestion(scenario, out, overwrite) if are_raw(scenario) else None
    plan = _plan(scenario, suggestion, settings)
    if outages:
        if not plan.source.recorded:
            raise InputError(
                "--outage withholds recorded GNSS fixes ([log]); in a simulation, use aiding.gnss.outages_s."
            )
        plan = _plan(scenario, suggestion, [*settings, *outage_settings(outages)])
    if view is not None:
        if not plan.recording.has_recording:
            raise InputError(
                "--view shows the recording, but this run keeps none (--keep, --recording; in the scenario "
                'recording.keep, recording.detail): use keep = "all" and detail = "light" or "full".'
            )
        find_content("viz", view)
    directory = out or Path("runs") / plan.name
    check_place(directory.resolve(), overwrite)
    from sinssim.experiments.run.execute import run
    from sinssim.system.outputs import write_text

    try:
        result = run(plan, directory, overwrite=overwrite, progress=has_bars(quiet))
    except KeyboardInterrupt as interrupt:
        if not notes_of(interrupt):
            interrupt.add_note("Nothing had been recorded.")
        raise
    except InputError as error:
        if suggestion is not None:
            files = " ".join(scenario)
            error.add_note(f"`{program_name()} inspect {files} --out FILE` writes the scenario, which you can change.")
        raise
    if suggestion is not None:
        write_text(directory / NAME, suggestion.text)
    if as_json:
        print_json(result.summary)
    elif not quiet:
        _show(result, plan)
        if suggestion is not None:
            _tell(suggestion, directory / NAME, scenario)
        if plan.recording.has_report:
            print(f"Report: {directory / 'report.html'}    (in any browser)")
        else:
            print(f"Summary: {directory / 'summary.json'}")
        if plan.recording.has_recording:
            print(f"View:   {program_name()} view {directory}    (--web: in a browser)")
    if view is not None:
        from sinssim.recording.rerun.viewer import open_viewer

        open_viewer(directory, view=view)


def _show(result: Any, plan: Scenario) -> None:
    """Print the tables and sentences of a run."""
    from sinssim.experiments.run import error_exhibits as run_table
    from sinssim.experiments.run import one_component_exhibits as one_component_table

    show = run_table.show if plan.source.in_space else one_component_table.show
    show(result, console(least_width=120))


def _suggestion(files: list[str], out: Path | None, overwrite: bool) -> Suggestion:
    """Return the scenario that recorded files suggest; a place that is taken is told before they are read."""
    from sinssim.analyses.inspection.inspected_files import suggest
    from sinssim.system.outputs import check_place

    if out is not None:
        check_place(out.resolve(), overwrite)
    return suggest([Path(file) for file in files])


def _plan(names: list[str], suggestion: Suggestion | None, settings: list[str]) -> Scenario:
    """Return the scenario of a name or a file, or the suggested one."""
    from sinssim.analyses.inspection.inspected_files import NAME
    from sinssim.scenario import load_scenario

    if suggestion is None:
        return load_scenario(names[0], settings)
    with TemporaryDirectory() as folder:
        file = Path(folder) / NAME
        file.write_text(suggestion.text, encoding="utf-8")
        return load_scenario(file, settings)


def _tell(suggestion: Suggestion, place: Path, files: list[str]) -> None:
    """Print where the suggested scenario is, and what is doubtful about the files."""
    print(f"Scenario: {place}    (suggested by `inspect`; {program_name()} run {place} -o DIR repeats the run)")
    if suggestion.doubts:
        count = len(suggestion.doubts)
        print(
            f"Doubts:   {count} about the files; {program_name()} inspect {' '.join(files)} tells all. The first: "
            f"{suggestion.doubts[0]}"
        )


def _kept(keep: str | None, recording: str | None) -> list[str]:
    """Return the settings of a scenario that the options stand for."""
    if keep not in (None, "all") and recording not in (None, "none"):
        raise typer.BadParameter(
            f"--keep {keep} keeps no recording, so that --recording {recording} would have no effect; give one of them"
        )
    return [f'recording.{key}="{value}"' for key, value in (("keep", keep), ("detail", recording)) if value is not None]
