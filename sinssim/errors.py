"""The errors that sinssim raises on purpose, and its warnings."""

from __future__ import annotations

import difflib
import re
import sys
import warnings
from collections.abc import Collection, Iterable
from types import FrameType

_HEAD, _TAIL = 4800, 1200
"""Characters at the beginning and at the end of a longer message that are kept: three screens."""
_SYNONYMS = {
    "height": "altitude alt elevation",
    "baro": "barometer barometric altimeter",
    "magnetometer": "compass",
    "gnss": "gps",
    "odometer": "wheel wheelspeed",
    "heading": "yaw azimuth",
    "latitude": "lat",
    "longitude": "lon lng long",
    "h": "hr hrs hour hours",
    "s": "sec secs second seconds",
    "sqrt": "rt root",
    "deg": "degree degrees",
    "m": "meter meters metre metres",
    "ft": "feet foot",
    "kt": "knot knots kts",
    "hz": "hertz",
    "": "per",
}
"""Words that people use for one another in names of keys, sensors and units; the first one is that of sinssim."""
_CANONICAL = {word: term for term, words in _SYNONYMS.items() for word in words.split()}
_COMPARED = 200  # number of characters compared with the known names


class SinssimError(Exception):
    """Base of all errors raised on purpose; the message says what is wrong, where, and what would be right."""

    exit_code = 1

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(printable(argument) if isinstance(argument, str) else argument for argument in arguments))


class InputError(SinssimError, ValueError):
    """The input cannot be used: a key, a name, a leg that cannot be flown, a full disk (exit code 2)."""

    exit_code = 2


class RunError(SinssimError, RuntimeError):
    """The input is valid but the run failed: a frame reached its pole, a viewer did not start (exit code 1).

    Args:
        message: description of the failure.
        time: time of the failure in the run, s, if there is one.
        exit_code: 2 if only the run shows that the input cannot be used, such as a program of another protocol.
    """

    def __init__(self, message: str, *, time: float | None = None, exit_code: int = 1) -> None:
        super().__init__(message)
        self.time, self.exit_code = time, exit_code


class SinssimWarning(UserWarning):
    """A remark on input that is used all the same: a plan beyond the limits of its aircraft."""


def warn(text: str) -> None:
    """Issue a warning at the line of the user's program that called sinssim; Python shows it once for each line.

    The command line prints it as a line on standard error.
    """
    frame: FrameType | None = sys._getframe()
    level = 1
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "sinssim":
        frame, level = frame.f_back, level + 1
    warnings.warn(printable(text), SinssimWarning, stacklevel=level)


def printable(text: str) -> str:
    r"""Return a text in which a terminal shows every character, and which is not too long.

    Control characters are written as in Python ("\x1b" for an escape character), line ends stay, and a long text loses
    its middle. A message may contain anything that a file contained.
    """
    if len(text) > _HEAD + _TAIL:
        text = f"{text[:_HEAD]} … ({len(text) - _HEAD - _TAIL} characters) … {text[-_TAIL:]}"
    if text.isprintable():
        return text
    return "".join(c if c in "\n\u00a0\u202f" or c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shortened(text: str, most: int = 80) -> str:
    """Return a text for a message; of a long one the beginning, "…" and its length."""
    return text if len(text) <= most else f"{text[:most]}… ({len(text)} characters)"


def respelled(name: str) -> str:
    """Return a name in the words of sinssim, in lower case with underscores: "altitude_ft" is "height_ft",
    "gyro_arw_deg_rt_hr" is "gyro_arw_deg_sqrt_h"."""
    words = re.split(r"[\W_]+", name[:_COMPARED].lower())
    return "_".join(filter(None, (_CANONICAL.get(word, word) for word in words)))


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is meant, None if there is none.

    It has the same words, or else the most similar spelling.
    """
    names = sorted(known)
    words = respelled(name)
    plain = words.replace("_", "")
    same = [candidate for candidate in names if plain and respelled(candidate).replace("_", "") == plain]
    near = same or difflib.get_close_matches(name[:_COMPARED], names, n=1)
    if not near:
        near = difflib.get_close_matches(words, names, n=1)
    return near[0] if near else None


def unknown_name(kind: str, name: object, known: Iterable[str]) -> InputError:
    """Return the error for an unknown name of a kind such as "algorithm", with the nearest known name and the list of
    all."""
    names = sorted(known)
    near = nearest(str(name), names)
    hint = f" Did you mean {near!r}?" if near else ""
    return InputError(f"unknown {kind} {shortened(repr(name))}.{hint} Known: {', '.join(names)}.")


def check_name(kind: str, name: object, known: Collection[str]) -> None:
    """Raise if a name is unknown or is not text."""
    if not isinstance(name, str) or name not in known:
        raise unknown_name(kind, name, known)
