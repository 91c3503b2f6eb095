"""Packets at the pace of the clock: places to send them to, their deadlines, and the solutions that come back."""

from __future__ import annotations

import fcntl
import gc
import ipaddress
import json
import math
import os
import select
import socket
import threading
import time
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import numpy as np

from sinssim.data import NavSolution
from sinssim.errors import InputError, RunError, shortened
from sinssim.experiments.run.stream_packets import Packet
from sinssim.logs.stored_run import STATE_COLUMNS
from sinssim.simulation.navigator_protocol import HEADER, MAGIC, SOLUTION, WITHIN, answer_size, check_header
from sinssim.system.files import Draft

if TYPE_CHECKING:
    from sinssim.experiments.run.run_scores import Scored
    from sinssim.logs.solution_score import Judge

LATE_S = 1e-3
"""Lateness beyond which the deadline of a packet is lost, s."""
_SPIN_S = 3e-4
"""Time before a deadline that is spent awake, s: a sleep may end so much later than was asked for."""
_QUIET_S = 1.0
"""Time without an answer after which no more are expected, and that the reader of a terminal has for the rest, s."""
_DATAGRAM = 1 << 16
_BUFFER = 1 << 22
_PTY = "pty:"
_SIGMA_COLUMNS = ("sigma_n_m", "sigma_e_m", "sigma_d_m", "sigma_vn_mps", "sigma_ve_mps", "sigma_vd_mps")


@dataclass(frozen=True)
class Place:
    """Where packets go to, or answers come from; "pty" is a new pseudo-terminal."""

    scheme: str
    host: str = ""
    port: int = 0

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return _PTY if self.scheme == "pty" else f"{self.scheme}://{host}:{self.port}"


def place_of(text: str, option: str, schemes: tuple[str, ...], *, allow_network: bool = False) -> Place:
    """Return the place that an option names, one of this machine unless the network is allowed; raise InputError if it
    is no place of one of the schemes, or may not be used, before any name is looked up."""
    example = f"{schemes[0]}://127.0.0.1:14550"
    if text == _PTY and "pty" in schemes:
        return Place("pty")
    try:
        parts = urlsplit(text)
        scheme, host, port = parts.scheme, parts.hostname or "", parts.port
    except ValueError as error:
        raise InputError(f"{option} {shortened(text)}: {error}; give for example {example}.") from error
    if scheme not in schemes or (parts.path + parts.query + parts.fragment).strip("/") or parts.username is not None:
        kinds = ", ".join(_PTY if name == "pty" else f"{name}://HOST:PORT" for name in schemes)
        raise InputError(f"{option} {shortened(text)} is none of {kinds}; give for example {example}.")
    if not host or not port:
        raise InputError(
            f"{option} {shortened(text)} lacks a {'port' if host else 'host'}; give for example {example}."
        )
    if not (allow_network or _is_loopback(host)):
        raise InputError(
            f"{option} {shortened(text)} is not this machine; nothing was sent. --allow-network allows other machines."
        )
    return Place(scheme, host, port)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _address(place: Place, kind: socket.SocketKind) -> tuple[socket.AddressFamily, Any]:
    try:
        family, _, _, _, address = socket.getaddrinfo(place.host, place.port, type=kind)[0]
    except OSError as error:
        raise InputError(f"{place}: the host {place.host} is not known ({error.strerror}).") from error
    return family, address


