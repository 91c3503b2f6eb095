"""The section on a redundant set: directions, alarms, statistics, detectable faults, with and without monitoring."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.charts import Charts
from sinssim.experiments.run.parts import redundancy
from sinssim.experiments.run.parts.redundancy import Redundancy
from sinssim.experiments.run.sensor_exhibits import single_errors
from sinssim.sensors.fault_detection import Monitored
from sinssim.sensors.imu.imu_section import Imu, draw
from sinssim.strapdown.navigation_error import NavError
from tests.recording.made_monitoring import ACCELEROMETERS, GYROS, SECTION, TIME
from tests.recording.spies import Shown, cells, html, read

AIDED, PINK = "#0072b2", "#e11e6e"
ARCSEC = np.pi / 648_000.0


def test_directions_and_the_sum_of_variances() -> None:
    """Three axes and one between them: tr (I + d dᵀ)⁻¹ = 3 − ½, at least 9/4; acos 0.8 is 36.87°."""
    html = Shown(redundancy.about(SECTION)).html
    assert cells(html) == [
        ["sensor", "forward", "right", "down", "from the down axis, deg"],
        ["1", "1.00000", "0", "0", "90.00"], ["2", "0", "1.00000", "0", "90.00"], ["3", "0", "0", "1.00000", "0.00"],
        ["4", "0.600000", "0", "0.800000", "36.87"],
    ]  # fmt: skip
    assert "Four single gyros and four single accelerometers along given directions." in html
    assert "add up to tr (HᵀH)⁻¹ = 2.5 of the variance of one sensor, the least possible with this number of sensors " \
           "is 9/m = 2.25;" in html  # fmt: skip


def test_alarms_in_their_columns() -> None:
    assert cells(Shown([redundancy.alarms([GYROS, ACCELEROMETERS])]).html) == [
        ["faulty sensor", "detected at, s", "window", "statistic", "threshold", "isolated and excluded at, s"],
        ["gyro 3", "11.000", "1 s", "45.25", "20.50", "11.500"],
        ["one of the accelerometers", "10.500", "sample", "14.00", "12.00", "not isolated"],
        ["accelerometer 2", "11.000", "sample", "33.00", "12.00", "11.000"],
    ]
    assert read(Shown([redundancy.alarms([])]).html) == "No fault was detected."


def part(without: NavError | None = None, own: dict[str, NavError] | None = None, monitored: Any = None) -> Any:
    found = (GYROS, ACCELEROMETERS) if monitored is None else monitored
    readings = SimpleNamespace(monitored=found, imu=SimpleNamespace(time=TIME))
    run: Any = SimpleNamespace(
        time=TIME, errors=own or {}, sensed=SimpleNamespace(readings=readings),
        scenario=SimpleNamespace(imu=SimpleNamespace(sensor_set=SECTION)),
    )  # fmt: skip
    made = Redundancy(run)
    vars(made)["without_monitoring"] = without
    return made


def test_statistics_thresholds_and_sensors_in_use() -> None:
    """The axis ends at twice the largest threshold; a window without a test has no line; gaps in use."""
    found = Shown(part().exhibits())
    at = TIME[1:]
    found.curves(
        "redundancy/gyro/statistic", "Gyros: test statistic", "", ("sample", "#009e73", at, [2.0, 9.0, 31.0, 4.0]),
        ("1 s", "#d55e00", at, [np.nan, 5.0, 45.0, 6.0]), ("threshold", PINK, at, [20.0, 20.0, 20.0, 15.0]),
    )  # fmt: skip
    found.curves(
        "redundancy/accel/statistic", "Accelerometers: test statistic", "",
        ("sample", "#009e73", at, [3.0, 8.0, 2.0, 1.0]), ("threshold", PINK, at, [12.0, np.nan, 12.0, 12.0]),
    )  # fmt: skip
    assert found.span("redundancy/gyro/statistic") == (10.0, 12.0)
    assert found.rules("redundancy/gyro/statistic") == [(11.5, "3 excluded")]
    assert found.rules("redundancy/accel/statistic") == [(10.5, "fault detected"), (11.0, "2 excluded")]
    ranges = found.drawn.ranges
    assert (ranges["redundancy/gyro/statistic"], ranges["redundancy/accel/statistic"]) == ((0.0, 40.0), (0.0, 24.0))
    used = [[1.0, 2.0, 3.0, 4.0]] * 3 + [[1.0, 2.0, np.nan, 4.0]]
    assert ranges["redundancy/gyro/used"] == (0.0, 5.0)
    found.drawn.shows("redundancy/gyro/used", ["1", "2", "3", "4"], at, used)
    found.drawn.shows("redundancy/accel/used", ["1", "2", "3", "4"], at, [[1.0, 2.0, 3.0, 4.0]] * 4)
    assert "Values above 2 thresholds are clipped." in found.html
    assert "in use" not in found.html.replace("sensors in use", "")
    none = Shown(part(monitored=()).exhibits())
    assert "The sensors are not monitored: all of them are always used." in none.html
    assert not none.charts


def test_a_thinned_statistic_keeps_its_peaks() -> None:
    """Of 30 000 samples the largest, and the gap before the first whole window, are recorded."""
    time = np.arange(30_001) / 100.0
    rng = np.random.default_rng(5)
    values = rng.uniform(0.0, 10.0, (2, 30_000))
    values[0, 17_123], values[1, :100] = 31.0, np.nan
    whole = np.full(30_000, 20.0)
    one = Monitored("gyro", np.array([0.01, 1.0]), values, whole, GYROS.smallest, (), np.ones((30_000, 4), int))
    drawn = Shown([Charts("c", ((redundancy.statistic(one, time),),), (1.0, 1.0))]).drawn
    at, rows, *_ = drawn.lines["redundancy/gyro/statistic"]
    assert len(at) < 30_000
    assert at[np.nanargmax(rows[:, 0])] == time[17_124]
    assert rows[:, 0].max() == 31.0
    assert np.isnan(rows[at < 1.005, 1]).all()
    assert np.isfinite(rows[at > 1.005, 1]).all()


def test_events_of_the_monitoring() -> None:
    """A fault that is isolated later than detected has two events, one that is isolated at once has one."""
    assert [(event.time, event.text) for event in part().events()] == [
        (11.0, "fault of the gyros detected"), (11.5, "gyro 3 excluded"),
        (10.5, "fault of the accelerometers detected, not isolated"), (11.0, "accelerometer 2 excluded"),
    ]  # fmt: skip


def test_the_smallest_detectable_biases() -> None:
    """Of seven and four tests with 2 % false alarms each, 0.14 and 0.08 are expected."""
    html = Shown(redundancy.tests([GYROS, ACCELEROMETERS], SECTION)).html
    assert cells(html) == [
        ["window", "smallest detectable bias, deg/h"], ["sample", "40.0 to 70.0"], ["1 s", "20.0"],
        ["window", "smallest detectable bias, µg"], ["sample", "300 to 500"],
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


def test_with_and_without_monitoring() -> None:
    without = error([4.0, 8.0, 12.0, 16.0, 20.0], [1.0, 2.0, 3.0, 60.0, 5.0])
    own = {"poisson": error([0.4, 0.8, 4.0, 1.6, 2.0], [1.0, 2.0, 6.0, 4.0, 5.0]), "euler": without}
    found = Shown(part(without, own).exhibits())
    assert "With and without monitoring: poisson" in found.html
    found.curves(
        "redundancy/horizontal", "Horizontal error of poisson", "m",
        ("without monitoring", PINK, TIME, [5.0, 10.0, 15.0, 20.0, 25.0]),
        ("with monitoring", AIDED, TIME, [0.5, 1.0, 5.0, 2.0, 2.5]),
    )  # fmt: skip
    minute = 17.0 / 60.0
    found.curves(
        "redundancy/attitude", "Attitude error of poisson", "arcmin",
        ("without monitoring", PINK, TIME, np.array([1.0, 2.0, 3.0, 60.0, 5.0]) * minute),
        ("with monitoring", AIDED, TIME, np.array([1.0, 2.0, 6.0, 4.0, 5.0]) * minute),
    )  # fmt: skip
    assert found.rules("redundancy/horizontal") == found.rules("redundancy/attitude") == [(11.0, ""), (11.5, "")]
    names, colors = ["without monitoring", "with monitoring"], [(225, 30, 110), (0, 114, 178)]
    lines = np.array([[5.0, 10.0, 15.0, 20.0, 25.0], [0.5, 1.0, 5.0, 2.0, 2.5]]).T
    found.drawn.shows("redundancy/horizontal", names, TIME, lines, colors)
    assert (found.labels["redundancy/horizontal"], found.labels["redundancy/attitude"]) == ("m", "arcmin")
    assert [one.name for one in part(without, own).streams()] == ["error_without_monitoring"]
    for one in (part(None, own), part(without)):
        assert "redundancy/horizontal" not in Shown(one.exhibits()).charts
    assert not list(part(None, own).streams())


def test_errors_of_single_sensors_in_their_units() -> None:
    """The first four of two blocks of three; the tilt of an axis is the length of its row of misalignments."""
    section = Imu(grade="ideal", gyro_bias_sigma_deg_h=0.75, gyro_misalignment_sigma_arcsec=6.0, sensor_set=SECTION)
    ideal = Imu(grade="ideal")
    blocks = [draw(ideal, 1), draw(ideal, 2)]
    rows = [[0.0, 3.0, -4.0], [5.0, 0.0, 12.0], [8.0, 15.0, 0.0]], [[0.0, 20.0, 21.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    for block, bias, tilts in zip(blocks, ([1.0, -2.0, 3.0], [4.5, 5.0, 6.0]), rows, strict=True):
        block.gyro.bias[:] = np.array(bias) * ARCSEC
        block.gyro.misalignment[:] = np.array(tilts) * ARCSEC
    assert cells(html(single_errors(blocks, section, "gyro"))) == [
        ["", "unit", "1", "2", "3", "4", "1σ"], ["bias", "deg/h", "1.000", "−2.000", "3.000", "4.500", "0.75"],
        ["scale factor", "ppm", "0", "0", "0", "0", "0"],
        ["tilt of the axis", "arcsec", "5.000", "13.00", "17.00", "29.00", "6"],
    ]  # fmt: skip
