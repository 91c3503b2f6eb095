"""The loop over the tasks of an experiment: parts, results, tasks whose worker dies, errors and interruptions."""

from __future__ import annotations

import threading
import time
from typing import Any

import pytest

from sinssim.experiments.workload import Abandoned, Threads, WorkerDiedError, work_through


def test_parts_and_results_of_all_tasks() -> None:
    """Parts come before the result of their task, in this thread."""
    heard: list[tuple[int, Any]] = []
    caller = threading.get_ident()

    def compute(task: int, part: Any) -> str:
        for count in range(task):
            part(count)
        return f"task {task}"

    def on_done(task: int, result: str) -> None:
        assert threading.get_ident() == caller
        heard.append((task, result))

    with Threads(2, lambda stop: compute) as threads:
        work_through(range(4), threads, on_done, lambda task, part: heard.append((task, part)))
    for task in range(4):
        assert [what for number, what in heard if number == task] == [*range(task), f"task {task}"]
    assert not [one for one in threading.enumerate() if one.name == "work"]


def test_a_task_whose_worker_dies_is_begun_again() -> None:
    """Twice of three times; then the experiment ends with the executor's error."""
    deaths, parts = [0], list[Any]()

    def compute(task: str, part: Any) -> int:
        part(7)
        deaths[0] += 1
        if deaths[0] <= limit:
            raise WorkerDiedError("SIGKILL")
        return 9

    class Mortal(Threads[str]):
        lives = 3

        def failure(self, task: str, death: Exception) -> Exception:
            return ValueError(f"{task}: {death}")

    limit, done = 2, list[Any]()
    with Mortal(1, lambda stop: compute) as threads:
        work_through(["a"], threads, lambda *pair: done.append(pair), lambda _, part: parts.append(part))
    assert (done, parts) == ([("a", 9)], [7, 0, 7, 0, 7])
    deaths[0], limit = 0, 3
    with pytest.raises(ValueError, match="a: SIGKILL"), Mortal(1, lambda stop: compute) as threads:
        work_through(["a"], threads, lambda *pair: done.append(pair))
    assert deaths == [3]


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), ZeroDivisionError("by chance")])
def test_the_others_are_abandoned(stop: BaseException) -> None:
    """After an error of a task, or an interruption while its part is shown; the other task ends at its next part."""
    ended: list[BaseException] = []
    both = threading.Barrier(2)

    def compute(task: int, part: Any) -> None:
        both.wait()
        if task == 0:
            if not isinstance(stop, KeyboardInterrupt):
                raise stop
            part("shown")
            return
        try:
            while True:
                part("more")
                time.sleep(0.01)
        except Abandoned as abandoned:
            ended.append(abandoned)
            raise

    def on_part(task: int, part: str) -> None:
        if part == "shown":
            raise stop

    executor = Threads[int](2, lambda event: lambda task, part: compute(task, part) if task or not event.wait(0) else 0)
    begin = time.monotonic()
    with pytest.raises(type(stop)), executor:
        work_through(range(2), executor, lambda *_: None, on_part)
    assert time.monotonic() - begin < 5.0
    assert len(ended) == 1
