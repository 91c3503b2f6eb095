"""Dates and times of day in columns: seconds, clocks, midnight, zones."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.gps_time import date_seconds, is_date


def test_dates_in_utc_have_leap_seconds() -> None:
    time, clock = date_seconds(["2025-07-08T23:59:59.5Z", "2025-07-09T00:00:00.25Z", None])
    assert clock is not None
    np.testing.assert_allclose(time[:2], [0.5, 1.25])
    assert np.isnan(time[2])
    since = datetime(2025, 7, 8, 23, 59, 59, tzinfo=UTC) - datetime(1980, 1, 6, tzinfo=UTC)
    assert clock.kind == "utc"
    assert clock.origin_gps_s == since.total_seconds() + 18.0


def test_a_zone_is_taken_off() -> None:
    here, of_utc = date_seconds(["2025/07/08 12:00:00+02:00"])[1], date_seconds(["2025-07-08 10:00:00 UTC"])[1]
    assert here == of_utc


def test_dates_without_a_zone_do_not_tell_their_scale() -> None:
    clock = date_seconds(["2025-07-08 12:00:00"])[1]
    assert clock is not None
    assert clock.kind == "machine"
    since = datetime(2025, 7, 8, 12, tzinfo=UTC) - datetime(1980, 1, 6, tzinfo=UTC)
    assert clock.origin_gps_s == since.total_seconds()


def test_times_of_day_go_on_after_midnight() -> None:
    time, clock = date_seconds(["23:59:59.75", "00:00:00.25"])
    assert clock is None
    np.testing.assert_allclose(time, [86399.75, 86400.25])


def test_what_is_no_date() -> None:
    assert not is_date("12.5")
    assert not is_date("2025-07-08")
    with pytest.raises(InputError, match="is not a date"):
        date_seconds(["2025-02-30 00:00:00"])
