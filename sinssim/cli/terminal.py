"""The terminal: progress bars, the console for tables, JSON, and the name of this program."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from sinssim.system.encoding import holds_everything

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bars

_STAGES = {
    "flight": "Flying",
    "truth": "Fitting the true motion",
    "imu": "Sensing",
    "navigate": "Navigating",
    "budget": "Sources of the phases",
    "filter": "Filtering",
    "record": "Recording",
}
"""Text of the bar of each stage of a run, in order."""

Progress = Callable[[str, float], None]


@contextmanager
def stage_bars(show: bool) -> Iterator[Progress | None]:
    """Show a bar for each stage of a run while it lasts, on standard error and only on a terminal.

    Args:
        show: whether bars are wanted.

    Yields:
        A function of a stage and its fraction done; None without bars.
    """
    if not show or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<24}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True)) as bars:
        # In the order of the stages; each bar appears when its stage begins.
        tasks = {stage: bars.add_task(text, total=1.0, start=False, visible=False) for stage, text in _STAGES.items()}

        def report(text: str, fraction: float) -> None:
            stage, _, work = text.partition(": ")
            if not bars.tasks[tasks[stage]].started:
                bars.start_task(tasks[stage])
            bars.update(tasks[stage], completed=fraction, visible=True, description=f"{_STAGES[stage]} {work}"[:60])

        with _compilation_bar(bars):
            yield report


@contextmanager
def one_bar(show: bool) -> Iterator[Progress | None]:
    """Show one bar for a whole task, on standard error and only on a terminal.

    Args:
        show: whether a bar is wanted.

    Yields:
        A function of the text beside the bar and the fraction done; None without a bar.
    """
    if not show or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<40}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=1.0)
        with _compilation_bar(bars):
            yield lambda text, fraction: bars.update(task, description=text[:40], completed=fraction)


@contextmanager
def _compilation_bar(bars: Bars) -> Iterator[None]:
    """Show an additional bar while kernels are compiled; the cache keeps them for later runs."""
    from sinssim.jit import compilation

    task = bars.add_task("Compiling, once", total=None, start=False, visible=False)

    def show(compiling: bool) -> None:
        if compiling and not bars.tasks[task].started:
            bars.start_task(task)
        bars.update(task, visible=compiling, refresh=compiling)

    with compilation(show):
        yield


def console(least_width: int = 0) -> Console:
    """Return the console that tables are printed on.

    Args:
        least_width: minimum number of characters per line. Digits are never truncated; on a narrower terminal, lines
            wrap.

    Returns:
        The console on standard output.
    """
    from rich.console import Console

    width = max(least_width, shutil.get_terminal_size().columns) if least_width else None
    return Console(highlight=False, width=width)


def print_json(value: object) -> None:
    """Print a result as JSON; characters that standard output cannot represent are escaped.

    Args:
        value: a value that JSON can hold.
    """
    print(json.dumps(value, indent=2, ensure_ascii=not holds_everything(sys.stdout)))


def program_name() -> str:
    """Return the command for this program: its name if the shell finds it, otherwise the way it was called."""
    if shutil.which("sinssim"):
        return "sinssim"
    return sys.argv[0] if Path(sys.argv[0]).name == "sinssim" else f"{Path(sys.executable).name} -m sinssim"


def notes_of(error: BaseException) -> str:
    """Return the notes that were added to an error, about the recorded part of the run and its place.

    Args:
        error: an error.

    Returns:
        The notes as one text; empty without notes.
    """
    return " ".join(getattr(error, "__notes__", ()))
