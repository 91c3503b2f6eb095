"""Flights that go wrong: each ends with a sentence, or says which leg did not attain what it ordered."""

from __future__ import annotations

import math
from typing import Any, cast

import pytest

from sinssim.errors import InputError
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.autopilot import BANK, HEADING, INTERVAL, PITCH, AircraftState, Autopilot
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_model import Monitor
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.flight.leg import LegError, not_attained, shortfall
from sinssim.truth.sampling import FlightEvent
from tests.slow import slow


def plan(aircraft: str, height: float, airspeed: float, *legs: dict[str, Any], **start: float) -> FlightPlan:
    place = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": height, "airspeed_kt": airspeed}
    return FlightPlan.model_validate({"aircraft": aircraft, "start": {**place, **start}, "legs": legs})


def flown(*parts: Any, **start: float) -> FlightLog:
    return flight_log(fly_plan(plan(*parts, **start)))


HOLD = {"type": "hold", "duration_s": 20.0}


def test_a_turn_with_too_much_bank_says_how_far_it_fell() -> None:
    steep = {"type": "turn", "heading_deg": 180.0, "bank_deg": 75.0}  # 3.9 g, and the autopilot pulls 2.2 g
    first, second = not_attained(flown("737", 3000.0, 280.0, steep, HOLD).events)
    assert first.startswith("leg 1 (turn) did not reach its targets: at its end the height is 22")
    assert "m instead of 3000 m, the airspeed is 304 kt instead of 280 kt (at 43 s)." in first
    assert second.startswith("leg 2 (hold) did not reach its targets: at its end the height is 24")


def test_a_flight_within_its_limits_says_nothing() -> None:
    turn = {"type": "turn", "heading_deg": 40.0}
    log = flown("c172x", 1000.0, 100.0, turn, {"type": "speed", "airspeed_kt": 90.0}, HOLD)
    assert not_attained(log.events) == []


def test_a_steep_descent_stops_at_its_height() -> None:
    """At 25 m/s with 0.7 m/s² it takes 446 m to stop, and a vertical speed of a tenth of the way left begins at 250."""
    down = {"type": "descend", "altitude_m": 4000.0, "vertical_speed_mps": 25.0}
    log = flown("737", 6000.0, 280.0, down, HOLD)
    assert log.channels["vertical_speed_mps"].values.min() == pytest.approx(-25.0, abs=1.0)
    assert log.channels["vertical_speed_mps"].values[-1] == pytest.approx(0.0, abs=0.3)
    height = log.channels["height_above_ground_m"].values  # of the ground at 0 m
    assert height.min() > 3990.0
    assert height[-1] == pytest.approx(4000.0, abs=6.0)


def test_a_turn_to_the_present_heading_is_no_circle() -> None:
    """20° and 30° make 50° less a rounding in binary numbers, which ordered a full circle."""
    to = {"type": "turn", "heading_deg": 50.0, "direction": "right"}
    back = {**to, "direction": "left"}
    section = plan("c172x", 1000.0, 100.0, to, to, back, HOLD, heading_deg=20.0)
    log = flight_log(fly_plan(section))
    begins = [event.time for event in log.events if event.text.endswith("begins")]
    assert begins[1] == begins[2] == begins[3]
    assert section.leg_durations()[1:3] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_the_737_starts_at_any_speed_above_the_stall() -> None:
    log = flown("737", 3000.0, 165.0, HOLD)
    assert log.channels["calibrated_airspeed_mps"].values[-1] == pytest.approx(165.0 * 1852.0 / 3600.0, abs=0.5)
    assert log.channels["height_above_ground_m"].values[-1] == pytest.approx(3000.0, abs=2.0)


@pytest.mark.parametrize(
    ("flight", "words"),
    [
        *slow((
            ("c172x", 1000.0, 100.0, {"type": "waypoint", "latitude_deg": 48.0, "longitude_deg": 11.008,
                                      "capture_radius_m": 50.0, "name": "ALPHA"}),
            r"the aircraft circles ALPHA, .* 54 m/s and 20° of bank a turn has a radius of 0.8 km.* a capture_radius_m",
        )),
        (("737", 9000.0, 280.0, {**HOLD, "duration_s": 300.0}, {"latitude_deg": 89.905}),
         r"the pole is 10\.\d km away, and a heading cannot be held .* Use a path farther from the pole"),
        (("f16", 60.0, 130.0, {"type": "speed", "airspeed_kt": 105.0}), "the aircraft hit the ground"),
        (("c172x", 0.0, 100.0, HOLD), "The ground below a start in the air is at a height of 0 m"),
        (("737", 3000.0, 150.0, HOLD), "Give an airspeed and a height at which it can fly"),
    ],
)  # fmt: skip
def test_what_cannot_go_on_says_why(flight: Any, words: str) -> None:
    *parts, last = flight
    start = {} if "type" in last else last
    with pytest.raises(InputError, match=words):
        fly_plan(plan(*(parts if start else flight), **start))


class _Node:
    def __init__(self, values: dict[str, float], name: str) -> None:
        self._values, self._name = values, name

    def get_double_value(self) -> float:
        return self._values[self._name]


