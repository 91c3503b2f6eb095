"""The acceptance flight: its plan, the errors of a flight that is written down by hand, and the sentences."""

from __future__ import annotations

from array import array
from typing import Any

import numpy as np
import pytest

from sinssim.truth.aircraft_design.acceptance_flight import (
    LegErrors,
    acceptance_items,
    acceptance_numbers,
    acceptance_plans,
    errors_of_legs,
)
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_log import CHANNELS, FlightRecord
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.sampling import FlightEvent

FOOT, KNOT = 0.3048, 1852.0 / 3600.0
A = 6378137.0


def record(heights: Any, headings: Any, rolls: Any, speeds_kt: Any, legs: list[tuple[float, float]]) -> FlightRecord:
    """Return a record over the equator, at 30 Hz, of values every step."""
    poses = array("d")
    for height, heading, roll in zip(heights, headings, rolls, strict=True):
        poses.extend(((A + height) / FOOT, 0.0, 0.0, np.radians(roll), 0.0, np.radians(heading)))
    column = [name for name, *_ in CHANNELS].index("calibrated_airspeed_mps")
    channels = array("d")
    for speed in speeds_kt[::3]:
        row = [0.0] * (len(CHANNELS) + 1)
        row[column] = speed * KNOT / FOOT
        channels.extend(row)
    events = [
        FlightEvent(t, f"leg {n} (x) {word}")
        for n, leg in enumerate(legs, 1)
        for t, word in zip(leg, ("begins", "ends"), strict=True)
    ]
    return FlightRecord(poses, channels, tuple(events))


def plan(*legs: dict[str, Any]) -> FlightPlan:
    start = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 0.0, "altitude_m": 1000.0, "airspeed_kt": 200.0}
    return FlightPlan.model_validate({"aircraft": "737", "start": start, "legs": legs})


def test_errors_of_a_flight_that_is_known() -> None:
    """A turn by 90° right 12 m too high and 4 kt too slow, and a hold that is 3 m low, 2 kt fast, 0.4° off at its end,
    where it rolls at 0.2°/s; what happens in the first half of the hold does not count."""
    t = np.arange(1801) / 30.0  # 60 s: turn until 20 s, hold until 60 s
    heading = np.where(t < 20.0, 350.0 + 4.5 * t, 440.4)
    height = np.where(t < 20.0, 1012.0, np.where(t < 40.0, 900.0, 997.0))
    speed = np.where(t < 20.0, 196.0, np.where(t < 40.0, 150.0, 202.0))
    roll = np.where(t < 50.0, 0.0, 0.2 * (t - 50.0))
    flown = record(height, heading % 360.0, roll, speed, [(0.0, 19.0), (20.0, 60.0)])
    turn, hold = errors_of_legs(
        plan({"type": "turn", "angle_deg": 90.0, "direction": "right"}, {"type": "hold", "duration_s": 40.0}),
        flown, ["turn right", "hold after turn right"],
    )  # fmt: skip
    assert turn == LegErrors("turn right", "turn", pytest.approx(12.0, abs=1e-3), pytest.approx(4.0), None, None)
    assert (hold.height_m, hold.airspeed_kt, hold.heading_deg, hold.rate_deg_s) == pytest.approx(
        (3.0, 2.0, 0.4, 0.2), abs=2e-3
    )
    assert hold.excess() == ""


def test_what_exceeds_its_limit_is_named() -> None:
    bad = LegErrors("hold after climb", "hold", 10.4, 4.0, 1.5, 0.1)
    assert bad.excess() == "hold after climb: height 10.4 m (limit 10 m), heading 1.5 ° (limit 1 °)"
    assert (
        LegErrors("descent", "descend", None, float("nan"), 0.0, None).excess()
        == "descent: airspeed nan kt (limit 15 kt)"
    )


def test_the_plan_has_every_manoeuvre() -> None:
    plain, windy = acceptance_plans("737", load_aircraft("737").performance, 3000.0)
    kinds = [leg.type for leg in plain[0].legs if leg.type != "hold"]
    assert kinds == ["climb", "turn", "turn", "speed", "speed", "descend"]
    assert [leg.direction for leg in plain[0].legs if leg.type == "turn"] == ["right", "left"]
    assert [leg.airspeed_kt for leg in plain[0].legs if leg.type == "speed"] == [252.0, 280.0]
    assert len(plain[0].legs) == len(plain[1])
    assert windy[0].wind.gusts[0].velocity_ned_mps == (0.0, 5.0, -3.0)


def test_the_exhibits_say_the_verdict_and_show_the_limits() -> None:
    good, bad = LegErrors("climb", "climb", None, 1.234, 0.5, None), LegErrors("gust", "gust", 31.0, 1.0, 1.0, None)
    sentence, table = acceptance_items("kite", 1500.0, [good, bad])
    assert sentence.text == (
        "kite does not hold the limits of the acceptance plan at 1500 m: gust: height 31.0 m (limit 30 m)."
    )
    assert table.rows[0] == ("climb", "", "1.23 (10)", "0.50 (3)", "")
    assert next(iter(acceptance_items("kite", 1500.0, [good]))).text.endswith("every leg is within its limits.")
    numbers = acceptance_numbers("kite", 1500.0, [good, bad])
    assert (numbers["accepted"], numbers["legs"][1]["height_m"], numbers["legs"][1]["limits"]["height_m"]) == (
        False,
        31.0,
        30.0,
    )
