"""The work of an ensemble: the errors of its runs at the epochs, and the processes and clusters that compute them.

A run is computed by the same functions, on the same numbers, as by `sinssim run`, and has the same bits. Of aided runs,
what the filter states about the errors is kept, too.

A task is a group of runs of any ensemble, and writes its own file. Processes are for runs with a filter, which hold
Python's lock most of the time. One starts before there is work for it, and loads the program while the ensemble is
planned; then it is sent the plan, with the true motion that all runs share, and later the next one. All workers of a
cluster of dask.distributed (the extra `cluster`) must see the ensemble's directory. A worker that dies costs its group,
which another computes again.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution
from sinssim.errors import InputError, RunError, SinssimError
from sinssim.estimation import Estimate
from sinssim.experiments.ensembles.batch_navigation import compute_as_batch, why_not_batch
from sinssim.experiments.ensembles.ensemble_directory import write_chunk
from sinssim.experiments.ensembles.ensemble_errors import (
    WITHIN,
    OnRun,
    RunErrors,
    check_finite,
    empty,
    rows_at,
    store_errors,
)
from sinssim.experiments.ensembles.ensemble_plan import ALL, Member, Plan, TruthCache, member, motions_differ
from sinssim.experiments.workload import Abandoned, Executor, Part, Threads, WorkerDiedError
from sinssim.scenario import Scenario
from sinssim.simulation.navigation_stage import by_one, navigate
from sinssim.simulation.total_system_error import path_values
from sinssim.simulation.truth_and_sensors import Sensed, Truth, sense
from sinssim.statistics.requirements import MISS

if TYPE_CHECKING:
    from sinssim.simulation.truth_comparison import Aided


class Group(NamedTuple):
    """A task: some runs of an ensemble, and the folder of its files."""

    plan: Plan
    runs: range
    folder: Path


def errors_of_runs(plan: Plan, runs: range, truths: TruthCache, on_run: OnRun | None = None) -> RunErrors:
    """Compute some runs of an ensemble and return their errors at its epochs.

    Inertial runs on one motion are computed together where the batch serves them, and one by one otherwise. A run that
    fails has the reason in `failure`, and its errors are NaN.
    """
    errors = empty(len(runs), len(plan.epochs), plan.keys, tuple(plan.blocks), plan.sensors, plan.path)
    members = [member(plan.scenario, number) for number in runs]
    for row, (number, run) in enumerate(zip(runs, members, strict=True)):
        errors.number[row], errors.seed[row] = number, run.seed
        for key, value in run.values.items():
            errors.values[key][row] = value
    left = list(range(len(runs)))
    if why_not_batch(plan, truths) is None:
        left = compute_as_batch(plan, members, truths, errors, on_run)
    for row in left:
        try:
            errors_of_run(plan, members[row], truths, errors, row)
        except SinssimError as error:
            _fail(errors, row, str(error))
        except MemoryError:  # no property of the run: another machine, or fewer runs at a time, would do
            raise
        except Exception as error:  # whatever went wrong in one of a thousand runs is a result to report
            _fail(errors, row, _unexpected(error))
        if on_run is not None:
            on_run()
    return errors


def make_chunk(group: Group, truths: TruthCache, on_part: Callable[[int], None] = lambda count: None) -> None:
    """Compute a group of runs and write its file; `on_part` is called with the number of its runs that are finished.

    It may be done twice, by any process: the file is the same and is renamed into place.
    """
    finished = itertools.count(1)
    errors = errors_of_runs(group.plan, group.runs, truths, lambda: on_part(next(finished)))
    write_chunk(errors, group.plan, group.folder)


def errors_of_run(plan: Plan, run: Member, truths: TruthCache, errors: RunErrors, row: int) -> None:
    """Compute one run, and fill in its row."""
    from sinssim.scenario.planned_limits import check_route, check_route_flown

    scenario = run.scenario
    if run.values:
        check_route(scenario)
    truth = truths.of(scenario)
    check_route_flown(scenario, truth.time, truth.state)
    sensed = sense(scenario, truth)
    errors.end[row] = truth.time[-1]
    if plan.filtered:
        compute_filtered(plan, sensed, errors, row)
        return
    solution = navigate(by_one(scenario, plan.solution), sensed).solutions[plan.solution]
    epochs, rows = rows_at(plan.epochs, solution.time)
    error = truth.error_of(solution, truth.axes(scenario.navigation.frame), rows)
    check_finite(error)
    store_errors(errors, row, error, epochs)
    if errors.path:
        _store_path(plan, scenario, truth, solution, errors, row)


def _store_path(
    plan: Plan, scenario: Scenario, truth: Truth, solution: NavSolution, errors: RunErrors, row: int
) -> None:
    """Fill in what is kept by the planned path of a flight."""
    reached = np.flatnonzero(plan.epochs <= truth.time[-1] + WITHIN)
    for name, column in path_values(scenario, truth, solution, plan.epochs[reached]).items():
        if name.startswith(f"{MISS}_"):  # of no instant, also in a run that ends before others
            errors.column(name)[row] = column[0]
        else:
            errors.column(name)[row, reached] = column


def _unexpected(error: Exception) -> str:
    """Return the kind of an error that nobody foresaw, with its text, or where it arose if it has none."""
    if str(error).strip():
        return f"{type(error).__name__}: {error}"
    at = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} without a message in {Path(at.filename).name}, line {at.lineno}."


def _fail(errors: RunErrors, row: int, text: str) -> None:
    """Mark a run as failed."""
    errors.failure[row] = text or "it failed without a message."
    errors.final[row] = np.nan
    for name in errors.names:
        errors.column(name)[row] = np.nan


_ROW_S = 1.0
"""A covariance is kept each second: epochs are at whole seconds, or samples in a run of less than 500 s."""
DIVERGED = "the filter diverged"
"""Beginning of the failure of a run whose filter diverged."""
_DEPENDENT = 1e-9
"""Eigenvalue of the correlation matrix of a block below which a combination of its states counts as known."""


def compute_filtered(plan: Plan, sensed: Sensed, errors: RunErrors, row: int) -> None:
    """Run the filter of a run, and fill in its row."""
    from sinssim.scenario.filter_model import with_states
    from sinssim.scenario.navigation_section import initial_state_with_errors
    from sinssim.simulation.aided_run import aid_run

    truth, scenario = sensed.truth, with_states(sensed.scenario)
    assert isinstance(truth, Truth)  # an ensemble is simulated
    assert sensed.errors is not None
    trajectory, start = truth.trajectory, truth.first
    initial = initial_state_with_errors(start, scenario.navigation.initial_error, trajectory.ellipsoid, scenario.seed)
    step = float(np.diff(plan.epochs).min(initial=np.inf))
    aided = aid_run(
        scenario, trajectory, sensed.imu, initial, sensed.errors, monitored=sensed.readings.monitored,
        history=False, row_s=_ROW_S if step >= _ROW_S - WITHIN else 0.0,
    )  # fmt: skip
    estimate = aided.estimate
    if estimate.divergence is not None:
        reason = estimate.divergence.reason.rstrip(".")
        raise RunError(f"{DIVERGED} at t = {estimate.divergence.time:.2f} s: {reason}.")
    epochs, rows = rows_at(plan.epochs, estimate.time)
    error = aided.error_at(rows)
    check_finite(error)
    store_errors(errors, row, error, epochs)
    assert errors.sigma is not None
    errors.sigma[row, epochs] = estimate.sigma[rows[:-1], :9]
    _store_nees(aided, errors, row, epochs, rows[:-1])
    _store_nis(plan, estimate, errors, row)
    if errors.path:
        _store_path(plan, scenario, truth, estimate.solution, errors, row)


def _store_nees(aided: Aided, errors: RunErrors, row: int, epochs: NDArray[np.intp], rows: NDArray[np.intp]) -> None:
    """Fill in the NEES at the last stored covariance at or before each epoch."""
    estimate = aided.estimate
    if not len(estimate.rows):
        return
    place = np.searchsorted(estimate.rows, rows, side="right") - 1
    epochs, place = epochs[place >= 0], place[place >= 0]
    actual, covariance = aided.state_errors_at(estimate.rows[place]), estimate.covariance[place]
    compared = estimate.model.compared
    for name in errors.nees:
        seen = np.vstack(list(compared.values())) if name == ALL else compared.get(name)
        if seen is None:
            continue  # a run whose varied keys give its filter other states
        square, freedom = normalised(actual @ seen.T, seen @ covariance @ seen.T)
        errors.nees[name][row, epochs], errors.nees_freedom[name][row, epochs] = square, freedom


def normalised(errors: Array, covariance: Array) -> tuple[Array, Array]:
    """Return normalised squared errors xᵀP⁻¹x of errors, (K, n), and the rank of their covariance P, (K,) each.

    States that are known exactly, and combinations of states that depend on others, do not count: an alignment at rest
    leaves a tilt and an accelerometer bias that are one error, not two. NaN where P has no positive variance.
    """
    scale = np.sqrt(np.maximum(np.einsum("kii->ki", covariance), 0.0))
    scale[scale == 0.0] = np.inf
    root, vectors = np.linalg.eigh(covariance / (scale[:, :, None] * scale[:, None, :]))
    counts = root > _DEPENDENT
    along = np.einsum("kij,ki->kj", vectors, errors / scale)
    square = np.sum(np.where(counts, along**2 / np.where(counts, root, 1.0), 0.0), axis=1)
    freedom = counts.sum(axis=1).astype(np.float64)
    return np.where(freedom > 0.0, square, np.nan), np.where(freedom > 0.0, freedom, np.nan)


def _store_nis(plan: Plan, estimate: Estimate, errors: RunErrors, row: int) -> None:
    """Fill in the sums of the normalised squared innovations between epochs; rejected readings count, too."""
    for name in plan.sensors:
        square, freedom = np.zeros((2, len(plan.epochs)))
        for innovations in estimate.innovations:
            if innovations.sensor != name:
                continue
            there = np.isfinite(innovations.nis)
            at = np.searchsorted(plan.epochs, innovations.time[there] - WITHIN)
            at = np.minimum(at, len(plan.epochs) - 1)
            square += np.bincount(at, innovations.nis[there], len(plan.epochs))
            freedom += np.bincount(at, minlength=len(plan.epochs)) * float(innovations.value.shape[1])
        errors.nis[name][row], errors.nis_freedom[name][row] = square, freedom


class Processes(Threads[Group]):
    """Threads that each have their groups of runs computed by a process, which is sent the motion that runs share."""

    lives = 3

    def __init__(self, number: int, truths: TruthCache, early: int = 0) -> None:
        """Start some processes `early`, before there is work for them; the others start when they are needed."""
        super().__init__(number, lambda stop: _Process(self, stop).compute)
        self._truths, self._ready = truths, [_start() for _ in range(early)]
        self._lock = threading.Lock()
        self._last: tuple[Plan | None, bytes] = (None, b"")

    def take(self) -> subprocess.Popen[bytes]:
        """Return a process without work: one that has started already, or another one."""
        try:
            return self._ready.pop()
        except IndexError:
            return _start()

    def told(self, plan: Plan) -> bytes:
        """Return what a process is told before the first group of runs of a plan: the plan, and the runs' motion."""
        with self._lock:
            if self._last[0] is not plan:
                self._last = plan, _told(plan, self._truths)
            return self._last[1]

    def stop(self) -> None:
        super().stop()
        while self._ready:
            process = self._ready.pop()
            process.kill()
            process.wait()

    def failure(self, task: Group, death: Exception) -> RunError:
        return RunError(
            f"{self.lives} processes died while computing the runs {task.runs.start} to {task.runs.stop - 1} of the "
            f"ensemble, the last one by {death}. All other finished runs are kept; a machine with more "
            "memory, or fewer --threads, may help."
        )


