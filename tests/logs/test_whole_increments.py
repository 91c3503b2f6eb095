"""Increments of a few samples, worked out by hand: trapezoids, intervals, bridges and their noise."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import InertialStream, bridge_noise, gap_words, made_increments

GYRO = np.array([[1.0, -2.0, 3.0], [2.0, 4.0, -1.0], [5.0, 0.0, 7.0], [3.0, 8.0, -5.0]])
ACCEL = 10.0 * GYRO + np.array([0.5, 0.25, 0.125])


def same(imu: ImuData, time: object, gyro: object) -> None:
    """Accelerometers read ten times the gyros, and constants beside it."""
    np.testing.assert_allclose(imu.time, time, rtol=0, atol=1e-12)
    np.testing.assert_allclose(imu.dtheta, gyro, atol=1e-12)
    steps = np.diff(imu.time)[:, None]
    np.testing.assert_allclose(imu.dvel, 10.0 * imu.dtheta + np.array([0.5, 0.25, 0.125]) * steps, atol=1e-12)


def test_trapezoids() -> None:
    """Steps of 0.5, 0.625 and 0.5 s: the mean of both ends times the step."""
    made = made_increments(InertialStream(np.array([1.0, 1.5, 2.125, 2.625]), GYRO, ACCEL))
    same(made.imu, [1.0, 1.5, 2.125, 2.625], [[0.75, 0.5, 0.5], [2.1875, 1.25, 1.875], [2.0, 2.0, 0.5]])
    assert made.gaps.shape == (0, 2)
    assert gap_words(made.gaps) == ()
    assert bridge_noise(made.imu, made.gaps) is None


def test_a_bridge_of_rates_is_a_straight_line() -> None:
    """1.5 s between two samples, three usual intervals: rates go from 2, 4, −1 to 5, 0, 7 by thirds."""
    time = np.array([1.0, 1.5, 3.0, 3.5])
    with pytest.raises(
        InputError,
        match=r"the log: no samples for 1 s from t = 1\.500000 s on, more than "
        r"max_gap_s = 0\.9",
    ):
        made_increments(InertialStream(time, GYRO, ACCEL), max_gap=0.9)
    made = made_increments(InertialStream(time, GYRO, ACCEL), max_gap=1.0)
    # means within the thirds: 2.5, 3.5, 4.5; 4 − 2/3, 2, 2/3; −1 + 4/3, 3, 7 − 4/3
    bridge = np.array([[2.5, 10.0 / 3.0, 1.0 / 3.0], [3.5, 2.0, 3.0], [4.5, 2.0 / 3.0, 17.0 / 3.0]]) * 0.5
    same(made.imu, [1.0, 1.5, 2.0, 2.5, 3.0, 3.5], [[0.75, 0.5, 0.5], *bridge, [2.0, 2.0, 0.5]])
    np.testing.assert_allclose(made.gaps, [[1.5, 1.0]])
    assert gap_words(made.gaps) == (
        "The inertial unit lacks samples at 1 place, 1 s in all; the longest gap, 1 s, begins at t = 1.500 s. They are "
        "bridged by linear interpolation, with more noise.",
    )
    assert gap_words(np.array([[1.0, 0.25], [4.5, 0.75], [7.0, 0.5]]))[0].startswith(
        "The inertial unit lacks samples at 3 places, 1.5 s in all; the longest gap, 0.75 s, begins at t = 4.500 s."
    )


def test_increments_and_mean_rates_belong_to_the_interval_that_ends_at_the_stamp() -> None:
    """The first interval is a usual one; 1 s of the 1.5 s before the third sample have the mean rate of both sides."""
    time = np.array([1.0, 1.5, 3.0, 3.5])
    steps = np.array([0.5, 0.5, 0.5, 0.5])[:, None]
    edges = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]
    bridge = 0.5 * (GYRO[1] + GYRO[2]) * 0.5
    expected = [GYRO[0] * 0.5, GYRO[1] * 0.5, bridge, bridge, GYRO[2] * 0.5, GYRO[3] * 0.5]
    means = InertialStream(time, GYRO, ACCEL)
    sums = InertialStream(time, GYRO * steps, ACCEL * steps, "increments")
    for made in (made_increments(means, readings="mean", max_gap=1.0), made_increments(sums, max_gap=1.0)):
        same(made.imu, edges, expected)
        np.testing.assert_allclose(made.gaps, [[1.5, 1.0]])


def test_intervals_of_gyros_and_accelerometers_of_their_own() -> None:
    """Gyros over 0.25 s and accelerometers over 0.375 s of steps of 0.5 s: the mean rates hold over whole steps.

    The first interval is as long as the longer of both.
    """
    interval = np.tile((0.25, 0.375), (4, 1))
    stream = InertialStream(np.array([1.0, 1.5, 2.0, 2.5]), GYRO * 0.25, ACCEL * 0.375, "increments", interval)
    made = made_increments(stream)
    same(made.imu, [0.625, 1.0, 1.5, 2.0, 2.5], np.vstack([GYRO[:1] * 0.375, GYRO[1:] * 0.5]))


def test_the_noise_of_bridges() -> None:
    """√(S T/12) with the mean square S of the changes over the gap's length, at each bridge and nowhere else.

    Rates 1, 3, 7, 13, 21 a second at steps of 0.5 s: over 1 s, two steps, they change by 6, 10 and 14, whose mean
    square is 332/3; over 0.5 s by 2, 4, 6 and 8, whose mean square is 30.
    """
    rates = np.array([1.0, 3.0, 7.0, 13.0, 21.0])[:, None] * np.array([1.0, 2.0, 3.0])
    imu = ImuData(2.0 + 0.5 * np.arange(6), 0.5 * rates, 0.5 * 10.0 * rates)
    found = bridge_noise(imu, np.array([[2.5, 1.0], [6.0, 0.5]]))
    assert found is not None
    first, second = np.sqrt(332.0 / 3.0 * 1.0 / 12.0), np.sqrt(30.0 * 0.5 / 12.0)
    for time, root in ((2.4, 0.0), (2.6, first), (3.9, first), (4.1, 0.0), (6.1, second), (6.9, second), (7.1, 0.0)):
        roots = found.roots(np.array([time]))[0]
        gyro, accel = np.diag(roots[0]), np.diag(roots[1])
        np.testing.assert_allclose(gyro, root * np.array([1.0, 2.0, 3.0]), rtol=1e-12, err_msg=str(time))
        np.testing.assert_allclose(accel, 10.0 * root * np.array([1.0, 2.0, 3.0]), rtol=1e-12)
