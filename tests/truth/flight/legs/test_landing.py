"""The landing step by step: place beside the runway, approach, flare, touchdown, roll-out, and what fails."""

from __future__ import annotations

import math

import pytest

from sinssim.truth.flight.autopilot import BANK, INTERVAL, AircraftState
from sinssim.truth.flight.leg import LegError
from sinssim.truth.flight.legs.landing import LandLeg, _Runway
from tests.truth.flight.legs.test_flying import KNOT, TRAINER, Cockpit


def test_the_place_beside_a_runway() -> None:
    """600 m south and 800 m west of a threshold on the equator, 100 m up, with a heading of 30°."""
    leg = LandLeg(type="land", latitude_deg=0.0, longitude_deg=20.0, altitude_m=100.0, heading_deg=30.0)
    runway, state = _Runway(leg), AircraftState()
    state.latitude = -600.0 / (6378137.0 * (1.0 - 6.694379990141e-3) + 100.0)
    state.longitude = math.radians(20.0) - 800.0 / 6378237.0
    left, offset = runway.place(state)
    assert left == pytest.approx(600.0 * math.sqrt(0.75) + 400.0)
    assert offset == pytest.approx(-800.0 * math.sqrt(0.75) + 300.0)
    state.ground_speed, state.track, state.psi = 50.0, 0.55, 0.5
    assert runway.heading_to(75.0, 15.0, state) == pytest.approx(math.radians(30.0) - math.atan(0.1) - 0.05)
    assert runway.heading_to(-1e5, 15.0, state) == pytest.approx(math.radians(70.0) - 0.05)
    state.ground_speed = 19.0
    assert runway.heading_to(30.0, 15.0, state) == pytest.approx(math.radians(30.0) - math.atan(0.1))


def test_there_is_no_approach_from_too_near() -> None:
    """From 700 m over the runway a path of 3° needs 700/tan 3° less the 300 m of its aim beyond the threshold."""
    leg = LandLeg(type="land", latitude_deg=0.0, longitude_deg=20.0, altitude_m=300.0, heading_deg=0.0)
    cockpit = Cockpit()
    cockpit.state.latitude, cockpit.state.longitude = -9000.0 / 6335739.0, math.radians(20.0)
    with pytest.raises(LegError) as error:
        cockpit.fly(leg)
    assert error.value.reason == (
        "there is no approach to this runway from here: its threshold is 9.0 km ahead along its heading of 0°, and a "
        "glide path of 3° from 1000 m needs 13.1 km"
    )


def test_an_approach_follows_its_path() -> None:
    """14 km out, 40 m to the right, at 40 m/s: level until the path is met, then on it with the lead of its loop."""
    leg = LandLeg(type="land", latitude_deg=0.0, longitude_deg=20.0, altitude_m=300.0, heading_deg=0.0)
    cockpit = Cockpit()
    pilot, state = cockpit.pilot, cockpit.state
    state.longitude, state.ground_speed, state.cas = math.radians(20.0) + 40.0 / 6378437.0, 40.0, 43.0
    flown = leg.fly(pilot, state, TRAINER.performance)
    slope = math.tan(math.radians(3.0))
    sink = 40.0 * slope
    for left, height in ((14_000.0, 1000.0), (12_900.0, 300.0 + 13_200.0 * slope - sink / pilot.height_rate)):
        state.latitude = -left / 6335739.3
        next(flown)
        assert pilot.height == pytest.approx(height, abs=0.01)
        assert pilot.descent_limit == pytest.approx(1.5 * sink + 1.0)
        assert pilot.heading == pytest.approx(-math.atan(40.0 / (40.0 * 3.0 * pilot.heading_time)), rel=1e-4)
        assert (pilot.airspeed, pilot.gear) == (65.0 * KNOT, 1.0)
        assert pilot.runway_height is None
    state.latitude, state.height = -4900.0 / 6335739.3, 600.0
    next(flown)
    assert pilot.runway_height == 300.0
    # the flare begins where the wheels are 4 s of the sink rate less 0.6 m/s and half a second of it above the runway
    flare = 4.0 * (sink - 0.6) + 0.5 * sink
    state.latitude, state.height, state.psi = -100.0 / 6335739.3, 300.0 + 1.31 + flare + 0.01, pilot.heading
    next(flown)
    assert not pilot.may_touch
    state.height, state.longitude = state.height - 0.02, math.radians(20.0)
    next(flown)
    assert (pilot.may_touch, pilot.fixed_throttle) == (True, 0.0)
    wheels = flare - 0.01
    assert pilot.height == pytest.approx(state.height - (wheels / 4.0 + 0.6) / pilot.height_rate)
    state.height, state.latitude = 300.0 + 1.31 + 1.9, 50.0 / 6335739.3
    next(flown)
    assert (pilot.lateral, pilot.bank, pilot.steering, pilot.heading) == (BANK, 0.0, True, 0.0)
    pilot.elevator, state.on_wheels, state.ground_speed = -0.2, True, 30.0
    next(flown)
    assert (pilot.fixed_elevator, pilot.brakes) == pytest.approx((-0.2, 0.2 / 30.0))
    state.time += 1.0
    next(flown)
    assert (pilot.fixed_elevator, pilot.brakes) == pytest.approx((-0.15, 0.4 / 30.0))
    for _ in range(100):
        next(flown)
    assert pilot.brakes == TRAINER.performance.braking
    state.ground_speed = 7.9
    with pytest.raises(StopIteration):
        next(flown)
    assert (pilot.flaps, pilot.may_touch, pilot.descent_limit) == (0.0, False, 2.5)


