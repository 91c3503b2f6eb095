"""The three sets of sensors: perfect ones navigate alike, and sums of samples lose and add nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sinssim import emulate
from sinssim.data import ImuData
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_readings import Readings, read, sums
from sinssim.strapdown.measured_attitude import navigate_set
from sinssim.strapdown.mechanization import Mechanization
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.coning_and_rocking import classical_cone
from sinssim.truth.motions.parked_and_great_circle import GreatCircle

SETS = {
    "gyros": {"type": "gyros"},
    "attitude-sensor": {"type": "attitude-sensor"},
    "accelerometers": {"type": "accelerometers", "arm_m": 1.0},
}


def section(kind: str, rate_hz: float, **more) -> Imu:
    return Imu.model_validate({"grade": "ideal", "rate_hz": rate_hz, "sensor_set": SETS[kind], **more})


@pytest.fixture(scope="module")
def cone() -> OnEarth:
    motion = classical_cone(np.radians(2.0), 2.0 * np.pi * 3.0)
    return OnEarth(motion, np.radians(45.0), 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 4.0)


def test_the_sum_of_exact_increments_is_the_exact_increment(cone):
    fast, slow = cone.increments(200.0), cone.increments(25.0)
    # k/200 and k/25 as doubles differ by up to 4e-16 s here, in which it turns by that times 0.7 rad/s.
    np.testing.assert_allclose(sums(fast.dtheta, 8), slow.dtheta, rtol=0, atol=5e-16)
    np.testing.assert_allclose(sums(fast.dvel, 8), slow.dvel, rtol=0, atol=1e-14)


def test_a_rest_is_dropped():
    rows = np.arange(21.0).reshape(7, 3)
    np.testing.assert_array_equal(sums(rows, 3), [[9.0, 12.0, 15.0], [36.0, 39.0, 42.0]])
    assert sums(rows, 1) is rows


def test_noise_is_the_same_at_every_rate(cone):
    """What the sensors add up to by an instant does not depend on how often they are read."""
    ideal = cone.increments(100.0)
    true, readings = read(cone, ideal, section("gyros", 100.0, grade="tactical"), 5)
    measured = emulate(ideal, Imu(grade="tactical"), 5)
    assert true.imu is ideal
    for ratio in (1, 2, 5, 10):
        imu = readings.at(ratio).imu
        np.testing.assert_allclose(
            np.cumsum(imu.dtheta, axis=0), np.cumsum(measured.dtheta, axis=0)[ratio - 1 :: ratio]
        )
        np.testing.assert_array_equal(imu.time, ideal.time[::ratio])


def test_attitude_is_read_where_samples_end(cone):
    _, readings = read(cone, cone.increments(100.0), section("attitude-sensor", 100.0))
    slower = readings.at(4)
    assert slower.attitude.shape == (101, 4)
    np.testing.assert_array_equal(slower.attitude[3], readings.attitude[12])


def test_what_is_not_measured_is_not_a_number(cone):
    """No gyros, no angle increments: who navigates on them by mistake is told so."""
    _, readings = read(cone, cone.increments(100.0), section("attitude-sensor", 100.0))
    assert np.isnan(readings.imu.dtheta).all()
    with pytest.raises(ValueError, match=r"imu.dtheta\[0\]"):
        navigate_set(readings.imu, None, cone.state(0.0), Mechanization())


@pytest.mark.parametrize("kind", SETS)
def test_perfect_sensors_of_every_set_navigate(cone, kind):
    true, measured = read(cone, cone.increments(200.0), section(kind, 200.0))
    for readings in (true, measured):
        solution = navigate_set(readings.at(2).imu, readings.at(2).attitude, cone.state(0.0), Mechanization())
        truth = cone.state(solution.time)
        # A 3 Hz cone at 100 Hz, 6e-3 rad a sample: what is left is the splines of the sets without gyros.
        np.testing.assert_allclose(solution.latitude, truth.latitude, rtol=0, atol=1e-5 / 6.4e6)
        np.testing.assert_allclose(np.abs(np.sum(solution.q_nb * truth.q_nb, axis=1)), 1.0, rtol=0, atol=1e-10)


@pytest.mark.parametrize("vertical", ["baro-loop", "truth"])
def test_every_set_has_the_same_vertical_channels(vertical):
    """Accelerometers 100 µg off: the loop of every set settles where that of the others does."""
    flight = GreatCircle(0.9, 0.3, 9000.0, 1.0, 250.0, 900.0)
    ideal = flight.increments(10.0)
    truth = flight.state(ideal.time)
    biased = ImuData(ideal.time, ideal.dtheta, ideal.dvel + 0.1 * np.array([0.0, 0.0, 1e-4 * 9.80665]))
    of = Mechanization(frame="inertial", vertical=vertical)
    if vertical == "baro-loop":
        of = replace(of, baro_time_constant=30.0)
    attitude, _ = read(flight, ideal, section("attitude-sensor", 10.0))
    errors = {}
    for kind, readings in (("gyros", Readings(biased)), ("attitude", Readings(biased, attitude.attitude))):
        solution = navigate_set(readings.imu, readings.attitude, flight.state(0.0), of, truth.height)
        errors[kind] = navigation_error(truth, solution, flight.ellipsoid)
    offset = {"baro-loop": None, "truth": 0.0}[vertical]
    height = errors["gyros"].height
    assert np.abs(errors["attitude"].height - height).max() < 1e-6
    assert np.abs(errors["attitude"].position_ned - errors["gyros"].position_ned).max() < 1e-4
    if offset is None:  # k₃∫e = δa/…: the integral takes the bias up, the height comes back after a swing
        assert np.abs(height).max() > 0.05
        assert abs(height[-1]) < 1e-3 * np.abs(height).max()
    else:
        assert np.abs(height).max() < 1e-6
