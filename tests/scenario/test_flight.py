"""Flight sections: what is accepted, what is refused, and in which words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from sinssim.content import list_content
from sinssim.errors import InputError
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.legs.turns import TurnLeg

AIR = {"on": "air", "latitude_deg": 50.0, "longitude_deg": 10.0, "altitude_m": 3000.0}
RUNWAY = {"on": "runway", "latitude_deg": 50.0, "longitude_deg": 10.0}

LEGS: list[dict[str, Any]] = [
    {"type": "hold", "duration_s": 10},
    {"type": "hold", "until_s": 100.0},
    {"type": "climb", "altitude_m": 4000.0},
    {"type": "descend", "altitude_m": 2000.0, "vertical_speed_mps": 5.0},
    {"type": "turn", "heading_deg": 90.0},
    {"type": "turn", "angle_deg": 720.0, "direction": "left", "bank_deg": 30.0},
    {"type": "waypoint", "latitude_deg": 51.0, "longitude_deg": 11.0, "capture_radius_m": 200.0},
    {"type": "racetrack", "leg_duration_s": 60.0, "laps": 2},
    {"type": "racetrack", "leg_length_m": 10000.0, "direction": "left"},
    {"type": "s_turns", "turns": 4, "swing_deg": 45.0},
    {"type": "s_turns", "duration_s": 120.0},
    {"type": "speed", "airspeed_kt": 250.0},
    {"type": "doublet", "control": "aileron", "amplitude": -0.2, "shape": "step"},
    {"type": "loop"},
    {"type": "barrel_roll", "direction": "left"},
]


def section(legs: list[dict[str, Any]], start: dict[str, Any] = AIR, **more: Any) -> FlightPlan:
    return FlightPlan.model_validate({"aircraft": "737", "start": start, "legs": legs, **more})


@pytest.mark.parametrize("leg", LEGS, ids=lambda leg: "-".join(map(str, leg.values())))
def test_every_leg_is_known_by_its_type(leg: dict[str, Any]) -> None:
    (made,) = section([leg]).legs
    assert made.type == leg["type"]
    assert made.timeout_s > 0.0
    for key, value in leg.items():
        assert getattr(made, key) == value


def test_sections_cannot_be_changed() -> None:
    flight = section(LEGS)
    with pytest.raises(ValidationError):
        flight.aircraft = "f16"
    assert isinstance(flight.legs, tuple)


@pytest.mark.parametrize(
    ("legs", "words"),
    [
        ([], "at least one leg"),
        ([{"type": "hold"}], "exactly one of them"),
        ([{"type": "hold", "duration_s": 1.0, "until_s": 2.0}], "duration_s or at until_s"),
        ([{"type": "hold", "duration_s": -1.0}], "greater than 0"),
        ([{"type": "turn"}], "a turn needs heading_deg or angle_deg"),
        ([{"type": "turn", "angle_deg": 90.0}], 'needs direction = "left" or "right"'),
        ([{"type": "turn", "heading_deg": 90.0, "bank_deg": 95.0}], "less than or equal to 80"),
        ([{"type": "waypoint", "latitude_deg": 91.0, "longitude_deg": 0.0}], "less than or equal to 90"),
        ([{"type": "racetrack"}], "leg_duration_s or leg_length_m"),
        ([{"type": "s_turns"}], "after turns or after duration_s"),
        ([{"type": "climb", "altitude_m": 4000.0, "speed_kt": 3.0}], "Extra inputs are not permitted"),
        ([{"type": "climb", "altitude_m": "4000"}], "valid number"),
        ([{"type": "climb", "altitude_m": 2000.0}], r"leg 1 \(climb\) goes down, from 3000 m to altitude_m = 2000"),
        ([LEGS[2], {"type": "descend", "altitude_m": 5000.0}], r"leg 2 \(descend\) goes up, from 4000 m to .* = 5000"),
        ([{"type": "climb", "altitude_m": float("nan")}], "finite number"),
        ([{"type": "hower", "duration_s": 1.0}], "does not match any of the expected tags"),
        ([{"type": "takeoff"}], "needs the aircraft at rest on a runway"),
    ],
)
def test_what_is_wrong_is_said(legs: list[dict[str, Any]], words: str) -> None:
    with pytest.raises(ValidationError, match=words) as refusal:
        section(legs)
    assert refusal.value.error_count() == 1


def test_flight_from_a_runway_takes_off_before_anything_else() -> None:
    section([{"type": "parked", "duration_s": 5.0}, {"type": "takeoff"}, {"type": "loop"}], RUNWAY)
    with pytest.raises(ValidationError, match=r"leg 2 \(turn\) would begin on the runway"):
        section([{"type": "parked", "duration_s": 5.0}, {"type": "turn", "heading_deg": 1.0}], RUNWAY)
    with pytest.raises(ValidationError, match=r"leg 2 \(parked\) needs the aircraft at rest"):
        section([{"type": "takeoff"}, {"type": "parked", "duration_s": 5.0}], RUNWAY)


def test_unknown_aircraft_lists_those_there_are() -> None:
    with pytest.raises(ValidationError, match=r"unknown aircraft 'f61'. Did you mean 'f16'\? Known: .*737.*c172x.*f16"):
        FlightPlan.model_validate({"aircraft": "f61", "start": AIR, "legs": LEGS})


def test_gust_and_turbulence() -> None:
    flight = section(
        LEGS,
        wind={"north_mps": -5, "gusts": [{"start_s": 3.0, "velocity_ned_mps": [1.0, 2.0, 3.0]}]},
        turbulence={"severity": 4},
    )
    assert flight.wind.gusts[0].velocity_ned_mps == (1.0, 2.0, 3.0)
    assert flight.turbulence is not None
    with pytest.raises(ValidationError, match="less than or equal to 7"):
        section(LEGS, turbulence={"severity": 8})


@pytest.mark.parametrize("name", ["737", "c172x", "f16"])
def test_aircraft_that_come_with_the_package(name: str) -> None:
    assert name in list_content("aircraft")
    aircraft = load_aircraft(name)
    assert aircraft.jsbsim_model == name
    performance = aircraft.performance
    assert performance.takeoff_kt < performance.initial_climb_kt < performance.cruise_kt


def test_own_aircraft_with_a_mistake_names_file_and_key(tmp_path: Path) -> None:
    text = Path("aircraft/737/aircraft.toml").read_text()
    for wrong, words in (
        (text.replace("bank_deg", "bonk_deg"), "bonk_deg"),
        (text.replace("cruise_kt = 280.0", 'cruise_kt = "280"'), "cruise_kt"),
        (text.replace("[mounting]", "[mounting"), "aircraft.toml"),
    ):
        (tmp_path / "aircraft.toml").write_text(wrong)
        with pytest.raises(InputError, match=words) as refusal:
            load_aircraft(str(tmp_path))
        assert str(tmp_path / "aircraft.toml") in str(refusal.value)


def test_turn_takes_integers_for_numbers() -> None:
    assert TurnLeg.model_validate({"type": "turn", "heading_deg": 90}).heading_deg == 90.0
