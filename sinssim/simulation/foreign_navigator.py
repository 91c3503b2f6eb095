"""Navigators of somebody else: programs that read samples and write solutions, and shared libraries.

A program runs in a group of processes of its own, without a shell, and is ended with its children whatever happens. A
library is loaded by a process of its own (`library_host`). What goes wrong becomes the failure of this navigator alone.

Nothing of a stranger is started unasked: a file must be the user's own, in the folder `navigators` of a project that is
named as for own content (`use`, SINSSIM_CONTENT), or the user allows the programs of scenarios (`--allow-programs`,
SINSSIM_PROGRAMS).
"""

from __future__ import annotations

import contextlib
import fcntl
import math
import os
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, NoReturn

import numpy as np

from sinssim.content import named_paths
from sinssim.data import Array, ImuData, Measurements, NavSolution, NavState, measurements_at
from sinssim.earth.ellipsoids import GRAVITY_MODELS, Ellipsoid, ellipsoid_by_name
from sinssim.errors import InputError, RunError, shortened
from sinssim.logs.formats import DEFAULT_START
from sinssim.logs.gps_time import parse_date
from sinssim.scenario import Scenario
from sinssim.scenario.navigation_section import NavigatorSection
from sinssim.simulation import library_host
from sinssim.simulation.navigator_protocol import (
    HEADER,
    Feed,
    ForeignSolution,
    answer_size,
    check_header,
    rows_of,
    solution_of,
)
from sinssim.simulation.truth_and_sensors import RecordedMotion, Truth
from sinssim.system.extensions import NAVIGATORS
from sinssim.system.process import thread_pool
from sinssim.units import ARCMIN

VARIABLE = "SINSSIM_PROGRAMS"
"""Environment variable with the value "allow" where the user allows the programs of scenarios."""
_PIPE_BYTES, _F_SETPIPE_SZ = 1 << 20, 1031
_KEPT_BYTES = 1 << 16
"""End of a program's standard error that is kept."""
_POLL_S = 0.05


class ForeignError(RunError):
    """The failure of a navigator of somebody else; `messages` is the end of its standard error."""

    messages = ""


def allow_programs() -> None:
    """Allow the programs of scenarios in this process and its workers."""
    os.environ[VARIABLE] = "allow"


def check_programs(scenario: Scenario, *, to_start: bool = True) -> None:
    """Raise InputError unless the navigators of others are there and, to start them, the user allows it and a library
    has what it must have."""
    for number, navigator in enumerate(scenario.navigator, start=1):
        key, given = f"navigator.{number}", navigator.library or (navigator.command or ("",))[0]
        if navigator.file is None:
            key += ".command" if navigator.library is None else ".library"
            raise InputError(f"{key}: there is no {'file' if '/' in given else 'program'} {shortened(given)!r}.")
        if navigator.library is None and not os.access(navigator.file, os.X_OK):
            raise InputError(f"{key}.command: {shortened(given)!r} is not executable (chmod +x).")
        if not to_start:
            continue
        check_permission(scenario, navigator)
        if navigator.library is not None:
            done = subprocess.run([*_host(navigator.library), "--check"], capture_output=True, text=True, check=False)
            if done.returncode:
                why = done.stderr.strip() or f"its loading ends with {_end_words(done.returncode)}"
                raise InputError(f"{key}.library: {shortened(given, 200)} {shortened(why, 300)}.")


def check_permission(scenario: Scenario, navigator: NavigatorSection) -> None:
    """Raise InputError unless the user has allowed a navigator of a scenario to be started."""
    file = navigator.file
    if file is None or os.environ.get(VARIABLE) == "allow":
        return
    for folder in (*map(Path, scenario.use), *named_paths()):
        place = folder.resolve() / NAVIGATORS
        if place in file.resolve().parents and _is_own(place) and _is_own(file):
            return
    raise InputError(
        f"the navigator {navigator.name} is the {'program' if navigator.library is None else 'library'} {file}, which "
        f"is started only if you allow it: give --allow-programs, or keep it in the folder {NAVIGATORS} of a project "
        "of yours, which the key `use` or SINSSIM_CONTENT names."
    )