class Listener:
    """Collects what arrives at a place: datagrams, or what each connection brings; a context manager."""

    def __init__(self, place: Place, to: Place) -> None:
        """Listen from now on; if packets go to the same place by a connection, to that, once it is made (`hear`)."""
        self.place, self._heard, self.last = place, list[bytearray](), time.monotonic()
        self._used: Counter[int] = Counter()  # bytes of each connection that were fresh, and datagrams
        self._over, self._threads = threading.Event(), list[threading.Thread]()
        kind = socket.SOCK_DGRAM if place.scheme == "udp" else socket.SOCK_STREAM
        self.family, address = _address(place, kind)
        self.socket = socket.socket(self.family, kind)
        self.answers_back = kind == socket.SOCK_STREAM and place == to
        if self.answers_back:
            return
        try:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
            if kind == socket.SOCK_STREAM:
                self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.socket.bind(address)
            if kind == socket.SOCK_STREAM:
                self.socket.listen()
        except OSError as error:
            self.socket.close()
            raise InputError(f"--listen {place}: {error.strerror}; another program may use it.") from error
        self._start(self._datagrams if kind == socket.SOCK_DGRAM else self._connections)

    def hear(self, link: socket.socket) -> None:
        """Collect what a connection brings."""
        self._start(lambda: self._stream(link))

    def _start(self, work: Callable[[], None]) -> None:
        self._threads.append(threading.Thread(target=work, name="answers", daemon=True))
        self._threads[-1].start()

    def _ready(self, link: socket.socket) -> bool:
        return bool(select.select([link], [], [], 0.1)[0])

    def _datagrams(self) -> None:
        while not self._over.is_set():
            with suppress(OSError):
                if self._ready(self.socket):
                    self._heard.append(bytearray(self.socket.recv(_DATAGRAM)))
                    self.last = time.monotonic()

    def _connections(self) -> None:
        """Collect what connections bring, one after another."""
        while not self._over.is_set():
            if self._ready(self.socket):
                with self.socket.accept()[0] as link:
                    self._stream(link)

    def _stream(self, link: socket.socket) -> None:
        heard = bytearray()
        self._heard.append(heard)
        with suppress(OSError, ValueError):  # it fails, or is closed here
            while not self._over.is_set():
                if self._ready(link):
                    if not (more := link.recv(_DATAGRAM)):
                        return
                    heard += more
                    self.last = time.monotonic()

    @property
    def answers(self) -> list[bytes]:
        """The datagrams, and of connections the lines of JSON or all messages of the protocol."""
        if self.place.scheme == "udp":
            return [bytes(heard) for heard in self._heard]
        parts = (heard.splitlines() if heard.lstrip().startswith(b"{") else [heard] for heard in self._heard)
        return [bytes(answer) for of_connection in parts for answer in of_connection if answer]

    def fresh(self) -> list[bytes]:
        """Return the whole answers that have come since the last time."""
        if self.place.scheme == "udp":
            new = [bytes(heard) for heard in self._heard[self._used[0] :]]
            self._used[0] += len(new)
            return new
        parts = list[bytes]()
        for number, heard in enumerate(self._heard):
            begin, end = self._used[number], _whole(heard, self._used[number])
            parts += bytes(heard[begin:end]).splitlines() if heard.startswith(b"{") else [bytes(heard[begin:end])]
            self._used[number] = end
        return [part for part in parts if part]

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        for thread in self._threads:
            thread.join()
        self.socket.close()

    def wait(self) -> None:
        """Wait until nothing has arrived for a second."""
        self.last = time.monotonic()
        while time.monotonic() - self.last < _QUIET_S:
            time.sleep(0.05)


def _whole(heard: bytearray, end: int) -> int:
    """Return where the last whole answer ends that a connection has brought, given where one before it ends."""
    if heard.startswith(b"{"):
        return heard.rfind(b"\n") + 1
    if end == 0 and heard.startswith(MAGIC):
        end = HEADER.size if len(heard) > HEADER.size else 0
    with suppress(RunError):  # it is told at the end
        while len(heard) - end >= 8 and (size := answer_size(bytes(heard[end : end + 8]))) <= len(heard) - end:
            end += size
    return end


