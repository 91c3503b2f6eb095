"""What `run`, `ensemble`, `compare`, `budget`, `calibrate` and `align` return: one family of results."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from sinssim.lazy import from_later_stage
from sinssim.system.short_repr import html_table


class Result:
    """The result of a computation: its numbers, streams, figure and files.

    Attributes:
        directory: the directory that the computation wrote; None if it wrote none.
    """

    directory: Path | None

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Its numbers, units in the names: the contents of the JSON file of its directory."""
        return dict(_later("summary_of", self))

    @property
    def streams(self) -> Mapping[str, Any]:
        """Its tables over time by name, as arrays, Arrow, pandas or polars: `run.streams["truth"].pandas()`.

        A result without any has an empty mapping.

        Raises:
            InputError: the run is one in a vertical plane, whose streams are in its run directory alone.
        """
        found: Mapping[str, Any] = _later("streams_of", self)
        return found

    def plot(self) -> Any:
        """Return its figure.

        Returns:
            A `matplotlib.figure.Figure`; a notebook shows it, and `figure.savefig("errors.pdf")` writes it.

        Raises:
            InputError: the result has nothing to draw.
        """
        return _later("figure_of", self)

    def save(self, directory: Path | str, *, overwrite: bool = False) -> Path:
        """Write the directory that the computation would have written, or copy the one that it wrote.

        A run that was computed without a directory is computed again, with the same numbers.

        Args:
            directory: the directory to write.
            overwrite: whether an existing result in it may be replaced.

        Returns:
            The directory.

        Raises:
            InputError: the directory is taken or cannot be written.
        """
        return Path(_later("save", self, Path(directory), overwrite))

    def _repr_html_(self) -> str:
        return html_table(repr(self), [])


def _later(name: str, *arguments: Any) -> Any:
    """Call a function of the last stage, which writes and draws every kind of result."""
    return from_later_stage("sinssim.running.results", name)(*arguments)
