"""Being asked to stop, by Ctrl-C or by other means, and not losing the question."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import NoReturn

_SOON = 0.01  # [s]


@contextlib.contextmanager
def interruptible(*signals: signal.Signals) -> Iterator[None]:
    """Raise KeyboardInterrupt when one of the signals comes, so that what is to be tidied up then is tidied up.

    Python's own handler raises wherever it is. Inside the import system that can leave the import lock taken, and a
    thread that imports waits for ever; inside a finalizer the exception is printed and forgotten. Here the one is put
    off, and the other is raised again.

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
        if frame is not None and frame.f_code.co_filename.startswith("<frozen importlib"):
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


def _stop() -> NoReturn:
    raise KeyboardInterrupt
