"""What a filter is told of every aiding sensor: names, 1σ in SI, and correlation times, from round keys."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.scenario.filter_section import AidingSection
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, Vehicle, within
from sinssim.truth.motions.parked_and_great_circle import Parked

_DEG = np.pi / 180.0
_LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def _sensor(name: str, **keys: Any) -> AidingSensor:
    return AidingSection.model_validate({name: keys}).sensors()[name]


_CASES: list[tuple[str, dict[str, Any], list[tuple[str, tuple[float, ...], float]]]] = [
    # a given error counts beside the 1σ of the random one: √(3² + 4²) = 5
    (
        "gnss",
        {
            "correlated_position_sigma_m": 2.0, "correlated_height_sigma_m": 5.0, "correlated_velocity_sigma_mps": 0.3,
            "correlation_time_s": 70.0, "lever_arm_sigma_m": 0.4, "time_offset_s": 0.3, "time_offset_sigma_s": 0.4,
            "velocity_delay_sigma_s": 0.2,
        },
        [
            ("gnss-position bias", (2.0, 2.0, 5.0), 70.0),
            ("gnss-velocity bias", (0.3, 0.3, 0.3), 70.0),
            ("gnss lever arm", (0.4, 0.4, 0.4), np.inf),
            ("gnss time offset", (0.5,), np.inf),
            ("gnss-velocity delay", (0.2,), np.inf),
        ],
    ),
    (
        "baro",
        {"bias_m": 7.0, "bias_sigma_m": 9.0, "bias_correlation_time_s": 600.0, "scale_ppm": 30.0,
         "scale_sigma_ppm": 40.0},
        [("baro bias", (9.0,), 600.0), ("baro scale", (5e-5,), np.inf)],
    ),
    (
        "magnetometer",
        {"bias_deg": 2.0, "bias_sigma_deg": 1.0, "declination": "wmm", "declination_sigma_deg": 2.0,
         "deviation_sigma_deg": 0.7},
        [("magnetometer bias", (3.0 * _DEG,), np.inf), ("magnetometer deviation", (0.7 * _DEG, 0.7 * _DEG), np.inf)],
    ),
    (
        "airspeed",
        {"bias_mps": 3.0, "bias_sigma_mps": 4.0, "scale_ppm": 600.0, "scale_sigma_ppm": 800.0, "wind_sigma_mps": 6.0,
         "wind_correlation_time_s": 90.0},
        [("airspeed bias", (5.0,), np.inf), ("airspeed scale", (1e-3,), np.inf), ("airspeed wind", (6.0, 6.0), 90.0)],
    ),
    ("odometer", {"scale_ppm": 30.0, "scale_sigma_ppm": 40.0}, [("odometer scale", (5e-5,), np.inf)]),
    ("zero_velocity", {}, []),
    ("zero_rate", {}, []),
    (
        "attitude",
        {"bias_sigma_arcmin": 3.0, "bias_correlation_time_s": 80.0},
        [("attitude bias", (0.05 * _DEG,) * 3, 80.0)],
    ),
    ("star_tracker", {"bias_sigma_arcsec": 36.0}, [("star-tracker bias", (0.01 * _DEG,) * 3, np.inf)]),
    (
        "master",
        {"attitude": True, "velocity_drift_mps": 0.7, "drift_time_s": 500.0, "mounting_sigma_arcmin": 6.0},
        [("master-velocity bias", (0.7,) * 3, 500.0), ("master-attitude bias", (0.1 * _DEG,) * 3, np.inf)],
    ),
    (
        "dual_antenna",
        {"bias_deg": 0.3, "bias_sigma_deg": 0.4},
        [("dual-antenna bias", (0.5 * _DEG,), np.inf)],
    ),
    (
        "land_vehicle",
        {"drift_lateral_mps": 0.02, "drift_vertical_mps": 0.05, "drift_correlation_time_s": 4.0,
         "mounting_sigma_deg": 2.0, "lever_arm_sigma_m": 0.6, "slip_deg_per_g": 3.0, "slip_sigma_deg_per_g": 4.0},
        [
            ("land-vehicle bias", (0.02, 0.05), 4.0),
            ("land-vehicle mounting", (2.0 * _DEG, 2.0 * _DEG), np.inf),
            ("land-vehicle lever arm", (0.6,) * 3, np.inf),
            ("land-vehicle slip", (5.0 * _DEG / 9.80665,), np.inf),
        ],
    ),
]  # fmt: skip


@pytest.mark.parametrize(("name", "keys", "states"), _CASES, ids=[name for name, *_ in _CASES])
def test_states(name: str, keys: dict[str, Any], states: list[tuple[str, tuple[float, ...], float]]) -> None:
    found = list(_sensor(name, **keys).states())
    assert [state.block for state in found] == [block for block, *_ in states]
    for state, (_, sigma, time) in zip(found, states, strict=True):
        assert state.sigma == pytest.approx(sigma)
        assert state.correlation_time == time


def _read(name: str, **keys: Any) -> list[AidingReadings]:
    place = Parked(0.9, 0.2, 400.0, _LEVEL, 6.0, (0.0, 0.0, 0.0), _LEVEL)
    return _sensor(name, **keys).read(Vehicle(place, 5))


def test_the_sigma_and_the_errors_of_lever_arm_and_time_that_readings_carry() -> None:
    """The filter assumes a lever arm with an error; its true value is what it lacks."""
    arm = (1.5, -0.7, -2.0)
    keys = {"lever_arm_m": arm, "lever_arm_sigma_m": 0.4, "time_offset_s": 0.25, "latency_s": 0.3}
    position, velocity = _read("gnss", **keys, velocity_averaging_s=0.4)
    assert (position.measurements.name, position.measurements.kind) == ("gnss-position", "gnss-position")
    for one in (position, velocity):
        lacks = np.array(arm) - one.measurements.lever_arm
        assert np.abs(lacks).min() > 0.0
        assert one.parameters["gnss lever arm"] == pytest.approx(lacks)
        assert one.parameters["gnss time offset"].tolist() == [0.25]
    assert position.measurements.time == pytest.approx(np.arange(1.0, 6.1))
    assert position.measurements.arrival == pytest.approx(np.arange(1.3, 6.4))
    # a mean over 0.4 s is that of the middle, 0.2 s earlier
    assert velocity.measurements.time == pytest.approx(np.arange(1.0, 6.1) - 0.2)
    assert position.measurements.sigma[0].tolist() == [1.5, 1.5, 3.0]
    assert velocity.measurements.sigma[0].tolist() == [0.05, 0.05, 0.05]


def test_jumps_and_ramps() -> None:
    """North, east and up; both ends of a fault belong to it; a velocity has the rate of a ramp, downwards."""
    none = {"position_sigma_m": 1e-9, "height_sigma_m": 1e-9, "velocity_sigma_mps": 1e-9}
    faults = {
        "jumps": [{"from_s": 2.0, "to_s": 3.0, "north_m": 6.0, "east_m": -8.0, "up_m": 3.0}],
        "ramps": [{"from_s": 4.0, "north_mps": 0.5, "east_mps": 0.25, "up_mps": -2.0}],
    }
    plain, spoilt = _read("gnss", **none), _read("gnss", **none, **faults)
    off = spoilt[0].measurements.value - plain[0].measurements.value
    sine2 = np.sin(0.9) ** 2
    a, e2 = 6378137.0, 0.00669437999014
    east = (a / np.sqrt(1.0 - e2 * sine2) + 400.0) * np.cos(0.9)
    north = a * (1.0 - e2) / (1.0 - e2 * sine2) ** 1.5 + 400.0
    moved = [[0, 0, 0], [6, -8, 3], [6, -8, 3], [0, 0, 0], [0.5, 0.25, -2], [1, 0.5, -4]]
    assert off * (north, east, 1.0) == pytest.approx(np.array(moved, dtype=float), abs=1e-4)
    drift = spoilt[1].measurements.value - plain[1].measurements.value
    assert drift == pytest.approx(np.array([[0.0] * 3] * 3 + [[0.5, 0.25, 2.0]] * 3), abs=1e-9)


def test_both_ends_of_a_span_belong_to_it() -> None:
    time = np.array([1.0, 2.0, 2.5, 3.0, 3.5, 7.0])
    assert within(time, [(2.0, 3.0), (6.9, 8.0)]).tolist() == [False, True, True, True, False, True]


@pytest.mark.parametrize(
    ("name", "keys", "sigma"),
    [
        ("magnetometer", {"sigma_deg": 2.5}, [2.5 * _DEG]),
        ("dual_antenna", {"sigma_deg": 0.3}, [0.3 * _DEG]),
        ("attitude", {"sigma_arcmin": (6.0, 3.0, 12.0)}, [0.1 * _DEG, 0.05 * _DEG, 0.2 * _DEG]),
        ("star_tracker", {"sigma_arcsec": (36.0, 18.0, 72.0)}, [0.01 * _DEG, 0.005 * _DEG, 0.02 * _DEG]),
        ("baro", {"sigma_m": 1.75}, [1.75]),
        ("odometer", {"sigma_mps": 0.07}, [0.07]),
        ("land_vehicle", {"sigma_lateral_mps": 0.2, "sigma_vertical_mps": 0.3}, [0.2, 0.3]),
    ],
)
def test_sigmas_in_si(name: str, keys: dict[str, Any], sigma: list[float]) -> None:
    (found,) = _read(name, **keys)
    assert found.measurements.sigma[2] == pytest.approx(sigma)
