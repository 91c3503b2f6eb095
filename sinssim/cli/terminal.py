"""The terminal: the console for tables, JSON, and the name of this program."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from sinssim.system.encoding import holds_everything

if TYPE_CHECKING:
    from rich.console import Console


def has_bars(quiet: bool) -> bool:
    """Return whether progress is shown: on a terminal, unless the command is quiet."""
    return not quiet and sys.stderr.isatty()


def console(least_width: int = 0) -> Console:
    """Return the console that tables are printed on; on a terminal of less than `least_width`, lines wrap."""
    from rich.console import Console

    width = max(least_width, shutil.get_terminal_size().columns) if least_width else None
    return Console(highlight=False, width=width)


def print_json(value: object) -> None:
    """Print a result as JSON; characters that standard output cannot represent are escaped."""
    print(json.dumps(value, indent=2, ensure_ascii=not holds_everything(sys.stdout)))


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
