"""The work of an experiment: one loop over its tasks, which executors compute, and the limit of its duration.

Executors are threads of this process (`Threads`), processes and a cluster (`ensembles/ensemble_execution.py`).
"""

from __future__ import annotations

import math
import queue
import threading
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import partial
from typing import Any, Generic, Self, TypeVar

from sinssim.errors import InputError, shortened
from sinssim.progress import Progress
from sinssim.scenario import Scenario
from sinssim.scenario.planned_limits import expected_duration
from sinssim.units import duration_text

Task = TypeVar("Task")
Part = Callable[[Any], None]
"""Called by a task with what it has finished so far; it raises `Abandoned` after an interruption."""
Compute = Callable[[Task, Part], Any]

_POLL = 0.2
_PATIENCE = 3.0
"""Longest time to wait for the tasks in progress after an interruption, s; they are abandoned."""


class Abandoned(BaseException):
    """The experiment was interrupted: the task ends without a result. It is no Exception, which a run would report."""


class WorkerDiedError(Exception):
    """The process that computed a task has died; the text says by what."""


class Executor(ABC, Generic[Task]):
    """Computes tasks until it is stopped; a context manager that stops it."""

    death: type[Exception] = WorkerDiedError
    lives = 1
    """Number of workers that may die on one task before the experiment fails."""

    @abstractmethod
    def submit(self, task: Task, part: Part) -> Future[Any]:
        """Begin a task."""

    @abstractmethod
    def stop(self) -> None:
        """Abandon the tasks that are not finished, and free the workers."""

    def failure(self, task: Task, death: Exception) -> Exception:
        """Return the error of an experiment that ends because workers died on a task."""
        return death

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


class Threads(Executor[Task]):
    """Threads of this process. They are daemons, so that a long task does not delay the end after Ctrl-C."""

    def __init__(self, number: int, worker: Callable[[threading.Event], Compute[Task]]) -> None:
        """Start without threads; a `worker` makes a thread's function from the event of an interruption."""
        self._number, self._worker, self._stop = number, worker, threading.Event()
        self._waiting = queue.SimpleQueue[tuple[Future[Any], Task, Part] | None]()
        self._threads: list[threading.Thread] = []

    def submit(self, task: Task, part: Part) -> Future[Any]:
        future: Future[Any] = Future()
        self._waiting.put((future, task, part))
        if len(self._threads) < self._number:
            self._threads.append(threading.Thread(target=self._work, name="work", daemon=True))
            self._threads[-1].start()
        return future

    def _work(self) -> None:
        compute = self._worker(self._stop)
        while (item := self._waiting.get()) is not None and not self._stop.is_set():
            future, task, part = item
            try:
                result = compute(task, partial(self._pass_on, part))
            except Abandoned:
                return
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)

    def _pass_on(self, part: Part, finished: Any) -> None:
        if self._stop.is_set():
            raise Abandoned
        part(finished)

    def stop(self) -> None:
        self._stop.set()
        end = time.monotonic() + _PATIENCE
        for _ in self._threads:
            self._waiting.put(None)
        for thread in self._threads:
            thread.join(max(end - time.monotonic(), 0.0))


def work_through(
    tasks: Sequence[Task],
    executor: Executor[Task],
    on_done: Callable[[Task, Any], None],
    on_part: Callable[[Task, Any], None] = lambda task, finished: None,
) -> None:
    """Compute tasks by an executor; a task whose worker dies is begun again.

    A task and its result go to `on_done`, in this thread; what it has finished so far goes to `on_part`. The first
    error of a task, or an interruption, is raised; the caller stops the executor, which abandons the other tasks.
    """
    answers, deaths = queue.SimpleQueue[tuple[int, Any]](), Counter[int]()

    def begin(number: int) -> None:
        future = executor.submit(tasks[number], lambda finished: answers.put((number, finished)))
        future.add_done_callback(lambda done: answers.put((number, done)))

    for number in range(len(tasks)):
        begin(number)
    left = len(tasks)
    while left:
        try:
            number, answer = answers.get(timeout=_POLL)  # wakes up often, so that Ctrl-C takes effect
        except queue.Empty:
            continue
        if not isinstance(answer, Future):
            on_part(tasks[number], answer)
            continue
        try:
            result = answer.result()
        except executor.death as death:
            deaths[number] += 1
            if deaths[number] >= executor.lives:
                raise executor.failure(tasks[number], death) from death
            on_part(tasks[number], 0)
            begin(number)
            continue
        on_done(tasks[number], result)
        left -= 1


def whole_number(name: str, value: object, most: int) -> int:
    """Return a number that is whole and from 1 to `most`, or raise InputError."""
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise InputError(f"{name} = {shortened(repr(value))} must be a whole number from 1 to {most}.")
    return value


