"""Sensitivities against one-error runs of the engine itself, on a motion with turns about all axes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.analyses.error_budget import covariance_propagation
from sinssim.analyses.error_budget.covariance_budget import budget
from tests.analyses.error_budget.worlds import ensemble, scenario

_ONE: dict[str, Any] = {
    "gyro_bias_deg_h": [0.3, -0.2, 0.5],
    "gyro_scale_ppm": [200.0, -300.0, 250.0],
    "gyro_misalignment_arcsec": [20.0, -30.0, 10.0, 25.0, -15.0, 40.0],
    "gyro_asymmetry_ppm": [300.0, 200.0, -400.0],
    "gyro_quadratic_ppm_per_deg_s": [30.0, 20.0, -10.0],
    "gyro_cubic_ppm_per_deg2_s2": [3.0, 2.0, -1.0],
    "gyro_g_sensitivity_deg_h_per_g": [0.1, 0.2, -0.1, 0.3, 0.1, 0.2, -0.2, 0.1, 0.2],
    "gyro_ramp_deg_h_per_h": [1.0, -2.0, 1.0],
    "accel_bias_ug": [100.0, -50.0, 70.0],
    "accel_scale_ppm": [100.0, -150.0, 120.0],
    "accel_misalignment_arcsec": [10.0, -20.0, 30.0, 15.0, -25.0, 12.0],
    "accel_asymmetry_ppm": [100.0, 200.0, 150.0],
    "accel_quadratic_ug_per_g2": [50.0, 40.0, 30.0],
    "accel_cubic_ug_per_g3": [50.0, -40.0, 30.0],
    "accel_cross_axis_ug_per_g2": [20.0, 30.0, -10.0, 15.0, 25.0, 10.0],
    "accel_ramp_ug_per_h": [300.0, 200.0, -100.0],
    "accel_arms_mm": [[300.0, 0.0, 0.0], [0.0, 200.0, 0.0], [0.0, 0.0, -250.0]],
    "accel_delay_ms": 20.0,
    "accel_range_g": 0.99,
    "faults": [{"type": "bias-step", "from_s": 50.0, "to_s": 120.0, "gyro_deg_h": [5.0, 0.0, -3.0]}],
}


_PERFECT: dict[str, Any] = {}


def _perfect(plan: Any, result: Any) -> Any:
    """Return the errors of the engine without errors of the sensors; those of the usual motion are computed once."""
    without = plan.model_copy(update={"imu": scenario().imu, "compensation": None})
    key = f"{without!r} {result.time.tobytes().hex()}"
    if key not in _PERFECT:
        _PERFECT[key] = ensemble(without, result, 1)[0]
    return _PERFECT[key]


def _compare(plan: Any, least: float = 1e-3) -> None:
    """Compare the mean with the run's error less that of the engine without errors, to 1 % of the largest."""
    result = budget(plan)
    assert not result.total.any()
    run = ensemble(plan, result, 1)[0]
    perfect = _perfect(plan, result)
    found = run - perfect
    assert np.abs(found[:, :2]).max() > least  # the error has an effect
    of_errors = result.bias - result.mean.get("algorithm", 0.0)
    for part in (slice(0, 3), slice(3, 6), slice(6, 9)):
        largest = np.abs(found[:, part]).max()
        if largest > 0.0:
            assert np.abs(of_errors[:, part] - found[:, part]).max() <= 0.01 * largest + 1e-11


@pytest.mark.parametrize("key", _ONE)
def test_one_error_run(key: str) -> None:
    _compare(scenario(imu={key: _ONE[key]}))


def test_errors_by_temperature() -> None:
    warm = {"temperature_start_c": 20.0, "temperature_steady_c": 35.0, "warm_up_time_s": 60.0}
    _compare(scenario(imu={**warm, "gyro_bias_temperature_deg_h_per_c": [0.02, -0.01, 0.03]}))
    _compare(scenario(imu={**warm, "gyro_scale_temperature_ppm_per_c": [20.0, -10.0, 15.0]}))


