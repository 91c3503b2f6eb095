"""Streams by name, as arrays, Arrow, pandas or polars: the columns of their Parquet files."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.recording.store.parquet import arrow_table
from sinssim.recording.streams import Stream
from sinssim.system.short_repr import described, html_table


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
        """Return the stream as a `pandas.DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        _needed("pandas")
        return self.arrow().to_pandas()

    def polars(self) -> Any:
        """Return the stream as a `polars.DataFrame`.

        Raises:
            InputError: polars is not installed.
        """
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
