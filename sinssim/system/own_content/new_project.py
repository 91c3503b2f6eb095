"""Lays out a project folder from the package's example."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from sinssim.content import package_content
from sinssim.errors import InputError

_FILES = {
    "README.md": "what everything is, and what to type",
    "scenario.toml": "what to simulate",
    "grades/my_unit.toml": "your own sensors",
    "algorithms/cayley.py": "your own attitude algorithm",
    "views/attitude.py": "your own view",
}
"""Files of the example, with what they are."""


def new_project(folder: Path) -> list[tuple[str, str]]:
    """Lay out a project folder.

    Args:
        folder: the folder; it is made if it does not exist.

    Returns:
        Each file, relative to the folder, with what it is.

    Raises:
        InputError: the folder is not empty, is a file, or cannot be written.
    """
    example = package_content("scenarios") / "new_project"
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    begun = False
    try:
        if folder.is_dir():
            there = sorted(path.name for path in folder.iterdir())
            if there:
                shown = ", ".join(there[:3]) + (f" and {len(there) - 3} more" if len(there) > 3 else "")
                raise InputError(f"the folder {folder} is not empty: it has {shown}. Name a new folder.")
        elif folder.exists():
            raise InputError(f"{folder} is a file. Name a new folder.")
        begun = True
        for name in _FILES:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(example / name, folder / name)
    except OSError as error:
        if begun:
            _remove(folder, made)
        raise InputError(
            f"the project folder {folder} cannot be made: {error.strerror}. Name another folder."
        ) from error
    return list(_FILES.items())


def _remove(folder: Path, made: Iterable[Path]) -> None:
    """Remove the files of the example from a folder that was empty, and the folders that were made."""
    for name in _FILES:
        with suppress(OSError):
            (folder / name).unlink()
    for place in (*sorted({(folder / name).parent for name in _FILES} - {folder}), *made):
        with suppress(OSError):  # it may not exist
            place.rmdir()
