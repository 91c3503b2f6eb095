"""Sums of samples: nothing is lost, and nothing is added."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import emulate
from sinssim.scenario.imu import ImuSection
from sinssim.studies.motions import make
from sinssim.studies.samples import first_seconds, sums
from sinssim.studies.schema import StudyMotion
from sinssim.studies.variants import read


@pytest.fixture(scope="module")
def trajectory():
    cone = {"type": "coning", "half_angle_deg": 2.0, "frequency_hz": 3.0, "duration_s": 5.0}
    return make(StudyMotion.model_validate({"motion": cone, "duration_s": 4.0}))


def test_the_sum_of_exact_increments_is_the_exact_increment(trajectory):
    fast, slow = trajectory.increments(200.0), trajectory.increments(25.0)
    # k/200 and k/25 as doubles differ by up to 4e-16 s here, in which it turns by that times 0.7 rad/s.
    np.testing.assert_allclose(sums(fast.dtheta, 8), slow.dtheta, rtol=0, atol=5e-16)
    np.testing.assert_allclose(sums(fast.dvel, 8), slow.dvel, rtol=0, atol=1e-14)


def test_a_rest_is_dropped():
    rows = np.arange(21.0).reshape(7, 3)
    np.testing.assert_array_equal(sums(rows, 3), [[9.0, 12.0, 15.0], [36.0, 39.0, 42.0]])
    assert sums(rows, 1) is rows


def test_beginning(trajectory):
    assert (trajectory.start, trajectory.end) == (0.0, 4.0)
    imu = trajectory.increments(100.0)
    assert len(imu) == 400
    assert imu.time[-1] == 4.0
    assert len(first_seconds(imu, 1.0)) == 100
    assert len(first_seconds(imu, 1.005)) == 100


def test_noise_is_the_same_at_every_rate(trajectory):
    """What the sensors add up to by an instant does not depend on how often they are read."""
    section = ImuSection(grade="tactical")
    ideal = trajectory.increments(100.0)
    readings = read("rate-gyros", trajectory, ideal, section, 5)
    measured = emulate(ideal, section, 5)
    for ratio in (1, 2, 5, 10):
        imu = readings.at(ratio).imu
        np.testing.assert_allclose(
            np.cumsum(imu.dtheta, axis=0), np.cumsum(measured.dtheta, axis=0)[ratio - 1 :: ratio]
        )
        np.testing.assert_array_equal(imu.time, ideal.time[::ratio])


def test_attitude_is_read_where_samples_end(trajectory):
    readings = read("attitude-sensor", trajectory, trajectory.increments(100.0), ImuSection(grade="ideal"), 0)
    slower = readings.at(4)
    assert slower.attitude.shape == (101, 4)
    np.testing.assert_array_equal(slower.attitude[3], readings.attitude[12])


@pytest.mark.parametrize("variant", ["rate-gyros", "attitude-sensor", "six-accelerometers-1m"])
def test_perfect_sensors_of_every_set_navigate(trajectory, variant):
    readings = read(variant, trajectory, trajectory.increments(200.0), ImuSection(grade="ideal"), 0).at(2)
    options = {"algorithm": "quaternion", "gravity": "normal", "ellipsoid": "wgs84", "vertical": "free"}
    solution = readings.navigate(trajectory.state(0.0), None, options)
    truth = trajectory.state(solution.time)
    # A 3 Hz cone at 100 Hz, 6e-3 rad a sample: what is left is the splines of the sets without gyros.
    np.testing.assert_allclose(solution.latitude, truth.latitude, rtol=0, atol=1e-5 / 6.4e6)
    np.testing.assert_allclose(np.abs(np.sum(solution.q_nb * truth.q_nb, axis=1)), 1.0, rtol=0, atol=1e-10)
