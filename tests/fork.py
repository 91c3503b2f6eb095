"""Calls a function in a process forked from the one of the tests, which has loaded all that it needs."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import tempfile
import threading
import traceback
import warnings
from collections.abc import Callable
from typing import NoReturn


class Fork:
    """A process that calls a function and ends, with the part of `subprocess.Popen` that tests use.

    Attributes:
        pid: identifier of the process.
        stdin: pipe to its standard input.
        stdout: pipe from its standard output.
        returncode: its exit code once it was waited for, negative for a signal.
    """

    _one_at_a_time = threading.Lock()  # so that no process keeps an end of another one's pipe open

    def __init__(self, function: Callable[[], object]) -> None:
        """Start the process; an exception is printed on its standard error, and its exit code is 1."""
        self.returncode: int | None = None
        self._waiting = threading.Lock()
        self._errors = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        with self._one_at_a_time:
            inside, stdin = os.pipe()
            stdout, outside = os.pipe()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)  # other threads hold nothing that is used there
                self.pid = os.fork()
            if self.pid == 0:
                os.close(stdin)
                os.close(stdout)
                _become(function, (inside, outside, self._errors.fileno()))
            os.close(inside)
            os.close(outside)
        self.stdin, self.stdout = os.fdopen(stdin, "wb"), os.fdopen(stdout, "rb")

    def kill(self, number: int = signal.SIGKILL) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def poll(self) -> int | None:
        return self._wait(os.WNOHANG)

    def wait(self) -> int:
        code = self._wait(0)
        assert code is not None
        return code

    def stderr(self) -> str:
        """Wait for the end, and return what was written on standard error."""
        self.wait()
        self._errors.seek(0)
        return self._errors.read()

    def _wait(self, options: int) -> int | None:
        with self._waiting:
            if self.returncode is None:
                pid, status = os.waitpid(self.pid, options)
                self.returncode = os.waitstatus_to_exitcode(status) if pid else None
        return self.returncode


def _become(function: Callable[[], object], streams: tuple[int, int, int]) -> NoReturn:
    code = 1
    try:  # whatever happens, the tests must not go on here
        for number, file in enumerate(streams):
            os.dup2(file, number)
        sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w")
        function()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(BaseException):
                stream.flush()
        os._exit(code)
