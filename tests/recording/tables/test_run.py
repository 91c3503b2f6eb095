"""The table of a run's errors."""

from __future__ import annotations

import pytest

from sinssim.recording.tables.run import error_text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1852.0, "1852"),
        (123456.7, "123457"),
        (0.0123456, "0.01235"),
        (1.23456, "1.235"),
        (-12.3456, "-12.35"),
        (1.24e-7, "1.2e-07"),
        (float("inf"), "inf"),
    ],
)
def test_numbers(value: float, text: str) -> None:
    assert error_text(value) == text