class LastSolution:
    """The last solution that a listener has got, of those with a whole state."""

    def __init__(self, listener: Listener, *, paced: bool) -> None:
        """Read what comes from now on; without a pace, the last one until which samples were sent is awaited."""
        self._listener, self._paced, self._row = listener, paced, dict[str, float]()
        self._apart = math.inf  # least time between two solutions, s

    def __call__(self, sent: float) -> NavSolution | None:
        """Return it; None: none has come. `sent`: time until which samples were sent, s."""
        self._listener.last = time.monotonic()
        self._read()
        while not self._paced and self._is_due(sent) and time.monotonic() - self._listener.last < _QUIET_S:
            time.sleep(1e-3)
            self._read()
        row = self._row
        if not row or row["time_s"] > sent + WITHIN:  # of the future
            return None
        state = np.array([[row[name] for name in STATE_COLUMNS]])
        times = np.array([row["time_s"]])
        latitude, longitude, height = state[:, :3].T
        return NavSolution(times, latitude, longitude, height, state[:, 3:6], state[:, 6:], np.zeros(1))

    def _is_due(self, sent: float) -> bool:
        """Return whether another solution can come of samples until an instant, s: not all navigators answer each."""
        known = self._row.get("time_s", -math.inf)
        return known < sent - WITHIN and not (math.isfinite(self._apart) and known + self._apart > sent + WITHIN)

    def _read(self) -> None:
        for answer in self._listener.fresh():  # another one may have other columns
            columns, _ = columns_of_answers([answer])
            known = self._row.get("time_s", -math.inf)
            if {"time_s", *STATE_COLUMNS} <= columns.keys() and columns["time_s"][-1] > known:
                times = np.array([known, *columns["time_s"]])
                self._apart = float(np.diff(times[times >= known]).min(initial=self._apart))
                self._row = {name: values[-1] for name, values in columns.items()}


@contextmanager
def outlet(place: Place, listener: Listener | None, opened: Callable[[str], None]) -> Iterator[Callable[[bytes], bool]]:
    """Yield a function that sends bytes to a place, and returns whether they were taken; `opened` takes the name of a
    pseudo-terminal's device. Datagrams come from the address of the listener, if there is one, so that they can be
    answered; a listener at the same place as a connection hears what comes back by that."""
    if place.scheme == "pty":
        with _terminal(opened) as send:
            yield send
        return
    datagrams = place.scheme == "udp"
    family, address = _address(place, socket.SOCK_DGRAM if datagrams else socket.SOCK_STREAM)
    if datagrams and listener is not None and (listener.place.scheme, listener.family) == ("udp", family):
        yield _datagrams(listener.socket, address)
        return
    with socket.socket(family, socket.SOCK_DGRAM if datagrams else socket.SOCK_STREAM) as link:
        if datagrams:
            yield _datagrams(link, address)
            return
        try:
            link.connect(address)
        except OSError as error:
            raise RunError(f"{place} does not take a connection: {error.strerror}.") from error
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if listener is not None and listener.answers_back:
            listener.hear(link)
        yield _all_of(link)


def _all_of(link: socket.socket) -> Callable[[bytes], bool]:
    def send(data: bytes) -> bool:
        link.sendall(data)
        return True

    return send


def _datagrams(link: socket.socket, address: Any) -> Callable[[bytes], bool]:
    return lambda data: link.sendto(data, address) == len(data)


@contextmanager
def _terminal(opened: Callable[[str], None]) -> Iterator[Callable[[bytes], bool]]:
    """Yield the sender of a new pseudo-terminal, which refuses what its reader leaves waiting.

    At the end its reader has a second for the rest: what is unread when the terminal closes is lost.
    """
    import termios
    import tty

    leader, device = os.openpty()
    try:
        tty.setraw(device)
        os.set_blocking(leader, False)
        opened(os.ttyname(device))

        def send(data: bytes) -> bool:
            with suppress(BlockingIOError):
                return os.write(leader, data) == len(data)
            return False

        yield send
        deadline, unread = time.monotonic() + _QUIET_S, array("i", [1])
        while unread[0] and time.monotonic() < deadline:
            time.sleep(0.02)
            fcntl.ioctl(device, termios.FIONREAD, unread)
    finally:
        os.close(leader)
        os.close(device)


