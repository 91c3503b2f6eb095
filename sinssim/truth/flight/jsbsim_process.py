"""Flies a plan in a separate process.

JSBSim holds Python's lock while it flies. In a separate process it has its own processor while the program loads the
modules for the later stages, and a model that crashes its process does not crash the program.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from typing import IO, Any

from sinssim.errors import RunError
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_simulation import fly_plan

_PATIENCE = 5.0  # [s]


class _RemoteError(Exception):
    """Traceback of an error in the other process, shown as its cause."""

    def __str__(self) -> str:
        return f"in the process that flew\n\n{self.args[0]}"


def fly_apart(
    flight: FlightPlan,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
) -> FlightLog:
    """Fly a flight plan in a separate process; return the flight, bit for bit the same as in this process (progress:
    called from time to time with the fraction flown, 0 … 1)."""
    program = (
        f"import sys; sys.path[:] = {sys.path!r}; from sinssim.truth.flight.jsbsim_process import _serve; _serve()"
    )
    # In its own process group: Ctrl-C reaches only this process, which then ends the other.
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0
    ) as other:
        assert other.stdin is not None
        assert other.stdout is not None
        try:
            with contextlib.suppress(BrokenPipeError):  # it has already ended: there will be no answer
                other.stdin.write(pickle.dumps((flight, seed)))
                other.stdin.flush()  # left open: it closes when this process ends, and the other then ends, too
            if meanwhile is not None:
                meanwhile()
            for kind, value in _answers(other.stdout):
                if kind == "flown":
                    return flight_log(value)
                if kind == "error":
                    error, where = value
                    raise error from _RemoteError(where)
                if progress is not None:
                    progress(value)
            code = other.wait()
        finally:
            _end(other)
    raise RunError(
        f"the process that flew the {flight.aircraft} ended with "
        f"{signal.Signals(-code).name if code < 0 else f'exit code {code}'} without an answer: its flight dynamics "
        "model is the likely cause; its own output is above."
    )


def _answers(pipe: IO[bytes]) -> Iterator[tuple[str, Any]]:
    while True:
        try:
            yield pickle.load(pipe)
        except (EOFError, pickle.UnpicklingError):
            return


def _end(other: subprocess.Popen[bytes]) -> None:
    """Ask the process to end, so that it cleans up; kill it if it does not."""
    other.terminate()
    try:
        other.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        other.kill()


def _serve() -> None:
    """Fly the plan from standard input, answer on standard output, and end with the parent process."""

    def stop(number: int, frame: Any) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second signal would interrupt the clean-up
        sys.exit(1)

    signal.signal(signal.SIGTERM, stop)
    pipe = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # a model's output must not mix with the answers

    def answer(kind: str, value: Any) -> None:
        left = memoryview(pickle.dumps((kind, value)))
        try:
            while left:
                left = left[pipe.write(left) :]
        except BrokenPipeError:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            raise

    try:
        flight, seed = pickle.load(sys.stdin.buffer)
        threading.Thread(target=_end_with_the_other, daemon=True).start()
        answer("flown", fly_plan(flight, seed, lambda fraction: answer("fraction", fraction)))
    except (BrokenPipeError, EOFError, SystemExit):
        pass  # the parent no longer waits
    except BaseException as error:
        with contextlib.suppress(BrokenPipeError):
            answer("error", (error, traceback.format_exc()))
    os._exit(0)  # clean-up is done; Python's own exit could still complain about closed pipes


def _end_with_the_other() -> None:
    """Wait until the parent process has ended, then ask this one to end, so that it cleans up."""
    with contextlib.suppress(OSError):
        os.read(0, 1)
    os.kill(os.getpid(), signal.SIGTERM)
