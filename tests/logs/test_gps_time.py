"""GPS time, UTC and leap seconds against published dates and the tables of the IERS."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs import gps_time
from sinssim.logs.gps_time import LEAP_SECONDS, date_from_gps, gps_from_date, gps_from_unix, parse_date, unix_from_gps


@pytest.mark.parametrize(
    ("date", "leap"),
    # IERS, Bulletin C 52 (18 s since 2017), and the steps before
    [("1980-01-06", 0), ("1981-07-01", 1), ("1990-01-01", 6), ("1999-01-01", 13), ("2006-01-01", 14),
     ("2008-12-31", 14), ("2009-01-01", 15), ("2015-07-01", 17), ("2016-12-31", 17), ("2017-01-01", 18)],
)  # fmt: skip
def test_gps_minus_utc(date: str, leap: int) -> None:
    at = datetime.fromisoformat(f"{date}T00:00:00+00:00")
    days = (at - datetime(1980, 1, 6, tzinfo=UTC)).days
    assert gps_from_date(at) == 86400 * days + leap


def test_published_week() -> None:
    """GPS week 2048 began on 2019-04-07, when the counter of ten bits began again (IS-GPS-200)."""
    assert gps_time.week_and_seconds(gps_from_date(datetime(2019, 4, 6, 23, 59, 42, tzinfo=UTC))) == (2048, 0)


def test_leap_seconds_are_those_of_the_iers() -> None:
    data = pytest.importorskip("astropy_iers_data")
    lines = Path(data.IERS_LEAP_SECOND_FILE).read_text().splitlines()
    rows = [line.split() for line in lines if line.strip() and not line.startswith("#")]
    steps = [(f"{year}-{int(month):02d}-{int(day):02d}", int(tai)) for _, day, month, year, tai in rows]
    assert tuple(day for day, tai in steps if tai > 19) == LEAP_SECONDS


def test_unix_and_back() -> None:
    unix = np.array([315964800.0, 1e9, 1483228799.0, 1483228800.0, 1.75e9])
    assert np.array_equal(unix_from_gps(gps_from_unix(unix)), unix)
    # the last second of 2016 is counted twice by Unix time: GPS time counts on
    assert gps_from_unix(1483228800.0) - gps_from_unix(1483228799.0) == 2.0
    assert date_from_gps(float(gps_from_unix(1.75e9))) == datetime.fromtimestamp(1.75e9, tz=UTC)


def test_counters_that_begin_again() -> None:
    time = np.array([604799.0, 604800.0 - 0.5, 0.0, 0.5, 1.0, 0.9])
    assert np.array_equal(
        gps_time.unrolled(time, gps_time.WEEK), np.array([604799.0, 604799.5, 604800.0, 604800.5, 604801.0, 604800.9])
    )


@pytest.mark.parametrize("text", ["yesterday", "2026-13-01", "1979-01-01", "2026-01-01T00:00:00.5Z", "", "9999-01-01"])
def test_bad_dates(text: str) -> None:
    with pytest.raises(InputError, match="--start"):
        parse_date(text, "--start")


def test_dates_with_and_without_a_zone() -> None:
    assert parse_date("2026-01-01", "x") == parse_date("2026-01-01T01:00:00+01:00", "x") == 1451260818
