"""A request to stop arrives, wherever the program is at the time."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from sinssim.system.process import aside, interruptible

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


def test_while_it_is_waited_for() -> None:
    """What goes on aside is not waited for, although the compiler stands above; it ends all the same."""
    ended = threading.Event()

    def work() -> None:
        signal.pthread_kill(threading.main_thread().ident or 0, USR1)
        time.sleep(0.5)
        ended.set()

    code = compile("aside(work)", "/lib/site-packages/numba/core/dispatcher.py", "exec")
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt), interruptible(USR1):
        exec(code, {"aside": aside, "work": work})
    assert not ended.is_set()
    assert time.monotonic() - begin < 0.5
    assert ended.wait(10.0)


def test_aside_gives_results_and_errors() -> None:
    assert aside(lambda: threading.current_thread() is threading.main_thread()) is False
    with pytest.raises(ZeroDivisionError):
        aside(lambda: 1 / 0)


def test_a_module_that_is_imported_waits_for_nobody() -> None:
    """Another thread might wait for the import."""
    found: dict[str, Any] = {"aside": aside, "threading": threading}
    code = compile("thread = aside(threading.current_thread)", "<frozen importlib._x>", "exec")
    exec(code, found)
    assert found["thread"] is threading.main_thread()


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