def test_what_a_measured_calibration_leaves() -> None:
    imu = {"accel_bias_ug": [100.0, -50.0, 70.0]}
    calibration = {"accel_bias_ug": [90.0, -60.0, 70.0], "accel_bias_sigma_ug": 5.0}
    result = budget(scenario(imu=imu, compensation=calibration))
    reference = budget(scenario(imu={"accel_bias_ug": [10.0, 10.0, 0.0]}))
    assert result.bias == pytest.approx(reference.bias, rel=1e-9, abs=0.0)
    assert not result.total.any()


def test_given_initial_errors() -> None:
    start = {"north_m": 30.0, "east_m": -20.0, "velocity_east_mps": 0.1, "roll_arcmin": 0.5, "heading_arcmin": 4.0}
    plan = scenario(navigation={"initial_error": start})
    result = budget(plan)
    run = ensemble(plan, result, 1)[0]
    for part in (slice(0, 2), slice(3, 5), slice(6, 9)):
        scale = np.abs(run[:, part]).max()
        assert np.abs(result.bias[:, part] - run[:, part]).max() <= 0.01 * scale


def test_the_baro_loop_and_its_given_errors() -> None:
    """Readings with a given bias, scale factor, lag and latency, that arrive every two seconds."""
    plan = scenario(
        great_circle={"latitude_deg": 40.0, "course_deg": 30.0, "speed_mps": 100.0, "altitude_m": 1000.0,
                      "duration_s": 300.0},
        imu={"accel_bias_ug": [0.0, 0.0, 300.0]},
        aiding={"baro": {"rate_hz": 0.5, "sigma_m": 1e-9, "bias_m": 8.0, "bias_sigma_m": 0.0, "scale_ppm": 3000.0,
                         "latency_s": 0.4, "outages_s": [[100.0, 160.0]]}},
        navigation={"vertical": "baro-loop", "baro_time_constant_s": 20.0},
    )  # fmt: skip
    result = budget(plan)
    run = ensemble(plan, result, 1)[0]
    assert np.abs(run[:, 2]).max() > 5.0
    assert np.abs(result.bias[:, 2] - run[:, 2]).max() < 0.01 * np.abs(run[:, 2]).max()
    assert np.abs(result.bias[:, 5] - run[:, 5]).max() < 0.01 * np.abs(run[:, 5]).max()


def test_the_algorithm_and_its_gravity_model() -> None:
    """A navigator without the north component of gravity, at height: its own error is a source."""
    plan = scenario(
        great_circle={"latitude_deg": 45.0, "course_deg": 60.0, "speed_mps": 200.0, "altitude_m": 10000.0,
                      "duration_s": 300.0},
        navigation={"gravity": "somigliana"},
    )  # fmt: skip
    result = budget(plan)
    assert [source.name for source in result.sources] == ["algorithm"]
    run = ensemble(plan, result, 1)[0]
    assert np.abs(run[:, 0]).max() > 1.0
    assert result.bias == pytest.approx(run, abs=1e-9)
    exact = budget(plan.model_copy(update={"navigation": scenario().navigation}))
    assert exact.sources == ()


def test_the_length_of_a_step_hardly_matters(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of a quarter of a second instead of one, on turns at up to 20°/s: 0.1 %, and no drift with it."""
    plan = scenario(imu={"grade": "tactical", "gyro_instability_deg_h": 1.0, "gyro_correlation_time_s": 50.0})
    usual = budget(plan).sigma()
    monkeypatch.setattr(covariance_propagation, "_LONGEST", 0.25)
    finer = budget(plan).sigma()
    for part in (slice(0, 2), slice(3, 5), slice(6, 9)):
        assert np.abs(usual[20:, part] / finer[20:, part] - 1.0).max() < 1e-3
