"""A directory that a long computation fills over several calls: taken or continued, and locked while it is used."""

from __future__ import annotations

import json
import os
import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from sinssim.errors import InputError
from sinssim.system.drafts import Draft, remove_left
from sinssim.system.locks import MARK as IN_USE
from sinssim.system.locks import try_hold
from sinssim.system.outputs import MARK, check_inside, publish, remove, written


class Kind(NamedTuple):
    """What a directory holds.

    Attributes:
        manifest: name of the file that says so.
        files: further files beside it from the beginning.
        folder: name of the folder of what is computed.
        kind: value of the key `kind` in it.
        article: "a" or "an".
        name: the contents in words, such as "ensemble".
    """

    manifest: str
    files: tuple[str, ...]
    folder: str
    kind: str
    article: str
    name: str


class GrowingDirectory(ABC):
    """A directory that is begun, continued or replaced, and locked until `close`."""

    KIND: ClassVar[Kind]

    def __init__(self, path: Path, *, resume: bool, overwrite: bool) -> None:
        """Begin a directory, or continue one.

        Args:
            path: the directory.
            resume: whether its contents are continued; a missing or empty directory is begun in any case.
            overwrite: whether its contents are removed; `resume` goes before it.

        Raises:
            InputError: the directory holds something else, or something other than what is asked for, or cannot be
                written; or another process uses it.
        """
        self.path = path.resolve()
        self._lock: int | None = None
        taken = self.path.exists() and (not self.path.is_dir() or any(p.name != IN_USE for p in self.path.iterdir()))
        ours: list[str] = []
        if taken:
            found = read_manifest(self.path, self.KIND)
            if not (resume or overwrite):
                raise InputError(
                    f"{path} already holds {self.KIND.article} {self.KIND.name}. Continue or extend it with --resume, "
                    "give another folder with -o, or replace it with --overwrite."
                )
            if resume:
                self._check_same(found, path)
            ours = [*owned(self.path, self.KIND), *self._computed()]
        if self.path.is_dir():
            check_inside(self.path, [IN_USE, MARK, f"{self.KIND.folder}/any", *ours])
        made = [place for place in (self.path, *self.path.parents) if not place.exists()]
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = try_hold(self.path)
            if self._lock is None:
                raise InputError(
                    f"another process is computing the {self.KIND.name} in {path}; wait for it, or give another -o."
                )
            if taken and overwrite and not resume:
                remove(self.path, [*ours, MARK])
            self.folder.mkdir(exist_ok=True)
            remove_left(self.path)
            remove_left(self.folder)
            self._begin()
        except OSError as error:
            self.close()
            if not taken:
                self._leave_nothing(made)
            raise InputError(
                f"the directory {path} cannot be made: {error.strerror}. Give a folder that can be written with -o."
            ) from error
        except BaseException:
            self.close()
            raise

    def _leave_nothing(self, made: list[Path]) -> None:
        """Remove what was written in a folder that was empty, and the folders that were made."""
        with suppress(OSError):
            for entry in self.path.iterdir():
                shutil.rmtree(entry, ignore_errors=True) if entry.is_dir() else entry.unlink()
        for place in made:
            with suppress(OSError):  # it may not exist
                place.rmdir()

    @abstractmethod
    def _check_same(self, found: dict[str, Any], path: Path) -> None:
        """Raise InputError unless a manifest is that of what is asked for; the message names the difference."""

    @abstractmethod
    def _computed(self) -> list[str]:
        """Return the names of the computed files in the directory, with slashes."""

    @abstractmethod
    def _begin(self) -> None:
        """Write the manifest."""

    @property
    def folder(self) -> Path:
        """Folder of what is computed."""
        return self.path / self.KIND.folder

    def keep(self, write: Callable[[Path], object]) -> None:
        """Write the results, in place of those of before; the files of others stay.

        Args:
            write: writes files to a given folder.

        Raises:
            InputError: a file of others has the name of a result; nothing is changed.
            OSError: they cannot be written; nothing is changed.
        """
        with Draft(self.path, "results") as place:
            write(place.path)
            publish(place, self.path, [self.KIND.manifest, *self.KIND.files])

    def free(self) -> float:
        """Return the free space of the disk, MB."""
        return shutil.disk_usage(self.path).free / 1e6

    def close(self) -> None:
        """Unlock the directory."""
        if self._lock is not None:
            with suppress(OSError):
                (self.path / IN_USE).unlink(missing_ok=True)
            os.close(self._lock)
            self._lock = None


def owned(path: Path, kind: Kind) -> list[str]:
    """Return the files that sinssim wrote in a directory, beside the folder of what is computed.

    Args:
        path: the directory.
        kind: what it holds.

    Returns:
        Their names, with slashes.

    Raises:
        InputError: the directory has a mark that cannot be one.
    """
    if os.path.lexists(path / MARK) and written(path) is None:
        raise InputError(
            f"{path / MARK}, by which sinssim recognises its own files, is damaged. The folder stays unchanged; give "
            "another one with -o."
        )
    return list(dict.fromkeys([kind.manifest, *kind.files, *(written(path) or ())]))


def read_manifest(path: Path, kind: Kind) -> dict[str, Any]:
    """Return the manifest of a directory.

    Args:
        path: the directory.
        kind: what it should hold.

    Returns:
        The contents of the manifest.

    Raises:
        InputError: the path is a file, or the directory holds something else.
    """
    if not path.is_dir():
        raise InputError(f"{path} is a file; give the name of a folder with -o.")
    try:
        found = json.loads((path / kind.manifest).read_text(encoding="utf-8"))
        if found["kind"] != kind.kind:
            raise KeyError("kind")
        return dict(found)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"the folder {path} is not empty and holds no {kind.name}: it lacks a readable "
            f"{kind.manifest}. It stays unchanged; give another folder with -o."
        ) from error
