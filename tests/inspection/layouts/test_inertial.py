"""Layouts of inertial readings: signs and order of columns, names of axes and units."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.inspection.layouts.inertial import Layout
from sinssim.inspection.layouts.names import axis, quantity, triads, unit_of


def test_columns_change_order_and_sign_as_the_matrix_says() -> None:
    layout = Layout("rates", 0, "s", (1, 2, 3), (4, 5, 6), "rad/s", "g", True, gyro_signs=(1, 1, -1))
    swapped = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    turned = layout.turned(swapped, np.diag((1.0, -1.0, 1.0)))
    assert turned is not None
    rows = np.random.default_rng(1).normal(size=(5, 7))
    stated = rows[:, list(layout.gyro or ())] * layout.gyro_signs
    np.testing.assert_array_equal(rows[:, list(turned.gyro or ())] * turned.gyro_signs, stated @ swapped.T)
    assert (turned.accel, turned.accel_signs) == ((4, 5, 6), (1, -1, 1))
    assert layout.turned(2.0 * np.eye(3), np.eye(3)) is None


@pytest.mark.parametrize(
    ("name", "what", "number"),
    [
        ("GyrX", "gyro", 0), ("gyro_rad[1]", "gyro", 1), ("w_RS_S_z [rad s^-1]", "gyro", 2), ("wx", "gyro", 0),
        ("Angular rate Y [°/s]", "gyro", 1), ("imu.angular_velocity.z", "gyro", 2), ("gx [deg/s]", "gyro", 0),
        ("AccY", "accel", 1), ("accelerometer_m_s2[2]", "accel", 2), ("Acceleration X [m/s²]", "accel", 0),
        ("fz", "accel", 2), ("linear_acceleration.y", "accel", 1), ("mag_x", "other", 0), ("x", None, 0),
    ],
)  # fmt: skip
def test_names_say_sensor_and_axis(name: str, what: str | None, number: int) -> None:
    found = axis(name)
    assert found is not None
    assert (quantity(name), found[1]) == (what, number)


def test_triads_follow_the_axes_of_the_names_not_their_places() -> None:
    assert triads(["time", "z", "y", "x"]) == [(3, 2, 1)]
    assert triads(["ax", "gx", "ay", "gy", "az", "gz"]) == [(0, 2, 4), (1, 3, 5)]
    assert triads(["lat", "lon", "max"]) == []


@pytest.mark.parametrize(
    ("name", "unit"),
    [("g_dps", "deg/s"), ("w [rad s^-1]", "rad/s"), ("rate [°/s]", "deg/s"), ("gyro (rad/s)", "rad/s"), ("wx", None)],
)
def test_units_of_names(name: str, unit: str | None) -> None:
    assert unit_of(name, ("mrad/s", "rad/s", "deg/s", "deg/h")) == unit
