"""The process of the command line: signals, errors as one paragraph on standard error, exit codes."""

from __future__ import annotations

import signal
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, NoReturn, TypeVar

import typer

from sinssim.cli.app import app
from sinssim.cli.options import quiet_wanted, traceback_wanted, want_quiet, want_traceback
from sinssim.cli.terminal import notes_of
from sinssim.errors import SinssimError, SinssimWarning
from sinssim.system.encoding import standard_streams
from sinssim.system.interruption import interruptible

E = TypeVar("E", bound=BaseException)

READER_GONE = 128 + 13
"""Exit code if the reader of standard output closes it: that of a program ended by SIGPIPE (`yes | head -1`)."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; expected errors become one paragraph on standard error and an exit code.

    Args:
        arguments: command-line arguments without the program's name; by default those of the process.

    Raises:
        SystemExit: always, with the exit code.
    """
    want_traceback(False)
    want_quiet(False)
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
        if traceback_wanted():
            raise
        _fail(f"{error} {notes_of(error)}".rstrip(), error.exit_code)
    except MemoryError as error:
        if traceback_wanted():
            raise
        _fail(f"not enough memory: {error}. A shorter scenario or log, or a lower rate, needs less.", 1)
    except ImportError as error:
        name = (error.name or "").partition(".")[0]
        if traceback_wanted() or name in ("", "sinssim"):
            raise
        _fail(
            f"the package {name}, which this command needs, cannot be loaded: {error}. The installation in "
            f"{sys.prefix} is incomplete: repeat it, by make setup or by pip.",
            1,
        )
    except OSError as error:  # for example standard output on a full disk, no space for temporary files
        if traceback_wanted():
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
            elif not (quiet_wanted() or str(message) in printed):
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
