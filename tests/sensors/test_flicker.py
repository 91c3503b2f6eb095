"""Covariances of flicker noise against the recursion's own matrices, term by term."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import Array, ImuData
from sinssim.sensors.flicker import (
    DIRECT,
    RATES,
    STATIONARY,
    WEIGHTS,
    covariance,
    processes,
    shortest_time,
    smoothed_over,
    variance_of_mean,
)  # fmt: skip
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


B, WHITE, LASTS = 5e-8, 1e-7, 3600.0


def test_the_spectrum_of_a_sum_of_processes() -> None:
    """B²/(2πf), two-sided, within 2/cosh(π²/ln r), and 1 % by the ends, from 1/T to a fortieth of the fastest."""
    first = shortest_time(B, WHITE)
    assert 2.0 * B**2 / np.pi * first == pytest.approx(0.05 * WHITE**2, rel=1e-12)
    f = np.geomspace(1.0 / LASTS, 0.025 / first, 400)
    for count, ripple in ((None, 0.0208), (5, 0.0586), (8, 0.00246)):
        sigma, times, rest = processes(B, WHITE, LASTS, count)
        density = rest**2 + np.sum(2.0 * sigma**2 * times / (1.0 + (2.0 * np.pi * np.outer(f, times)) ** 2), axis=1)
        off = density * 2.0 * np.pi * f / B**2 - 1.0
        step = np.log(times[1] / times[0])
        assert 2.0 / np.cosh(np.pi**2 / step) == pytest.approx(ripple, rel=0.1)
        assert 0.8 * ripple < np.abs(off).max() < ripple + 0.011
        assert len(times) == (count or 6)
        np.testing.assert_allclose(sigma[:-1] ** 2, B**2 / np.pi * step, rtol=1e-12)


def test_the_allan_deviation_of_the_sum_is_that_of_the_emulated_noise() -> None:
    """By the variances of means over T and 2T, of the emulator's samples and of exponential correlations."""
    sigma, times, rest = processes(B, WHITE, LASTS)
    average = np.geomspace(3.0 * times[0], 0.3 * LASTS, 30)

    def of_mean(length: Array) -> Array:
        x = np.divide.outer(length, times)
        return np.asarray(np.sum(sigma**2 * 2.0 * (x + np.expm1(-x)) / x**2, axis=1) + rest**2 / length)

    def emulated(length: Array) -> Array:
        return B**2 * variance_of_mean(100.0 * length)

    summed, made = (np.sqrt(2.0 * (of(average) - of(2.0 * average))) for of in (of_mean, emulated))
    np.testing.assert_allclose(made, np.sqrt(2.0 * np.log(2.0) / np.pi) * B, rtol=0.003)
    np.testing.assert_allclose(summed, made, rtol=0.02)
    window = smoothed_over(B, WHITE)  # the mean over it varies as all processes together
    assert np.sum(sigma**2) == pytest.approx(float(B**2 * variance_of_mean(100.0 * window)), rel=1e-9)
    x = window / np.geomspace(shortest_time(B, WHITE) * 1e-6, 1e12, 400_001)  # ∫ 2(x + e⁻ˣ − 1)/x² d ln τ over all τ
    every = np.trapezoid(2.0 * (x + np.expm1(-x)) / x**2, -np.log(x))
    assert every == pytest.approx(np.log(1e12 / shortest_time(B, WHITE)), rel=1e-3)


def test_a_run_shorter_than_the_noise_has_two_processes() -> None:
    """A decade from the shortest time on, and a slower one; without white noise the shortest is 0.1 s."""
    assert shortest_time(B, 0.0) == 0.1
    _, times, _ = processes(B, 0.0, 0.5)
    np.testing.assert_allclose(times[0], 0.1 * 10.0**0.5)
    assert len(times) == 2
