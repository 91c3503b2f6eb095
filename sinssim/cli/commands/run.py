"""`sinssim run` and `check`: simulates a scenario, or navigates on recorded sensors; checks one and shows its plan."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sinssim.cli.command_line import (
    Debug,
    GradeOption,
    Json,
    OutFolder,
    Quiet,
    Settings,
    Trial,
    command,
    console,
    has_bars,
    notes_of,
    overwrite_option,
    print_json,
    print_places,
    program_name,
    remarks,
    require_option,
    scenario_names,
    starts_programs,
    with_grade,
)
from sinssim.errors import InputError
from sinssim.progress import shown

if TYPE_CHECKING:
    from sinssim.analyses.inspection.inspected_files import Suggestion
    from sinssim.recording.rerun_viewer import LiveViewer
    from sinssim.scenario import Scenario

ScenarioOrFiles = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENARIO | FILE...",
        autocompletion=scenario_names,
        help="A scenario's TOML file, a name from `sinssim list scenarios`, or recorded files: of an IMU and a "
        "receiver, or a track.",
    ),
]
View = Annotated[
    str | None,
    typer.Option(
        "--view", metavar="NAME", help="Open this view afterwards: a name from `sinssim list views`, or a file."
    ),
]
Live = Annotated[bool, typer.Option("--live", help="Open the viewer at once, and fill it while the run is computed.")]
Outages = Annotated[
    list[str] | None,
    typer.Option(
        "--outage",
        metavar="SPAN",
        help="Withhold recorded GNSS fixes: 40:55 from 40 s to 55 s; 15/45 for 15 s every 45 s; 15/45@60 the "
        "same, the first at 60 s; 15/45@30,45,60 with one pass of the filter for each start time, evaluated "
        "together. May be repeated. Only for scenarios with [log].",
    ),
]
Keep = Annotated[
    Literal["summary", "report", "streams", "all"] | None,
    typer.Option(
        "--keep",
        help="Contents of the run directory: scenario and summary; also the report; also every stream as Parquet; "
        "also the recording.",
        show_default="recording.keep: all",
    ),
]
Detail = Annotated[
    Literal["full", "light", "none"] | None,
    typer.Option(
        "--recording",
        help="Streams in the recording: every row, the rows that a screen can show, or no recording.",
        show_default="recording.detail: light",
    ),
]
Require = Annotated[
    list[str] | None,
    require_option(
        'Test a requirement by the errors of this run: "r95(3600 s) <= 1852 m", "tse(run) <= 4 nmi", '
        '"miss(waypoint 3) <= 1 nmi"'
    ),
]


@command
@starts_programs
def run(
    scenario: ScenarioOrFiles,
    out: OutFolder = None,
    settings: Settings = None,
    overwrite: Annotated[bool, overwrite_option("an existing run")] = False,
    grade: GradeOption = None,
    view: View = None,
    live: Live = False,
    outages: Outages = None,
    keep: Keep = None,
    recording: Detail = None,
    require: Require = None,
    trial: Trial = True,
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
    from sinssim.analyses.inspection.inspected_files import are_raw
    from sinssim.statistics.requirements import parse_requirements
    from sinssim.system.files import check_place

    settings, wanted = [*with_grade(settings, grade), *_kept(keep, recording)], parse_requirements(require or ())
    raw = are_raw(scenario)
    if not (raw or trial):
        raise typer.BadParameter("--no-trial is for recorded files, whose suggested scenario it leaves untried; "
                                 f"it would have no effect on the scenario {scenario[0]}")  # fmt: skip
    suggestion = _suggestion(scenario, out, overwrite, trial, has_bars(quiet)) if raw else None
    plan = _plan(scenario, suggestion, settings, outages)
    _check_view(plan, view, live=live)
    directory = out or Path("runs") / plan.name
    check_place(directory.resolve(), overwrite)
    from sinssim.experiments.run.run_execution import run

    with _noted(suggestion, scenario), _viewer(live) as viewer:
        result = run(plan, directory, overwrite=overwrite, require=wanted, progress=has_bars(quiet), viewer=viewer)
        if suggestion is not None:
            _write_suggestion(suggestion, directory, [*settings, *_withheld(outages)])
        if as_json:
            print_json(result.summary)
        elif not quiet:
            _show(result, plan, directory, suggestion, scenario)
        if viewer is not None:
            _leave_open(viewer, directory, remarks(quiet))
    if view is not None:
        from sinssim.recording.rerun_viewer import open_viewer

        open_viewer(directory, view=view)


@contextmanager
def _noted(suggestion: Suggestion | None, files: list[str]) -> Iterator[None]:
    """Add to errors of a run what is left of it, and how a suggested scenario can be changed."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        if not notes_of(interrupt):
            interrupt.add_note("Nothing had been recorded.")
        raise
    except InputError as error:
        if suggestion is not None:
            named = " ".join(files)
            error.add_note(f"`{program_name()} inspect {named} --out FILE` writes the scenario, which you can change.")
        raise


