"""Where the filter's model is the truth, the budget is the filter's own covariance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.units import DEG_H, DEG_SQRT_H
from tests.analyses.error_budget.worlds import PLACE, SHORT_TURN, scenario
from tests.slow import slow

_STATES = ["gyro bias", "accelerometer bias", "gyro scale", "accelerometer scale", "gyro misalignment",
           "accelerometer misalignment"]  # fmt: skip
_START = {
    "position_sigma_m": 5.0, "height_sigma_m": 3.0, "velocity_sigma_mps": 0.05, "tilt_sigma_arcmin": 0.5,
    "heading_sigma_arcmin": 20.0,
}  # fmt: skip
_WORLDS: dict[str, dict[str, Any]] = {
    "gnss": {"gnss": {"latency_s": 0.2, "lever_arm_m": [2.0, 1.0, -1.0], "correlated_position_sigma_m": 1.0}},
    "baro": {"gnss": {"velocity": False}, "baro": {"bias_sigma_m": 4.0, "scale_sigma_ppm": 1000.0}},
    "headings": {"gnss": {}, "magnetometer": {"bias_sigma_deg": 1.0, "deviation_sigma_deg": 0.5}},
    "attitudes": {"attitude": {"bias_sigma_arcmin": 2.0}, "star_tracker": {"bias_sigma_arcsec": 3.0}},
    "standstill": {"zero_velocity": {"rate_hz": 0.5}, "zero_rate": {"sigma_deg_h": 3.0}},
    "wheels": {"odometer": {"scale_sigma_ppm": 500.0, "lever_arm_m": [1.0, 0.5, 0.5]}, "zero_velocity": {}},
}


@pytest.mark.parametrize("name", ["gnss", "baro", *slow("attitudes", "headings", "standstill", "wheels")])
def test_the_models_agree(name: str) -> None:
    """To 1 % of each standard deviation, with the covariance that the filter of a run computes itself."""
    plan = scenario(
        motion=SHORT_TURN,
        imu={"grade": "tactical", "rate_hz": 20.0, "gyro_instability_deg_h": 2.0, "gyro_correlation_time_s": 30.0},
        navigation={"vertical": "free", "initial_error": _START},
        aiding=_WORLDS[name],
        filter={"states": _STATES, "gate": 0.0},
    )
    result = budget(plan)
    assert result.filter_covariance is not None
    own = np.sqrt(np.einsum("kii->ki", result.filter_covariance))
    assert result.sigma() == pytest.approx(own, rel=0.01)
    aided = sinssim.run(plan).aided
    assert aided is not None
    rows = np.searchsorted(aided.estimate.time, result.time + aided.trajectory.start - 1e-6)
    assert result.sigma() == pytest.approx(aided.estimate.sigma[rows, :9], rel=0.01)


def test_after_an_alignment_at_rest() -> None:
    """Gyrocompassing, then zero velocity: the alignment's error follows from the sensors' errors, as P₀ says."""
    plan = scenario(
        parked={**PLACE, "heading_deg": 30.0, "duration_s": 300.0},
        imu={"grade": "laser-navigation", "rate_hz": 20.0},
        navigation={"vertical": "free", "initial_error": {"position_sigma_m": 2.0, "height_sigma_m": 2.0}},
        aiding={"zero_velocity": {"sigma_mps": 0.002}},
        filter={"alignment_s": 120.0, "states": _STATES, "gate": 0.0},
    )
    result = budget(plan)
    assert result.filter_covariance is not None
    own = np.sqrt(np.einsum("kii->ki", result.filter_covariance))
    aided = sinssim.run(plan).aided
    assert aided is not None
    rows = np.searchsorted(aided.estimate.time, result.time + aided.trajectory.start - 1e-6)
    assert own == pytest.approx(aided.estimate.sigma[rows, :9], rel=0.01)
    # the alignment's heading error is √(σ_b² + N²/T)/(ω cos φ); the filter assumes some motion of the base, too
    drift = math.hypot(0.0035 * DEG_H, 0.002 * DEG_SQRT_H / math.sqrt(120.0))
    expected = drift / (OMEGA_IE * math.cos(math.radians(50.0)))
    assert result.sigma()[0, 8] == pytest.approx(expected, rel=0.01)
    assert result.sigma()[0, 8] < own[0, 8]
    assert result.sigma()[0, 6:8] == pytest.approx(own[0, 6:8], rel=0.02)
    # later, only the first 120 s of alignment distinguish them
    assert result.sigma()[-1, 6:] == pytest.approx(own[-1, 6:], rel=0.15)
    assert np.all(result.sigma()[-1, 6:] <= own[-1, 6:] * 1.01)


def test_without_readings_it_is_inertial_navigation() -> None:
    """A filter whose readings are all in an outage."""
    tables = {
        "motion": SHORT_TURN,
        "imu": {"grade": "tactical"},
        "navigation": {"vertical": "free", "initial_error": _START},
    }
    blind = scenario(**tables, aiding={"gnss": {"outages_s": [[0.0, 1000.0]]}}, filter={"rate_hz": 10.0})
    aided = budget(blind)
    inertial = budget(scenario(**tables), times=aided.time)
    rows = [inertial.row(t) for t in aided.time]
    assert aided.sigma() == pytest.approx(inertial.sigma()[rows], rel=1e-3, abs=1e-9)
    again = budget(blind, solution="inertial")
    plain = budget(scenario(**tables))
    assert again.sigma() == pytest.approx(plain.sigma(), rel=1e-12)