def _is_own(path: Path) -> bool:
    """Return whether a file or folder belongs to the user, and others cannot change it."""
    about = path.resolve().stat()
    return not hasattr(os, "geteuid") or (about.st_uid == os.geteuid() and not about.st_mode & 0o002)


def foreign_solutions(
    scenario: Scenario, truth: Truth | RecordedMotion, sensed: ImuData, imu: ImuData, initial: NavState
) -> dict[str, ForeignSolution | RunError]:
    """Return the solutions of the navigators of others by name, and the failures of those that have none; raise
    InputError if the user has not allowed one to be started. `sensed` are the increments of the whole run, `imu` those
    that are navigated on, after an alignment, from the initial state."""
    for navigator in scenario.navigator:
        check_permission(scenario, navigator)
    names = dict.fromkeys(name for navigator in scenario.navigator for name in navigator.inputs if name != "imu")
    readings = readings_by_name(scenario, truth, sensed, names)

    def by(navigator: NavigatorSection) -> ForeignSolution | RunError:
        chosen = [m for name in navigator.inputs for m in readings.get(name, ())]
        of_log = truth.prepared.log.zero if isinstance(truth, RecordedMotion) else None
        zero = None if of_log is None else of_log.seconds + of_log.fraction
        begin = first_message(scenario, truth.ellipsoid, zero, imu, initial)
        feed = Feed(begin, imu, chosen, navigator.imu_as == "rates", navigator.form == "text", navigator.step != "bulk")
        try:
            return navigated(navigator, feed)
        except RunError as error:
            return error

    with thread_pool(os.cpu_count()) as pool, ended_with_errors():
        return dict(zip((n.name for n in scenario.navigator), pool.map(by, scenario.navigator), strict=True))


def readings_by_name(
    scenario: Scenario, truth: Truth | RecordedMotion, imu: ImuData, names: Collection[str]
) -> dict[str, list[Measurements]]:
    """Return the measurements that navigators get, in the order of arrival, by the name of the input."""
    if not names:
        return {}
    if isinstance(truth, RecordedMotion):
        from sinssim.simulation.recorded_filter_run import all_readings

        of_log = [readings.measurements for readings in all_readings(truth.prepared)]
        of = {name: [m for m in of_log if f"{m.label}-".startswith(f"{name.replace('_', '-')}-")] for name in names}
    else:
        from functools import partial

        from sinssim.scenario.true_motion import mounting
        from sinssim.sensors.aiding_sensor import Vehicle
        from sinssim.simulation.aided_run import navigate_beside

        assert scenario.aiding is not None  # it has the inputs
        beside = partial(navigate_beside, scenario, truth.trajectory)
        vehicle = Vehicle(truth.trajectory, scenario.seed, beside, mounting(scenario).q_bs, imu)
        sensors = scenario.aiding.sensors()
        of = {name: [readings.measurements for readings in sensors[name].read(vehicle)] for name in names}
    return {name: [_in_order(m) for m in series] for name, series in of.items()}


def _in_order(m: Measurements) -> Measurements:
    """Return measurements in the order of their arrival."""
    return measurements_at(m, np.argsort(m.arrival, kind="stable"))


