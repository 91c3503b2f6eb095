"""Matches the clock of a solution to that of a run."""

from __future__ import annotations

from dataclasses import dataclass

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import DAY, WEEK, date_from_gps, leap_seconds
from sinssim.logs.streams import Clock


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

    Raises:
        InputError: the solution does not overlap the run.
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
        own = " to ".join(f"{date_from_gps(clock.origin_gps_s + t):%Y-%m-%dT%H:%M:%SZ}" for t in (first, last))
    else:
        own = f"{first:.3f} s to {last:.3f} s on a clock without a date"
    raise InputError(
        f"{name} does not overlap the run: it lasts from {own}; the run from {begin} to {end} (seconds {span[0]:g} to "
        f"{span[1]:g}). Give the date with which the run was exported (--start)."
    )