@dataclass
class Tally:
    """What was sent."""

    pace: float  # run time over the clock's time; inf for as fast as possible
    counts: Counter[str] = field(default_factory=Counter)  # packets by kind
    size: int = 0  # bytes
    refused: int = 0  # packets that a full terminal did not take
    lateness: array[float] = field(default_factory=lambda: array("d"))  # of each packet with a deadline, s
    lost: int = 0  # deadlines that were missed by 1 ms, or by the time until the next packet
    until: float = math.nan  # run time of the last packet, s
    interrupted: bool = False  # whether Ctrl-C has ended it

    @property
    def numbers(self) -> dict[str, Any]:
        """The numbers, units in their names."""
        late = np.array(self.lateness) * 1e3
        p99, largest = (float(np.percentile(late, 99.0)), float(late.max())) if len(late) else (None, None)
        within = float((late <= 1e3 * LATE_S).mean()) if len(late) else None
        return {
            "packets": self.counts.total(), "by_kind": dict(self.counts), "bytes": self.size, "refused": self.refused,
            "until_s": None if math.isnan(self.until) else self.until,
            "pace": self.pace if math.isfinite(self.pace) else "max", "lost_deadlines": self.lost,
            "within_1_ms": within, "lateness_99_percent_ms": p99, "lateness_max_ms": largest,
            "interrupted": self.interrupted,
        }  # fmt: skip

    def __str__(self) -> str:
        numbers, kinds = self.numbers, ", ".join(f"{count} {kind}" for kind, count in self.counts.items())
        if not self.counts:
            return "Nothing was sent."
        text = f"{numbers['packets']} packets ({kinds}) up to {self.until:g} s were sent."
        if self.refused:
            text += f" {self.refused} of them were not taken, because nobody had read those before."
        if numbers["lateness_max_ms"] is None:
            return text
        return (
            f"{text} 99 % were at most {numbers['lateness_99_percent_ms']:.2g} ms late, the latest "
            f"{numbers['lateness_max_ms']:.3g} ms. Deadlines lost, by more than 1 ms or the time until the next "
            f"packet: {self.lost}."
        )


