"""Lets text be written to streams with limited encodings: cp1252 and Latin-1 of Windows' files and pipes, ASCII."""

from __future__ import annotations

import codecs
import sys
import unicodedata
from typing import TextIO

_NAME = "sinssim-plain"
_PLAIN = {
    "−": "-", "–": "-", "—": "-", "‑": "-", "…": "...", "·": ".", "•": "*", "×": "x", "÷": "/", "±": "+-", "√": "sqrt",
    "→": "->", "←": "<-", "⇒": "=>", "≤": "<=", "≥": ">=", "≈": "~", "≠": "!=", "∞": "inf", "∝": "~", "°": "deg",
    "′": "'", "″": '"', "’": "'", "‘": "'", "“": '"', "”": '"', "„": '"', "«": '"', "»": '"', "µ": "u", "μ": "u",
    "∂": "d", "∑": "sum", "∫": "int", "ß": "ss", "⊗": "*", "✓": "ok", "✗": "no", "²": "^2", "³": "^3", "‰": "permille",
}  # fmt: skip


def encode_everything(stream: TextIO) -> None:
    """Let a text stream replace characters that its encoding lacks (σ by "sigma") instead of raising an error.

    Args:
        stream: standard output or standard error. A stream with a user's own error handler keeps it, and other objects
            are not changed.
    """
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None and stream.errors in ("strict", "backslashreplace", "surrogateescape"):
        reconfigure(errors=_NAME)


def holds_everything(stream: TextIO) -> bool:
    """Return whether a stream's encoding represents all characters."""
    return (getattr(stream, "encoding", None) or "utf-8").lower().startswith(("utf", "cp65001"))


def _in_plain_words(error: UnicodeError) -> tuple[str | bytes, int]:
    """Replace one character that cannot be encoded; the error handler for codecs."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    character, following = error.object[error.start], error.start + 1
    if "\udc80" <= character <= "\udcff":  # a byte of a file's name, as given by the system
        return bytes([ord(character) - 0xDC00]), following
    for plain in (_PLAIN.get(character, ""), _decomposed(character), _letter(character)):
        if plain:
            return plain, following
    return "?", following


def _decomposed(character: str) -> str:
    """Return the ASCII letters in a character: é as e, ₂ as 2."""
    return unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()


def _letter(character: str) -> str:
    """Return the name of a Greek letter."""
    name = unicodedata.name(character, "").split(" WITH ")[0]
    if not name.startswith(("GREEK SMALL LETTER ", "GREEK CAPITAL LETTER ")):
        return ""
    word = name.split()[-1].lower()
    return word if "SMALL" in name else word.capitalize()


codecs.register_error(_NAME, _in_plain_words)


def standard_streams() -> None:
    """Let standard output and standard error write all characters."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # the stream is closed
            encode_everything(stream)
