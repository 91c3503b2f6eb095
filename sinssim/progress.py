"""Progress of long work: a function that is told of it, or bars or lines on standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sinssim.errors import InputError

if TYPE_CHECKING:
    from rich.progress import Progress as Bars

Progress = Callable[[str, float], None]
"""Called with a stage, or a description of the current work, and the fraction done, 0…1. After a stage, ": " and its
current work may follow."""

VARIABLE = "SINSSIM_PROGRESS"
"""Environment variable that is "lines" where another program reads the progress: a line on standard error at each
percent, "progress 0.42 Navigating", instead of bars."""


def as_lines() -> bool:
    """Return whether progress is printed as lines."""
    return os.environ.get(VARIABLE) == "lines"


@contextmanager
def shown(progress: Progress | bool | None, stages: Mapping[str, str] | None = None) -> Iterator[Progress]:
    """Yield the function that long work reports to: a given one; for True bars on standard error, which a notebook
    shows as well; none for None or False. Each of the stages has a bar of its own with its text, in order; without any
    there is one bar with the description."""
    if progress is not None and not callable(progress) and not isinstance(progress, bool):
        raise InputError(f"progress = {progress!r} must be a function of a text and a fraction, or True for bars.")
    if not isinstance(progress, bool):
        yield progress or silent
        return
    if not progress:
        yield silent
        return
    if as_lines():
        yield _lines(stages or {})
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    width = 24 if stages else 40
    columns = (TextColumn(f"{{task.description:<{width}}}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=not stages) as bars, _compilation_bar(bars):
        if not stages:
            task = bars.add_task("", total=1.0)
            yield lambda text, fraction: bars.update(task, description=text[:width], completed=fraction)
            return
        # in the order of the stages; each bar appears when its stage begins
        tasks = {stage: bars.add_task(text, total=1.0, start=False, visible=False) for stage, text in stages.items()}

        def report(text: str, fraction: float) -> None:
            stage, _, work = text.partition(": ")
            if not bars.tasks[tasks[stage]].started:
                bars.start_task(tasks[stage])
            bars.update(tasks[stage], completed=fraction, visible=True, description=f"{stages[stage]} {work}"[:60])

        yield report


def _lines(stages: Mapping[str, str]) -> Progress:
    """Return the function that prints lines, with the text of each stage."""
    last = ""

    def report(text: str, fraction: float) -> None:
        nonlocal last
        stage, _, work = text.partition(": ")
        words = f"{stages[stage]} {work}".strip() if stage in stages else text
        line = f"progress {min(max(fraction, 0.0), 1.0):.2f} {words}"
        if line != last:
            last = line
            print(line, file=sys.stderr, flush=True)

    return report


def silent(text: str, fraction: float) -> None:
    """Report nothing."""


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
