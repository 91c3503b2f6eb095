"""Limits of a scenario's values: what is accepted can be computed with."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.scenario import Scenario, load_scenario

CONING = {"type": "coning", "half_angle_deg": 1.0, "frequency_hz": 5.0, "duration_s": 2.0}
ROCKING = {"type": "spin-rock", "axis": (0.0, 0.0, 1.0), "angle_deg": 1.0, "frequency_hz": 5.0, "duration_s": 2.0}
CIRCLE = {"latitude_deg": 45.0, "course_deg": 0.0, "speed_mps": 200.0, "duration_s": 10.0}
PARKED = {"latitude_deg": 45.0, "duration_s": 10.0}
VIBRATION = {"coordinate": "roll", "rms_arcsec": 3.0, "low_hz": 20.0}
ISOLATOR = {"linear_hz": 30.0, "angular_hz": 40.0}
SOURCES: dict[str, dict[str, Any]] = {"parked": PARKED, "great_circle": CIRCLE, "coning": CONING, "rocking": ROCKING}


def scenario(source: str, **tables: Any) -> Scenario:
    """Return a scenario of one source of motion, with more tables."""
    place = {source: SOURCES[source]} if source in ("parked", "great_circle") else {"motion": SOURCES[source]}
    return Scenario(**{"name": "x", **place, **tables})


@pytest.mark.parametrize(
    ("source", "table", "key", "last", "first_refused"),
    [
        ("parked", "parked", "altitude_m", 1e6, 1.1e6),
        ("parked", "parked", "altitude_m", -12_000.0, -13_000.0),
        ("parked", "parked", "duration_s", 1e9, 1e300),
        ("great_circle", "great_circle", "speed_mps", 12_000.0, 1e5),
        ("coning", "motion", "frequency_hz", 1e-6, 1e-300),
        ("coning", "motion", "frequency_hz", 1e5, 1e100),
        ("coning", "motion", "half_angle_deg", 180.0, 181.0),
        ("rocking", "motion", "axis", (0.0, 0.0, 1e-6), (0.0, 0.0, 1e-300)),
        ("rocking", "motion", "axis", (1e5, 0.0, 0.0), (1e300, 0.0, 0.0)),
        ("rocking", "motion", "spin_deg_s", -360_000.0, 1e16),
    ],
)
def test_motions(source: str, table: str, key: str, last: object, first_refused: object) -> None:
    sound = SOURCES[source]
    scenario(source, **{table: sound | {key: last}})
    with pytest.raises(InputError, match=key):
        scenario(source, **{table: sound | {key: first_refused}})


@pytest.mark.parametrize(
    ("table", "last", "first_refused"),
    [
        ("vibration", [VIBRATION | {"rms_arcsec": 648_000.0}], [VIBRATION | {"rms_arcsec": 1e9}]),
        ("vibration", [VIBRATION | {"low_hz": 1e-6}], [VIBRATION | {"low_hz": 1e-9}]),
        ("isolator", ISOLATOR | {"linear_hz": 1e5}, ISOLATOR | {"linear_hz": 1e16}),
        ("isolator", ISOLATOR | {"angular_damping": 1e-6}, ISOLATOR | {"angular_damping": 1e-300}),
        ("navigation", {"initial_error": {"north_m": 1e6}}, {"initial_error": {"north_m": 1e7}}),
        ("navigation", {"initial_error": {"roll_arcmin": -10_800.0}}, {"initial_error": {"roll_arcmin": 1e5}}),
        ("navigation", {"initial_error": {"velocity_sigma_mps": 1e4}}, {"initial_error": {"velocity_sigma_mps": 1e9}}),
        ("imu", {"grade": "tactical", "lever_arm_m": (1e3, 0.0, 0.0)}, {"lever_arm_m": (1e9, 0.0, 0.0)}),
        ("aiding", {"gnss": {"position_sigma_m": 1e-12}}, {"gnss": {"position_sigma_m": 1e-13}}),
        ("aiding", {"gnss": {"velocity_sigma_mps": 1e6}}, {"gnss": {"velocity_sigma_mps": 1e16}}),
        ("aiding", {"gnss": {"correlation_time_s": 1e-3}}, {"gnss": {"correlation_time_s": 1e-9}}),
        ("aiding", {"star_tracker": {"sigma_arcsec": (1e-12,) * 3}}, {"star_tracker": {"sigma_arcsec": (1e-300,) * 3}}),
    ],
)
def test_what_is_added_to_them(table: str, last: Any, first_refused: Any) -> None:
    more = {"filter": {}} if table == "aiding" else {}
    scenario("parked", **{table: last}, **more)
    with pytest.raises(InputError, match=table):
        scenario("parked", **{table: first_refused}, **more)


def test_baro_loop() -> None:
    loop = {"vertical": "baro-loop"}
    scenario("parked", navigation=loop | {"baro_time_constant_s": 0.1})
    with pytest.raises(InputError, match="baro_time_constant_s"):
        scenario("parked", navigation=loop | {"baro_time_constant_s": 1e-9})


GUST = "[{start_s=1.0, rise_s=1e-9, velocity_ned_mps=[1.0, 0.0, 0.0]}]"


@pytest.mark.parametrize(
    ("key", "setting"), [("timeout_s", "legs.1.timeout_s=1e300"), ("rise_s", f"wind.gusts={GUST}")]
)
def test_flights(key: str, setting: str) -> None:
    with pytest.raises(InputError, match=key):
        load_scenario("first_flight", f"flight.{setting}")
