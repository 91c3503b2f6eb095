"""The statistics of a run against its truth and its solution, without the package's formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sinssim
from sinssim.data import Array
from sinssim.scenario import Scenario

A, F = 6_378_137.0, 1.0 / 298.257223563


def _cartesian(state: Any) -> Array:
    e2 = F * (2.0 - F)
    n = A / np.sqrt(1.0 - e2 * np.sin(state.latitude) ** 2)
    across = (n + state.height) * np.cos(state.latitude)
    z = (n * (1.0 - e2) + state.height) * np.sin(state.latitude)
    return np.stack([across * np.cos(state.longitude), across * np.sin(state.longitude), z], axis=1)


def _rotation(state: Any) -> Rotation:
    return Rotation.from_quat(state.q_nb[:, [1, 2, 3, 0]])


def test_a_run_states_its_errors() -> None:
    """The horizontal error is the part of the chord across the truth's normal; here it grows to 19 m."""
    path = {"latitude_deg": 60.0, "longitude_deg": 10.0, "altitude_m": 5000.0, "course_deg": 70.0}
    data = {
        "name": "m",
        "great_circle": {**path, "speed_mps": 200.0, "duration_s": 60.0},
        "imu": {"grade": "tactical", "rate_hz": 20.0},
        "navigation": {"initial_error": {"tilt_sigma_arcmin": 3.0, "heading_sigma_arcmin": 30.0}},
    }
    run = sinssim.run(Scenario.model_validate(data))
    found, true = run.solutions["quaternion"], run.truth.state
    chord = _cartesian(found) - _cartesian(true)
    normal = _cartesian(type(true)(true.latitude, true.longitude, true.height + 1.0, true.velocity_ned, true.q_nb))
    up = np.sum(chord * (normal - _cartesian(true)), axis=1)
    turned = (_rotation(found) * _rotation(true).inv()).magnitude() * 180.0 / np.pi * 3600.0
    expected = {
        "horizontal_error_m": np.sqrt(np.sum(chord**2, axis=1) - up**2),
        "height_error_m": found.height - true.height,
        "velocity_error_mps": np.linalg.norm(found.velocity_ned - true.velocity_ned, axis=1),
        "attitude_error_arcsec": turned,
    }
    numbers = run.summary["algorithms"]["quaternion"]
    assert numbers["final_horizontal_error_m"] > 10.0
    for name, values in expected.items():
        assert numbers[f"final_{name}"] == pytest.approx(values[-1], rel=1e-6), name
        assert numbers[f"rms_{name}"] == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-6), name
        assert numbers[f"max_{name}"] == pytest.approx(np.abs(values).max(), rel=1e-6), name
