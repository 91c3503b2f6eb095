"""Dates and times of day in the columns of text files, as seconds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import EPOCH_UNIX, gps_from_unix
from sinssim.logs.streams import Clock

_DATE = re.compile(
    r"\"?(?:(\d{4})[-/](\d{1,2})[-/](\d{1,2})[ T])?(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d+))? ?(Z|UTC|[+-]\d\d:?\d\d)?\"?"
)
_EPOCH = datetime(1980, 1, 6)
_DAY = 86_400


def is_date(text: str) -> bool:
    """Return whether a field is a date with a time of day, or a time of day: 2025-07-08 19:34:21.72, 19:34:21.72."""
    return _DATE.fullmatch(text.strip()) is not None


def date_seconds(texts: Sequence[str | None]) -> tuple[Array, Clock | None]:
    """Return the seconds of dates, or of times of day.

    Times of day go on after midnight. Offsets of time zones are taken off.

    Args:
        texts: fields of a column, (N,).

    Returns:
        Seconds since the whole second of the first one, (N,), NaN for a field that is no date; and the clock that the
        dates give, of the kind "machine" if they do not say that they are in UTC; None for times of day, which then
        count from midnight.

    Raises:
        InputError: there is no such day.
    """
    seconds, parts = np.full(len(texts), np.nan), np.zeros(len(texts))
    days: dict[tuple[str, str, str], int] = {}
    zoned = dated = False
    for k, text in enumerate(texts):
        found = None if text is None else _DATE.fullmatch(text.strip())
        if found is None:
            continue
        year, month, day, hour, minute, second, part, zone = found.groups()
        at = 3600 * int(hour) + 60 * int(minute) + int(second)
        if year is not None:
            dated = True
            key = (year, month, day)
            if key not in days:
                days[key] = _days(*key)
            at += _DAY * days[key]
        if zone is not None:
            zoned = True
            if zone[0] in "+-":
                at -= int(zone[0] + "1") * (3600 * int(zone[1:3]) + 60 * int(zone[-2:]))
        seconds[k] = at
        parts[k] = 0.0 if part is None else float(f"0.{part}")
    known = np.isfinite(seconds)
    if not known.any():
        return seconds, None
    if not dated:  # a time of day that falls by more than half a day is that of the next day
        steps = np.diff(seconds[known])
        seconds[known] += _DAY * np.concatenate([[0.0], np.cumsum(steps < -0.5 * _DAY)])
        return seconds + parts, None
    first = int(seconds[known][0])
    clock = Clock("machine", first, "dates without a time scale")
    if zoned:
        clock = Clock("utc", int(gps_from_unix(first + EPOCH_UNIX)), "dates in UTC")
    return (seconds - first) + parts, clock


def _days(year: str, month: str, day: str) -> int:
    try:
        return (datetime(int(year), int(month), int(day)) - _EPOCH).days
    except ValueError as error:
        raise InputError(f'"{year}-{month}-{day}" is not a date: {error}.') from error
