"""The height of a flight over the way to a waypoint: a straight slope with rounded ends.

The slope begins and ends on parabolas, along which the vertical speed changes uniformly, so that the aircraft is at the
waypoint's height, with the slope it is to have there, when it reaches the waypoint.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

VERTICAL_ACCELERATION = 0.3
"""Vertical acceleration of the rounded ends, 0.03 g, which passengers hardly notice [m/s²]."""
_ACCELERATIONS = (VERTICAL_ACCELERATION, 0.6, 1.2, 2.4)
"""What is tried in turn where the way is too short for a gentle change [m/s²]."""


@dataclass(frozen=True)
class HeightPath:
    """Height over the distance that is left to a waypoint.

    Attributes:
        begin, end: distance left where the change of height begins and ends, m.
        height: at the beginning, m.
        slope: of the straight part, height over way, positive up.
        slope_before, slope_after: before the beginning and after the end.
        curvature: of the parabolas, 1/m.
    """

    begin: float
    end: float
    height: float
    slope: float
    slope_before: float
    slope_after: float
    curvature: float

    def at(self, left: float) -> tuple[float, float]:
        """Return height and slope at a distance.

        Args:
            left: distance left, m.

        Returns:
            Height, m, and slope; before the beginning the height is constant.
        """
        way, length = self.begin - left, self.begin - self.end
        if way <= 0.0:
            return self.height, 0.0
        first = abs(self.slope - self.slope_before) / self.curvature
        last = abs(self.slope - self.slope_after) / self.curvature
        s = min(way, first)
        bend = math.copysign(self.curvature, self.slope - self.slope_before)
        height, slope = self.height + (self.slope_before + 0.5 * bend * s) * s, self.slope_before + bend * s
        height += self.slope * max(0.0, min(way, length - last) - first)
        if way > first:
            slope = self.slope
        s = min(way, length) - (length - last)
        if s > 0.0:
            bend = math.copysign(self.curvature, self.slope_after - self.slope)
            height, slope = height + (self.slope + 0.5 * bend * s) * s, self.slope + bend * s
        if way > length:
            height, slope = height + self.slope_after * (way - length), self.slope_after
        return height, slope


def along_the_way(
    height: float, target: float, left: float, speed: float, slope_before: float = 0.0, slope_after: float = 0.0
) -> HeightPath | None:
    """Return a path of one slope from here to the waypoint.

    With the slopes m₀ before, m between and m₁ after, and the curvature κ, the parabolas are |m − m₀|/κ and |m − m₁|/κ
    long, and the path rises by mL − sgn(m − m₀)(m − m₀)²/2κ − sgn(m − m₁)(m − m₁)²/2κ over its length L. The rise grows
    with m until the parabolas meet.

    Args:
        height: here, m.
        target: at the waypoint, m.
        left: distance to the waypoint, m.
        speed: ground speed, m/s, with which the vertical acceleration gives the curvature.

    Returns:
        The path; None if the way is too short for the change of height.
    """
    for acceleration in _ACCELERATIONS if left > 0.0 else ():
        curvature = acceleration / speed**2

        def rise(slope: float, curvature: float = curvature) -> float:
            before, after = slope - slope_before, slope - slope_after
            return slope * left - 0.5 * (before * abs(before) + after * abs(after)) / curvature

        middle, reach = 0.5 * (slope_before + slope_after), 0.5 * curvature * left
        low, high = middle - reach, middle + reach
        if not rise(low) <= target - height <= rise(high):
            continue
        for _ in range(60):
            slope = 0.5 * (low + high)
            low, high = (slope, high) if rise(slope) < target - height else (low, slope)
        return HeightPath(left, 0.0, height, 0.5 * (low + high), slope_before, slope_after, curvature)
    return None


def at_a_slope(height: float, target: float, left: float, speed: float, slope: float) -> HeightPath | None:
    """Return a path of a given slope: a climb begins here, a descent so late that it ends at the waypoint.

    From level flight to level flight at a slope m the change of height takes the way |Δh/m| + |m|/κ.

    Args:
        height: here, m.
        target: at the waypoint, m.
        left: distance to the waypoint, m.
        speed: ground speed in the middle of the change, m/s.

    Returns:
        The path; None if the way is too short for the change of height at this slope.
    """
    curvature = VERTICAL_ACCELERATION / speed**2
    change = abs(target - height)
    slope = min(slope, math.sqrt(change * curvature))  # of a change so small that the parabolas meet
    length = change / slope + slope / curvature if change else 0.0
    if length > left:
        return None
    if target < height:
        return HeightPath(length, 0.0, height, -slope, 0.0, 0.0, curvature)
    return HeightPath(left, left - length, height, slope, 0.0, 0.0, curvature)


def length_at_a_slope(height: float, target: float, speed: float, slope: float) -> float:
    """Return the way of `at_a_slope`, m.

    Args:
        height, target: at the beginning and at the end, m.
        speed: ground speed in the middle of the change, m/s.

    Returns:
        Distance, m.
    """
    change = abs(target - height)
    return change / slope + slope * speed**2 / VERTICAL_ACCELERATION


def passing_slope(before: float, after: float) -> float:
    """Return the slope at a waypoint between two slopes: the flatter one, level if one goes up and the other down."""
    return math.copysign(min(abs(before), abs(after)), before) if before * after > 0.0 else 0.0
