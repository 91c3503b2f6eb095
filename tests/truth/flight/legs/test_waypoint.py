"""Routes of waypoints: heights on the way in closed form, and what the flight makes of them."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from sinssim.earth.geodetic_coordinates import ecef_to_geodetic
from sinssim.errors import InputError
from sinssim.experiments.run.parts.phases import phases_of
from sinssim.truth.flight.flight_log import flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.flight.legs.waypoint import (
    VERTICAL_ACCELERATION,
    HeightPath,
    WaypointLeg,
    at_a_slope,
    passing_slope,
    single_slope,
)

KNOT = 1852.0 / 3600.0
ROUTE = [
    {"name": "ALPHA", "latitude_deg": 48.045, "longitude_deg": 11.0, "height_m": 1160.0},
    {"name": "BRAVO", "latitude_deg": 48.085, "longitude_deg": 11.0, "height_m": 1260.0},
    {"name": "CHARLIE", "latitude_deg": 48.16, "longitude_deg": 11.0, "height_m": 1000.0, "path_deg": 3.0},
]
WIND = {
    "profile": [
        {"height_m": 0.0, "from_deg": 250.0, "speed_mps": 2.0},
        {"height_m": 2000.0, "from_deg": 300.0, "speed_kt": 15.0},
    ]
}


def plan(legs: list[dict[str, Any]], **more: Any) -> FlightPlan:
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 1000.0}
    return FlightPlan.model_validate({"aircraft": "c172x", "start": start, "legs": legs, **more})


PATHS = {
    "climb": single_slope(1000.0, 2000.0, 30e3, 100.0),
    "on": single_slope(1000.0, 2000.0, 30e3, 100.0, 0.01, 0.02),
    "off": single_slope(2000.0, 500.0, 30e3, 100.0, -0.02, 0.0),
    "late": at_a_slope(3000.0, 1000.0, 60e3, 120.0, math.tan(math.radians(3.0))),
    "soon": at_a_slope(1000.0, 3000.0, 60e3, 120.0, 0.06),
    "little": at_a_slope(1010.0, 1000.0, 60e3, 120.0, 0.06),
}


@pytest.mark.parametrize("name", PATHS)
def test_a_path_is_smooth_and_ends_at_the_height(name: str) -> None:
    path = PATHS[name]
    assert path is not None
    ends = {"climb": 2000.0, "on": 2000.0, "off": 500.0, "late": 1000.0, "soon": 3000.0, "little": 1000.0}
    assert path.at(path.end)[0] == pytest.approx(ends[name], abs=1e-6)
    assert path.at(path.end)[1] == pytest.approx(path.slope_after, abs=1e-9)
    left = np.linspace(path.begin - 0.01, path.end, 30_001)
    height, slope = np.array([path.at(float(d)) for d in left]).T
    step = left[0] - left[1]
    assert np.abs(np.gradient(height, step)[1:-1] - slope[1:-1]).max() < path.curvature * step
    assert np.abs(np.diff(slope)).max() <= path.curvature * step * (1.0 + 1e-6)


def test_top_of_descent_lies_where_the_closed_form_says() -> None:
    """Δh/tan γ + tan γ V²/a before the waypoint: half of the parabola's way at either end is lost."""
    path = PATHS["late"]
    assert isinstance(path, HeightPath)
    slope = math.tan(math.radians(3.0))
    assert path.begin == pytest.approx(2000.0 / slope + slope * 120.0**2 / VERTICAL_ACCELERATION, rel=1e-12)


def test_a_way_that_is_too_short_has_no_path() -> None:
    assert at_a_slope(3000.0, 1000.0, 38e3, 120.0, math.tan(math.radians(3.0))) is None
    assert single_slope(1000.0, 3000.0, 2e3, 120.0) is None


@pytest.mark.parametrize(("before", "after", "through"), [(1, 2, 1), (-3, -2, -2), (1, -1, 0), (1, 0, 0)])
def test_a_waypoint_is_passed_with_the_flatter_slope(before: float, after: float, through: float) -> None:
    assert passing_slope(before, after) == through


@pytest.fixture(scope="module")
def flown() -> Any:
    flight = plan([{"type": "waypoint", "waypoints": ROUTE}, {"type": "hold", "duration_s": 20.0}], wind=WIND)
    return flight, flight_log(fly_plan(flight))


