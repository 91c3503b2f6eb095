"""Marks folders as in use by a locked file, which the system unlocks however the process ends."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

if sys.platform != "win32":
    import fcntl

MARK = ".sinssim-in-use"
"""Name of the locked file in a folder."""


def hold(folder: Path) -> int:
    """Mark a folder as in use until the returned descriptor is closed, at the latest when the process ends.

    Args:
        folder: the folder; it is made if it does not exist.

    Returns:
        Descriptor of the locked file; not inherited by child processes.

    Raises:
        OSError: the folder cannot be made, or its file cannot be opened.
    """
    while True:
        folder.mkdir(parents=True, exist_ok=True)
        file = os.open(folder / MARK, os.O_RDWR | os.O_CREAT, 0o666)
        if sys.platform == "win32":
            return file
        try:
            fcntl.flock(file, fcntl.LOCK_EX)
        except OSError:  # a file system without locks; `remove_unused` finds none there either, and removes nothing
            return file
        if os.fstat(file).st_nlink:
            return file
        os.close(file)  # another process has removed the folder meanwhile


def try_hold(folder: Path) -> int | None:
    """Mark a folder as in use, unless another process has.

    Args:
        folder: an existing folder.

    Returns:
        Descriptor of the locked file, as for `hold`; None if another process has locked it. Without locks, on Windows
        or on some network drives, the folder is taken as free.

    Raises:
        OSError: the file cannot be opened.
    """
    file = os.open(folder / MARK, os.O_RDWR | os.O_CREAT, 0o666)
    if sys.platform == "win32":
        return file
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(file)
        return None
    except OSError:  # a file system without locks
        return file
    return file


def remove_unused(folder: Path) -> bool:
    """Remove a folder unless a process has marked it as in use.

    Args:
        folder: the folder, with everything in it.

    Returns:
        Whether it was removed. Nothing is removed if the system does not support such locks.
    """
    if sys.platform == "win32":
        return False
    try:
        file = os.open(folder / MARK, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    else:
        shutil.rmtree(folder, ignore_errors=True)
        return True
    finally:
        os.close(file)
