"""Version 1 of the protocol with navigators of others: what they are sent, and how their answers are read.

Both directions begin with a header of 16 bytes: the text "SINSSIM" with a zero byte, the version and a zero, each a
32-bit number. Then come messages with a head of 8 bytes: kind and index, 16 bits each, and the size of the rest in
bytes, 32 bits. All numbers are little-endian, and the quantities SI, in doubles. As lines of text, a message is a word
and its numbers. `docs/foreign-navigators.md` describes the messages; `scenarios/new_navigator` has the header for C.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, ImuData, Measurements, NavSolution, short_repr
from sinssim.errors import RunError, shortened
from sinssim.units import number_text

VERSION = 1
MAGIC = b"SINSSIM\0"
HEADER = struct.Struct("<8sII")
BEGIN, SENSOR, IMU, MEASUREMENT, END, SOLUTION = range(1, 7)
"""Kinds of messages."""

_NUMBERS = {
    "epoch_gps_s": 1, "time_s": 1, "state": 10, "state_sigma": 9, "imu_rate_hz": 1, "gyro_noise": 3, "accel_noise": 3,
    "gyro_bias": 3, "accel_bias": 3, "gyro_walk": 3, "accel_walk": 3, "gyro_instability": 3, "accel_instability": 3,
    "correlation_s": 2, "gyro_scale": 3, "accel_scale": 3, "quantum": 2, "ellipsoid": 4, "gravity_equator": 1,
    "gravity_k": 1,
}  # fmt: skip
"""Numbers of the first message in their order, with the count of each."""
BEGIN_TYPE = np.dtype(
    [(name, "<f8", (count,)) for name, count in _NUMBERS.items()]
    + [("gravity", "S16"), ("rates", "<u4"), ("stepwise", "<u4"), ("sensors", "<u4"), ("zero", "<u4")]
)
SENSOR_TYPE = np.dtype(
    [("name", "S32"), ("kind", "S32"), ("lever_arm", "<f8", (3,)), ("values", "<u4"), ("sigmas", "<u4")]
)
_IMU_WORDS = 9
"""Words of 8 bytes of a sample: head, time, interval, three angles, three velocities."""
_STATE, _FULL = 11, 27
"""Numbers of a solution: time, latitude, longitude, height, velocity, quaternion; with 1σ, biases and status."""
_BLOCK = 2048
"""Samples that are written, and answers that are checked, at once: they stay in the cache of the processor."""
WITHIN = 1e-6
"""Difference of two instants that counts as none, s: 0.25 mm of an airliner's way."""
_MOST = 2
"""Solutions a sample beyond which a program floods."""


class Block(NamedTuple):
    """Some samples with the measurements that arrive with them, as they are sent."""

    data: bytes | memoryview
    ends: NDArray[np.intp]  # bytes up to the end of what belongs to each sample

    @property
    def parts(self) -> Iterator[memoryview]:
        """What is sent for each sample."""
        view, begin = memoryview(self.data), 0
        for end in self.ends.tolist():
            yield view[begin:end]
            begin = end


