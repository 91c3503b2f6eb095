"""The errors that sinssim raises on purpose."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

_COMPARED = 200  # characters that are compared with the names that there are


class SinssimError(Exception):
    """Base of every error raised on purpose; its text says what was wrong, where, and what would be right."""

    exit_code = 1


class InputError(SinssimError, ValueError):
    """What the user gave cannot be used: a key, a name, a leg that cannot be flown, a full disk (exit code 2)."""

    exit_code = 2


class RunError(SinssimError, RuntimeError):
    """The input was fine but the run failed: a frame met its pole, a viewer did not start (exit code 1).

    Args:
        message: what happened.
        time: instant of the run at which it happened, s, if it happened at one.
    """

    def __init__(self, message: str, *, time: float | None = None) -> None:
        super().__init__(message)
        self.time = time


def shortened(text: str, most: int = 80) -> str:
    """Return a text for a message, cut if it is long: a person wants to recognise it, not to read all of it.

    Args:
        text: the text.
        most: characters that are left of it.

    Returns:
        The text, or its beginning with "…" and its length.
    """
    return text if len(text) <= most else f"{text[:most]}… ({len(text)} characters)"


def unknown_name(kind: str, name: object, known: Iterable[str]) -> InputError:
    """Return the error for a name that is not in a list, with the nearest right one and the whole list.

    Args:
        kind: what the name names, for example "algorithm".
        name: the name that was given.
        known: all the names that would be right.

    Returns:
        The error, ready to raise.
    """
    names = sorted(known)
    near = difflib.get_close_matches(str(name)[:_COMPARED], names, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return InputError(f"unknown {kind} {shortened(repr(name))}.{hint} Known: {', '.join(names)}.")


def check_name(kind: str, name: object, known: Collection[str]) -> None:
    """Raise if a name is none of those that there are.

    Args:
        kind: what it names.
        name: what was given; anything but text is no name.
        known: all names that would be right.

    Raises:
        InputError: listing them.
    """
    if not isinstance(name, str) or name not in known:
        raise unknown_name(kind, name, known)
