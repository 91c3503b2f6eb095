"""Handles signals that ask the program to stop, including Ctrl-C, wherever they arrive."""

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
"""Files of numba; compiled kernels have none, so that they can be interrupted."""


@contextlib.contextmanager
def interruptible(*signals: signal.Signals) -> Iterator[None]:
    """Raise KeyboardInterrupt on any of the signals, so that clean-up runs as after Ctrl-C (*signals: the signals; main
    thread only).

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
    """Run uninterruptible work in a separate thread, so that the caller reacts to an interruption at once.

    After an interruption the work continues to its end, and its result is discarded.

    Args:
        work: the work. It is done in the current thread if that is not the main thread, which alone receives signals,
            or if a module is being imported, for which the work might wait.
    """
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
