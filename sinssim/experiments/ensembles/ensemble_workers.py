"""Executors of an ensemble: processes on this machine, and a cluster of dask.distributed (the extra `cluster`).

Processes are for runs with a filter, which hold Python's lock most of the time. One starts before there is work for
it, and loads the program while the ensemble is planned; then it is sent the plan, with the true motion that all runs
share. A task on a cluster computes a group of runs and writes its own file into the ensemble's directory, which all
workers must see. A worker that dies costs its group, which another computes again.
"""

from __future__ import annotations

import contextlib
import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
from concurrent.futures import Future
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles.ensemble_directory import make_chunk
from sinssim.experiments.ensembles.ensemble_plan import Plan, TruthCache, motions_differ
from sinssim.experiments.workload import Abandoned, Executor, Part, Threads, WorkerDiedError


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


class Processes(Threads[range]):
    """Threads that each have their groups of runs computed by a process, which is sent the motion that runs share."""

    lives = 3

    def __init__(self, number: int, plan: Plan, folder: Path, spare: SparePool, truths: TruthCache) -> None:
        task = _task(plan, folder, truths)
        super().__init__(number, lambda stop: _Process(task, spare, stop).compute)

    def failure(self, task: range, death: Exception) -> RunError:
        return RunError(
            f"{self.lives} processes died while computing the runs {task.start} to {task.stop - 1} of the "
            f"ensemble, the last one by {death}. All other finished runs are kept; a machine with more "
            "memory, or fewer --threads, may help."
        )


def _task(plan: Plan, folder: Path, truths: TruthCache) -> bytes:
    """Return what a process is told before the first group of runs: plan, folder, and the motion that runs share."""
    shared = None if motions_differ(plan.scenario) else truths.of(plan.scenario)
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
        threading.Thread(target=self._kill_on_stop, daemon=True).start()

    def compute(self, runs: range, part: Part) -> None:
        """Have a group computed; WorkerDiedError if the process dies."""
        process = self._process or self._begin()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            with contextlib.suppress(BrokenPipeError):
                pickle.dump(runs, process.stdin)
                process.stdin.flush()
            while (answer := _received(process.stdout)) is not None:
                kind, value = answer
                if kind == "done":
                    return
                if kind == "error":
                    raise value
                part(value)
        except BaseException:
            process.kill()
            raise
        if self._stop.is_set():
            raise Abandoned
        code, self._process = process.wait(), None
        raise WorkerDiedError(signal.Signals(-code).name if code < 0 else f"exit code {code}")

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
    import sinssim.experiments.ensembles.ensemble_execution  # what every task needs, loaded before the task comes
    import sinssim.scenario.schema
    import sinssim.simulation.aided_run
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
                make_chunk(task[0], runs, task[1], truths, lambda count: answer("part", count))
            except (BrokenPipeError, KeyboardInterrupt):
                raise
            except BaseException as error:
                answer("error", error)
            else:
                answer("done", None)
    except (BrokenPipeError, KeyboardInterrupt):
        pass  # the parent process has ended
    os._exit(0)  # nothing is left to clean up; Python's own exit could complain about closed pipes


_PATIENCE_S = 10.0
_TASK_LIVES = 3
_SETTINGS: dict[str, Any] = {
    "distributed.scheduler.allowed-failures": _TASK_LIVES,
    "distributed.logging.distributed": "error",
    "distributed.worker.daemon": True,
    "distributed.comm.timeouts.connect": f"{_PATIENCE_S:g}s",
}


@lru_cache(maxsize=1)
def _truths() -> TruthCache:
    """Return the true motions that this worker keeps."""
    return TruthCache()


def compute_task(plan: Plan, folder: str, runs: range) -> None:
    """Compute a group of runs on a worker; InputError if it does not see the folder."""
    if not Path(folder).is_dir():
        raise InputError(
            f"a worker on {os.uname().nodename} does not see the folder {folder}. All workers need the same file "
            "system: give a directory on a shared one with -o."
        )
    make_chunk(plan, runs, Path(folder), _truths())


class Cluster(Executor[range]):
    """A dask cluster; its scheduler begins a group of runs anew whose worker has died."""

    def __init__(self, plan: Plan, folder: Path, *, workers: int | None, scheduler: str | None) -> None:
        """Connect to a scheduler, for example "tcp://10.0.0.1:8786", or start a number of workers on this machine."""
        try:
            import dask
            from distributed import Client, KilledWorker, LocalCluster
        except ImportError as error:
            raise InputError(
                "--workers and --scheduler need the package distributed: install sinssim with its extra, "
                "pip install 'sinssim[cluster]'."
            ) from error
        self.death = KilledWorker
        self._plan, self._folder = plan, str(folder)
        with ExitStack() as stack:
            stack.enter_context(dask.config.set(_SETTINGS))
            if scheduler is None:
                # one thread a worker: numba's own threads must not run inside several threads of dask
                local = LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1",
                    silence_logs=logging.CRITICAL,
                )  # fmt: skip
                client = stack.enter_context(Client(stack.enter_context(local)))
            else:
                client = stack.enter_context(_client(Client, scheduler))
            self._executor = client.get_executor(pure=False)
            stack.callback(self._executor.shutdown, wait=False)
            self._stack = stack.pop_all()

    def submit(self, task: range, part: Part) -> Future[Any]:
        future: Future[Any] = self._executor.submit(compute_task, self._plan, self._folder, task)
        return future

    def stop(self) -> None:
        self._stack.close()

    def failure(self, task: range, death: Exception) -> RunError:
        return RunError(
            f"{_TASK_LIVES} workers died while computing the runs {task.start}-{task.stop - 1} of the ensemble. All "
            "other finished runs are kept; workers with more memory may help."
        )


def _client(client: Any, scheduler: str) -> Any:
    """Connect to a scheduler."""
    try:
        return client(scheduler, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"the scheduler {scheduler} cannot be reached within {_PATIENCE_S:g} s. Start one with `dask scheduler`, "
            "give its address as tcp://host:port, and check the network."
        ) from error
