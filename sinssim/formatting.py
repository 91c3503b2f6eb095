"""Numbers and sentences as a person reads them."""

from __future__ import annotations

import math


def number_text(value: float, digits: int = 3) -> str:
    """Write a number with a few significant digits.

    Args:
        value: the number.
        digits: how many.

    Returns:
        "0.0123", "1.2e-09", or "–" for what is not known.
    """
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if 1e-4 <= abs(value) < 1e6:
        places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:.{places}f}"
    return f"{value:.{digits - 1}e}"


def signed(value: float, digits: int = 3) -> str:
    """Write a number with a few significant digits and, if it is negative, a true minus sign.

    Args:
        value: the number.
        digits: how many.

    Returns:
        "−0.0123".
    """
    return ("−" if value < 0.0 else "") + number_text(abs(value), digits)


def capital(sentence: str) -> str:
    """Return a sentence that begins with a capital.

    Args:
        sentence: any words.

    Returns:
        The same words.
    """
    return sentence[:1].upper() + sentence[1:]
