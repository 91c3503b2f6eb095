"""Streams as Parquet files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from sinssim.recording.streams import BLOCK, Stream, blocks
from sinssim.system import memory
from sinssim.system.drafts import draft
from sinssim.truth.channel import FlightEvent

_MOST_ROWS = 262144
"""Largest number of rows of a row group, which is one page of each column."""
_MOST_BYTES = 24 * 2**20
"""Memory of a row group, beyond which it has fewer rows."""


def write_stream(stream: Stream, folder: Path, metadata: Mapping[str, str] | None = None) -> Path:
    """Write a stream as `<folder>/<name>.parquet`, through a temporary file.

    Args:
        stream: the stream; doubles stay doubles.

    Raises:
        OSError: the file cannot be written.
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
    """Write events as `<folder>/events.parquet`, columns `time_s` and `text`.

    Raises:
        OSError: the file cannot be written.
    """
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

    Raises:
        OSError: the file cannot be written.
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

    found: list[Any] = []
    for table in tables:
        if found and sum(len(one) for one in found) + len(table) > most:
            yield pa.concat_tables(found)
            found = []
        found.append(table)
    yield pa.concat_tables(found)


def give_back_memory() -> None:
    """Return to the system what writing until now has freed."""
    import pyarrow as pa

    pa.default_memory_pool().release_unused()
    memory.give_back_memory()