@dataclass(frozen=True)
class Feed:
    """What a navigator is sent."""

    begin: dict[str, Any]  # the numbers of the first message by name, and "gravity"
    imu: ImuData  # the increments
    readings: Sequence[Measurements]  # measurements, each sensor's in the order of arrival
    rates: bool = False  # whether the samples are divided by their intervals
    text: bool = False  # whether the messages are lines of text
    stepwise: bool = False  # whether each sample is answered before the next is sent

    def opening(self) -> bytes:
        """Return the header, the first message and those that describe the sensors."""
        flags = {"rates": int(self.rates), "stepwise": int(self.stepwise), "sensors": len(self.readings)}
        if self.text:
            return self._opening_lines(flags).encode()
        first = np.zeros((), BEGIN_TYPE)
        for name, value in {**self.begin, **flags}.items():
            first[name] = value
        parts = [HEADER.pack(MAGIC, VERSION, 0), _head(BEGIN, 0, BEGIN_TYPE.itemsize), first.tobytes()]
        for number, m in enumerate(self.readings):
            about = np.zeros((), SENSOR_TYPE)
            about["name"], about["kind"], about["lever_arm"] = m.label.encode()[:31], m.kind.encode()[:31], m.lever_arm
            about["values"], about["sigmas"] = m.value.shape[1], m.sigma.shape[1]
            parts += [_head(SENSOR, number, SENSOR_TYPE.itemsize), about.tobytes()]
        return b"".join(parts)

    def _opening_lines(self, flags: dict[str, int]) -> str:
        lines = [f"sinssim {VERSION}"]
        lines += [f"{name} {_numbers(np.ravel(self.begin[name]).tolist())}" for name in _NUMBERS]
        lines += [f"gravity {self.begin['gravity']}", *(f"{name} {value}" for name, value in flags.items())]
        for number, m in enumerate(self.readings):
            sizes = f"{m.value.shape[1]} {m.sigma.shape[1]}"
            lines.append(f"sensor {number} {m.label} {m.kind} {_numbers(m.lever_arm.tolist())} {sizes}")
        return "\n".join([*lines, "begin", ""])

    def closing(self) -> bytes:
        """Return the last message."""
        return b"end\n" if self.text else _head(END, 0, 0)

    def blocks(self) -> Iterator[Block]:
        """Yield the samples in blocks, each sample followed by the measurements that arrive by its instant."""
        edges = self.imu.time
        rows = [np.searchsorted(edges[1:], m.arrival - WITHIN) for m in self.readings]
        for begin in range(0, len(self.imu), _BLOCK):
            end = min(begin + _BLOCK, len(self.imu))
            some = [slice(*np.searchsorted(row, (begin, end))) for row in rows]
            with_samples = [row[part] - begin for row, part in zip(rows, some, strict=True)]
            yield (
                self._lines(begin, end, some, with_samples)
                if self.text
                else self._words(begin, end, some, with_samples)
            )

    def _samples(self, begin: int, end: int, samples: Array) -> Array:
        """Write time, interval and six readings of some samples to an array, (K, 8), and return it."""
        imu = self.imu
        samples[:, 0] = imu.time[begin + 1 : end + 1]
        np.subtract(imu.time[begin + 1 : end + 1], imu.time[begin:end], out=samples[:, 1])
        samples[:, 2:5], samples[:, 5:8] = imu.dtheta[begin:end], imu.dvel[begin:end]
        if self.rates:
            samples[:, 2:] /= samples[:, 1:2]
        return samples

    def _words(self, begin: int, end: int, some: list[slice], rows: list[NDArray[np.intp]]) -> Block:
        """Return samples and measurements as messages, in words of 8 bytes."""
        count = end - begin
        sensor = np.concatenate([np.full(len(row), k) for k, row in enumerate(rows)] or [np.zeros(0)]).astype(np.intp)
        row = np.concatenate([*rows, np.zeros(0, np.intp)])
        arrival = np.concatenate([*(m.arrival[part] for m, part in zip(self.readings, some, strict=True)), np.zeros(0)])
        order = np.lexsort((sensor, arrival, row))
        sizes = np.array([3 + m.value.shape[1] + m.sigma.shape[1] for m in self.readings] or [0], np.intp)[sensor]
        with_each = np.bincount(row, minlength=count)
        ends = np.cumsum(_IMU_WORDS + np.bincount(row, sizes, count).astype(np.intp))
        words = np.empty(ends[-1] if count else 0)
        heads = words.view(np.uint64)
        starts = np.concatenate([[0], ends[:-1]])
        heads[starts] = IMU | with_each.astype(np.uint64) << np.uint64(16) | np.uint64(8 * (_IMU_WORDS - 1) << 32)
        if len(row):
            samples = self._samples(begin, end, np.empty((count, _IMU_WORDS - 1)))
            words[starts[:, None] + np.arange(1, _IMU_WORDS)] = samples
        else:
            self._samples(begin, end, words.reshape(count, _IMU_WORDS)[:, 1:])
        place = np.empty(len(row), np.intp)
        place[order] = _IMU_WORDS * (row[order] + 1) + np.cumsum(sizes[order]) - sizes[order]
        for number, (m, part) in enumerate(zip(self.readings, some, strict=True)):
            at, size = place[sensor == number], 2 + m.value.shape[1] + m.sigma.shape[1]
            heads[at] = MEASUREMENT | number << 16 | 8 * size << 32
            values = np.column_stack([m.arrival[part], m.time[part], m.value[part], m.sigma[part]])
            words[at[:, None] + np.arange(1, size + 1)] = values
        return Block(words.data.cast("B"), 8 * ends)

    def _lines(self, begin: int, end: int, some: list[slice], rows: list[NDArray[np.intp]]) -> Block:
        """Return samples and measurements as lines."""
        with_each: list[list[tuple[float, str]]] = [[] for _ in range(begin, end)]
        for number, (m, part, row) in enumerate(zip(self.readings, some, rows, strict=True)):
            values = np.column_stack([m.arrival[part], m.time[part], m.value[part], m.sigma[part]])
            for k, numbers in zip(row.tolist(), values.tolist(), strict=True):
                with_each[k].append((numbers[0], f"measurement {number} {_numbers(numbers)}\n"))
        lines, samples = [], self._samples(begin, end, np.empty((end - begin, _IMU_WORDS - 1)))
        for sample, measured in zip(samples.tolist(), with_each, strict=True):
            measured.sort(key=lambda entry: entry[0])
            lines.append(f"imu {_numbers(sample)} {len(measured)}\n" + "".join(line for _, line in measured))
        return Block("".join(lines).encode(), np.cumsum([len(line) for line in lines]))

    @property
    def most_bytes(self) -> int:
        """Bytes of answers beyond which a program floods."""
        return (_MOST * len(self.imu) + 1000) * (30 * _FULL if self.text else 8 * (_FULL + 1))


