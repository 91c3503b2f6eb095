"""The timetable of a route with unlike legs, worked out by hand: changes of speed, corners, stops."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.truth.planned_route import Timetable


def route(stops: list[float], speeds: list[float], passed: list[float]) -> Any:
    return SimpleNamespace(
        waypoints=[SimpleNamespace(stop_s=stop) for stop in stops],
        speeds=np.array(speeds), passed=np.array(passed), named=lambda number: f"place {number}",
    )  # fmt: skip


def test_three_legs_with_stops_at_both_ends() -> None:
    """At 2 m/s² a change by Δv takes 35/16 Δv/2: 10 m/s take 10.9375 s. At a corner the lower of both speeds holds."""
    table = Timetable(route([7.0, 0.0, 0.0, 5.0], [10.0, 20.0, 15.0, 99.0], [0.0, 1000.0, 3000.0, 4500.0]), 2.0)
    rise, slow, halt = 10.9375, 5.46875, 16.40625
    first = 7.0 + rise + (1000.0 - 5.0 * rise) / 10.0
    second = first + rise + (2000.0 - 15.0 * rise - 17.5 * slow) / 20.0 + slow
    third = second + (1500.0 - 7.5 * halt) / 15.0 + halt
    assert table.passings == pytest.approx([0.0, first, second, third], rel=1e-14)
    assert table.duration == pytest.approx(third + 5.0, rel=1e-14)
    assert set(table.stops) == {0, 3}
    assert table.stops[0] == (0.0, 7.0)
    assert table.stops[3] == pytest.approx((third, third + 5.0))
    # the integral of the smooth step to its middle is 7/32 − 14/64 + 10/128 − 2.5/256 = 0.068359375
    at = {
        3.0: 0.0, 7.0 + 0.5 * rise: 10.0 * rise * 0.068359375, 50.0: 5.0 * rise + 10.0 * (43.0 - rise), first: 1000.0,
        first + 0.5 * rise: 1000.0 + 5.0 * rise + 10.0 * rise * 0.068359375, second: 3000.0,
        second - 0.5 * slow: 3000.0 - 17.5 * slow + 10.0 * slow - 5.0 * slow * 0.068359375,
        second + 4.0: 3060.0, third: 4500.0, third + 2.0: 4500.0,
    }  # fmt: skip
    assert table.distances(np.array(list(at))) == pytest.approx(list(at.values()), rel=1e-12, abs=1e-12)


def test_a_start_and_an_end_without_a_stop_have_the_speed_of_their_leg() -> None:
    table = Timetable(route([0.0, 3.0, 0.0], [8.0, 12.0, 99.0], [0.0, 400.0, 1000.0]), 0.5)
    halt, start = 35.0 / 16.0 * 8.0 / 0.5, 35.0 / 16.0 * 12.0 / 0.5
    first = (400.0 - 4.0 * halt) / 8.0 + halt
    last = first + 3.0 + start + (600.0 - 6.0 * start) / 12.0
    assert table.passings == pytest.approx([0.0, first, last], rel=1e-14)
    assert table.duration == pytest.approx(last, rel=1e-14)
    assert table.stops == {1: pytest.approx((first, first + 3.0))}
    assert table.distances(np.array([0.0, 10.0, first + 1.0])) == pytest.approx([0.0, 80.0, 400.0])


def test_a_leg_that_is_too_short() -> None:
    """From rest to 10 m/s and to 4 m/s: 54.6875 m and 45.9375 m."""
    with pytest.raises(InputError) as error:
        Timetable(route([1.0, 0.0, 0.0], [10.0, 4.0, 4.0], [0.0, 100.0, 900.0]), 2.0)
    assert str(error.value) == (
        "the leg from place 0 to place 1 has 100 m, but its changes of speed, from 0 to 10 and to 4 m/s, need 100.62 m "
        "at 2 m/s²: give a lower speed_mps, or a larger track.acceleration_mps2."
    )
