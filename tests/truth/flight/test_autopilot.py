"""The control loops alone, on a point that obeys the flight equations to first order."""

from __future__ import annotations

from itertools import pairwise
from math import atan, cos, degrees, pi, radians, remainder, sin, tan

import pytest

from sinssim.truth.flight.aircraft import AutopilotGains, load_aircraft
from sinssim.truth.flight.autopilot import (
    BANK,
    HEADING,
    HEIGHT,
    LOAD_FACTOR,
    PITCH,
    ROLL_RATE,
    AircraftState,
    Autopilot,
)

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


def instrumented(**state: float) -> tuple[Autopilot, AircraftState]:
    """Return an autopilot with round gains, whose reference is 100 m/s, at 80 m/s calibrated and 90 m/s true."""
    gains = AutopilotGains(
        reference_kt=100.0 * 3600.0 / 1852.0, airspeed_scheduled=True, roll_rate_max_deg_s=degrees(0.5),
        roll_acceleration_max_deg_s2=degrees(1.5), bank_rate=0.8, bank_gain=2.0, roll_feedforward=0.5, roll_gain=0.3,
        roll_integral=0.6, heading_time_s=9.0, height_rate=0.1, path_gain=0.4, vertical_acceleration_mps2=0.6,
        load_time_s=0.5, lift_time_s=0.25, pitch_feedforward=0.7, pitch_gain=1.1, pitch_integral=1.3, speed_gain=0.02,
        speed_integral=0.003, climb_throttle=3.0, throttle_lead_s=0.5, throttle_rate=0.6, yaw_feedforward=0.4,
        yaw_gain=0.9, sideslip_gain=0.35, sideslip_integral=0.15, steering_gain=1.7,
    )  # fmt: skip
    plane = load_aircraft("c172x")
    performance = plane.performance.model_copy(update={"acceleration_mps2": 0.9, "climb_mps": 4.0, "descent_mps": 3.0})
    pilot = Autopilot(plane.model_copy(update={"autopilot": gains, "performance": performance}), STEP)
    m = AircraftState()
    m.cas, m.tas, m.height, m.psi = 80.0, 90.0, 1000.0, 1.0
    pilot.engage(m, elevator=0.05, aileron=-0.02, rudder=0.03, throttle=0.5)
    for name, value in state.items():
        setattr(m, name, value)
    return pilot, m


# At 80 m/s feedforward is 100/80 as large, and feedback the square of it.
RATIO, SQUARE = 1.25, 1.5625


def test_one_step_of_the_bank() -> None:
    """Reference rate 0.8 · 0.3 rad/s, its step at most 1.5/30; then rate error, its integral, and the aileron."""
    pilot, m = instrumented(phi=0.08, p=0.02)
    pilot.lateral, pilot.bank = BANK, 0.3
    pilot.step(m)
    rate = 0.05
    error = rate + 2.0 * (rate / 30.0 - 0.08) - 0.02
    assert pilot.aileron == pytest.approx(RATIO * 0.5 * rate + SQUARE * 0.3 * error - 0.02 + 0.6 * error / 30.0)
    pilot.step(m)
    rate2 = 0.1
    error2 = rate2 + 2.0 * ((rate + rate2) / 30.0 - 0.08) - 0.02
    whole = -0.02 + 0.6 * (error + error2) / 30.0
    assert pilot.aileron == pytest.approx(RATIO * 0.5 * rate2 + SQUARE * 0.3 * error2 + whole)


def test_one_step_of_the_heading_and_of_the_roll_rate() -> None:
    """A small error of the heading asks for tan φ = V Δψ/(g T), here 0.0102 rad; bank and rate keep their limits."""
    pilot, m = instrumented()
    pilot.heading = 1.01
    pilot.step(m)
    bank = atan(90.0 * 0.01 / (G * 9.0))
    error = 0.8 * bank + 2.0 * 0.8 * bank / 30.0
    assert pilot.aileron == pytest.approx(RATIO * 0.5 * 0.8 * bank + (SQUARE * 0.3 + 0.02) * error - 0.02)
    left, m = instrumented()
    left.heading, left.bank_limit = 1.0 + pi + 0.5, 0.02  # the shorter way is to the left
    left.step(m)
    error = -0.016 - 2.0 * 0.016 / 30.0
    assert left.aileron == pytest.approx(-RATIO * 0.5 * 0.016 + (SQUARE * 0.3 + 0.02) * error - 0.02)
    rolling, m = instrumented(p=0.01)
    rolling.lateral, rolling.roll_rate = ROLL_RATE, -0.03
    rolling.step(m)
    assert rolling.aileron == pytest.approx(-RATIO * 0.5 * 0.03 - (SQUARE * 0.3 + 0.02) * 0.04 - 0.02)


