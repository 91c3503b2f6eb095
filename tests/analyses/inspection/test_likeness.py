"""What the numbers of three columns look like, and the words of names: numbers that can be worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.inertial_columns import Layout, accelerometers, is_unix, no_gravity_words, off_gravity
from sinssim.analyses.inspection.log_corrections import Reread, description_of, reread
from sinssim.analyses.inspection.text_columns import (
    TextTable,
    copies,
    gyro_unit_of,
    lasts,
    quaternion,
    repeats,
    resolution,
    split_kinds,
    spread,
    turns,
    uneven,
    unlike_gyros,
    varies,
)

G = 9.80665


def _table(values: np.ndarray, names: str | None = None) -> TextTable:
    return TextTable(
        Path("log.csv"), ",", 0, None if names is None else tuple(names.split(",")), np.asarray(values, float)
    )


def test_magnitudes() -> None:
    """|(2, 3, 6)| = 7: magnitudes of 7, 14, 21, 28 and 35 have the middle 21 and the middle half from 14 to 28."""
    assert spread(np.outer((3, 1, 5, 2, 4), (2.0, -3.0, 6.0))) == pytest.approx(14.0 / 21.0)
    rows = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.0, 2.0, 4.0], [1.0, 2.0, 4.0], [1.0, 2.0, 4.0]])
    assert repeats(rows) == pytest.approx(0.75)
    assert repeats(rows[:1]) == 0.0
    # steps below 1e-6 are rounding; 0.25 is the coarsest
    values = np.array([[0.0, 0.0, 0.5], [0.125, 0.25, 0.5 + 1e-7], [0.5, 0.75, np.nan], [0.25, 2.0, 0.5625]])
    assert resolution(values) == pytest.approx(0.25)
    assert resolution(np.ones((4, 3))) == 0.0


def test_unevenness_is_that_of_second_differences() -> None:
    """±a by turns has second differences of 4a: 0.01, 0.1 and 0.003 are log10(33.3) apart; a slope counts nothing."""
    values = np.outer((-1.0) ** np.arange(40), (0.01, 0.1, 0.003)) + np.outer(np.arange(40), (5.0, 2.0, 9.0))
    assert uneven(values) == pytest.approx(np.log10(0.1 / 0.003), rel=1e-6)
    # the middle of the second column is 0.6 of its largest values
    middle = np.column_stack([np.tile((-1.0, 1.0), 20), np.tile((0.3, 0.5), 20), np.tile((-2.0, 2.0), 20)])
    expected = 0.4 / 0.5 + np.log10(2.0 / 0.1)
    assert unlike_gyros(_table(middle), (0, 1, 2), (3, 4, 5)) == pytest.approx(expected)
    assert unlike_gyros(_table(middle), (0, 1, 2), (4, 5, 6)) == pytest.approx(expected + 0.5)


def test_copies_and_quaternions() -> None:
    rng = np.random.default_rng(4)
    own = rng.normal(size=(50, 3))
    table = _table(np.column_stack([own, -57.3 * own, own[:, :2], own[:, 0]]))
    assert copies(table, (0, 1, 2), (3, 4, 5))
    assert not copies(table, (0, 1, 2), (6, 7, 8))
    q = rng.normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    assert quaternion(_table(np.column_stack([own[:, :2], q, own]))) == {2, 3, 4, 5}
    assert quaternion(_table(np.column_stack([own, own]))) == set()
    sparse = np.full((10, 3), np.nan)
    sparse[:2] = own[:2]
    assert not varies(_table(sparse), (0, 1, 2))
    sparse[2] = own[2]
    assert varies(_table(sparse), (0, 1, 2))
    sparse[:, 1] = 4.0
    assert not varies(_table(sparse), (0, 1, 2))


def test_what_lasts() -> None:
    """Of 30 s at 10 Hz, windows of 10 s count: (0, 8) and (6, 0) by turns is (3, 4) in the mean, 5 of 7."""
    values = np.tile(((0.0, 0.0, 8.0), (6.0, 0.0, 0.0)), (150, 1))
    assert lasts(values, 0.1)  # 0.714
    values = np.tile(((0.0, 0.0, 8.0), (8.0, 0.0, 0.0), (0.0, -3.0, 0.0)), (100, 1))
    assert not lasts(values, 0.1)  # √(8² + 8² + 3²)/19 = 0.616
    names = "t,gyro_x [deg/s],gyro_y [deg/s],gyro_z [deg/s]"
    time = 0.1 * np.arange(300)
    wobble = 1e-3 * np.sin(np.outer(time, (1.0, 2.0, 3.0)))
    for rate, fast in ((5.6, False), (5.8, True)):  # °/s, of which 10 s are 56° and 58°; a radian is 57.3°
        assert turns(_table(np.column_stack([time, wobble + np.array((0.0, rate, 0.0))]), names), 0.1) == fast


def test_units_of_gyros() -> None:
    small = 0.01 * np.sin(np.outer(np.arange(200), (0.1, 0.2, 0.3)))
    assert gyro_unit_of(_table(small), (0, 1, 2), "rates") == ("rad/s", False)
    assert gyro_unit_of(_table(700.0 * small), (0, 1, 2), "rates") == ("deg/s", False)
    assert gyro_unit_of(_table(550.0 * small), (0, 1, 2), "rates") == ("rad/s", False)
    assert gyro_unit_of(_table(small), (0, 1, 2), "increments") == ("rad", False)
    assert gyro_unit_of(_table(small, "wx [deg/h],wy [deg/h],wz [deg/h]"), (0, 1, 2), "rates") == ("deg/h", True)


@pytest.mark.parametrize(
    ("scale", "kind", "unit"),
    [
        (G, "rates", "m/s^2"), (1.0, "rates", "g"), (1000.0, "rates", "mg"), (G / 0.3048, "rates", "ft/s^2"),
        (G * 0.02, "increments", "m/s"), (1.25 * G, "rates", "m/s^2"),
    ],
)  # fmt: skip
def test_units_of_accelerometers(scale: float, kind: str, unit: str) -> None:
    """Gravity of (2, −3, 6)/7 and a little motion; evidence is the departure from 1 g."""
    time = 0.02 * np.arange(1500)
    motion = 0.003 * np.sin(np.outer(time, (1.0, 2.0, 3.0)))
    table = _table(np.column_stack([time, scale * (np.array((2.0, -3.0, 6.0)) / 7.0 + motion)]))
    _, three, found, of = accelerometers(table, (1, 2, 3), 0, 0.02)
    assert (three, found, of) == ((1, 2, 3), kind, unit)
    if kind == "rates":
        assert off_gravity(table, Layout("rates", 0, "s", None, (1, 2, 3), "rad/s", unit, True)) == pytest.approx(
            abs(scale / G * {"m/s^2": 1.0, "g": G, "mg": 1e-3 * G, "ft/s^2": 0.3048}[unit] - 1.0), abs=2e-3
        )
    if scale != 1.25 * G:
        more = _table(table.values * (1.0, 1.35, 1.35, 1.35))  # beyond 1.3 of every unit
        assert not np.isfinite(accelerometers(more, (1, 2, 3), 0, 0.02)[0])


def test_counts_are_named_by_the_nearest_power_of_two() -> None:
    values = np.rint(15_900.0 * np.array((2.0, -3.0, 6.0)) / 7.0) + np.array([[-1, 0, 1], [0, 1, -1], [1, -1, 0]])
    assert no_gravity_words(_table(values, "ax,ay,az"), (0, 1, 2)) == (
        "log.csv: the columns ax, ay, az have a median magnitude of 1.59e+04, which is not gravity in any unit. Whole "
        "numbers are counts: 16384 of them per g are usual for this magnitude. Multiply gyros and accelerometers by "
        "the scale factors of the data sheet."
    )
    assert "counts" not in no_gravity_words(_table(values + 0.5), (0, 1, 2))
    assert "counts" not in no_gravity_words(_table(np.rint(values / 85.0)), (0, 1, 2))  # below 200
    same = no_gravity_words(_table(np.ones((5, 3)), "ax,ay,az"), (0, 1, 2))
    assert same == "log.csv: the columns ax, ay, az of the accelerometers have no numbers, or never change."


def test_unix_times() -> None:
    """From 2001-09-09 to 2039; no date, and no name with gps."""
    table = _table(np.zeros((3, 2)), "stamp,gps_time")
    assert is_unix(table, 0, np.array([1.0e9, 1.1e9, 1.2e9]))
    assert not is_unix(table, 0, np.array([0.9e9, 0.95e9, 1.2e9]))
    assert not is_unix(table, 0, np.full(3, 2.3e9))
    assert not is_unix(table, 1, np.full(3, 1.5e9))
    assert not is_unix(replace(table, dates={0: "2024-01-01"}), 0, np.full(3, 1.5e9))


def test_readings_in_other_columns_signs_and_units() -> None:
    """The right x is −2 times the stated y, the right y the stated z, and so on, times one scale."""
    matrix = 0.5 * np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    found = reread(matrix)
    assert found == Reread((1, 2, 0), (-1, 1, 1), 0.5)
    assert reread(np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]])) is None
    assert reread(matrix + 1e-6) is None  # an angle between axes is no other column
    # 0.5 · 1 rad/s is no unit; as increments over 0.02 s the stated numbers are 50 times as large
    assert found.unit("gyro", "rates", "rad/s", 0.02) is None
    assert Reread((0, 1, 2), (1, 1, 1), 50.0).unit("gyro", "rates", "rad/s", 0.02) == ("increments", "rad")
    assert Reread((0, 1, 2), (1, 1, 1), 0.02).unit("accel", "increments", "m/s", 0.02) == ("rates", "m/s^2")
    assert Reread((0, 1, 2), (1, 1, 1), np.pi / 180.0 / 3600.0).unit("gyro", "rates", "rad/s", 0.02) == (
        "rates",
        "deg/h",
    )
    stated = {
        "gyro": {"columns": ["a", "b", "c"], "unit": "rad/s", "signs": [1, -1, 1]},
        "accel": {"columns": ["d", "e", "f"], "unit": "g"},
        "gravity": {"columns": ["p", "q", "r"], "unit": "g"},
    }
    right = description_of("rates", stated, {"gyro": 2.0 * matrix, "accel": 2.0 / G * matrix}, 0.02)
    assert right == (
        "rates",
        {
            "gyro": {"columns": ["b", "c", "a"], "unit": "rad/s", "signs": [1, 1, 1]},
            "accel": {"columns": ["e", "f", "d"], "unit": "m/s^2", "signs": [-1, 1, 1]},
            "gravity": {"columns": ["q", "r", "p"], "unit": "m/s^2", "signs": [-1, 1, 1]},
        },
    )
    array = {"gyro": {"columns": "rates", "unit": "rad/s"}, "accel": {"columns": "forces", "unit": "g"}}
    assert description_of("rates", array, {"gyro": 2.0 * matrix, "accel": np.eye(3)}, 0.02) is None


def test_rows_of_several_units() -> None:
    values = np.column_stack([np.arange(12.0), np.tile((2.0, 5.0, 9.0), 4)])
    (first,), (text,) = split_kinds(_table(values, "t_s,imu_id"))
    assert first.values.tolist() == values[::3].tolist()
    assert first.rows == {"imu_id": "2"}
    assert text == "log.csv contains 3 units (imu_id = 2, 5, 9), of which imu_id = 2 is used."
    whole = _table(np.column_stack([np.arange(12.0), np.repeat((2.0, 5.0), 6)]), "t_s,imu_id")
    assert split_kinds(whole) == ([whole], [])  # changes once: no rows by turns
    kinds = replace(_table(values, "t_s,x"), kinds={1: np.array(["A", "B", ""] * 4)})
    parts, left = split_kinds(kinds)
    assert left == []
    assert [(part.rows, part.values[:, 0].tolist()) for part in parts] == [
        ({"x": "A"}, [0.0, 3.0, 6.0, 9.0]),
        ({"x": "B"}, [1.0, 4.0, 7.0, 10.0]),
    ]
