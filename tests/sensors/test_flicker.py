"""Covariances of flicker noise against the recursion's own matrices, term by term."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.sensors.flicker import DIRECT, RATES, STATIONARY, WEIGHTS, covariance, variance_of_mean
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu

LOST, SHARE = np.array(RATES), np.array(WEIGHTS)
KEPT = 1.0 - LOST
STATE = 1.0 / (np.add.outer(LOST, LOST) - np.outer(LOST, LOST))
"""P = D P D + 1 1ᵀ of x ← D x + 1 ν: each element over 1 − d_m d_n."""


def test_the_start_has_the_stationary_covariance() -> None:
    np.testing.assert_allclose(STATIONARY @ STATIONARY.T, STATE, rtol=1e-12)
    assert np.array_equal(STATIONARY, np.tril(STATIONARY))


def test_covariance_at_a_distance() -> None:
    lags = np.array([[0.0, 1.0, 2.5], [30.0, 1e4, 1e7]])
    expected = [[SHARE @ (KEPT**lag * (STATE @ SHARE)) for lag in row] for row in lags]
    np.testing.assert_allclose(covariance(lags), expected, rtol=1e-12)


def test_variance_of_a_mean_is_the_sum_over_all_pairs() -> None:
    reached = STATE @ SHARE + DIRECT
    lagged = np.array([SHARE @ (KEPT**lag * reached) for lag in range(500)])
    lagged[0] = SHARE @ STATE @ SHARE + 2.0 * DIRECT * SHARE.sum() + DIRECT**2
    counts = np.array([[1, 2, 3], [10, 77, 500]])
    expected = [
        [lagged[np.abs(np.subtract.outer(np.arange(n), np.arange(n)))].sum() / n**2 for n in row] for row in counts
    ]
    np.testing.assert_allclose(variance_of_mean(counts), expected, rtol=1e-9)
    assert np.isclose(variance_of_mean(77), expected[1][1], rtol=1e-9)


def test_flicker_of_accelerometers_starts_as_that_of_gyros() -> None:
    """400 runs of one second: both are Gaussian, of the same size for the same coefficient, and independent."""
    still = ImuData(np.array([0.0, 1.0]), np.zeros((1, 3)), np.zeros((1, 3)))
    section = Imu(grade="ideal", rate_hz=1.0, gyro_flicker_deg_h=1.0, accel_flicker_ug=1.0)
    runs = [emulate(still, section, seed) for seed in range(400)]
    gyro = np.array([run.dtheta[0] for run in runs]).ravel() / (np.pi / 648_000.0)
    accel = np.array([run.dvel[0] for run in runs]).ravel() / 9.80665e-6
    assert np.std(accel) / np.std(gyro) == pytest.approx(1.0, abs=0.1)  # 1200 values each: 2.9 % of their ratio
    for values in (gyro, accel):  # a median of 0.6745 σ; heavy tails would have less
        assert np.median(np.abs(values)) / np.std(values) == pytest.approx(0.6745, abs=0.07)
    assert abs(np.corrcoef(gyro, accel)[0, 1]) < 0.12
