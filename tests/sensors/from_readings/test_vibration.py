"""The level of vibration in readings of known noise, and the noise that it adds."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.from_readings.vibration import AddedNoise, vibration, vibration_noise
from sinssim.sensors.from_readings.windows import windows_of

RATE_HZ = 200.0
COUNT = 20_000


def readings(rates: Array, forces: Array) -> ImuData:
    time = np.arange(len(rates) + 1) / RATE_HZ
    return ImuData(time, rates / RATE_HZ, forces / RATE_HZ)


def test_the_level_of_white_noise_is_its_sigma() -> None:
    """A slow turn and a constant force leave it alone. A hundred windows of 200 samples: 0.5 % of 1σ each."""
    rng = np.random.default_rng(4)
    sigma = np.array([0.01, 0.03, 0.002])
    slow = 0.5 * np.sin(2.0 * np.pi * 0.1 * np.arange(COUNT) / RATE_HZ)[:, None]
    found = vibration(readings(slow + sigma * rng.standard_normal((COUNT, 3)), -9.8 + np.zeros((COUNT, 3))))
    assert len(found.time) == 100
    np.testing.assert_allclose(np.sqrt(np.mean(found.gyro**2, axis=0)), sigma, rtol=0.03)
    assert found.accel.max() < 1e-9
    assert found.jitter < 1e-9
    added = vibration_noise(found, 1.0, 0.5)
    # white noise of density N scatters a rate of one sample by N/√Δt
    np.testing.assert_allclose(np.sqrt(np.mean(added.gyro**2, axis=0)), sigma / np.sqrt(RATE_HZ), rtol=0.03)


def test_the_level_of_an_oscillation_is_its_rms() -> None:
    """30 Hz, well above the 5 Hz at which the running mean over 0.2 s takes an oscillation for motion."""
    time = np.arange(COUNT) / RATE_HZ
    shaking = np.outer(np.sin(2.0 * np.pi * 30.0 * time + 0.3), [1.0, 0.0, 0.0])
    found = vibration(readings(shaking, 2.0 * shaking))
    np.testing.assert_allclose(found.gyro[:, 0], np.sqrt(0.5), rtol=0.02)
    np.testing.assert_allclose(found.accel[:, 0], np.sqrt(2.0), rtol=0.02)
    assert found.gyro[:, 1:].max() < 1e-9


def densities(noise: AddedNoise, time: Array) -> Array:
    """Return the spectral densities of gyros and accelerometers at instants, (K, 6)."""
    return np.sum(noise.roots(time) ** 2, axis=-1).reshape(-1, 6)


def test_a_window_has_the_level_of_the_one_before() -> None:
    rates = np.zeros((600, 3))
    rates[200:400, 1] = np.tile((1.0, -1.0), 100)
    added = vibration_noise(vibration(readings(rates, rates)), 1.0, 0.0)
    variance = densities(added, np.array([0.5, 1.5, 2.5]))
    assert variance[:2, 1].max() < 1e-2 * variance[2, 1]
    assert not variance[:, 3:].any()
    np.testing.assert_allclose(variance[2, 1], 1.0 / RATE_HZ, rtol=0.02)


def test_jitter_of_the_stamps_is_measured() -> None:
    rng = np.random.default_rng(1)
    steps = 0.01 + 0.0005 * rng.standard_normal(4000)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    found = vibration(ImuData(time, np.zeros((4000, 3)), np.zeros((4000, 3))))
    assert found.jitter == pytest.approx(0.05, rel=0.1)


def test_a_slow_unit_shows_no_vibration() -> None:
    slow = ImuData(np.arange(101.0), np.zeros((100, 3)), np.zeros((100, 3)))
    with pytest.raises(InputError, match=r"needs samples every 0.0667 s or more often.*here are 100 samples of 1 s"):
        vibration(slow)


def test_added_noise_holds_from_its_instant_on() -> None:
    noise = AddedNoise(np.array([0.0, 10.0]), np.array([[1.0] * 3, [2.0] * 3]), np.array([[3.0] * 3, [4.0] * 3]))
    found = densities(noise, np.array([-1.0, 0.0, 9.9, 10.0]))
    np.testing.assert_array_equal(found[:, [0, 3]], [[1, 9], [1, 9], [1, 9], [4, 16]])


def test_windows() -> None:
    """Mean, variance and change of a ramp: a (t − ½), a²/12 over a second, a/2."""
    time = (np.arange(1000) + 0.5) / RATE_HZ
    ramp = np.outer(time, [1.0, 0.0, -2.0])
    found = windows_of(readings(ramp, ramp), 1.0, 0.5)
    np.testing.assert_allclose(found.end - found.begin, 1.0)
    np.testing.assert_allclose(np.diff(found.end), 0.5)
    np.testing.assert_allclose(found.mean[:, 0], found.end - 0.5, atol=1e-9)
    np.testing.assert_allclose(found.variance[:, 2], 4.0 / 12.0, rtol=1e-4)
    np.testing.assert_allclose(found.change[:, 2], -1.0, rtol=1e-9)
    with pytest.raises(InputError, match=r"a window of 0\.01 s needs at least 8 samples"):
        windows_of(readings(ramp, ramp), 0.01, 0.5)
