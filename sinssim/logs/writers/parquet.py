"""Every stream of a run as Parquet for other programs, with the errors, which a run directory does not store."""

from __future__ import annotations

import shutil
from pathlib import Path

from sinssim.logs.stored_run import StoredStreams
from sinssim.logs.writers.run_export import Content

SUFFIX = ""
HOLDS = "run"


def write(content: Content, place: Path) -> list[str]:
    """Write a folder of Parquet files.

    Args:
        content: of any run; every stream is written whole.
    """
    import pyarrow as pa
    from pyarrow import parquet

    streams = StoredStreams(content.run.path / "streams")
    for name in streams.names:
        if streams.is_stored(name):
            shutil.copyfile(streams.path(name), place / f"{name}.parquet")
            continue
        columns = streams.columns(name)
        table = pa.table(dict(zip(columns, map(pa.array, streams.read(name, columns)), strict=True)))
        split = dict.fromkeys(columns, "BYTE_STREAM_SPLIT")
        parquet.write_table(
            table, place / f"{name}.parquet", compression="zstd", use_dictionary=False, column_encoding=split
        )
    return [
        "Every stream of the run at all its samples, doubles bit for bit; times are the run's own, units are in the "
        "names of the columns.",
        "error_<algorithm>.parquet are the errors against the truth: north, east, down.",
    ]
