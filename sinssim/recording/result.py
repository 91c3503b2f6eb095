"""What `run`, `ensemble`, `compare`, `budget`, `calibrate` and `align` return: one family of results."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from shutil import copytree
from typing import Any, ClassVar, Generic, TypeVar

from sinssim.exhibits import Exhibits
from sinssim.recording.run_directory import write_directory
from sinssim.recording.stream_tables import Stream, Streams
from sinssim.system.outputs import write_text
from sinssim.system.short_repr import html_table

R = TypeVar("R")

Json = Mapping[str, "Json"] | Sequence["Json"] | str | float | None
"""What a JSON file can hold."""


class Media(Generic[R]):
    """What draws and writes one kind of result; it stands beside the figures and files of that kind."""

    file: ClassVar[str]
    """Name of the JSON file of a result's directory."""

    def summary(self, result: R) -> dict[str, Any]:
        """Return the contents of the JSON file of a result's directory."""
        raise NotImplementedError

    def streams(self, result: R) -> Iterator[Stream]:
        """Yield the tables over time of a result; by default none."""
        yield from ()

    def exhibits(self, result: R) -> Exhibits:
        """Return what a result has to show."""
        raise NotImplementedError

    def figure(self, result: R, quantity: str | None = None) -> Any:
        """Draw a result, or one of its quantities; by default the charts that its exhibits name."""
        from sinssim.recording.figures import figure_of

        exhibits = self.exhibits(result)
        return figure_of(exhibits.chosen(exhibits.figure))

    def save(self, result: R, directory: Path, *, overwrite: bool) -> Path:
        """Write the directory of a result that has none, and return it: the JSON file, and what `write` adds."""
        exhibits = self.exhibits(result)

        def write(folder: Path) -> None:
            text = json.dumps(self.summary(result), indent=2, ensure_ascii=False)
            write_text(folder / self.file, text + "\n")
            self.write(result, exhibits, folder)

        return write_directory(directory, write, overwrite=overwrite)

    def write(self, result: R, exhibits: Exhibits, folder: Path) -> None:
        """Write the files beside the JSON file."""
        raise NotImplementedError


class Result:
    """The result of a computation: its numbers, streams, figure and files.

    Attributes:
        media: what draws and writes it; whatever computes a result gives it.
        directory: the directory that the computation wrote; None if it wrote none.
    """

    media: Media[Any]
    directory: Path | None

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Its numbers, units in the names: the contents of the JSON file of its directory."""
        numbers: dict[str, Any] = self.media.summary(self)
        return numbers

    @property
    def exhibits(self) -> Exhibits:
        """What it has to show: sentences, tables and charts, for `sinssim.recording` to render."""
        exhibits: Exhibits = self.media.exhibits(self)
        return exhibits

    @property
    def streams(self) -> Streams:
        """Its tables over time by name, as arrays, Arrow, pandas or polars: `run.streams["truth"].pandas()`.

        A result without any has an empty mapping.

        Raises:
            InputError: the run is one in a vertical plane, whose streams are in its run directory alone.
        """
        return Streams(self.media.streams(self))

    def plot(self, quantity: str | None = None) -> Any:
        """Return its figure.

        Args:
            quantity: of a trade study, for example "r95(end)"; by default the first one that its report draws.

        Returns:
            A `matplotlib.figure.Figure`; a notebook shows it, and `figure.savefig("errors.pdf")` writes it.

        Raises:
            InputError: the result has nothing to draw, or does not have the quantity.
        """
        from sinssim.recording.figures import to_png

        figure = self.media.figure(self, quantity)
        figure._repr_png_ = lambda: to_png(figure)  # what a notebook shows without pyplot
        return figure

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
        there = self.directory
        if there is None:
            return Path(self.media.save(self, Path(directory), overwrite=overwrite))
        return write_directory(
            Path(directory), lambda folder: copytree(there, folder, dirs_exist_ok=True), overwrite=overwrite
        )

    def _repr_html_(self) -> str:
        return html_table(repr(self), [])
