"""The streams of a run directory by name: read from Parquet, or computed from those that are stored."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.stored.error_rule import ERROR_COLUMNS, STATE_COLUMNS, ErrorRule, errors_by


@dataclass(frozen=True)
class StoredStreams:
    """The streams of a run.

    The errors of an algorithm against the truth are not stored: they are computed from the streams `truth` and
    `nav_<algorithm>` by the function that computed them in the run, from the same numbers.

    Attributes:
        folder: the folder `streams` of a run directory.
    """

    folder: Path

    @cached_property
    def names(self) -> list[str]:
        """Names of all streams, stored and computed, sorted; empty without the folder."""
        stored = {path.stem for path in self.folder.glob("*.parquet")}
        solutions = (name.removeprefix("nav_") for name in stored if name.startswith("nav_"))
        return sorted(stored | {f"error_{name}" for name in solutions if self._rule(name) is not None})

    def is_stored(self, name: str) -> bool:
        """Return whether a stream has a file."""
        return self.path(name).is_file()

    def path(self, name: str) -> Path:
        """Return the file of a stream, which a computed one does not have."""
        return self.folder / f"{name}.parquet"

    def source(self, name: str) -> Path:
        """Return the file that a stream is read from; of computed errors that of the solution."""
        return self.path(name if self.is_stored(name) else name.replace("error_", "nav_", 1))

    def columns(self, name: str) -> list[str]:
        """Return the names of a stream's columns, `time_s` first.

        Raises:
            OSError: there is no such stream.
            pyarrow.ArrowException: its file is damaged.
        """
        from pyarrow import parquet

        if name in self.names and not self.is_stored(name):
            return list(ERROR_COLUMNS)
        return list(parquet.read_schema(self.path(name)).names)

    def read(self, name: str, columns: tuple[str, ...] | list[str]) -> list[Array]:
        """Return columns of a stream.

        Returns:
            (N,) each.

        Raises:
            OSError: there is no such stream.
            KeyError: it has no such column.
            InputError: errors do not follow from the files, because one was changed.
            pyarrow.ArrowException: a file is damaged.
        """
        if self.is_stored(name) or name not in self.names:
            return self._stored(name, columns)
        found = dict(zip(ERROR_COLUMNS, self._errors(name.removeprefix("error_")), strict=True))
        return [found[column] for column in columns]

    def _stored(self, name: str, columns: tuple[str, ...] | list[str]) -> list[Array]:
        from pyarrow import parquet

        table = parquet.read_table(self.path(name), columns=list(columns))
        return [table.column(column).to_numpy() for column in columns]

    def _rule(self, solution: str) -> ErrorRule | None:
        """Return how the errors of a solution follow; None if they do not, or are stored, as older versions did."""
        from pyarrow import ArrowException, parquet

        if self.is_stored(f"error_{solution}") or not self.is_stored("truth"):
            return None
        try:
            found = parquet.read_schema(self.path(f"nav_{solution}")).metadata
        except (OSError, ArrowException):
            return None
        return ErrorRule.of_metadata(found or {}, self.path(f"nav_{solution}"))

    def _errors(self, solution: str) -> list[Array]:
        """Return the errors of a solution, by `ERROR_COLUMNS`."""
        rule = self._rule(solution)
        assert rule is not None
        truth = self._stored("truth", ("time_s", *STATE_COLUMNS))
        own = self._stored(f"nav_{solution}", ("time_s", *STATE_COLUMNS))
        if not np.array_equal(truth[0], own[0]):
            raise InputError(
                f"{self.path(f'nav_{solution}')} and {self.path('truth')} have different times: one of them was "
                "changed after the run. Run its scenario.toml again."
            )
        return errors_by(rule, truth, own)


def first_line(error: Exception) -> str:
    """Return what an error says in its first line, shortened, without the quotes of a `KeyError` and the full stop.

    Args:
        error: what was raised while a stream was read.
    """
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    return text.split("\n", 1)[0][:200].rstrip(".")
