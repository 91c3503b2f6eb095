"""Formats numbers and sentences for display."""

from __future__ import annotations

import math
from collections.abc import Iterable


def number_text(value: float | None, digits: int = 3) -> str:
    """Write a number with a few significant digits; return "0.0123", "1.2e-09", or "–" for an unknown number."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if 1e-4 <= abs(value) < 1e6:
        places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:.{places}f}"
    return f"{value:.{digits - 1}e}"


def signed(value: float, digits: int = 3) -> str:
    """Write a number with a few significant digits and, if it is negative, a true minus sign; return "−0.0123"."""
    return ("−" if value < 0.0 else "") + number_text(abs(value), digits)


def with_band(value: float, low: float, high: float, size: float = 1.0) -> str:
    """Write an estimate with the ends of its band, in a unit of a `size`: "0.712 (0.655 … 0.781)"; "∞" if infinite."""
    value_text, low_text, high_text = (
        "∞" if end == math.inf else number_text(float(end) / size) for end in (value, low, high)
    )
    return f"{value_text} ({low_text} … {high_text})"


def percent(share: float) -> str:
    """Write a share in whole percent: "88 %", "–" for an unknown one."""
    return "–" if math.isnan(share) else f"{100.0 * share:.0f} %"


def two_digits(number: int) -> int:
    """Return about how many: a number of two significant digits."""
    return round(number, min(2 - len(str(number)), 0))


def capital(sentence: str) -> str:
    """Return a sentence with a capital first letter."""
    return sentence[:1].upper() + sentence[1:]


def duration_text(seconds: float) -> str:
    """Return a duration in words of at most six letters: "40 s", "3 min" or "2.5 h"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def size_text(size: float) -> str:
    """Return a size with a suitable unit: for example "248 MB" (size in bytes)."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size >= factor:
            return f"{size / factor:.3g} {unit}"
    return f"{size:.0f} B"


def listed(names: Iterable[str], last_by: str = "and") -> str:
    """Return names as a list in a sentence: "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} {last_by} {last}" if first else last
