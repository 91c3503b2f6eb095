"""Units, ticks and rows that all drawings share: each answer is written down from the definition."""

from __future__ import annotations

from math import inf, nan, pi
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.error_budget.budget_exhibits import units_of_budget
from sinssim.charts import Axis
from sinssim.experiments.run.filter_exhibits import NAVIGATION, settled
from sinssim.recording.style import envelope, log_numbers, thinned, tick_label, ticks, time_ticks
from sinssim.recording.svg_chart import _numbers
from sinssim.units import (
    ANGLE_SCALE,
    HEIGHT_SCALE,
    LENGTH_SCALE,
    SPEED_SCALE,
    Scale,
    duration_words,
    suiting,
    time_unit,
)

SECOND, MINUTE, DEGREE = pi / 648_000.0, pi / 10_800.0, pi / 180.0


@pytest.mark.parametrize(
    ("scale", "largest", "unit", "size"),
    [
        (LENGTH_SCALE, 0.0, "mm", 1e-3), (LENGTH_SCALE, 0.5, "mm", 1e-3), (LENGTH_SCALE, 0.51, "m", 1.0),
        (LENGTH_SCALE, 1e5, "m", 1.0),
        (LENGTH_SCALE, 1.01e5, "km", 1e3), (LENGTH_SCALE, inf, "km", 1e3), (LENGTH_SCALE, nan, "km", 1e3),
        (HEIGHT_SCALE, 0.5, "mm", 1e-3), (HEIGHT_SCALE, 0.51, "m", 1.0), (HEIGHT_SCALE, 1e7, "m", 1.0),
        (SPEED_SCALE, 0.05, "mm/s", 1e-3), (SPEED_SCALE, 0.051, "m/s", 1.0), (SPEED_SCALE, 9e3, "m/s", 1.0),
        (ANGLE_SCALE, 0.99 * MINUTE, "arcsec", SECOND), (ANGLE_SCALE, 1.01 * MINUTE, "arcmin", MINUTE),
        (ANGLE_SCALE, 1.99 * DEGREE, "arcmin", MINUTE), (ANGLE_SCALE, 2.01 * DEGREE, "deg", DEGREE),
        (ANGLE_SCALE, inf, "deg", DEGREE),
    ],
)  # fmt: skip
def test_the_unit_of_a_size(scale: Scale, largest: float, unit: str, size: float) -> None:
    assert suiting(scale, np.array([largest])) == (unit, pytest.approx(size, rel=1e-14))
    assert suiting(scale, np.array([-largest])) == (unit, pytest.approx(size, rel=1e-14))


def test_the_largest_of_all_values_counts() -> None:
    """−0.7 m lies beyond the 0.5 m of millimetres; a NaN beside it does not count, an array of NaN does."""
    small = np.array([[0.1, nan], [0.2, -0.3]])
    assert suiting(LENGTH_SCALE, small, np.zeros(0)) == ("mm", 1e-3)
    assert suiting(LENGTH_SCALE, small, np.array([0.4, -0.7])) == ("m", 1.0)
    assert suiting(LENGTH_SCALE, np.array([0.4, -0.7]), small) == ("m", 1.0)
    assert suiting(LENGTH_SCALE, small, np.array([nan, nan])) == ("km", 1e3)
    assert suiting(LENGTH_SCALE) == ("mm", 1e-3)


def test_the_units_of_a_budget() -> None:
    """Each block of columns has its own; the circles count among the lengths."""
    errors = np.array([[0.1, 0.2, 0.3, 0.01, 0.02, 0.07, 2.0 * SECOND, 3.0 * SECOND, 90.0 * MINUTE]])
    result = SimpleNamespace(root_mean_square=lambda: errors, cep=np.array([0.2]), r95=np.array([0.4]))
    assert units_of_budget(result) == (("mm", 1e-3), ("m/s", 1.0), ("arcmin", pytest.approx(MINUTE)))
    result.r95 = np.array([0.6])
    assert units_of_budget(result)[0] == ("m", 1.0)
    result.r95, result.cep = np.array([0.4]), np.array([0.6])
    assert units_of_budget(result)[0] == ("m", 1.0)
    result.cep, errors[0, 2], errors[0, 5] = np.array([0.4]), -0.6, 0.03
    assert units_of_budget(result)[:2] == (("m", 1.0), ("mm/s", 1e-3))


def test_an_envelope_row_by_row() -> None:
    """Four columns of 3 s from 10 s to 22 s: in each, the extremes in the order from its first to its last value."""
    time = np.arange(10.0, 22.0)
    values = np.array([3.0, 9.0, 4.0, 8.0, -2.0, 7.0, 5.0, 5.5, 6.0, -1.0, 11.0, -3.0])
    at, found = envelope(time, values, 10.0, 22.0, 4)
    assert at.tolist() == [10.0, 12.0, 13.0, 15.0, 16.0, 18.0, 19.0, 21.0]
    assert found.tolist() == [3.0, 9.0, 8.0, -2.0, 5.0, 6.0, 11.0, -3.0]
    few = envelope(time[:8], values[:8], 10.0, 22.0, 4)
    assert (few[0].tolist(), few[1].tolist()) == (time[:8].tolist(), values[:8].tolist())


