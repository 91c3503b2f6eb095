"""Estimated durations against what the legs say themselves and the closed forms of steady flight."""

from __future__ import annotations

import math
from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.logs.log_settings import Log
from sinssim.scenario.plan_summary import plan_lines
from sinssim.scenario.planned_limits import check_times, expected_duration
from sinssim.scenario.schema import Scenario
from sinssim.truth.flight.flight_plan import FlightPlan

# At sea level calibrated and true airspeed are the same.
START = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 0.0, "altitude_m": 0.0, "heading_deg": 350.0}
SPEED = 200.0 * 1852.0 / 3600.0  # m/s


def flight(*legs: dict[str, Any], airspeed_kt: float = 200.0) -> FlightPlan:
    start = {**START, "airspeed_kt": airspeed_kt}
    return FlightPlan.model_validate({"aircraft": "737", "start": start, "legs": legs})


def circle(bank_deg: float) -> float:
    """Return the time of a level circle, 2πV/(g tan bank)."""
    return 2.0 * math.pi * SPEED / (9.80665 * math.tan(math.radians(bank_deg)))


@pytest.mark.parametrize(
    ("leg", "seconds"),
    [
        ({"type": "hold", "duration_s": 12.0}, 12.0),
        ({"type": "hold", "until_s": 34.0}, 34.0),
        ({"type": "climb", "altitude_m": 1000.0, "vertical_speed_mps": 10.0}, 100.0),
        ({"type": "turn", "angle_deg": 360.0, "direction": "left", "bank_deg": 30.0}, circle(30.0)),
        ({"type": "turn", "heading_deg": 80.0, "bank_deg": 30.0}, circle(30.0) / 4),
        ({"type": "turn", "heading_deg": 80.0, "direction": "left", "bank_deg": 30.0}, circle(30.0) * 3 / 4),
        ({"type": "racetrack", "leg_duration_s": 60.0, "bank_deg": 20.0, "laps": 2}, 240.0 + 2 * circle(20.0)),
        ({"type": "racetrack", "leg_length_m": 60 * SPEED, "bank_deg": 20.0}, 120.0 + circle(20.0)),
        ({"type": "doublet", "control": "rudder", "amplitude": 0.1, "duration_s": 2.0, "recovery_s": 5.0}, 9.0),
        (
            {"type": "doublet", "control": "rudder", "amplitude": 0.1, "duration_s": 2.0, "shape": "step"},
            12.0,
        ),
        ({"type": "barrel_roll", "duration_s": 8.0, "recovery_s": 4.0}, 12.0),
    ],
)
def test_leg(leg: dict[str, Any], seconds: float) -> None:
    assert flight(leg).leg_durations() == [pytest.approx(seconds, rel=1e-3)]


def test_legs_follow_one_another() -> None:
    durations = flight(
        {"type": "turn", "heading_deg": 80.0, "bank_deg": 30.0},
        {"type": "turn", "angle_deg": 90.0, "direction": "right", "bank_deg": 30.0},
        {"type": "turn", "heading_deg": 260.0, "bank_deg": 30.0},
        {"type": "hold", "until_s": 400.0},
    ).leg_durations()
    quarter = pytest.approx(circle(30.0) / 4, rel=1e-3)
    assert durations[:3] == [quarter, quarter, quarter]
    assert sum(durations) == pytest.approx(400.0)


def test_true_airspeed_grows_with_height() -> None:
    """A jet climbs at 300 kt and then at Mach 0.78; both are the same at 29 314 ft, as manuals have it."""
    height, airspeed_kt, mach = 29_314.0 * 0.3048, 300.0, 0.78
    sound = math.sqrt(1.4 * 287.053 * (288.15 - 0.0065 * height))
    high = FlightPlan.model_validate(
        {
            "aircraft": "737",
            "start": {**START, "altitude_m": height, "airspeed_kt": airspeed_kt},
            "legs": [{"type": "turn", "angle_deg": 360.0, "direction": "left", "bank_deg": 30.0}],
        }
    )
    assert high.leg_durations()[0] == pytest.approx(circle(30.0) * mach * sound / SPEED, rel=5e-3)


A_DEGREE = 111_195.0  # of the equator, on the sphere of the Earth's mean radius, m
RADIUS = SPEED**2 / (9.80665 * math.tan(math.radians(30.0)))  # of a turn at 30°


def eastward(*legs: dict[str, Any], wind: dict[str, float] | None = None) -> list[float]:
    """Return the durations of legs that begin on the equator with the heading 90°."""
    start = {**START, "airspeed_kt": 200.0, "heading_deg": 90.0}
    section = {"aircraft": "737", "start": start, "legs": legs, "wind": wind or {}}
    return FlightPlan.model_validate(section).leg_durations()


