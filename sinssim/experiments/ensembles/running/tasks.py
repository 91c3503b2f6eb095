"""One task of an ensemble, a group of runs that writes its own file, and the threads that work through many."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from sinssim.experiments.ensembles.execute import errors_of_runs
from sinssim.experiments.ensembles.plan import Plan
from sinssim.experiments.ensembles.running.chunk_file import write_chunk
from sinssim.experiments.ensembles.truth import TruthCache

OnRun = Callable[[int], None]
"""Called with the number of further runs that are finished."""
Compute = Callable[[range, OnRun], None]
"""Computes a group of runs and writes its file."""

_POLL = 0.2
_PATIENCE = 3.0
"""Longest time to wait for the runs in progress after an interruption, s; they are abandoned and write no file."""


class Abandoned(BaseException):
    """The ensemble was interrupted: the task ends without a file. It is no Exception, which a run would report."""


def make_chunk(plan: Plan, runs: range, folder: Path, truths: TruthCache, on_run: OnRun | None = None) -> None:
    """Compute a group of runs and write its file.

    It may be done twice, by any process: the file is the same and is renamed into place.

    Args:
        plan: the plan of the ensemble.
        runs: numbers of the runs.
        folder: folder of the files of runs.
        truths: true motions that are kept between tasks.
        on_run: called after each run; it may raise to abandon the task.

    Raises:
        OSError: the file cannot be written.
    """
    write_chunk(errors_of_runs(plan, runs, truths, on_run), plan, folder)


def work_through(
    groups: Sequence[range], threads: int, worker: Callable[[threading.Event], Compute], on_run: OnRun
) -> None:
    """Compute groups of runs in several threads.

    Args:
        groups: the groups, computed in this order.
        threads: number of threads.
        worker: makes the function by which a thread computes a group; it is given the event of an interruption.
        on_run: called in this thread.

    Raises:
        BaseException: the first error of a task, or an interruption; the other tasks are abandoned.
    """
    stop, waiting, answers = threading.Event(), queue.SimpleQueue[range](), queue.SimpleQueue[Any]()
    for group in groups:
        waiting.put(group)

    def run() -> None:
        def done(count: int) -> None:
            if stop.is_set():
                raise Abandoned
            answers.put(count)

        try:
            compute = worker(stop)
            while not stop.is_set():
                compute(waiting.get_nowait(), done)
                answers.put(None)
        except (queue.Empty, Abandoned):
            pass
        except BaseException as error:
            answers.put(error)

    pool = [threading.Thread(target=run, name=f"ensemble {i}", daemon=True) for i in range(min(threads, len(groups)))]
    for thread in pool:
        thread.start()
    try:
        left = len(groups)
        while left:
            try:
                answer = answers.get(timeout=_POLL)  # wakes up often, so that Ctrl-C takes effect
            except queue.Empty:
                continue
            if isinstance(answer, BaseException):
                raise answer
            if answer is None:
                left -= 1
            else:
                on_run(answer)
    finally:
        stop.set()
        end = time.monotonic() + _PATIENCE
        for thread in pool:
            thread.join(max(end - time.monotonic(), 0.0))
