"""The memory available to a process on this machine."""

from __future__ import annotations

import ctypes
import math
import os
from contextlib import suppress
from pathlib import Path

_CGROUP = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))


def give_back_memory() -> None:
    """Return freed memory to the system, as far as it allows it.

    glibc keeps the freed memory of arrays below 32 MB, which another allocation reuses only if it fits.
    """
    with suppress(AttributeError, OSError):  # only glibc has the function
        ctypes.CDLL(None).malloc_trim(0)


def machine_memory() -> float:
    """Return the memory that a process can have, bytes.

    Returns:
        The smallest of the machine's physical memory, the limit of its container and the limit of the process
        (`ulimit -v`); infinity if the system does not give them.
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
