"""The budget of a block that turns: against ensembles of runs, and its encoders against runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget.budget_result import BudgetResult
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.data import Array
from sinssim.experiments.ensembles.ensemble_execution import errors_of_runs
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario
from tests.analyses.error_budget.worlds import ALLOWED, aided_ensemble, scenario, standard_errors
from tests.slow import slow

INDEXED: dict[str, Any] = {"type": "indexed", "rate_deg_s": 10.0, "ramp_s": 1.0, "dwell_s": 10.0}
MOVING: dict[str, Any] = {
    "great_circle": {"latitude_deg": 40.0, "longitude_deg": 8.0, "course_deg": 30.0, "speed_mps": 10.0},
}


def moving(seconds: float, turning: dict[str, Any], **imu: Any) -> Scenario:
    motion = {"great_circle": {**MOVING["great_circle"], "duration_s": seconds}}
    return scenario(**motion, imu={"rate_hz": 5.0, "rotation": turning, **imu})


def departures(plan: Scenario, result: BudgetResult, count: int) -> Array:
    """Return (s² / σ² − 1) √(N/2) of the ensemble about the budget's mean, in standard errors, (E, 9)."""
    truths = TruthCache()
    made = make_plan(plan, truths)
    errors = errors_of_runs(made, range(count), truths)
    assert not any(errors.failure)
    rows = [result.row(t) for t in made.epochs - made.start]
    found = np.concatenate([errors.position_ned, errors.velocity_ned, errors.attitude], axis=2)
    sigma2 = np.einsum("kii->ki", result.total)[rows]
    square = np.mean((found - result.bias[rows]) ** 2, axis=0)
    known = sigma2 > 1e-20
    return np.asarray(np.where(known, square / np.where(known, sigma2, 1.0) - 1.0, 0.0) * np.sqrt(count / 2.0))


@pytest.mark.parametrize(
    "turning",
    [
        {**INDEXED, "encoder_bias_sigma_arcsec": 30.0, "encoder_noise_arcsec": 3.0, "wobble_arcsec": 5.0},
        *slow(
            {
                "type": "continuous",
                "rate_deg_s": 6.0,
                "encoder_bias_arcsec": [9.0, 0.0],
                "encoder_bias_sigma_arcsec": 30.0,  # without it the step rounds alike in every run
                "encoder_quantum_arcsec": 20.0,
            }
        ),
    ],
    ids=["sixteen positions", "continuous"],
)
def test_ensembles_of_turning_blocks(turning: dict[str, Any]) -> None:
    """N = 50 over five minutes; fails by chance with 0.3 % at most, see `ALLOWED`."""
    plan = moving(300.0, turning, grade="laser-standard")
    epochs = make_plan(plan).epochs
    result = budget(plan, times=epochs.tolist())
    assert np.abs(departures(plan, result, 50)).max() < ALLOWED


def _aided(seconds: float, noise: float = 1.0, **turning: Any) -> Scenario:
    """Return a rotating IMU with a filter, whose readings show the encoders' errors on arms and in the heading."""
    satellites = {"position_sigma_m": 1.5 * noise, "height_sigma_m": 3.0 * noise, "velocity_sigma_mps": 0.05 * noise}
    plan = moving(seconds, {**INDEXED, **turning}, grade="tactical")
    data = {
        **plan.contents(),
        "aiding": {
            "gnss": {"lever_arm_m": [4.0, 1.0, -3.0], **satellites},
            "dual_antenna": {"sigma_deg": 0.05, "rate_hz": 0.5},
        },
        "filter": {"gate": 0.0, "rate_hz": 2.0},
    }
    return Scenario.model_validate(data)


_OF_ENCODERS = {"encoder_bias_sigma_arcsec": 600.0, "encoder_noise_arcsec": 300.0}


