"""The run directory: written to a hidden folder beside its place and moved into place when complete."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from sinssim import __version__
from sinssim.errors import InputError
from sinssim.formatting import size_text
from sinssim.system.locks import MARK as IN_USE
from sinssim.system.locks import hold, remove_unused

MARK = ".sinssim.json"
"""Name of the file that marks a run directory. It lists the files that sinssim wrote and may replace."""


class RunDirectory:
    """A run directory being written, in a hidden folder beside its final place until `keep` moves it there.

    The next run that writes to the same place removes hidden folders of killed processes.

    Attributes:
        target: the final place.
        path: the hidden folder to write to.
    """

    def __init__(self, target: Path, *, overwrite: bool = False) -> None:
        """Check the place and make the hidden folder.

        Args:
            target: the final place of the run directory.
            overwrite: whether the files that sinssim wrote for an existing run may be replaced.

        Raises:
            InputError: the place is taken or cannot be written.
        """
        self.target = target.resolve()
        self._overwrite = overwrite
        self._made: list[Path] = []
        self._lock: int | None = None
        parent = self.target.parent
        try:
            _check_place(self.target, overwrite)
            missing = [p for p in (parent, *parent.parents) if not p.exists()]
            for folder in reversed(missing):
                folder.mkdir()
                self._made.append(folder)
            _remove_leavings(parent)
            self.path = parent / f".{self.target.name}-{secrets.token_hex(8)}"
            try:
                self.path.mkdir()
                self._lock = hold(self.path)
            except BaseException:  # in particular an interruption: the caller does not have the folder yet
                self.discard()
                raise
        except OSError as error:
            self._remove_made()
            raise InputError(
                f"the run directory {target} cannot be made: {error.strerror} ({parent}). Give a folder that can be "
                "written with -o."
            ) from error

    def keep(self, *, beside: str = "") -> Path:
        """Move the run directory into its place.

        Args:
            beside: suffix of the name under which an incomplete run is kept beside an existing one, which it does not
                replace.

        Returns:
            Its place.

        Raises:
            InputError: files that sinssim did not write are in the way; they stay, and the run is kept beside them.
            OSError: the directory cannot be moved; the existing files stay.
        """
        files = _files(self.path)
        write_text(self.path / MARK, json.dumps({"sinssim": __version__, "files": files}, indent=1) + "\n")
        place = self.target
        if beside and _is_taken(place):
            place = _beside(place, beside)
        if not place.exists():
            self._move_to(place)
            return place
        try:
            _check_place(place, self._overwrite or bool(beside))
            _replace(place, self.path, [*files, MARK])
        except InputError as error:
            kept = _beside(self.target, "new")
            if kept.exists():
                _replace(kept, self.path, [*files, MARK])
            else:
                self._move_to(kept)
            raise InputError(f"{error} This run is kept in {kept}.") from error
        finally:
            self.discard()
        return place

    def _move_to(self, place: Path) -> None:
        """Rename the hidden folder to its final name."""
        self._unlock()
        (self.path / IN_USE).unlink(missing_ok=True)
        os.replace(self.path, place)

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Convert system errors inside the block, such as a full disk, into an input error, and remove the folder.

        Raises:
            InputError: data could not be written.
        """
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
        shutil.rmtree(self.path, ignore_errors=True)
        self._unlock()
        self._remove_made()

    def _unlock(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _remove_made(self) -> None:
        with contextlib.suppress(OSError):
            for folder in reversed(self._made):
                folder.rmdir()


def write_text(path: Path, text: str) -> None:
    """Write a text file to a temporary file and rename it into place.

    Args:
        path: the file.
        text: its contents.

    Raises:
        OSError: the file cannot be written.
    """
    beside = path.with_name(path.name + ".part")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)


def _files(folder: Path) -> list[str]:
    """Return the files of a run being written, relative to its folder, with slashes."""
    found = (path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())
    return sorted(name for name in found if name not in (MARK, IN_USE))


def _written(place: Path) -> list[str] | None:
    """Return the files that sinssim wrote in a folder according to its mark; None without a mark."""
    try:
        files = json.loads((place / MARK).read_text(encoding="utf-8"))["files"]
        names = [PurePosixPath(name) for name in files]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if any(name.is_absolute() or ".." in name.parts or not name.parts for name in names):
        return None
    return [str(name) for name in names]


def _replace(place: Path, source: Path, files: list[str]) -> None:
    """Replace the files that sinssim wrote in a folder by a new run, file by file; all other files stay.

    Args:
        place: an existing folder.
        source: folder of the new run, on the same file system.
        files: the new run's files.

    Raises:
        InputError: a file that sinssim did not write has the name of a new one; nothing is changed.
        OSError: a file cannot be moved; nothing is changed.
    """
    old = [name for name in (*(_written(place) or ()), MARK) if (place / name).is_file()]
    for name in files:
        if name not in old and os.path.lexists(place / name):
            raise InputError(f"{place / name} was not written by sinssim and stays unchanged.")
    moved: list[tuple[Path, Path]] = []

    def move(here: Path, there: Path) -> None:
        there.parent.mkdir(parents=True, exist_ok=True)
        os.replace(here, there)
        moved.append((here, there))

    replaced = Path(tempfile.mkdtemp(prefix=".replaced-", dir=source))
    try:
        for name in old:
            move(place / name, replaced / name)
        for name in files:
            move(source / name, place / name)
    except BaseException:
        for here, there in reversed(moved):
            os.replace(there, here)
        raise
    emptied = {parent for name in old for parent in (place / name).parents if place in parent.parents}
    for folder in sorted(emptied, key=lambda path: len(path.parts), reverse=True):
        with contextlib.suppress(OSError):  # not empty
            folder.rmdir()


def _beside(place: Path, ending: str) -> Path:
    """Return a place with a suffix to the name that is free or holds a run that may be replaced."""
    number = 1
    while True:
        there = place.with_name(f"{place.name}-{ending}" + (f"-{number}" if number > 1 else ""))
        if not os.path.lexists(there) or (there.is_dir() and _written(there) is not None):
            return there
        number += 1


def _is_taken(place: Path) -> bool:
    return place.exists() and (not place.is_dir() or any(place.iterdir()))


def _check_place(place: Path, overwrite: bool) -> None:
    """Raise unless a place is free or holds a run that may be replaced."""
    if not _is_taken(place):
        return
    if not place.is_dir():
        raise InputError(f"the run directory {place} is a file; give the name of a folder with -o.")
    files = _written(place)
    if files is None:
        older = (place / "recording.rrd").exists()
        raise InputError(
            f"the folder {place} is not empty and holds no run: it lacks the file {MARK}, by which sinssim recognises "
            "a run. It stays unchanged; give another folder with -o."
            + (" If it is a run of an older sinssim, move or remove it yourself." if older else "")
        )
    if not overwrite:
        raise InputError(
            f"the run directory {place} already contains a run. Give another folder with -o, or replace it with "
            "--overwrite."
        )
    for name in files:
        path = place / name
        links = [p for p in (path, *path.parents) if place in p.parents and p.is_symlink()]
        if links or path.is_dir():
            raise InputError(
                f"{links[0] if links else path} is a {'link' if links else 'folder'}, but sinssim wrote a file there; "
                "the run directory stays unchanged. Give another folder with -o, or restore the file."
            )


def _remove_leavings(parent: Path) -> None:
    """Remove the hidden folders of runs that were killed."""
    for folder in parent.glob(".*-*"):
        if (folder / IN_USE).is_file() and not folder.is_symlink():
            remove_unused(folder)
