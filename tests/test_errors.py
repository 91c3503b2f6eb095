"""Messages: what a file brings into them can be printed."""

from __future__ import annotations

import pytest

from sinssim.errors import InputError, RunError, printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("altitude_ft: é°µσ\n  - second", "altitude_ft: é°µσ\n  - second"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("a\x00b\r\t", "a\\x00b\\r\\t"),
        ("\u202eback\u200b", "\\u202eback\\u200b"),
        ("file-\udc80", "file-\\udc80"),
        ("5\u00a0m", "5\u00a0m"),
    ],
)
def test_what_a_terminal_does_not_show_is_written_out(text: str, shown: str) -> None:
    assert str(InputError(text)) == str(RunError(text, time=1.0)) == printable(text) == shown
    assert InputError(text).args == (shown,)
