"""The application and its process: commands, signals, errors as one paragraph on standard error, exit codes.

The functions of the files in `commands/` with the decorator `command` are the commands. Mistakes in options and
arguments are reported in the sentences of sinssim's other errors.
"""

from __future__ import annotations

import importlib
import pkgutil
import signal
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Annotated, Any, NoReturn, TypeVar

import typer
from typer.core import TyperGroup

from sinssim import __version__
from sinssim.cli import commands
from sinssim.cli.command_line import COMMANDS, GIVEN, notes_of, standard_streams
from sinssim.errors import InputError, SinssimError, SinssimWarning, shortened
from sinssim.system.process import interruptible

E = TypeVar("E", bound=BaseException)
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]
_KINDS = (("integer", "a whole number"), ("number", "a number"), ("float", "a number"), ("boolean", "true or false"))
"""Words of typer's messages, which differ from version to version, and what an option needs."""


class Commands(TyperGroup):
    """The commands; a mistake in their options is an `InputError`, which is printed like any other."""

    def make_context(self, *args: Any, **options: Any) -> Any:
        """Read the options before the command's name."""
        with _in_sentences():
            return super().make_context(*args, **options)

    def invoke(self, ctx: Any) -> Any:
        """Run the command that the arguments name."""
        with _in_sentences():
            return super().invoke(ctx)


@contextmanager
def _in_sentences() -> Iterator[None]:
    try:
        yield
    except _UsageError as error:
        if type(error).__name__ == "NoArgsIsHelpError":  # nothing is given: the help is printed
            raise
        raise InputError(sentence(error)) from error


def sentence(error: Any) -> str:
    """Return what is wrong, for example "--runs = 'abc' must be a whole number. See `sinssim ensemble --help`."."""
    text = error.message.strip().rstrip(".")
    parameter = getattr(error, "param", None)
    name = "" if parameter is None else next((o for o in parameter.opts if o.startswith("--")), "") or parameter.metavar
    if "Missing" in type(error).__name__:
        text = f"{name} is missing" if name else " ".join(error.format_message().split()).rstrip(".")
    elif name:
        given, kind = _given(error), next((kind for word, kind in _KINDS if f"valid {word}" in text), None)
        text = f"{name} = {given}: {text}" if kind is None else f"{name} = {given} must be {kind}"
    elif similar := getattr(error, "possibilities", None):
        text = f"{text}. Did you mean {' or '.join(similar)}?"
    context = getattr(error, "ctx", None)
    command = "sinssim" if context is None else context.command_path
    return f"{text}{'' if text.endswith('?') else '.'} See `{command} --help`."


def _given(error: Any) -> str:
    """Return the value that was given, as far as it is known."""
    cause = error.__cause__
    try:
        return shortened(repr(cause.errors()[0]["input"]))
    except (AttributeError, LookupError, TypeError):
        quoted = error.message.split("'")
        return shortened(repr(quoted[1])) if len(quoted) > 2 else "what was given"


_FIRST = ("run", "view", "check", "compare")
"""Commands at the top of the list in `sinssim --help`; the others follow in alphabetical order."""

app = typer.Typer(
    name="sinssim",
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 success, 1 the run failed, 2 wrong input, 130 interrupted.",
)


def command_names() -> list[str]:
    """Return the names of the commands, in the order of the help."""
    return sorted(COMMANDS, key=lambda name: (_FIRST.index(name) if name in _FIRST else len(_FIRST), name))


def _print_version(value: bool) -> None:
    if value:
        print(f"sinssim {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Simulate strapdown inertial navigation from end to end.

    JSBSim flies an aircraft along a flight plan. An inertial measurement unit with the errors of its grade measures the
    flight. Navigation algorithms compute attitude, velocity and position from its output. One Rerun recording contains
    all data.

    A scenario may add aiding sensors and a Kalman filter: see `sinssim run aided_airliner`.

    Begin with `sinssim run first_flight`, then `sinssim view runs/first_flight`.
    """


for _module in pkgutil.iter_modules(commands.__path__):
    importlib.import_module(f"{commands.__name__}.{_module.name}")
for _name in command_names():
    app.command(_name)(COMMANDS[_name])


READER_GONE = 128 + 13
"""Exit code if the reader of standard output closes it: that of a program ended by SIGPIPE (`yes | head -1`)."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line, by default with the arguments of the process; expected errors become one paragraph on
    standard error. Always raise SystemExit with the exit code."""
    GIVEN.update(debug=False, quiet=False)
    standard_streams()
    # A shell's `&` makes a program ignore SIGINT: Ctrl-C is then meant for another program.
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    try:
        with _warnings_as_lines(), interruptible(signal.SIGTERM, *(() if ignored else (signal.SIGINT,))):
            app(args=None if arguments is None else list(arguments), prog_name="sinssim")
    except KeyboardInterrupt as interrupt:
        _interrupted(interrupt)
    except SystemExit as end:
        if end.code == 130 and (cause := _behind(end, KeyboardInterrupt)):
            _interrupted(cause)
        if end.code == 1 and _behind(end, BrokenPipeError):
            sys.exit(READER_GONE)
        raise
    except SinssimError as error:
        if GIVEN["debug"]:
            raise
        _fail(f"{error} {notes_of(error)}".rstrip(), error.exit_code)
    except MemoryError as error:
        if GIVEN["debug"]:
            raise
        _fail(f"not enough memory: {error}. A shorter scenario or log, or a lower rate, needs less.", 1)
    except ImportError as error:
        name = (error.name or "").partition(".")[0]
        if GIVEN["debug"] or name in ("", "sinssim"):
            raise
        _fail(
            f"the package {name}, which this command needs, cannot be loaded: {error}. The installation in "
            f"{sys.prefix} is incomplete: repeat it, by make setup or by pip.",
            1,
        )
    except OSError as error:  # for example standard output on a full disk, no space for temporary files
        if GIVEN["debug"]:
            raise
        _fail(f"the operating system reported an error: {error}.", 1)


@contextmanager
def _warnings_as_lines() -> Iterator[None]:
    """Print the warnings of sinssim as lines on standard error, without the place in the program; none with --quiet."""
    with warnings.catch_warnings():
        usual, printed = warnings.showwarning, set[str]()

        def show(message: Warning | str, category: type[Warning], *where: Any, **further: Any) -> None:
            if not issubclass(category, SinssimWarning):
                usual(message, category, *where, **further)
            elif not (GIVEN["quiet"] or str(message) in printed):
                printed.add(str(message))
                print(f"WARNING: {message}", file=sys.stderr)

        warnings.simplefilter("always", SinssimWarning)
        warnings.showwarning = show
        yield


def _interrupted(interrupt: BaseException) -> NoReturn:
    print(f"Interrupted. {notes_of(interrupt)}".rstrip(), file=sys.stderr)
    sys.exit(130)


def _behind(end: BaseException, kind: type[E]) -> E | None:
    """Return the error of a kind that ended the command line, if any: typer converts some to exit codes."""
    cause: BaseException | None = end
    while cause is not None and not isinstance(cause, kind):
        cause = cause.__cause__ or cause.__context__
    return cause


def _fail(message: str, code: int) -> NoReturn:
    with suppress(OSError):  # standard error on a full disk does not change the exit code
        typer.secho("sinssim: ", fg=typer.colors.RED, bold=True, err=True, nl=False)
        print(message, file=sys.stderr)
    sys.exit(code)