@contextmanager
def _viewer(live: bool) -> Iterator[LiveViewer | None]:
    """Yield a viewer that is open, if it is wanted."""
    if not live:
        yield None
        return
    from sinssim.recording.rerun_viewer import LiveViewer

    with LiveViewer() as viewer:
        yield viewer


def _leave_open(viewer: LiveViewer, directory: Path, tell: Callable[[str], None]) -> None:
    """Leave the viewer open until its window is closed, or tell that it was closed early."""
    again = f"{program_name()} view {directory}"
    if viewer.is_lost:
        tell(f"The viewer was closed, or took nothing any more, while the run was computed; {again} shows all of it.")
        return
    tell(f"The viewer ends with this program: close its window, or press Ctrl-C. {again} shows the run again.")
    viewer.wait()


def _suggestion(files: list[str], out: Path | None, overwrite: bool, trial: bool, bars: bool) -> Suggestion:
    """Return the scenario that recorded files suggest; a place that is taken is refused before they are read."""
    from sinssim.analyses.inspection.inspected_files import suggest
    from sinssim.system.files import check_place

    if out is not None:
        check_place(out.resolve(), overwrite)
    with shown(bars) as progress:
        return suggest([Path(file) for file in files], progress, trial=trial)


def _plan(names: list[str], suggestion: Suggestion | None, settings: list[str], outages: list[str] | None) -> Scenario:
    """Return the scenario of a name or a file, or the suggested one, without the fixes of some outages."""
    plan = _loaded(names, suggestion, settings)
    if not outages:
        return plan
    if not plan.source.recorded:
        from sinssim.errors import InputError

        raise InputError("--outage withholds recorded GNSS fixes ([log]); in a simulation, use aiding.gnss.outages_s.")
    return _loaded(names, suggestion, [*settings, *_withheld(outages)])


def _withheld(outages: list[str] | None) -> list[str]:
    """Return the settings of outages."""
    from sinssim.logs.log_settings import outage_settings

    return outage_settings(outages) if outages else []


def _loaded(names: list[str], suggestion: Suggestion | None, settings: list[str]) -> Scenario:
    from sinssim.scenario import load_scenario

    if suggestion is None:
        return load_scenario(names[0], settings)
    with TemporaryDirectory() as folder:
        _write_suggestion(suggestion, Path(folder), [])
        return load_scenario(_suggested(Path(folder)), settings)


def _suggested(folder: Path) -> Path:
    from sinssim.analyses.inspection.inspected_files import NAME

    return folder / NAME


def _write_suggestion(suggestion: Suggestion, folder: Path, settings: list[str]) -> None:
    from sinssim.scenario.load import with_settings
    from sinssim.system.files import write_text

    write_text(_suggested(folder), with_settings(suggestion.text, settings))


def _check_view(plan: Scenario, view: str | None, *, live: bool) -> None:
    """Raise for a view that does not exist, or of a run without a recording."""
    from sinssim.scenario import find_content

    if view is not None and live:
        raise typer.BadParameter("--live opens the viewer before the run and --view after it; give one of them")
    if not (view is not None or live):
        return
    if not plan.recording.has_recording:
        option = "--live" if live else "--view"
        raise InputError(
            f"{option} shows the recording, but this run keeps none (--keep, --recording; in the scenario "
            'recording.keep, recording.detail): use keep = "all" and detail = "light" or "full".'
        )
    if view is not None:
        find_content("viz", view)


def _show(result: Any, plan: Scenario, directory: Path, suggestion: Suggestion | None, files: list[str]) -> None:
    """Print the tables and sentences of a run, where its files are, and what is doubtful about recorded files."""
    from sinssim.experiments.run.one_component_exhibits import plane_brief
    from sinssim.experiments.run.run_report import brief
    from sinssim.recording.console import show_items

    shown = brief(result, result.summary) if plan.source.in_space else plane_brief(plan, result.summary)
    show_items(shown, console(least_width=120))
    if suggestion is not None:
        place = _suggested(directory)
        print(f"Scenario: {place}    (suggested by `inspect`; {program_name()} run {place} -o DIR repeats the run)")
        if doubts := suggestion.doubts:
            inspect = f"{program_name()} inspect {' '.join(files)}"
            print(f"Doubts:   {len(doubts)} about the files; {inspect} tells all. The first: {doubts[0]}")
    if plan.recording.has_report:
        print_places(directory, plan.recording.has_recording)
    else:
        print(f"Summary: {directory / 'summary.json'}")


def _kept(keep: str | None, recording: str | None) -> list[str]:
    """Return the settings of a scenario that the options stand for."""
    if keep not in (None, "all") and recording not in (None, "none"):
        raise typer.BadParameter(
            f"--keep {keep} keeps no recording, so that --recording {recording} would have no effect; give one of them"
        )
    return [f'recording.{key}="{value}"' for key, value in (("keep", keep), ("detail", recording)) if value is not None]


