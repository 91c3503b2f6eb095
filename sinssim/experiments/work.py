"""Works through the tasks of an experiment in threads, which may each have a process, so that Ctrl-C takes effect."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

Task = TypeVar("Task")
Tell = Callable[[Any], None]
"""Called by a task with what it has finished; it raises `Abandoned` after an interruption."""
Compute = Callable[[Task, Tell], None]

_POLL = 0.2
_PATIENCE = 3.0
"""Longest time to wait for the tasks in progress after an interruption, s; they are abandoned."""


class Abandoned(BaseException):
    """The experiment was interrupted: the task ends without a result. It is no Exception, which a run would report."""


def work_through(
    tasks: Sequence[Task], threads: int, worker: Callable[[threading.Event], Compute[Task]], on_done: Tell
) -> None:
    """Compute tasks in several threads.

    Args:
        worker: makes the function by which a thread computes a task; it is given the event of an interruption.
        on_done: called in this thread with what the tasks tell.

    Raises:
        BaseException: the first error of a task, or an interruption; the other tasks are abandoned.
    """
    stop, waiting, answers = threading.Event(), queue.SimpleQueue[Task](), queue.SimpleQueue[tuple[str, Any]]()
    for task in tasks:
        waiting.put(task)

    def run() -> None:
        def tell(finished: Any) -> None:
            if stop.is_set():
                raise Abandoned
            answers.put(("told", finished))

        try:
            compute = worker(stop)
            while not stop.is_set():
                compute(waiting.get_nowait(), tell)
                answers.put(("done", None))
        except (queue.Empty, Abandoned):
            pass
        except BaseException as error:
            answers.put(("failed", error))

    pool = [threading.Thread(target=run, name=f"work {i}", daemon=True) for i in range(min(threads, len(tasks)))]
    for thread in pool:
        thread.start()
    try:
        left = len(tasks)
        while left:
            try:
                kind, answer = answers.get(timeout=_POLL)  # wakes up often, so that Ctrl-C takes effect
            except queue.Empty:
                continue
            if kind == "failed":
                raise answer
            if kind == "done":
                left -= 1
            else:
                on_done(answer)
    finally:
        stop.set()
        end = time.monotonic() + _PATIENCE
        for thread in pool:
            thread.join(max(end - time.monotonic(), 0.0))
