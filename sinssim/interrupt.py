"""Being asked to stop, by Ctrl-C or by other means, and not losing the question."""

from __future__ import annotations

import contextlib
import re
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import NoReturn

_SOON = 0.01  # [s]
_COMPILER = re.compile(r"[/\\](numba|llvmlite)[/\\]")
"""Its files; compiled kernels have none, so that they are interrupted."""


@contextlib.contextmanager
def interruptible(*signals: signal.Signals) -> Iterator[None]:
    """Raise KeyboardInterrupt when one of the signals comes, so that what is to be tidied up then is tidied up.

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
        if frame is not None and (frame.f_code.co_filename.startswith("<frozen importlib") or _compiles(frame)):
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


def _compiles(frame: FrameType | None) -> bool:
    """Return whether the compiler of kernels is at work in a frame or above it."""
    while frame is not None:
        if _COMPILER.search(frame.f_code.co_filename):
            return True
        frame = frame.f_back
    return False


def _stop() -> NoReturn:
    raise KeyboardInterrupt
