"""Signals that ask the program to stop, Ctrl-C included, heard wherever they arrive."""

from __future__ import annotations

import contextlib
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import NoReturn, TypeVar

T = TypeVar("T")

_SOON = 0.01  # [s]
_IMPORT = "<frozen importlib"
_COMPILER = re.compile(r"[/\\](numba|llvmlite)[/\\]")
"""Its files; compiled kernels have none, so that they are interrupted."""


@contextlib.contextmanager
def interruptible(*signals: signal.Signals) -> Iterator[None]:
    """Raise KeyboardInterrupt on any of the signals, so that clean-up runs as after Ctrl-C.

    Python's own handler raises wherever it is. Inside the import system that can leave the import lock taken, and a
    thread that imports waits for ever; inside the compiler of kernels it can leave half a kernel, and errors of its own
    come instead; inside a finalizer the exception is printed and forgotten. Here the first two are put off, and the
    last is raised again.

    Args:
        *signals: which; main thread only.

    Raises:
        KeyboardInterrupt: one of them came.
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
    """Do something that must not be interrupted in a thread of its own, so that who waits for it hears at once.

    What the interrupted thread waited for goes on to its end, and its result is dropped.

    Args:
        work: what to do. It is done in this thread if that is not the main thread, which hears of no signals, or if it
            is importing a module, which the work might wait for.

    Returns:
        Its result.

    Raises:
        KeyboardInterrupt: an interruption came before the end.
    """
    if threading.current_thread() is not threading.main_thread() or _imports(sys._getframe()):
        return work()
    from concurrent.futures import Future  # here, for what starts without it starts faster

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
    """Return whether the compiler of kernels is at work in a frame or above it, and not only waited for."""
    while frame is not None:
        if frame.f_code is aside.__code__:
            return False
        if _COMPILER.search(frame.f_code.co_filename):
            return True
        frame = frame.f_back
    return False


def _stop() -> NoReturn:
    raise KeyboardInterrupt
