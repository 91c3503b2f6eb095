"""The section on a redundant set: directions, alarms, statistics, detectable faults, with and without monitoring."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.experiments.run.report import redundancy as report
from sinssim.sensors.imu.imu import Imu, draw
from sinssim.strapdown.nav_error import NavError
from tests.recording.made_monitoring import ACCELEROMETERS, GYROS, SECTION, TIME
from tests.recording.spies import Plots, cells, read

AIDED, PINK = "#0072b2", "#e11e6e"
ARCSEC = np.pi / 648_000.0


def test_directions_and_the_sum_of_variances() -> None:
    """Three axes and one between them: tr (I + d dᵀ)⁻¹ = 3 − ½, at least 9/4; acos 0.8 is 36.87°."""
    html = "".join(report._about(SECTION))
    assert cells(html) == [
        ["sensor", "forward", "right", "down", "from the down axis [deg]"],
        ["1", "1.00000", "0", "0", "90.00"], ["2", "0", "1.00000", "0", "90.00"], ["3", "0", "0", "1.00000", "0.00"],
        ["4", "0.600000", "0", "0.800000", "36.87"],
    ]  # fmt: skip
    assert "Four single gyros and four single accelerometers along given directions." in html
    assert "add up to tr (HᵀH)⁻¹ = 2.5 of the variance of one sensor, the least possible with this number of sensors " \
           "is 9/m = 2.25;" in html  # fmt: skip


def test_alarms_in_their_columns() -> None:
    assert cells(report._alarms([GYROS, ACCELEROMETERS])) == [
        ["faulty sensor", "detected at [s]", "window", "statistic", "threshold", "isolated and excluded at [s]"],
        ["gyro 3", "11.000", "1 s", "45.25", "20.50", "11.500"],
        ["one of the accelerometers", "10.500", "sample", "14.00", "12.00", "not isolated"],
        ["accelerometer 2", "11.000", "sample", "33.00", "12.00", "11.000"],
    ]
    assert report._alarms([]) == "<p>No fault was detected.</p>"


def test_statistics_and_thresholds(plots: Plots) -> None:
    """The axis ends at the tick above twice the largest threshold; a window without a test has no line."""
    for one in (GYROS, ACCELEROMETERS):
        report._statistic(one, TIME)
    gyros, accelerometers = plots
    at = TIME[1:]
    assert [line.label for line in gyros.lines] == ["sample", "1 s", "threshold"]
    for line, values in zip(gyros.lines, ([2.0, 9.0, 31.0, 4.0], [np.nan, 5.0, 45.0, 6.0], [20.0, 20.0, 20.0, 15.0]),
                            strict=True):  # fmt: skip
        np.testing.assert_array_equal(line.time, at)
        np.testing.assert_array_equal(line.values, values)
    assert (gyros.title, gyros.unit, gyros.span) == ("Gyros: test statistic", "", (10.0, 12.0))
    assert gyros.options["axis"] == (0.0, 40.0, 10.0)
    assert gyros.marks == [(11.5, "3 excluded", False)]
    assert gyros.lines[-1].color == PINK
    assert gyros.lines[-1].reference
    assert accelerometers.title == "Accelerometers: test statistic"
    assert [line.label for line in accelerometers.lines] == ["sample", "threshold"]
    assert accelerometers.options["axis"] == (0.0, 25.0, 5.0)
    assert accelerometers.marks == [(10.5, "fault detected", False), (11.0, "2 excluded", False)]


def test_the_smallest_detectable_biases() -> None:
    """Of seven and four tests with 2 % false alarms each, 0.14 and 0.08 are expected."""
    html = "".join(report._tests([GYROS, ACCELEROMETERS], SECTION))
    assert cells(html) == [
        ["window", "smallest detectable bias [deg/h]"], ["sample", "40.0 to 70.0"], ["1 s", "20.0"],
        ["window", "smallest detectable bias [µg]"], ["sample", "300 to 500"],
    ]  # fmt: skip
    text = read(html)
    assert "Gyros window" in text
    assert "7 tests; of such tests without a fault, at most 0.14 false alarms are expected." in text
    assert "4 tests; of such tests without a fault, at most 0.080 false alarms are expected." in text
    assert "raises a false alarm with the probability 0.02." in text
    assert "misses with the probability 0.003." in text


def error(east: list[float], tilt: list[float]) -> NavError:
    """North and east 3 : 4, horizontal 5/4 of east; angles 8 : 15, 17 times the factor."""
    place = np.outer(east, (0.75, 1.0, 9.0))
    return NavError(TIME, place, np.zeros_like(place), np.outer(tilt, (8.0, 15.0, 0.0)) * ARCSEC)


def test_with_and_without_monitoring(plots: Plots) -> None:
    readings = SimpleNamespace(monitored=(ACCELEROMETERS, GYROS))
    without = error([4.0, 8.0, 12.0, 16.0, 20.0], [1.0, 2.0, 3.0, 60.0, 5.0])
    own = {"poisson": error([0.4, 0.8, 4.0, 1.6, 2.0], [1.0, 2.0, 6.0, 4.0, 5.0]), "euler": without}
    run = SimpleNamespace(time=TIME, errors=own, sensed=SimpleNamespace(readings=readings))
    part: Any = SimpleNamespace(run=run, without_monitoring=without)
    html = "".join(report.with_and_without(part))
    assert "With and without monitoring: poisson" in html
    horizontal, attitude = plots
    horizontal.shows(
        "Horizontal error", "m", ("without monitoring", PINK, TIME, [5.0, 10.0, 15.0, 20.0, 25.0]),
        ("with monitoring", AIDED, TIME, [0.5, 1.0, 5.0, 2.0, 2.5]),
    )  # fmt: skip
    minute = 17.0 / 60.0
    attitude.shows(
        "Attitude error", "arcmin",
        ("without monitoring", PINK, TIME, np.array([1.0, 2.0, 3.0, 60.0, 5.0]) * minute),
        ("with monitoring", AIDED, TIME, np.array([1.0, 2.0, 6.0, 4.0, 5.0]) * minute),
    )  # fmt: skip
    assert horizontal.marks == attitude.marks == [(11.0, "", False), (11.5, "", False)]
    part.without_monitoring = None
    assert not list(report.with_and_without(part))


def test_errors_of_single_sensors_in_their_units() -> None:
    """The first four of two blocks of three; the tilt of an axis is the length of its row of misalignments."""
    section = Imu(grade="ideal", gyro_bias_sigma_deg_h=0.75, gyro_misalignment_sigma_arcsec=6.0, sensor_set=SECTION)
    ideal = Imu(grade="ideal")
    blocks = [draw(ideal, 1), draw(ideal, 2)]
    rows = [[0.0, 3.0, -4.0], [5.0, 0.0, 12.0], [8.0, 15.0, 0.0]], [[0.0, 20.0, 21.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    for block, bias, tilts in zip(blocks, ([1.0, -2.0, 3.0], [4.5, 5.0, 6.0]), rows, strict=True):
        block.gyro.bias[:] = np.array(bias) * ARCSEC
        block.gyro.misalignment[:] = np.array(tilts) * ARCSEC
    assert cells(report.single_errors(blocks, section, "gyro")) == [
        ["", "unit", "1", "2", "3", "4", "1σ"], ["bias", "deg/h", "1.000", "−2.000", "3.000", "4.500", "0.75"],
        ["scale factor", "ppm", "0", "0", "0", "0", "0"],
        ["tilt of the axis", "arcsec", "5.000", "13.00", "17.00", "29.00", "6"],
    ]  # fmt: skip
