"""The filter on a block that turns: readings of the vehicle, errors of the block, and the consistency of both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim import rotation
from sinssim.data import Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation.linearisation import Prediction, observe
from sinssim.estimation.state_model import Block, ErrorModel
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario

TURNING = {"type": "indexed", "rate_deg_s": 15.0, "ramp_s": 1.0, "dwell_s": 10.0}


def aided(seconds: float, seed: int = 1, turning: dict[str, Any] | None = TURNING, **imu: Any) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "aided",
            "seed": seed,
            "great_circle": {
                "latitude_deg": 45.0, "longitude_deg": 5.0, "altitude_m": 3000.0, "course_deg": 60.0,
                "speed_mps": 150.0, "duration_s": seconds,
            },
            "imu": {
                "grade": "ideal", "rate_hz": 10.0, "mounting_deg": (10.0, 20.0, 50.0),
                **({} if turning is None else {"rotation": turning}), **imu,
            },
            "aiding": {"gnss": {"lever_arm_m": (3.0, 2.0, -4.0)}, "baro": {}},
            "filter": {},
            "navigation": {"initial_error": {"tilt_sigma_arcmin": 1.0, "heading_sigma_arcmin": 10.0}},
        }
    )  # fmt: skip


def test_velocity_at_a_lever_arm_has_the_derivatives_of_the_errors_of_the_block() -> None:
    """H of the gyros' biases, in the block's axes, against differences of the residual."""
    lever, rate_b = np.array([3.0, 2.0, -4.0]), np.array([0.05, -0.2, 0.1])
    q_vb, q_nv = rotation.quaternion_from_euler(0.4, 0.3, 2.0), rotation.quaternion_from_euler(0.1, -0.2, 1.0)
    turn = np.array([0.02, -0.22, 0.11])
    model = ErrorModel(
        (Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1.0), Block("gyro bias", 1.0)), 0.0, 0.0
    )
    state = NavState(np.array([0.8]), np.array([0.1]), np.array([50.0]), np.array([[9.0, 8.0, 7.0]]), q_nv[None])
    reading = Measurements("gnss-velocity", np.zeros(1), np.zeros(1), np.zeros((1, 3)), np.ones((1, 3)), lever)
    c_vb = rotation.dcm_from_quaternion(q_vb)[None]

    def seen(bias: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        rate = rate_b + bias
        of_vehicle = rotation.rotate(q_vb, rate - turn)[None]
        return observe(reading, Prediction(state, of_vehicle, WGS84, (rate[None], c_vb)), model, {})

    here, h = seen(np.zeros(3))
    for axis in range(3):
        bias = np.zeros(3)
        bias[axis] = 1e-3
        assert seen(bias)[0][0] - here[0] == pytest.approx(1e-3 * h[0, :, 9 + axis], abs=1e-9)
    assert np.abs(h[0, :, 9:]).max() > 1.0


def test_ideal_sensors_leave_nothing_but_the_noise_of_the_readings() -> None:
    """A wrong axis of the lever arm of 5 m would leave metres; the antenna's noise here is 10 mm and 1 mm/s."""
    scenario = aided(120.0)
    assert scenario.aiding is not None
    exact = {"position_sigma_m": 1e-2, "height_sigma_m": 1e-2, "velocity_sigma_mps": 1e-3}
    gnss = scenario.aiding.gnss.model_copy(update=exact)
    aiding = scenario.aiding.model_copy(update={"gnss": gnss})
    done = run(scenario.model_copy(update={"aiding": aiding}))
    assert done.aided is not None
    assert np.abs(done.aided.error.position_ned[-1]).max() < 0.03
    for innovation in done.aided.estimate.innovations:
        assert np.nanmean(innovation.nis) / innovation.value.shape[1] == pytest.approx(1.0, abs=0.3)


def nees(scenario: Scenario) -> tuple[float, float]:
    """Return the mean NEES of navigation and the mean NIS, per degree of freedom."""
    found = run(scenario).aided
    assert found is not None
    actual = found.state_errors_at(found.estimate.rows)[:, :9]
    covariance = found.estimate.covariance[:, :9, :9]
    square = np.einsum("ki,kij,kj->k", actual, np.linalg.inv(covariance), actual) / 9.0
    normal = [np.nanmean(i.nis) / i.value.shape[1] for i in found.estimate.innovations]
    return float(np.mean(square)), float(np.mean(normal))


def test_the_filter_is_consistent() -> None:
    """Two runs of two minutes; the study behind the mark slow has sixteen of fifteen.

    A run has few independent errors: nine in χ²₉/9 have a spread of 0.47, two runs 0.33, so that 0.2 … 3 is beyond the
    band of 99.9 %. NIS: 2 · 120 · 7 numbers, a spread of 0.035.
    """
    values = np.array([nees(aided(120.0, seed, grade="laser-standard")) for seed in range(2)])
    assert 0.2 < values[:, 0].mean() < 3.0
    assert values[:, 1].mean() == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(
    "turning",
    [TURNING, {"type": "continuous", "rate_deg_s": 10.0, "inner_rate_deg_s": 7.0, "axis": (1.0, 0.0, 0.0)}],
)
def test_the_filter_is_consistent_over_many_runs(turning: dict[str, Any]) -> None:
    """Sixteen runs of fifteen minutes; the spread of a run is 0.2, that of the mean 0.05."""
    values = np.array([nees(aided(900.0, seed, turning, grade="laser-standard")) for seed in range(16)])
    assert values[:, 0].mean() == pytest.approx(1.0, abs=0.25)
    assert values[:, 1].mean() == pytest.approx(1.0, abs=0.05)
