"""A request to stop arrives, wherever the program is at the time."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable
from typing import Any

import pytest

from sinssim.interrupt import interruptible

USR1 = signal.SIGUSR1


def come() -> None:
    """Let the signal come, and give its handler a bytecode to run on."""
    signal.raise_signal(USR1)
    time.sleep(0.0)


def interrupted(what: Callable[[], None]) -> None:
    """Do something during which the signal comes, and wait for it."""
    with interruptible(USR1):
        what()
        time.sleep(5.0)
    pytest.fail("it was lost")


def test_in_ordinary_code() -> None:
    reached: list[str] = []

    def what() -> None:
        come()
        reached.append("went on")

    with pytest.raises(KeyboardInterrupt):
        interrupted(what)
    assert not reached


def test_in_the_import_system() -> None:
    """It is let finish, for it holds locks that others wait for."""
    done: dict[str, Any] = {"come": come}
    code = compile("import signal\nsignal.raise_signal(signal.SIGUSR1)\nfinished = 1", "<frozen importlib._x>", "exec")
    with pytest.raises(KeyboardInterrupt):
        interrupted(lambda: exec(code, done))
    assert done["finished"] == 1


def test_in_the_compiler() -> None:
    """A kernel is finished, however deep the compiler is in something else at the time."""
    done: dict[str, Any] = {"come": come}
    code = compile("come()\nfinished = 1", "/lib/site-packages/numba/core/dispatcher.py", "exec")
    with pytest.raises(KeyboardInterrupt):
        interrupted(lambda: exec(code, done))
    assert done["finished"] == 1


def test_in_a_finalizer() -> None:
    """Python drops an exception there."""

    class Final:
        def meet(self) -> None: ...

        def __del__(self) -> None:
            come()

    before = sys.unraisablehook
    with pytest.raises(KeyboardInterrupt):
        interrupted(lambda: Final().meet())
    assert sys.unraisablehook is before


def test_handlers_are_put_back() -> None:
    before = signal.getsignal(USR1)
    with interruptible(USR1):
        assert signal.getsignal(USR1) is not before
    assert signal.getsignal(USR1) is before
