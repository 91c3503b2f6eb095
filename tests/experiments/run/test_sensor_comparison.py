"""Readings against the truth: accumulated errors, means over windows, names and units of every kind of sensor."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import Array, ImuData
from sinssim.experiments.run.sensor_exhibits import SensorComparison, compare_sensors
from sinssim.sensors.sensor_set_readings import Readings
from sinssim.units import ANGLE_SCALE, SPEED_SCALE

TIME = np.array([100.0, 102.0, 104.0, 106.0])
DTHETA = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]])
DVEL = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]])
GYRO = np.array([[1.0, 2.0, 4.0], [8.0, 16.0, 32.0], [64.0, 128.0, 256.0]]) / 1024.0
ACCEL = np.array([[3.0, -5.0, 7.0], [11.0, 13.0, -17.0], [19.0, 23.0, 29.0]]) / 64.0
DEG_H, UG = (("deg/h", pytest.approx(pi / 648_000.0)), ("µg", pytest.approx(9.80665e-6)))
DEG_S, MPS2 = (("deg/s", pytest.approx(pi / 180.0)), ("m/s²", 1.0))


def imu(dtheta: Array, dvel: Array) -> ImuData:
    return ImuData(TIME, dtheta, dvel)


IDEAL, READ, LEFT = imu(DTHETA, DVEL), imu(DTHETA + GYRO, DVEL + ACCEL), imu(DTHETA + 0.5 * GYRO, DVEL - 2.0 * ACCEL)


def sums(errors: Array) -> Array:
    """Return the sums of the first 0, 1, 2 and 3 rows."""
    return np.array([0.0 * errors[0], errors[0], errors[0] + errors[1], errors[0] + errors[1] + errors[2]])


def check(found: SensorComparison, key: str, title: str, names: str, error: Any, left: Any, units: tuple[Any, ...],
          ideal: Any, measured: Any) -> None:  # fmt: skip
    assert (found.key, found.title, found.names) == (key, title, tuple(names))
    np.testing.assert_array_equal(found.time, TIME)
    np.testing.assert_allclose(found.error, error, rtol=0, atol=1e-15)
    assert (found.left is None) == (left is None)
    if left is not None:
        np.testing.assert_allclose(found.left, left, rtol=0, atol=1e-15)
    assert (found.sums, found.drift, found.reading) == units
    assert found.ideal is ideal
    assert found.measured is measured


def test_gyros_and_accelerometers() -> None:
    gyro, accel = compare_sensors(Readings(READ), Readings(IDEAL), IDEAL, LEFT)
    check(gyro, "gyro", "Gyros", "xyz", sums(GYRO), 0.5 * sums(GYRO), (ANGLE_SCALE, DEG_H, DEG_S), DTHETA, READ.dtheta)
    check(
        accel,
        "accel",
        "Accelerometers",
        "xyz",
        sums(ACCEL),
        -2.0 * sums(ACCEL),
        (SPEED_SCALE, UG, MPS2),
        DVEL,
        READ.dvel,
    )
    assert [one.left for one in compare_sensors(Readings(READ), Readings(IDEAL), IDEAL, None)] == [None, None]


def test_a_redundant_set() -> None:
    """Four gyros and two accelerometers, numbered from 1, before what is formed from them."""
    rng = np.random.default_rng(3)
    perfect = SimpleNamespace(dtheta=rng.normal(size=(3, 4)), dvel=rng.normal(size=(3, 4)))
    off = rng.normal(size=(2, 3, 4))
    read = SimpleNamespace(dtheta=perfect.dtheta + off[0], dvel=perfect.dvel + off[1])
    after = SimpleNamespace(dtheta=perfect.dtheta + 0.1 * off[0], dvel=perfect.dvel + 0.2 * off[1])
    found = list(compare_sensors(Readings(READ, single=read, single_compensated=after),
                                 Readings(IDEAL, single=perfect), IDEAL, LEFT))  # fmt: skip
    of_gyros, of_accels = (ANGLE_SCALE, DEG_H, DEG_S), (SPEED_SCALE, UG, MPS2)
    check(found[0], "single_gyro", "Single gyros", "1234", sums(off[0]), sums(0.1 * off[0]), of_gyros, perfect.dtheta,
          read.dtheta)  # fmt: skip
    check(found[1], "single_accel", "Single accelerometers", "1234", sums(off[1]), sums(0.2 * off[1]), of_accels,
          perfect.dvel, read.dvel)  # fmt: skip
    check(found[2], "gyro", "Angular rate from the single gyros", "xyz", sums(GYRO), 0.5 * sums(GYRO), of_gyros, DTHETA,
          READ.dtheta)  # fmt: skip
    check(found[3], "accel", "Specific force from the single accelerometers", "xyz", sums(ACCEL), -2.0 * sums(ACCEL),
          of_accels, DVEL, READ.dvel)  # fmt: skip
    bare = list(compare_sensors(Readings(READ, single=read), Readings(IDEAL, single=perfect), IDEAL, None))
    assert [one.left for one in bare] == [None] * 4


def test_six_accelerometers() -> None:
    rng = np.random.default_rng(4)
    perfect, off = rng.normal(size=(3, 6)), rng.normal(size=(3, 6))
    read = perfect + off
    found = list(compare_sensors(Readings(READ, accelerometers=read), Readings(IDEAL, accelerometers=perfect), IDEAL,
                                 None))  # fmt: skip
    check(
        found[0], "single", "Single accelerometers", "123456", sums(off), None, (SPEED_SCALE, UG, MPS2), perfect, read
    )
    assert [(one.key, one.title) for one in found[1:]] == [
        ("gyro", "Angular rate from the accelerometers"), ("accel", "Specific force from the accelerometers"),
    ]  # fmt: skip


def test_an_attitude_sensor() -> None:
    """The error in inertial axes: after a true quarter turn about z, a reading turned further by 0.1 rad about x."""
    half, small = np.sqrt(0.5), 0.05
    perfect = np.tile([half, 0.0, 0.0, half], (4, 1))
    further = np.array([[1.0, 0.0, 0.0, 0.0], [np.cos(small), np.sin(small), 0.0, 0.0],
                        [np.cos(small), 0.0, np.sin(small), 0.0],
                        [np.cos(small), 0.0, 0.0, -np.sin(small)]])  # fmt: skip
    read = np.array([[w * half - z * half, x * half + y * half, y * half - x * half, w * half + z * half]
                     for w, x, y, z in further])  # fmt: skip
    attitude, accel = compare_sensors(Readings(READ, attitude=read), Readings(IDEAL, attitude=perfect), IDEAL, None)
    expected = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, -0.1]])
    check(attitude, "attitude", "Attitude sensor, inertial axes", "xyz", expected, None,
          (ANGLE_SCALE, DEG_H, ("", 1.0)),
          None, None)  # fmt: skip
    assert (accel.key, accel.title) == ("accel", "Accelerometers")


@pytest.mark.parametrize(
    ("duration", "window"),
    [(20.0, 0.1), (20.5, 0.5), (300.0, 2.0), (1000.0, 5.0), (1900.0, 10.0), (7000.0, 60.0), (12_001.0, 120.0)],
)
def test_the_window_gives_at_most_two_hundred_means(duration: float, window: float) -> None:
    time = np.array([50.0, 50.0 + duration])
    assert SensorComparison("gyro", "", (), time, TIME, None, ANGLE_SCALE, ("", 1.0)).window == window


def test_means_over_windows() -> None:
    """30 s give windows of 0.5 s; the remainder of 0.3 s has no mean. Sensors: difference over time; attitude: mean."""
    time = 70.0 + 0.1 * np.arange(304)
    error = np.column_stack((0.3 * (time - 70.0), np.arange(304.0) ** 2))
    sensor = SensorComparison("gyro", "", ("x", "y"), time, error, None, ANGLE_SCALE, ("", 1.0), error, error)
    ends, means = sensor.averaged(error)
    np.testing.assert_allclose(ends, 70.5 + 0.5 * np.arange(60), rtol=1e-12)
    np.testing.assert_allclose(means[:, 0], 0.3, rtol=1e-10)
    k = np.arange(60.0)
    np.testing.assert_allclose(means[:, 1], ((5.0 * k + 5.0) ** 2 - (5.0 * k) ** 2) / 0.5, rtol=1e-10)
    attitude = SensorComparison("attitude", "", ("x", "y"), time, error, None, ANGLE_SCALE, ("", 1.0))
    ends, means = attitude.averaged(error)
    np.testing.assert_allclose(ends, 70.5 + 0.5 * np.arange(60), rtol=1e-12)
    squares = [np.mean([(5 * n + j) ** 2 for j in range(5)]) for n in range(60)]
    np.testing.assert_allclose(means[:, 1], squares, rtol=1e-12)
