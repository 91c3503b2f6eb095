"""Tables and plots of the sensors' errors from errors that are chosen: units, 1σ of the grade, single sensors."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.run import sensor_exhibits as compared
from sinssim.experiments.run import sensor_exhibits as report
from sinssim.experiments.run.sensor_exhibits import SensorComparison
from sinssim.sensors.imu.faults import BiasStep, Dropout, Spike
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import WarmUp
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_readings import AttitudeSensorErrors
from sinssim.units import ANGLE_SCALE, SPEED_SCALE
from tests.recording.spies import Plot, cells, html, plots

ARCSEC, UG = np.pi / 648_000.0, 9.80665e-6
X, Y, Z = "#d55e00", "#009e73", "#56b4e9"


def test_six_single_accelerometers() -> None:
    """The tactical grade has 1000 µg, 300 ppm and 100″; the tilt is √(3² + 4²) and so on."""
    tilts = np.array([[0.0, 3.0, -4.0], [5.0, 0.0, 12.0], [8.0, 15.0, 0.0]]) * ARCSEC
    one = TriadErrors(bias=np.array([1.0, -2.0, 3.0]) * UG, scale=np.array([7.0, 8.0, 9.5]) * 1e-6, misalignment=tilts)
    two = TriadErrors(
        bias=np.array([4.5, 5.0, 6.0]) * UG, scale=np.array([-1.0, 2.0, 3.0]) * 1e-6, misalignment=2.0 * tilts
    )
    page = html(report._six(Imu(grade="tactical"), [one, two]))
    heads = ["", "unit", "1", "2", "3", "4", "5", "6", "1σ"]
    assert cells(page) == [
        heads, ["bias", "µg", "1.000", "−2.000", "3.000", "4.500", "5.000", "6.000", "1000"],
        ["scale factor", "ppm", "7.000", "8.000", "9.500", "−1.000", "2.000", "3.000", "300"],
        ["axis tilt", "arcsec", "5.000", "13.00", "17.00", "10.00", "26.00", "34.00", "100"],
    ]  # fmt: skip
    own = Imu(
        grade="tactical", accel_bias_sigma_ug=11.0, accel_scale_sigma_ppm=12.0, accel_misalignment_sigma_arcsec=13.0
    )
    assert [row[-1] for row in cells(html(report._six(own, [one, two])))] == ["1σ", "11", "12", "13"]


def test_an_attitude_sensor() -> None:
    sensor = {"type": "attitude-sensor", "drift_deg_h": (1.0, 2.0, 3.0), "bias_sigma_arcsec": 8.0}
    section = Imu(grade="tactical", sensor_set=sensor)
    errors = AttitudeSensorErrors(
        np.array([2.0, -3.0, 5.0]) * ARCSEC, np.array([0.5, 0.25, -0.75]) * ARCSEC, 6.0 * ARCSEC
    )
    page = html(*report._attitude_sensor(section, errors))
    assert cells(page) == [
        ["reference", "unit", "X", "Y", "Z", "1σ"], ["initial error", "arcsec", "2.000", "−3.000", "5.000", "8"],
        ["drift", "deg/h", "0.5000", "0.2500", "−0.7500", "given"],
    ]  # fmt: skip
    assert "Noise of each measurement, 1σ 6 arcsec." in page
    drifting = Imu(grade="tactical", sensor_set={"type": "attitude-sensor"})
    assert [row[-1] for row in cells(html(*report._attitude_sensor(drifting, errors)))] == ["1σ", "0", "1"]


@pytest.mark.parametrize(
    ("given", "sigma", "of_grade", "text"),
    [(False, None, 12.3456, "12.35"), (False, 0.0, 5.0, "0"), (False, 3.0, 5.0, "3"), (True, None, 5.0, "given"),
     (True, 0.0, 5.0, "given"), (True, 0.25, 5.0, "given ± 0.25"), (False, 123456.7, 5.0, "123457")],
)  # fmt: skip
def test_the_spread_of_an_error(given: bool, sigma: float | None, of_grade: float, text: str) -> None:
    assert report._spread(given, sigma, of_grade) == text


def test_faults_in_words() -> None:
    lost = Dropout(type="dropout", from_s=3.5, to_s=9.0, channels=("gyro_4", "accel_2", "gyro_1"))
    assert report._fault(lost, True) == "dropout of gyro 1, gyro 4, accelerometer 2 from 3.5 s to 9 s"
    assert report._fault(lost, False) == "dropout from 3.5 s to 9 s"
    step = BiasStep(type="bias-step", from_s=3.5, accel_ug=(0.0, 0.0, 0.0, 1.0))
    assert report._fault(step, True) == "bias step of accelerometer 4 from 3.5 s to the end"
    spike = Spike(type="spike", at_s=4.25, gyro_arcsec=(0.0, 1.0, 0.0, 0.0, 0.0))
    assert report._fault(spike, True) == "a spike of gyro 2 at 4.25 s"


def test_the_null_shift_is_the_largest_between_start_and_end() -> None:
    """A shift of −(Θ + 3)(Θ − 5) has its largest value 16 at Θ = 1; −20 at the ends −5 and 7 is larger by amount."""
    shift = SimpleNamespace(bias=lambda warmth: -(warmth + 3.0) * (warmth - 5.0))
    errors: Any = SimpleNamespace(null_shift=shift, warm_up=WarmUp(-2.0, 4.0))
    assert report._null_shift(errors) == pytest.approx(16.0, rel=1e-4)
    errors.warm_up = WarmUp(-5.0, 7.0)
    assert report._null_shift(errors) == pytest.approx(20.0)
    errors.null_shift = None
    assert report._null_shift(errors) == 0.0


def test_noises_in_words() -> None:
    text = report._noises(("walk", 3.0 * ARCSEC, ARCSEC, "deg/√h"), ("none", 0.0, 1.0, "x"), ("range", 0.5, 0.25, "g"))
    assert text == "Walk 3 deg/√h, range 2 g."
    assert report._noises(("none", 0.0, 1.0, "x")) == "No noise."


def kind(key: str, title: str, left: Any = None, measured: Any = True, sums: Any = ANGLE_SCALE) -> SensorComparison:
    """Errors of a kind of sensor that grow by 2, −4 and 6 (or 0.5, 1, 1.5) a second from the start at 100 s."""
    time = 100.0 + 0.5 * np.arange(41)
    unit = ARCSEC if sums is ANGLE_SCALE else 1e-3
    error = np.outer(time - 100.0, (2.0, -4.0, 6.0)) * unit
    rest = None if left is None else np.outer(time - 100.0, left) * unit
    readings = np.ones((40, 3)) if measured else None
    drift = ("deg/h", ARCSEC) if sums is ANGLE_SCALE else ("µg", UG)
    return SensorComparison(key, title, ("x", "y", "z"), time, error, rest, sums, drift, readings, readings)


def drawn(of: SensorComparison) -> list[Plot]:
    return plots(compared.comparison_charts([of]))


def test_errors_of_the_readings() -> None:
    """In 20 s: 40, −80 and 120″; as means over 0.1 s, of which each sample is one, 2, −4 and 6 deg/h."""
    one = kind("gyro", "Gyros")
    mean, total = drawn(one)
    ends = one.averaged(one.error)[0]
    mean.shows("Gyros: error, mean over 0.1 s", "deg/h", *(
        (axis, color, ends, np.full(len(ends), rate))
        for axis, color, rate in zip("xyz", (X, Y, Z), (2.0, -4.0, 6.0), strict=True)
    ))  # fmt: skip
    grown = one.time - 100.0
    total.shows("Gyros: error, accumulated", "arcmin", *(
        (axis, color, one.time, grown * rate / 60.0)
        for axis, color, rate in zip("xyz", (X, Y, Z), (2.0, -4.0, 6.0), strict=True)
    ))  # fmt: skip
    assert mean.span == total.span == (100.0, 120.0)


def test_before_and_after_compensation() -> None:
    mean, total, left = drawn(kind("accel", "Accelerometers", (0.5, 1.0, 1.5), sums=SPEED_SCALE))
    labels = ["x measured", "y measured", "z measured", "x compensated", "y compensated", "z compensated"]
    assert [line.label for line in mean.lines] == [line.label for line in total.lines] == labels
    assert [line.color for line in total.lines[3:]] == [X, Y, Z]
    assert (mean.unit, total.unit, left.unit) == ("µg", "m/s", "mm/s")
    rates = [float(line.y[-1] / mean.chart.unit(True)[1]) for line in mean.lines]
    np.testing.assert_allclose(rates, np.array([2.0, -4.0, 6.0, 0.5, 1.0, 1.5]) * 1e-3 / UG)
    ends = [float(line.y[-1] / total.chart.unit(True)[1]) for line in total.lines]
    np.testing.assert_allclose(ends, [0.04, -0.08, 0.12, 0.01, 0.02, 0.03])
    grown = np.arange(41) * 0.5
    left.shows("Accelerometers: error after compensation, accumulated", "mm/s", *(
        (axis, color, 100.0 + grown, grown * rate)
        for axis, color, rate in zip("xyz", (X, Y, Z), (0.5, 1.0, 1.5), strict=True)
    ))  # fmt: skip


def test_an_attitude_sensor_has_errors_and_no_sums() -> None:
    mean, each = drawn(kind("attitude", "Attitude sensor", measured=False))
    assert mean.unit == each.unit == "arcmin"
    assert (mean.title, each.title) == (
        "Attitude sensor: error, mean over 0.1 s", "Attitude sensor: error of each measurement",
    )  # fmt: skip


def test_kinds_side_by_side() -> None:
    """Gyros left, accelerometers right; single sensors above the block that is combined of them."""
    kinds = [kind("gyro", "G"), kind("single_gyro", "SG"), kind("accel", "A", sums=SPEED_SCALE),
             kind("single_accel", "SA", sums=SPEED_SCALE)]  # fmt: skip
    titles = [found.title.partition(":")[0] for found in plots(compared.comparison_charts(kinds))]
    assert titles == ["SG", "SA", "SG", "SA", "G", "A", "G", "A"]
