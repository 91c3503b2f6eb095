"""Stamps that a double cannot hold: whole nanoseconds of Unix time, and decimal seconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import EPOCH_UNIX, gps_from_unix
from sinssim.logs.recorded_streams import Clock
from sinssim.logs.text.rows import WHITESPACE, cut_rows, text_rows

NS = 1_000_000_000


def clock_of(ns: NDArray[np.int64], note: str) -> tuple[Clock, Array]:
    """Return the clock and the times of Unix stamps.

    Args:
        ns: nanoseconds of Unix time, or since another start, (N,).
        note: what the file gives.

    Returns:
        The clock, with an origin if the stamps are dates since 1980, and times from its origin, (N,) s.
    """
    seconds, rest = np.divmod(ns, NS)
    if seconds[0] < EPOCH_UNIX:
        first = 0
        note = f"{note}, since an unknown start"
        origin = None
    else:
        first = int(seconds[0])
        origin = int(gps_from_unix(float(first)))
        note = f"{note}, taken as Unix time"
    return Clock("machine", origin, note), (seconds - first) + rest * 1e-9


def split_first(path: Path, delimiter: str = WHITESPACE, skip: int = 0) -> NDArray[np.int64]:
    """Return the first column as whole nanoseconds, without rounding.

    Args:
        path: a text file that `sinssim.logs.text.numeric_columns.read_numbers` accepts.
        delimiter: one character, or `WHITESPACE`.
        skip: lines at the beginning that are left out.

    Returns:
        (N,): decimal numbers are seconds, whole numbers of 16 digits or more nanoseconds.

    Raises:
        InputError: a stamp is no decimal number.
    """
    found: list[int] = []
    for number, fields in text_rows(path, delimiter, skip, cut_rows(path, delimiter, skip)):
        word = fields[0]
        whole, point, decimals = word.partition(".")
        try:
            if not point and len(whole.lstrip("+-0")) >= 16:
                found.append(int(whole))
            elif "e" in word.lower():
                found.append(round(float(word) * 1e9))
            else:
                part = int((decimals + "000000000")[:9]) if decimals.isdigit() or not decimals else None
                if part is None:
                    raise ValueError
                found.append(int(whole or "0") * NS + (-part if whole.startswith("-") else part))
        except (ValueError, OverflowError) as error:
            raise InputError(f"{path}, line {number}: {word[:40]!r} is not a stamp.") from error
        if not -(2**62) < found[-1] < 2**62:
            raise InputError(f"{path}, line {number}: the stamp {word[:40]} is out of range.")
    return np.array(found, dtype=np.int64)
