"""What `run`, `ensemble`, `compare`, `budget`, `calibrate` and `align` return: one family of results, and their
directories.

A directory is written to a hidden folder beside its place and moved into place when complete.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import platform
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from shutil import copytree
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

import sinssim
from sinssim.data import DROPPED, FROZEN, SATURATED, ImuData, html_table
from sinssim.errors import InputError
from sinssim.exhibits import Exhibits
from sinssim.recording.streams import Stream, Streams
from sinssim.system.files import Draft, as_directory, check_place, is_taken, publish, write_text, written
from sinssim.units import size_text


class RunDirectory:
    """A run directory being written, in a hidden folder beside its final place until `keep` moves it there.

    Attributes:
        target: the final place.
        path: the hidden folder to write to.
    """

    def __init__(self, target: Path, *, overwrite: bool = False) -> None:
        """Check the place and make the hidden folder; `overwrite` admits that the files that sinssim wrote for an
        existing run are replaced."""
        self.target = target.resolve()
        self._overwrite = overwrite
        self._made: list[Path] = []
        parent = self.target.parent
        try:
            check_place(self.target, overwrite)
            missing = [p for p in (parent, *parent.parents) if not p.exists()]
            for folder in reversed(missing):
                folder.mkdir()
                self._made.append(folder)
            self._draft = Draft(parent, self.target.name)
            self.path = self._draft.path
        except OSError as error:
            self._remove_made()
            raise InputError(
                f"the run directory {target} cannot be made: {error.strerror} ({parent}). Give a folder that can be "
                "written with -o."
            ) from error
        except BaseException:
            self._remove_made()
            raise

    def keep(self, *, beside: str = "") -> Path:
        """Move the run directory into its place; an incomplete run is kept `beside` an existing one, under its name
        with this suffix, and does not replace it."""
        place = self.target
        if beside and is_taken(place):
            place = _beside(place, beside)
        try:
            check_place(place, self._overwrite or bool(beside))
            publish(self._draft, place)
        except InputError as error:
            kept = _beside(self.target, "new")
            publish(self._draft, kept)
            raise InputError(f"{error} This run is kept in {kept}.") from error
        finally:
            self.discard()
        return place

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Convert system errors inside the block, such as a full disk, into an input error, and remove the folder."""
        try:
            yield
        except OSError as error:
            free = shutil.disk_usage(self.target.parent if self._made == [] else self._made[0].parent).free
            self.discard()
            raise InputError(
                f"the run directory {self.target} could not be written: {error.strerror or error} "
                f"({size_text(free)} were free). Nothing of this run was kept; existing files are unchanged."
            ) from error

    def discard(self) -> None:
        """Remove everything that was written; an existing run stays."""
        self._draft.close()
        self._remove_made()

    def _remove_made(self) -> None:
        with contextlib.suppress(OSError):
            for folder in reversed(self._made):
                folder.rmdir()


def write_directory(target: Path, write: Callable[[Path], object], *, overwrite: bool) -> Path:
    """Write a directory that is complete or not there."""
    folder = RunDirectory(target, overwrite=overwrite)
    try:
        with folder.writing():
            write(folder.path)
            return folder.keep()
    except BaseException:
        if folder.path.exists():
            folder.discard()
        raise


def write_json(path: Path, contents: Any) -> None:
    """Write numbers and words as JSON, with null in place of what is not finite."""
    write_text(path, json.dumps(plain(contents), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def write_shown(exhibits: Exhibits, folder: Path) -> None:
    """Write what a result has to show as report.html and recording.rrd."""
    from sinssim.recording.page import page_of
    from sinssim.recording.rerun_exhibits import record

    write_text(folder / "report.html", page_of(exhibits))
    record(exhibits, folder / "recording.rrd")


def _beside(place: Path, ending: str) -> Path:
    """Return a place with a suffix to the name that is free or holds a run that may be replaced."""
    number = 1
    while True:
        there = place.with_name(f"{place.name}-{ending}" + (f"-{number}" if number > 1 else ""))
        if not os.path.lexists(there) or (not there.is_symlink() and written(there) is not None):
            return there
        number += 1


def flagged(imu: ImuData) -> dict[str, int]:
    """Return the number of flagged samples by kind of flag, set by any sensor, for `summary.json`; empty if the sensors
    set no flags."""
    if imu.flags is None:
        return {}
    kinds = {"saturated": SATURATED, "dropped": DROPPED, "frozen": FROZEN}
    return {name: int(np.any(imu.flags & bit, axis=1).sum()) for name, bit in kinds.items()}


def flagged_words(flags: Mapping[str, int], samples: int) -> str:
    """Report the number of flagged samples of `flagged` in a sentence; "" if there are none."""
    counts = [f"{count:,} {name}" for name, count in flags.items() if count]
    return f"Flagged by the sensors, of {samples:,} samples: {', '.join(counts)}." if counts else ""


def plain(value: Any) -> Any:
    """Return a value, at any depth of dictionaries, lists and tuples, that JSON can hold: None in place of a float that
    is NaN or infinite."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def versions() -> dict[str, str]:
    """Return the versions of the software that computed the numbers."""
    names = ("jsbsim", "numpy", "scipy", "numba", "filterpy", "rerun-sdk", "pyarrow")
    return {"sinssim": sinssim.__version__, **{name: _version(name) for name in names}}


@cache
def _version(name: str) -> str:
    """Return the version of an installed package; its metadata take milliseconds to read."""
    return version(name)


def software() -> str:
    """Return the versions of the software and the processor, in a line."""
    about = {**versions(), "Python": platform.python_version(), "processor": processor()}
    return ", ".join(f"{name} {text}" for name, text in about.items())


def processor() -> str:
    """Return the name of the machine's processor."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return (names or [platform.processor() or platform.machine()])[0]


R = TypeVar("R")

Json = Mapping[str, "Json"] | Sequence["Json"] | str | float | None
"""What a JSON file can hold."""


class Media(Generic[R]):
    """What draws and writes one kind of result; it stands beside the figures and files of that kind."""

    file: ClassVar[str]
    """Name of the JSON file of a result's directory."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"

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
            write_json(folder / self.file, self.summary(result))
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
            return Path(self.media.save(self, as_directory(directory), overwrite=overwrite))
        return write_directory(
            as_directory(directory), lambda folder: copytree(there, folder, dirs_exist_ok=True), overwrite=overwrite
        )

    def _repr_html_(self) -> str:
        return html_table(repr(self), [])
