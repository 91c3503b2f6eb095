"""Thread pools whose work is abandoned after an interruption."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager


@contextmanager
def thread_pool(count: int | None) -> Iterator[ThreadPoolExecutor]:
    """Provide a thread pool for the block; at its end the pool is joined, unless the block ends with an exception.

    Python's own pool would wait in that case, too, for compilations and for navigations over hours of samples.

    Yields:
        The pool. Its work must be safe to abandon: it must not write files.
    """
    pool = ThreadPoolExecutor(count)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()
