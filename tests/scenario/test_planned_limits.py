"""Plans beyond the limits of the aircraft, and the picture of a plan."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.run.motion_exhibits import plan_charts
from sinssim.recording.figures import figure_of
from sinssim.scenario import planned_limits
from sinssim.scenario.load import load_scenario
from sinssim.scenario.planned_limits import check_limits, findings
from sinssim.scenario.schema import Scenario
from sinssim.truth.aircraft_design import trimmed_envelope as envelope_module
from sinssim.truth.aircraft_design.trimmed_envelope import trimmed_envelope
from sinssim.truth.flight.aircraft import ceiling, climb_rate, descent_rate, load_aircraft, speed_range
from sinssim.truth.flight.flight_plan import planned_path
from sinssim.truth.flight.jsbsim_model import quiet
from sinssim.truth.motions.parked_and_great_circle import GreatCircleFlight


def scenario(
    *legs: dict[str, Any], altitude_m: float = 6000.0, airspeed_kt: float = 280.0, aircraft: str = "737"
) -> Scenario:
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": altitude_m}
    flight = {"aircraft": aircraft, "start": {**start, "airspeed_kt": airspeed_kt}, "legs": list(legs)}
    return Scenario.model_validate({"name": "test", "flight": flight})


PLACE = {"type": "waypoint", "latitude_deg": 48.2, "longitude_deg": 11.0, "name": "ALPHA"}


@pytest.mark.parametrize(
    ("legs", "start", "words"),
    [
        ([{"type": "climb", "altitude_m": 14_000.0}], {}, "altitude_m = 14000 is above the ceiling of the 737 at 280"),
        ([{"type": "hold", "duration_s": 9.0}], {"airspeed_kt": 145.0}, "possible from 154 to 445 kt"),
        ([{"type": "speed", "airspeed_kt": 420.0}], {"altitude_m": 9000.0}, "airspeed_kt = 420.* from 155 to 379 kt"),
        ([{"type": "turn", "heading_deg": 90.0, "bank_deg": 70.0}], {}, "bank_deg = 70 needs 2.9 g.* at most 63"),
        (
            [{"type": "turn", "heading_deg": 90.0, "bank_deg": 50.0}],
            {"airspeed_kt": 180.0},
            "stalls below 192 kt, and it flies at 180 kt: give at most 43",
        ),
        ([{**PLACE, "height_m": 14_000.0}], {}, "ALPHA, height_m = 14000 is above the ceiling"),
        ([{**PLACE, "height_m": 9000.0}], {}, "needs a climb of 43.* m/s; the 737 climbs at 10.8 m/s at most"),
        ([{**PLACE, "height_m": 3000.0, "path_deg": 3.0}], {}, "at path_deg = 3 takes 6.* km; 21.* km are left"),
        ([{"type": "climb", "altitude_m": 12_000.0, "timeout_s": 600.0}], {}, "timeout_s = 600: the climb to 12000 m"),
        (
            [{"type": "descend", "altitude_m": -20.0}],
            {},
            r"ends at -20 m, but the ground is at 0 m.* a greater height",
        ),
        (
            [{"type": "hold", "duration_s": 900.0, "timeout_s": 60.0}],
            {},
            r"takes about 900 s, which is longer than timeout_s = 60\.",
        ),
        (
            [{**PLACE, "latitude_deg": 48.0, "longitude_deg": 11.03}],
            {},
            # Mach 0.606 in air of 249.15 K is 191.7 m/s: v²/(g tan 25°) = 8.04 km
            r"ALPHA lies within the turn towards it, whose radius is 8\.0 km at 280 kt and 25° .* would circle it",
        ),
        (
            [{"type": "climb", "altitude_m": 6500.0}],
            {"aircraft": "c172x", "altitude_m": 1000.0, "airspeed_kt": 90.0},
            "above the ceiling of the c172x at 90 kt, about 4800 m: .* at 60 kt, where it is about 7400 m",
        ),
        (
            [{"type": "hold", "duration_s": 9.0}],
            {"aircraft": "f16", "altitude_m": 14_000.0, "airspeed_kt": 800.0},
            "level flight of the f16 .* from 123 to 764 kt",
        ),
    ],
)
def test_what_cannot_be_flown_is_refused(legs: list[dict[str, Any]], start: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_limits(scenario(*legs, **start))


def test_the_ground_is_at_the_height_of_the_runway() -> None:
    """A descent to this height is refused, one to a metre above it is not."""
    start = {"on": "runway", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 400.0}
    for altitude, refused in ((400.0, True), (401.0, False)):
        legs = [
            {"type": "takeoff"},
            {"type": "climb", "altitude_m": 1500.0},
            {"type": "descend", "altitude_m": altitude},
        ]
        flight = {"aircraft": "737", "start": start, "legs": legs}
        found = findings(Scenario.model_validate({"name": "test", "flight": flight}))
        assert [one.text.partition(". ")[0] for one in found if one.refused] == (
            ["flight.legs.3 (descend) ends at 400 m, but the ground is at 400 m"] if refused else []
        )


@pytest.mark.parametrize(
    ("leg", "words"),
    [
        ({"type": "climb", "altitude_m": 9000.0, "vertical_speed_mps": 20.0}, "climbs at 10.* m/s at most at 9000 m"),
        ({"type": "descend", "altitude_m": 3000.0, "vertical_speed_mps": 20.0}, "descends at 13.* m/s at 280 kt"),
        ({**PLACE, "latitude_deg": 48.5, "height_m": 500.0}, "needs 2.* m/s.* faster descent increases its airspeed"),
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
    assert speed_range(envelope, 6000.0)[0] == pytest.approx(154.0, abs=1.0)  # flown: stalled at 154 kt


def test_limits_of_the_other_aircraft_are_those_of_flights() -> None:
    """Flown: the Cessna with full throttle at 62.6 kt (2.75 m/s) and 83 kt (3.06 m/s) at 3000 m; 123 kt at 1000 m."""
    envelope = load_aircraft("c172x").envelope
    assert envelope is not None
    assert climb_rate(envelope, 3000.0, 62.6) == pytest.approx(2.75, abs=0.05)
    assert climb_rate(envelope, 3000.0, 83.0) == pytest.approx(3.06, abs=0.15)  # interpolated over 10 kt
    assert speed_range(envelope, 1000.0)[1] == pytest.approx(123.0, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("aircraft", "heights", "speeds", "steepest"),
    [
        ("737", [6000.0, 7500.0], [280.0, 320.0], 30.0),
        ("c172x", [3000.0, 4000.0], [70.0, 90.0], 30.0),
        ("f16", [8000.0, 10_000.0], [350.0, 400.0], 75.0),
    ],
)
def test_the_table_is_that_of_the_model(
    aircraft: str, heights: list[float], speeds: list[float], steepest: float
) -> None:
    """Trimmed again; nine bisections resolve 0.06° up to 30° and 0.15° up to 75°: 0.15 m/s at 150, 0.6 at 240 m/s."""
    declared = load_aircraft(aircraft).envelope
    assert declared is not None
    again = trimmed_envelope(aircraft, heights, speeds, steepest)
    near = 0.3 if steepest == 30.0 else 1.2
    for row, height in enumerate(again.height_m):
        for column, speed in enumerate(again.airspeed_kt):
            assert climb_rate(declared, height, speed) == pytest.approx(again.climb_mps[row][column], abs=near)
            assert descent_rate(declared, height, speed) == pytest.approx(again.descent_mps[row][column], abs=near)


@pytest.mark.slow
def test_a_trim_that_spoils_the_model_spoils_no_other() -> None:
    """Level flight at 120 kt and 1500 m leaves the Cessna's propeller without a speed (NaN), and its tanks empty."""
    with quiet(), envelope_module.TrimmedModel("c172x", 30.0) as model:
        assert not model.flies(1500.0, 120.0, 0.0)
        assert model.flies(1500.0, 60.0, 0.0)