def waypoint(longitude: float, latitude: float = 0.0) -> dict[str, Any]:
    return {"type": "waypoint", "latitude_deg": latitude, "longitude_deg": longitude, "capture_radius_m": 1000.0}


def test_a_waypoint_straight_ahead() -> None:
    assert eastward(waypoint(1.0)) == [pytest.approx((A_DEGREE - 1000.0) / SPEED, rel=1e-4)]


def test_a_waypoint_behind_other_legs_is_reached_from_where_they_lead() -> None:
    """It counted as nothing when another leg stood before it."""
    there = (A_DEGREE - 1000.0) / SPEED
    hold = {"type": "hold", "duration_s": 300.0}
    assert eastward(hold, waypoint(1.0)) == [300.0, pytest.approx(there - 300.0, rel=1e-3)]
    # round in a circle, and on as if nothing had been
    circle_ = {"type": "turn", "angle_deg": 360.0, "direction": "left", "bank_deg": 30.0}
    assert eastward(circle_, waypoint(1.0))[1] == pytest.approx(there, rel=1e-3)
    loop = {"type": "loop", "recovery_s": 0.0}
    assert eastward(loop, waypoint(1.0))[1] == pytest.approx(there, rel=1e-3)
    racetrack = {"type": "racetrack", "leg_duration_s": 60.0}
    assert eastward(racetrack, waypoint(1.0))[1] == pytest.approx(there, rel=1e-3)
    # four swings of ±60° lead ahead by sin 60°/60° of what is flown
    swings = {"type": "s_turns", "swing_deg": 60.0, "turns": 4, "bank_deg": 30.0}
    swung, left = eastward(swings, waypoint(1.0))
    assert swung == pytest.approx(4 * circle(30.0) / 3.0, rel=1e-3)
    assert left == pytest.approx(there - swung * math.sin(math.pi / 3) / (math.pi / 3), rel=1e-3)


def test_a_climb_leads_ahead_faster_and_faster() -> None:
    """Up to 5 km, where the density is 0.6009 of that at sea level; the mean of both speeds on the way."""
    high = SPEED / math.sqrt(0.6009)
    climb, left = eastward({"type": "climb", "altitude_m": 5000.0, "vertical_speed_mps": 25.0}, waypoint(1.0))
    assert climb == pytest.approx(200.0)
    # compressible flow takes 1 % of the speed there
    assert left == pytest.approx((A_DEGREE - 1000.0 - 200.0 * 0.5 * (SPEED + high)) / high, rel=2e-2)


def test_a_waypoint_aside_begins_with_a_turn() -> None:
    """Due north of an eastward start: a quarter circle and a bit, whose end the way is tangent to."""
    seconds = eastward({**waypoint(0.0, 1.0), "bank_deg": 30.0})[0]
    # the tangent from (0, A) to the circle about (0, r), from where the turn of 90° + a ends; sin a = r/(A − r)
    beyond = math.asin(RADIUS / (A_DEGREE - RADIUS))
    way = RADIUS * (math.pi / 2 + beyond) + (A_DEGREE - RADIUS) * math.cos(beyond) - 1000.0
    assert seconds == pytest.approx(way / SPEED, rel=1e-3)


def test_from_one_waypoint_to_the_next() -> None:
    """Past the first, whose radius ends it 1 km before the place, straight on to the second."""
    assert eastward(waypoint(1.0), waypoint(2.0))[1] == pytest.approx(A_DEGREE / SPEED, rel=1e-3)
    assert eastward(waypoint(1.0), waypoint(1.0))[1] == pytest.approx(0.0, abs=1e-6)


def test_the_wind_helps_and_hinders() -> None:
    """A tail wind adds to the speed; against a cross wind the aircraft heads up and makes good the rest."""
    way = A_DEGREE - 1000.0
    assert eastward(waypoint(1.0), wind={"east_mps": 30.0}) == [pytest.approx(way / (SPEED + 30.0), rel=1e-3)]
    across = eastward(waypoint(1.0), wind={"north_mps": 50.0})[0]
    assert across == pytest.approx(way / math.sqrt(SPEED**2 - 50.0**2), rel=5e-3)
    drifted = eastward({"type": "hold", "duration_s": 500.0}, waypoint(1.0), wind={"east_mps": -20.0})[1]
    assert drifted == pytest.approx((way - 500.0 * (SPEED - 20.0)) / (SPEED - 20.0), rel=1e-3)


def test_a_wind_that_keeps_a_waypoint_out_of_reach() -> None:
    slow = {**START, "airspeed_kt": 100.0, "heading_deg": 90.0}
    section = {"aircraft": "c172x", "start": slow, "legs": [waypoint(1.0)], "wind": {"east_mps": -60.0}}
    with pytest.raises(
        InputError, match=r"flight\.legs\.1 \(waypoint\) cannot be flown: the wind of 0 m/s north and -60"
    ):
        FlightPlan.model_validate(section).leg_durations()


