"""Dates, leap seconds, and files on different clocks."""

from __future__ import annotations

import pytest

from sinssim.errors import InputError
from sinssim.logs.gps_time import (
    WEEK,
    FileClock,
    Instant,
    date_of,
    file_clock,
    gps_instant,
    leap_seconds_of_day,
    offset,
)
from sinssim.logs.recorded_streams import Clock

MACHINE, GPS = Clock("machine"), Clock("gps")


@pytest.mark.parametrize(
    ("text", "week", "second"),
    [
        ("1980-01-06 00:00:00", 0, 0),
        ("1999-08-22 00:00:00", 1024, 0),  # the first rollover of ten bits (IS-GPS-200)
        ("2019-04-07 00:00:00", 2048, 0),  # the second one
        ("2022-03-06 00:00:01", 2200, 1),
    ],
)
def test_weeks_begin_where_they_are_published_to_begin(text: str, week: int, second: int) -> None:
    assert gps_instant(text) == Instant(week * WEEK + second, 0.0)


def test_utc_is_behind_by_the_published_leap_seconds() -> None:
    days = ("1980-01-06", "1999-01-01", "2016-12-31", "2017-01-01", "2025-07-08")
    assert [leap_seconds_of_day(day) for day in days] == [
        0, 13, 17, 18, 18,
    ]  # fmt: skip
    utc, gps = gps_instant("2025-07-08 19:34:03.723", "utc"), gps_instant("2025-07-08T19:34:21.723")
    assert (utc.seconds, utc.fraction) == (gps.seconds, gps.fraction)
    assert date_of(utc) == "2025-07-08 19:34:21.723 GPST"


def test_a_machine_s_clock_with_the_instant_of_its_first_row() -> None:
    own = file_clock(MACHINE, 261.906, gps_instant("2025-07-08 19:34:21.723"))
    other = file_clock(Clock("gps", gps_instant("2025-07-08 19:34:18").seconds), 0.499, None)
    # a fix 4 s after 19:34:18 comes 0.277 s after the first row
    assert 4.0 + offset(own, other, "log.gnss", 0.499) - 261.906 == pytest.approx(0.277, abs=1e-6)


def test_seconds_of_the_week_take_the_week_of_the_other_clock() -> None:
    own = FileClock(Clock("gps", 2374 * WEEK), Instant(2374 * WEEK, 0.0))
    assert offset(own, FileClock(GPS, None), "log.gnss", 5000.0) == 0.0
    own = FileClock(Clock("gps"), Instant(2374 * WEEK + 100, 0.25))
    assert 200.0 + offset(own, FileClock(GPS, None), "log.gnss", 200.0) == pytest.approx(99.75)
    assert offset(FileClock(GPS, None), FileClock(GPS, Instant(2374 * WEEK + 7, 0.5)), "log.gnss", 0.0) == 7.5


def test_two_clocks_without_date_are_the_same_and_one_alone_is_refused() -> None:
    assert offset(FileClock(MACHINE, None), FileClock(MACHINE, None), "log.gnss", 0.0) == 0.0
    dated = FileClock(GPS, Instant(1, 0.0))
    with pytest.raises(InputError, match=r"log\.imu has no date .* give the instant of its first row, log\.imu\.first"):
        offset(FileClock(MACHINE, None), dated, "log.gnss", 0.0)
    with pytest.raises(InputError, match=r"log\.gnss has no date"):
        offset(dated, FileClock(MACHINE, None), "log.gnss", 0.0)


def test_what_is_no_date_is_refused() -> None:
    with pytest.raises(InputError, match="is not a date with a time of day"):
        gps_instant("2025-13-08 19:34:21")
