"""Runs of an ensemble on a cluster, by dask.distributed (the optional extra `cluster`).

Each task computes a group of runs and writes its own file into the ensemble's directory, which all workers must see.
The scheduler carries only the numbers of runs. A worker that dies costs its group, which another worker computes again.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import Any

from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles.execute import OnRun
from sinssim.experiments.ensembles.plan import Plan
from sinssim.experiments.ensembles.running.directory import make_chunk
from sinssim.experiments.ensembles.truth import TruthCache

_PATIENCE_S = 10.0
_LIVES = 3
_SETTINGS: dict[str, Any] = {
    "distributed.scheduler.allowed-failures": _LIVES,
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
                    f"{_LIVES} workers died while computing the runs {numbers} of the ensemble. All other finished "
                    "runs are kept; workers with more memory may help."
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
