"""Layouts of inertial readings: signs and order of columns, names of axes and units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection.log_corrections import description_of
from sinssim.analyses.inspection.text_columns import gyro_unit_of, read_table
from sinssim.data import Array
from sinssim.logs.column_names import axis, quantity, triads, unit_of


def test_columns_change_order_sign_and_unit_as_the_matrix_says() -> None:
    """The readings of the corrected description are the matrix times those of the stated one."""
    rows = np.random.default_rng(1).normal(size=(5, 6))
    stated = {
        "gyro": {"columns": [0, 1, 2], "unit": "rad/s", "signs": [1, 1, -1]},
        "accel": {"columns": [3, 4, 5], "unit": "m/s^2"},
    }
    swapped = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]) * np.pi / 180.0
    mirror = np.diag((1.0, -1.0, 1.0)) * 9.80665
    found = description_of("rates", stated, {"gyro": swapped, "accel": mirror}, 0.01)
    assert found is not None
    assert found[0] == "rates"
    assert (found[1]["gyro"]["unit"], found[1]["accel"]["unit"]) == ("deg/s", "g")

    def read(triad: dict[str, Any], unit: float) -> Array:
        return np.asarray(rows[:, triad["columns"]] * np.array(triad.get("signs", (1, 1, 1))) * unit)

    for name, matrix, unit in (("gyro", swapped, np.pi / 180.0), ("accel", mirror, 9.80665)):
        np.testing.assert_allclose(read(found[1][name], unit), read(stated[name], 1.0) @ matrix.T)
    assert description_of("rates", stated, {"gyro": 2.0 * np.eye(3), "accel": np.eye(3)}, 0.01) is None
    # a hundredth at 100 samples a second: increments
    both = {"gyro": 100.0 * np.eye(3), "accel": 100.0 * np.eye(3)}
    found = description_of("rates", stated, both, 0.01)
    assert found is not None
    assert (found[0], found[1]["gyro"]["unit"], found[1]["accel"]["unit"]) == ("increments", "rad", "m/s")


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


@pytest.mark.parametrize(("step", "unit"), [(0.0571, "deg/s"), (0.001, "rad/s")])
def test_gyros_with_steps_of_degrees_are_no_rad(step: float, unit: str, tmp_path: Path) -> None:
    """Steps of 0.0571 rad/s are 3.3 °/s, which no gyro has; steps of 0.001 fit both units. Both are questions."""
    rates = step * np.rint(np.random.default_rng(2).normal(0.0, 1.2, (400, 3)) / step)
    path = tmp_path / "log.csv"
    np.savetxt(
        path, np.column_stack([np.arange(400) * 0.02, rates]), delimiter=",", header="t,x,y,z", comments="", fmt="%.4f"
    )
    assert gyro_unit_of(read_table(path), (1, 2, 3), "rates") == (unit, False)