class _Model:
    """The properties that a monitor reads, and no flight dynamics."""

    def __init__(self, values: dict[str, float]) -> None:
        self.values = values

    def get_property_manager(self) -> _Model:
        return self

    def get_ground_reactions(self) -> _Model:
        return self

    def get_num_gear_units(self) -> int:
        return 4

    def hasNode(self, name: str) -> bool:
        return name in self.values

    def get_node(self, name: str) -> _Node:
        return _Node(self.values, name)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"propulsion/total-fuel-lbs": 0.0}, "the fuel of the model is used up"),
        ({"contact/unit[3]/WOW": 1.0}, "hit the ground"),  # the belly of an aircraft with its gear up
    ],
)
def test_fuel_and_contact_are_watched(change: dict[str, float], words: str) -> None:
    flight, aircraft = plan("f16", 3000.0, 350.0, HOLD), load_aircraft("f16")
    model = _Model({"propulsion/total-fuel-lbs": 3000.0, "gear/unit[0]/WOW": 0.0, "contact/unit[3]/WOW": 0.0})
    monitor, pilot, state = Monitor(model, flight, aircraft), Autopilot(aircraft, INTERVAL), AircraftState()
    state.height_above_ground = 100.0
    monitor.watch(cast(Any, flight.legs[0]), pilot, state)
    model.values |= change
    with pytest.raises(LegError, match=words):
        monitor.watch(cast(Any, flight.legs[0]), pilot, state)


@pytest.mark.parametrize(
    ("extra", "remedy"),
    [
        ({}, "a higher airspeed or a lower load factor"),
        ({"turbulence": {"severity": 3}}, "a higher airspeed, a lower load factor or weaker turbulence"),
        ({"wind": {"down_mps": -1.0}}, "a higher airspeed, a lower load factor or weaker vertical wind and gusts"),
    ],
)
def test_a_stall_lasts_a_second(extra: dict[str, Any], remedy: str) -> None:
    """Ten updates in a row beyond the angle of the stall."""
    whole = plan("f16", 3000.0, 350.0, HOLD).model_dump(exclude_none=True)
    section, aircraft = FlightPlan.model_validate({**whole, **extra}), load_aircraft("f16")
    stall = aircraft.performance.stall_alpha_deg
    monitor, pilot, state = (
        Monitor(_Model({"propulsion/total-fuel-lbs": 9.0}), section, aircraft),
        Autopilot(aircraft, INTERVAL),
        AircraftState(),
    )
    leg = cast(Any, section.legs[0])
    for alpha_deg, times in ((stall + 0.1, 9), (stall - 0.1, 1), (stall + 0.1, 9)):
        state.alpha = math.radians(alpha_deg)
        for _ in range(times):
            monitor.watch(leg, pilot, state)
    with pytest.raises(LegError, match="the aircraft stalled") as error:
        monitor.watch(leg, pilot, state)
    assert error.value.remedy == remedy


def test_a_heading_near_the_pole() -> None:
    """At 89.9° the pole is 11.12 km away; at 200 m/s and 20° of bank a turn has a radius of 11.21 km."""
    section, aircraft = plan("737", 9000.0, 280.0, HOLD), load_aircraft("737")
    monitor, pilot, state = (
        Monitor(_Model({"propulsion/total-fuel-lbs": 9.0}), section, aircraft),
        Autopilot(aircraft, INTERVAL),
        AircraftState(),
    )
    leg = cast(Any, section.legs[0])
    pilot.bank_limit, state.latitude, state.ground_speed = math.radians(20.0), math.radians(-89.9), 199.0
    monitor.watch(leg, pilot, state)
    state.ground_speed = 200.0
    with pytest.raises(LegError) as error:
        monitor.watch(leg, pilot, state)
    assert error.value.reason == (
        "the pole is 11.1 km away, and a heading cannot be held within the turn radius of 11.2 km"
    )
    pilot.lateral = BANK
    monitor.watch(leg, pilot, state)
    pilot.lateral, state.height_above_ground = HEADING, -0.1
    with pytest.raises(LegError, match="hit the ground"):
        monitor.watch(leg, pilot, state)


def test_what_a_leg_did_not_attain() -> None:
    """Limits of 50 m, 5° and 10 kt or 5 %; three times as much in turbulence."""
    leg, aircraft = cast(Any, plan("737", 9000.0, 280.0, HOLD).legs[0]), load_aircraft("737")
    pilot, state = Autopilot(aircraft, INTERVAL), AircraftState()
    kt = 1852.0 / 3600.0
    pilot.height, pilot.airspeed, pilot.heading = 3000.0, 300.0 * kt, math.radians(358.0)
    state.time, state.height, state.cas, state.psi = 77.4, 2951.0, 286.0 * kt, math.radians(2.0)

    def said(**change: float) -> str | None:
        kept = {name: getattr(state, name) for name in change}
        for name, value in change.items():
            setattr(state, name, value)
        event = shortfall("leg 4 (hold)", leg, pilot, state, turbulent=False)
        calm = shortfall("leg 4 (hold)", leg, pilot, state, turbulent=True)
        for name, value in kept.items():
            setattr(state, name, value)
        assert calm is None
        assert event is None or event.time == 77.4
        return None if event is None else event.text

    begin = "leg 4 (hold) did not reach its targets: at its end "
    assert said() is None
    assert said(height=2949.0) == begin + "the height is 2949 m instead of 3000 m"
    assert said(cas=284.0 * kt) == begin + "the airspeed is 284 kt instead of 300 kt"
    assert said(psi=math.radians(4.0)) == begin + "the heading is 4° instead of 358°"
    assert said(height=3051.0, psi=math.radians(352.0)) == (
        begin + "the height is 3051 m instead of 3000 m, the heading is 352° instead of 358°"
    )
    pilot.airspeed = 100.0 * kt
    assert said(cas=109.0 * kt) is None
    assert said(cas=111.0 * kt) == begin + "the airspeed is 111 kt instead of 100 kt"
    pilot.vertical = PITCH
    assert said(cas=100.0 * kt, height=0.0) is None
    events = [FlightEvent(1.0, "leg 1 (hold) ends"), FlightEvent(77.4, begin + "the heading is 4° instead of 358°")]
    assert not_attained(events) == [f"{begin}the heading is 4° instead of 358° (at 77 s)."]
