"""A finished run read from its directory: its kind, its headline figure, and the errors of its solutions."""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.stored.error_rule import ERROR_COLUMNS
from sinssim.logs.stored.made_by import reason_of
from sinssim.logs.stored.streams import StoredStreams, first_line
from sinssim.strapdown.nav_error import NavError
from sinssim.system.outputs import MARK

_KINDS = {
    "ensemble.json": "ensemble",
    "trade.json": "trade study",
    "budget.json": "error budget",
    "results.json": "study",
    "comparison.json": "comparison of runs",
}
"""Files that tell what a directory holds beside runs."""


def kind_of(folder: Path) -> str | None:
    """Return what a directory holds: "run", "ensemble", "study", "trade study", "error budget".

    Returns:
        The kind; None if sinssim did not write it.
    """
    for name, kind in _KINDS.items():
        if (folder / name).is_file():
            return kind
    return "run" if (folder / "summary.json").is_file() and (folder / "scenario.toml").is_file() else None


@dataclass(frozen=True)
class FinishedRun:
    """A run directory.

    Attributes:
        path: the directory.
    """

    path: Path

    def __post_init__(self) -> None:
        """Check that the directory holds a run.

        Raises:
            InputError: it does not.
        """
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
        """Contents of summary.json.

        Raises:
            InputError: it cannot be read, or an older version wrote it without the required keys.
        """
        file = self.path / "summary.json"
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{file} cannot be read: {error}.") from error
        missing = [key for key in ("scenario", "versions") if not (isinstance(found, dict) and key in found)]
        if missing:
            raise InputError(f"{file} lacks {' and '.join(missing)}. {reason_of(self.path)}")
        return dict(found)

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """Contents of scenario.toml, as text and values without checks: older versions wrote other keys."""
        from sinssim.toml_file import read_toml

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
        of_filter, own = self.summary.get("filter", {}), self.summary.get("algorithms", {})
        found = {name: of_filter[name] for name in ("aided", "backward", "smoothed") if of_filter.get(name)}
        return {**found, **own}

    @property
    def headline(self) -> tuple[str, float] | None:
        """Name and rms horizontal error, m, of the aided solution or else of the first algorithm with a result."""
        for name, numbers in self.numbers.items():
            value = numbers.get("rms_horizontal_error_m")
            if value is not None:
                return name, float(value)
        return None

    def solution(self, wanted: str | None = None) -> str:
        """Return the name of a solution with errors over time.

        Args:
            wanted: the name; by default the aided solution, or else the first algorithm with a result.

        Raises:
            InputError: the run has none of this name, or no errors over time.
        """
        folder = self.path / "streams"
        stored = {name.removeprefix("error_") for name in self._streams.names if name.startswith("error_")}
        if "one_component" in self.scenario:
            raise InputError(
                f"{self.path} is a run of the one-component system, whose errors are in a vertical plane; compare runs "
                "of the same kind of motion in space."
            )
        if not stored:
            if not folder.is_dir():
                why = "it was run without streams; run it again with --keep streams or --keep all."
            elif self.status != "finished":
                why = f"the run {self.status} before it navigated."
            else:
                why = f"they do not follow from its streams. {reason_of(self.path)}"
            raise InputError(f"{self.path} has no errors over time: {why}")
        names = [name for name in self.numbers if name in stored] or sorted(stored)
        if wanted is None:
            return self.headline[0] if self.headline and self.headline[0] in stored else names[0]
        if wanted not in stored:
            raise unknown_name(f"solution of {self.path}", wanted, names)
        return wanted

    def errors(self, name: str) -> NavError:
        """Return the errors of a solution over time, exactly as they were computed.

        Args:
            name: a solution, as `solution` returns it.

        Raises:
            InputError: the stream cannot be read, or no error in it is known.
        """
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
        """Return latitude and height at the start of the solution, (1,) rad and (1,) m.

        Raises:
            InputError: no solution can be read.
        """
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
    """Return the size of a directory's files, bytes."""
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file() and not file.is_symlink())


def is_marked(folder: Path) -> bool:
    """Return whether sinssim wrote a folder, or an older version of it did."""
    return (folder / MARK).is_file() or kind_of(folder) is not None
