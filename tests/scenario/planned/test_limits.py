"""Plans beyond the limits of the aircraft, and the picture of a plan."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.recording.figures.plan import plan_figure
from sinssim.scenario.duration import leg_durations
from sinssim.scenario.load import load_scenario
from sinssim.scenario.planned.limits import check_limits, findings
from sinssim.scenario.planned.path import planned_path
from sinssim.scenario.schema import Scenario
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.planning.envelope import ceiling, climb_rate, descent_rate, speed_range
from sinssim.truth.flight.planning.trim import trimmed_envelope


def scenario(*legs: dict[str, Any], altitude_m: float = 6000.0, airspeed_kt: float = 280.0) -> Scenario:
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": altitude_m}
    flight = {"aircraft": "737", "start": {**start, "airspeed_kt": airspeed_kt}, "legs": list(legs)}
    return Scenario.model_validate({"name": "test", "flight": flight})


PLACE = {"type": "waypoint", "latitude_deg": 48.2, "longitude_deg": 11.0, "name": "ALPHA"}


@pytest.mark.parametrize(
    ("legs", "start", "words"),
    [
        ([{"type": "climb", "altitude_m": 14_000.0}], {}, "altitude_m = 14000 is above the ceiling of the 737 at 280"),
        ([{"type": "hold", "duration_s": 9.0}], {"airspeed_kt": 150.0}, "possible from 188 to 445 kt"),
        ([{"type": "speed", "airspeed_kt": 420.0}], {"altitude_m": 9000.0}, "airspeed_kt = 420.* from 190 to 379 kt"),
        ([{"type": "turn", "heading_deg": 90.0, "bank_deg": 70.0}], {}, "bank_deg = 70 needs 2.9 g.* at most 63"),
        (
            [{"type": "turn", "heading_deg": 90.0, "bank_deg": 50.0}],
            {"airspeed_kt": 200.0},
            "stalls below 235 kt, and it flies at 200 kt: give at most 28",
        ),
        ([{**PLACE, "height_m": 14_000.0}], {}, "ALPHA, height_m = 14000 is above the ceiling"),
        ([{**PLACE, "height_m": 9000.0}], {}, "needs a climb of 43.* m/s; the 737 climbs at 10.8 m/s at most"),
        ([{**PLACE, "height_m": 3000.0, "path_deg": 3.0}], {}, "at path_deg = 3 takes 6.* km; 21.* km are left"),
        ([{"type": "climb", "altitude_m": 12_000.0, "timeout_s": 600.0}], {}, "timeout_s = 600: the climb to 12000 m"),
    ],
)
def test_what_cannot_be_flown_is_refused(legs: list[dict[str, Any]], start: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_limits(scenario(*legs, **start))


@pytest.mark.parametrize(
    ("leg", "words"),
    [
        ({"type": "climb", "altitude_m": 9000.0, "vertical_speed_mps": 20.0}, "climbs at 10.* m/s at most at 9000 m"),
        ({"type": "descend", "altitude_m": 3000.0, "vertical_speed_mps": 20.0}, "descends at 13.* m/s at 280 kt"),
        ({**PLACE, "latitude_deg": 48.5, "height_m": 500.0}, "needs 2.* m/s.* it will fly faster"),
    ],
)
def test_what_is_flown_otherwise_is_noted(leg: dict[str, Any], words: str) -> None:
    (found,) = findings(scenario(leg))
    assert not found.refused
    assert re.search(words, found.text), found.text


@pytest.mark.parametrize("name", ["first_flight", "gate_to_gate", "waypoint_route", "aided_airliner", "trainer"])
def test_the_shipped_plans_are_within_the_limits(name: str) -> None:
    assert list(findings(load_scenario(name))) == []


def test_limits_are_those_of_flights() -> None:
    """Flown: fastest level flight at 9000 m 380 kt; a climb at 280 kt came to 12 832 m and 273 kt in 15 minutes.

    The table has a step of 1500 m, between which the ceiling is interpolated.
    """
    envelope = load_aircraft("737").envelope
    assert envelope is not None
    assert speed_range(envelope, 9000.0)[1] == pytest.approx(380.0, abs=3.0)
    assert ceiling(envelope, 273.0, 0.0) == pytest.approx(12_832.0, rel=0.02)
    assert climb_rate(envelope, 6000.0, 280.0) == pytest.approx(16.7, abs=0.1)
    assert descent_rate(envelope, 0.0, 280.0) > 0.0


@pytest.mark.slow
def test_the_table_is_that_of_the_model() -> None:
    """Trimmed again at two points; the bisection resolves 0.06°, 0.15 m/s."""
    declared = load_aircraft("737").envelope
    assert declared is not None
    again = trimmed_envelope("737", [6000.0, 7500.0], [280.0, 320.0])
    for row, height in enumerate(again.height_m):
        for column, speed in enumerate(again.airspeed_kt):
            assert climb_rate(declared, height, speed) == pytest.approx(again.climb_mps[row][column], abs=0.3)
            assert descent_rate(declared, height, speed) == pytest.approx(again.descent_mps[row][column], abs=0.3)


def test_the_planned_path_takes_the_legs_in_order() -> None:
    plan = load_scenario("gate_to_gate")
    assert plan.flight is not None
    path = planned_path(plan.flight)
    assert path.time[-1] == pytest.approx(sum(leg_durations(plan.flight)), rel=1e-12)
    assert np.all(np.diff(path.time) >= 0.0)
    assert [name.split()[1] for name, _, _ in path.legs] == [leg.type for leg in plan.flight.legs]
    assert max(path.height) == pytest.approx(3500.0)


def test_a_turn_is_drawn_as_a_circle() -> None:
    plan = scenario({"type": "turn", "angle_deg": 360.0, "direction": "right", "bank_deg": 30.0}).flight
    assert plan is not None
    path = planned_path(plan)
    north = (np.array(path.latitude) - math.radians(48.0)) * 6371e3
    east = (np.array(path.longitude) - math.radians(11.0)) * 6371e3 * math.cos(math.radians(48.0))
    radius = 0.5 * np.ptp(north)
    assert np.hypot(north, east - radius) == pytest.approx(np.full(len(north), radius), rel=0.01)


@pytest.mark.parametrize("name", ["waypoint_route", "drive", "parked"])
def test_the_picture_shows_map_height_and_speed(name: str) -> None:
    figure = plan_figure(load_scenario(name))
    places, heights, speeds = figure.axes
    assert places.get_title(loc="left") == "Map"
    assert heights.get_title(loc="left").startswith("Height")
    assert "speed" in speeds.get_title(loc="left")
    words = {text.get_text() for text in places.texts}
    if name == "waypoint_route":
        assert {"ALPHA", "BRAVO", "CHARLIE", "DELTA", "start"} <= words
        assert any("ceiling" in text.get_text() for text in heights.texts)
    if name == "parked":
        assert any("at rest at 50.00000°" in word for word in words)


def test_recorded_sensors_have_no_plan() -> None:
    with pytest.raises(InputError, match="a motion in a vertical plane: there is no plan to draw"):
        plan_figure(load_scenario("one_component"))
