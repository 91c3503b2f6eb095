"""Imports the libraries that read the formats of vendors; a missing one is named with the command that installs it."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from sinssim.errors import InputError

INSTALL = "pip install 'sinssim[logs]'"
"""The command that installs all of them."""


def library(module: str, package: str, purpose: str) -> Any:
    """Import a library of the extra `logs`.

    Args:
        purpose: what needs it, the beginning of the message: a file, or "--to mcap".

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{purpose} needs the library {package}, which is not installed ({error}). Install it with: {INSTALL}"
        ) from error


def refused(path: Path, format_name: str, error: BaseException) -> InputError:
    """Return the error for a file that a vendor's library cannot read.

    Args:
        format_name: what the file should be, for example "a PX4 ULog".
        error: the library's error.
    """
    reason = "".join(c if c.isprintable() else " " for c in str(error)).strip().rstrip(".")
    return InputError(
        f"{path} cannot be read as {format_name}: {reason[:300] or type(error).__name__}. It may be damaged or "
        "incomplete."
    )
