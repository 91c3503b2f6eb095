"""Threads that nobody waits for once their work is no longer wanted."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager


@contextmanager
def thread_pool(count: int | None) -> Iterator[ThreadPoolExecutor]:
    """Make threads for the block; what is not done at its end is waited for, unless the block is broken off.

    Python's own pool waits in that case too: for kernels that compile and for navigations over hours of samples.

    Args:
        count: how many threads at most.

    Yields:
        The pool. Its work must be such that it can be left alone: no files.
    """
    pool = ThreadPoolExecutor(count)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()