def test_waypoints_are_passed_at_their_heights(flown: Any) -> None:
    """Within the capture radius of 500 m and half a second's way of it, and within 3 m of the height."""
    _, log = flown
    latitude, longitude, height = ecef_to_geodetic(log.position_ecef)
    times = {name: next(e.time for e in log.events if e.text.startswith(f"{name} reached")) for name in NAMES}
    for place in ROUTE:
        row = round(times[place["name"]] * 30.0)
        north = (latitude[row] - math.radians(place["latitude_deg"])) * 6.376e6
        east = (longitude[row] - math.radians(place["longitude_deg"])) * 6.389e6 * math.cos(latitude[row])
        assert 450.0 < math.hypot(north, east) < 503.0
        assert height[row] == pytest.approx(place["height_m"], abs=3.0)
    assert np.abs(height[round(times["CHARLIE"] * 30) :] - 1000.0).max() < 3.0  # and held
    climb = np.gradient(height, 1.0 / 30.0)[round(times["ALPHA"] * 30)]
    assert climb > 1.0  # ALPHA is passed in the climb that goes on to BRAVO


NAMES = ("ALPHA", "BRAVO", "CHARLIE")


def test_the_descent_begins_at_its_top_and_has_its_angle(flown: Any) -> None:
    _, log = flown
    latitude, _, height = ecef_to_geodetic(log.position_ecef)
    event = next(e for e in log.events if "top of descent to CHARLIE" in e.text)
    row = round(event.time * 30.0)
    left = (math.radians(48.16) - latitude[row]) * 6.376e6 - 500.0
    slope = math.tan(math.radians(3.0))
    said = re.search(r"([\d.]+) km away", event.text)
    assert said is not None
    assert 1e3 * float(said[1]) == pytest.approx(left, abs=60.0)
    ground = math.sqrt((left - 260.0 / slope) * VERTICAL_ACCELERATION / slope)  # of the closed form above
    assert ground == pytest.approx(53.0, abs=4.0)  # 100 kt calibrated, 54.3 m/s true at 1100 m, headwind of 1 to 2 m/s
    middle = slice(row + 20 * 30, row + 70 * 30)
    way = (latitude[middle][-1] - latitude[middle][0]) * 6.376e6
    assert math.degrees(math.atan2(height[middle][0] - height[middle][-1], way)) == pytest.approx(3.0, abs=0.1)


def test_the_plan_takes_as_long_as_the_flight(flown: Any) -> None:
    flight, log = flown
    assert sum(flight.leg_durations()) == pytest.approx(log.time[-1], rel=0.02)


def test_each_named_waypoint_has_its_phase(flown: Any) -> None:
    _, log = flown
    assert [phase.name for phase in phases_of(log.events)] == [*(f"flight to {name}" for name in NAMES), "flight"]


def test_a_waypoint_too_near_for_its_height_is_named() -> None:
    near = {**ROUTE[2], "height_m": 500.0, "latitude_deg": 48.05}
    with pytest.raises(InputError, match=r"CHARLIE cannot be reached .* path_deg = 3 takes 10.* km; 5.* km are left"):
        fly_plan(plan([{"type": "waypoint", "waypoints": [near]}]))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"waypoints": ROUTE, "latitude_deg": 48.0}, "waypoints and latitude_deg are given"),
        ({"latitude_deg": 48.0}, "give longitude_deg"),
        ({}, "give latitude_deg"),
        ({"latitude_deg": 48.0, "longitude_deg": 11.0, "path_deg": 3.0}, "path_deg needs height_m"),
        ({**ROUTE[2], "vertical_speed_mps": 3.0}, "path_deg and vertical_speed_mps both give the slope"),
    ],
)
def test_incomplete_places_are_refused(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        WaypointLeg(type="waypoint", **keys)


def test_a_leg_accepts_its_own_defaults_written_out() -> None:
    for keys in ({"waypoints": ROUTE}, {"latitude_deg": 48.0, "longitude_deg": 11.0}):
        leg = WaypointLeg.model_validate({"type": "waypoint", **keys})
        assert WaypointLeg.model_validate(leg.model_dump(exclude_none=True)) == leg
