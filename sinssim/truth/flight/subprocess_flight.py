"""A flight in a process of its own.

JSBSim keeps Python's lock while it flies. In another process it has a processor to itself while the program loads what
comes after the flight, and a model that brings its process down does not bring down the program.
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
from sinssim.scenario.sections.flight import FlightSection
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.jsbsim_flight import fly_plan

_PATIENCE = 5.0  # [s]


class _RemoteError(Exception):
    """Where in the other process an error came from; shown as its cause."""

    def __str__(self) -> str:
        return f"in the process that flew\n\n{self.args[0]}"


def fly_apart(
    flight: FlightSection,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
) -> FlightLog:
    """Fly a flight plan in a process of its own.

    Args:
        flight: the [flight] section of a scenario.
        seed: seed of the turbulence.
        progress: called now and then with the flown fraction, 0 … 1.
        meanwhile: called once while the other process flies.

    Returns:
        The flight, bit for bit what it would be in this process.

    Raises:
        InputError: as `fly_plan`.
        RunError: the process broke down.
    """
    program = (
        f"import sys; sys.path[:] = {sys.path!r}; from sinssim.truth.flight.subprocess_flight import _serve; _serve()"
    )
    # In a group of its own: Ctrl-C goes to this process alone, which then ends the other.
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0
    ) as other:
        assert other.stdin is not None
        assert other.stdout is not None
        try:
            with contextlib.suppress(BrokenPipeError):  # it has ended already: the answer will be none
                other.stdin.write(pickle.dumps((flight, seed)))
                other.stdin.flush()  # and left open: it closes when this process ends, and the other ends with it
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
        f"{signal.Signals(-code).name if code < 0 else f'exit code {code}'} and without an answer: its flight dynamics "
        "model is the first to suspect; what it said itself stands above."
    )


def _answers(pipe: IO[bytes]) -> Iterator[tuple[str, Any]]:
    while True:
        try:
            yield pickle.load(pipe)
        except (EOFError, pickle.UnpicklingError):
            return


def _end(other: subprocess.Popen[bytes]) -> None:
    """Ask the process to end, so that it tidies up; one that does not listen is ended."""
    other.terminate()
    try:
        other.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        other.kill()


def _serve() -> None:
    """Fly what standard input asks for, answer on standard output, and end with the process that asked."""
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(1))
    pipe = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever a model prints must not get between the answers

    def answer(kind: str, value: Any) -> None:
        left = memoryview(pickle.dumps((kind, value)))
        while left:
            left = left[pipe.write(left) :]

    try:
        flight, seed = pickle.load(sys.stdin.buffer)
        threading.Thread(target=_end_with_the_other, daemon=True).start()
        answer("flown", fly_plan(flight, seed, lambda fraction: answer("fraction", fraction)))
    except (BrokenPipeError, EOFError, SystemExit):
        pass  # nobody waits for it any more
    except BaseException as error:
        with contextlib.suppress(BrokenPipeError):
            answer("error", (error, traceback.format_exc()))
    os._exit(0)  # what is to be tidied up has been; Python's own end may still complain about closed pipes


def _end_with_the_other() -> None:
    """Wait until the process that asked has ended, and ask this one to end, so that it tidies up."""
    with contextlib.suppress(OSError):
        os.read(0, 1)
    os.kill(os.getpid(), signal.SIGTERM)
