"""`sinssim view`, `runs`, `compare-runs`, `export`, `score`, `stream` and `workbench`: what is done with finished runs.

The workbench is a page that edits scenarios, starts commands and shows their results.
"""

from __future__ import annotations

import math
import os
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sinssim.cli.command_line import (
    Debug,
    Json,
    OutFolder,
    Quiet,
    RunFolder,
    Settings,
    command,
    console,
    has_bars,
    print_json,
    remarks,
    scenario_names,
    start_option,
    starts_programs,
)
from sinssim.errors import InputError
from sinssim.logs.formats import WRITERS

if TYPE_CHECKING:
    from sinssim.experiments.run.stream_packets import Streamed
    from sinssim.logs.solution_score import Judge, Score

_LATEST = 9e9
"""Time that a recording can have, s: it counts nanoseconds in 64 bits."""


@command
def view(
    run_or_recording: Annotated[Path, typer.Argument(metavar="DIR_OR_RRD", help="A run directory or a recording.")],
    name: Annotated[
        str | None,
        typer.Option("--view", metavar="NAME", help="View to show first: a name from `sinssim list views`, or a file."),
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Show it in a browser, served to this machine only.")] = False,
    screenshot: Annotated[
        Path | None,
        typer.Option("--screenshot", metavar="FILE", help="Write a picture (PNG) instead of opening a window."),
    ] = None,
    time_s: Annotated[
        float | None,
        typer.Option(
            "--time", metavar="S", help="Time of the run to show.", show_default="the start; of a picture, the middle"
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Show a run in the Rerun viewer or in a browser, or write a picture.

    The viewer opens in a window unless --web or --screenshot is given.

    Examples:

        sinssim view runs/first_flight --view navigation
        sinssim view runs/first_flight --web
        sinssim view runs/first_flight --view sensors --screenshot sensors.png
        sinssim view runs/first_flight --time 1234
    """
    if time_s is not None and not abs(time_s) < _LATEST:
        raise typer.BadParameter(f"--time {time_s:g} is no time of a run; give seconds, less than {_LATEST:g}")
    if web and screenshot is not None:
        raise typer.BadParameter("--web and --screenshot exclude each other; give one of them")
    from sinssim.recording import rerun_viewer

    if screenshot is not None:
        rerun_viewer.screenshot(run_or_recording, screenshot, view=name, time_s=time_s)
    elif web:
        rerun_viewer.serve(run_or_recording, view=name, time_s=time_s)
    else:
        rerun_viewer.open_viewer(run_or_recording, view=name, time_s=time_s)


@command
def runs(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder with runs.")] = Path("runs"),
    html: Annotated[
        bool, typer.Option("--html", help="Write the list with the runs' curves to DIR/runs.html.")
    ] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List the runs, ensembles, studies and budgets in a folder, the newest first.

    The list shows the scenario, the size and the date. For a run it also shows the rms horizontal error of the aided
    solution, or else of the first algorithm. On the page that --html writes, the curves of runs, ensembles and budgets
    are chosen and drawn on the same axes.

    Examples:

        sinssim runs
        sinssim runs results/2026 --json
        sinssim runs --html
    """
    from sinssim.experiments.run.finished_runs import runs_in

    entries = runs_in(folder)
    if html:
        from sinssim.experiments.run.run_comparison import write_list

        place = write_list(entries, folder)
        if not as_json:
            print(f"Page: {place}    (in any browser)")
            return
    if as_json:
        print_json(
            [
                {**vars(entry), "path": str(entry.path), "date": entry.date.isoformat(timespec="seconds")}
                for entry in entries
            ]
        )
        return
    from sinssim.experiments.run.run_comparison import list_exhibits
    from sinssim.recording.console import show_items

    show_items(list_exhibits(entries, folder), console(least_width=110))


@command
def compare_runs(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Directories of runs, ensembles and budgets.")],
    solution: Annotated[
        str | None,
        typer.Option(
            "--solution",
            metavar="NAME",
            help="Solution that all runs have: an algorithm, aided, backward or smoothed.",
            show_default="of each run the aided one, or else the first algorithm",
        ),
    ] = None,
    out: OutFolder = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing comparison.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Compare finished runs: tables of their errors, errors on common axes, and the keys that differ.

    The runs may be of different scenarios; their errors are compared at the same times. On the page, the curves of all
    their solutions, of scored ones, of ensembles and of budgets are chosen. Writes report.html and comparison.json to
    runs/compare-A-B.

    Examples:

        sinssim compare-runs runs/first_flight runs/tactical
        sinssim compare-runs runs/gnss runs/gnss_baro --solution aided -o runs/with_and_without_baro
    """
    from sinssim.experiments.run.run_comparison import compare_runs, write_comparison

    compared = compare_runs(runs, solution)
    target = out or Path("runs") / ("compare-" + "-".join(path.resolve().name for path in runs))[:120]

    contents, place = write_comparison(compared, target, overwrite=overwrite)
    if as_json:
        print_json(contents)
    elif not quiet:
        from sinssim.experiments.run.run_comparison import comparison_exhibits
        from sinssim.recording.console import show

        show(comparison_exhibits(compared), console(least_width=110))
        print(f"Report: {place / 'report.html'}    (in any browser)")


To = Annotated[str, typer.Option("--to", metavar="FORMAT", help=f"{', '.join(WRITERS)}; see `sinssim list exports`.")]
ExportPlace = Annotated[
    Path | None,
    typer.Option(
        "--out",
        "-o",
        metavar="FILE",
        help="The file, or the folder if the format has several files.",
        show_default="next to the run",
    ),
]
ExportedSolutions = Annotated[
    list[str] | None,
    typer.Option(
        "--solution",
        metavar="NAME",
        help="Exported solution: truth, an algorithm, aided, backward, smoothed, or a GNSS receiver such as gnss; "
        "and measured, ideal or compensated for the inertial data. May be given twice.",
        show_default="truth, measured",
    ),
]
Rate = Annotated[
    float | None,
    typer.Option("--rate", metavar="HZ", help="Largest sampling rate of the solution.", show_default="all"),
]
Outages = Annotated[
    list[str] | None,
    typer.Option(
        "--outage",
        metavar="SPAN",
        help="Withhold GNSS fixes: 40:55 from 40 s to 55 s; 15/45 for 15 s every 45 s; 15/45@60 the same, the "
        "first at 60 s. May be repeated.",
    ),
]


@command
def export(
    run: RunFolder,
    to: To,
    out: ExportPlace = None,
    solution: ExportedSolutions = None,
    start: Annotated[str | None, start_option("Date of time 0 of the run, UTC.")] = None,
    rate: Rate = None,
    outages: Outages = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Write a run in a format of another program: sensor data, fixes, truth and solutions.

    The output lists the file of each stream with its units, axes and clock. The simulated time of a run begins at 0;
    --start gives the date of this time.

    Another navigation program can be tested on the exported data; `sinssim score` computes the errors of its solution.

    Examples:

        sinssim export runs/first_flight --to kml
        sinssim export runs/mems_uav --to kf-gins -o kf_gins_input
        sinssim export runs/mems_uav --to kf-gins -o gaps --outage 15/45@60
        sinssim export runs/mems_uav --to sbet --solution aided --solution ideal
    """
    from sinssim.logs.formats.export_streams import export

    done = export(
        run, to, out, solution=solution or [], start=start, rate_hz=rate, outages=outages or (), overwrite=overwrite
    )
    if as_json:
        print_json({"place": str(done.place), "files": [str(f) for f in done.files], "contents": list(done.sentences)})
    elif not quiet:
        print(f"{done.place}")
        for sentence in done.sentences:
            print(f"  {sentence}")


SolutionFiles = Annotated[
    list[Path], typer.Argument(metavar="SOLUTION", help="Files of solutions; formats: `sinssim list formats`.")
]
Names = Annotated[
    list[str] | None,
    typer.Option("--name", metavar="NAME", help="Name of each solution, in order.", show_default="the file's name"),
]
Seconds = Annotated[
    list[float] | None, typer.Option("--time-s", metavar="S", help="Computing time of each solution, s.")
]
Format = Annotated[
    str | None,
    typer.Option("--format", metavar="FORMAT", help="Format of the files.", show_default="found from the file"),
]
Antenna = Annotated[
    str | None,
    typer.Option(
        "--antenna",
        metavar="NAME",
        help="GNSS receiver, such as gnss, to whose antenna the positions refer.",
        show_default="the sensor block",
    ),
]


@command
def score(
    run: RunFolder,
    solutions: SolutionFiles,
    names: Names = None,
    seconds: Seconds = None,
    format_name: Format = None,
    antenna: Antenna = None,
    start: Annotated[str | None, start_option("Date of the run's time 0 in the export, UTC.")] = None,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Score solutions that other navigation programs computed from the exported data of a run.

    Each solution is treated as a further algorithm of the run: its errors in position, velocity and attitude are
    computed, and a table, plots and a ranking compare it with the algorithms of the run. Quantities that a solution
    lacks are not scored. The results are in RUN/scores; other files of the run do not change.

    Examples:

        sinssim export runs/mems_uav --to csv -o readings
        sinssim score runs/mems_uav mine.csv --name mine --time-s 3.2
        sinssim score runs/mems_uav KF_GINS_Navresult.nav rtk.pos
    """
    from sinssim.experiments.run.run_scores import check_names
    from sinssim.logs.formats.export_streams import date_of_run
    from sinssim.logs.solution_score import Judge
    from sinssim.logs.stored_run import RecordedRun

    for option, given in (("--name", names), ("--time-s", seconds)):
        if given and len(given) != len(solutions):
            raise InputError(f"{option} is given {len(given)} times for {len(solutions)} solutions; give one for each.")
    if any(not 0.0 < value < 1e9 for value in seconds or ()):
        raise InputError("--time-s: the time must be positive, in seconds.")
    recorded = RecordedRun(run)
    judge = Judge(recorded, date_of_run(recorded, start))
    called = names or [path.stem for path in solutions]
    check_names(judge, called)
    times: list[float | None] = [*seconds] if seconds else [None] * len(solutions)
    scores = [
        judge.score(path, name=name, format_name=format_name, antenna=antenna, seconds=time)
        for path, name, time in zip(solutions, called, times, strict=True)
    ]
    _write_scores(judge, scores, quiet=quiet, as_json=as_json)


def _write_scores(judge: Judge, scores: list[Score], *, quiet: bool, as_json: bool) -> None:
    """Write the scores beside the run, and print them."""
    from sinssim.experiments.run.run_scores import Scored, score_exhibits, to_json, write_scores
    from sinssim.logs.solution_score import common_span

    span = common_span(scores)
    errors = {**judge.run_errors(span), **{score.name: score.error for score in scores}}
    scored = Scored(judge, scores, errors, span)
    place = write_scores(scored)
    if as_json:
        numbers = {name: scored.numbers[name] for name in errors}
        print_json({"errors": numbers, "scores": [to_json(score, span) for score in scores], "report": str(place)})
    elif not quiet:
        from sinssim.recording.console import show

        show(score_exhibits(scored), console(least_width=110))
        print(f"Report: {place}\nCurves and map: sinssim view {place.parent}")


ScenarioOrRun = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO | RUN",
        autocompletion=scenario_names,
        help="A scenario's TOML file, a name from `sinssim list scenarios`, or a run directory.",
    ),
]
Receiver = Annotated[
    str, typer.Option("--to", metavar="PLACE", help="udp://HOST:PORT, tcp://HOST:PORT, or pty: for a new terminal.")
]
Form = Annotated[Literal["mavlink", "json", "nmea", "binary"], typer.Option("--as", help="Form of the packets.")]
Pace = Annotated[
    str, typer.Option("--pace", metavar="N|max", help="Run time over the clock's time; max sends without waiting.")
]
Listen = Annotated[
    str | None,
    typer.Option("--listen", metavar="PLACE", help="Score the solutions that arrive at udp:// or tcp://HOST:PORT."),
]
Network = Annotated[bool, typer.Option("--allow-network", help="Allow places that are not on this machine.")]
Guide = Annotated[bool, typer.Option("--guide", help="Fly by the solutions that arrive, while it is flown.")]
LargestRate = Annotated[
    float | None,
    typer.Option("--rate", metavar="HZ", help="Largest rate of the inertial samples.", show_default="all"),
]


@command
@starts_programs
def stream(
    scenario: ScenarioOrRun,
    to: Receiver,
    form: Form,
    pace: Pace = "1",
    listen: Listen = None,
    guide: Guide = False,
    network: Network = False,
    rate: LargestRate = None,
    start: Annotated[str | None, start_option("Date of time 0 of the run, UTC.")] = None,
    settings: Settings = None,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Send what the sensors of a run would send, at the pace of the clock.

    A bench, a ground station, a flight controller in simulation or a navigator receives it: as MAVLink, lines of JSON,
    NMEA, or the binary protocol with navigators. A scenario is computed first. Ctrl-C ends it.

    Only places on this machine are used, unless --allow-network is given.

    Examples:

        sinssim stream runs/mems_uav --to udp://127.0.0.1:14550 --as mavlink --pace max
        sinssim stream runs/mems_uav --to pty: --as nmea --pace max
        sinssim stream parked --to udp://127.0.0.1:5005 --as json --pace max --set parked.duration_s=60
        sinssim stream my_flight.toml --to tcp://127.0.0.1:5005 --as binary --listen tcp://127.0.0.1:5005 --guide
    """
    from sinssim.experiments.run.paced_stream import exchange, pace_of, place_of
    from sinssim.experiments.run.stream_packets import FORMS, computed, live_packets, live_scenario, readings_of

    place = place_of(to, "--to", ("udp", "tcp", "pty"), allow_network=network)
    heard = None if listen is None else place_of(listen, "--listen", ("udp", "tcp"), allow_network=network)
    factor = pace_of(pace)

    def opened(device: str) -> None:
        print(f"Terminal: {device}", file=sys.stderr if as_json else sys.stdout, flush=True)

    with ExitStack() as stack:
        if guide:
            from sinssim.simulation.guided_passes import LiveFlight

            flight = LiveFlight(live_scenario(scenario, settings or (), form, rate, listens=heard is not None))
            packets = partial(live_packets, stack.enter_context(flight), start, math.isfinite(factor))
            remarks(quiet)(f"{flight.scenario.name} goes to {place}, and flies by the answers; Ctrl-C ends it.")
            tally, answers = exchange(packets, place, heard, factor, opened)
        else:
            sent = stack.enter_context(readings_of(scenario, settings or (), start, rate, progress=has_bars(quiet)))
            remarks(quiet)(f"{sent.run.name} goes to {place} as {form}, {sent.duration:g} s; Ctrl-C ends it.")
            tally, answers = exchange(FORMS[form](sent, factor), place, heard, factor, opened)
        if not (as_json or quiet):
            print(tally)
        numbers = tally.numbers
        if guide and not tally.interrupted:
            sent = stack.enter_context(computed(flight.scenario, start, flown=flight.log))
        if heard is not None and ((answers and not guide) or not tally.interrupted):
            numbers["answers"] = _scored_answers(sent, answers, quiet=quiet or as_json)
    if as_json:
        print_json(numbers)
    if tally.interrupted:
        interrupt = KeyboardInterrupt()
        interrupt.add_note(str(tally) if as_json or quiet else "The rest was not sent.")
        raise interrupt


def _scored_answers(sent: Streamed, answers: list[bytes], *, quiet: bool) -> dict[str, Any]:
    """Return the numbers of a navigator's solutions, and print its errors beside those of the run's own."""
    from sinssim.experiments.run.paced_stream import scored
    from sinssim.experiments.run.run_scores import score_exhibits, to_json
    from sinssim.logs.solution_score import Judge

    result, faults = scored(Judge(sent.run, sent.content.start_gps_s), answers)
    if not quiet:
        from sinssim.recording.console import show

        show(score_exhibits(result), console(least_width=110))
        if faults:
            print(f"{len(faults)} answers could not be used; the first: {faults[0]}")
    return {**to_json(result.scores[0], result.span), "left_out": len(faults)}


@command
def workbench(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="A folder with scenarios; results go to its runs.")
    ] = Path("."),
    port: Annotated[
        int | None, typer.Option("--port", metavar="N", min=1, max=65535, help="Port.", show_default="a free one")
    ] = None,
    debug: Debug = False,
) -> None:
    """Work on the scenarios of a folder in a browser, on a page that is served to this machine only.

    The page lists the scenarios of the folder and the shipped ones, checks a text while it is written, completes its
    keys, draws the plan, starts runs, ensembles and budgets, and lists what has finished with reports and views.
    Everything that it makes is a file that the other commands make, too: runs are in FOLDER/runs. Ctrl-C ends the page
    and the commands that it has started. Needs the extra `workbench`.

    Example:

        sinssim workbench my_project
    """

    from sinssim.cli.workbench_server import serve

    try:
        os.chdir(folder)  # names and paths are then those of the commands that it starts there
    except OSError as error:
        raise InputError(f"{folder} is no folder that can be opened: {error.strerror}.") from error
    serve(Path.cwd(), port or 0, ready=lambda address: print(f"Open {address}\nStop with Ctrl-C.", flush=True))
