"""The points of a path for a map: at most so many, with dates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import cached_property

import numpy as np

from sinssim.data import Array
from sinssim.logs.gps_time import unix_from_gps
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG

MOST = 20_000
"""Most points of a map if no rate is given."""


@dataclass(frozen=True)
class Points:
    """Points of a path.

    Attributes:
        latitude, longitude: (N,) °, longitude within ±180°.
        height: above the ellipsoid, (N,) m.
        dates: UTC, (N,).
        total: number of samples of the stream.
    """

    latitude: Array
    longitude: Array
    height: Array
    dates: list[str]
    total: int

    @cached_property
    def sentence(self) -> str:
        """How many points are written."""
        if len(self.dates) == self.total:
            return f"{self.total} points."
        return f"{len(self.dates)} of {self.total} points; --rate sets how many a second."


def path_points(content: Content) -> Points:
    """Return the points of the chosen solution.

    Args:
        content: what is written; without a rate at most `MOST` points.

    Returns:
        The points.
    """
    stream = content.solution
    total = len(replace(content, rate_hz=None).solution)
    every = 1 if content.rate_hz is not None else max(1, -(-len(stream) // MOST))
    rows = np.unique(np.append(np.arange(0, len(stream), every), len(stream) - 1))
    longitude = (stream.longitude[rows] / DEG + 180.0) % 360.0 - 180.0
    return Points(stream.latitude[rows] / DEG, longitude, stream.height[rows], dates(content, stream.time[rows]), total)


def dates(content: Content, time: Array) -> list[str]:
    """Return the dates of times in UTC, to a millisecond.

    Args:
        content: with the date of time 0.
        time: the run's own time, (N,) s.

    Returns:
        For example "2026-01-01T00:00:00.010Z".
    """
    unix = unix_from_gps(content.start_gps_s + time)
    start = datetime(1970, 1, 1, tzinfo=UTC)
    ms = np.round(unix * 1e3).astype(np.int64)
    found = (start + timedelta(milliseconds=value) for value in ms.tolist())
    return [f"{date:%Y-%m-%dT%H:%M:%S}.{date.microsecond // 1000:03d}Z" for date in found]


HEIGHTS = (
    "Heights are above the ellipsoid WGS-84; maps take them as above mean sea level, which differs by up to 110 m "
    "(sinssim has no geoid model)."
)
