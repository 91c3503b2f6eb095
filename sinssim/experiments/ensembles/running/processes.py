"""Worker processes of this machine: for runs with a filter, which hold Python's lock most of the time.

A process starts before there is work for it, and loads the program while the ensemble is planned. Then it is sent the
plan, with the true motion that all runs share, so that it computes nothing twice.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from sinssim.errors import RunError
from sinssim.experiments.ensembles.execute import OnRun
from sinssim.experiments.ensembles.plan import Plan, own_motions
from sinssim.experiments.ensembles.running.directory import make_chunk
from sinssim.experiments.ensembles.truth import TruthCache
from sinssim.experiments.work import Abandoned, Compute

_LIVES = 3
"""Number of processes that may die on one group of runs before the ensemble fails."""


class SparePool:
    """Processes that have started and have no work yet; a context manager that ends those without work."""

    def __init__(self, number: int) -> None:
        """Start processes."""
        self._spare = [_start() for _ in range(number)]

    def take(self) -> subprocess.Popen[bytes]:
        """Return a process without work: one that has started already, or another one."""
        try:
            return self._spare.pop()
        except IndexError:
            return _start()

    def __enter__(self) -> SparePool:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._spare:
            process.kill()
            process.wait()
        self._spare.clear()


def in_processes(
    plan: Plan, folder: Path, spare: SparePool, truths: TruthCache
) -> Callable[[threading.Event], Compute[range]]:
    """Return what makes a thread's function for `work_through`: it has the groups computed by a process of its own.

    A process that dies costs the group that it was computing, which another process computes again. The true motion
    that all runs share is sent to the processes.
    """
    task = _task(plan, folder, truths)

    def worker(stop: threading.Event) -> Compute[range]:
        process = _Process(task, spare, stop)

        def compute(runs: range, on_run: OnRun) -> None:
            told = 0

            def tell(count: int) -> None:
                nonlocal told
                told += count
                on_run(count)

            for _ in range(_LIVES):
                if process.compute(runs, tell):
                    return
                on_run(-told)
                told = 0
            raise RunError(
                f"{_LIVES} processes died while computing the runs {runs.start} to {runs.stop - 1} of the ensemble, "
                f"the last one by {process.end}. All other finished runs are kept; a machine with more memory, or "
                "fewer --threads, may help."
            )

        return compute

    return worker


def _task(plan: Plan, folder: Path, truths: TruthCache) -> bytes:
    """Return what a process is told before the first group of runs: plan, folder, and the motion that runs share."""
    shared = None if own_motions(plan.scenario) else truths.of(plan.scenario)
    try:
        return pickle.dumps((plan, folder, shared), pickle.HIGHEST_PROTOCOL)
    except (pickle.PicklingError, AttributeError, TypeError):  # a motion of functions is computed by each process
        return pickle.dumps((plan, folder, None), pickle.HIGHEST_PROTOCOL)


def _start() -> subprocess.Popen[bytes]:
    """Start a process that loads the program and waits for its task."""
    program = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve()"
    # In its own process group: Ctrl-C reaches only this process, which then ends the other.
    return subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0,
        env={**os.environ, "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip


class _Process:
    """A worker process, taken when first needed, and another one after it died."""

    def __init__(self, task: bytes, spare: SparePool, stop: threading.Event) -> None:
        self._task, self._spare, self._stop = task, spare, stop
        self._process: subprocess.Popen[bytes] | None = None
        self.end = ""
        threading.Thread(target=self._kill_on_stop, daemon=True).start()

    def compute(self, runs: range, on_run: OnRun) -> bool:
        """Have a group computed; return whether the process has survived it."""
        process = self._process or self._begin()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            with contextlib.suppress(BrokenPipeError):
                pickle.dump(runs, process.stdin)
                process.stdin.flush()
            while True:
                answer = _received(process.stdout)
                if answer is None:
                    break
                kind, value = answer
                if kind == "done":
                    return True
                if kind == "error":
                    raise value
                on_run(value)
        except BaseException:
            process.kill()
            raise
        if self._stop.is_set():
            raise Abandoned
        code = process.wait()
        self.end = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        self._process = None
        return False

    def _begin(self) -> subprocess.Popen[bytes]:
        self._process = process = self._spare.take()
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(self._task)
            process.stdin.flush()
        return process

    def _kill_on_stop(self) -> None:
        self._stop.wait()
        if self._process is not None:
            self._process.kill()
            self._process.wait()


def _received(pipe: IO[bytes]) -> Any:
    """Return the next object of a pipe; None at its end, also if that is in the middle of the object."""
    try:
        return pickle.load(pipe)
    except (EOFError, pickle.UnpicklingError):
        return None


def serve() -> None:
    """Compute the groups of runs that standard input names, answer on standard output, and end with the parent."""
    pipe = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a library prints must not mix with the answers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import sinssim.experiments.ensembles.filtered  # what every task needs, loaded before the task comes
    import sinssim.scenario.schema
    import sinssim.simulation.aided.aided_run
    import sinssim.truth.curve  # noqa: F401

    def answer(kind: str, value: object) -> None:
        left = memoryview(pickle.dumps((kind, value)))
        while left:
            left = left[pipe.write(left) :]

    truths = TruthCache()
    try:
        task = _received(sys.stdin.buffer)
        if task is not None and task[2] is not None:
            truths.keep(task[0].scenario, task[2])
        while task is not None and (runs := _received(sys.stdin.buffer)) is not None:
            try:
                make_chunk(task[0], runs, task[1], truths, lambda count: answer("runs", count))
            except (BrokenPipeError, KeyboardInterrupt):
                raise
            except BaseException as error:
                answer("error", error)
            else:
                answer("done", None)
    except (BrokenPipeError, KeyboardInterrupt):
        pass  # the parent process has ended
    os._exit(0)  # nothing is left to clean up; Python's own exit could complain about closed pipes
