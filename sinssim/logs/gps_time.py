"""GPS time, UTC and Unix time: leap seconds, weeks and dates; clocks of recorded files and their offset from the run's.

GPS time counts seconds since 1980-01-06 00:00:00 UTC without leap seconds. UTC has had the leap seconds of the table
since then (IERS Bulletin C; the last one was inserted at the end of 2016). Unix time counts the seconds of UTC without
leap seconds since 1970-01-01.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.recorded_streams import Clock

WEEK = 604800
"""Seconds of a week."""
DAY = 86400
"""Seconds of a day."""
EPOCH = datetime(1980, 1, 6, tzinfo=UTC)
"""Beginning of GPS time."""
EPOCH_UNIX = 315964800
"""Unix time of the beginning of GPS time, s."""

LEAP_SECONDS: tuple[str, ...] = (
    "1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01", "1988-01-01", "1990-01-01", "1991-01-01", "1992-07-01",
    "1993-07-01", "1994-07-01", "1996-01-01", "1997-07-01", "1999-01-01", "2006-01-01", "2009-01-01", "2012-07-01",
    "2015-07-01", "2017-01-01",
)  # fmt: skip
"""Days at whose beginning, UTC, GPS time minus UTC grew by one second (IERS Bulletin C, numbers 1 to 72)."""

_STEPS_UNIX = np.array([datetime.fromisoformat(f"{day}T00:00:00+00:00").timestamp() for day in LEAP_SECONDS])
_STEPS_GPS = _STEPS_UNIX - EPOCH_UNIX + np.arange(1, len(LEAP_SECONDS) + 1)


def leap_seconds(unix: float | Array) -> Array:
    """Return GPS time minus UTC: whole seconds, of the same shape; 0 before 1981, 18 since 2017. `unix`: Unix times, ()
    or (N,) s."""
    return np.asarray(np.searchsorted(_STEPS_UNIX, unix, side="right"), dtype=np.float64)


def check_weeks(path: Path, week: Array) -> None:
    """Refuse numbers that are no GPS weeks, (N,); 0 may stand for an unknown one."""
    bad = ~((week == np.floor(week)) & (week >= 0.0) & (week <= 1e4))
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(f"{path}, row {row + 1}: {week[row]:g} is not a GPS week; that column has the week, or 0.")


def gps_from_unix(unix: float | Array) -> Array:
    """Return GPS time: seconds since 1980-01-06 00:00:00 GPST, of the same shape. `unix`: Unix times, () or (N,) s."""
    return np.asarray(unix, dtype=np.float64) - EPOCH_UNIX + leap_seconds(unix)


def unix_from_gps(gps: float | Array) -> Array:
    """Return Unix time, s, of GPS seconds since 1980-01-06 00:00:00 GPST, () or (N,); within a leap second, the second
    after it."""
    gps = np.asarray(gps, dtype=np.float64)
    return gps + EPOCH_UNIX - np.searchsorted(_STEPS_GPS, gps, side="right")


def gps_from_date(date: datetime) -> int:
    """Return GPS time of a date in UTC: whole seconds since 1980-01-06 00:00:00 GPST. `date`: with a time zone, of
    whole seconds."""
    unix = round((date - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds())
    return unix - EPOCH_UNIX + int(leap_seconds(unix))


def date_from_gps(gps: float) -> datetime:
    """Return the date in UTC: the date, to a microsecond. `gps`: seconds since 1980-01-06 00:00:00 GPST."""
    return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=float(unix_from_gps(gps)))


def parse_date(text: str, key: str) -> int:
    """Return GPS time of a date given as text, as "2026-01-01T00:00:00Z", which is UTC without a time zone: whole
    seconds since 1980-01-06 00:00:00 GPST. The message names the option or key."""
    given = text.strip()
    try:
        date = datetime.fromisoformat(re.sub(r"[zZ]$", "+00:00", given))
    except ValueError as error:
        raise InputError(
            f"{key}: {shortened(repr(text))} is not a date; give one such as 2026-01-01T00:00:00Z (UTC)."
        ) from error
    if date.tzinfo is None:
        date = date.replace(tzinfo=UTC)
    if date.microsecond:
        raise InputError(f"{key}: {text} has a fraction of a second; give whole seconds.")
    if not EPOCH <= date < datetime(2200, 1, 1, tzinfo=UTC):
        raise InputError(f"{key}: {text} is not within 1980-01-06 and 2200, the years of GPS time.")
    return gps_from_date(date)


def week_and_seconds(gps: float) -> tuple[int, float]:
    """Return the GPS week of seconds since 1980-01-06 00:00:00 GPST, counted without overflow since 1980, and the
    seconds of the week: whole if `gps` is, otherwise to the microsecond."""
    week = int(gps // WEEK)
    seconds = gps - week * WEEK
    return week, seconds if isinstance(gps, int) else round(seconds, 6)


def unrolled(seconds: Array, period: float) -> Array:
    """Return times, (N,) s, that count on where a counter begins again, at the end of a week or of a day: with
    multiples of its period, s, added after each fall by more than half a period."""
    if len(seconds) < 2:
        return seconds
    falls = np.diff(seconds) < -0.5 * period
    if not falls.any():
        return seconds
    return seconds + period * np.concatenate(([0.0], np.cumsum(falls)))


_ISO = re.compile(
    r"(\d{4})-(\d\d)-(\d\d)[T ](\d\d):(\d\d)(?::(\d\d)([.,]\d+)?)?\s*(Z|z|[+-]\d\d(?::?\d\d)?)?", re.ASCII
)


def gps_seconds(text: str) -> tuple[float, bool]:
    """Return the GPS time of a time as ISO 8601 writes it, "2024-05-01T12:00:00.5Z", "2024-05-01 14:00:00+02:00", which
    is UTC without a zone: seconds since 1980-01-06 00:00:00 GPST, and whether the text has a zone."""
    parts = _ISO.fullmatch(text.strip())
    if parts is None:
        raise InputError(f"{shortened(text)!r} is not a time; 2024-05-01T12:00:00Z would be one.")
    year, month, day, hour, minute, second = (int(part or 0) for part in parts.groups()[:6])
    fraction, zone = float((parts[7] or "0").replace(",", ".")), parts[8]
    extra, second = (1, 59) if second == 60 else (0, second)  # a leap second
    try:
        moment = datetime(year, month, day, hour, minute, second, tzinfo=UTC)
    except ValueError as error:
        raise InputError(f"{shortened(text)!r} is not a time: {error}.") from error
    unix = moment.timestamp()
    if zone and zone not in "Zz":
        digits = zone[1:].replace(":", "").ljust(4, "0")
        unix -= (-1.0 if zone[0] == "-" else 1.0) * (3600 * int(digits[:2]) + 60 * int(digits[2:]))
    return float(gps_from_unix(unix)) + extra + fraction, zone is not None


_DATE = re.compile(
    r"\"?(?:(\d{4})[-/](\d{1,2})[-/](\d{1,2})[ T])?(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d+))? ?(Z|UTC|[+-]\d\d:?\d\d)?\"?"
)
_ORIGIN = datetime(1980, 1, 6)


def is_date(text: str) -> bool:
    """Return whether a field is a date with a time of day, or a time of day: 2025-07-08 19:34:21.72, 19:34:21.72."""
    return _DATE.fullmatch(text.strip()) is not None


def date_seconds(texts: Sequence[str | None]) -> tuple[Array, Clock | None]:
    """Return the seconds of dates, or of times of day, since the whole second of the first one, (N,), NaN for a field
    that is no date; and the clock that the dates give, of the kind "machine" if they do not say that they are in UTC.
    For times of day, which go on after midnight, it is None, and they count from midnight. Offsets of time zones are
    taken off."""
    seconds, parts = np.full(len(texts), np.nan), np.zeros(len(texts))
    days: dict[tuple[str, str, str], int] = {}
    zoned = dated = False
    for k, text in enumerate(texts):
        match = None if text is None else _DATE.fullmatch(text.strip())
        if match is None:
            continue
        year, month, day, hour, minute, second, part, zone = match.groups()
        at = 3600 * int(hour) + 60 * int(minute) + int(second)
        if year is not None:
            dated = True
            key = (year, month, day)
            if key not in days:
                days[key] = _days(*key)
            at += DAY * days[key]
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
        seconds[known] += DAY * np.concatenate([[0.0], np.cumsum(steps < -0.5 * DAY)])
        return seconds + parts, None
    first = int(seconds[known][0])
    clock = Clock("machine", first, "dates without a time scale")
    if zoned:
        clock = Clock("utc", int(gps_from_unix(first + EPOCH_UNIX)), "dates in UTC")
    return (seconds - first) + parts, clock


def _days(year: str, month: str, day: str) -> int:
    try:
        return (datetime(int(year), int(month), int(day)) - _ORIGIN).days
    except ValueError as error:
        raise InputError(f'"{year}-{month}-{day}" is not a date: {error}.') from error


@dataclass(frozen=True)
class Instant:
    """An instant of GPS time, with whole seconds apart so that no digit is lost."""

    seconds: int  # whole seconds since 1980-01-06 00:00:00 GPST
    fraction: float  # 0 ≤ fraction < 1, s


def gps_instant(text: str, scale: Literal["gps", "utc", "unix"] = "gps") -> Instant:
    """Return the instant of a date and time of day: the instant. `text`: "2025-07-08 19:34:21.723"; `scale`: "gps", or
    else UTC, whose leap seconds are then added."""
    date, _, fraction = text.replace("T", " ").partition(".")
    try:
        whole = datetime.fromisoformat(date)
    except ValueError as error:
        raise InputError(f'"{text}" is not a date with a time of day: {error}.') from error
    seconds = round((whole - _ORIGIN).total_seconds())
    if scale != "gps":
        seconds += leap_seconds_of_day(date[:10])
    return Instant(seconds, float(f"0.{fraction}") if fraction else 0.0)


def leap_seconds_of_day(day: str) -> int:
    """Return by how much GPS time is ahead of UTC on a day: whole seconds. `day`: "2025-07-08"."""
    return sum(day >= leap for leap in LEAP_SECONDS)


@dataclass(frozen=True)
class FileClock:
    """The clock of one file."""

    clock: Clock  # of the file
    zero: Instant | None  # GPS time of the file's time 0, if known: whole seconds and a fraction of either sign


def file_clock(clock: Clock, first: float, first_row: Instant | None) -> FileClock:
    """Return the clock of a file: the clock; the description counts more than the file. `first`: its first time, s;
    `first_row`: instant of its first row, if the description gives it."""
    if first_row is not None:
        return FileClock(clock, Instant(first_row.seconds, first_row.fraction - first))
    zero = None if clock.origin_gps_s is None else Instant(clock.origin_gps_s, 0.0)
    return FileClock(clock, zero)


def offset(clock: FileClock, other: FileClock, name: str, first: float) -> float:
    """Return what is added to the times of another file so that they are on the clock of one's own: the offset, s.
    `name`: what the other file is, for the message: "log.gnss"; `first`: first time of the other file, s."""
    if clock.zero is not None and other.zero is not None:
        return other.zero.seconds - clock.zero.seconds + (other.zero.fraction - clock.zero.fraction)
    if clock.zero is None and other.zero is None:
        return 0.0  # both count from the same unknown instant
    without, key = ("log.imu", clock) if clock.zero is None else (name, other)
    if key.clock.kind == "gps":  # seconds of the week: the week is that of the other clock
        known = other.zero if clock.zero is None else clock.zero
        assert known is not None
        if clock.zero is None:
            return float(known.seconds % WEEK) + known.fraction
        weeks = round((known.seconds + known.fraction - first) / WEEK)
        return float(weeks * WEEK - known.seconds) - known.fraction
    raise InputError(
        f"{without} has no date ({key.clock.note or 'its times count from an unknown instant'}), but the other file "
        f'has one: give the instant of its first row, {without}.first_row = "2025-07-08 19:34:21.723".'
    )


def date_of(zero: Instant) -> str:
    """Return an instant as text, for example "2025-07-08 19:34:21.723 GPST"."""
    at = _ORIGIN + timedelta(seconds=zero.seconds, milliseconds=round(1e3 * zero.fraction))
    return f"{at:%Y-%m-%d %H:%M:%S}.{at.microsecond // 1000:03d} GPST"


@dataclass(frozen=True)
class Match:
    """How a solution's clock becomes that of the run."""

    offset: float  # to be added to the solution's times, s
    sentence: str  # what was assumed


