"""A filter whose compass keeps the declination of the start: it is told how much it changes along the way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import filter_model, with_declination
from sinssim.scenario.true_motion import fly
from sinssim.sensors.aiding.magnetometer import field_along


def westwards(how: str, seconds: float, seed: int = 1) -> Scenario:
    """Return a flight along which the declination changes by some 3.5° an hour."""
    data: dict[str, Any] = {
        "name": "w", "seed": seed,
        "great_circle": {"latitude_deg": 50.0, "longitude_deg": 10.0, "altitude_m": 9000.0, "course_deg": 270.0,
                         "speed_mps": 250.0, "duration_s": seconds},
        "imu": {"grade": "tactical", "rate_hz": 2.0},
        "navigation": {"vertical": "free", "initial_error": {"tilt_sigma_arcmin": 3.0, "heading_sigma_arcmin": 30.0}},
        "aiding": {
            "gnss": {"rate_hz": 0.2},
            "magnetometer": {"declination": how, "date": "2026-06-01", "rate_hz": 0.5},
        },
        "filter": {"rate_hz": 1.0},
    }  # fmt: skip
    return Scenario.model_validate(data)


@pytest.mark.parametrize("how", ["start", "wmm"])
def test_the_walk_bounds_the_change(how: str) -> None:
    plan = westwards(how, 1800.0)
    motion, model = fly(plan), filter_model(plan, 1800.0)
    (block,) = (b for b in with_declination(model, plan, motion).blocks if b.name == "magnetometer bias")
    ends = motion.state(np.array([motion.start, motion.end]))
    field = field_along(ends.latitude, ends.longitude, ends.height, 2026.4137)
    change = abs(np.diff(np.arctan2(field[:, 1], field[:, 0]))[0])
    assert float(block.density[0]) * np.sqrt(1800.0) == pytest.approx(change if how == "start" else 0.0, rel=1e-3)
    assert block.sigma == pytest.approx(np.radians(0.4))


def test_the_covariance_contains_the_error() -> None:
    """The budget's heading error, the declination's change included, within the filter's σ; with a constant, 5.2 σ."""
    found = sinssim.budget(westwards("start", 1800.0))
    assert found.filter_covariance is not None
    own = np.sqrt(found.filter_covariance[:, 8, 8])
    assert np.all(np.abs(found.bias[:, 8]) < own)
    assert np.all(found.sigma()[:, 8] < 1.1 * own)


@pytest.mark.slow
def test_nees_of_an_hour() -> None:
    """Twenty flights of an hour: the NEES of the heading at the end, at most 2.07 by chance once in 500 if it is 1."""
    squares = []
    for seed in range(20):
        aided = sinssim.run(westwards("start", 3600.0, seed)).aided
        assert aided is not None
        last = len(aided.estimate.rows) - 1
        row = aided.estimate.rows[last]
        error = aided.error_at(np.array([row])).attitude[0, 2]
        squares.append(error**2 / aided.estimate.covariance[last][8, 8])
    assert np.mean(squares) < 2.07