def first_message(
    scenario: Scenario, of_truth: Ellipsoid, zero: float | None, imu: ImuData, initial: NavState
) -> dict[str, Any]:
    """Return the numbers of the first message by name; `zero` is the GPS time of the run's time 0, s, if known."""
    from sinssim.scenario.filter_model import inertial_sigma

    section, sensors = scenario.navigation, inertial_sigma(scenario, 1.0)
    ellipsoid = ellipsoid_by_name(section.ellipsoid_over(of_truth.name))
    gyro, accel = sensors.gyro, sensors.accel
    numbers: dict[str, Any] = {
        "epoch_gps_s": float(parse_date(DEFAULT_START, "")) if zero is None else zero,
        "time_s": imu.time[0],
        "state": np.concatenate(
            [[initial.latitude, initial.longitude, initial.height], initial.velocity_ned, initial.q_nb]
        ),
        "state_sigma": _initial_sigma(scenario, sensors.gyro.bias, sensors.accel.bias, float(initial.latitude)),
        "imu_rate_hz": scenario.imu.rate_hz,
        "correlation_s": (gyro.correlation_time, accel.correlation_time),
        "quantum": (gyro.quantum, accel.quantum),
        "ellipsoid": (ellipsoid.a, ellipsoid.f, ellipsoid.gm, ellipsoid.omega),
        "gravity_equator": ellipsoid.gamma_e,
        "gravity_k": ellipsoid.k,
        "gravity": section.gravity,
    }
    assert section.gravity in GRAVITY_MODELS
    for name, triad in (("gyro", gyro), ("accel", accel)):
        numbers |= {
            f"{name}_noise": np.full(3, triad.random_walk), f"{name}_bias": triad.bias,
            f"{name}_walk": np.full(3, triad.rate_walk), f"{name}_instability": np.full(3, triad.instability),
            f"{name}_scale": triad.scale,
        }  # fmt: skip
    return numbers


def _initial_sigma(scenario: Scenario, gyro_bias: Array, accel_bias: Array, latitude: float) -> Array:
    """Return the 1σ of the initial state, (9,): position, velocity, attitude; north, east, down; fixed errors count."""
    e = scenario.navigation.initial_error
    if scenario.filter is not None:
        from sinssim.scenario.filter_model import filter_model

        blocks = {block.name: block.sigma for block in filter_model(scenario).blocks}
        return np.concatenate([blocks["position"], blocks["velocity"], blocks["attitude"]])
    velocity = [
        math.hypot(e.velocity_sigma_mps, v) for v in (e.velocity_north_mps, e.velocity_east_mps, e.velocity_down_mps)
    ]
    tilt = math.hypot(e.tilt_sigma_arcmin, e.roll_arcmin, e.pitch_arcmin) * ARCMIN
    heading = math.hypot(e.heading_sigma_arcmin, e.heading_arcmin) * ARCMIN
    if scenario.navigation.alignment is not None:  # levelled by the accelerometers, north by the gyros: eq. (1)
        rate = ellipsoid_by_name(scenario.navigation.ellipsoid_over("wgs84")).omega * math.cos(latitude)
        tilt, heading = float(np.max(accel_bias)) / 9.81, float(np.max(gyro_bias)) / max(rate, 1e-9)
    position = [math.hypot(e.position_sigma_m, e.north_m), math.hypot(e.position_sigma_m, e.east_m)]
    return np.array([*position, math.hypot(e.height_sigma_m, e.height_m), *velocity, tilt, tilt, heading])


def navigated(navigator: NavigatorSection, feed: Feed) -> ForeignSolution:
    """Run a navigator over the whole run; raise ForeignError with what it did wrong."""
    with _Process(navigator) as process:
        try:
            data = process.stepwise(feed) if feed.stepwise else process.bulk(feed)
            state = feed.begin["state"]
            solution = solution_of(
                rows_of(data, text=feed.text), feed.imu.time, state, navigator.name, stepwise=feed.stepwise
            )
            return replace(solution, messages=process.messages)
        except RunError as error:
            messages = process.messages.strip()
            last = f" Its standard error ends with: {shortened(messages.splitlines()[-1], 200)}" if messages else ""
            failure = ForeignError(f"{error}{last}", time=error.time, exit_code=error.exit_code)
            failure.messages = messages
            raise failure from error


def messages_of(solutions: Mapping[str, NavSolution], failures: Mapping[str, RunError]) -> dict[str, str]:
    """Return the end of the standard error of the navigators of others that have written to it, by name."""
    messages = {name: getattr(of, "messages", "") for name, of in {**solutions, **failures}.items()}
    return {name: text for name, text in messages.items() if text}


_RUNNING: set[_Process] = set()