def match_clock(clock: Clock, time: Array, start_gps_s: float, span: tuple[float, float], name: str) -> Match:
    """Find the offset of the clock of a solution, of times (M,) s, to a run from a first to a last time, s, whose time
    0 is a GPS time. A clock with a date is used as it is. Seconds without a date may be those of the run, of the GPS
    week, of the day in GPS time, or of the day in UTC; the first of these under which the solution overlaps the run is
    taken."""
    if clock.origin_gps_s is not None:
        choices = [Match(clock.origin_gps_s - start_gps_s, f"Its clock: {clock.note or clock.kind}, with a date.")]
        if clock.kind == "utc":
            choices[0] = Match(choices[0].offset, f"Its clock: {clock.note}.")
    else:
        day_of_utc = start_gps_s - int(leap_seconds(float(start_gps_s) + 315964800.0))
        choices = [
            Match(0.0, "Its times are taken as those of the run."),
            Match(-float(start_gps_s % WEEK), "Its times are taken as seconds of the run's GPS week."),
            Match(-float(start_gps_s % DAY), "Its times are taken as seconds of the run's day, GPS time."),
            Match(-float(day_of_utc % DAY), "Its times are taken as seconds of the run's day, UTC."),
        ]
    first, last = float(time.min()), float(time.max())
    for choice in choices:
        if min(last + choice.offset, span[1]) > max(first + choice.offset, span[0]):
            return choice
    begin, end = (f"{date_from_gps(start_gps_s + t):%Y-%m-%dT%H:%M:%SZ}" for t in span)
    if clock.origin_gps_s is not None:
        utc = " to ".join(f"{date_from_gps(clock.origin_gps_s + t):%Y-%m-%dT%H:%M:%SZ}" for t in (first, last))
    else:
        utc = f"{first:.3f} s to {last:.3f} s on a clock without a date"
    raise InputError(
        f"{name} does not overlap the run: it lasts from {utc}; the run from {begin} to {end} (seconds {span[0]:g} to "
        f"{span[1]:g}). Give the date with which the run was exported (--start)."
    )