def touching(**change: float) -> LegError:
    """Return the refusal of a touchdown 120 m beyond a threshold at 300 m, 5 m to the right, with some changes."""
    leg = LandLeg(type="land", latitude_deg=0.0, longitude_deg=20.0, altitude_m=300.0, heading_deg=0.0, length_m=900.0)
    cockpit = Cockpit(lambda pilot, state: setattr(state, "height", state.height - change.get("falls", 0.0)))
    pilot, state = cockpit.pilot, cockpit.state
    state.latitude = change.get("beyond", 120.0) / 6335739.3
    state.longitude = math.radians(20.0) + change.get("right", 5.0) / 6378437.0
    state.height, state.climb = 301.31 + change.get("high", 0.0), -change.get("sinks", 1.0)
    state.on_wheels = "high" not in change

    def flare() -> None:
        for _ in leg._flare(_Runway(leg), pilot, state, 1.31):
            state.time += INTERVAL

    with pytest.raises(LegError) as error:
        flare()
    return error.value


def test_touchdowns_that_fail_say_where() -> None:
    assert touching(beyond=-50.0).reason == (
        "it touches down before the threshold: 50 m before the threshold, 5 m from the centreline"
    )
    assert touching(right=-35.0).reason == (
        "it touches down beside the runway: 120 m beyond the threshold, 35 m from the centreline"
    )
    assert touching(high=0.4, sinks=4.1).reason == "the touchdown is too hard: 4.1 m/s"
    assert touching(high=0.6, sinks=4.1).reason == (
        "it does not touch down: 120 m beyond the threshold it is still 0.6 m high"
    )
    assert touching(high=3.0, beyond=901.0).reason == (
        "it does not touch down: 901 m beyond the threshold it is still 3.0 m high"
    )


def test_a_roll_out_beyond_the_end() -> None:
    leg = LandLeg(type="land", latitude_deg=0.0, longitude_deg=20.0, altitude_m=300.0, heading_deg=0.0, length_m=900.0)
    cockpit = Cockpit()
    pilot, state = cockpit.pilot, cockpit.state
    state.longitude, state.on_wheels, state.ground_speed = math.radians(20.0) + 20.0 / 6378437.0, True, 30.0
    rolling = leg._roll_out(_Runway(leg), pilot, state, TRAINER.performance)
    state.latitude = 890.0 / 6335739.3
    next(rolling)
    assert pilot.heading == pytest.approx(-0.1)  # back to the centreline, by 0.1 rad at most
    state.longitude = math.radians(20.0) + 6.0 / 6378437.0
    next(rolling)
    assert pilot.heading == pytest.approx(-math.atan2(6.0, 150.0), rel=1e-4)
    state.latitude = 910.0 / 6335739.3
    with pytest.raises(LegError, match=r"it overruns the end of the runway at 30 m/s \(length_m = 900\)"):
        next(rolling)
