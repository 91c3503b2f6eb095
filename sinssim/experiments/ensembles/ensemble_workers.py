"""Worker processes of an ensemble on this machine.

And on a cluster by dask.distributed (the optional extra `cluster`).

Processes are for runs with a filter, which hold Python's lock most of the time. One starts before there is work for
it, and loads the program while the ensemble is planned; then it is sent the plan, with the true motion that all runs
share. A task on a cluster computes a group of runs and writes its own file into the ensemble's directory, which all
workers must see; the scheduler carries only the numbers of runs. A worker that dies costs its group, which another
computes again.
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
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles.ensemble_directory import make_chunk
from sinssim.experiments.ensembles.ensemble_execution import OnRun
from sinssim.experiments.ensembles.ensemble_plan import Plan, TruthCache, motions_differ
from sinssim.experiments.workload import Abandoned, Compute

_PROCESS_LIVES = 3
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

            for _ in range(_PROCESS_LIVES):
                if process.compute(runs, tell):
                    return
                on_run(-told)
                told = 0
            raise RunError(
                f"{_PROCESS_LIVES} processes died while computing the runs {runs.start} to {runs.stop - 1} of the "
                f"ensemble, the last one by {process.end}. All other finished runs are kept; a machine with more "
                "memory, or fewer --threads, may help."
            )

        return compute

    return worker


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


def compute_task(plan: Plan, folder: str, first: int, last: int) -> int:
    """Compute a group of runs on a worker and return their number; InputError if it does not see the folder."""
    if not Path(folder).is_dir():
        raise InputError(
            f"a worker on {os.uname().nodename} does not see the folder {folder}. All workers need the same file "
            "system: give a directory on a shared one with -o."
        )
    make_chunk(plan, range(first, last + 1), Path(folder), _truths())
    return last + 1 - first


def on_cluster(
    plan: Plan, folder: Path, groups: Sequence[range], on_run: OnRun, *, workers: int | None, scheduler: str | None
) -> None:
    """Compute groups of runs on a cluster.

    Args:
        workers: number of workers of a cluster on this machine, if there is no scheduler.
        scheduler: address of a scheduler, for example "tcp://10.0.0.1:8786".

    Raises:
        InputError: dask.distributed is not installed, the scheduler cannot be reached, or a worker does not see the
            folder.
        RunError: workers died again and again on the same group.
    """
    try:
        import dask
        from distributed import Client, KilledWorker, LocalCluster, as_completed
    except ImportError as error:
        raise InputError(
            "--workers and --scheduler need the package distributed: install sinssim with its extra, "
            "pip install 'sinssim[cluster]'."
        ) from error
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(_SETTINGS))
        if scheduler is None:
            # one thread a worker: numba's own threads must not run inside several threads of dask
            local = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                host="127.0.0.1",
                silence_logs=logging.CRITICAL,
            )
            client = stack.enter_context(Client(stack.enter_context(local)))
        else:
            client = stack.enter_context(_client(Client, scheduler))
        futures = [
            client.submit(
                compute_task, plan, str(folder), group.start, group.stop - 1,
                key=f"sinssim-{plan.digest[:12]}-{group.start}-{group.stop - 1}", pure=False,
            )
            for group in groups
        ]  # fmt: skip
        for future in as_completed(futures):
            try:
                on_run(future.result())
            except KilledWorker as killed:
                client.cancel(futures)
                numbers = "-".join(str(killed.task).split("-")[2:])
                raise RunError(
                    f"{_TASK_LIVES} workers died while computing the runs {numbers} of the ensemble. All other "
                    "finished runs are kept; workers with more memory may help."
                ) from killed


def _client(client: Any, scheduler: str) -> Any:
    """Connect to a scheduler."""
    try:
        return client(scheduler, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"the scheduler {scheduler} cannot be reached within {_PATIENCE_S:g} s. Start one with `dask scheduler`, "
            "give its address as tcp://host:port, and check the network."
        ) from error
