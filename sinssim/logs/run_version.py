"""The version of sinssim that wrote a run directory, and what is said of a run of another version."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sinssim import __version__
from sinssim.errors import warn
from sinssim.system.outputs import MARK

_PARTS = 2
"""Number of parts of a version, such as 0.1, within which the files and their columns stay the same."""


def version_of(run: Path) -> str:
    """Return the version of sinssim that wrote a run directory.

    Returns:
        The version in summary.json, or else in the mark of the directory; "" if neither gives one.
    """
    return next((str(v) for v in (_read(run / "summary.json", "versions"), _read(run / MARK)) if v), "")


def _read(file: Path, *path: str) -> Any:
    try:
        summary = json.loads(file.read_text(encoding="utf-8"))
        for key in (*path, "sinssim"):
            summary = summary[key]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return summary


def is_of_another(run: Path) -> bool:
    """Return whether another version of sinssim, whose files and numbers may differ, wrote a run directory.

    Returns:
        Whether the first two parts of the version differ; False if the version is not known.
    """
    version = version_of(run)
    return bool(version) and version.split(".")[:_PARTS] != __version__.split(".")[:_PARTS]


def warn_of_version(run: Path) -> None:
    """Warn of a run directory that another version of sinssim wrote."""
    if is_of_another(run):
        warn(
            f"{run} was written by sinssim {version_of(run)}, and this is {__version__}: its numbers, and the meaning "
            "of its columns, may differ. sinssim run with its scenario.toml makes it again."
        )


def reason_of(run: Path) -> str:
    """Return why a file of a run directory may lack what is needed, as a sentence.

    Returns:
        The versions if they differ; otherwise that the file was changed.
    """
    if is_of_another(run):
        return (
            f"The run was written by sinssim {version_of(run)}, and this is {__version__}; run its scenario.toml again."
        )
    return "The file was changed after the run, or belongs to another version of sinssim; run its scenario.toml again."