def test_parked_and_great_circle_last_as_long_as_they_say() -> None:
    parked = Scenario.model_validate({"name": "p", "parked": {"latitude_deg": 90.0, "duration_s": 321.0}})
    assert expected_duration(parked) == 321.0
    circle_ = {"latitude_deg": 0.0, "course_deg": 45.0, "speed_mps": 200.0, "duration_s": 4000.0}
    route = Scenario.model_validate({"name": "c", "great_circle": circle_, "imu": {"rate_hz": 50.0}})
    assert expected_duration(route) == 4000.0
    lines = list(plan_lines(route))
    assert "duration    about 1 h 7 min, 200,000 samples" in lines
    assert lines[1].startswith("great circle  latitude_deg = 0, course_deg = 45, speed_mps = 200")


def sensed(imu: dict[str, Any], **source: Any) -> Scenario:
    parked = {"parked": {"latitude_deg": 50.0, "duration_s": 100.0}}
    return Scenario.model_validate({"name": "sensed", "imu": imu, **(source or parked)})


@pytest.mark.parametrize(
    ("imu", "message"),
    [
        (
            {"faults": [{"type": "dropout", "from_s": 100.0}]},
            r"imu\.faults\.1\.from_s = 100 lies outside the run, which lasts 100 s",
        ),
        (
            {"faults": [{"type": "freeze", "from_s": 0.0}, {"type": "spike", "at_s": 100.5, "gyro_arcsec": [1, 0, 0]}]},
            r"imu\.faults\.2\.at_s = 100\.5 lies outside the run, which lasts 100 s",
        ),
        ({"rate_hz": 1e-3}, r"imu\.rate_hz = 0\.001 gives no sample in a run that lasts 100 s; at least 0\.01 would"),
    ],
)
def test_sensors_that_do_not_suit_the_run(imu: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        check_times(sensed(imu))


@pytest.mark.parametrize(
    ("within", "beyond"),
    [
        ({"rate_hz": 0.01}, {"rate_hz": 0.0099}),
        (
            {"faults": [{"type": "spike", "at_s": 100.0, "gyro_arcsec": [1.0, 0.0, 0.0]}]},
            {"faults": [{"type": "spike", "at_s": 100.001, "gyro_arcsec": [1.0, 0.0, 0.0]}]},
        ),
        (
            {"faults": [{"type": "dropout", "from_s": 99.999, "to_s": 1e6}]},
            {"faults": [{"type": "dropout", "from_s": 100.0, "to_s": 1e6}]},
        ),
    ],
)
def test_the_limits_of_what_suits_a_run(within: dict[str, Any], beyond: dict[str, Any]) -> None:
    """One sample in 100 s; a spike at the last instant; a dropout that begins before it, however long it lasts."""

    def suits(imu: dict[str, Any]) -> bool:
        try:
            check_times(sensed(imu))
        except InputError:
            return False
        return True

    assert suits(within)
    assert not suits(beyond)


def test_a_fault_may_lie_where_a_flight_may_still_be() -> None:
    """Of an estimated 1000 s twice as much and ten minutes."""
    start = {**START, "airspeed_kt": 200.0}

    def flown(begin: float, *legs: dict[str, Any]) -> Scenario:
        imu = {"faults": [{"type": "dropout", "from_s": begin}]}
        return sensed(imu, flight={"aircraft": "737", "start": start, "legs": legs})

    hold = {"type": "hold", "duration_s": 1000.0}
    check_times(flown(2599.0, hold))
    with pytest.raises(InputError, match=r"from_s = 2601 lies outside the run, which lasts about 1000 s"):
        check_times(flown(2601.0, hold))


def test_more_samples_than_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 1000}.__getitem__)
    with pytest.raises(InputError, match=r"rate_hz = 1000 makes 1e\+05 samples .* Use at most 46.5\."):
        check_times(sensed({"rate_hz": 1000.0}))
    check_times(sensed({"rate_hz": 46.5}))


def test_a_part_of_a_log_lasts_from_its_beginning_to_its_end() -> None:
    for begin, lasts in ((None, 90.0), (25.5, 64.5)):
        log = Log.model_validate({"imu": {"file": "imu.csv"}, "from_s": begin, "to_s": 90.0})
        scenario = Scenario(name="x", log=log, imu={"grade": "tactical"})
        assert expected_duration(scenario) == lasts
    endless = scenario.model_copy(update={"log": Log.model_validate({"imu": {"file": "imu.csv"}})})
    with pytest.raises(InputError, match="whose duration is known when their files are read"):
        expected_duration(endless)
