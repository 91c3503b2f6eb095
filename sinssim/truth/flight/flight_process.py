"""The process that flies: JSBSim holds Python's lock while it flies, and a model may crash its process.

In a process of its own a flight has its own processor while the program loads the modules for the later stages, and a
model that crashes does not crash the program.

A flight in sections waits at the end of each. The waiting process is the memory of that instant: it forks for every
trial of the next section, and the trial that is kept waits at the end of its own. A trial flies bit for bit as a flight
that was given all of its errors at the start.
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
from types import TracebackType
from typing import IO, Any, Self

from sinssim.errors import RunError
from sinssim.truth.flight.flight_log import FlightLog, FlightRecord, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.guidance import SolutionErrors
from sinssim.truth.flight.jsbsim_simulation import fly_plan

_PATIENCE = 5.0  # [s]


class _RemoteError(Exception):
    """Traceback of an error in the other process, shown as its cause."""

    def __str__(self) -> str:
        return f"in the process that flew\n\n{self.args[0]}"


class OtherProcess:
    """The other process, which flies; it ends with this object.

    Attributes:
        patience: time to its next answer after which it is ended, s; None: it may take any time.
    """

    def __init__(self, aircraft: str, function: str, module: str = __name__, patience: float | None = None) -> None:
        """Start a process.

        Args:
            aircraft: name of what it flies, for messages.
            function: name of the function that it calls, which answers by `served`.
            module: where the function is.
            patience: time to an answer after which the process is ended, s; None: it may take any time.
        """
        self._aircraft, self.patience = aircraft, patience
        program = f"import sys; sys.path[:] = {sys.path!r}; from {module} import {function}; {function}()"
        # In its own process group: Ctrl-C reaches only this process, which then ends the other.
        self._process = subprocess.Popen(
            [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Ask the process and those that it has forked to end, so that they clean up; kill them if they do not."""
        group, process = self._process.pid, self._process
        with process:
            assert process.stdin is not None
            with contextlib.suppress(BrokenPipeError):  # a message that nobody has read
                process.stdin.close()
            for number in (signal.SIGTERM, signal.SIGKILL):
                if process.poll() is not None:
                    break
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(group, number)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(_PATIENCE)

    def send(self, content: Any) -> None:
        """Send a message; it is lost if the process has ended, which then gives no answer."""
        pipe = self._process.stdin
        assert pipe is not None
        with contextlib.suppress(BrokenPipeError):
            packed = pickle.dumps(content)
            pipe.write(len(packed).to_bytes(_HEAD) + packed)
            pipe.flush()  # left open: it closes when this process ends, and the other then ends, too

    def answer(self, progress: Callable[[float], None] | None = None) -> Any:
        """Return the next answer, or raise the error that the other process has raised."""
        assert self._process.stdout is not None
        answers, late = _answers(self._process.stdout), threading.Event()
        nothing: tuple[str, Any] = ("ended", None)
        while True:
            with self._watched(late):
                kind, value = next(answers, nothing)
            if kind == "flown":
                return value
            if kind == "error":
                error, where = value
                raise error from _RemoteError(where)
            if kind == "ended":
                break
            if progress is not None:
                progress(value)
        code = self._process.wait()
        if late.is_set():
            raise RunError(
                f"the process that flew the {self._aircraft} gave no answer for {self.patience:.3g} s and was ended: "
                "its flight dynamics model is the likely cause."
            )
        raise RunError(
            f"the process that flew the {self._aircraft} ended with "
            f"{signal.Signals(-code).name if code < 0 else f'exit code {code}'} without an answer: its flight dynamics "
            "model is the likely cause; its own output is above."
        )

    @contextlib.contextmanager
    def _watched(self, late: threading.Event) -> Iterator[None]:
        """End the process if its next answer takes longer than the patience."""
        if self.patience is None:
            yield
            return

        def end() -> None:
            late.set()
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)

        timer = threading.Timer(self.patience, end)
        timer.start()
        try:
            yield
        finally:
            timer.cancel()


def fly_apart(
    flight: FlightPlan,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
    errors: SolutionErrors | None = None,
) -> FlightLog:
    """Fly a flight plan in a separate process; return the flight, bit for bit the same as in this process."""
    with OtherProcess(flight.aircraft, "_serve") as other:
        other.send((flight, seed, errors))
        if meanwhile is not None:
            meanwhile()
        return flight_log(other.answer(progress))


