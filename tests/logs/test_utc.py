"""GPS time against published pairs."""

from __future__ import annotations

import pytest

from sinssim.errors import InputError
from sinssim.logs.gps_time import gps_seconds

WEEK = 604_800


@pytest.mark.parametrize(
    ("text", "week", "seconds"),
    [
        ("1980-01-06T00:00:00Z", 0, 0.0),
        ("1999-08-21T23:59:47Z", 1024, 0.0),  # the first rollover, 13 s before midnight UTC
        ("2019-04-06T23:59:42Z", 2048, 0.0),  # the second, 18 s
        ("2016-12-31T23:59:60Z", 1930, 17.0),  # the leap second itself: week 1930 began 17 s before
        ("2017-01-01T00:00:00Z", 1930, 18.0),
        ("2024-05-01T14:00:00.25+02:00", 2312, 302_418.25),  # a Wednesday
        ("2024-05-01 12:00:00,25", 2312, 302_418.25),
        ("2024-05-01T08:30:00-0330", 2312, 302_418.0),
        ("2024-05-01T12:00Z", 2312, 302_418.0),
    ],
)
def test_pairs(text: str, week: int, seconds: float) -> None:
    found, zoned = gps_seconds(text)
    assert found == pytest.approx(week * WEEK + seconds, abs=1e-6)
    assert zoned == ("Z" in text or text[-5] in "+-" or text[-6] in "+-")


@pytest.mark.parametrize("text", ["", "yesterday", "2024-13-01T00:00:00Z", "2024-05-01T25:00:00Z", "12:00:00"])
def test_refusals(text: str) -> None:
    with pytest.raises(InputError, match="is not a time"):
        gps_seconds(text)
