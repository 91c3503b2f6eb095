"""The filter on a redundant set: noise of the combination, exclusions, alignment, consistency over runs."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import Array
from sinssim.experiments.ensembles import run_seed
from sinssim.experiments.run.run_result import Run
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import choice, filter_model, noise_of_combination, states
from sinssim.sensors.redundant_set_errors import spread
from sinssim.sensors.sensor_set_section import READY
from sinssim.simulation.truth_comparison import InertialParameters
from sinssim.statistics.chi_square import mean_square_band
from tests.analyses.error_budget.worlds import SHORT_TURN
from tests.sensors.sets.test_combination import SKEWED
from tests.slow import slow

STEP = {"type": "bias-step", "from_s": 20.0, "gyro_deg_h": (0.0, 0.0, 3000.0, 0.0, 0.0, 0.0)}
SPIKE = {"type": "spike", "at_s": 30.0, "accel_mm_s": (0.0, 0.0, 0.0, 0.0, 20.0, 0.0)}
"""Found in the next sample, with hardly any effect before."""


def scenario(sensor_set: dict[str, Any] | None, **more: Any) -> Scenario:
    imu = {"grade": "tactical", "rate_hz": 20.0, **more.pop("imu", {})}
    if sensor_set is not None:
        imu["sensor_set"] = {"type": "redundant", "windows_s": (1.0,), **sensor_set}
    return Scenario.model_validate(
        {
            "name": "redundant", "motion": SHORT_TURN, "imu": imu,
            "navigation": {"initial_error": {"velocity_sigma_mps": 0.05, "tilt_sigma_arcmin": 3.0,
                                             "heading_sigma_arcmin": 10.0}},
            "aiding": {"gnss": {}}, "filter": {"rate_hz": 5.0, "diagnose": False}, **more,
        }
    )  # fmt: skip


def test_noise_of_the_filter_is_smaller_by_the_root_of_3_over_n() -> None:
    states = {"filter": {"states": ("gyro bias", "accelerometer bias")}}
    one, six = (filter_model(scenario(own, **states)) for own in (None, {}))
    factor = np.sqrt(0.5)
    assert six.gyro_noise == pytest.approx(factor * one.gyro_noise, rel=1e-12)
    assert six.accel_noise == pytest.approx(factor * one.accel_noise, rel=1e-12)
    assert six.sigma[9:15] == pytest.approx(factor * one.sigma[9:15], rel=1e-12)
    assert six.covariance == pytest.approx(np.diag(six.sigma**2), abs=1e-12 * six.sigma[12] ** 2)
    assert noise_of_combination(six, scenario({}), (), np.arange(5.0)) is None


def test_noise_without_symmetry_has_the_covariance_of_least_squares() -> None:
    plan = scenario({"directions": SKEWED}, filter={"states": ("gyro bias", "accelerometer bias")})
    model = filter_model(plan)
    added = noise_of_combination(model, plan, (), np.arange(5.0))
    assert added is not None
    root = added.roots(np.zeros(1))[0, 0]
    single = float(expected_errors(scenario(None).imu).sigma.gyro.random_walk)
    h = np.array(SKEWED)
    p = np.linalg.inv(h.T @ h)
    assert model.gyro_noise**2 * np.eye(3) + root @ root.T == pytest.approx(
        single**2 * p, rel=1e-9, abs=1e-12 * single**2
    )
    bias = float(expected_errors(scenario(None).imu).sigma.gyro.bias[0])
    assert model.covariance[9:12, 9:12] == pytest.approx(bias**2 * p, rel=1e-9, abs=1e-12 * bias**2)


@cache
def excluded() -> Run:
    return sinssim.run(scenario({}, imu={"faults": (STEP, SPIKE)}))


def test_exclusions_change_the_noise_and_the_biases() -> None:
    run = excluded()
    assert [one.excluded[0].sensor for one in run.sensed.readings.monitored] == [3, 5]
    plan, axes = run.scenario, READY["dodecahedron"]
    assert run.aided is not None
    model = run.aided.estimate.model
    added = noise_of_combination(model, plan, run.sensed.readings.monitored, run.sensed.measured.time)
    assert added is not None
    used = np.arange(6) != 2
    increase = spread(axes, used) - spread(axes)
    assert np.linalg.matrix_rank(increase, tol=1e-9) == 1  # one sensor less
    roots = added.roots(np.array([10.0, 25.0, 35.0]))
    assert not roots[0].any()
    assert roots[1, 0] @ roots[1, 0].T == pytest.approx(2.0 * model.gyro_noise**2 * increase, abs=1e-20)
    assert not roots[1, 1].any()
    assert roots[2, 1].any()
    jump = next(change for change in added.changes if change.block == "gyro bias")
    sigma = float(expected_errors(scenario(None).imu).sigma.gyro.bias[0])
    assert jump.time == pytest.approx(20.05, abs=0.11)
    assert jump.jump == pytest.approx(sigma**2 * increase, rel=1e-6, abs=1e-9 * sigma**2)


def test_an_exclusion_of_a_walking_bias() -> None:
    """(σ² + K² t)(P_after − P_before), t from the start of the data; an instability gathers nothing."""
    walk, instability = np.radians(30.0 / 3600.0) / 60.0, np.radians(7.0 / 3600.0)
    plan = scenario({}, imu={"gyro_rrw_deg_h_sqrt_h": 30.0, "gyro_instability_deg_h": 7.0})
    model, axes = filter_model(plan), READY["dodecahedron"]
    edges = 3.0 + 0.5 * np.arange(41)
    used = [np.ones((40, 6), dtype=bool) for _ in range(2)]
    used[0][25:, 4] = False  # from the 26th sample on, which begins at 15.5 s
    used[1][10:, 1] = False
    monitored: Any = [SimpleNamespace(kind=kind, used=own) for kind, own in zip(("gyro", "accel"), used, strict=True)]
    added = noise_of_combination(model, plan, monitored, edges)
    assert added is not None
    np.testing.assert_allclose(added.time, [3.0, 8.0, 15.5])
    h = np.array(axes)
    whole, without = (np.linalg.inv(rows.T @ rows) for rows in (h, np.delete(h, 4, axis=0)))
    single = float(expected_errors(scenario(None).imu).sigma.gyro.bias[0])
    changes = {change.block: change for change in added.changes if change.time == 15.5}
    expected = (single**2 + walk**2 * 12.5) * (without - whole)
    np.testing.assert_allclose(changes["gyro bias"].jump, expected, rtol=1e-6, atol=1e-9 * single**2)
    np.testing.assert_allclose(
        changes["gyro bias"].density, walk**2 * (without - whole), rtol=1e-6, atol=1e-9 * walk**2
    )
    expected = instability**2 * (without - whole)
    np.testing.assert_allclose(changes["gyro instability"].jump, expected, rtol=1e-6, atol=1e-9 * instability**2)
    # white noise: that of the smallest direction of all sensors is in the model, the rest is added
    noise = float(expected_errors(scenario(None).imu).sigma.gyro.random_walk)
    least = np.linalg.eigvalsh(whole)[0]
    root = added.gyro[2]
    np.testing.assert_allclose(root @ root.T, noise**2 * (without - least * np.eye(3)), rtol=1e-6, atol=1e-9 * noise**2)
    assert not added.gyro[1].any()
    assert added.accel[1].any()
    assert {change.time for change in added.changes} == {8.0, 15.5}


def test_true_parameters_follow_the_combination() -> None:
    """The true biases are what the readings of sensors with biases alone show, before and after the exclusions."""
    biases = {"gyro_bias_sigma_deg_h": 5.0, "accel_bias_sigma_ug": 500.0}
    run = sinssim.run(scenario({}, imu={"grade": "ideal", "faults": (STEP, SPIKE), **biases}))
    used = run.sensed.readings.monitored[0].used, run.sensed.readings.monitored[1].used
    edges = run.sensed.measured.time
    true = InertialParameters(run.sensed.errors, edges, run.scenario.seed, run.scenario.imu.sensor_set, used)
    samples = np.array([100, 300, 500, 900])
    (found,) = true.at(edges[samples + 1])
    for block, measured, ideal in (
        ("gyro bias", run.sensed.measured.dtheta, run.truth.ideal.dtheta),
        ("accelerometer bias", run.sensed.measured.dvel, run.truth.ideal.dvel),
    ):
        error = (measured - ideal)[samples] / 0.05
        assert found[block] == pytest.approx(error, abs=1e-6 * np.abs(error).max())
        # the exclusions change them far more than that
        assert np.ptp(found[block], axis=0).max() > 1e-3 * np.abs(error).max()


def _nees(runs: list[Run], time: float) -> Array:
    found = []
    for run in runs:
        assert run.aided is not None
        estimate = run.aided.estimate
        row = int(np.searchsorted(estimate.time[estimate.rows], time))
        error = run.aided.state_errors_at(estimate.rows[row : row + 1])[0]
        known = np.flatnonzero(estimate.covariance[row].diagonal() > 0.0)
        p = estimate.covariance[row][np.ix_(known, known)]
        found.append(error[known] @ np.linalg.solve(p, error[known]) / len(known))
    return np.array(found)


@pytest.mark.parametrize(
    ("sensor_set", "imu"),
    [({}, {"faults": (STEP, SPIKE)}), ({"directions": SKEWED, "monitoring": "none"}, {})],
    ids=["exclusions", "skewed"],
)
@pytest.mark.parametrize("count", [2, *slow(12)])
def test_filter_is_consistent(sensor_set: dict[str, Any], imu: dict[str, Any], count: int) -> None:
    """NEES of all states over some runs at three times; fails by chance with 3 · 0.1 %."""
    calibrated = {"gyro_bias_sigma_deg_h": 2.0, "gyro_scale_sigma_ppm": 2000.0, "gyro_misalignment_sigma_arcsec": 400.0}
    plan = scenario(sensor_set, imu=imu, compensation=calibrated)
    runs = [sinssim.run(plan.model_copy(update={"seed": run_seed(5, i)})) for i in range(count)]
    freedom = count * runs[0].aided.estimate.model.size
    band = mean_square_band(freedom, 0.999)
    for time in (15.0, 27.0, 49.0):
        assert band.low < np.mean(_nees(runs, time)) < band.high, time


@pytest.mark.parametrize("by", ["filter", "navigation"])
def test_alignment_at_rest(by: str) -> None:
    """Ten minutes: the error of the heading is that of the combined gyros, σ/(U cos φ), for each of 3 runs."""
    parked = {
        "latitude_deg": 50.0,
        "longitude_deg": 14.5,
        "altitude_m": 300.0,
        "heading_deg": 30.0,
        "duration_s": 130.0,
    }
    imu = {"grade": "laser-standard", "rate_hz": 20.0, "gyro_arw_deg_sqrt_h": 0.0,
           "sensor_set": {"type": "redundant", "windows_s": (1.0,)}}  # fmt: skip
    align: dict[str, Any] = (
        {"filter": {"alignment_s": 120.0, "diagnose": False}, "aiding": {"zero_velocity": {}}}
        if by == "filter"
        else {"navigation": {"alignment": {"duration_s": 120.0}}}
    )
    plan = Scenario.model_validate({"name": "aligned", "parked": parked, "imu": imu, **align})
    errors = []
    for i in range(3):
        run = sinssim.run(plan.model_copy(update={"seed": run_seed(5, i)}))
        if by == "filter":
            assert run.aided is not None
            errors.append(run.aided.error_at(np.zeros(1, np.intp)).attitude[0, 2])
        else:
            errors.append(run.errors["quaternion"].attitude[0, 2])
    sigma = expected_errors(plan.imu).sigma.gyro.bias[0] / (7.292115e-5 * np.cos(np.radians(50.0)))
    band = mean_square_band(3, 0.999)
    assert band.low < np.mean(np.square(errors)) / sigma**2 < band.high


def test_errors_of_three_axes_are_no_states_of_single_sensors() -> None:
    """The square of the force along a skew axis has products of three axes: it is left out, and refused by name."""
    imu = {"accel_quadratic_sigma_ug_per_g2": 4000.0, "gyro_g_sensitivity_sigma_deg_h_per_g": 100.0}
    of_axes, of_set = (scenario(sensor_set, imu=imu) for sensor_set in (None, {}))
    further = {"accelerometer quadratic", "gyro g-sensitivity"}
    assert further <= set(states(of_axes))
    assert not further & set(states(of_set))
    assert sum(line.endswith(", and no state of a redundant set") for line in choice(of_set)) == 2
    for tables in ({"filter": {"states": ["gyro cubic"]}}, {"filters": [{"name": "b", "states": ["gyro cubic"]}]}):
        with pytest.raises(ValueError, match=r'filter\.states: a redundant set has no state "gyro cubic"'):
            scenario({}, **tables)
