"""What commands share: arguments and options, the console, JSON, text for streams with limited encodings."""

from __future__ import annotations

import codecs
import functools
import inspect
import json
import shutil
import sys
import unicodedata
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer

from sinssim.progress import as_lines

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.recording.result import Result

GIVEN = {"debug": False, "quiet": False}
"""Whether --debug and --quiet were given, for the process around the command."""

COMMANDS: dict[str, Callable[..., None]] = {}
"""The commands by name."""


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Make a function a command of its name, with hyphens for underscores."""
    COMMANDS[function.__name__.strip("_").replace("_", "-")] = function
    return function


def _remember(option: str) -> Callable[[bool], bool]:
    """Return the callback of an option in `GIVEN`."""

    def remember(value: bool) -> bool:
        GIVEN[option] = value
        return value

    return remember


def scenario_names(incomplete: str) -> list[str]:
    """Return the names of scenarios for the shell's completion, which adds files where none of them fits."""
    from sinssim.content import list_content

    return [name for name in list_content("scenarios") if name.startswith(incomplete)]


ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=scenario_names,
        help="A scenario's TOML file, or a name from `sinssim list scenarios`.",
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the scenario; may be given several times. A key is a path with dots; legs are "
        "counted from 1: `--set imu.grade=tactical --set flight.legs.2.altitude_m=9000`.",
    ),
]
GradeOption = Annotated[
    str | None,
    typer.Option(
        "--grade",
        metavar="NAME|FILE",
        help="Replace imu.grade: a name from `sinssim list grades`, or a grade's TOML file.",
    ),
]
ColumnsFile = Annotated[
    Path | None,
    typer.Option(
        "--columns",
        metavar="FILE",
        help="TOML file that describes the columns, units and axes of a log.",
        show_default="the columns of imu_measured.parquet",
    ),
]
FromTime = Annotated[float | None, typer.Option("--from", metavar="S", help="Start of the part to use, s.")]
ToTime = Annotated[float | None, typer.Option("--to", metavar="S", help="End of the part to use, s.")]
AtTimes = Annotated[
    list[float] | None,
    typer.Option("--at", metavar="S", help="A further time for the table, s; may be given several times."),
]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", callback=_remember("quiet"), help="Print only errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print only the result, as JSON.")]
Trial = Annotated[
    bool,
    typer.Option(
        "--trial/--no-trial",
        help="Whether the suggested scenario is run without the fixes of short outages, and follows what they show. "
        "This takes 1 to 20 s.",
    ),
]
Debug = Annotated[
    bool, typer.Option("--debug", callback=_remember("debug"), help="Show Python's traceback if an error occurs.")
]


_AllowPrograms = Annotated[
    bool,
    typer.Option("--allow-programs", help="Start the programs and libraries that the scenario names as navigators."),
]


def starts_programs(function: Callable[..., None]) -> Callable[..., None]:
    """Add the option --allow-programs to a command."""

    @functools.wraps(function)
    def call(*, allow_programs: bool, **given: Any) -> None:
        if allow_programs:
            from sinssim.simulation.foreign_navigator import allow_programs as allow

            allow()
        function(**given)

    keyword, signature = inspect.Parameter.KEYWORD_ONLY, inspect.signature(function, eval_str=True)
    option = inspect.Parameter("allow_programs", keyword, default=False, annotation=_AllowPrograms)
    call.__annotations__ = {**function.__annotations__, option.name: _AllowPrograms}
    call.__signature__ = signature.replace(parameters=[*signature.parameters.values(), option])  # type: ignore[attr-defined]
    return call


def out_option(folder: str) -> Any:
    """Return the option --out of a command that writes to a `folder` by default."""
    return typer.Option("--out", "-o", metavar="DIR", help="Output directory.", show_default=folder)


OutFolder = Annotated[Path | None, out_option("runs/<name>")]
Written = Annotated[Path | None, out_option("nothing is written")]


def overwrite_option(results: str) -> Any:
    """Return the option --overwrite of a command, whose `results` in words are "an existing run"."""
    return typer.Option("--overwrite", help=f"Replace {results}; your own files are kept.")


def plot_option(what: str) -> Any:
    """Return the option --plot of a command, which draws `what`."""
    return typer.Option("--plot", metavar="FILE", help=f"Draw {what} (.svg, .png or .pdf).")


def record_option(what: str) -> Any:
    """Return the option --record of a command, which records `what`."""
    return typer.Option("--record", metavar="FILE", help=f"Record {what} for `sinssim view` (.rrd).")


def threads_option(what: str, usual: str = "the number of cores") -> Any:
    """Return the option --threads of a command, the number of `what`, which is the `usual` one by default."""
    return typer.Option("--threads", metavar="N", help=f"Number of {what}.", show_default=usual)


def require_option(what: str) -> Any:
    """Return the option --require of a command, whose help begins with `what` it does."""
    return typer.Option("--require", metavar="REQUIREMENT", help=f"{what}; may be given several times.")


