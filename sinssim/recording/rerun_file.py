"""The Rerun recording of a run: everything columnar, times as integer nanoseconds on `sim_time`.

Of a long stream it shows the rows that a screen can show: extremes, gaps and events stay, at their exact times.
"""

from __future__ import annotations

import contextlib
import errno
import os
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from sinssim.data import Array, Rows, blocks
from sinssim.errors import RunError
from sinssim.jit import strict_kernel
from sinssim.recording import style
from sinssim.recording.streams import Stream
from sinssim.recording.style import RowNumbers
from sinssim.system.files import draft
from sinssim.truth.sampling import FlightEvent

COLUMNS = 4000
"""Columns of pixels that are told apart: a wide screen has as many."""
AROUND = 10
"""Rows on each side of an event that are kept whole."""


@strict_kernel
def _mark_k(time: Array, values: Array, start: float, width: float, kept: NDArray[np.bool_]) -> None:
    """Mark the rows with the least and the greatest value of each series in each column, and the ends of gaps."""
    rows, series = values.shape
    for j in range(series):
        constant = np.nan  # the value of a column of pixels in which the series is constant
        first = 0
        while first < rows:
            edge = start + width * (np.floor((time[first] - start) / width) + 1.0)
            low, high = np.inf, -np.inf
            at_low, at_high = -1, -1
            i = first
            while i == first or (i < rows and time[i] < edge):
                v = values[i, j]
                if v < low:
                    low, at_low = v, i
                if v > high:
                    high, at_high = v, i
                if i > 0 and np.isnan(v) != np.isnan(values[i - 1, j]):
                    kept[i - 1] = kept[i] = True
                i += 1
            if not (low == high and low == constant):
                if at_low >= 0:
                    kept[at_low] = True
                if at_high >= 0:
                    kept[at_high] = True
            constant = low if low == high else np.nan
            first = i


def is_long(count: int) -> bool:
    """Return whether a stream has more rows than a screen can show."""
    return count > 2 * COLUMNS


def screen_rows(time: Array, values: Array, start: float, end: float, events: Sequence[float] = ()) -> RowNumbers:
    """Return the rows that draw the same picture as all of them, of times (N,) s in order, and series (N, k) that share
    the rows. In each of `COLUMNS` columns of pixels from start (at most `time[0]`) to end these are, for each series,
    the row with its least and that with its greatest value. The first and the last row, both rows at the ends of a gap
    (NaN), and the rows around events stay. No value or time is changed, and no extreme is lost."""
    count = len(time)
    if count <= 2 or end <= start:
        return np.arange(count)
    kept = np.zeros(count, dtype=np.bool_)
    _mark_k(time, np.ascontiguousarray(values, dtype=np.float64), start, (end - start) / COLUMNS, kept)
    kept[[0, -1]] = True
    for at in np.searchsorted(time, np.asarray(events, dtype=np.float64)):
        kept[max(0, at - AROUND) : at + AROUND] = True
    return np.flatnonzero(kept)


def screen_vectors(stream: Stream, events: Sequence[float] = ()) -> Iterator[tuple[str, Array, Array]]:
    """Yield the vectors of a long stream with the rows that a screen can show and those around events, computing one
    block of rows after the other: name, times (M,) s and values (M, k), exact rows of the stream, of each vector its
    own."""
    start, end = float(stream.time[0]), float(stream.time[-1])
    vector_parts: dict[str, list[tuple[Array, Array]]] = {vector.name: [] for vector in stream.vectors}
    places = np.searchsorted(stream.time, np.asarray(events, dtype=np.float64))
    for rows in blocks(len(stream.time)):
        time = stream.time[rows]
        near = [at for at, place in zip(events, places, strict=True)
                if rows.start - AROUND < place < rows.stop + AROUND]  # fmt: skip
        for vector in stream.vectors:
            values = vector.values[rows]
            k = screen_rows(time, values, start, end, near)
            vector_parts[vector.name].append((time[k], values[k]))
    for name, parts in vector_parts.items():
        yield name, np.concatenate([times for times, _ in parts]), np.concatenate([values for _, values in parts])


TIMELINE = "sim_time"
STREAMS = "streams"
"""Parent of the exact streams' entities, `streams/<stream>/<vector>`."""
CHUNK_ROWS = 65536
_MOST_WAITING = 1 << 21
"""Bytes that may wait in memory to be written."""
_PIPES_HAVE_NAMES = os.path.isdir("/dev/fd")  # not on Windows: there Rerun writes the file itself


def nanoseconds(time: Array) -> Array:
    """Return times in the form of a recording: nearest whole nanoseconds, (N,) timedelta64[ns]. `time`: (N,) s."""
    return np.rint(time * 1e9).astype(np.int64).astype("timedelta64[ns]")


