"""The terminal: text for streams with limited encodings, the console for tables, JSON, and the name of this program."""

from __future__ import annotations

import codecs
import json
import shutil
import sys
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from sinssim.progress import as_lines

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.recording.result import Result


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


def has_bars(quiet: bool) -> bool:
    """Return whether progress is shown: on a terminal, or to a program that reads it, unless the command is quiet."""
    return not quiet and (sys.stderr.isatty() or as_lines())


def console(least_width: int = 0) -> Console:
    """Return the console that tables are printed on; on a terminal of less than `least_width`, lines wrap."""
    from rich.console import Console

    width = max(least_width, shutil.get_terminal_size().columns) if least_width else None
    return Console(highlight=False, width=width)


def print_json(value: object) -> None:
    """Print a result as JSON; characters that standard output cannot represent are escaped."""
    print(json.dumps(value, indent=2, ensure_ascii=not holds_everything(sys.stdout)))


def print_result(result: Result, *, as_json: bool, quiet: bool = False, least_width: int = 0) -> bool:
    """Print a result as JSON, or its tables and sentences; return whether these were printed."""
    if as_json:
        print_json(result.summary)
    elif not quiet:
        from sinssim.recording.console import show

        show(result.exhibits, console(least_width))
    return not (as_json or quiet)


def print_places(directory: Path, recording: bool = True) -> None:
    """Print where the report of a directory is, and how its recording is viewed."""
    print(f"Report: {directory / 'report.html'}    (in any browser)")
    if recording:
        print(f"View:   {program_name()} view {directory}    (--web: in a browser)")


def remarks(quiet: bool) -> Callable[[str], None]:
    """Return a function that prints a remark on standard error, unless the command is quiet."""
    return lambda text: None if quiet else print(text, file=sys.stderr)


def program_name() -> str:
    """Return the command for this program: its name if the shell finds it, otherwise the way it was called."""
    if shutil.which("sinssim"):
        return "sinssim"
    return sys.argv[0] if Path(sys.argv[0]).name == "sinssim" else f"{Path(sys.executable).name} -m sinssim"


def notes_of(error: BaseException) -> str:
    """Return the notes that were added to an error, about the recorded part of the run and its place, as one text."""
    return " ".join(getattr(error, "__notes__", ()))
