"""The budget against ensembles of runs: standard deviations of position, velocity and attitude at every instant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget.covariance_budget import budget
from tests.analyses.error_budget.worlds import ALLOWED, SHORT_TURN, aided_ensemble, ensemble, scenario, standard_errors
from tests.slow import slow

_START = {
    "position_sigma_m": 5.0, "height_sigma_m": 3.0, "velocity_sigma_mps": 0.05, "tilt_sigma_arcmin": 0.5,
    "heading_sigma_arcmin": 5.0,
}  # fmt: skip
_NOISES = {
    "gyro_arw_deg_sqrt_h": 0.01, "gyro_instability_deg_h": 0.3, "gyro_correlation_time_s": 60.0,
    "gyro_rrw_deg_h_sqrt_h": 3.0, "gyro_flicker_deg_h": 0.2, "gyro_quantum_arcsec": 0.5, "accel_vrw_ug_sqrt_hz": 30.0,
    "accel_instability_ug": 100.0, "accel_correlation_time_s": 30.0, "accel_quantum_mm_s": 0.1,
    "accel_flicker_ug": 50.0, "accel_rrw_ug_sqrt_h": 300.0,
}  # fmt: skip


_SKEWED = [[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.6, -0.8, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]
_REDUNDANT = {
    "sensor_set": {"type": "redundant", "directions": _SKEWED, "monitoring": "none"}, "grade": "tactical",
    "gyro_g_sensitivity_sigma_deg_h_per_g": 1.0, "gyro_asymmetry_sigma_ppm": 3000.0,
    "accel_quadratic_sigma_ug_per_g2": 1000.0, "accel_scale_temperature_sigma_ppm_per_c": 30.0,
    "temperature_steady_c": -20.0, **_NOISES,
}  # fmt: skip
"""Five sensors whose covariance has no symmetry, with errors of all kinds."""


_CALIBRATED_SET = {"imu": _REDUNDANT, "compensation": {"gyro_bias_sigma_deg_h": 0.1, "gyro_scale_sigma_ppm": 300.0}}


@pytest.mark.parametrize(
    ("runs", "tables"),
    [
        (30, {"imu": {"grade": "laser-standard"}, "navigation": {"vertical": "free", "initial_error": _START}}),
        (30, {"imu": _NOISES, "navigation": {"vertical": "baro-loop"}}),
        *slow((30, {"imu": {"grade": "tactical"},
                    "compensation": {"gyro_bias_sigma_deg_h": 0.1, "accel_bias_sigma_ug": 30.0}}),
              (10, _CALIBRATED_SET), (60, _CALIBRATED_SET)),
    ],
    ids=["laser", "noises", "calibrated", "redundant", "redundant, many"],
)  # fmt: skip
def test_unaided_runs(runs: int, tables: dict[str, Any]) -> None:
    """Of N runs, fewer of a redundant set; fails by chance with 0.3 % at most, see `ALLOWED`."""
    plan = scenario(**tables)
    result = budget(plan)
    assert np.abs(standard_errors(ensemble(plan, result, runs), result)).max() < ALLOWED


def _aided(**changes: Any) -> dict[str, Any]:
    return {
        "motion": SHORT_TURN,
        "imu": {"grade": "tactical", "rate_hz": 10.0},
        "navigation": {"vertical": "free", "initial_error": _START},
        "aiding": {
            "gnss": {"latency_s": 0.3, "lever_arm_m": [1.0, 0.5, -2.0], "lever_arm_sigma_m": 0.2,
                     "correlated_position_sigma_m": 2.0, "correlation_time_s": 60.0, "outages_s": [[25.0, 35.0]]},
            "baro": {"bias_sigma_m": 5.0, "scale_sigma_ppm": 500.0},
        },
        "filter": {"gate": 0.0, "rate_hz": 2.0, **changes},
    }  # fmt: skip


@pytest.mark.parametrize("runs", [6, *slow(10, 50)])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        *slow({"states": ["gyro bias"], "measurement_noise_factor": 3.0}),
        *slow({"imu": {**_REDUNDANT, "rate_hz": 10.0}, "states": ["gyro bias", "accelerometer bias"]}),
    ],
    ids=["all states", "a filter that knows less", "redundant"],
)
def test_runs_with_a_filter(changes: dict[str, Any], runs: int) -> None:
    """Some 130 instants; fails by chance with 0.3 % at most."""
    imu = {"imu": changes["imu"]} if "imu" in changes else {}
    plan = scenario(**{**_aided(**{key: value for key, value in changes.items() if key != "imu"}), **imu})
    result = budget(plan, marks=(20.0, 40.0))
    errors = aided_ensemble(plan, result, runs)
    assert np.abs(standard_errors(errors, result)).max() < ALLOWED
    assert result.added is not None  # and what an interval adds, readings that are late included
    begin, end = (errors[:, result.row(t)] for t in result.added.end[:2])
    added = np.sqrt([sum(p[1, k, k] for p in result.added.covariance.values()) for k in range(9)])
    found = np.sqrt(np.mean((end - begin - sum(mean[1] for mean in result.added.mean.values())) ** 2, axis=0))
    assert np.abs((found / added - 1.0) * np.sqrt(2.0 * runs)).max() < ALLOWED


@pytest.mark.slow
@pytest.mark.parametrize("grade", ["laser-standard", "laser-navigation"])
def test_first_flight(grade: str) -> None:
    """N = 2000: within 3.5 standard errors for one instant, corrected for their number.

    The errors change over minutes, so that the 501 instants are about 50 independent ones of 9 components:
    3.5 for one of them, by chance 5e-4, becomes 4.5 at the same level for the largest of 450.
    """
    plan = sinssim.load_scenario("first_flight", (f"imu.grade={grade}", 'navigation.algorithms=["quaternion"]'))
    result = budget(plan)
    assert np.abs(standard_errors(ensemble(plan, result, 2000), result)).max() < 4.5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gyrocompassing", "aided_airliner"])
def test_shipped_filters(name: str) -> None:
    """N = 200, some ten minutes each; the epochs of a filter are less correlated: 501 × 9 give 5.0, by chance 0.5 %."""
    settings = ("filter.smooth=false",) if name == "aided_airliner" else ()
    plan = sinssim.load_scenario(name, settings)
    result = budget(plan)
    assert np.abs(standard_errors(aided_ensemble(plan, result, 200), result)).max() < 5.0
