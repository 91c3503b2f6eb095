"""Heights on the way to a waypoint, worked out by hand from slopes and parabolas."""

from __future__ import annotations

import math
from dataclasses import astuple

import pytest

from sinssim.truth.flight.legs.waypoint import HeightPath, at_a_slope, length_at_a_slope, passing_slope, single_slope


@pytest.mark.parametrize(
    ("left", "height", "slope"),
    [
        (1300.0, 500.0, 0.0),  # before it begins
        (1150.0, 502.25, 0.07),  # 50 m into the first parabola, which is 80 m long
        (1120.0, 504.8, 0.1),
        (800.0, 536.8, 0.1),  # 320 m of straight slope
        (260.0, 587.6, 0.02),  # 80 m into the second parabola, which is 140 m long
        (200.0, 587.0, -0.04),
        (100.0, 583.0, -0.04),  # beyond the end
    ],
)
def test_height_and_slope_along_a_path(left: float, height: float, slope: float) -> None:
    path = HeightPath(1200.0, 200.0, 500.0, 0.1, 0.02, -0.04, 0.001)
    assert path.at(left) == pytest.approx((height, slope), abs=1e-12)


def test_a_path_of_one_slope_solves_its_quadratic() -> None:
    """50 m on 5 km at 100 m/s: m L − m²/κ = 50 with κ = 0.3/100²; 200 m are more than κL²/4 = 187.5 m."""
    path = single_slope(1000.0, 1050.0, 5000.0, 100.0)
    assert path is not None
    slope = 0.5 * 3e-5 * (5000.0 - math.sqrt(5000.0**2 - 4.0 * 50.0 / 3e-5))
    assert (path.begin, path.end, path.height, path.slope_before, path.slope_after) == (5000.0, 0.0, 1000.0, 0.0, 0.0)
    assert (path.slope, path.curvature) == pytest.approx((slope, 3e-5), rel=1e-12)
    down = single_slope(1000.0, 950.0, 5000.0, 100.0)
    assert down is not None
    assert down.slope == pytest.approx(-slope, rel=1e-12)
    for rise, acceleration in ((187.0, 0.3), (200.0, 0.6), (380.0, 1.2), (760.0, 2.4), (1490.0, 2.4)):
        steep = single_slope(1000.0, 1000.0 + rise, 5000.0, 100.0)
        assert steep is not None
        assert steep.curvature == pytest.approx(acceleration / 1e4)
        assert steep.at(0.0) == pytest.approx((1000.0 + rise, 0.0), abs=1e-9)
    assert single_slope(1000.0, 2510.0, 5000.0, 100.0) is None
    assert single_slope(1000.0, 1000.0, 0.0, 100.0) is None


@pytest.mark.parametrize(("before", "after"), [(0.01, -0.02), (-0.03, 0.0), (0.0, 0.02), (0.02, 0.05)])
def test_a_path_meets_height_and_slope_at_both_ends(before: float, after: float) -> None:
    path = single_slope(800.0, 870.0, 9000.0, 90.0, before, after)
    assert path is not None
    height, slope = path.at(9000.0 - 1e-6)
    assert (height, slope) == pytest.approx((800.0, before), abs=1e-6)
    assert path.at(0.0) == pytest.approx((870.0, after), abs=1e-9)
    assert path.curvature == pytest.approx(0.3 / 8100.0)


def test_a_climb_begins_here_and_a_descent_ends_at_the_waypoint() -> None:
    """The way is |Δh|/m + m/κ: 8000 and 6000 m of slope, and 1666.7 m of parabolas, at 100 m/s."""
    climb, descent = (at_a_slope(1000.0, target, 20_000.0, 100.0, 0.05) for target in (1400.0, 700.0))
    assert climb is not None
    assert descent is not None
    assert astuple(climb) == pytest.approx((2e4, 2e4 - 29_000.0 / 3.0, 1000.0, 0.05, 0.0, 0.0, 3e-5))
    assert astuple(descent) == pytest.approx((23_000.0 / 3.0, 0.0, 1000.0, -0.05, 0.0, 0.0, 3e-5))
    assert length_at_a_slope(1000.0, 700.0, 100.0, 0.05) == pytest.approx(23_000.0 / 3.0)
    assert at_a_slope(1000.0, 700.0, 7660.0, 100.0, 0.05) is None
    assert at_a_slope(1000.0, 700.0, 7670.0, 100.0, 0.05) is not None
    small = at_a_slope(1000.0, 990.0, 2000.0, 100.0, 0.05)  # the parabolas meet at √(10 κ)
    assert small is not None
    assert (small.slope, small.begin) == pytest.approx((-math.sqrt(3e-4), 2.0 * math.sqrt(10.0 / 3e-5)))
    level = at_a_slope(1000.0, 1000.0, 500.0, 100.0, 0.05)
    assert level is not None
    assert astuple(level) == pytest.approx((500.0, 500.0, 1000.0, 0.0, 0.0, 0.0, 3e-5))


@pytest.mark.parametrize(
    ("before", "after", "slope"),
    [(0.03, 0.05, 0.03), (0.05, 0.03, 0.03), (-0.05, -0.02, -0.02), (0.03, -0.02, 0.0), (-0.03, 0.02, 0.0),
     (0.0, 0.1, 0.0)],
)  # fmt: skip
def test_the_flatter_slope_at_a_waypoint(before: float, after: float, slope: float) -> None:
    assert passing_slope(before, after) == slope