class _Times:
    """A time column over an Arrow array, without Rerun's own copies."""

    def __init__(self, times: Array) -> None:
        self._array = pa.array(times)

    def timeline_name(self) -> str:
        return TIMELINE

    def as_arrow_array(self) -> Any:
        return self._array


class _Scalars:
    """Rows of k doubles as a component column over the same memory (`Scalars.columns` would copy them twice)."""

    def __init__(self, rows: Array) -> None:
        count, width = rows.shape
        offsets: Any = pa.array(np.arange(0, count * width + 1, width, dtype=np.int32))
        values: Any = pa.array(rows.reshape(-1))
        self._array = pa.ListArray.from_arrays(offsets, values)

    def component_descriptor(self) -> Any:
        return rr.Scalars.descriptor_scalars()

    def as_arrow_array(self) -> Any:
        return self._array


class _File:
    """The file of a recording, written by us from a pipe that Rerun writes to.

    On a full disk Rerun's own writer may stop such that `flush` and `disconnect` never return. This writer stores the
    error and keeps emptying the pipe.
    """

    def __init__(self, path: Path) -> None:
        """Open the file and the pipe."""
        self._error: OSError | None = None
        self._thread: threading.Thread | None = None
        self.entry = str(path)
        if not _PIPES_HAVE_NAMES:
            return
        self._file = path.open("wb", buffering=0)
        self._read, self._write = os.pipe()
        self.entry = f"/dev/fd/{self._write}"
        self._thread = threading.Thread(target=self._copy, name="recording", daemon=True)
        self._thread.start()

    def _copy(self) -> None:
        room = memoryview(bytearray(1 << 20))
        with self._file as file, open(self._read, "rb", buffering=0) as pipe:
            while count := pipe.readinto(room):
                left = room[:count]
                while left and self._error is None:
                    try:
                        left = left[file.write(left) :]
                    except OSError as error:
                        self._error = error

    def opened(self) -> None:
        """Close our writing end of the pipe, after Rerun has opened its own."""
        if self._thread is not None:
            os.close(self._write)

    def check(self) -> None:
        """Raise if data could not be written."""
        if self._error is not None:
            raise OSError(self._error.errno, self._error.strerror) from self._error

    def close(self) -> None:
        """Wait until everything is written, after Rerun has closed its end."""
        if self._thread is not None:
            self._thread.join()
        self.check()


class Watching(Protocol):
    """A viewer that shows a recording while it is written."""

    address: str  # of its server

    def lost(self) -> None:
        """End it, because it was closed or takes nothing any more."""


_MOST_SECONDS = 60.0
"""Longest time for a viewer to take what waits for it, s."""