def end_programs() -> None:
    """End every navigator of others that is running, with its children."""
    for process in list(_RUNNING):
        process.end("it was ended with the run.")


@contextmanager
def ended_with_errors() -> Iterator[None]:
    """End the navigators that are running if the block ends by an error or an interruption."""
    try:
        yield
    except BaseException:
        end_programs()
        raise


def _host(library: str) -> list[str]:
    return [sys.executable, "-I", "-S", str(Path(library_host.__file__)), library]


def _end_words(code: int) -> str:
    """Return how a program ended, in words."""
    if code >= 0:
        return f"status {code}"
    with suppress(ValueError):
        return f"the signal {signal.Signals(-code).name}"
    return f"the signal {-code}"


class _Process:
    """A navigator that runs, with its pipes; a context manager that ends it with its children."""

    def __init__(self, navigator: NavigatorSection) -> None:
        """Start it."""
        self._library, self._timeout = navigator.library is not None, navigator.timeout_s
        command = _host(navigator.library) if navigator.library is not None else list(navigator.command or ())
        place = next((file.parent for file in navigator.files), None)
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                command, stdin=pipe, stdout=pipe, stderr=pipe, bufsize=0, cwd=place, start_new_session=True
            )
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or str(error)
            raise RunError(f"it cannot be started: {shortened(command[0])!r}: {why}.") from error
        process = self._process
        self._in, self._out, self._err = map(_pipe, (process.stdin, process.stdout, process.stderr))
        self._fault, self._stderr, self._alive, self._over = "", b"", time.monotonic(), threading.Event()
        self._sent = 0.0
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._hear, self._watch)]
        _RUNNING.add(self)
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> _Process:
        return self

    def __exit__(self, *_: object) -> None:
        self.end("")
        self._over.set()
        self._process.wait()
        for thread in self._threads:
            thread.join()
        for file in (self._process.stdin, self._process.stdout, self._process.stderr):
            assert file is not None
            with suppress(OSError):
                file.close()
        _RUNNING.discard(self)

    @property
    def messages(self) -> str:
        """The end of its standard error."""
        return self._stderr.decode("utf-8", "replace")

    def end(self, fault: str) -> None:
        """End it with its children; a fault that is known before stays."""
        self._fault = self._fault or fault
        if self._process.returncode is None:  # else the number may be that of another group by now
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def _hear(self) -> None:
        """Keep the end of its standard error."""
        with suppress(OSError):
            while more := os.read(self._err, 1 << 16):
                self._stderr = (self._stderr + more)[-_KEPT_BYTES:]

    def _watch(self) -> None:
        """End it if it neither reads nor answers for too long."""
        while not self._over.wait(_POLL_S):
            if time.monotonic() - self._alive > self._timeout:
                self.end(f"it hangs: for {self._timeout:g} s it has neither read nor answered; {self._so_far()}.")

    def _so_far(self) -> str:
        return f"it was sent the samples up to {self._sent:.6g} s"

    def _write(self, data: bytes | memoryview) -> None:
        left = memoryview(data)
        while left:
            left = left[os.write(self._in, left) :]
            self._alive = time.monotonic()

    def _framed(self, data: bytes | memoryview, samples: int) -> None:
        """Write a block; before it stand its sizes for the host of a library."""
        if self._library:
            self._write(struct.pack("<QQ", len(data), samples))
        self._write(data)

    def _close_input(self) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()

    def bulk(self, feed: Feed) -> bytes | memoryview:
        """Send everything while answers are read, and return them."""
        errors: list[BaseException] = []

        def send() -> None:
            try:
                self._framed(feed.opening(), 0)
                number = 0
                for block in feed.blocks():
                    number += len(block.ends)
                    self._framed(block.data, len(block.ends))
                    self._sent = float(feed.imu.time[number])
                self._framed(feed.closing(), 0)
            except OSError:
                pass  # it has closed its input: how it ends tells
            except BaseException as error:
                errors.append(error)
            self._close_input()

        sender = threading.Thread(target=send, daemon=True)
        sender.start()
        answers, size = bytearray(2 * _PIPE_BYTES + 96 * len(feed.imu)), 0  # a state for each sample
        while more := os.readv(self._out, [memoryview(answers)[size : size + _PIPE_BYTES]]):
            self._alive = time.monotonic()
            size += more
            if size > feed.most_bytes:
                self.end(f"it floods: it has written {size} bytes for {len(feed.imu)} samples.")
                break
            if len(answers) - size < _PIPE_BYTES:
                answers = answers + bytearray(len(answers))
        self._check_end()
        sender.join()
        if errors:
            raise errors[0]
        return memoryview(answers)[:size]

    def stepwise(self, feed: Feed) -> bytes:
        """Send each sample with its measurements once the one before is answered, and return the answers."""
        answers = list[bytes]()
        try:
            self._framed(feed.opening(), 0)
            answer = self._lines(answers) if feed.text else self._records(answers)
            number, times = 0, feed.imu.time
            for block in feed.blocks():
                for part in block.parts:
                    self._sent = times[number := number + 1]
                    self._framed(part, 1)
                    if not answer():
                        self._close_input()
                        self._check_end()
                        raise RunError(f"it answers nothing any more; {self._so_far()}.")
            self._framed(feed.closing(), 0)
        except OSError:
            pass  # it has closed its input: how it ends tells
        self._close_input()
        if len(rest := self._rest()) > 0:
            raise RunError(f"it answers more than once a sample: {len(rest)} bytes are left over.")
        self._check_end()
        return b"".join(answers)

    def _rest(self) -> bytes:
        """Return what it still writes, up to a page."""
        rest = b""
        while len(rest) < 4096 and (more := os.read(self._out, 4096)):
            rest += more
        return rest

    def _lines(self, answers: list[bytes]) -> Callable[[], bool]:
        """Return a function that reads the next line of answers, with the header before the first one."""
        file = os.fdopen(self._out, "rb", closefd=False)

        def answer() -> bool:
            for _ in range(2 if not answers else 1):
                answers.append(file.readline(_PIPE_BYTES))
            self._alive = time.monotonic()
            return bool(answers[-1])

        return answer

    def _records(self, answers: list[bytes]) -> Callable[[], bool]:
        """Return a function that reads the next answer, with the header before the first one."""
        size, out, read, append = 0, self._out, os.read, answers.append

        def answer() -> bool:
            nonlocal size
            if not size:
                append(header := self._exactly(HEADER.size))
                if len(header) < HEADER.size:
                    return False
                check_header(header)
                append(head := self._exactly(8))
                if len(head) < 8:
                    return False
                size = answer_size(head)
                append(self._exactly(size - 8))
                return bool(answers[-1])
            data = read(out, size)
            if len(data) < size:
                data += self._exactly(size - len(data))
            self._alive = time.monotonic()
            append(data)
            return len(data) == size

        return answer

    def _exactly(self, size: int) -> bytes:
        data = b""
        while len(data) < size and (more := os.read(self._out, size - len(data))):
            data += more
        return data

    def _check_end(self) -> None:
        """Wait until it ends, and raise for the fault for which it was ended, or an end that is none."""
        with contextlib.suppress(ChildProcessError):
            while os.waitid(os.P_PID, self._process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
                time.sleep(0.002)
        if self._process.returncode is None and not self._fault:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)  # its children; it has ended itself
        code = self._process.wait()
        self._threads[0].join(1.0)  # its last words
        if self._fault:
            self._fail(self._fault)
        if self._library and code == library_host.WRONG:
            self._fail(f"the library {self.messages.strip()}.")
        if code:
            self._fail(f"it ends with {_end_words(code)}; {self._so_far()}.")

    def _fail(self, text: str) -> NoReturn:
        raise RunError(text)


def _pipe(file: IO[bytes] | None) -> int:
    """Return the descriptor of a pipe, which is made as large as a block."""
    assert file is not None
    with suppress(OSError):  # the system has no such size
        fcntl.fcntl(file, _F_SETPIPE_SZ, _PIPE_BYTES)
    return file.fileno()
