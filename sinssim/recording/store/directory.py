"""The run directory: written to a hidden folder beside its place and moved into place when complete."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from sinssim.errors import InputError
from sinssim.formatting import size_text
from sinssim.system.drafts import Draft
from sinssim.system.outputs import check_place, is_taken, publish, written


class RunDirectory:
    """A run directory being written, in a hidden folder beside its final place until `keep` moves it there.

    Attributes:
        target: the final place.
        path: the hidden folder to write to.
    """

    def __init__(self, target: Path, *, overwrite: bool = False) -> None:
        """Check the place and make the hidden folder.

        Args:
            overwrite: whether the files that sinssim wrote for an existing run may be replaced.

        Raises:
            InputError: the place is taken or cannot be written.
        """
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
        """Move the run directory into its place.

        Args:
            beside: suffix of the name under which an incomplete run is kept beside an existing one, which it does not
                replace.

        Raises:
            InputError: files that sinssim did not write are in the way; they stay, and the run is kept beside them.
            OSError: the directory cannot be moved; the existing files stay.
        """
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
        self._draft.close()
        self._remove_made()

    def _remove_made(self) -> None:
        with contextlib.suppress(OSError):
            for folder in reversed(self._made):
                folder.rmdir()


def write_directory(target: Path, write: Callable[[Path], object], *, overwrite: bool) -> Path:
    """Write a directory that is complete or not there.

    Raises:
        InputError: the place is taken or cannot be written.
    """
    folder = RunDirectory(target, overwrite=overwrite)
    try:
        with folder.writing():
            write(folder.path)
            return folder.keep()
    except BaseException:
        if folder.path.exists():
            folder.discard()
        raise


def _beside(place: Path, ending: str) -> Path:
    """Return a place with a suffix to the name that is free or holds a run that may be replaced."""
    number = 1
    while True:
        there = place.with_name(f"{place.name}-{ending}" + (f"-{number}" if number > 1 else ""))
        if not os.path.lexists(there) or (not there.is_symlink() and written(there) is not None):
            return there
        number += 1
