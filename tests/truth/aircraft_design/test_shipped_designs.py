"""Aircraft that come with the package as `sinssim aircraft add` made them: their acceptance flight, and a scenario."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim.content import list_content
from sinssim.toml_mistakes import read_toml
from sinssim.truth.aircraft_design.acceptance_flight import acceptance_height, fly_acceptance
from sinssim.truth.flight.aircraft import load_aircraft, speed_range
from sinssim.truth.flight.flight_log import flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.flight.leg import not_attained

DESIGNED = [
    name for name, file in list_content("aircraft").items() if file.read_text(encoding="utf-8").startswith("# Made by")
]


def test_their_limits_fit_together() -> None:
    """Cruise lies between the ends of level flight at the lowest height, usual rates below the largest."""
    assert {"A320", "787-8", "f15", "T38", "B747", "Concorde", "DHC6", "J3Cub", "sgs233"} <= set(DESIGNED)
    for name in DESIGNED:
        aircraft = load_aircraft(name)
        performance, envelope = aircraft.performance, aircraft.envelope
        assert envelope is not None
        slow, fast = speed_range(envelope, 1000.0)
        assert slow < performance.cruise_kt < fast
        assert performance.takeoff_kt < performance.initial_climb_kt < performance.cruise_kt
        assert performance.climb_mps < max(max(row) for row in envelope.climb_mps) or performance.glider
        assert read_toml(list_content("aircraft")[name])[1]["jsbsim_model"] == name


def test_the_flight_is_at_the_height_of_the_design() -> None:
    for name, file in list_content("aircraft").items():
        if name in DESIGNED:
            assert f"designed at {acceptance_height(load_aircraft(name)):.0f} m." in file.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNED)
def test_they_fly_their_acceptance_plan(name: str) -> None:
    assert not [
        words
        for leg in fly_acceptance(name, load_aircraft(name).performance, acceptance_height(load_aircraft(name)))
        if (words := leg.excess())
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNED)
def test_they_fly_a_scenario_with_wind_and_turbulence(name: str) -> None:
    """S-turns, a racetrack's half circles and a climb in 15 kt of wind and light turbulence attain their targets."""
    start: dict[str, Any] = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0}
    start["altitude_m"] = height = min(2500.0, acceptance_height(load_aircraft(name)))
    glider = load_aircraft(name).performance.glider
    legs = [
        {"type": "s_turns", "turns": 2},
        {"type": "descend", "altitude_m": height - 700.0}
        if glider
        else {"type": "climb", "altitude_m": height + 300.0},
        {"type": "turn", "heading_deg": 180.0},
        {"type": "hold", "duration_s": 60.0},
    ]
    plan = FlightPlan.model_validate(
        {
            "aircraft": name, "start": start, "legs": legs, "wind": {"from_deg": 240.0, "speed_kt": 15.0},
            "turbulence": {"severity": 3},
        }
    )  # fmt: skip
    log = flight_log(fly_plan(plan, 1))
    assert not_attained(log.events) == []
    assert log.time[-1] < 900.0
