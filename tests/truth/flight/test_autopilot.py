"""The control loops alone, on a point that obeys the flight equations to first order."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, radians, remainder, sin, tan

import pytest

from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.autopilot import BANK, HEADING, HEIGHT, AircraftState, Autopilot

STEP = 1.0 / 30.0
G = 9.80665


class Point:
    """Roll and pitch rates that follow their controls in half a second, lift without lag, thrust as the throttle."""

    def __init__(self, name: str = "737") -> None:
        self.gains = load_aircraft(name).autopilot
        self.pilot = Autopilot(load_aircraft(name), STEP)
        self.m = AircraftState()
        self.m.cas = self.m.tas = self.gains.reference_kt * 0.514444
        self.m.height = 5000.0
        self.pilot.engage(self.m, elevator=0.0, aileron=0.0, rudder=0.0, throttle=0.5)

    def step(self) -> None:
        m, pilot = self.m, self.pilot
        pilot.step(m)
        m.p += 2.0 * STEP * (pilot.aileron / self.gains.roll_feedforward - m.p)
        m.q += 2.0 * STEP * (-pilot.elevator / self.gains.pitch_feedforward - m.q)
        load = m.q * m.tas / G + cos(m.theta) * cos(m.phi)
        m.phi += m.p * STEP
        m.psi = (m.psi + G * tan(m.phi) / m.tas * STEP) % (2.0 * pi)
        m.climb += (load * cos(m.phi) - 1.0) * G * STEP
        m.theta = m.climb / m.tas
        m.height += m.climb * STEP
        m.cas += 3.0 * (pilot.throttle - 0.5 - m.theta / 3.0) * STEP
        m.tas = m.cas
        m.r = G / m.tas * sin(m.phi)
        m.time += STEP


def test_bank_is_reached_without_overshoot() -> None:
    point = Point()
    point.pilot.lateral, point.pilot.bank = BANK, radians(30.0)
    banks = []
    for _ in range(600):
        point.step()
        banks.append(point.m.phi)
    assert banks[-1] == pytest.approx(radians(30.0), abs=radians(0.1))
    assert max(banks) < radians(30.5)
    rates = [(b - a) / STEP for a, b in pairwise(banks)]
    # The reference keeps to the limit; catching up with it takes a little more.
    assert max(rates) < radians(1.25 * point.gains.roll_rate_max_deg_s)


@pytest.mark.parametrize(
    ("start_deg", "target_deg", "way"), [(350.0, 20.0, 1.0), (20.0, 350.0, -1.0), (0.0, 90.0, 1.0)]
)
def test_heading_is_turned_to_the_shorter_way(start_deg: float, target_deg: float, way: float) -> None:
    point = Point()
    point.m.psi = radians(start_deg)
    point.pilot.heading = radians(target_deg)
    extreme = 0.0
    for _ in range(30 * 150):
        point.step()
        extreme = max(extreme, way * point.m.phi)
        assert way * point.m.phi > radians(-1.0)
    assert extreme < radians(25.5)
    assert remainder(point.m.psi - radians(target_deg), 2.0 * pi) == pytest.approx(0.0, abs=radians(0.1))


def test_height_is_reached_at_the_limited_rate() -> None:
    point = Point()
    point.pilot.height = 5300.0
    climbs, heights = [], []
    for _ in range(30 * 150):
        point.step()
        climbs.append(point.m.climb)
        heights.append(point.m.height)
    assert max(climbs) == pytest.approx(point.pilot.usual_climb, rel=0.1)
    assert heights[-1] == pytest.approx(5300.0, abs=0.2)
    assert max(heights) < 5302.0


def test_airspeed_is_reached() -> None:
    point = Point()
    target = point.m.cas + 10.0
    point.pilot.airspeed = target
    speeds = []
    for _ in range(30 * 200):
        point.step()
        speeds.append(point.m.cas)
    assert speeds[-1] == pytest.approx(target, abs=0.2)
    assert max(speeds) < target + 2.5


def test_commands_stay_within_full_travel() -> None:
    point = Point("f16")
    point.pilot.height, point.pilot.heading, point.pilot.airspeed = 9000.0, 2.0, 400.0
    for _ in range(3000):
        point.step()
        for command in (point.pilot.elevator, point.pilot.aileron, point.pilot.rudder):
            assert -1.0 <= command <= 1.0
        assert 0.0 <= point.pilot.throttle <= 1.0


def test_fixed_controls_are_not_touched_and_given_back_smoothly() -> None:
    point = Point()
    point.pilot.fixed_aileron, point.pilot.fixed_throttle = 0.1, 0.9
    for _ in range(30):
        point.step()
    assert point.pilot.aileron == 0.1
    assert point.pilot.throttle > 0.55
    throttle = point.pilot.throttle
    point.pilot.resume(point.m)
    assert (point.pilot.lateral, point.pilot.vertical) == (HEADING, HEIGHT)
    point.step()
    assert point.pilot.throttle == pytest.approx(throttle, abs=0.01)
