"""Estimated durations against what the legs say themselves and the closed forms of steady flight."""

from __future__ import annotations

import math
from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.scenario.duration import check_times, expected_duration, leg_durations
from sinssim.scenario.legs import FlightSection
from sinssim.scenario.schema import Scenario
from sinssim.scenario.summary import plan_lines

# At sea level calibrated and true airspeed are the same.
START = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 0.0, "altitude_m": 0.0, "heading_deg": 350.0}
SPEED = 200.0 * 1852.0 / 3600.0  # m/s


def flight(*legs: dict[str, Any], airspeed_kt: float = 200.0) -> FlightSection:
    start = {**START, "airspeed_kt": airspeed_kt}
    return FlightSection.model_validate({"aircraft": "737", "start": start, "legs": legs})


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
        # A degree of the equator, on the sphere of the Earth's mean radius.
        ({"type": "waypoint", "latitude_deg": 0.0, "longitude_deg": 1.0}, 111_195.0 / SPEED),
    ],
)
def test_leg(leg: dict[str, Any], seconds: float) -> None:
    assert leg_durations(flight(leg)) == [pytest.approx(seconds, rel=1e-3)]


def test_legs_follow_one_another() -> None:
    durations = leg_durations(
        flight(
            {"type": "turn", "heading_deg": 80.0, "bank_deg": 30.0},
            {"type": "turn", "angle_deg": 90.0, "direction": "right", "bank_deg": 30.0},
            {"type": "turn", "heading_deg": 260.0, "bank_deg": 30.0},
            {"type": "hold", "until_s": 400.0},
        )
    )
    quarter = pytest.approx(circle(30.0) / 4, rel=1e-3)
    assert durations[:3] == [quarter, quarter, quarter]
    assert sum(durations) == pytest.approx(400.0)


def test_true_airspeed_grows_with_height() -> None:
    """At 11 km the standard atmosphere has 0.2971 of the density at sea level."""
    high = FlightSection.model_validate(
        {
            "aircraft": "737",
            "start": {**START, "altitude_m": 11000.0, "airspeed_kt": 200.0},
            "legs": [{"type": "turn", "angle_deg": 360.0, "direction": "left", "bank_deg": 30.0}],
        }
    )
    assert leg_durations(high)[0] == pytest.approx(circle(30.0) / math.sqrt(0.2971), rel=2e-3)


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


def test_sensors_that_suit_the_run() -> None:
    spike = {"type": "spike", "at_s": 100.0, "gyro_arcsec": [1.0, 0.0, 0.0]}
    check_times(sensed({"rate_hz": 0.01, "faults": [spike, {"type": "dropout", "from_s": 99.0, "to_s": 1e6}]}))


def test_a_fault_may_lie_where_a_flight_may_still_be() -> None:
    """Of an estimated 1000 s twice as much and ten minutes; nothing is said of a plan that does not tell."""
    start = {**START, "airspeed_kt": 200.0}

    def flown(begin: float, *legs: dict[str, Any]) -> Scenario:
        imu = {"faults": [{"type": "dropout", "from_s": begin}]}
        return sensed(imu, flight={"aircraft": "737", "start": start, "legs": legs})

    hold, turn = {"type": "hold", "duration_s": 1000.0}, {"type": "turn", "angle_deg": 1e-3, "direction": "left"}
    check_times(flown(2599.0, hold))
    with pytest.raises(InputError, match=r"from_s = 2601 lies outside the run, which lasts about 1000 s"):
        check_times(flown(2601.0, hold))
    somewhere = {"type": "waypoint", "latitude_deg": 1.0, "longitude_deg": 1.0}
    check_times(flown(2601.0, hold, turn, somewhere))
    with pytest.raises(InputError, match="lies outside the run"):
        check_times(flown(2601.0, hold, turn, somewhere, {"type": "hold", "until_s": 1000.0}))


def test_more_samples_than_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 1000}.__getitem__)
    with pytest.raises(InputError, match=r"rate_hz = 1000 makes 1e\+05 samples .* at most 117 would fit"):
        check_times(sensed({"rate_hz": 1000.0}))
    check_times(sensed({"rate_hz": 117.0}))