ScenarioFile = Annotated[
    str | None,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=scenario_names,
        help="Path of a TOML file, or a name from `sinssim list scenarios`.",
    ),
]
Plot = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help="Draw the plan: map, height, speed (.png, .svg, .pdf).")
]
Keys = Annotated[
    str | None,
    typer.Option(
        "--keys",
        metavar="TABLE",
        help="Show the keys of a table with default, limits and meaning instead, or those with a common beginning: "
        "imu, flight.legs, imu.gyro_bias.",
    ),
]


@command
def check(
    scenario: ScenarioFile = None,
    settings: Settings = None,
    grade: GradeOption = None,
    as_json: Json = False,
    plot: Plot = None,
    keys: Keys = None,
    debug: Debug = False,
) -> None:
    """Check a scenario without a simulation, and show its plan.

    Checks the file, the aircraft, all legs and all names. If there are mistakes, the command lists all of them and
    exits with code 2.

    Examples:

        sinssim check my_flight.toml --set flight.aircraft=f16
        sinssim check my_flight.toml --grade my_unit.toml
        sinssim check my_flight.toml --plot plan.png
        sinssim check --keys imu.gyro_bias
    """
    if keys is not None:
        from sinssim.scenario.schema import keys_under, toml_lines

        print("\n".join(line for table in keys_under(keys) for line in toml_lines(table)).rstrip())
        return
    if scenario is None:
        from sinssim.errors import InputError

        raise InputError("give a scenario to check, or --keys TABLE for the keys that a table may have.")
    from sinssim.scenario import load_scenario

    if plot is not None:
        from sinssim.recording.figures import check_format

        check_format(plot)
    plan = load_scenario(scenario, with_grade(settings, grade))
    if plot is not None and (plan.source.recorded or not plan.source.in_space):
        from sinssim.experiments.run.motion_exhibits import plan_of

        plan_of(plan)  # raises: there is no plan to draw
    if plan.source.recorded:
        _check_log(plan, as_json)
        return
    resolved, lines = checked(plan)
    if as_json:
        from sinssim.scenario.planned_limits import expected_duration

        print_json({"expected_duration_s": round(expected_duration(plan)), "scenario": resolved.as_written()})
    else:
        print("\n".join(lines))
    if plot is not None:
        from sinssim.experiments.run.motion_exhibits import plan_charts
        from sinssim.recording.figures import figure_of, save

        save(figure_of(plan_charts(plan)), plot)
        if not as_json:
            print(f"plot        {plot}")


def checked(plan: Scenario) -> tuple[Scenario, list[str]]:
    """Check a scenario with simulated sensors; return it with the states of its filter, and the lines of its plan."""
    from sinssim.scenario.plan_summary import plan_lines
    from sinssim.scenario.planned_limits import check_limits, check_route, check_times

    check_times(plan)
    check_route(plan)
    if plan.use:
        from sinssim.strapdown.engine_assembly import check_own_files

        check_own_files(plan.navigation.algorithms, plan.navigation.frame)
    if plan.navigator:
        from sinssim.simulation.foreign_navigator import check_programs

        check_programs(plan, to_start=False)
    check_limits(plan)
    if plan.flight is not None:
        from sinssim.truth.flight.jsbsim_model import check_fuel

        check_fuel(plan.flight)
    resolved, about_filter = plan, list[str]()
    if plan.filter is not None:
        from sinssim.scenario import filter_model as filter_states
        from sinssim.scenario.run_memory import check_memory

        resolved = filter_states.with_states(plan)
        check_memory(resolved)
        about_filter = [*filter_states.choice(plan), *(f"note        {note}" for note in filter_states.notes(plan))]
    return resolved, [*plan_lines(resolved), *about_filter]


def _check_log(plan: Scenario, as_json: bool) -> None:
    """Read the files of a scenario with recorded sensors, and show what they hold and what follows from them."""
    from sinssim.scenario import filter_model as filter_states
    from sinssim.scenario.plan_summary import plan_lines
    from sinssim.scenario.planned_limits import expected_duration
    from sinssim.scenario.run_memory import check_memory
    from sinssim.simulation.recorded_filter_run import prepare

    prepared = prepare(plan)
    log, resolved = prepared.log, prepared.scenario
    check_memory(resolved, of_log=log.rates)
    notes = [*log.notes, prepared.start.words]
    if as_json:
        duration = expected_duration(resolved)
        print_json({"expected_duration_s": round(duration), "notes": notes, "scenario": resolved.as_written()})
        return
    print("\n".join(plan_lines(resolved)))
    for name, rate in log.rates.items():
        print(f"recorded    {name}, {rate:.4g} Hz")
    if plan.filter is not None:
        print("\n".join(filter_states.choice(plan, prepared.moved)))
    print("\n".join(f"note        {sentence}" for sentence in notes))
