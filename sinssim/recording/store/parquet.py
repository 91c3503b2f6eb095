"""Streams as Parquet files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from sinssim.recording.store.streams import Stream, blocks
from sinssim.truth.trajectory import FlightEvent


def write_stream(stream: Stream, folder: Path) -> Path:
    """Write a stream as `<folder>/<name>.parquet`, through a temporary file.

    Args:
        stream: the stream; doubles stay doubles.
        folder: an existing folder.

    Returns:
        The file.

    Raises:
        OSError: the file cannot be written.
    """
    tables = (arrow_table(stream, rows) for rows in blocks(len(stream.time)))
    return _write(tables, folder / f"{stream.name}.parquet")


def arrow_table(stream: Stream, rows: slice) -> Any:
    """Return rows of a stream as a `pyarrow.Table`.

    Args:
        stream: the stream.
        rows: which of them.

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

    Args:
        events: the events in order of time.
        folder: an existing folder.

    Returns:
        The file.

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
        path: the file.

    Returns:
        The file.

    Raises:
        OSError: the file cannot be written.
    """
    return _write([table], path)


def _write(tables: Iterable[Any], path: Path) -> Path:
    """Write the blocks of a table, at least one, as row groups of a Parquet file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    beside = path.with_name(path.name + ".part")
    first, others = next(blocks := iter(tables)), blocks
    # Doubles of a simulation rarely repeat: a dictionary costs time and saves nothing. With their bytes split into
    # eight planes, the planes of signs and exponents compress well.
    numbers = [f.name for f in first.schema if not (pa.types.is_string(f.type) or pa.types.is_boolean(f.type))]
    with pq.ParquetWriter(
        beside,
        first.schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=False,
        write_statistics=False,
        column_encoding=dict.fromkeys(numbers, "BYTE_STREAM_SPLIT"),
    ) as writer:
        writer.write_table(first)
        for table in others:
            writer.write_table(table)
    os.replace(beside, path)
    return path