def test_the_planned_path_takes_the_legs_in_order() -> None:
    plan = load_scenario("gate_to_gate")
    assert plan.flight is not None
    path = planned_path(plan.flight)
    assert path.time[-1] == pytest.approx(sum(plan.flight.leg_durations()), rel=1e-12)
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


def test_the_ceiling_of_a_planned_path_is_that_of_its_airspeed() -> None:
    """A leg that accelerates from 250 to 300 kt: the ceiling of the first and of the last point."""
    plan = scenario({"type": "speed", "airspeed_kt": 300.0}, airspeed_kt=250.0).flight
    assert plan is not None
    envelope = load_aircraft(plan.aircraft).envelope
    assert envelope is not None
    path = planned_path(plan)
    assert path.ceiling[0] == pytest.approx(ceiling(envelope, 250.0))
    assert path.ceiling[-1] == pytest.approx(ceiling(envelope, 300.0))


@pytest.mark.parametrize("name", ["waypoint_route", "drive", "parked"])
def test_the_picture_shows_map_height_and_speed(name: str) -> None:
    figure = figure_of(plan_charts(load_scenario(name)))
    places, heights, speeds = figure.axes
    assert places.get_title(loc="left") == "Map"
    assert heights.get_title(loc="left").startswith("Height")
    assert "speed" in speeds.get_title(loc="left")
    words = {text.get_text() for text in places.texts}
    if name == "waypoint_route":
        assert {"ALPHA", "BRAVO", "CHARLIE", "DELTA", "start"} <= words
        assert any("ceiling" in text.get_text() for text in heights.get_legend().get_texts())
    if name == "parked":
        assert any("at rest at 50.00000°" in word for word in words)


def test_recorded_sensors_have_no_plan() -> None:
    with pytest.raises(InputError, match="a motion in a vertical plane: there is no plan to draw"):
        plan_charts(load_scenario("one_component"))


def test_a_great_circle_over_the_pole() -> None:
    """From 60° N, 90° E to the north for 60°: over the pole, and to 60° N, 90° W."""
    circle = GreatCircleFlight.model_validate(
        {"latitude_deg": 60.0, "longitude_deg": 90.0, "course_deg": 0.0, "speed_mps": 200.0,
         "duration_s": math.pi / 3.0 * planned_limits.RADIUS / 200.0}
    )  # fmt: skip
    over, *ends = planned_limits._on_circle(circle, np.array([0.0, 0.0, 1.0]))
    assert over.latitude == pytest.approx(math.pi / 2.0, abs=1e-7)
    assert over.when == f"at t = {math.pi / 6.0 * planned_limits.RADIUS / 200.0:.0f} s"
    assert sorted(round(math.degrees(end.longitude), 6) for end in ends) == [-90.0, 90.0]
    assert [end.latitude for end in ends] == pytest.approx([math.pi / 3.0] * 2)
