"""Streams: tables over time whose columns carry their units, written in blocks to Parquet files.

`Streams` gives them by name as arrays, Arrow, pandas or polars, with the columns of their Parquet files.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.system import resources
from sinssim.system.outputs import draft
from sinssim.system.short_repr import described, html_table
from sinssim.truth.sampling import FlightEvent

BLOCK = 16384
"""Rows that are written together, so that no copy is as long as a run."""


class Rows(Protocol):
    """Rows of a vector: an array, or an object that computes any block of them."""

    def __getitem__(self, rows: slice, /) -> Array: ...


class Computed:
    """Rows of a vector that are computed when they are written.

    Args:
        rows: returns a block of them, (R, k).
    """

    def __init__(self, rows: Callable[[slice], Array]) -> None:
        self._rows = rows

    def __getitem__(self, rows: slice, /) -> Array:
        return self._rows(rows)


@dataclass(frozen=True)
class Vector:
    """A group of related columns of a stream.

    Attributes:
        name: short name.
        columns: name of each column, ending in its unit.
        values: (N, len(columns)).
    """

    name: str
    columns: tuple[str, ...]
    values: Rows


@dataclass(frozen=True)
class Stream:
    """A table over time: one Parquet file, and one entity per vector in the recording.

    Attributes:
        name: name of the file and of the entities' parent.
        time: (N,) s.
        vectors: the columns.
    """

    name: str
    time: Array
    vectors: tuple[Vector, ...]


def blocks(count: int) -> Iterator[slice]:
    """Yield rows in blocks, as they are written; of no rows one empty block."""
    for start in range(0, max(count, 1), BLOCK):
        yield slice(start, min(start + BLOCK, count))


_MOST_ROWS = 262144
"""Largest number of rows of a row group, which is one page of each column."""
_MOST_BYTES = 24 * 2**20
"""Memory of a row group, beyond which it has fewer rows."""


def write_stream(stream: Stream, folder: Path, metadata: Mapping[str, str] | None = None) -> Path:
    """Write a stream as `<folder>/<name>.parquet`, through a temporary file.

    Args:
        stream: the stream; doubles stay doubles.
    """
    tables = (arrow_table(stream, rows) for rows in blocks(len(stream.time)))
    return _write(tables, folder / f"{stream.name}.parquet", metadata)


def arrow_table(stream: Stream, rows: slice) -> Any:
    """Return rows of a stream as a `pyarrow.Table`.

    Returns:
        The column `time_s`, and the columns of all vectors; doubles stay doubles.
    """
    import pyarrow as pa

    columns = {"time_s": pa.array(stream.time[rows])}
    for vector in stream.vectors:
        values = vector.values[rows]
        columns |= {name: pa.array(values[:, i].copy()) for i, name in enumerate(vector.columns)}
    return pa.table(columns)


def write_events(events: Sequence[FlightEvent], folder: Path) -> Path:
    """Write events as `<folder>/events.parquet`, columns `time_s` and `text`."""
    import pyarrow as pa

    table = pa.table(
        {
            "time_s": pa.array([event.time for event in events], pa.float64()),
            "text": pa.array([event.text for event in events], pa.string()),
        }
    )
    return write_table(table, folder / "events.parquet")


def write_table(table: Any, path: Path) -> Path:
    """Write a table as a Parquet file, through a temporary file.

    Args:
        table: a `pyarrow.Table`; doubles stay doubles.
    """
    return _write([table], path)


def _write(tables: Iterable[Any], path: Path, metadata: Mapping[str, str] | None = None) -> Path:
    """Write the blocks of a table, at least one, as a Parquet file.

    Doubles of a simulation rarely repeat: a dictionary costs time and saves nothing. With their bytes split into eight
    planes, the planes of signs and exponents compress well. zstd has one code for 128 kB: a plane of a page must be as
    long, or planes of different statistics share a code.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    first, others = next(blocks := iter(tables)), blocks
    schema = first.schema.with_metadata({**(first.schema.metadata or {}), **(metadata or {})} or None)
    numbers = [f.name for f in schema if not (pa.types.is_string(f.type) or pa.types.is_boolean(f.type))]
    with (
        draft(path) as beside,
        pq.ParquetWriter(
            beside,
            schema,
            compression="zstd",
            compression_level=3,
            use_dictionary=False,
            write_statistics=False,
            column_encoding=dict.fromkeys(numbers, "BYTE_STREAM_SPLIT"),
            data_page_size=8 * _MOST_ROWS,
            max_rows_per_page=_MOST_ROWS,
        ) as writer,
    ):
        for group in _groups(chain((first,), others), _rows_together(len(schema))):
            writer.write_table(group.replace_schema_metadata(schema.metadata))
    return path


