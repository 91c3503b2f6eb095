"""The streams of a finished run by name, as arrays, Arrow, pandas or polars: `load_streams`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from sinssim.errors import InputError, unknown_name
from sinssim.experiments.run.finished.finished_run import FinishedRun
from sinssim.logs.stored.made_by import reason_of, warn_of_version
from sinssim.logs.stored.streams import StoredStreams, first_line
from sinssim.recording.stream_tables import StreamTable
from sinssim.recording.streams import Stream, Vector

_TEXT = "events"
"""The stream of texts, which is no table of numbers."""


class FinishedStreams(Mapping[str, StreamTable]):
    """The streams of a finished run by name; each is read when it is taken.

    They are those of its Parquet files, and the errors of its algorithms, `error_<algorithm>`, which follow from the
    stored truth and solution and have no files.
    """

    def __init__(self, run: Path, stored: StoredStreams) -> None:
        """Take the streams of a run."""
        self._run, self._stored = run, stored
        self._names = [name for name in stored.names if name != _TEXT]

    def __getitem__(self, name: str) -> StreamTable:
        from pyarrow import ArrowException

        if name not in self._names:
            raise unknown_name(f"stream of {self._run}", name, self._names)
        try:
            columns = self._stored.columns(name)
            rows = self._stored.read(name, columns)
        except (OSError, KeyError, ArrowException) as error:
            raise InputError(
                f"{self._stored.source(name)} cannot be read: {first_line(error)}. {reason_of(self._run)}"
            ) from error
        vectors = (Vector(word, (word,), one[:, np.newaxis]) for word, one in zip(columns[1:], rows[1:], strict=True))
        return StreamTable(Stream(name, rows[0], tuple(vectors)))

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"FinishedStreams({self._run}: {', '.join(self)})"


def load_streams(run: Path | str) -> FinishedStreams:
    """Return the streams of a finished run by name: `load_streams("runs/first_flight")["error_euler"].pandas()`.

    Args:
        run: the run directory.

    Returns:
        A mapping; the columns have their units in their names.

    Raises:
        InputError: the directory holds no run, or one without streams.

    Warns:
        SinssimWarning: another version of sinssim wrote the run.
    """
    path = FinishedRun(Path(run)).path
    warn_of_version(path)
    stored = StoredStreams(path / "streams")
    if not stored.names:
        raise InputError(
            f"{path} has no streams: it was run without them. Run it again with --keep streams or --keep all."
        )
    return FinishedStreams(path, stored)
