"""Judging mutants: each in a worker's own copy of the checkout, so that the checkout itself is never edited."""

from __future__ import annotations

import os
import resource
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.work_item import WorkResult

from tests.mutation.mutants import ROOT, Mutant, Target

MEMORY = 12 * 2**30
"""Most address space of a mutant's process, bytes: one that fills the memory must not take the machine with it."""

COMPILING_S = 120.0
"""Time given to a mutant beyond three times that of the unchanged package: the whole engine compiles in 30 s on a busy
core, and a mutant that never ends is worth no longer wait."""

_LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "runs", "build", "dist")

_tree = Path()


def command(target: Target) -> list[str]:
    """Return the command that runs a target's tests until the first failure."""
    options = ["-q", "-x", "--no-header", "--tb=line", "-p", "no:cacheprovider", "--basetemp=basetemp"]
    if target.plain:
        options += ["-p", "tests.mutation.plain_kernels"]
    return [sys.executable, "-m", "pytest", *options, *target.tests]


class CopiedTree:
    """A temporary copy of the checkout, gone at the end of the with-block.

    Args:
        cache: folder of the compiled kernels, shared by all copies: a kernel that no mutation touches is compiled once.
    """

    def __init__(self, cache: Path) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="sinssim-mutation-")) / ROOT.name
        shutil.copytree(ROOT, self.path, ignore=_LEFT_OUT)
        # Indices are checked: what lies beside an array would decide what a mutant that reads there does.
        self.environment = {
            "PYTHONPATH": str(self.path), "SINSSIM_CACHE": str(cache), "NUMBA_BOUNDSCHECK": "1",
        }  # fmt: skip

    def __enter__(self) -> CopiedTree:
        return self

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.path.parent, ignore_errors=True)


def unchanged_s(target: Target, cache: Path) -> float:
    """Run a target's tests on the unchanged package, and leave its compiled kernels for the mutants.

    Args:
        target: what they judge.
        cache: folder of the compiled kernels.

    Returns:
        The time that it took, compilation included, s.

    Raises:
        RuntimeError: a test fails without any mutation.
    """
    with CopiedTree(cache) as tree:
        begin = time.perf_counter()
        environment = {**os.environ, **tree.environment}
        done = subprocess.run(
            command(target), cwd=tree.path, env=environment, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RuntimeError(f"{target.file}: a test fails without any mutation:\n{done.stdout}{done.stderr}")
        return time.perf_counter() - begin


def _start(trees: str, cache: Path) -> None:
    """Begin a worker process: a copy of the checkout of its own, and little memory."""
    global _tree
    tree = CopiedTree(cache)
    _tree = tree.path
    Path(trees, str(os.getpid())).write_text(str(tree.path.parent))
    os.environ.update(tree.environment)
    os.chdir(_tree)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def _judge(mutant: Mutant, limit_s: float) -> tuple[WorkResult, float]:
    begin = time.perf_counter()
    result = mutate_and_test([mutant.specification(_tree)], shlex.join(command(mutant.target)), limit_s)
    return result, time.perf_counter() - begin


def judged(
    mutants: list[Mutant], unchanged: dict[str, float], cache: Path, workers: int
) -> Iterator[tuple[Mutant, WorkResult, float]]:
    """Run the tests on mutants.

    Args:
        mutants: which.
        unchanged: time of each target's tests without a mutation, s.
        cache: folder of the compiled kernels.
        workers: how many at once.

    Yields:
        The mutants as they are done, cosmic-ray's results, and the times that it took, s.
    """
    with tempfile.TemporaryDirectory() as trees:
        try:
            with ProcessPoolExecutor(workers, initializer=_start, initargs=(trees, cache)) as pool:
                limits = [3.0 * unchanged[m.target.file] + COMPILING_S for m in mutants]
                tasks = {pool.submit(_judge, m, limit): m for m, limit in zip(mutants, limits, strict=True)}
                try:
                    for task in as_completed(tasks):
                        yield tasks[task], *task.result()
                finally:
                    pool.shutdown(cancel_futures=True)
        finally:
            for name in Path(trees).iterdir():
                shutil.rmtree(name.read_text(), ignore_errors=True)