def _told(plan: Plan, truths: TruthCache) -> bytes:
    shared = None if motions_differ(plan.scenario) else truths.of(plan.scenario)
    try:
        return pickle.dumps((plan, shared), pickle.HIGHEST_PROTOCOL)
    except (pickle.PicklingError, AttributeError, TypeError):  # a motion of functions is computed by each process
        return pickle.dumps((plan, None), pickle.HIGHEST_PROTOCOL)


def _start() -> subprocess.Popen[bytes]:
    """Start a process that loads the program and waits for its tasks."""
    program = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve()"
    # In its own process group: Ctrl-C reaches only this process, which then ends the other.
    return subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0,
        env={**os.environ, "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip


class _Process:
    """A worker process, taken when first needed, and another one after it died."""

    def __init__(self, pool: Processes, stop: threading.Event) -> None:
        self._pool, self._stop = pool, stop
        self._process: subprocess.Popen[bytes] | None = None
        self._plan: Plan | None = None
        threading.Thread(target=self._kill_on_stop, daemon=True).start()

    def compute(self, group: Group, part: Part) -> None:
        """Have a group computed; WorkerDiedError if the process dies."""
        if self._process is None:
            self._process, self._plan = self._pool.take(), None
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            with contextlib.suppress(BrokenPipeError):
                if self._plan is not group.plan:
                    process.stdin.write(self._pool.told(group.plan))
                    self._plan = group.plan
                pickle.dump((group.runs, group.folder), process.stdin)
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
    import sinssim.simulation.aided_run
    import sinssim.truth.curve  # noqa: F401  (without effect on numbers: loaded before the task comes, it starts earlier)

    def answer(kind: str, value: object) -> None:
        left = memoryview(pickle.dumps((kind, value)))
        while left:
            left = left[pipe.write(left) :]

    truths = TruthCache()
    try:
        while (task := _received(sys.stdin.buffer)) is not None:
            if isinstance(task[0], Plan):
                plan, shared = task
                if shared is not None:
                    truths.keep(plan.scenario, shared)
                continue
            try:
                make_chunk(Group(plan, *task), truths, lambda count: answer("part", count))
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


def compute_task(group: Group) -> None:
    """Compute a group of runs on a worker; InputError if it does not see the folder."""
    if not group.folder.is_dir():
        raise InputError(
            f"a worker on {os.uname().nodename} does not see the folder {group.folder}. All workers need the same file "
            "system: give a directory on a shared one with -o."
        )
    make_chunk(group, _truths())


class Cluster(Executor[Group]):
    """A dask cluster; its scheduler begins a group of runs anew whose worker has died."""

    def __init__(self, workers: int | None, scheduler: str | None) -> None:
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
        with ExitStack() as stack:
            stack.enter_context(dask.config.set(_SETTINGS))
            if scheduler is None:
                # one thread a worker: numba's own threads must not run inside several threads of dask; a scheduler
                # without a dashboard still has a web server, whose usual port another cluster may have
                local = LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1",
                    scheduler_kwargs={"dashboard_address": "127.0.0.1:0"}, silence_logs=logging.CRITICAL,
                )  # fmt: skip
                client = stack.enter_context(Client(stack.enter_context(local)))
            else:
                client = stack.enter_context(_client(Client, scheduler))
            self._executor = client.get_executor(pure=False)
            stack.callback(self._executor.shutdown, wait=False)
            self._stack = stack.pop_all()

    def submit(self, task: Group, part: Part) -> Future[Any]:
        future: Future[Any] = self._executor.submit(compute_task, task)
        return future

    def stop(self) -> None:
        self._stack.close()

    def failure(self, task: Group, death: Exception) -> RunError:
        return RunError(
            f"{_TASK_LIVES} workers died while computing the runs {task.runs.start}-{task.runs.stop - 1} of the "
            "ensemble. All other finished runs are kept; workers with more memory may help."
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
