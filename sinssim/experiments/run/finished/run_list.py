"""The runs in a folder: what each is, its size, its headline figure and its date."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sinssim.errors import InputError
from sinssim.experiments.run.finished.finished_run import FinishedRun, is_marked, kind_of, size_of
from sinssim.logs.stored.made_by import version_of

_DEPTH = 3


@dataclass(frozen=True)
class Entry:
    """A directory that sinssim wrote.

    Attributes:
        path: the directory.
        kind: "run", "ensemble", "study", "trade study", "error budget" or "other".
        scenario: name of its scenario, "" if it is not known.
        status: "finished", "failed" or "interrupted", "" if it is not a run.
        solution: solution of the headline figure, "" without one.
        rms_horizontal_error_m: headline figure, None without one.
        size_bytes: size of all files.
        date: when it was written, local time.
        problem: why it cannot be read, "" if it can.
        sinssim: the version that wrote it, "" if it is not known.
    """

    path: Path
    kind: str
    scenario: str
    status: str
    solution: str
    rms_horizontal_error_m: float | None
    size_bytes: int
    date: datetime.datetime
    problem: str = ""
    sinssim: str = ""


def runs_in(folder: Path) -> list[Entry]:
    """Return the directories that sinssim wrote in a folder, the newest first.

    Args:
        folder: the folder, which may itself be a run, with up to three levels of folders in it.

    Returns:
        The entries; those in a study or an ensemble belong to it and are not listed.

    Raises:
        InputError: there is no such folder.
    """
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise InputError(f"{folder} {what}; give a folder with runs, for example runs.")
    return sorted(map(_entry, _found(folder, _DEPTH)), key=lambda entry: entry.date, reverse=True)


def _found(folder: Path, depth: int) -> Iterator[Path]:
    if is_marked(folder):
        yield folder
        return
    if depth:
        for path in sorted(folder.iterdir()):
            if path.is_dir() and not path.is_symlink() and not path.name.startswith("."):
                yield from _found(path, depth - 1)


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