def start_option(help_text: str) -> Any:
    """Return the option --start, the date of a run's time 0."""
    from sinssim.logs.formats import DEFAULT_START

    usual = f"{DEFAULT_START}, or the date of a recorded log"
    return typer.Option("--start", metavar="DATE", help=help_text, show_default=usual)


def with_grade(settings: Sequence[str] | None, grade: str | None) -> list[str]:
    """Return the settings of a scenario with that of --grade, which is the last one."""
    return [*(settings or ()), *([] if grade is None else [f"imu.grade={json.dumps(grade)}"])]


_NAME = "sinssim-plain"
_PLAIN = {
    "−": "-", "–": "-", "—": "-", "‑": "-", "…": "...", "·": ".", "•": "*", "×": "x", "÷": "/", "±": "+-", "√": "sqrt",
    "→": "->", "←": "<-", "⇒": "=>", "≤": "<=", "≥": ">=", "≈": "~", "≠": "!=", "∞": "inf", "∝": "~", "°": "deg",
    "′": "'", "″": '"', "’": "'", "‘": "'", "“": '"', "”": '"', "„": '"', "«": '"', "»": '"', "µ": "u", "μ": "u",
    "∂": "d", "∑": "sum", "∫": "int", "ß": "ss", "⊗": "*", "✓": "ok", "✗": "no", "²": "^2", "³": "^3", "‰": "permille",
}  # fmt: skip


def encode_everything(stream: TextIO) -> None:
    """Let standard output or standard error replace characters that its encoding lacks (σ by "sigma") instead of
    raising an error. A stream with a user's own error handler keeps it, and other objects are not changed."""
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None and stream.errors in ("strict", "backslashreplace", "surrogateescape"):
        reconfigure(errors=_NAME)


def holds_everything(stream: TextIO) -> bool:
    """Return whether a stream's encoding represents all characters."""
    return (getattr(stream, "encoding", None) or "utf-8").lower().startswith(("utf", "cp65001"))


def _in_plain_words(error: UnicodeError) -> tuple[str | bytes, int]:
    """Replace one character that cannot be encoded; the error handler for codecs."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    character, following = error.object[error.start], error.start + 1
    if "\udc80" <= character <= "\udcff":  # a byte of a file's name, as given by the system
        return bytes([ord(character) - 0xDC00]), following
    for plain in (_PLAIN.get(character, ""), _decomposed(character), _letter(character)):
        if plain:
            return plain, following
    return "?", following


def _decomposed(character: str) -> str:
    """Return the ASCII letters in a character: é as e, ₂ as 2."""
    return unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()


def _letter(character: str) -> str:
    """Return the name of a Greek letter."""
    name = unicodedata.name(character, "").split(" WITH ")[0]
    if not name.startswith(("GREEK SMALL LETTER ", "GREEK CAPITAL LETTER ")):
        return ""
    word = name.split()[-1].lower()
    return word if "SMALL" in name else word.capitalize()


codecs.register_error(_NAME, _in_plain_words)


def standard_streams() -> None:
    """Let standard output and standard error write all characters."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # the stream is closed
            encode_everything(stream)


def has_bars(quiet: bool) -> bool:
    """Return whether progress is shown: on a terminal, or to a program that reads it, unless the command is quiet."""
    return not quiet and (sys.stderr.isatty() or as_lines())


def console(least_width: int = 0) -> Console:
    """Return the console that tables are printed on; on a terminal of less than `least_width`, lines wrap."""
    from rich.console import Console

    width = max(least_width, shutil.get_terminal_size().columns) if least_width else None
    return Console(highlight=False, width=width)


def print_json(value: object) -> None:
    """Print a result as JSON; characters that standard output cannot represent are escaped."""
    print(json.dumps(value, indent=2, ensure_ascii=not holds_everything(sys.stdout)))


def print_result(result: Result, *, as_json: bool, quiet: bool = False, least_width: int = 0) -> bool:
    """Print a result as JSON, or its tables and sentences; return whether these were printed."""
    if as_json:
        print_json(result.summary)
    elif not quiet:
        from sinssim.recording.console import show

        show(result.exhibits, console(least_width))
    return not (as_json or quiet)


def print_places(directory: Path, recording: bool = True) -> None:
    """Print where the report of a directory is, and how its recording is viewed."""
    print(f"Report: {directory / 'report.html'}    (in any browser)")
    if recording:
        print(f"View:   {program_name()} view {directory}    (--web: in a browser)")


def remarks(quiet: bool) -> Callable[[str], None]:
    """Return a function that prints a remark on standard error, unless the command is quiet."""
    return lambda text: None if quiet else print(text, file=sys.stderr)


def program_name() -> str:
    """Return the command for this program: its name if the shell finds it, otherwise the way it was called."""
    if shutil.which("sinssim"):
        return "sinssim"
    return sys.argv[0] if Path(sys.argv[0]).name == "sinssim" else f"{Path(sys.executable).name} -m sinssim"


def notes_of(error: BaseException) -> str:
    """Return the notes that were added to an error, about the recorded part of the run and its place, as one text."""
    return " ".join(getattr(error, "__notes__", ()))
