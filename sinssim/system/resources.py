"""Resources of the machine: the memory available to a process, and thread pools whose work is abandoned after an
interruption.
"""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

import numpy as np

T = TypeVar("T", bound=np.ndarray)

_CGROUP = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))
_M_MMAP_THRESHOLD = -3
"""Number of the setting in glibc's malloc.h."""


def give_back_memory() -> None:
    """Return freed memory to the system, as far as it allows it.

    glibc keeps the freed memory of arrays below 32 MB, which another allocation reuses only if it fits.
    """
    with suppress(AttributeError, OSError):  # only glibc has the function
        ctypes.CDLL(None).malloc_trim(0)


def map_large_arrays() -> None:
    """Let the C library take every array above one megabyte from the system by itself, and return it when it is freed.

    By itself glibc puts arrays of up to 32 MB between the small ones as soon as one of that size has been freed, where
    a freed one stays a gap unless another fits. The setting holds for the rest of the process.
    """
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, 1 << 20)


def shared(array: T, known: list[T]) -> T:
    """Return the array among the known ones that equals this one, so that this one's memory is freed; a new one becomes
    known."""
    for other in known:
        if other.dtype == array.dtype and np.array_equal(other, array):
            return other
    known.append(array)
    return array


def machine_memory() -> float:
    """Return the memory that a process can have, bytes, infinity if the system does not say it.

    It is the smallest of the machine's physical memory, the limit of its container and that of the process (`ulimit
    -v`).
    """
    limits = [math.inf]
    with suppress(AttributeError, OSError, ValueError):  # Windows has no sysconf
        limits.append(float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")))
    for file in _CGROUP:
        with suppress(OSError, ValueError):  # "max" means that there is no limit
            limits.append(float(file.read_text()))
    with suppress(ImportError, OSError, ValueError):
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_AS)
        if soft != resource.RLIM_INFINITY:
            limits.append(float(soft))
    return min(limits)


@contextmanager
def thread_pool(count: int | None) -> Iterator[ThreadPoolExecutor]:
    """Provide a thread pool for the block, which is joined at its end, but not after an exception.

    Python's own pool would then still wait for compilations and for navigations over hours of samples. The work must be
    safe to abandon: it must not write files.
    """
    pool = ThreadPoolExecutor(count)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()