def _head(kind: int, index: int, size: int) -> bytes:
    return struct.pack("<HHI", kind, index, size)


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(repr, values))


@short_repr
@dataclass(frozen=True)
class ForeignSolution(NavSolution):
    """The solution of a navigator of somebody else.

    Attributes:
        sigma: 1σ that it states, north, east, down of position, m, velocity, m/s, and attitude, rad, (N+1, 9); None
            if it states none.
        biases: of gyros, rad/s, and accelerometers, m/s², that it states, (N+1, 6); None if it states none.
        status: of its own, (N+1,); None if it states none.
        messages: the end of its standard error.
    """

    sigma: Array | None = None
    biases: Array | None = None
    status: Array | None = None
    messages: str = ""


def rows_of(data: bytes | memoryview, *, text: bool) -> Array:
    """Return the numbers of a program's answers, (K, 11), or (K, 27) with what else they state; raise RunError if they
    do not follow the protocol."""
    return _rows_of_text(bytes(data)) if text else _rows_of_words(data)


def check_header(data: bytes) -> None:
    """Raise RunError unless binary answers begin with the header of this version."""
    if len(data) < HEADER.size or not data.startswith(MAGIC):
        shown = shortened(repr(data[: HEADER.size])[1:], 60)
        hint = '; form = "text" in its table is for lines of text' if data[:8].isascii() and data[7:8] != b"\0" else ""
        raise RunError(f"its answer begins with {shown} instead of the header of the protocol{hint}.")
    _check_version(HEADER.unpack_from(data)[1])


def _check_version(version: object) -> None:
    if version != VERSION:
        raise RunError(f"it answers in version {version} of the protocol, but this is version {VERSION}.", exit_code=2)


def answer_size(head: bytes) -> int:
    """Return the size of a solution with its head, bytes; raise RunError if it is not a solution."""
    kind, _, size = struct.unpack("<HHI", head[:8])
    if kind != SOLUTION or size not in (8 * _STATE, 8 * _FULL):
        raise RunError(
            f"it answers with a message of kind {kind} and {size} bytes; a solution has kind {SOLUTION} and "
            f"{8 * _STATE} or {8 * _FULL} bytes."
        )
    return int(size) + 8


