"""Files that a user names are opened here, and directories of output written.

A file of a user is an ordinary one: a named pipe waits until somebody writes, and /dev/zero has no end.

Output is written to a hidden folder beside its place and then moved there. A directory has a mark with the files that
sinssim wrote in it; all other files stay. A temporary folder holds a file with the number of its process and the name
of its machine, locked as long as the process lives. A later process that writes beside the same place removes the
folders whose processes have ended, in particular those that were killed. The system unlocks a file however a process
ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import shutil
import socket
import stat
import sys
import tempfile
import weakref
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path, PurePosixPath
from typing import Self, TextIO

from sinssim import __version__
from sinssim.errors import InputError, shortened
from sinssim.units import size_text

_KINDS = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def user_file(path: Path) -> Path:
    """Return the path of a file, or of a folder of such a format, for a library that opens it; raise if it cannot be
    read."""
    stat = path.stat()
    kind = next((words for test, words in _KINDS if test(stat.st_mode)), None)
    if kind is not None:
        raise InputError(f"{path} is {kind}, not an ordinary file. Copy its contents to a file, and give that.")
    from sinssim.system.process import machine_memory

    if stat.st_size > machine_memory():
        raise InputError(
            f"{path} has {size_text(stat.st_size)}, and this machine's memory {size_text(machine_memory())}. Split it "
            "into parts."
        )
    return path


def open_file(path: Path) -> BufferedReader:
    """Open a file for reading bytes."""
    return user_file(path).open("rb")


def open_text(path: Path, encoding: str, errors: str = "strict", newline: str | None = None) -> TextIO:
    """Open a file for reading text (encoding, errors, newline as for `open`)."""
    return user_file(path).open(encoding=encoding, errors=errors, newline=newline)


def read_bytes(path: Path) -> bytes:
    """Return the contents of a file: its bytes."""
    return user_file(path).read_bytes()


def read_text(path: Path, encoding: str = "utf-8", errors: str = "strict") -> str:
    """Return the contents of a text file (encoding, errors as for `open`)."""
    return user_file(path).read_text(encoding=encoding, errors=errors)


if sys.platform != "win32":
    import fcntl

IN_USE = ".sinssim-in-use"
"""Name of the locked file in a folder."""


def open_own(path: Path, *, make: bool = True) -> int:
    """Open a file of this program for reading and writing; links are not followed. Return its descriptor, which child
    programs do not inherit."""
    flags = os.O_RDWR | (os.O_CREAT if make else 0)
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)  # Windows has neither
    file = os.open(path, flags, 0o666)
    about = os.fstat(file)
    if not stat.S_ISREG(about.st_mode) or (not make and sys.platform != "win32" and about.st_uid != os.geteuid()):
        os.close(file)
        raise PermissionError(f"{path} is not a file of this program")
    return file


def try_lock(file: int) -> bool | None:
    """Lock a file until its descriptor is closed, at the latest when the process ends; return whether this process has
    locked it, and not another one; None if the system has no such locks, as Windows or some network drives."""
    if sys.platform == "win32":
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return None
    return True


def try_hold(folder: Path) -> int | None:
    """Mark a folder as in use, unless another process has; return descriptor of the locked file; None if another
    process has locked it. Without locks, the folder is taken as free."""
    file = open_own(folder / IN_USE)
    if try_lock(file) is False:
        os.close(file)
        return None
    return file


IN_DRAFT = ".sinssim-draft"
"""Name of the locked file in a hidden folder."""
_HEAD = "sinssim draft of process"


class Draft:
    """A hidden folder for temporary output; removed by `close`, at the end of a `with` block, or by a later process.

    Attributes:
        path: the folder.
    """

    def __init__(self, parent: Path | None = None, name: str = "sinssim", *, mode: int = 0o777) -> None:
        """Make a folder in an existing one, by default the system's for temporary files, with a name that begins with
        `name` and permissions before those that the process withholds, and remove those of processes that have
        ended."""
        if parent is None:
            parent, mode = Path(tempfile.gettempdir()), 0o700
        remove_left(parent)
        self.path = parent / f".{name}-{secrets.token_hex(8)}"
        self._lock: int | None = None
        # for an interruption before the caller has the folder, which no block can catch
        self._end = weakref.finalize(self, _discard, self.path, os.getpid())
        try:
            self.path.mkdir(mode)
            self._lock = open_own(self.path / IN_DRAFT)
            try_lock(self._lock)
            os.write(self._lock, f"{_HEAD} {os.getpid()} on {socket.gethostname()}\n".encode())
        except BaseException:  # in particular an interruption: the caller does not have the folder yet
            self.close()
            raise

    def move_to(self, place: Path) -> None:
        """Rename the folder to its final name."""
        (self.path / IN_DRAFT).unlink()
        os.replace(self.path, place)
        self.close()

    def close(self) -> None:
        """Remove the folder."""
        self._end.detach()
        shutil.rmtree(self.path, ignore_errors=True)
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _discard(path: Path, process: int) -> None:
    """Remove a folder in the process that made it, and not in one that was forked from it."""
    if os.getpid() == process:
        shutil.rmtree(path, ignore_errors=True)


@contextmanager
def draft(path: Path) -> Iterator[Path]:
    """Write a file under a temporary name in a hidden folder beside it, and rename it into place at the end of the
    block.

    A link at its place is replaced, not followed.
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
    if not (folder / IN_DRAFT).is_file():
        return
    file = open_own(folder / IN_DRAFT, make=False)
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