def send_at_pace(
    packets: Iterable[Packet],
    send: Callable[[bytes], bool],
    pace: float = 1.0,
    *,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> Tally:
    """Send packets in order of time at their instants, each of which is counted from the first one, so that no delay
    adds up; those of one microsecond have one deadline. The pace is run time over the time of a clock that never goes
    back, inf for sending without waiting. Return what was sent, also until Ctrl-C; raise RunError if it cannot be
    sent."""
    tally, timed = Tally(pace), math.isfinite(pace)
    together = groupby(packets, key=lambda packet: round(1e6 * packet.time))
    groups = (list(group) for _, group in together) if timed else ([packet] for packet in packets)
    with _without_collections():
        try:
            group, following = next(groups, []), next(groups, []) if timed else []
            begin = clock() - (group[0].time / pace if group else 0.0)
            while group:
                due = begin + group[0].time / pace
                if timed:
                    if (left := due - clock() - _SPIN_S) > 0.0:
                        sleep(left)
                    while clock() < due:
                        pass
                most = min(LATE_S, (following[0].time - group[0].time) / pace) if following else LATE_S
                for packet in group:
                    tally.refused += not send(packet.data)
                    if timed:
                        tally.lateness.append(late := clock() - due)
                        tally.lost += late > most
                    tally.counts[packet.kind] += 1
                    tally.size += len(packet.data)
                    tally.until = packet.time
                if timed:
                    group, following = following, next(groups, [])  # it is made while there is time
                else:  # the next one may be made of the answer to this one
                    group = next(groups, [])
        except KeyboardInterrupt:
            tally.interrupted = True
        except OSError as error:
            what = error.strerror or type(error).__name__
            raise RunError(f"the connection failed: {what}. {tally}") from error
    return tally


def exchange(
    packets: Iterable[Packet] | Callable[[LastSolution], Iterable[Packet]],
    place: Place,
    listen: Place | None,
    pace: float,
    opened: Callable[[str], None],
) -> tuple[Tally, list[bytes]]:
    """Send packets, or what makes them from the answers, to a place, and return what was sent and the answers that came
    to another, or back by a connection; `opened` takes the name of a pseudo-terminal's device."""
    with (
        nullcontext() if listen is None else Listener(listen, place) as listener,
        outlet(place, listener, opened) as send,
    ):
        if callable(packets):
            assert listener is not None
            packets = packets(LastSolution(listener, paced=math.isfinite(pace)))
        tally = send_at_pace(packets, send, pace)
        if listener is None:
            return tally, []
        if not tally.interrupted:
            listener.wait()
        return tally, listener.answers


@contextmanager
def _without_collections() -> Iterator[None]:
    """Keep the collector of unused objects from looking through all that exist, which takes milliseconds."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def columns_of_answers(answers: Iterable[bytes]) -> tuple[dict[str, list[float]], list[str]]:
    """Return the columns of a navigator's solutions, in order of time, and why answers are left out.

    The answers are messages of the binary protocol, or lines of JSON with the names of columns that a table for
    `sinssim score` has. Datagrams may come twice or in any order.
    """
    rows: dict[float, dict[str, float]] = {}
    faults: list[str] = []
    for answer in answers:
        try:
            for row in _binary_rows(answer) if not answer.lstrip().startswith(b"{") else _json_rows(answer):
                rows[row["time_s"]] = row
        except (RunError, ValueError) as error:
            faults.append(str(error))
    times = sorted(rows)
    names = list(dict.fromkeys(name for time in times for name in rows[time]))
    whole = [name for name in names if all(name in rows[time] for time in times)]
    return {name: [rows[time][name] for time in times] for name in whole}, faults


def _binary_rows(data: bytes) -> Iterator[dict[str, float]]:
    if data.startswith(MAGIC):
        check_header(data)
        data = data[HEADER.size :]
    elif data[:1] != bytes([SOLUTION]):
        raise RunError(f"an answer, {shortened(repr(data)[1:])}, is neither a solution of the protocol nor JSON.")
    columns = ("time_s", *STATE_COLUMNS, *_SIGMA_COLUMNS)
    while data:
        size = answer_size(data[:8]) if len(data) >= 8 else 8
        if len(data) < size or size == 8:
            raise RunError(f"an answer ends after {len(data)} of {size} bytes.")
        numbers = np.frombuffer(data, "<f8", size // 8 - 1, 8)[: len(columns)]
        if not np.isfinite(numbers[: 1 + len(STATE_COLUMNS)]).all():
            raise RunError("an answer is not finite.")
        known = numbers[: 1 + len(STATE_COLUMNS)] if np.isnan(numbers).any() else numbers
        yield dict(zip(columns, known.tolist(), strict=False))
        data = data[size:]


def _json_rows(data: bytes) -> Iterator[dict[str, float]]:
    for line in data.decode("utf-8").splitlines():
        values = json.loads(line)
        if not isinstance(values, dict) or "time_s" not in values:
            raise RunError(f"an answer, {shortened(line)}, is no JSON object with time_s.")
        row = {k: float(v) for k, v in values.items() if isinstance(v, int | float) and not isinstance(v, bool)}
        if "time_s" not in row or not all(map(math.isfinite, row.values())):
            raise RunError(f"an answer, {shortened(line)}, is not finite.")
        yield row


def scored(judge: Judge, answers: list[bytes]) -> tuple[Scored, list[str]]:
    """Return the score of a navigator's answers beside the run's own solutions, and why some are left out; raise
    RunError if there are no solutions among them."""
    from sinssim.experiments.run.run_scores import Scored

    columns, faults = columns_of_answers(answers)
    if len(columns.get("time_s", ())) < 2:
        why = f" The first that is none: {shortened(faults[0], 300)}" if faults else ""
        raise RunError(f"{len(answers)} answers have come; two solutions are needed for a score.{why}")
    with Draft(name="answers") as folder:
        file = folder.path / "answers.csv"
        rows = zip(*columns.values(), strict=True)
        text = "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows), ""])
        file.write_text(text, encoding="utf-8")
        score = replace(judge.score(file, name="answers"), path=Path(f"{len(answers)} answers"))
    span = float(score.error.time[0]), float(score.error.time[-1])
    return Scored(judge, [score], {**judge.run_errors(span), score.name: score.error}, span), faults


def pace_of(text: str) -> float:
    """Return a pace from its text: a factor, or "max" for inf."""
    if text == "max":
        return math.inf
    try:
        pace = float(text)
    except ValueError:
        raise InputError(f"--pace {shortened(text)} must be a number, or max.") from None
    if not 0.0 < pace < math.inf:
        raise InputError(f"--pace {shortened(text)} must be positive: 1 is the pace of the clock, max the fastest.")
    return pace
