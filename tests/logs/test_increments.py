"""Increments from rates with jitter, from increments with gaps, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sinssim
from sinssim.arguments import checked_increments
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import InertialStream, bridge_noise, gap_words, made_increments
from tests.logs.drive import drive

TRUTH = drive(40.0)


def rates(time: np.ndarray) -> InertialStream:
    gyro, accel = TRUTH.rates(time)
    return InertialStream(time, gyro, accel)


def final_error(imu: sinssim.ImuData) -> float:
    """Return the horizontal error at the end of navigation from the true state, m."""
    solution = sinssim.navigate(imu, TRUTH.state(float(imu.time[0])))
    end = TRUTH.state(float(imu.time[-1]))
    return float(np.hypot(solution.latitude[-1] - end.latitude, solution.longitude[-1] - end.longitude) * 6.37e6)


def test_instantaneous_rates_converge_with_the_square_of_the_interval() -> None:
    coarse, fine = (
        final_error(made_increments(rates(np.arange(0.0, 39.0 + step / 2, step))).imu) for step in (0.1, 0.05)
    )
    assert 3.5 < coarse / fine < 4.5


def test_jitter_of_true_sampling_instants_does_no_harm() -> None:
    jitter = np.random.default_rng(1).uniform(-0.002, 0.002, 3900)
    time = np.arange(3900) * 0.01 + 0.005 + jitter
    even = final_error(made_increments(rates(np.arange(3900) * 0.01 + 0.005)).imu)
    assert final_error(made_increments(rates(time)).imu) < 2.0 * even + 1e-3


def test_even_stamps_remove_a_logger_s_jitter() -> None:
    time = np.arange(3900) * 0.01 + 0.005
    stream = rates(time)
    noisy = replace(stream, time=time + np.random.default_rng(1).uniform(-0.002, 0.002, 3900))
    made = made_increments(noisy, stamps="even").imu
    assert np.abs(made.time - time).max() < 2e-4  # a line through 3900 stamps of 1.2 ms rms
    assert np.abs(np.diff(made.time) - 0.01).max() < 1e-6


def test_mean_rates_and_increments_are_the_same_thing() -> None:
    imu = TRUTH.increments(100.0)
    of_increments = InertialStream(imu.time[1:], imu.dtheta, imu.dvel, "increments")
    means = InertialStream(imu.time[1:], imu.dtheta * 100.0, imu.dvel * 100.0)
    for made in (made_increments(of_increments), made_increments(means, readings="mean")):
        np.testing.assert_allclose(made.imu.time, imu.time, atol=1e-9)
        np.testing.assert_allclose(made.imu.dtheta, imu.dtheta, atol=1e-12)
        np.testing.assert_allclose(made.imu.dvel, imu.dvel, atol=1e-9)
        assert not len(made.gaps)


@pytest.mark.parametrize("kind", ["rates", "increments", "with intervals"])
def test_a_gap_is_bridged_and_told(kind: str) -> None:
    """Five lost samples in a smooth turn: the bridge is in error by the curvature over 60 ms, millimetres a second."""
    imu = TRUTH.increments(100.0)
    lost = np.r_[0:2500, 2505 : len(imu)]
    if kind == "rates":
        stream = rates(imu.time[1:][lost])
    else:
        interval = np.full((len(lost), 2), 0.01) if kind == "with intervals" else None
        stream = InertialStream(imu.time[1:][lost], imu.dtheta[lost], imu.dvel[lost], "increments", interval)
    made = made_increments(stream)
    np.testing.assert_allclose(made.gaps, [[imu.time[2500], 0.05]], atol=1e-9)
    (sentence,) = gap_words(made.gaps)
    assert "at 1 place, 0.05 s in all" in sentence
    assert f"t = {imu.time[2500]:.3f} s" in sentence
    checked_increments(made.imu)  # no interval is left that counts as a gap
    whole = (made.imu.time >= 24.9) & (made.imu.time <= 25.2)
    assert np.diff(made.imu.time[whole]).max() < 0.0101
    inside = slice(*np.searchsorted(made.imu.time, (24.995, 25.095)))
    theirs = slice(*np.searchsorted(imu.time, (24.995, 25.095)))
    np.testing.assert_allclose(made.imu.dvel[inside].sum(axis=0), imu.dvel[theirs].sum(axis=0), atol=5e-4)
    np.testing.assert_allclose(made.imu.dtheta[inside].sum(axis=0), imu.dtheta[theirs].sum(axis=0), atol=5e-6)


def test_a_long_gap_stops_with_its_time_and_length() -> None:
    time = np.r_[np.arange(0.0, 10.0, 0.01), np.arange(10.5, 20.0, 0.01)]
    with pytest.raises(InputError, match=r"no samples for 0\.5 s from t = 9\.99\d* s on, more than max_gap_s = 0\.1"):
        made_increments(rates(time))
    made = made_increments(rates(time), max_gap=1.0)
    assert made.gaps[0, 1] == pytest.approx(0.5)


def test_times_that_go_back_are_refused() -> None:
    time = np.r_[np.arange(0.0, 1.0, 0.01), np.arange(0.5, 2.0, 0.01)]
    with pytest.raises(InputError, match=r"sample 100 is not later than 0\.99"):
        made_increments(rates(time))


def test_increments_of_other_lengths_than_their_stamps_tell() -> None:
    """Each sensor integrates over its own interval; the mean rate then holds between the stamps."""
    imu = TRUTH.increments(100.0)
    interval = np.tile((0.009, 0.0095), (len(imu), 1))
    stream = InertialStream(imu.time[1:], imu.dtheta * 0.9, imu.dvel * 0.95, "increments", interval)
    made = made_increments(stream).imu
    np.testing.assert_allclose(made.dtheta[1:], imu.dtheta[1:], atol=1e-12)
    np.testing.assert_allclose(made.dvel[1:], imu.dvel[1:], atol=1e-12)


def test_the_noise_of_a_bridge_is_that_of_rates_that_wander() -> None:
    """Random walks are cut: the scatter of the bridged integral is that of the added white noise over the gap.

    Of 4000 gaps the variance is known to 2.2 % (1σ); the level that S shows in one record of 40 000 samples to 5 %.
    """
    rng = np.random.default_rng(8)
    step, lost = 0.01, 80
    walk = np.cumsum(rng.normal(0.0, 0.1, (4000, lost + 1)), axis=1)
    whole = step * (0.5 * (walk[:, 0] + walk[:, -1]) + walk[:, 1:-1].sum(axis=1))
    line = step * lost * 0.5 * (walk[:, 0] + walk[:, -1])
    record = np.cumsum(rng.normal(0.0, 0.1, (40_000, 3)), axis=0)
    imu = ImuData(step * np.arange(40_001), step * record, step * record)
    length = step * (lost - 1)  # what lacks
    found = bridge_noise(imu, np.array([[50.0, length]]))
    assert found is not None
    axes = range(3)
    root = found.roots(np.array([49.99, 50.01, 50.5, 50.0 + step * lost + 0.001]))[:, :, axes, axes]
    assert (root[[0, 3]] == 0.0).all()
    expected = float(np.var(whole - line))
    np.testing.assert_allclose(root[1:3] ** 2 * step * lost, expected, rtol=0.2)
    back = found.mirrored(0.0, 400.0)
    np.testing.assert_array_equal(back.roots(np.array([349.0, 349.5, 350.1]))[:, 0, 0, 0] > 0.0, [False, True, False])
