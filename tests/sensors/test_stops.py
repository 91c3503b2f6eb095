"""Stops in readings of a known course: rest with an idling engine, creeping, and what cannot be learned from."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import ImuData, Measurements
from sinssim.errors import InputError
from sinssim.sensors.aiding.standstill import find_stops, learn_rest, standstill

RATE_HZ = 100.0
GYRO, ACCEL = np.radians([0.6, 2.4, 0.07]), np.array([0.05, 0.05, 0.13])
"""Shaking by an engine, 1σ of a sample, as a car's on a cold morning."""


def idling(seconds: float, seed: int, push: float = 0.0, turn: float = 0.0) -> ImuData:
    """Return readings at rest up to half the time; then the vehicle accelerates or turns without more shaking."""
    rng = np.random.default_rng([2, seed])
    count = round(seconds * RATE_HZ)
    later = (np.arange(count) >= count // 2)[:, None]
    rate = np.radians([0.05, -0.1, 0.2]) + GYRO * rng.standard_normal((count, 3)) + later * [0.0, 0.0, turn]
    force = [-0.3, 0.2, -9.8] + ACCEL * rng.standard_normal((count, 3)) + later * [push, 0.0, 0.0]
    return ImuData(np.arange(count + 1) / RATE_HZ, rate / RATE_HZ, force / RATE_HZ)


@pytest.mark.parametrize(("push", "turn"), [(0.3, 0.0), (0.0, np.radians(2.0))])
def test_a_vehicle_that_creeps_off_on_its_engine_no_longer_stands(push: float, turn: float) -> None:
    """0.3 m/s² or 2 °/s without more shaking: the stop ends within half a second."""
    for seed in range(5):
        imu = idling(40.0, seed, push, turn)
        rest = learn_rest(imu, spans=[(0.0, 15.0)])
        spans = find_stops(imu, rest).spans
        inside = [(a, b) for a, b in spans if a < 20.0]
        assert sum(min(b, 20.0) - a for a, b in inside) > 18.0
        assert max(b for _, b in inside) < 20.5
        if turn:
            assert len(inside) == len(spans)


def test_rest_is_what_it_is() -> None:
    imu = idling(60.0, 3)
    rest = learn_rest(imu, spans=[(0.0, 60.0)])
    np.testing.assert_allclose(np.sqrt(rest.variance), [*GYRO, *ACCEL], rtol=0.05)
    np.testing.assert_allclose(rest.mean[:3], np.radians([0.05, -0.1, 0.2]), atol=4.0 * GYRO.max() / np.sqrt(6000.0))
    # the mean of a hundred samples of white noise scatters by a tenth; of 60 windows the median by 15 %
    np.testing.assert_allclose(rest.scatter, np.array([*GYRO, *ACCEL]) / 10.0, rtol=0.6)
    by_fixes = learn_rest(imu, velocity=fixes(0.0))
    np.testing.assert_allclose(by_fixes.variance, rest.variance, rtol=0.02)


def fixes(speed: float) -> Measurements:
    time = np.arange(1.0, 60.0)
    value = np.tile((speed, 0.0, 0.0), (len(time), 1))
    return Measurements("gnss-velocity", time, time, value, np.full((len(time), 3), 0.05))


def test_fixes_veto_a_stop() -> None:
    imu = idling(60.0, 3)
    rest = learn_rest(imu, spans=[(0.0, 60.0)])
    assert find_stops(imu, rest, velocity=fixes(0.0)).spans[-1, 1] == pytest.approx(60.0)
    vetoed = find_stops(imu, rest, velocity=fixes(0.5)).spans
    assert not len(vetoed)


def test_what_cannot_be_learned_is_refused() -> None:
    imu = idling(60.0, 1)
    with pytest.raises(InputError, match="give velocity fixes, or spans"):
        learn_rest(imu)
    with pytest.raises(InputError, match=r"stands for 0 s of the data.*from 5 s or more"):
        learn_rest(imu, velocity=fixes(3.0))
    with pytest.raises(InputError, match=r"stands for 2 s of the data"):
        learn_rest(imu, spans=[(0.0, 2.0)])


def test_readings_lie_within_the_stops() -> None:
    imu = idling(30.0, 1)
    rest = learn_rest(imu, spans=[(0.0, 15.0)])
    stops = find_stops(imu, rest)
    velocity, rate = standstill(stops, velocity_sigma=0.05, rate_hz=2.0)
    for m in (velocity, rate):
        assert all(any(a + 0.499 < t < b + 1e-6 for a, b in stops.spans) for t in m.time)
        assert not m.value.any()
    np.testing.assert_array_equal(velocity.sigma[0], [0.05] * 3)
    np.testing.assert_allclose(rate.sigma[0], rest.scatter[:3] * np.sqrt(2.0))  # half the time
    assert not standstill(find_stops(idling(30.0, 1, 5.0), rest, ratio=1e-6))[0].time.size


def test_the_scatter_is_that_of_the_means_of_the_windows() -> None:
    """Offsets that change every second, 1σ of 3e-4 rad/s and 0.02 m/s², without any noise within a second."""
    rng = np.random.default_rng(5)
    sigma = np.repeat((3e-4, 0.02), 3)
    offset = np.repeat(rng.normal(size=(2000, 6)) * sigma, 10, axis=0)
    time = 0.1 * np.arange(20_001)
    force = offset[:, 3:] + np.array([0.0, 0.0, -9.8])
    rest = learn_rest(ImuData(time, 0.1 * offset[:, :3], 0.1 * force), spans=[(0.0, 2000.0)])
    np.testing.assert_allclose(rest.scatter, sigma, rtol=0.12)  # the median of 2000 is good to 4 %