class Recording:
    """A recording being written; as a context manager it is closed and valid however the block ends."""

    def __init__(self, path: Path, application: str, blueprint: Any = None, viewer: Watching | None = None) -> None:
        """Open the file, by convention `recording.rrd`. The viewer keeps one layout for each `application`, and opens
        with that of the `rerun.blueprint.Blueprint`. A `viewer` shows what is written at once; the file is complete
        without it."""
        self._viewer = viewer
        self.ranges: dict[str, tuple[float, float]] = {}
        """Smallest and largest value of every entity recorded by `series`, for the axes of plots."""
        self._waiting = 0  # bytes sent since the last flush
        with contextlib.suppress(RuntimeError):  # in a forked process, which has no threads of others
            rr.bindings.flush_and_cleanup_orphaned_recordings()  # ends the threads of those that were written before
        self._stream = rr.RecordingStream(application)
        self._file = _File(path)
        try:
            if viewer is None:
                self._stream.save(self._file.entry, blueprint)
            else:
                sinks = rr.FileSink(self._file.entry), rr.GrpcSink(viewer.address)
                self._stream.set_sinks(*sinks, default_blueprint=blueprint)
        finally:
            self._file.opened()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Write the data still in memory and the footer, without which a recording is not valid."""
        try:
            self._flush()
        finally:
            self._stream.disconnect()
            self._file.close()

    def _flush(self) -> None:
        try:
            self._stream.flush(timeout_sec=1e38 if self._viewer is None else _MOST_SECONDS)
        except RuntimeError as error:
            if self._viewer is None:
                raise OSError(errno.EIO, f"Rerun could not write the recording ({error})") from error
            self._viewer.lost()  # the file has its own writer, which tells its errors itself
        self._waiting = 0
        self._file.check()

    def blueprint(self, blueprint: Any) -> None:
        """Replace the `rerun.blueprint.Blueprint`, the layout that the viewer opens with."""
        self._stream.send_blueprint(blueprint, make_active=self._viewer is not None, make_default=True)

    def stream(self, stream: Stream, *, thin: bool = False, events: Sequence[float] = ()) -> None:
        """Record a stream; the series are named after the Parquet columns. If it is to be `thin`, a long one is reduced
        to exact rows that a screen can show, with all around events, see `screen_rows`."""
        for vector in stream.vectors:
            lines = rr.SeriesLines(names=list(vector.columns), aggregation_policy="MinMax")
            self.static(f"{STREAMS}/{stream.name}/{vector.name}", lines)
        if thin and is_long(len(stream.time)):
            for name, times, values in screen_vectors(stream, events):
                self._scalars(f"{STREAMS}/{stream.name}/{name}", times, values)
        else:
            for rows in blocks(len(stream.time)):
                for vector in stream.vectors:
                    entity = f"{STREAMS}/{stream.name}/{vector.name}"
                    self._scalars(entity, stream.time[rows], vector.values[rows])
        self._flush()  # at most one stream waits in memory

    def series(
        self,
        entity: str,
        time: Array,
        values: Array,
        names: Sequence[str],
        *,
        colors: Sequence[style.Rgb] | None = None,
        widths: Sequence[float] | float = 1.5,
    ) -> None:
        """Record lines (N, k) for a plot, in display units, with k colours, by name if not given, and widths in points.
        A NaN gives a gap, and nothing is recorded if all are NaN."""
        if not np.isfinite(values).any():
            return
        lines = rr.SeriesLines(
            names=list(names),
            colors=list(colors if colors is not None else style.colors(names)),
            widths=[widths] * len(names) if isinstance(widths, float) else list(widths),
            aggregation_policy="MinMax",  # the viewer's averaging over a pixel would hide peaks
        )
        self.static(entity, lines)
        self._scalars(entity, time, values)
        self.ranges[entity] = (float(np.nanmin(values)), float(np.nanmax(values)))

    def points(
        self,
        entity: str,
        time: Rows,
        values: Rows,
        names: Sequence[str],
        color: style.Rgb,
        *,
        marker: str,
        size: float,
    ) -> None:
        """Record dots (N, k) for a plot, in display units, as markers "circle", "cross" or another shape of Rerun, of a
        size in points. A NaN gives no dot."""
        count = len(names)
        dots = rr.SeriesPoints(
            names=list(names), colors=[color] * count, markers=[marker] * count, marker_sizes=[size] * count
        )
        self.static(entity, dots)
        low, high = np.inf, -np.inf
        for part in blocks(len(time)):
            block = values[part]
            self._scalars(entity, time[part], block)
            low = np.fmin(low, np.fmin.reduce(block, axis=None, initial=np.inf))
            high = np.fmax(high, np.fmax.reduce(block, axis=None, initial=-np.inf))
        if low <= high:
            self.ranges[entity] = (float(low), float(high))

    def _scalars(self, entity: str, time: Array, values: Array) -> None:
        rows = np.ascontiguousarray(values)
        times = nanoseconds(time)
        for first in range(0, len(rows), CHUNK_ROWS):
            part = slice(first, first + CHUNK_ROWS)
            self._stream.send_columns(entity, [_Times(times[part])], [_Scalars(rows[part])], strict=True)
            self._waiting += rows[part].nbytes
            if self._waiting > _MOST_WAITING:
                self._flush()

    def columns(self, entity: str, time: Array, columns: Any) -> None:
        """Record any other archetype over time: the result of `Archetype.columns(...)` for N rows at times in s."""
        self._stream.send_columns(entity, [_Times(nanoseconds(time))], columns, strict=True)

    def static(self, entity: str, archetype: Any) -> None:
        """Record data that hold at all times."""
        self._stream.log(entity, archetype, static=True, strict=True)

    def document(self, entity: str, markdown: str) -> None:
        """Record a text."""
        self.static(entity, rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN))

    def events(self, events: Sequence[FlightEvent], entity: str = "events") -> None:
        """Record events as a text log, with the instant before each text."""
        if events:
            levels = [rr.TextLogLevel.INFO] * len(events)
            self.columns(
                entity,
                np.array([event.time for event in events]),
                rr.TextLog.columns(text=[f"{event.time:.3f} s  {event.text}" for event in events], level=levels),
            )


@contextlib.contextmanager
def whole_recording(path: Path, application: str) -> Iterator[Recording]:
    """Write a recording beside its place, and rename it into its place when it is complete. `path`: the file, by
    convention with the suffix .rrd; its folder is made."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with draft(path) as beside, Recording(beside, application) as recording:
            yield recording
    except (OSError, RuntimeError) as error:
        raise RunError(f"the recording {path} cannot be written: {error}.") from error


def time_plot(entity: str, name: str, time: Array) -> rrb.TimeSeriesView:
    """Return a plot whose time axis shows a whole record. `time`: instants of the record, (N,) s."""
    start, end = (rrb.TimeRangeBoundary.absolute(seconds=float(time[k])) for k in (0, -1))
    return rrb.TimeSeriesView(
        origin=entity, name=name, axis_x=rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
    )