MARK = ".sinssim.json"
"""Name of the file that marks an output directory. It lists the files that sinssim wrote and may replace."""


def write_text(path: Path, text: str) -> None:
    """Write a text file to a temporary file and rename it into place."""
    with draft(path) as beside:
        beside.write_text(text, encoding="utf-8")


def written(place: Path) -> list[str] | None:
    """Return the files that sinssim wrote in a directory: their names in it, with slashes, by its mark; None without a
    mark that could be one."""
    mark = place / MARK
    if mark.is_symlink() or not mark.is_file():
        return None
    try:
        names = [PurePosixPath(name) for name in json.loads(mark.read_text(encoding="utf-8"))["files"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    if any(name.is_absolute() or ".." in name.parts or not name.parts or "\0" in str(name) for name in names):
        return None
    return [str(name) for name in names]


def check_inside(place: Path, names: Iterable[str]) -> None:
    """Refuse names in a directory that a link leads elsewhere, or at which there is a folder instead of a file."""
    for name in names:
        path = place / name
        links = [p for p in (path, *path.parents) if place in p.parents and p.is_symlink()]
        if links or path.is_dir():
            raise InputError(
                f"{links[-1] if links else path} is a {'link' if links else 'folder'}, but sinssim writes a file "
                f"{'through it' if links else 'there'}; {place} stays unchanged. Give another folder with -o, or "
                f"remove the {'link' if links else 'folder'}."
            )


def remove(place: Path, names: Iterable[str]) -> None:
    """Remove files of sinssim in a directory, and the folders that are empty then; all others stay (names of files in
    it, with slashes; missing ones are left out)."""
    names = list(names)
    check_inside(place, names)
    for name in names:
        (place / name).unlink(missing_ok=True)
    _remove_emptied(place, names)


def publish(source: Draft, place: Path, staying: Iterable[str] = ()) -> list[str]:
    """Move a draft, on the same file system, to its place, or replace what sinssim wrote there, file by file; all other
    files stay. Files of sinssim whose names are in `staying` stay, too, and are marked with the new ones. Return the
    names of the new files, with slashes."""
    new, staying = _files(source.path), list(staying)
    if not os.path.lexists(place):
        _write_mark(source.path, new)
        source.move_to(place)
        return new
    ours = [name for name in written(place) or () if name not in staying]
    check_inside(place, [MARK, *new, *ours, *staying])
    old = [name for name in ours if (place / name).is_file()]
    for name in new:
        if name not in old and os.path.lexists(place / name):
            raise InputError(f"{place / name} was not written by sinssim and stays unchanged.")
    before = (place / MARK).read_bytes() if (place / MARK).is_file() else None
    moved: list[tuple[Path, Path]] = []

    def move(here: Path, there: Path) -> None:
        there.parent.mkdir(parents=True, exist_ok=True)
        os.replace(here, there)
        moved.append((here, there))

    with Draft(source.path, "replaced") as replaced:
        try:
            _write_mark(place, {*ours, *new, *staying})  # whoever is killed now leaves no file that is not marked
            for name in old:
                move(place / name, replaced.path / name)
            for name in new:
                move(source.path / name, place / name)
            _write_mark(place, {*new, *staying})
        except BaseException:
            for here, there in reversed(moved):
                os.replace(there, here)
            if before is None:
                (place / MARK).unlink(missing_ok=True)
            else:
                with draft(place / MARK) as beside:
                    beside.write_bytes(before)
            raise
    _remove_emptied(place, old)
    return new


def _write_mark(place: Path, names: Iterable[str]) -> None:
    """Write the mark of a directory."""
    write_text(place / MARK, json.dumps({"sinssim": __version__, "files": sorted(names)}, indent=1) + "\n")


def _files(folder: Path) -> list[str]:
    """Return the files of a directory being written, relative to its folder, with slashes."""
    names = (path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())
    return sorted(name for name in names if name not in (MARK, IN_DRAFT))


def _remove_emptied(place: Path, names: Iterable[str]) -> None:
    """Remove the folders of removed files that are empty."""
    emptied = {parent for name in names for parent in (place / name).parents if place in parent.parents}
    for folder in sorted(emptied, key=lambda path: len(path.parts), reverse=True):
        with contextlib.suppress(OSError):  # not empty
            folder.rmdir()


def is_taken(place: Path) -> bool:
    """Return whether a place is a file, or a folder that is not empty."""
    return place.exists() and (not place.is_dir() or any(place.iterdir()))


def check_place(place: Path, overwrite: bool) -> None:
    """Raise unless a place is free or holds a run that may be replaced."""
    if not is_taken(place):
        return
    if not place.is_dir():
        raise InputError(f"the run directory {place} is a file; give the name of a folder with -o.")
    files = written(place)
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
    check_inside(place, files)


def as_directory(directory: object) -> Path:
    """Return the path of a directory to write; refuse another object, such as settings in its place."""
    if not isinstance(directory, str | os.PathLike):
        shown = shortened(repr(directory))
        raise InputError(f"directory = {shown} must be a path; settings of keys are given by name, as overrides.")
    return Path(directory)


def check_directory(directory: Path | str | None, overwrite: bool) -> None:
    """Raise before a computation unless its directory is free or `overwrite` allows to replace the result in it."""
    if directory is not None:
        check_place(as_directory(directory).resolve(), overwrite)
    elif overwrite:
        raise InputError("overwrite needs the directory of a result.")
