"""The flight to a place step by step: track against the wind, heights on the path, what is said, and circling."""

from __future__ import annotations

import math
from typing import Any

import pytest

from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.autopilot import INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.leg import LegError
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from tests.truth.flight.test_dead_reckoning import Thinning

R, KNOT = 6_371_009.0, 1852.0 / 3600.0
TRAINER = load_aircraft("c172x")


class Calm(Air):
    """Air in which the true airspeed is the calibrated one."""

    def true_airspeed(self, calibrated: float, height: float) -> float:
        return calibrated


def made(north: float, east: float, **state: float) -> tuple[Autopilot, AircraftState]:
    """Return a pilot at 50 m/s, and a state so far north and east of latitude 0 and longitude 0.2."""
    pilot, m = Autopilot(TRAINER, INTERVAL), AircraftState()
    m.air, m.latitude, m.longitude = Calm(((0.0, (0.0, 0.0, 0.0)),)), north / R, 0.2 + east / R
    m.tas = m.cas = m.ground_speed = pilot.airspeed = 50.0
    m.height = pilot.height = 1000.0
    for name, value in state.items():
        setattr(m, name, value)
    return pilot, m


def place(north: float, **keys: Any) -> WaypointLeg:
    return WaypointLeg(
        type="waypoint", latitude_deg=math.degrees(north / R), longitude_deg=math.degrees(0.2), name="ALPHA", **keys
    )  # fmt: skip


def test_the_track_is_on_the_bearing_and_the_drift_taken_off() -> None:
    """4 km south and 3 km east of the place: a bearing of −36.87°; the track is 0.1 rad to the right of the heading."""
    pilot, m = made(6000.0, 3000.0, psi=0.3, track=0.4)
    flown = place(10_000.0, bank_deg=25.0).fly(pilot, m, TRAINER.performance)
    next(flown)
    assert pilot.heading == pytest.approx(-math.atan2(3.0, 4.0) - 0.1, abs=1e-6)
    assert pilot.bank_limit == pytest.approx(math.radians(25.0))
    assert pilot.height == 1000.0
    m.latitude, m.longitude, m.height = 9800.0 / R, 0.2 + 400.0 / R, 1003.4
    with pytest.raises(StopIteration):
        next(flown)
    assert pilot.remarks == ["ALPHA reached: 447 m away, height 1003 m"]
    assert pilot.heading == pytest.approx(2.0 * math.pi - math.atan2(3.0, 4.0) - 0.1, abs=1e-6)
    assert pilot.bank_limit == pilot.usual_bank


def test_a_descent_at_an_angle_begins_at_its_top() -> None:
    """200 m at 3° and 50 m/s: 200/tan 3° and 2500 tan 3°/0.3 of parabolas, 4253 m before the capture."""
    slope, keys = math.tan(math.radians(3.0)), {"height_m": 800.0, "path_deg": 3.0}
    top = 200.0 / slope + slope * 2500.0 / 0.3
    pilot, m = made(0.0, 0.0)
    flown = place(10_000.0, **keys).fly(pilot, m, TRAINER.performance)
    next(flown)
    assert pilot.height == 1000.0
    assert pilot.remarks == []
    m.latitude = (9500.0 - top + 1.0) / R
    next(flown)
    assert pilot.remarks == [f"top of descent to ALPHA: {(top - 1.0) / 1e3:.1f} km away, height 1000 m"]
    # in the middle of the slope: 100 m below, and the reference ahead by the sink rate over the loop's 0.1 1/s
    m.latitude, m.height = (9500.0 - 0.5 * top) / R, 900.0
    next(flown)
    sink = 50.0 * slope
    assert pilot.height == pytest.approx(900.0 - sink / pilot.height_rate, abs=1e-3)
    assert pilot.descent_limit == pytest.approx(1.5 * sink + 1.0)
    assert pilot.climb_limit == pilot.usual_climb == 2.5
    next(flown)  # no new measurement of the distance: a thirtieth of a second on
    assert pilot.height == pytest.approx(900.0 - sink / pilot.height_rate - sink / 30.0, abs=1e-3)
    m.latitude, m.height = 9600.0 / R, 851.0
    with pytest.raises(LegError, match="ALPHA was reached at a height of 851 m instead of 800 m"):
        next(flown)
    assert pilot.height == 800.0
    assert pilot.descent_limit == pilot.usual_descent


def test_a_climb_of_one_slope_all_the_way() -> None:
    """400 m in 9.5 km at 50 m/s in the middle: the slope m of m L − m²/κ = 400 with κ = 0.3/2500."""
    pilot, m = made(0.0, 0.0)
    flown = place(10_000.0, height_m=1400.0).fly(pilot, m, TRAINER.performance)
    next(flown)
    kappa = 0.3 / 2500.0
    slope = 0.5 * kappa * (9500.0 - math.sqrt(9500.0**2 - 4.0 * 400.0 / kappa))
    m.latitude = 4750.0 / R
    next(flown)
    rate = 50.0 * slope
    assert pilot.height == pytest.approx(1200.0 + rate / pilot.height_rate, abs=1e-2)
    assert pilot.climb_limit == pytest.approx(max(2.5, 1.5 * rate + 1.0))
    m.latitude, m.height = 9510.0 / R, 1440.0
    with pytest.raises(StopIteration):
        next(flown)
    assert (pilot.height, pilot.climb_limit) == (1400.0, 2.5)
    assert pilot.remarks == ["ALPHA reached: 490 m away, height 1440 m"]


def test_a_path_that_cannot_be_had() -> None:
    pilot, m = made(0.0, 0.0)
    with pytest.raises(LegError) as error:
        next(place(3000.0, height_m=3000.0).fly(pilot, m, TRAINER.performance))
    assert error.value.reason == (
        "ALPHA cannot be reached at its height: there is no path from 1000 m to height_m = 3000 within 2.5 km"
    )


def test_circling_is_noticed_after_two_turns() -> None:
    """At 50 m/s and 20° a turn has 0.7 km; the place was 0.6 km away at the nearest."""
    pilot, m = made(0.0, 0.0)
    flown = place(700.0, capture_radius_m=100.0).fly(pilot, m, TRAINER.performance)
    next(flown)
    m.latitude = 100.0 / R
    steps = []

    def turns() -> None:
        while True:
            m.psi += 0.1
            steps.append(m.psi)
            next(flown)
            m.latitude = 0.0

    with pytest.raises(LegError) as error:
        turns()
    assert len(steps) == 126  # 4π of 0.1 rad
    assert error.value.reason == (
        "the aircraft circles ALPHA, which lies within its turn: at 50 m/s and 20° of bank a turn has a radius of "
        "0.7 km, and the waypoint was never nearer than 0.6 km"
    )
    assert "a capture_radius_m above 100" in error.value.remedy


def test_the_top_of_descent_is_that_of_the_speed_in_the_middle() -> None:
    """At 900 m the true airspeed is 1.09 times the calibrated one, and a headwind takes 4.5 m/s: 50 m/s again."""
    pilot, m = made(0.0, 0.0)
    m.air = Thinning(((0.0, (-4.5, 0.0, 0.0)),))
    flown = place(10_000.0, height_m=800.0, path_deg=3.0).fly(pilot, m, TRAINER.performance)
    slope = math.tan(math.radians(3.0))
    top = 200.0 / slope + slope * 2500.0 / 0.3
    for before, begun in ((2.0, False), (-2.0, True)):
        m.latitude = (9500.0 - top - before) / R
        next(flown)
        assert bool(pilot.remarks) == begun