def _rows_together(columns: int) -> int:
    """Return how many rows of a table are compressed together."""
    return min(_MOST_ROWS, max(BLOCK, _MOST_BYTES // (8 * columns)))


def _groups(tables: Iterable[Any], most: int) -> Iterator[Any]:
    """Put the blocks of a table together to row groups."""
    import pyarrow as pa

    group: list[Any] = []
    for table in tables:
        if group and sum(len(block) for block in group) + len(table) > most:
            yield pa.concat_tables(group)
            group = []
        group.append(table)
    yield pa.concat_tables(group)


def give_back_memory() -> None:
    """Return to the system what writing until now has freed."""
    import pyarrow as pa

    pa.default_memory_pool().release_unused()
    resources.give_back_memory()


class StreamTable:
    """A stream of a run: a table over time, whose columns are those of its Parquet file; units are in their names."""

    def __init__(self, stream: Stream) -> None:
        """Take a stream."""
        self._stream = stream

    @property
    def name(self) -> str:
        """Name of the stream, and of its Parquet file."""
        return self._stream.name

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, beginning with `time_s`."""
        return ("time_s", *(name for vector in self._stream.vectors for name in vector.columns))

    def __len__(self) -> int:
        return len(self._stream.time)

    def __getitem__(self, column: str) -> Array:
        if column == "time_s":
            return self._stream.time
        for vector in self._stream.vectors:
            if column in vector.columns:
                return np.asarray(vector.values[slice(0, len(self))][:, vector.columns.index(column)])
        raise unknown_name(f"column of the stream {self.name}", column, self.columns)

    def __repr__(self) -> str:
        time, shown = self._stream.time, ", ".join(self.columns[:8])
        span = f", {time[0]:g} … {time[-1]:g} s" if len(time) else ""
        more = f", … {len(self.columns)} columns in all" if len(self.columns) > 8 else ""
        return f"StreamTable({self.name}: {len(self)} rows{span}; {shown}{more})"

    def _repr_html_(self) -> str:
        rows: list[tuple[str, ...]] = [(name, described(self[name])) for name in self.columns]
        return html_table(f"{self.name}: {len(self)} rows", rows, ("column", "values"))

    def arrow(self) -> Any:
        """Return the stream as a `pyarrow.Table`, doubles bit for bit."""
        return arrow_table(self._stream, slice(0, len(self)))

    def pandas(self) -> Any:
        """Return the stream as a `pandas.DataFrame`."""
        _needed("pandas")
        return self.arrow().to_pandas()

    def polars(self) -> Any:
        """Return the stream as a `polars.DataFrame`."""
        return _needed("polars").from_arrow(self.arrow())


class Streams(Mapping[str, StreamTable]):
    """The streams of a result by name: `run.streams["truth"].pandas()`.

    Those of a run are `truth`, `imu_ideal`, `imu_measured`, `nav_NAME` and `error_NAME` of each solution, and those of
    a filter. Streams of special sensor sets and further coordinates are in the Parquet files of a recorded run alone.
    """

    def __init__(self, streams: Iterable[Stream] = ()) -> None:
        """Take streams."""
        self._by_name = {stream.name: StreamTable(stream) for stream in streams}

    def __getitem__(self, name: str) -> StreamTable:
        try:
            return self._by_name[name]
        except KeyError:
            raise unknown_name("stream", name, tuple(self._by_name)) from None

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self._by_name)

    def __repr__(self) -> str:
        return f"Streams({', '.join(self)})"

    def _repr_html_(self) -> str:
        rows: list[tuple[str, ...]] = [
            (name, str(len(table)), str(len(table.columns))) for name, table in self._by_name.items()
        ]
        return html_table("Streams", rows, ("stream", "rows", "columns"))


def _needed(library: str) -> Any:
    """Return an optional library; raise with the command that installs it."""
    try:
        return importlib.import_module(library)
    except ImportError as error:
        raise InputError(
            f"{library} is not installed. Install sinssim with its extra, pip install 'sinssim[{library}]', or take "
            "arrow(), which needs nothing more."
        ) from error
