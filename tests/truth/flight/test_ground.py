"""Legs on the ground: a hop from standstill to standstill, and what fails on the way."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.truth.curve import Curve
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_simulation import fly_plan

START = {
    "on": "runway", "latitude_deg": 50.0, "longitude_deg": 14.0, "altitude_m": 300.0, "heading_deg": 90.0,
    "engines": "off",
}  # fmt: skip
# straight ahead of the take-off on heading 0, 120 m above the gate; the runway is crossed at a small angle
LAND = {
    "type": "land", "latitude_deg": 50.06, "longitude_deg": 14.004, "altitude_m": 250.0, "heading_deg": 4.0,
    "length_m": 1200.0,
}  # fmt: skip
HOP = [
    {"type": "park", "duration_s": 5.0},
    {"type": "taxi", "distance_m": 200.0, "heading_deg": 0.0, "radius_m": 30.0},
    {"type": "take_off", "height_m": 60.0, "runway_m": 800.0},
    LAND,
    {"type": "taxi", "distance_m": 40.0},
    {"type": "park", "duration_s": 20.0, "engines": "off"},
]


def plan(*legs: dict[str, Any], aircraft: str = "c172x", **start: Any) -> FlightPlan:
    return FlightPlan.model_validate({"aircraft": aircraft, "start": {**START, **start}, "legs": list(legs)})


@pytest.fixture(scope="module")
def hop() -> FlightLog:
    return flight_log(fly_plan(plan(*HOP)))


def span(log: FlightLog, number: int) -> tuple[float, float]:
    begin, end = (event.time for event in log.events if event.text.startswith(f"leg {number} "))
    return begin, end


def test_hop_from_standstill_to_standstill(hop: FlightLog) -> None:
    curve = Curve(hop.time, hop.position_ecef, hop.q_eb)
    for number, lasting in ((1, 5.0), (6, 20.0)):
        begin, end = span(hop, number)
        begin = end - lasting if number == 6 else begin
        state = curve.state(np.linspace(begin + 1.0, end - 1.0, 200))
        assert np.abs(state.velocity_ned).max() < 1e-10
        omega, force = curve.rates(np.linspace(begin + 1.0, end - 1.0, 200))
        assert np.ptp(omega, axis=0).max() < 1e-13
        assert np.ptp(force, axis=0).max() < 1e-8
    thrust = hop.channels["thrust_n"]
    begin, end = span(hop, 1)
    assert np.abs(thrust.values[thrust.time < end - 0.1]).max() < 1.0  # off at the gate
    assert thrust.values[(thrust.time > end)].max() > 500.0
    assert abs(thrust.values[-1]) < 100.0  # a piston engine that has stopped: what its propeller does in no wind


def test_taxi_goes_its_way(hop: FlightLog) -> None:
    begin, end = span(hop, 2)
    speed = np.linalg.norm(np.gradient(hop.position_ecef, hop.time, axis=0), axis=1)
    inside = (hop.time >= begin) & (hop.time <= end)
    assert np.trapezoid(speed[inside], hop.time[inside]) == pytest.approx(200.0, abs=1.0)
    q = Curve(hop.time, hop.position_ecef, hop.q_eb).state(end).q_nb
    heading = np.degrees(2.0 * np.arctan2(q[3], q[0]))
    assert abs(heading) < 2.0


def test_landing_is_on_the_runway_and_gentle(hop: FlightLog) -> None:
    curve = Curve(hop.time, hop.position_ecef, hop.q_eb)
    height = hop.channels["height_above_ground_m"]
    begin, end = span(hop, 4)
    touched = height.time[(height.time > begin) & (height.values < 1.45)][0]
    state = curve.state(np.array([touched, end]))
    north = (state.latitude - np.radians(50.06)) * 6.372e6  # meridian's radius of curvature at 50° and 250 m
    east = (state.longitude - np.radians(14.004)) * 6.3909e6 * np.cos(np.radians(50.06))
    along = north * np.cos(np.radians(4.0)) + east * np.sin(np.radians(4.0))
    beside = east * np.cos(np.radians(4.0)) - north * np.sin(np.radians(4.0))
    assert 100.0 < along[0] < 700.0
    assert along[0] < along[1] < 1200.0
    assert np.abs(beside).max() < 8.0
    before = curve.state(np.linspace(touched - 3.0, touched, 50))
    assert before.velocity_ned[:, 2].max() < 2.0
    assert before.height[-1] - 250.0 == pytest.approx(1.4, abs=0.2)  # the runway is at its own height


def test_check_estimates_the_durations(hop: FlightLog) -> None:
    flown = [end - begin for begin, end in (span(hop, number) for number in range(1, 7))]
    estimated = plan(*HOP).leg_durations()
    assert sum(estimated) == pytest.approx(sum(flown), rel=0.15)


@pytest.mark.parametrize(
    ("legs", "words"),
    [
        ([{"type": "take_off", "runway_m": 150.0}], r"leg 1 \(take_off\) failed at .*the aircraft does not take off"),
        (
            [{"type": "take_off", "height_m": 60.0}, {**LAND, "heading_deg": 184.0}],
            r"leg 2 \(land\) failed at .* s of the flight: there is no approach to this runway",
        ),
        (
            [{"type": "taxi", "distance_m": 30.0, "heading_deg": 270.0}],
            r"leg 1 \(taxi\) failed at .*the turn is not finished at the end of distance_m = 30",
        ),
    ],
)
def test_failure_names_phase_time_and_state(legs: list[dict[str, Any]], words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        fly_plan(plan(*legs))
    assert "kt calibrated" in str(refusal.value)


@pytest.mark.slow
def test_engine_without_fuel_does_not_start(tmp_path: Path) -> None:
    text = Path("aircraft/c172x/aircraft.toml").read_text()
    text = text.replace("[model_changes]\n", "[model_changes]\n'.//tank/contents' = \"0\"\n")
    (tmp_path / "aircraft.toml").write_text(text)
    with pytest.raises(InputError, match=r"leg 1 \(taxi\) failed at 9\d\.\d s .*: the engines do not start"):
        fly_plan(plan({"type": "taxi", "distance_m": 50.0}, aircraft=str(tmp_path)))


def test_aircraft_that_cannot_land_is_refused_before_the_flight(tmp_path: Path) -> None:
    text = Path("aircraft/c172x/aircraft.toml").read_text()
    (tmp_path / "aircraft.toml").write_text(text.replace("approach_kt = 65.0\n", ""))
    with pytest.raises(InputError, match=r"flight.legs.4 \(land\): the aircraft .* cannot land"):
        fly_plan(plan(*HOP, aircraft=str(tmp_path)))


def test_runway_above_the_aircraft_is_refused() -> None:
    with pytest.raises(ValueError, match=r"leg 2 \(land\) begins at 360 m, and the runway is at altitude_m = 400"):
        plan({"type": "take_off", "height_m": 60.0}, {**LAND, "altitude_m": 400.0})
