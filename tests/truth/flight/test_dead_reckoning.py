"""Dead reckoning step by step, worked out by hand in air whose true airspeed grows by a tenth in a kilometre."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.truth.atmosphere import Air, WindVector
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.leg import DeadReckoning, bearing, distance

R = 6371e3
PERFORMANCE = Performance(
    cruise_kt=200.0, stall_alpha_deg=15.0, bank_deg=20.0, max_load_factor_g=3.0, min_load_factor_g=0.2, climb_mps=4.0,
    descent_mps=2.5, acceleration_mps2=0.5, takeoff_kt=60.0, takeoff_pitch_deg=8.0, initial_climb_kt=90.0,
    takeoff_flaps=0.3, retractable_gear=True, engine_start_s=25.0, taxi_mps=5.0, approach_kt=70.0,
)  # fmt: skip


class Thinning(Air):
    """Air in which the true airspeed is (1 + h/10 km) times the calibrated one."""

    def true_airspeed(self, calibrated: float, height: float) -> float:
        return calibrated * (1.0 + height / 1e4)


def plan(
    wind: WindVector = (6.0, -8.0, 0.0), aloft: WindVector | None = None, heading_deg: float = 30.0
) -> DeadReckoning:
    levels = ((0.0, wind),) if aloft is None else ((0.0, wind), (1000.0, aloft))
    return DeadReckoning(
        PERFORMANCE, 0.2, 100.0, 0.0, math.radians(heading_deg), 0.5, 0.3, Thinning(levels), trace=[],
    )  # fmt: skip


def moved(of: DeadReckoning) -> tuple[float, float]:
    """Return the way north and east from latitude 0.5 and longitude 0.3, with the parallel of the middle."""
    north = (of.latitude - 0.5) * R
    return north, (of.longitude - 0.3) * R * math.cos(0.5 * (0.5 + of.latitude))


def test_straight_ahead_in_the_wind() -> None:
    """10 s at half of 100 m/s: 500 m through the air, 60 m north and 80 m west with it."""
    one = plan()
    assert one.straight(10.0, 0.5) == 10.0
    assert moved(one) == pytest.approx((500.0 * math.sqrt(0.75) + 60.0, 250.0 - 80.0), rel=1e-9)
    assert one.trace == [(one.latitude, one.longitude, 0.0)]
    other = plan()
    other.ahead(300.0)  # over the ground
    assert moved(other) == pytest.approx((300.0 * math.sqrt(0.75), 150.0), rel=1e-9)
    other.move(2e7, 0.0)
    assert other.latitude == 0.5 * math.pi


def test_a_climb_has_its_mean_speed_and_the_wind_of_its_heights() -> None:
    """1 km at 5 m/s: 200 s at a mean of 105 m/s; in twenty steps, the wind at the end of each."""
    calm, windy = plan((0.0, 0.0, 0.0)), plan((6.0, -8.0, 0.0), (16.0, -8.0, 0.0))
    for one, north, east in ((calm, 0.0, 0.0), (windy, 200.0 * (6.0 + 10.0 * 10.5 / 20.0), -1600.0)):
        assert one.climb(1000.0, 5.0) == 200.0
        assert one.altitude == 1000.0
        assert moved(one) == pytest.approx((21e3 * math.sqrt(0.75) + north, 10.5e3 + east), rel=1e-5)
    assert (len(calm.trace or ()), len(windy.trace or ())) == (1, 20)
    assert windy.wind == pytest.approx((16.0, -8.0))
    assert windy.true_airspeed() == pytest.approx(110.0)
    assert windy.climb(900.0, 4.0) == 25.0


def test_a_turn_to_the_left_in_the_wind() -> None:
    """By 90° at 45° of bank: the rate is g/V, the radius V²/g; the centre lies to the left."""
    one = plan()
    rate, radius = 0.0981, 100.0 / 0.0981
    seconds = 0.5 * math.pi / rate
    assert one.turn(-0.5 * math.pi, 45.0) == pytest.approx(seconds, rel=1e-12)
    sine, cosine = 0.5, math.sqrt(0.75)
    # from the centre the aircraft goes from bearing 120° to 30°
    assert moved(one) == pytest.approx(
        (radius * (cosine + sine) + 6.0 * seconds, radius * (sine - cosine) - 8.0 * seconds), rel=1e-7
    )
    assert math.degrees(one.heading) == pytest.approx(300.0)
    assert one.turning == pytest.approx((0.5 * math.pi) ** 2 / seconds + 2.0 * 0.25 * math.pi * 0.2, rel=1e-12)
    assert one.trace is not None
    assert len(one.trace) == 16  # fifteen places within it, and the end
    latitude, longitude, height = one.trace[7]  # the middle, from bearing 120° to 75°
    north = radius * (math.cos(math.radians(75.0)) - math.cos(math.radians(120.0))) + 3.0 * seconds
    east = radius * (math.sin(math.radians(75.0)) - math.sin(math.radians(120.0))) - 4.0 * seconds
    assert ((latitude - 0.5) * R, (longitude - 0.3) * R * math.cos(0.5), height) == pytest.approx(
        (north, east, 0.0), rel=1e-3
    )
    assert one.turn_rate(None) == pytest.approx(9.81 * math.tan(math.radians(20.0)) / 100.0)
    assert one.turning_of(1.2, 10.0, None) == pytest.approx(0.144 + 2.0 * math.radians(20.0) * 0.2)
    assert one.turning_of(1.2, 0.0, None) == 0.0


def test_the_heading_against_the_drift() -> None:
    """A wind from the west of 28 m/s at 100 m/s: 16.26° into the wind to go north, and 96 m/s over the ground."""
    one = plan((10.0, 28.0, 0.0))
    assert one.heading_along(0.0) == pytest.approx(2.0 * math.pi - math.asin(0.28))
    assert one.ground_speed(0.0) == pytest.approx(106.0)
    assert one.ground_speed(0.5 * math.pi) == pytest.approx(28.0 + math.sqrt(9900.0))
    assert one.heading_along(0.5 * math.pi) == pytest.approx(0.5 * math.pi + math.asin(0.1))
    assert plan((0.0, 101.0, 0.0)).heading_along(0.0) is None  # across
    assert plan((-101.0, 0.0, 0.0)).heading_along(0.0) is None  # against
    assert plan((101.0, 0.0, 0.0)).heading_along(0.0) == 0.0


def test_distance_and_bearing_are_those_of_vectors() -> None:
    a, b = (0.7, -0.2), (0.9, 0.5)

    def unit(latitude: float, longitude: float) -> np.ndarray:
        return np.array([math.cos(latitude) * math.cos(longitude), math.cos(latitude) * math.sin(longitude),
                         math.sin(latitude)])  # fmt: skip

    u, v = unit(*a), unit(*b)
    assert distance(*a, *b) == pytest.approx(R * math.acos(u @ v), rel=1e-12)
    east = np.array([-math.sin(a[1]), math.cos(a[1]), 0.0])
    assert bearing(*a, *b) == pytest.approx(math.atan2(v @ east, v @ np.cross(u, east)), rel=1e-12)
    assert distance(0.3, 0.1, -0.3, 0.1 + math.pi) == pytest.approx(math.pi * R)