def check_workers(threads: int | None, workers: int | None = None, scheduler: str | None = None) -> None:
    """Raise for numbers that are none, or for several ways of computing at once."""
    for name, value in (("threads", threads), ("workers", workers)):
        if value is not None:
            whole_number(name, value, 1024)
    given = [name for name, value in (("threads", threads), ("workers", workers), ("scheduler", scheduler)) if value]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} exclude each other: give one of them.")


LIMIT_MINUTES = 30.0
"""Expected duration above which a study is refused unless a higher limit is given."""
_FLIGHT_SPEED = 250.0
"""Speed of JSBSim relative to real time."""
LONG_SECONDS = 30.0
"""Expected duration above which a study is announced."""
_SURE_AFTER = 10.0
"""Time of progress within a cell after which it tells the duration of all cells, s."""


class TooLongError(InputError):
    """The study would take longer than allowed."""


def flight_wait(scenario: Scenario) -> float:
    """Return how long the flight of a scenario takes to be flown, s; 0 if it is in the cache, and for other motions."""
    from sinssim.truth.flight.flight_cache import is_cached

    if scenario.flight is None or is_cached(scenario.flight, scenario.seed):
        return 0.0
    return expected_duration(scenario) / _FLIGHT_SPEED


def check_limit(limit_minutes: float) -> None:
    """Raise InputError for a limit that is none."""
    if not limit_minutes >= 0.0:
        raise InputError(f"limit_minutes = {limit_minutes} must not be negative; inf means no limit.")


def check_duration(
    name: str, what: str, seconds: float, limit_minutes: float, remedy: str, say: Callable[[str], None]
) -> None:
    """Announce a study that takes long, or raise TooLongError.

    `what` is computed, in words: "24 ensembles of 200 runs"; the `cure` would make it shorter: "Give fewer values".
    """
    text = f"{what}, about {duration_text(max(seconds, 1.0))}"
    if seconds > 60.0 * limit_minutes:
        raise TooLongError(
            f"the study {name} would take too long: {text}, more than the limit of {limit_minutes:g} min. {remedy}, or "
            f"raise the limit with --limit-minutes {math.ceil(seconds / 60.0 * 1.2)}."
        )
    if seconds > LONG_SECONDS:
        say(f"{name}: {text}.")


class Watch:
    """Measures the first cells, foretells the duration of all, and refuses a study that takes too long."""

    def __init__(
        self, name: str, what: str, cells: int, limit_minutes: float, report: Progress, say: Callable[[str], None]
    ) -> None:
        """Begin the cells of a study, `what` in words, which is refused beyond a limit, minutes."""
        self._name, self._what, self._cells, self._limit = name, what, cells, limit_minutes
        self._report, self._say = report, say
        self._done, self._measured, self._each, self._flights, self._announced = 0, 0, math.inf, 0.0, False
        self._begin = self._start = time.perf_counter()
        self._first: tuple[float, float] | None = None

    def flying(self, seconds: float) -> None:
        """Say that a cell waits for its true motion, and how long the flights that are left take, s."""
        self._flights = seconds
        self._report(f"{self._done}/{self._cells} cells, flying", self._done / self._cells)

    def begin(self) -> None:
        """Begin a cell, whose true motion is there."""
        self._start, self._first = time.perf_counter(), None

    def inside(self, fraction: float, detail: str = "") -> None:
        """Report the progress within a cell."""
        now = time.perf_counter()
        if self._first is None and fraction > 0.0:  # what came before may have been compilation and start
            self._first = now, fraction
        each, (begin, there) = self._each, self._first or (now, fraction)
        if fraction > there and now > begin:
            slope = (now - begin) / (fraction - there)
            each = min(each, slope)
            if now - begin > _SURE_AFTER:
                self._judge(slope, self._cells - self._done - fraction)
        share = (self._done + fraction) / self._cells
        left = each * (self._cells - self._done - fraction) + self._flights
        words = f", {duration_text(left)} left" if math.isfinite(left) else ""
        self._report(f"{self._done}/{self._cells} cells{f', {detail}' if detail else ''}{words}", share)

    def finish(self, failed: bool = False) -> None:
        """Finish a cell; one that failed tells nothing about the duration of the others. May raise TooLongError."""
        self._done += 1
        if not failed:
            self._each = min(self._each, time.perf_counter() - self._start)
            self._measured += 1
        if self._measured >= 2:  # the first one may have waited for the compiler
            self._judge(self._each, self._cells - self._done)
        self.begin()
        self.inside(0.0)

    def _judge(self, each: float, left: float) -> None:
        """Announce a long study, or refuse it, once."""
        if self._announced:
            return
        self._announced = True
        total = each * left + self._flights + time.perf_counter() - self._begin
        remedy = "Give fewer values or fewer runs"
        check_duration(self._name, self._what, total, self._limit, remedy, self._say)
