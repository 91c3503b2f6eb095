"""Marks folders as in use by a locked file, which the system unlocks however the process ends."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

if sys.platform != "win32":
    import fcntl

MARK = ".sinssim-in-use"
"""Name of the locked file in a folder."""


def open_own(path: Path, *, make: bool = True) -> int:
    """Open a file of this program for reading and writing; links are not followed.

    Returns:
        Its descriptor, which child programs do not inherit.

    Raises:
        OSError: it cannot be opened, is a link, no regular file, or another user's.
    """
    flags = os.O_RDWR | (os.O_CREAT if make else 0)
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)  # Windows has neither
    file = os.open(path, flags, 0o666)
    about = os.fstat(file)
    if not stat.S_ISREG(about.st_mode) or (not make and sys.platform != "win32" and about.st_uid != os.geteuid()):
        os.close(file)
        raise PermissionError(f"{path} is not a file of this program")
    return file


def try_lock(file: int) -> bool | None:
    """Lock a file until its descriptor is closed, at the latest when the process ends.

    Returns:
        Whether this process has locked it, and not another one; None if the system has no such locks, as Windows or
        some network drives.
    """
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
    """Mark a folder as in use, unless another process has.

    Returns:
        Descriptor of the locked file; None if another process has locked it. Without locks, the folder is taken as
        free.

    Raises:
        OSError: the file cannot be opened.
    """
    file = open_own(folder / MARK)
    if try_lock(file) is False:
        os.close(file)
        return None
    return file