class SectionedFlight:
    """A flight whose sections may be flown again, each with other errors of its navigator.

    Use as a context manager.
    """

    def __init__(self, flight: FlightPlan, seed: int, errors: SolutionErrors, *, once: bool = False) -> None:
        """Bring the aircraft to the start of a plan; `errors` are those at the start. What is flown `once` is kept."""
        self._other = OtherProcess(flight.aircraft, "_serve_once" if once else "_serve_sections")
        self._other.send((flight, seed, errors))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """End the processes of the flight."""
        self._other.__exit__(kind, error, at)

    def fly(self, until: float, errors: SolutionErrors) -> tuple[FlightLog, bool]:
        """Fly the present section.

        Args:
            until: its end, s.
            errors: of the navigator, from the start of the flight.

        Returns:
            The flight from its start to the end of the section, and whether it is over.
        """
        self._other.send((until, errors))
        record, over = self._other.answer()
        return flight_log(record), over

    def keep(self, *, kept: bool) -> None:
        """Go on from the end of the section just flown, or fly it again."""
        self._other.send(kept)


def _answers(pipe: IO[bytes]) -> Iterator[tuple[str, Any]]:
    while True:
        try:
            yield pickle.load(pipe)
        except (EOFError, pickle.UnpicklingError):
            return


def _serve() -> None:
    """Fly the plan from standard input, answer on standard output, and end with the parent process."""
    with served() as answer:
        flight, seed, errors = message()
        threading.Thread(target=end_with_the_other, daemon=True).start()
        answer("flown", fly_plan(flight, seed, lambda fraction: answer("fraction", fraction), errors))


def _serve_sections() -> None:
    """Fly the plan from standard input in sections; it ends with the parent process at the end of a section."""
    with served() as answer:
        flight, seed, errors = message()
        fly_plan(flight, seed, errors=errors, pause=_Sections(answer).pause)


def _serve_once() -> None:
    """Fly the plan from standard input, and wait for a message at the end of each section."""
    with served() as answer:
        flight, seed, errors = message()
        begun = False

        def pause(record: FlightRecord, over: bool) -> tuple[float, SolutionErrors] | None:
            nonlocal begun
            if begun:
                answer("flown", (record, over))
            begun = True
            return None if over else message()

        fly_plan(flight, seed, errors=errors, pause=pause)


class _Sections:
    """The sections of a flight in progress, in the process that flies."""

    def __init__(self, answer: Callable[[str, Any], None]) -> None:
        self._answer, self._is_trial = answer, False

    def pause(self, record: FlightRecord, over: bool) -> tuple[float, SolutionErrors] | None:
        """Wait at the end of a section; return, in a new process, until when and with which errors to fly on."""
        if self._is_trial:
            self._answer("flown", (record, over))
            if not message():
                os._exit(_DROPPED)
        while not over:
            order = message()
            signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
            child = os.fork()
            if child == 0:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
                self._is_trial = True
                return order  # type: ignore[no-any-return]
            code = _ended(child)
            if code < 0:  # a signal ended it
                signal.signal(-code, signal.SIG_DFL)
                os.kill(os.getpid(), -code)
            if code != _DROPPED:  # it was kept, and has ended the flight
                os._exit(code)
        return None


def _ended(trial: int) -> int:
    """Wait until a trial has ended, which cleans up if this process is to end; return its exit code."""

    def hand_on(number: int, frame: Any) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(trial, signal.SIGTERM)

    stop = signal.signal(signal.SIGTERM, hand_on)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
    status = os.waitpid(trial, 0)[1]
    signal.signal(signal.SIGTERM, stop)
    return os.waitstatus_to_exitcode(status)


_DROPPED = 3
"""Exit code of a trial that is not kept."""
_HEAD = 8
"""Bytes before a message that say its length."""


def message() -> Any:
    """Return the next message, without reading on: what follows may be for another process."""
    return pickle.loads(_bytes(int.from_bytes(_bytes(_HEAD))))


def _bytes(count: int) -> bytes:
    content = bytearray()
    while len(content) < count:
        more = os.read(0, count - len(content))
        if not more:
            _let_clean_up()  # a signal follows
            raise EOFError
        content += more
    return bytes(content)


@contextlib.contextmanager
def served() -> Iterator[Callable[[str, Any], None]]:
    """Give the function that answers, report what is raised, and end this process."""

    def stop(number: int, frame: Any) -> None:
        _let_clean_up()  # a second signal may follow
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
            _let_clean_up()
            raise

    try:
        yield answer
    except (BrokenPipeError, EOFError, SystemExit):
        pass  # the parent no longer waits
    except BaseException as error:
        with contextlib.suppress(BrokenPipeError):
            answer("error", (error, traceback.format_exc()))
    os._exit(0)  # clean-up is done; Python's own exit could still complain about closed pipes


def _let_clean_up() -> None:
    """Let no request to end interrupt the clean-up; Python complains if one that it has noted is to be ignored."""
    signal.signal(signal.SIGTERM, lambda number, frame: None)


def end_with_the_other() -> None:
    """Wait until the parent process has ended, then ask this one to end, so that it cleans up."""
    with contextlib.suppress(OSError):
        os.read(0, 1)
    os.kill(os.getpid(), signal.SIGTERM)
