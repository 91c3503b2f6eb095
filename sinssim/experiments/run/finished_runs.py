"""Finished runs, read from their directories."""

from __future__ import annotations

import datetime
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.stored_run import ERROR_COLUMNS, StoredStreams, first_line, reason_of, version_of, warn_of_version
from sinssim.recording.streams import Stream, StreamTable, Vector
from sinssim.strapdown.navigation_error import NavError
from sinssim.system.files import MARK

_KINDS = {
    "ensemble.json": "ensemble",
    "trade.json": "trade study",
    "budget.json": "error budget",
    "results.json": "study",
    "comparison.json": "comparison of runs",
    "calibration.json": "calibration",
    "alignment.json": "alignment",
    "noise.json": "noise analysis",
}
"""Files that tell what a directory holds beside runs."""


def kind_of(folder: Path) -> str | None:
    """Return what a directory holds: "run", "ensemble", "study" and so on; None if sinssim did not write it."""
    for name, kind in _KINDS.items():
        if (folder / name).is_file():
            return kind
    return "run" if (folder / "summary.json").is_file() and (folder / "scenario.toml").is_file() else None


@dataclass(frozen=True)
class FinishedRun:
    """A run directory."""

    path: Path  # the directory

    def __post_init__(self) -> None:
        """Check that the directory holds a run."""
        kind = kind_of(self.path)
        if kind == "run":
            return
        if kind is not None:
            article = "an" if kind[0] in "aeiou" else "a"
            raise InputError(f"{self.path} is {article} {kind}; give the directory of a run, made by `sinssim run`.")
        what = "does not exist" if not self.path.exists() else "holds no run: it lacks summary.json or scenario.toml"
        raise InputError(f"{self.path} {what}. Give the directory of a run, for example runs/first_flight.")

    @cached_property
    def _streams(self) -> StoredStreams:
        return StoredStreams(self.path / "streams")

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Contents of summary.json."""
        file = self.path / "summary.json"
        try:
            contents = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{file} cannot be read: {error}.") from error
        missing = [key for key in ("scenario", "versions") if not (isinstance(contents, dict) and key in contents)]
        if missing:
            raise InputError(f"{file} lacks {' and '.join(missing)}. {reason_of(self.path)}")
        return dict(contents)

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """Contents of scenario.toml, as text and values without checks: older versions wrote other keys."""
        from sinssim.toml_mistakes import read_toml

        return read_toml(self.path / "scenario.toml")[1]

    @property
    def name(self) -> str:
        """Name of the directory."""
        return self.path.resolve().name

    @property
    def status(self) -> str:
        """How the run ended: "finished", "failed" or "interrupted"."""
        return str(self.summary.get("status", "finished"))

    @property
    def date(self) -> datetime.datetime:
        """When the run was written, in local time."""
        return datetime.datetime.fromtimestamp((self.path / "summary.json").stat().st_mtime).astimezone()

    @property
    def numbers(self) -> dict[str, Mapping[str, float | None]]:
        """Errors by solution, as in the summary: the filter's first, then the algorithms."""
        of_filter, algorithms = self.summary.get("filter", {}), self.summary.get("algorithms", {})
        solutions = {name: of_filter[name] for name in ("aided", "backward", "smoothed") if of_filter.get(name)}
        return {**solutions, **algorithms}

    @property
    def headline(self) -> tuple[str, float] | None:
        """Name and rms horizontal error, m, of the aided solution or else of the first algorithm with a result."""
        for name, numbers in self.numbers.items():
            value = numbers.get("rms_horizontal_error_m")
            if value is not None:
                return name, float(value)
        return None

    @property
    def with_errors(self) -> list[str]:
        """Names of the solutions with errors over time, as the summary orders them."""
        stored = {name.removeprefix("error_") for name in self._streams.names if name.startswith("error_")}
        first = [name for name in self.numbers if name in stored]
        return [*first, *sorted(stored - {*first})]

    def solution(self, wanted: str | None = None) -> str:
        """Return the name of a solution with errors over time: the `wanted` one, else that of the headline figure."""
        folder = self.path / "streams"
        names = self.with_errors
        if "one_component" in self.scenario:
            raise InputError(
                f"{self.path} is a run of the one-component system, whose errors are in a vertical plane; compare runs "
                "of the same kind of motion in space."
            )
        if not names:
            if not folder.is_dir():
                why = "it was run without streams; run it again with --keep streams or --keep all."
            elif self.status != "finished":
                why = f"the run {self.status} before it navigated."
            else:
                why = f"they do not follow from its streams. {reason_of(self.path)}"
            raise InputError(f"{self.path} has no errors over time: {why}")
        if wanted is None:
            return self.headline[0] if self.headline and self.headline[0] in names else names[0]
        if wanted not in names:
            raise unknown_name(f"solution of {self.path}", wanted, names)
        return wanted

    def errors(self, name: str) -> NavError:
        """Return the errors of a solution over time, exactly as they were computed."""
        from pyarrow import ArrowException

        try:
            rows = self._streams.read(f"error_{name}", ERROR_COLUMNS)
        except (OSError, KeyError, ArrowException) as error:
            raise InputError(
                f"{self._streams.source(f'error_{name}')} cannot be read as the errors of a solution: "
                f"{first_line(error)}. {reason_of(self.path)}"
            ) from error
        position = np.stack(rows[1:4], 1)
        if not np.isfinite(position).any():
            raise InputError(f"{self.path}: the errors of {name} are not known, because the run has no reference.")
        return NavError(rows[0], position, np.stack(rows[4:7], 1), np.stack(rows[7:10], 1))

    def place(self) -> tuple[Array, Array]:
        """Return latitude and height at the start of the solution, (1,) rad and (1,) m."""
        from pyarrow import ArrowException, parquet

        file = next((self.path / "streams").glob("nav_*.parquet"), self.path / "streams" / "nav_*.parquet")
        try:
            first = parquet.ParquetFile(file).read_row_group(0, columns=["latitude_rad", "height_m"])
            return first["latitude_rad"].to_numpy()[:1], first["height_m"].to_numpy()[:1]
        except (OSError, KeyError, ArrowException) as error:
            raise InputError(
                f"{file} cannot be read as a solution: {first_line(error)}. {reason_of(self.path)}"
            ) from error


