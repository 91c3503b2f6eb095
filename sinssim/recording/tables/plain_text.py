"""Tables as plain text, for a recording or a file."""

from __future__ import annotations

import io
from collections.abc import Callable

from rich.console import Console

_WIDTH = 120


def plain_text(show: Callable[[Console], None]) -> str:
    """Return the text that a table prints.

    Returns:
        Lines of at most 120 characters.
    """
    text = io.StringIO()
    show(Console(file=text, width=_WIDTH, highlight=False))
    return text.getvalue()
