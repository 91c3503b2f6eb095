"""The level of vibration in readings of known noise, and the noise that it adds."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.aiding.standstill import windows_of
from sinssim.sensors.vibration_noise import AddedNoise, Change, Vibration, vibration, vibration_noise

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


def test_the_level_of_what_alternates() -> None:
    """Of n = 7 samples four are opposite to the middle one: a (1 + 1/n), which counts √(n/(n − 1)) times."""
    time = np.arange(121) / 30.0
    signs = (-1.0) ** np.arange(120)[:, None]
    rates, forces = signs * (0.2, 0.3, 0.5) + (1.0, -2.0, 3.0), signs * (2.0, 7.0, 3.0)
    found = vibration(ImuData(time, rates / 30.0, forces / 30.0), 1.0)
    root = 8.0 / 7.0 * np.sqrt(7.0 / 6.0)
    np.testing.assert_allclose(found.time, [1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(found.gyro[1:3], np.tile(root * np.array((0.2, 0.3, 0.5)), (2, 1)), rtol=1e-9)
    np.testing.assert_allclose(found.accel[1:3], np.tile(root * np.array((2.0, 7.0, 3.0)), (2, 1)), rtol=1e-9)
    assert found.interval == pytest.approx(1.0 / 30.0)


def test_densities_of_windows() -> None:
    """κ s √Δt of the window before, from a window before the first one on."""
    gyro = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]])
    found = vibration_noise(Vibration(np.array((2.0, 3.5, 5.0)), gyro, 10.0 * gyro, 0.04, 0.0), 0.5, 0.25)
    np.testing.assert_allclose(found.time, [0.5, 2.0, 3.5, 5.0])
    np.testing.assert_allclose(found.gyro, 0.5 * 0.2 * gyro[[0, 0, 1, 2]])
    np.testing.assert_allclose(found.accel, 0.25 * 0.2 * 10.0 * gyro[[0, 0, 1, 2]])


def _noise(time: tuple[float, ...], gyro: tuple[float, ...], accel: tuple[float, ...]) -> AddedNoise:
    return AddedNoise(np.array(time), np.outer(gyro, (1.0, 2.0, 4.0)), np.outer(accel, (1.0, 3.0, 5.0)))


def test_noises_together_and_in_reverse_time() -> None:
    """3 and 4 are 5 together; a noise from 6 s on in a run from 2 to 12 s lasts until 8 s in reverse time."""
    both = _noise((0.0, 6.0), (3.0, 5.0), (8.0, 6.0)).plus(_noise((0.0, 4.0), (4.0, 12.0), (15.0, 8.0)))
    np.testing.assert_array_equal(both.time, [0.0, 4.0, 6.0])
    np.testing.assert_allclose(both.gyro[:, 1], 2.0 * np.array((5.0, np.hypot(3.0, 12.0), 13.0)))
    np.testing.assert_allclose(both.accel[:, 2], 5.0 * np.array((17.0, np.hypot(8.0, 8.0), 10.0)))
    back = _noise((0.0, 6.0), (3.0, 5.0), (8.0, 6.0)).mirrored(2.0, 12.0)
    np.testing.assert_allclose(densities(back, np.array((7.9, 8.1)))[:, [0, 3]], [[25.0, 36.0], [9.0, 64.0]])


def test_changes_drive_states() -> None:
    """A jump at 2.5 s falls into the second interval, and the density lasts from then on: half of it, then all."""
    change = Change(2.5, "gyro bias", np.diag((1.0, 2.0, 3.0)), np.diag((0.1, 0.2, 0.4)))
    other = Change(0.5, "no state", np.eye(3), np.eye(3))
    noise = AddedNoise(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)), (change, other))
    place = slice(6, 9)
    found = list(noise.of_states(np.array((1.0, 2.0, 3.0, 5.0)), {"gyro bias": place}))
    assert [(k, at) for k, at, _ in found] == [(1, place), (1, place), (2, place)]
    expected = [np.diag((1.0, 2.0, 3.0)), 0.5 * np.diag((0.1, 0.2, 0.4)), 2.0 * np.diag((0.1, 0.2, 0.4))]
    for (_, _, covariance), right in zip(found, expected, strict=True):
        np.testing.assert_allclose(covariance, right)
