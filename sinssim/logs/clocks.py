"""Clocks of recorded files and of solutions of other programs, and their offset from the clock of the run."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import DAY, LEAP_SECONDS, WEEK, date_from_gps, leap_seconds
from sinssim.logs.recorded_streams import Clock

_ORIGIN = datetime(1980, 1, 6)


@dataclass(frozen=True)
class Instant:
    """An instant of GPS time, with whole seconds apart so that no digit is lost.

    Attributes:
        seconds: whole seconds since 1980-01-06 00:00:00 GPST.
        fraction: 0 ≤ fraction < 1, s.
    """

    seconds: int
    fraction: float


def gps_instant(text: str, scale: Literal["gps", "utc", "unix"] = "gps") -> Instant:
    """Return the instant of a date and time of day: the instant.

    Args:
        text: "2025-07-08 19:34:21.723".
        scale: "gps", or else UTC, whose leap seconds are then added.
    """
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
    """Return by how much GPS time is ahead of UTC on a day: whole seconds.

    Args:
        day: "2025-07-08".
    """
    return sum(day >= leap for leap in LEAP_SECONDS)


@dataclass(frozen=True)
class FileClock:
    """The clock of one file.

    Attributes:
        clock: of the file.
        zero: GPS time of the file's time 0, if known: whole seconds and a fraction of either sign.
    """

    clock: Clock
    zero: Instant | None


def file_clock(clock: Clock, first: float, first_row: Instant | None) -> FileClock:
    """Return the clock of a file: the clock; the description counts more than the file.

    Args:
        first: its first time, s.
        first_row: instant of its first row, if the description gives it.
    """
    if first_row is not None:
        return FileClock(clock, Instant(first_row.seconds, first_row.fraction - first))
    zero = None if clock.origin_gps_s is None else Instant(clock.origin_gps_s, 0.0)
    return FileClock(clock, zero)


def offset(clock: FileClock, other: FileClock, name: str, first: float) -> float:
    """Return what is added to the times of another file so that they are on the clock of one's own: the offset, s.

    Args:
        name: what the other file is, for the message: "log.gnss".
        first: first time of the other file, s.
    """
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
    from datetime import timedelta

    at = _ORIGIN + timedelta(seconds=zero.seconds, milliseconds=round(1e3 * zero.fraction))
    return f"{at:%Y-%m-%d %H:%M:%S}.{at.microsecond // 1000:03d} GPST"


@dataclass(frozen=True)
class Match:
    """How a solution's clock becomes that of the run.

    Attributes:
        offset: to be added to the solution's times, s.
        sentence: what was assumed.
    """

    offset: float
    sentence: str


def match_clock(clock: Clock, time: Array, start_gps_s: float, span: tuple[float, float], name: str) -> Match:
    """Find the offset of a solution's clock.

    A clock with a date is used as it is. Seconds without a date may be those of the run, of the GPS week, of the day in
    GPS time, or of the day in UTC; the first of these under which the solution overlaps the run is taken.

    Args:
        time: of the solution, (M,) s.
        start_gps_s: GPS time of the run's time 0.
        span: first and last time of the run, s.
    """
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
