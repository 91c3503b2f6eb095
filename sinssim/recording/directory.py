"""The run directory: written beside its place, and put there in one step."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from sinssim.errors import InputError

_MARKS = ("summary.json", "recording.rrd")
"""A folder that holds one of these is a run directory, and may be replaced when that was asked for."""


class RunDirectory:
    """A run directory in the making, in a hidden folder beside its final place until `keep` puts it there.

    Attributes:
        target: where it will be.
        path: where to write meanwhile.
    """

    def __init__(self, target: Path, *, overwrite: bool = False) -> None:
        """Check the place and make the hidden folder.

        Args:
            target: where the run directory will be.
            overwrite: whether a run that is there already may be replaced.

        Raises:
            InputError: the place is taken, or cannot be written.
        """
        self.target = target.resolve()
        self._overwrite = overwrite
        self._made: list[Path] = []
        parent = self.target.parent
        try:
            _check_place(self.target, overwrite)
            missing = [p for p in (parent, *parent.parents) if not p.exists()]
            for folder in reversed(missing):
                folder.mkdir()
                self._made.append(folder)
            self.path = Path(tempfile.mkdtemp(prefix=f".{self.target.name}-", dir=parent))
            self.path.chmod(0o777 & ~_umask())
        except OSError as error:
            self._remove_made()
            raise InputError(
                f"the run directory {target} cannot be made: {error.strerror} ({parent}). Give a folder that can be "
                "written with -o."
            ) from error

    def keep(self, *, beside: str = "") -> Path:
        """Put the run directory in its place.

        Args:
            beside: for a run that is not whole: it does not replace one that is there, but goes beside it, under
                the same name with this at its end.

        Returns:
            Where it is now.

        Raises:
            OSError: it cannot be put there; what was there stays.
        """
        place = self.target
        if beside and _is_taken(place):
            place = place.with_name(f"{place.name}-{beside}")
        old = None
        if _is_taken(place):
            _check_place(place, self._overwrite or bool(beside))
            old = Path(tempfile.mkdtemp(prefix=f".{place.name}-old-", dir=place.parent))
            os.replace(place, old)
        elif place.is_dir():
            place.rmdir()
        try:
            os.replace(self.path, place)
        except OSError:
            if old is not None:
                os.replace(old, place)
            raise
        if old is not None:
            shutil.rmtree(old, ignore_errors=True)
        return place

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Turn a full disk and the like, inside the block, into an error that says so, and leave nothing behind.

        Raises:
            InputError: something could not be written.
        """
        try:
            yield
        except OSError as error:
            free = shutil.disk_usage(self.target.parent if self._made == [] else self._made[0].parent).free
            self.discard()
            raise InputError(
                f"the run directory {self.target} could not be written: {error.strerror or error} ({free / 1e6:.0f} MB "
                "were free). Nothing of this run was kept; what was there before is untouched."
            ) from error

    def discard(self) -> None:
        """Remove everything that was written; what was in the place stays."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._remove_made()

    def _remove_made(self) -> None:
        with contextlib.suppress(OSError):
            for folder in reversed(self._made):
                folder.rmdir()


def write_text(path: Path, text: str) -> None:
    """Write a text file beside and rename it into place.

    Args:
        path: the file.
        text: what it shall hold.

    Raises:
        OSError: it cannot be written.
    """
    beside = path.with_name(path.name + ".part")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)


def _is_taken(place: Path) -> bool:
    return place.exists() and (not place.is_dir() or any(place.iterdir()))


def _check_place(place: Path, overwrite: bool) -> None:
    if not _is_taken(place):
        return
    if not place.is_dir():
        raise InputError(f"the run directory {place} is a file; give the name of a folder with -o.")
    if not any((place / mark).exists() for mark in _MARKS):
        raise InputError(
            f"the folder {place} is not empty and holds no run; it is left alone. Give another one with -o."
        )
    if not overwrite:
        raise InputError(
            f"the run directory {place} holds a run already. Give another one with -o, or replace it with --overwrite."
        )


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
