"""The command line: run, check, view, list. What it does is done elsewhere; here it is asked for and shown."""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from sinssim import __version__
from sinssim.errors import SinssimError
from sinssim.interrupt import interruptible

if TYPE_CHECKING:
    from sinssim.scenario.content import Kind as ContentKind
    from sinssim.simulation import RunResult

app = typer.Typer(
    name="sinssim",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 the run failed, 2 bad input, 130 interrupted.",
)

_debug = False


def _set_debug(value: bool) -> bool:
    global _debug
    _debug = _debug or value
    return value


def _print_version(value: bool) -> None:
    if value:
        print(f"sinssim {__version__}")
        raise typer.Exit


ScenarioArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="A scenario's TOML file, or the name of one that `sinssim list scenarios` shows.",
        show_default=False,
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the scenario; may be given several times. Keys are paths with dots, legs are "
        "counted from 1: `--set imu.grade=tactical --set flight.legs.2.altitude_m=9000`.",
        show_default=False,
    ),
]
ColumnsOption = Annotated[
    Path | None,
    typer.Option(
        "--columns",
        metavar="FILE",
        help="TOML file that names a log's columns, units and axes.",
        show_default="the columns of imu_measured.parquet",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")]
DebugOption = Annotated[
    bool, typer.Option("--debug", callback=_set_debug, help="Show Python's traceback with an error.")
]


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Simulate strapdown inertial navigation from end to end.

    JSBSim flies an aircraft along a flight plan, an inertial measurement unit with the errors of its grade senses
    the flight, navigation algorithms compute where they think they are, and everything goes into one Rerun
    recording.

    Aiding sensors and a Kalman filter are a scenario's option: see `sinssim run aided_airliner`.

    Begin with `sinssim run first_flight`, then `sinssim view runs/first_flight`.
    """


@app.command()
def run(
    scenario: ScenarioArgument,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Run directory to write.", show_default="runs/<name>"),
    ] = None,
    settings: SetOption = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run directory if it exists.")] = False,
    view: Annotated[
        str | None,
        typer.Option("--view", metavar="NAME", help="Open this view when done; see `sinssim list views`."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Fly, sense, navigate and record one scenario.

    Writes a run directory with a report (report.html, which needs nothing else), the recording (recording.rrd),
    every stream as Parquet (streams/), the errors in numbers (summary.json) and the scenario with all its defaults
    (scenario.toml). A flight that was flown before is taken from the cache.

    Examples:

        sinssim run first_flight
        sinssim run my_flight.toml -o runs/tactical --set imu.grade=tactical --set seed=3
    """
    from sinssim.scenario import find_content, load_scenario

    plan = load_scenario(scenario, settings or ())
    if view is not None:
        find_content("viz", view)
    directory = out or Path("runs") / plan.name
    from sinssim.simulation import run as run_scenario

    try:
        with _progress(show=not quiet) as progress:
            result = run_scenario(plan, directory, overwrite=overwrite, progress=progress)
    except KeyboardInterrupt as interrupt:
        if not _notes(interrupt):
            interrupt.add_note("Nothing had been recorded yet.")
        raise
    if as_json:
        print(json.dumps(result.summary, indent=2))
    elif not quiet:
        _show_result(result, directory)
    if view is not None:
        from sinssim.recording.viewer import open_viewer

        open_viewer(directory, view=view)


@app.command()
def compare(
    study: Annotated[
        str,
        typer.Argument(
            metavar="STUDY",
            help="A study's TOML file, or the name of one that `sinssim list studies` shows.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Directory to write.", show_default="runs/<name>"),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Replace a value of the study; may be given several times. Parts and motions are counted from 1: "
            '`--set parts.1.rates_hz="[50.0, 100.0]"`.',
            show_default=False,
        ),
    ] = None,
    limit_minutes: Annotated[
        float, typer.Option("--limit-minutes", min=0.0, help="Refuse a study that would take longer than this.")
    ] = 30.0,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the directory's study if it exists.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Compare algorithms, rates, frames and sensors on identical samples, and report which to pick.

    Writes a directory with the report (report.html, which needs nothing else), every result as numbers
    (results.json, results.parquet), a recording for the view *comparison* (recording.rrd), and the study with all
    its defaults (study.toml). Ctrl-C leaves a report of what was done until then.

    Examples:

        sinssim compare coning
        sinssim compare my_study.toml -o runs/mine --set seed=3
    """
    from sinssim.studies.load import load_study

    plan = load_study(study, settings or ())
    directory = out or Path("runs") / plan.name
    from sinssim.studies.compare import compare as compare_algorithms

    def say(text: str) -> None:
        if not quiet:
            typer.echo(text, err=True)

    try:
        with _one_bar(show=not quiet) as progress:
            comparison = compare_algorithms(
                plan, directory, overwrite=overwrite, limit_minutes=limit_minutes, progress=progress, say=say
            )
    except KeyboardInterrupt as interrupt:
        if not _notes(interrupt):
            interrupt.add_note("Nothing had been done yet.")
        raise
    if as_json:
        from sinssim.studies.write import results

        print(json.dumps(results(comparison), indent=2, ensure_ascii=False))
    elif not quiet:
        from rich.console import Console

        from sinssim.studies.report import show

        show(comparison, Console(highlight=False))
        print(f"Report: {directory / 'report.html'}    Look at it: {_command()} view {directory}")


@app.command()
def check(
    scenario: ScenarioArgument, settings: SetOption = None, as_json: JsonOption = False, debug: DebugOption = False
) -> None:
    """Check a scenario without flying it, and show its plan.

    Checks everything that can be known beforehand: the file, the aircraft, every leg, every name. Exit code 2 if
    something is wrong, with every mistake listed.

    Example:

        sinssim check my_flight.toml --set flight.aircraft=f16
    """
    from sinssim.scenario import load_scenario
    from sinssim.scenario.duration import check_times, expected_duration
    from sinssim.scenario.summary import plan_lines

    plan = load_scenario(scenario, settings or ())
    if as_json:
        check_times(plan)
        duration = expected_duration(plan)
        print(json.dumps({"expected_duration_s": round(duration), "scenario": plan.model_dump()}, indent=2))
    else:
        print("\n".join(plan_lines(plan)))


@app.command()
def view(
    run_or_recording: Annotated[
        Path, typer.Argument(metavar="DIR_OR_RRD", help="A run directory or a recording.", show_default=False)
    ],
    name: Annotated[
        str | None,
        typer.Option("--view", metavar="NAME", help="View to show first; see `sinssim list views`."),
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Show it in a browser, served to this machine only.")] = False,
    screenshot: Annotated[
        Path | None, typer.Option("--screenshot", metavar="FILE", help="Write a picture (PNG) and open no window.")
    ] = None,
    debug: DebugOption = False,
) -> None:
    """Look at a run.

    Examples:

        sinssim view runs/first_flight --view navigation
        sinssim view runs/first_flight --web
        sinssim view runs/first_flight --view sensors --screenshot sensors.png
    """
    if web and screenshot is not None:
        raise typer.BadParameter("give one of --web and --screenshot")
    from sinssim.recording import viewer

    if screenshot is not None:
        viewer.screenshot(run_or_recording, screenshot, view=name)
    elif web:
        viewer.serve(run_or_recording, view=name)
    else:
        viewer.open_viewer(run_or_recording, view=name)


class Kind(StrEnum):
    """What can be listed."""

    AIRCRAFT = "aircraft"
    SCENARIOS = "scenarios"
    STUDIES = "studies"
    ALGORITHMS = "algorithms"
    FRAMES = "frames"
    GRAVITY = "gravity"
    GRADES = "grades"
    VIEWS = "views"
    AIDING = "aiding"
    STATES = "states"


@app.command()
def align(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO_OR_LOG",
            help="A scenario's TOML file or name, or a recorded log (text, .parquet, .npz).",
            show_default=False,
        ),
    ],
    columns: ColumnsOption = None,
    grade: Annotated[
        str | None,
        typer.Option("--grade", help="Grade of a log's sensors, for the expected error; see `sinssim list grades`."),
    ] = None,
    start: Annotated[float | None, typer.Option("--from", metavar="S", help="Begin of the session, s.")] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="S", help="End of the session, s.")] = None,
    disturbed: Annotated[
        bool, typer.Option("--disturbed", help="The vehicle sways: align on the cone that gravity describes.")
    ] = False,
    latitude: Annotated[
        float | None, typer.Option("--latitude", metavar="DEG", help="Latitude, if known (for --disturbed).")
    ] = None,
    settings: SetOption = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Draw the expected errors (.svg, .png or .pdf).")
    ] = None,
    record: Annotated[
        Path | None, typer.Option("--record", metavar="FILE", help="Record the session for `sinssim view` (.rrd).")
    ] = None,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Find heading, roll, pitch and latitude of a parked vehicle, and say what error to expect from what.

    A session of a few hundred seconds on a vehicle that stands still; one that moved is refused, unless it only
    swayed and --disturbed is given. The angles are those of the sensor block.

    Examples:

        sinssim align parked --to 300 --record parked.rrd
        sinssim align runs/parked/streams/imu_measured.parquet --grade laser-standard --to 600
        sinssim align log.csv --columns log.toml --grade tactical --plot expected.svg
        sinssim align log.npz --columns log.toml --disturbed --latitude 50
    """
    from sinssim.alignment.report import align_source

    report = align_source(
        source,
        columns=columns,
        grade=grade,
        start=start,
        end=end,
        method="disturbed" if disturbed else "quiet",
        latitude=None if latitude is None else math.radians(latitude),
        settings=tuple(settings or ()),
    )
    if plot is not None:
        from sinssim.alignment.figures import save, session_figure

        save(session_figure(report), plot)
    if record is not None:
        from sinssim.recording.session import record_alignment

        record_alignment(record, report)
    if as_json:
        print(json.dumps(report.to_json(), indent=2, allow_nan=False))
    else:
        from rich.console import Console

        report.show(Console(highlight=False))


@app.command("sensors")
def explain_sensors(
    grade: Annotated[str, typer.Argument(metavar="GRADE", help="See `sinssim list grades`.", show_default=False)],
    latitude: Annotated[
        float, typer.Option("--latitude", metavar="DEG", min=-90.0, max=90.0, help="Latitude of the vehicle.")
    ] = 45.0,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="What differs from the grade, by its key in a scenario's [imu]; may be given several times.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Say what a grade of sensors means: each error, and the position error that it alone makes in an hour.

    By closed forms, before anything is simulated: a vehicle at rest navigates unaided from a perfect start, and errors
    that show in motion only are told for one turn or one acceleration. See docs/sensors.md.

    Examples:

        sinssim sensors laser-standard --latitude 60
        sinssim sensors tactical --set gyro_bias_sigma_deg_h=0.3 --set gyro_quantum_arcsec=2.0
    """
    from sinssim.scenario.imu import ImuSection
    from sinssim.scenario.load import override
    from sinssim.scenario.toml_file import validate

    data: dict[str, object] = {"grade": grade}
    overridden = {override(data, setting.removeprefix("imu.")) for setting in settings or ()}
    section = validate(ImuSection, data, "", f"sensors {grade}", overridden)
    from sinssim.sensors.expectation import expect
    from sinssim.sensors.expectation_report import show, to_json

    expectation = expect(section, math.radians(latitude))
    if as_json:
        print(json.dumps(to_json(expectation), indent=2, ensure_ascii=False))
    else:
        from rich.console import Console

        show(expectation, Console(highlight=False))


@app.command()
def allan(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG",
            help="A recorded log (text, .parquet, .npz) of sensors at rest, or a run directory.",
            show_default=False,
        ),
    ],
    columns: ColumnsOption = None,
    channel: Annotated[
        list[str] | None,
        typer.Option(
            "--channel",
            metavar="NAME",
            help="gyro_x … accel_z, or gyro or accel for three; may be given several times.",
            show_default="all",
        ),
    ] = None,
    start: Annotated[float | None, typer.Option("--from", metavar="S", help="Begin of the part to use, s.")] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="S", help="End of the part to use, s.")] = None,
    correlation_time: Annotated[
        float | None,
        typer.Option(
            "--correlation-time",
            metavar="S",
            help="Correlation time of a Gauss-Markov bias, if there is one and it is known.",
            show_default="such a bias is looked for",
        ),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Draw the Allan deviations (.svg, .png or .pdf).")
    ] = None,
    record: Annotated[
        Path | None, typer.Option("--record", metavar="FILE", help="Record everything for `sinssim view` (.rrd).")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Identify the noise of sensors at rest: Allan deviation, and the terms Q, N, B, K, R with 95 % bands.

    Quantisation, random walk, bias instability, rate random walk and ramp of every channel, by maximum likelihood, in
    the units of data sheets and scenarios. What a record does not show is called not observable.

    Examples:

        sinssim allan runs/parked
        sinssim allan log.csv --columns log.toml --channel gyro --plot allan.svg
        sinssim allan log.npz --columns log.toml --from 600 --to 36600 --record allan.rrd
    """
    from sinssim.sensors.noise_report import noise_report

    if plot is not None:
        from sinssim.alignment.figures import check_format

        check_format(plot)
    with _one_bar(show=not quiet) as progress:
        report = noise_report(
            log,
            columns=columns,
            channels=tuple(channel or ()),
            start=start,
            end=end,
            correlation_time=correlation_time,
            progress=progress,
        )
    if plot is not None:
        from sinssim.alignment.figures import save
        from sinssim.recording.noise_figure import noise_figure

        save(noise_figure(report), plot)
    if record is not None:
        from sinssim.recording.noise import record_noise

        record_noise(record, report)
    if as_json:
        print(json.dumps(report.to_json(), indent=2, ensure_ascii=False, allow_nan=False))
    elif not quiet:
        from rich.console import Console

        from sinssim.sensors.noise_table import show

        show(report, Console(highlight=False, width=max(120, shutil.get_terminal_size().columns)))


@app.command("list")
def list_names(
    kind: Annotated[Kind, typer.Argument(help="What to list.", show_default=False)],
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """List the names that scenarios and options may use, each with a sentence.

    Aircraft, scenarios, studies and views are content: those in the folders `aircraft`, `scenarios`,
    `scenarios/studies` and `viz` of the current folder come first, then those that come with the package.

    Example:

        sinssim list grades
    """
    names = _names(kind)
    if as_json:
        print(json.dumps(names, indent=2, ensure_ascii=False))
        return
    width = max((len(name) for name in names), default=0)
    for name, sentence in names.items():
        print(f"{name:<{width}}  {sentence}".rstrip())
    sys.stdout.flush()  # so that what goes wrong there is the last word
    if kind is Kind.GRADES:
        typer.echo("What one means, term by term: sinssim sensors GRADE", err=True)


def _names(kind: Kind) -> Mapping[str, str]:
    match kind:
        case Kind.ALGORITHMS:
            from sinssim.names import SCENARIO_ALGORITHMS

            return SCENARIO_ALGORITHMS
        case Kind.FRAMES:
            from sinssim.names import FRAMES

            return FRAMES
        case Kind.GRAVITY:
            from sinssim.earth_models import GRAVITY_MODELS

            return GRAVITY_MODELS
        case Kind.GRADES:
            from sinssim.scenario.grades import GRADES

            return GRADES
        case Kind.STATES:
            from sinssim.names import FILTER_STATES

            return FILTER_STATES
        case Kind.AIDING:
            from sinssim.scenario.aiding import sensors

            return sensors()
        case Kind.AIRCRAFT | Kind.SCENARIOS | Kind.STUDIES:
            from sinssim.scenario.content import list_content

            folder: ContentKind = (
                "aircraft" if kind is Kind.AIRCRAFT else "scenarios" if kind is Kind.SCENARIOS else "studies"
            )
            return {name: _description(file) for name, file in list_content(folder).items()}
        case Kind.VIEWS:
            import ast

            from sinssim.scenario.content import list_content

            return {
                name: (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").split("\n")[0]
                for name, file in list_content("viz").items()
            }


def _description(file: Path) -> str:
    """Return what a TOML file says about itself; a broken one must not hide the others."""
    from sinssim.scenario.toml_file import read_toml

    try:
        return str(read_toml(file)[1].get("description", ""))
    except SinssimError as error:
        return f"(cannot be used: {error})"


@contextmanager
def _progress(show: bool) -> Iterator[Callable[[str, float], None] | None]:
    """Show a bar for each stage of a run while it lasts, on a terminal only, on standard error."""
    if not show or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    words = {
        "flight": "Flying",
        "truth": "Fitting the true motion",
        "imu": "Sensing",
        "navigate": "Navigating",
        "filter": "Filtering",
        "record": "Recording",
    }
    columns = (TextColumn("{task.description:<24}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True)) as bars:
        # In the order of the stages, each from the moment it begins.
        tasks = {stage: bars.add_task(word, total=1.0, start=False, visible=False) for stage, word in words.items()}

        def report(stage: str, fraction: float) -> None:
            if not bars.tasks[tasks[stage]].started:
                bars.start_task(tasks[stage])
            bars.update(tasks[stage], completed=fraction, visible=True)

        yield report


@contextmanager
def _one_bar(show: bool) -> Iterator[Callable[[str, float], None] | None]:
    """Show one bar for the whole of a study, on a terminal only, on standard error."""
    if not show or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<40}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=1.0)
        yield lambda what, fraction: bars.update(task, description=what[:40], completed=fraction)


def _notes(error: BaseException) -> str:
    """Return what was noted on an error on its way: what is left of the run, and where."""
    return " ".join(getattr(error, "__notes__", ()))


def _interrupt(end: BaseException) -> KeyboardInterrupt | None:
    """Return the interruption that ended the command line, if one did: typer makes an exit code of it."""
    if isinstance(end, SystemExit) and end.code != 130:
        return None
    cause: BaseException | None = end
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause


def _number(value: float | None) -> str:
    """Write a number with four significant digits, without an exponent where a person can do without."""
    if value is None:
        return "–"
    if value == 0.0:
        return "0"
    if not math.isfinite(value) or not 1e-4 <= abs(value) < 1e9:
        return f"{value:.1e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"


def _command() -> str:
    """Return what to type for this program: its name if the shell finds it, else the way it was called."""
    if shutil.which("sinssim"):
        return "sinssim"
    return sys.argv[0] if Path(sys.argv[0]).name == "sinssim" else f"{Path(sys.executable).name} -m sinssim"


def _show_result(result: RunResult, directory: Path) -> None:
    """Print each algorithm's errors, the time that each stage took, and what to open."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from sinssim.recording.summary import flagged_words
    from sinssim.scenario.idle import idle

    table = Table(
        title=f"{result.scenario.name}: errors against the truth",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("algorithm", no_wrap=True)
    for heading in (
        "horizontal\nfinal, m",
        "\nrms, m",
        "\nmax, m",
        "\nmax, nmi",
        "velocity\nmax, m/s",
        "attitude\nmax, arcmin",
    ):
        table.add_column(heading, justify="right", no_wrap=True)
    failures, of_filter = result.summary["failures"], result.summary.get("filter", {})
    aided = {name: of_filter[name] for name in ("aided", "smoothed") if of_filter.get(name)}
    for name, errors in {**result.summary["algorithms"], **aided}.items():
        table.add_row(
            name,
            _number(errors["final_horizontal_error_m"]),
            _number(errors["rms_horizontal_error_m"]),
            _number(errors["max_horizontal_error_m"]),
            "–" if name in failures else f"{errors['max_horizontal_error_m'] / 1852.0:.3f}",
            _number(errors["max_velocity_error_mps"]),
            "–" if name in failures else _number(errors["max_attitude_error_arcsec"] / 60.0),
        )
    # Digits are never cut off: on a terminal that is too narrow, lines wrap.
    console = Console(highlight=False, width=max(120, shutil.get_terminal_size().columns))
    if result.scenario.description:
        console.print(f"{result.scenario.description}\n", markup=False)
    console.print(table)
    if flags := flagged_words(result.summary["flagged_samples"], len(result.measured)):
        console.print(flags, markup=False)
    for sentence in idle(result.scenario.imu, result.trajectory.end):
        console.print(sentence, markup=False)
    for name, failure in failures.items():
        console.print(f"{name} has no result: {failure['text']}", markup=False)
    for solution in result.solutions.values():
        for event in solution.events:
            console.print(event.text, markup=False)
    if of_filter:
        from sinssim.recording.filter_summary import sentences

        for sentence in sentences(of_filter):
            console.print(sentence, markup=False)
    timing = {stage.removesuffix("_s"): seconds for stage, seconds in result.summary["timing"].items()}
    print("Time: " + ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in timing.items() if seconds))
    print(f"Read it:    {directory / 'report.html'}    (in any browser)")
    print(f"Look at it: {_command()} view {directory}    (--web: in a browser)")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; errors raised on purpose become one paragraph on standard error and an exit code.

    Args:
        arguments: command-line arguments without the program's name; those of the process by default.

    Raises:
        SystemExit: always, with the exit code.
    """
    global _debug
    _debug = False
    # A shell's `&` makes a program ignore SIGINT: the Ctrl-C then is another program's.
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    try:
        with interruptible(signal.SIGTERM, *(() if ignored else (signal.SIGINT,))):
            app(args=None if arguments is None else list(arguments), prog_name="sinssim")
    except (KeyboardInterrupt, SystemExit) as end:
        interrupt = _interrupt(end)
        if interrupt is None:
            raise
        typer.echo(f"Interrupted. {_notes(interrupt)}".rstrip(), err=True)
        sys.exit(130)
    except SinssimError as error:
        if _debug:
            raise
        _fail(f"{error} {_notes(error)}".rstrip(), error.exit_code)
    except MemoryError as error:
        if _debug:
            raise
        _fail(f"not enough memory: {error}. A shorter scenario or a lower imu.rate_hz needs less.", 1)
    except OSError as error:  # standard output on a full disk, no room for temporary files
        if _debug:
            raise
        _fail(f"the operating system refused: {error}.", 1)


def program() -> NoReturn:
    """Run the command line as a process of its own, and end it at once.

    Python's own end takes apart compilers and a gigabyte of arrays for a third of a second, and can fall over a thread
    that is still loading one of them. Everything that is to be closed has been closed by then.
    """
    code = 1
    try:
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    except KeyboardInterrupt:  # as it was ending, when all was done
        code = 130
    except BaseException:
        sys.excepthook(*sys.exc_info())
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        code = code or 1
    os._exit(code)


def _fail(message: str, code: int) -> NoReturn:
    typer.secho("sinssim: ", fg=typer.colors.RED, bold=True, err=True, nl=False)
    typer.echo(message, err=True)
    sys.exit(code)
