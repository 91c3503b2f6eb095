"""Flicker noise as a sum of Gauss-Markov processes: consistent with the states, and pessimistic with a random walk."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

import sinssim
from sinssim.estimation import error_model
from sinssim.estimation.consistency import nees
from sinssim.estimation.error_dynamics import reading_error
from sinssim.estimation.filter_start import _slow, at_rest
from sinssim.scenario import load_scenario
from sinssim.scenario.filter_model import choice, filter_model, inertial_sigma, notes, states
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from tests.slow import slow

NOISES = {"gyro_flicker_deg_h": 0.05, "gyro_arw_deg_sqrt_h": 0.0005, "accel_flicker_ug": 20.0, "rate_hz": 5.0}
WITHOUT = 'filter.states=["gyro bias", "accelerometer bias", "accelerometer scale", "accelerometer misalignment"]'


def parked(*sets: str, seconds: float = 300.0) -> sinssim.Scenario:
    """Return a block at rest whose flicker is far above its white noise after a few seconds, aligned by it."""
    return load_scenario("gyrocompassing", [
        *(f"imu.{key}={value}" for key, value in NOISES.items()), f"parked.duration_s={seconds}",
        "filter.alignment_s=60", *sets,
    ])  # fmt: skip


def squares(seed: int, *sets: str, seconds: float = 300.0) -> tuple[float, float]:
    """Return the mean NEES over a run of the attitude, and of bias and flicker together, three components each."""
    aided = sinssim.run(parked(f"seed={seed}", *sets, seconds=seconds)).aided
    assert aided is not None
    model, p = aided.estimate.model, aided.estimate.covariance[20::30]
    errors = aided.state_errors_at(aided.estimate.rows[20::30])
    seen = sum(m for name, m in model.compared.items() if name in ("gyro bias", "gyro flicker"))
    rate = nees(errors @ seen.T, seen @ p @ seen.T)
    return float(np.mean(nees(errors, p, model.slices["attitude"]))), float(np.mean(rate))


@pytest.mark.parametrize("runs", [2, *slow(20)])
def test_the_filter_is_consistent_with_the_processes_and_not_without(runs: int) -> None:
    """The mean of 3 squares over n runs is χ² of 3n degrees over n if the epochs of a run have the same errors, and
    varies less as they do not; it is outside of 99.8 % by chance in 0.2 %. A filter with a random walk takes the drift
    for far larger."""
    low, high = chi2.ppf((0.001, 0.999), 3 * runs) / runs
    seconds = 240.0 if runs == 2 else 900.0
    sums = np.mean([squares(seed, seconds=seconds) for seed in range(runs)], axis=0)
    assert np.all((low < sums) & (sums < high))
    walk = np.mean([squares(seed, WITHOUT, seconds=seconds) for seed in range(runs)], axis=0)
    assert np.all(walk < 0.5 * sums)
    if runs > 2:
        assert np.all(walk < low)


def test_only_the_sum_of_the_processes_is_compared() -> None:
    model = filter_model(parked(), 300.0)
    first = model.slices["gyro flicker 1"]
    count = len(model.sums["gyro flicker"])
    assert first.stop - first.start == 3
    np.testing.assert_array_equal(
        model.compared["gyro flicker"][:, first.start : first.start + 3 * count], np.tile(np.eye(3), count)
    )
    assert sum(len(matrix) for matrix in model.compared.values()) == model.size - 2 * 3 * (count - 1)
    effect = reading_error(model, "gyro", np.zeros((1, 3)), np.zeros((1, 3)))[0]
    np.testing.assert_array_equal(
        effect, model.compared["gyro flicker"] + np.eye(model.size)[model.slices["gyro bias"]]
    )
    assert not np.any(model.fed_back[first])


def test_the_key_sets_the_number_and_check_says_it() -> None:
    lines = choice(parked())
    assert {"gyro flicker", "accelerometer flicker"} <= set(states(parked()))
    assert any(line.startswith("  gyro flicker is the sum of 5 Gauss-Markov processes") for line in lines)
    assert len(filter_model(parked("filter.flicker_processes=3"), 300.0).sums["gyro flicker"]) == 3
    assert not filter_model(parked(WITHOUT), 300.0).sums
    idle = "filter.flicker_processes has no effect: no state of the filter is flicker noise."
    for sets, said in ((["filter.flicker_processes=3"], False), (["filter.flicker_processes=3", WITHOUT], True)):
        assert (idle in list(notes(parked(*sets)))) is said
    bias = ImuErrors(TriadErrors(bias=np.full(3, 1e-8), flicker=1e-9, random_walk=1e-7), TriadErrors())
    model = error_model(bias, imu=("gyro bias", "gyro flicker"))
    np.testing.assert_array_equal(model.sigma[model.slices["gyro bias"]], 1e-8)
    assert model.gyro_noise == pytest.approx(1e-7 * np.sqrt(1.05), rel=1e-12)


def test_an_alignment_ties_the_slow_processes_to_the_attitude() -> None:
    """The heading's error by a constant rate is shared by bias and slow processes as their variances."""
    scenario = parked(seconds=120.0)
    run = sinssim.run(scenario)
    model, sigma = filter_model(scenario, 120.0), inertial_sigma(scenario)
    measured, trajectory = run.sensed.measured, run.truth.trajectory
    count = round(60.0 * scenario.imu.rate_hz)
    start = at_rest(measured, trajectory.state(0.0), model, sigma, count).covariance
    assert start is not None
    heading, slow_ones = model.slices["attitude"].stop - 1, _slow(model, "gyro", 60.0)
    assert slow_ones
    by_bias = start[heading, model.slices["gyro bias"]] / model.sigma[model.slices["gyro bias"]] ** 2
    assert np.any(by_bias)
    for block in slow_ones:
        np.testing.assert_allclose(start[heading, model.slices[block.name]], by_bias * block.sigma**2, rtol=1e-9)
    scale = np.sqrt(start.diagonal())
    assert np.linalg.eigvalsh(start / np.outer(scale, scale)).min() > -1e-9
