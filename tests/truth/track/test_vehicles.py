"""The assumptions about vehicles as the page of tracks has them, each by its name."""

from __future__ import annotations

import math

import pytest

from sinssim.truth.vehicle_attitude import VEHICLES, Vehicle


def test_assumptions_by_name() -> None:
    """Speeds of standstill and of jumps, limits of acceleration, turn and pitch, and what a planned route has."""
    expected = {
        "aircraft": Vehicle(
            name="aircraft", pitch="slope", banks=True, standstill=3.0, spot_turn=0.5, knots=0.1, most_speed=1500.0,
            odd_acceleration=100.0, odd_turn=4.0, odd_pitch=1.0, acceleration=1.0, ramp=5.0, lateral=4.57,
        ),
        "land": Vehicle(
            name="land", pitch="slope", banks=False, standstill=1.0, spot_turn=0.8, knots=0.1, most_speed=150.0,
            odd_acceleration=15.0, odd_turn=2.0, odd_pitch=0.27, acceleration=1.0, ramp=1.5, lateral=2.0,
        ),
        "sea": Vehicle(
            name="sea", pitch="flat", banks=False, standstill=0.5, spot_turn=0.1, knots=0.25, most_speed=60.0,
            odd_acceleration=5.0, odd_turn=0.5, odd_pitch=0.35, acceleration=0.05, ramp=10.0, lateral=0.2,
        ),
    }  # fmt: skip
    assert expected == VEHICLES
    assert VEHICLES["aircraft"].lateral == pytest.approx(9.80665 * math.tan(math.radians(25.0)), abs=0.005)
