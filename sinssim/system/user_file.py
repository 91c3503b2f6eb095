"""Opens the files that a user names: ordinary ones only, which neither wait for ever nor have no end.

Every file of a user is opened here: a named pipe waits until somebody writes, and /dev/zero has no end.
"""

from __future__ import annotations

import stat
from io import BufferedReader
from pathlib import Path
from typing import TextIO

from sinssim.errors import InputError
from sinssim.formatting import size_text

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
    from sinssim.system.process import machine_memory  # which loads numpy

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