def _rows_of_words(data: bytes | memoryview) -> Array:
    check_header(bytes(data[: HEADER.size]))
    if len(data) < HEADER.size + 8:
        raise RunError("it answers no solution.")
    size = answer_size(bytes(data[HEADER.size : HEADER.size + 8]))
    count, rest = divmod(len(data) - HEADER.size, size)
    words = np.frombuffer(data, "<f8", count * size // 8, HEADER.size).reshape(count, size // 8)
    heads = np.ascontiguousarray(words[:, 0]).view(np.uint64) & np.uint64(0xFFFFFFFF0000FFFF)
    if (other := heads != heads[0]).any():
        number = int(np.argmax(other))
        answer_size(int(heads[number]).to_bytes(8, "little"))
        raise RunError(f"its solution number {number + 1} has another size than those before.")
    if rest:
        raise RunError(f"its last message ends after {rest} of {size} bytes.")
    return words[:, 1:]


def _rows_of_text(data: bytes) -> Array:
    lines = data.decode("ascii", "replace").splitlines()
    words = lines[0].split() if lines else []
    if len(words) != 2 or words[0] != "sinssim" or not words[1].isdecimal():
        shown = shortened(repr(lines[0])) if lines else "nothing"
        raise RunError(f'its answer begins with {shown} instead of the line "sinssim {VERSION}".')
    _check_version(int(words[1]))
    rows, count = [], 0
    for number, line in enumerate(lines[1:], start=2):
        word, *values = line.split() or [""]
        count = count or len(values)
        if word != "solution" or len(values) != count or count not in (_STATE, _FULL):
            raise RunError(
                f'line {number} of its answer, {shortened(repr(line))}, is not "solution" with {_STATE} or {_FULL} '
                "numbers, the same in all lines."
            )
        try:
            rows.append([float(value) for value in values])
        except ValueError as error:
            raise RunError(f"line {number} of its answer, {shortened(repr(line))}, has a word for a number.") from error
    if not rows:
        raise RunError("it answers no solution.")
    return np.array(rows)


def solution_of(rows: Array, time: Array, first: Array, name: str, *, stepwise: bool = False) -> ForeignSolution:
    """Return the solution of a navigator from its answers, as of `rows_of`, to samples of edges, (N+1,) s, which are
    checked; raise RunError for one that cannot be a solution of the run. The state that it was sent, (10,), is the
    first row unless its answers begin later. `stepwise` says whether each sample has one answer."""
    parts = [slice(begin, min(begin + _BLOCK, len(rows))) for begin in range(0, len(rows), _BLOCK)]
    for part in parts:
        _check_rows(rows[part], time, rows[part.start - 1, 0] if part.start else -np.inf, part.start)
    at = rows[:, 0]
    if stepwise and (off := np.abs(at - time[1 : len(rows) + 1]) > WITHIN).any():
        row = int(np.argmax(off))
        late = "late" if at[row] < time[row + 1] else "early"
        raise RunError(
            f"it is {late}: it answers the sample of {time[row + 1]:.6g} s with the solution of {at[row]:.6g} s.",
            time=float(time[row + 1]),
        )
    usual = float(at[-1] - at[0]) / max(len(rows) - 1, 1)
    if time[-1] - at[-1] > 2.0 * usual + WITHIN:
        raise RunError(
            f"its last solution is that of {at[-1]:.6g} s, and the run ends at {time[-1]:.6g} s.", time=float(at[-1])
        )
    later = int(WITHIN < at[0] - time[0] <= 1.5 * max(usual, float(time[1] - time[0])))  # the first row is that sent
    count = later + len(rows)
    columns = {name: np.empty((count, size)) for name, size in _COLUMNS.items()}
    for part in parts:
        block, to, begin = rows[part], slice(part.start + later, part.stop + later), 1
        for column in columns.values():
            column[to] = block[:, begin : begin + column.shape[1]]
            begin += column.shape[1]
    for number, column in enumerate(columns.values() if later else ()):
        begin = sum(list(_COLUMNS.values())[:number])
        column[0] = first[begin : begin + column.shape[1]]
    norm = np.sqrt(np.einsum("ij,ij->i", columns["q_nb"], columns["q_nb"]))
    columns["q_nb"] /= norm[:, None]
    instants = np.append(time[:later], at)
    latitude, longitude, height = (columns[name].ravel() for name in ("latitude", "longitude", "height"))
    sigma, biases, status = _stated(rows, later)
    return ForeignSolution(
        time if np.array_equal(instants, time) else _on_edges(instants, time), latitude, longitude, height,
        columns["velocity"], columns["q_nb"], np.abs(norm - 1.0), name, sigma=sigma, biases=biases,
        status=None if status is None else status[:, 0],
    )  # fmt: skip


_COLUMNS = {"latitude": 1, "longitude": 1, "height": 1, "velocity": 3, "q_nb": 4}


_POLE = 0.5 * np.pi + 1e-9


def _on_edges(instants: Array, time: Array) -> Array:
    """Return instants of which those that are as good as an edge of a sample are the edge."""
    after = np.clip(np.searchsorted(time, instants), 1, len(time) - 1)
    near = np.where(instants - time[after - 1] < time[after] - instants, time[after - 1], time[after])
    return np.where(np.abs(near - instants) <= WITHIN, near, instants)


def _stated(rows: Array, later: int) -> Iterator[Array | None]:
    """Yield 1σ, biases and status of answers, with an empty row before them if they begin later; None for nothing."""
    for columns in (slice(11, 20), slice(20, 26), slice(26, 27)):
        values = rows[:, columns]
        stated = values.size > 0 and not np.isnan(values).all()
        yield np.vstack([np.full((later, values.shape[1]), np.nan), values]) if stated else None


def _check_rows(rows: Array, time: Array, last: float, number: int) -> None:
    """Raise RunError for the first of some answers, (K, 11) or more columns, that is not a state of the run, with what
    is wrong about it. A number of answers, the last one at an instant, s, came before."""
    t, state = rows[:, 0], rows[:, 1:_STATE]
    before = np.append(last, t[:-1])
    q = np.ascontiguousarray(state[:, 6:])
    squares = np.einsum("ij,ij->i", q, q)
    with np.errstate(invalid="ignore", over="ignore"):
        # a block without faults passes here, in a third of the time
        in_order = (t > before).all() and t[0] >= time[0] - WITHIN and t[-1] <= time[-1] + WITHIN
        places = np.abs(state[:, 0]).max() <= _POLE and np.abs(squares - 1.0).max() <= 0.01
        if in_order and places and np.isfinite(rows[:, :_STATE].sum()):
            return
        faults = {
            "is not finite": ~np.isfinite(rows[:, :_STATE]).all(axis=1),
            "comes twice": t == before,
            "is out of order: it comes after that of {before:.6g} s": t < before,
            "lies before the first sample": t < time[0] - WITHIN,
            "lies after the end of the run": t > time[-1] + WITHIN,
            "has a latitude of {latitude} rad": np.abs(state[:, 0]) > _POLE,
            "has a quaternion of the norm {norm}": np.abs(squares - 1.0) > 0.01,
        }
    first = {text: int(np.argmax(wrong)) for text, wrong in faults.items() if wrong.any()}
    if not first:
        return
    text, row = min(first.items(), key=lambda item: item[1])
    norm = number_text(float(np.sqrt(squares[row])))
    words = text.format(before=before[row], latitude=number_text(state[row, 0]), norm=norm)
    finite = bool(np.isfinite(t[row]))
    which = f"of {t[row]:.6g} s" if finite else f"number {number + row + 1}"
    raise RunError(f"its solution {which} {words}.", time=float(t[row]) if finite else None)