@pytest.mark.parametrize(
    ("low", "high", "count", "numbers", "step"),
    [
        (0.0, 10.0, 5, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0], 2.0),
        (-0.13, 0.42, 4, [0.0, 0.2, 0.4], 0.2),
        (-7.0, 42.0, 5, [0.0, 10.0, 20.0, 30.0, 40.0], 10.0),
        (13.0, 58.0, 9, [15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0], 5.0),
        (-61.0, -9.0, 3, [-60.0, -40.0, -20.0], 20.0),
        (3.0, 30.0, 4, [10.0, 20.0, 30.0], 10.0),
    ],
)
def test_ticks(low: float, high: float, count: int, numbers: list[float], step: float) -> None:
    assert ticks(low, high, count) == (pytest.approx(numbers), pytest.approx(step))


def test_a_range_about_zero_has_other_numbers() -> None:
    """Steps of a quarter of 8360, 5000, meet it at zero alone."""
    found = _numbers(Axis(), (-4180.0, 4180.0), ("m", 1.0), 4)
    assert found == [(-4000.0, "−4000"), (-2000.0, "−2000"), (0.0, "0"), (2000.0, "2000"), (4000.0, "4000")]


@pytest.mark.parametrize(
    ("value", "step", "label"),
    [
        (2.0, 1.0, "2"), (0.25, 0.05, "0.25"), (-0.3, 0.1, "−0.3"), (-1e-9, 0.1, "0.0"), (1500.0, 500.0, "1500"),
        (2e6, 5e5, "2e+06"), (-3e-5, 1e-5, "−3e−05"), (0.002, 0.001, "0.002"), (0.01, 0.005, "0.010"),
        (3e5, 2e6, "3e+05"),
    ],
)  # fmt: skip
def test_labels_of_ticks(value: float, step: float, label: str) -> None:
    assert tick_label(value, step) == label


@pytest.mark.parametrize(
    ("duration", "unit", "size", "words"),
    [
        (90.0, "s", 1.0, "90 s"), (600.0, "s", 1.0, "600 s"), (606.0, "min", 60.0, "10.1 min"),
        (3984.0, "min", 60.0, "66.4 min"), (14_400.0, "min", 60.0, "240 min"), (16_200.0, "h", 3600.0, "4.5 h"),
    ],
)  # fmt: skip
def test_the_unit_of_a_duration(duration: float, unit: str, size: float, words: str) -> None:
    assert time_unit(duration) == (unit, size)
    assert duration_words(duration) == words


def test_ticks_of_time() -> None:
    """At most nine steps; 3 is a step of seconds and of minutes, and not of hours; the unit is that of the length."""
    at, step, unit, size = time_ticks(1000.0, 1240.0)
    assert at.tolist() == [1020.0, 1050.0, 1080.0, 1110.0, 1140.0, 1170.0, 1200.0, 1230.0]
    assert (step, unit, size) == (30.0, "s", 1.0)
    at, step, unit, size = time_ticks(7200.0, 8460.0)
    assert at.tolist() == [120.0, 123.0, 126.0, 129.0, 132.0, 135.0, 138.0, 141.0]
    assert (step, unit, size) == (3.0, "min", 60.0)
    at, step, unit, size = time_ticks(7200.0, 7200.0 + 24.0 * 3600.0)
    assert (at.tolist(), step, unit, size) == ([5.0, 10.0, 15.0, 20.0, 25.0], 5.0, "h", 3600.0)


def test_rows_to_be_drawn() -> None:
    assert thinned(4).tolist() == [0, 1, 2, 3]
    assert thinned(11, 6).tolist() == [0, 2, 4, 6, 8, 10]
    assert thinned(100, 4).tolist() == [0, 33, 66, 99]
    assert len(thinned(40_000)) == 16_384


def test_rows_after_the_filter_has_settled() -> None:
    """5 % of the 200 s from 100 s to 300 s are left out: at the start, and at the end of the backward solution."""
    time = np.array([100.0, 104.0, 110.0, 150.0, 290.0, 296.0, 300.0])
    assert settled("aided", time, (100.0, 300.0)) == slice(2, None)
    assert settled("smoothed", time, (100.0, 300.0)) == slice(2, None)
    assert settled("backward", time, (100.0, 300.0)) == slice(0, 5)


def test_the_blocks_of_navigation() -> None:
    """The components in the order of the filter's states; heights are positive upwards, positions down."""
    assert [(name, scale, tuple(key for key, _ in parts), sign) for name, scale, parts, sign in NAVIGATION] == [
        ("position", LENGTH_SCALE, ("position_north", "position_east", "height"), -1.0),
        ("velocity", SPEED_SCALE, ("velocity_north", "velocity_east", "velocity_down"), 1.0),
        ("attitude", ANGLE_SCALE, ("tilt_north", "tilt_east", "azimuth"), 1.0),
    ]


@pytest.mark.parametrize(
    ("low", "high", "numbers"),
    [
        (8.0, 60.0, [10, 20, 30, 50]), (8.0, 79.0, [10, 20, 30, 50, 70]), (8.0, 81.0, [10, 20, 50]),
        (3.0, 899.0, [5, 10, 20, 50, 100, 200, 500]), (3.0, 901.0, [10, 100]), (0.02, 0.5, [0.02, 0.05, 0.1, 0.2, 0.5]),
        (5e5, 3e6, [5e5, 7e5, 1e6, 2e6, 3e6]),
    ],
)  # fmt: skip
def test_plain_numbers_on_a_logarithmic_axis(low: float, high: float, numbers: list[float]) -> None:
    """Within a ratio of 10 also threes and sevens, within 300 twos and fives, beyond only powers of ten."""
    assert list(log_numbers(low, high)) == pytest.approx(numbers)
