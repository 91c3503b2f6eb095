"""The run directory and its summary.

The directory is written to a hidden folder beside its place and moved into place when complete. The summary has each
algorithm's errors for `summary.json` and as a table, and the versions of software and processor.
"""

from __future__ import annotations

import contextlib
import math
import os
import platform
import shutil
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import sinssim
from sinssim import units
from sinssim.data import DROPPED, FROZEN, SATURATED, ImuData, NavSolution
from sinssim.errors import InputError, RunError
from sinssim.formatting import size_text
from sinssim.system.outputs import Draft, check_place, is_taken, publish, written


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
        """Convert system errors inside the block, such as a full disk, into an input error, and remove the folder."""
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
    """Write a directory that is complete or not there."""
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


def flagged(imu: ImuData) -> dict[str, int]:
    """Return the number of flagged samples, for `summary.json`.

    Returns:
        Number of samples by kind of flag, set by any sensor; empty if the sensors set no flags.
    """
    if imu.flags is None:
        return {}
    kinds = {"saturated": SATURATED, "dropped": DROPPED, "frozen": FROZEN}
    return {name: int(np.any(imu.flags & bit, axis=1).sum()) for name, bit in kinds.items()}


def flagged_words(flags: Mapping[str, int], samples: int) -> str:
    """Report the number of flagged samples.

    Args:
        flags: result of `flagged`.

    Returns:
        A sentence; empty if there are no flagged samples.
    """
    counts = [f"{count:,} {name}" for name, count in flags.items() if count]
    return f"Flagged by the sensors, of {samples:,} samples: {', '.join(counts)}." if counts else ""


def singularities(solutions: Mapping[str, NavSolution]) -> dict[str, list[dict[str, Any]]]:
    """Return the passages through a singular attitude, for `summary.json`."""
    return {
        name: [
            {
                "start_s": event.start,
                "end_s": event.end,
                "damage_arcsec": event.damage / units.ARCSEC,
                "text": event.text,
            }
            for event in solution.events
        ]
        for name, solution in solutions.items()
        if solution.events
    }


def failures(failed: Mapping[str, RunError]) -> dict[str, dict[str, Any]]:
    """Return which algorithms have no result, and why, for `summary.json`.

    Returns:
        For each algorithm the instant, None if unknown, and the text.
    """
    return {name: {"time_s": error.time, "text": str(error)} for name, error in failed.items()}


def plain(value: Any) -> Any:
    """Return a value that JSON can hold: null in place of non-finite numbers, at any depth.

    Args:
        value: dictionaries, lists and tuples of numbers, texts and the like.

    Returns:
        The same value, with None where a float is NaN or infinite.
    """
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def versions() -> dict[str, str]:
    """Return the versions of the software that computed the numbers."""
    names = ("jsbsim", "numpy", "scipy", "numba", "filterpy", "rerun-sdk", "pyarrow")
    return {"sinssim": sinssim.__version__, **{name: _version(name) for name in names}}


@cache
def _version(name: str) -> str:
    """Return the version of an installed package; its metadata take milliseconds to read."""
    return version(name)


def software() -> str:
    """Return the versions of the software and the processor, in a line."""
    about = {**versions(), "Python": platform.python_version(), "processor": processor()}
    return ", ".join(f"{name} {text}" for name, text in about.items())


def processor() -> str:
    """Return the name of the machine's processor."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return (names or [platform.processor() or platform.machine()])[0]