def size_of(folder: Path) -> int:
    """Return the size of a directory's files, bytes, without those that links lead to."""
    size, places = 0, [str(folder)]
    while places:
        with os.scandir(places.pop()) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    places.append(entry.path)
                elif entry.is_file(follow_symlinks=False):
                    size += entry.stat(follow_symlinks=False).st_size
    return size


def is_marked(folder: Path) -> bool:
    """Return whether sinssim wrote a folder, or an older version of it did."""
    return (folder / MARK).is_file() or kind_of(folder) is not None


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
        vectors = (Vector(word, (word,), row[:, np.newaxis]) for word, row in zip(columns[1:], rows[1:], strict=True))
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


_NOT_COMPARED = ("name", "description", "views", "recording")


def flat_keys(value: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield the keys of a scenario with dots, and their values as text."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if path or key not in _NOT_COMPARED:
                yield from flat_keys(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        for number, item in enumerate(value, start=1):
            yield from flat_keys(item, f"{path}.{number}")
    else:
        yield path, ", ".join(map(_text, value)) if isinstance(value, list) else _text(value)


def _text(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


_DEPTH = 3


@dataclass(frozen=True)
class Entry:
    """A directory that sinssim wrote."""

    path: Path  # the directory
    kind: str  # "run", what else a directory holds, or "other"
    scenario: str  # name of its scenario, "" if it is not known
    status: str  # "finished", "failed" or "interrupted", "" if it is not a run
    solution: str  # solution of the headline figure, "" without one
    rms_horizontal_error_m: float | None  # headline figure, None without one
    size_bytes: int  # size of all files
    date: datetime.datetime  # when it was written, local time
    problem: str = ""  # why it cannot be read, "" if it can
    sinssim: str = ""  # the version that wrote it, "" if it is not known


def runs_in(folder: Path) -> list[Entry]:
    """Return the directories that sinssim wrote in a folder, three levels deep, the newest first."""
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise InputError(f"{folder} {what}; give a folder with runs, for example runs.")
    return sorted(map(_entry, _run_directories(folder, _DEPTH)), key=lambda entry: entry.date, reverse=True)


def _run_directories(folder: Path, depth: int) -> Iterator[Path]:
    if is_marked(folder):
        yield folder
        return
    if depth:
        for path in sorted(folder.iterdir()):
            if path.is_dir() and not path.is_symlink() and not path.name.startswith("."):
                yield from _run_directories(path, depth - 1)


def _entry(path: Path) -> Entry:
    date = datetime.datetime.fromtimestamp(path.stat().st_mtime).astimezone()
    kind, size, version = kind_of(path) or "other", size_of(path), version_of(path)
    if kind != "run":
        return Entry(path, kind, "", "", "", None, size, date, sinssim=version)
    run = FinishedRun(path)
    try:
        name, value = run.headline or ("", None)
        return Entry(path, kind, str(run.summary["scenario"]), run.status, name, value, size, run.date, sinssim=version)
    except InputError as error:
        return Entry(path, kind, "", "", "", None, size, date, str(error), version)