def test_given_errors_of_the_angles_with_a_filter() -> None:
    """The difference of two runs of the same seed: the errors act on the readings, the estimate and the output.

    The readings of satellites have small noise: what it does through gains that differ by 1e-3 is not linear.
    """
    angles = {"encoder_bias_arcsec": [300.0, -200.0], "wobble_arcsec": 200.0}
    one, none = _aided(40.0, 0.01, **angles), _aided(40.0, 0.01)
    result = budget(one)
    found = aided_ensemble(one, result, 1)[0] - aided_ensemble(none, result, 1)[0]
    expected = result.mean["encoder_given"] + result.mean["wobble"]
    for rows, share in ((slice(0, 3), 0.015), (slice(3, 6), 0.03), (slice(6, 9), 0.003)):
        assert np.abs(found - expected)[:, rows].max() < share * np.abs(expected[:, rows]).max()
    assert np.abs(expected[:, 6:]).max() > 1e-3


@pytest.mark.slow
def test_ensemble_of_a_filter_on_a_turning_block() -> None:
    """N = 300 over 100 s; some 200 instants of nine components: 4.5 as for one that is 3.5."""
    plan = _aided(100.0, **_OF_ENCODERS)
    result = budget(plan)
    assert np.abs(standard_errors(aided_ensemble(plan, result, 300), result)).max() < 4.5


@pytest.mark.slow
def test_the_scenario_of_a_day() -> None:
    """N = 300 over 24 h: about 100 independent instants of 7 components; 4.5 is 3.5 for one at the same level."""
    plan = sinssim.load_scenario("rotating_unit")
    epochs = make_plan(plan).epochs
    result = budget(plan, times=epochs.tolist())
    assert np.abs(departures(plan, result, 300)).max() < 4.5


def test_errors_of_the_angles_are_those_of_a_run() -> None:
    """Exact sensors: what is given appears in a run with its sign; a bias of 1σ is that of the covariance."""
    turning = {
        **INDEXED,
        "encoder_bias_arcsec": [20.0, -30.0],
        "encoder_periodic_arcsec": 7.0,
        "wobble_arcsec": 4.0,
    }
    plan = moving(120.0, turning)
    result = budget(plan)
    assert {"encoder_given", "wobble"} <= set(result.mean)
    (error,) = run(plan).errors.values()
    rows = np.searchsorted(error.time, result.time + error.time[0] - 1e-6)
    assert np.abs(result.bias[:, 6:] - error.attitude[rows]).max() < 1e-8  # products of the angles, and the algorithm
    with_sigma = budget(moving(120.0, {**INDEXED, "encoder_bias_sigma_arcsec": 20.0}))
    outer, inner = (
        budget(moving(120.0, {**INDEXED, "encoder_bias_arcsec": bias})).mean["encoder_given"][:, 6:]
        for bias in ([20.0, 0.0], [0.0, 20.0])
    )
    expected = np.einsum("ki,kj->kij", outer, outer) + np.einsum("ki,kj->kij", inner, inner)
    assert with_sigma.total[:, 6:, 6:] == pytest.approx(expected, rel=1e-3, abs=1e-13)


def test_turning_divides_the_share_of_constant_errors() -> None:
    """An hour: the biases of the gyros leave less than a hundredth of what they do at rest, noise stays as it is."""
    parts = {}
    for name, turning in (("still", None), ("turning", {**INDEXED, "dwell_s": 30.0})):
        keys = {} if turning is None else {"rotation": turning}
        motion = {"great_circle": {**MOVING["great_circle"], "duration_s": 3600.0}}
        result = budget(
            scenario(**motion, imu={"rate_hz": 1.0 if turning is None else 5.0, "grade": "laser-standard", **keys})
        )
        parts[name] = {
            source: np.sqrt(p[-1, 0, 0] + p[-1, 1, 1]) for source, p in result.covariance.items() if p[-1, :2, :2].any()
        }
    assert parts["turning"]["gyro_bias"] < 0.01 * parts["still"]["gyro_bias"]
    assert parts["turning"]["gyro_arw"] == pytest.approx(parts["still"]["gyro_arw"], rel=0.01)