def test_one_step_of_a_climb() -> None:
    """10 m below: 1 m/s, of which 0.6/30 in a step; load 1 + (0.6 + 0.4 (0.02 − 0.1))/g, through two lags of 1/8.5.

    The lift is led by its lag of 0.25 s at the reference, 0.25 · 1.5625 · 90/100 s here.
    """
    pilot, m = instrumented(climb=0.1, q=0.003)
    pilot.height = 1010.0
    pilot.step(m)
    load = 1.0 + (0.6 + 0.4 * (0.02 - 0.1)) / G
    lag = (1.0 / 30.0) / (0.25 + 1.0 / 30.0)
    ahead = lag * (load - 1.0)
    change = lag * ahead
    rate = G / 90.0 * (change + 0.25 * SQUARE * 0.9 * change * 30.0)
    error = rate - 0.003
    whole = 0.05 - SQUARE * 1.3 * error / 30.0
    assert pilot.elevator == pytest.approx(whole - SQUARE * 1.1 * error - RATIO * 0.7 * rate)
    # the throttle: 0 m/s of error, and 3 times the climb's reference over the airspeed, half a second ahead
    assert pilot.throttle == pytest.approx(0.5 + 3.0 * (0.02 + 0.5 * 0.6) / 90.0)


def test_one_step_of_pitch_and_of_load_factor() -> None:
    """Pitch: 0.8 1/s of its error, at most 0.06 rad/s, as a load V q/g beside the weight's part."""
    lag = (1.0 / 30.0) / (0.25 + 1.0 / 30.0)

    def elevator(load: float, weight: float) -> float:
        change = lag * lag * (load - 1.0)
        rate = G / 90.0 * (1.0 + change - weight + 0.25 * SQUARE * 0.9 * change * 30.0)
        return 0.05 - SQUARE * (1.3 / 30.0 + 1.1) * rate - RATIO * 0.7 * rate

    pilot, m = instrumented(theta=0.1, phi=0.2)
    pilot.vertical, pilot.pitch = PITCH, 0.15
    pilot.step(m)
    weight = cos(0.1) * cos(0.2)
    assert pilot.elevator == pytest.approx(elevator(weight + 90.0 / G * 0.04, weight))
    limited, m = instrumented(theta=0.1, phi=0.2)
    limited.vertical, limited.pitch = PITCH, -0.5
    limited.step(m)
    assert limited.elevator == pytest.approx(elevator(weight - 90.0 / G * 0.06, weight))
    pulled, m = instrumented(theta=0.1, phi=0.2)
    pulled.vertical, pulled.load_factor = LOAD_FACTOR, 9.0  # the limit of the trainer is 2.5
    pulled.step(m)
    assert pulled.elevator == pytest.approx(elevator(2.5, weight))


def test_one_step_of_the_throttle() -> None:
    """The reference changes by 0.9/30 m/s; 3 times Δv̇/g ahead, 0.02 of the error, and the integral."""
    pilot, m = instrumented(climb=0.0)
    pilot.airspeed, m.cas = 70.0, 80.2
    pilot.step(m)
    error = 80.0 - 0.03 - 80.2
    assert pilot.throttle == pytest.approx(max(0.5 - 0.02, 0.5 + 0.02 * error - 3.0 * 0.9 / G))
    gentle, m = instrumented()
    m.cas = 80.2
    gentle.step(m)
    assert gentle.throttle == pytest.approx(0.5 - 0.02 * 0.2)
    gentle.step(m)
    assert gentle.throttle == pytest.approx(0.5 - 0.02 * 0.2 - 0.003 * 0.2 / 30.0)
    # 4 m/s is the most by which the reference goes ahead
    slow, m = instrumented()
    m.cas = 70.0
    slow.step(m)
    assert slow.throttle == pytest.approx(0.52)  # 0.5 + 0.08 within 0.02 a step
    # below its airspeed by 4 m/s a climb is given up, of which 2.4 m/s are the way from all to nothing
    for short, share in ((1.0, 1.0), (2.8, 0.5), (4.0, 0.0)):
        climbing, m = instrumented()
        m.cas, climbing.height = 80.0 - short, 2000.0
        climbing._climb_step = 100.0
        climbing.step(m)
        assert climbing._climb_reference == pytest.approx(4.0 * share)
    sinking, m = instrumented()
    sinking.height, sinking._climb_step = 0.0, 100.0
    sinking.step(m)
    assert sinking._climb_reference == -3.0


