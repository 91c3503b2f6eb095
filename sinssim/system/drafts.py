"""Temporary output: hidden folders beside the place of what is written, which outlive no process for long.

A folder holds a file with the number of its process and the name of its machine, locked for as long as the process
lives. A later process that writes beside the same place removes the folders whose processes have ended, in particular
those that were killed.
"""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Self

from sinssim.system.locks import open_own, try_lock

MARK = ".sinssim-draft"
"""Name of the locked file in a hidden folder."""
_HEAD = "sinssim draft of process"


class Draft:
    """A hidden folder for temporary output; removed by `close`, at the end of a `with` block, or by a later process.

    Attributes:
        path: the folder.
    """

    def __init__(self, parent: Path | None = None, name: str = "sinssim", *, mode: int = 0o777) -> None:
        """Make a folder, and remove those of processes that have ended.

        Args:
            parent: an existing folder; the system's folder for temporary files if not given.
            name: what the name of the folder begins with.
            mode: permissions of the folder, before those that the process withholds.

        Raises:
            OSError: the folder cannot be made.
        """
        if parent is None:
            parent, mode = Path(tempfile.gettempdir()), 0o700
        remove_left(parent)
        self.path = parent / f".{name}-{secrets.token_hex(8)}"
        self._lock: int | None = None
        try:
            self.path.mkdir(mode)
            self._lock = open_own(self.path / MARK)
            try_lock(self._lock)
            os.write(self._lock, f"{_HEAD} {os.getpid()} on {socket.gethostname()}\n".encode())
        except BaseException:  # in particular an interruption: the caller does not have the folder yet
            self.close()
            raise

    def move_to(self, place: Path) -> None:
        """Rename the folder to its final name.

        Raises:
            OSError: it cannot be renamed.
        """
        (self.path / MARK).unlink()
        os.replace(self.path, place)
        self.close()

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.path, ignore_errors=True)
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def draft(path: Path) -> Iterator[Path]:
    """Write a file under a temporary name, and rename it into place at the end of the block.

    Args:
        path: the file; a link there is replaced, not followed.

    Yields:
        The temporary name, in a hidden folder beside the place.

    Raises:
        OSError: the file cannot be written; nothing is left of it.
    """
    with Draft(path.parent, path.name) as folder:
        yield folder.path / path.name
        os.replace(folder.path / path.name, path)


def remove_left(parent: Path) -> None:
    """Remove the hidden folders of processes that have ended.

    Nothing is removed if the system does not support locks, or of processes on other machines.
    """
    with suppress(OSError):
        for entry in list(os.scandir(parent)):
            if entry.name.startswith(".") and entry.is_dir(follow_symlinks=False):
                with suppress(OSError):
                    _remove_unused(Path(entry.path))


def _remove_unused(folder: Path) -> None:
    if not (folder / MARK).is_file():
        return
    file = open_own(folder / MARK, make=False)
    try:
        if _has_ended(os.read(file, 300)) and try_lock(file):
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(file)


def _has_ended(mark: bytes) -> bool:
    """Return whether a mark is that of a process of this machine that does not exist any more."""
    number, _, host = mark.decode(errors="replace").removeprefix(_HEAD).strip().partition(" on ")
    if not (mark.startswith(_HEAD.encode()) and number.isdecimal() and host == socket.gethostname()):
        return False
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):  # another user's
        return False
    return False
