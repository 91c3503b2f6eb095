"""Finds the format of a recorded file by its content and name, and reads it."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from sinssim.errors import InputError
from sinssim.logs.formats.registry import FORMATS
from sinssim.system.own_content.registry import ensure, module_of
from sinssim.system.user_file import open_file

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.logs.streams import FixStream, SolutionStream, Streams

_HEAD = 4096


class Format(Protocol):
    """What a module of a format defines; `files_of` only if the format is a folder."""

    def recognises(self, path: Path, head: bytes) -> bool: ...
    def read(self, path: Path) -> Streams: ...
    def files_of(self, folder: Path) -> list[Path]: ...


def format_module(name: str) -> Format:
    """Return the module of a format.

    Args:
        name: key of `FORMATS`.

    Raises:
        InputError: the format is unknown.
    """
    return cast(Format, module_of(FORMATS, name, "sinssim.logs.formats", ("recognises", "read")))


def candidates(path: Path) -> list[str]:
    """Return the names of the formats that a file may have.

    Args:
        path: a file, or a folder for the formats that are folders.

    Returns:
        Keys of `FORMATS`, none if no format fits.

    Raises:
        InputError: the file does not exist, is empty or cannot be read.
    """
    if not path.exists():
        raise InputError(f"{path} does not exist; give a recorded file.")
    head = b""
    if not path.is_dir():
        try:
            with open_file(path) as file:
                head = file.read(_HEAD)
        except OSError as error:
            raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
        if not head.strip():
            raise InputError(f"{path} is empty{' but for blanks' if head else ''}; it contains no data.")
    if found := [name for name in FORMATS if format_module(name).recognises(path, head)]:
        return found
    known = list(FORMATS)
    ensure("formats", "*")  # those of installed packages, whose list takes a while to read
    return [name for name in FORMATS if name not in known and format_module(name).recognises(path, head)]


def folder_of(file: Path) -> Path | None:
    """Return the folder that a file is a part of, in one of the formats that are folders; None if there is none."""
    for folder in (file.parent, file.parent.parent):
        for name in candidates(folder):
            if file in format_module(name).files_of(folder):
                return folder
    return None


def detect(path: Path) -> str:
    """Return the format of a file.

    Args:
        path: a file, or a folder for the formats that are folders.

    Returns:
        Key of `FORMATS`.

    Raises:
        InputError: no format fits, or several do.
    """
    found = candidates(path)
    if len(found) == 1:
        return found[0]
    if not found:
        raise InputError(
            f"{path} has none of the known formats: {', '.join(FORMATS)}. If it has one of them, give its name "
            "(--format NAME)."
        )
    raise InputError(
        f"{path} may be {', '.join(found[:-1])} or {found[-1]}: their numbers look alike. Give the format "
        "(--format NAME)."
    )


def read_file(path: Path | str, format_name: str | None = None) -> Streams:
    """Read a recorded file.

    Args:
        path: the file, or a folder for the formats that are folders.
        format_name: key of `FORMATS`; found from the file if not given.

    Raises:
        InputError: the file cannot be read, is of an unknown format, is damaged, or needs a library that is not
            installed.
    """
    path = Path(path)
    if format_name is not None:
        FORMATS.check(format_name)
        if not path.exists():
            raise InputError(f"{path} does not exist; give a recorded file.")
    name = detect(path) if format_name is None else format_name
    try:
        with np.errstate(all="ignore"):  # damaged numbers overflow; they are judged below
            found = format_module(name).read(path)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except csv.Error as error:
        raise InputError(f"{path} cannot be read as a table: {error}.") from error
    except MemoryError as error:
        raise InputError(f"{path} does not fit into memory. Split it into parts.") from error
    _check(found)
    return found


def _check(streams: Streams) -> None:
    """Refuse streams without rows, times that are not finite, and places that are not on the Earth."""
    for name, imu in streams.inertial.items():
        _check_times(streams, name, imu.time)
        finite = np.isfinite(imu.gyro).all(axis=1) & np.isfinite(imu.accel).all(axis=1)
        _refuse(streams, name, ~finite, "a reading is not finite")
    placed: list[tuple[str, FixStream | SolutionStream]] = [*streams.fixes.items(), *streams.solutions.items()]
    for name, stream in placed:
        _check_times(streams, name, stream.time)
        _refuse(streams, name, np.abs(stream.latitude) > 0.5 * np.pi + 1e-9, "the latitude is beyond ±90°")
        _refuse(streams, name, np.abs(stream.longitude) > 2.0 * np.pi + 1e-9, "the longitude is beyond ±360°")


def _check_times(streams: Streams, name: str, time: Array) -> None:
    if not len(time):
        raise InputError(f"{streams.path}: the stream {name!r} has no rows.")
    _refuse(streams, name, ~np.isfinite(time), "the time is not finite")


def _refuse(streams: Streams, name: str, given: ArrayLike, what: str) -> None:
    bad = np.asarray(given, dtype=np.bool_)
    if bad.any():
        raise InputError(f"{streams.path}, row {int(np.argmax(bad)) + 1} of {name!r}: {what}. The file may be damaged.")