def test_one_step_of_the_rudder() -> None:
    """In the air r = (g/V) cosθ sinφ and no sideslip; on the ground the nose wheel steers, and the pedals with it."""
    pilot, m = instrumented(phi=0.3, theta=0.1, beta=0.02, r=0.01)
    pilot.step(m)
    yaw = G / 90.0 * cos(0.1) * sin(0.3)
    whole = 0.03 - SQUARE * 0.15 * 0.02 / 30.0
    assert pilot.rudder == pytest.approx(whole - 0.4 * yaw - SQUARE * (0.9 * (yaw - 0.01) + 0.35 * 0.02))
    assert pilot.steer == 0.0
    pilot, m = instrumented(r=0.01)
    pilot.steering, pilot.heading = True, 1.1
    pilot.step(m)
    assert pilot.steer == pytest.approx(1.7 * (0.1 - 0.01))
    assert pilot.rudder == -pilot.steer
    pilot, m = instrumented()
    pilot.fixed_rudder = 0.4
    pilot.step(m)
    assert pilot.rudder == 0.4


def test_what_engaging_and_resuming_take_over() -> None:
    pilot, m = instrumented(phi=0.1, p=0.02, climb=1.5, cas=82.0)
    pilot.fixed_throttle, pilot.throttle, pilot.lateral, pilot.vertical = 0.9, 0.7, ROLL_RATE, PITCH
    pilot.resume(m)
    assert (pilot._bank_reference, pilot._roll_reference) == (0.1, 0.02)
    assert (pilot._climb_reference, pilot._speed_reference) == (1.5, 82.0)
    assert pilot._throttle_integral == pytest.approx(0.7 - 3.0 * 1.5 / 90.0)
    assert (pilot.lateral, pilot.vertical, pilot.fixed_throttle) == (HEADING, HEIGHT, None)
    pilot.engage(m, elevator=0.11, aileron=0.12, rudder=0.13, throttle=0.14)
    assert (pilot.heading, pilot.height, pilot.airspeed) == (1.0, 1000.0, 82.0)
    assert (pilot.elevator, pilot.aileron, pilot.rudder, pilot.throttle) == (0.11, 0.12, 0.13, 0.14)


def test_gains_follow_the_dynamic_pressure(monkeypatch: pytest.MonkeyPatch) -> None:
    """(reference/airspeed)², with the airspeed at least 0.6 of the reference, for gains that are scheduled; without a
    schedule the pressure alone. True airspeeds are at least 20 m/s."""
    asked: list[tuple[float, ...]] = []
    for name in ("_roll", "_pitch", "_power", "_yaw"):
        monkeypatch.setattr(Autopilot, name, lambda self, state, *given: asked.append(given))
    pilot, state = instrumented()
    reference = pilot._reference
    for scheduled, share, ratio in ((True, 0.8, 1.25), (True, 0.5, 1.0 / 0.6), (False, 0.8, 1.25)):
        pilot._gains = pilot._gains.model_copy(update={"airspeed_scheduled": scheduled})
        state.cas, state.tas = share * reference, 15.0 if share == 0.5 else 90.0
        pilot.step(state)
        tas, own, square = (20.0 if share == 0.5 else 90.0), ratio if scheduled else 1.0, ratio**2
        feedback = square if scheduled else 1.0
        assert asked == [
            pytest.approx((tas, own, feedback)), pytest.approx((tas, own, feedback, square)), pytest.approx((tas,)),
            pytest.approx((tas, feedback)),
        ]  # fmt: skip
        asked.clear()
