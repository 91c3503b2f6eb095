"""The process: interruptions by signals, the memory that it can have, and thread pools whose work can be abandoned."""

from __future__ import annotations

import math
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NoReturn, TypeVar

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

    import numpy as np

T = TypeVar("T")
A = TypeVar("A", bound="np.ndarray")

_SOON = 0.01  # [s]
_IMPORT = "<frozen importlib"
_COMPILER = re.compile(r"[/\\](numba|llvmlite)[/\\]")
"""Files of numba; compiled kernels have none, so that they can be interrupted."""


@contextmanager
def interruptible(*signals: signal.Signals) -> Iterator[None]:
    """Raise KeyboardInterrupt on any of the signals, so that clean-up runs as after Ctrl-C; in the main thread
    only.

    Python's own handler raises anywhere. Inside the import system it can leave the import lock held, so that other
    importing threads wait forever. Inside the compiler of kernels it can leave an incomplete kernel, which causes other
    errors. Inside a finalizer the exception is printed and lost. Here the first two are postponed, and the last is
    raised again.
    """
    again: list[threading.Timer] = []

    def soon(number: int) -> None:
        again.append(threading.Timer(_SOON, signal.pthread_kill, (threading.main_thread().ident, number)))
        again[-1].start()

    def stop(number: int, frame: FrameType | None) -> None:
        if frame is not None and (frame.f_code.co_filename.startswith(_IMPORT) or _compiles(frame)):
            soon(number)
        else:
            _stop()

    def unraisable(what: sys.UnraisableHookArgs) -> None:
        if what.exc_type is KeyboardInterrupt:
            soon(signals[0])
        else:
            hook(what)

    hook, sys.unraisablehook = sys.unraisablehook, unraisable
    before = {number: signal.signal(number, stop) for number in signals}
    try:
        yield
    finally:
        for timer in again:
            timer.cancel()
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook


def aside(work: Callable[[], T]) -> T:
    """Run uninterruptible work in a separate thread, so that the caller reacts to an interruption at once; after one
    the work continues to its end, and its result is discarded. It is done in the current thread if that is not the main
    thread, which alone receives signals, or if a module is being imported, for which the work might wait."""
    if threading.current_thread() is not threading.main_thread() or _imports(sys._getframe()):
        return work()
    from concurrent.futures import Future  # imported here, because other commands then start faster

    result: Future[T] = Future()

    def do() -> None:
        try:
            result.set_result(work())
        except BaseException as error:
            result.set_exception(error)

    threading.Thread(target=do, name="aside").start()
    return result.result()


def _imports(frame: FrameType | None) -> bool:
    """Return whether a module is being imported in a frame or above it."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORT):
            return True
        frame = frame.f_back
    return False


def _compiles(frame: FrameType | None) -> bool:
    """Return whether the compiler of kernels is running in a frame or above it, instead of only being waited for."""
    while frame is not None:
        if frame.f_code is aside.__code__:
            return False
        if _COMPILER.search(frame.f_code.co_filename):
            return True
        frame = frame.f_back
    return False


def _stop() -> NoReturn:
    raise KeyboardInterrupt


_CGROUP = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))
_M_MMAP_THRESHOLD = -3
"""Number of the setting in glibc's malloc.h."""


def give_back_memory() -> None:
    """Return freed memory to the system, as far as it allows it.

    glibc keeps the freed memory of arrays below 32 MB, which another allocation reuses only if it fits.
    """
    import ctypes

    with suppress(AttributeError, OSError):  # only glibc has the function
        ctypes.CDLL(None).malloc_trim(0)


def map_large_arrays() -> None:
    """Let the C library take every array above one megabyte from the system by itself, and return it when it is freed.

    By itself glibc puts arrays of up to 32 MB between the small ones as soon as one of that size has been freed, where
    a freed one stays a gap unless another fits. The setting holds for the rest of the process.
    """
    import ctypes

    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, 1 << 20)


def shared(array: A, known: list[A]) -> A:
    """Return the array among the known ones that equals this one, so that this one's memory is freed; a new one becomes
    known."""
    import numpy as np

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
    from concurrent.futures import ThreadPoolExecutor

    pool = ThreadPoolExecutor(count)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()
