"""The report of a run on recorded sensors: motion, readings, estimates and the reference, from chosen numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.charts import over
from sinssim.data import ImuData, NavSolution
from sinssim.exhibits import Sentence
from sinssim.experiments.run.parts import motion_source as report
from sinssim.experiments.run.sensor_exhibits import recorded_readings
from sinssim.simulation.truth_and_sensors import RecordedMotion
from sinssim.strapdown.navigation_error import NavError
from tests.recording.made_filter import ESTIMATES, SIGMA, SIZE, SLICES
from tests.recording.spies import Plot, cells, html, plots

X, Y, Z = "#d55e00", "#009e73", "#56b4e9"
AIDED, BOUND, TRUTH = "#0072b2", "#969696", "#009e73"
TIME = np.array([100.0, 102.0, 106.0, 110.0])
SPAN = (100.0, 110.0)


def prepared(*outages: tuple[float, float], reference: Any = None, sensed: Any = ()) -> Any:
    return SimpleNamespace(log=SimpleNamespace(outages=outages, reference=reference, sensed=sensed))


def test_readings_as_rates() -> None:
    """Increments over intervals of 2, 4 and 4 s, deg/s and m/s², at the ends of the intervals."""
    dtheta = np.radians([[2.0, -4.0, 6.0], [4.0, 12.0, -20.0], [-8.0, 16.0, 28.0]])
    imu = ImuData(TIME, dtheta, np.degrees(dtheta) * 2.0)
    found = plots(recorded_readings(imu, [report.mark_at(101.0, "outage")]))
    rates = ([1.0, 1.0, -2.0], [-2.0, 3.0, 4.0], [3.0, -5.0, 7.0])
    at = TIME[1:]
    found[0].shows("Inertial angular rate", "deg/s", *zip("xyz", (X, Y, Z), [at] * 3, rates, strict=True))
    found[1].shows("Specific force", "m/s²", *zip("xyz", (X, Y, Z), [at] * 3, 2.0 * np.array(rates), strict=True))
    assert [one.span for one in found] == [SPAN] * 2
    assert found[1].marks == [(101.0, "outage", False)]


def test_marks_of_outages() -> None:
    """Up to four are named."""
    few = prepared(*((10.0 * k, 10.0 * k + 3.0) for k in range(4))).log
    many = prepared(*((10.0 * k, 10.0 * k + 3.0) for k in range(5))).log
    assert [(m.at, m.text, m.color == "grid") for m in report._outage_marks(few)][1:3] == [
        (10.0, "outage", False), (20.0, "outage", False),
    ]  # fmt: skip
    assert [(m.at, m.text, m.color == "grid") for m in report._outage_marks(many)][4:] == [(40.0, "", True)]


def test_estimated_errors_with_their_sigma() -> None:
    """deg/s and mg; the values in the middle of the band of ±1σ; a block without uncertainty is not drawn."""
    time = np.array([20.0, 30.0, 40.0, 220.0, 420.0])
    scale = {"gyro scale": np.full((5, 3), 0.5)}
    slices = {**SLICES, "gyro scale": slice(0, 0)}
    estimate: Any = SimpleNamespace(
        time=time, sigma=SIGMA, parameters={**ESTIMATES, **scale}, model=SimpleNamespace(slices=slices)
    )
    values, share = np.array([1.0, 2.0, 3.0, -4.0, 6.0]), np.array([100.0, 40.0, 10.0, 6.0, 4.0])
    pale = ("#af7f5a", "#5a9988", "#7ca2b7")
    gyro, accelerometer = map(Plot, report._estimates(estimate, over((20.0, 420.0))))
    for found, block, unit, size, axes in (
        (gyro, "gyro bias", "deg/s", np.pi / 180.0, "xyz"),
        (accelerometer, "accelerometer bias", "mg", 9.80665e-3, "xy"),
    ):
        curves: list[Any] = []
        for k, axis in enumerate(axes):
            own = SIZE[SLICES[block].start + k] / size
            curves += [("", pale[k], time, own * (values + share)), ("", pale[k], time, own * (values - share)),
                       (axis, (X, Y, Z)[k], time, own * values)]  # fmt: skip
        found.shows(block.capitalize(), unit, *curves)
        assert [line.counts for line in found.lines[:3]] == [False, False, True]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("name", "unit", "size"),
    [("gyro scale", "%", 0.01), ("accelerometer scale", "%", 0.01), ("gyro instability", "deg/s", np.pi / 180.0),
     ("accelerometer instability", "mg", 9.80665e-3)],
)  # fmt: skip
def test_units_of_the_other_estimates(name: str, unit: str, size: float) -> None:
    title, ((shown, one, _),) = report.ESTIMATES[name]
    assert (title.lower().startswith(name), shown, one) == (True, unit, pytest.approx(size))


def test_difference_from_the_reference_and_both_sigmas() -> None:
    """North and east 3 : 4 give 5/4 of east; 1σ of both by Pythagoras."""
    east = np.array([4.0, 8.0, -12.0, 16.0])
    place = np.outer(east, (0.75, 1.0, 9.0))
    error = NavError(TIME, place, np.zeros((4, 3)), np.zeros((4, 3)))
    sigma = np.outer([1.0, 2.0, 3.0, 4.0], (5.0, 12.0, 99.0, 7.0))
    own = np.outer([4.0, 3.0, 2.0, 1.0], (0.8, 1.5, 99.0))
    reference = SimpleNamespace(position_sigma=own, sigma_at=lambda time: own)
    estimate = SimpleNamespace(time=TIME, sigma=sigma, parameters={})
    aided: Any = SimpleNamespace(estimate=estimate, error_at=lambda rows: error)
    of: Any = SimpleNamespace(prepared=prepared((103.0, 105.0), reference=reference))
    (found,) = plots(report.after_filter(of, aided, SPAN))
    found.shows(
        "Horizontal", "m", ("aided minus reference, horizontal", AIDED, TIME, [5.0, 10.0, 15.0, 20.0]),
        ("1σ of the filter", BOUND, TIME, [13.0, 26.0, 39.0, 52.0]),
        ("1σ that the reference states", TRUTH, TIME, [6.8, 5.1, 3.4, 1.7]),
    )  # fmt: skip
    assert found.marks == [(103.0, "outage", False)]
    assert found.chart.y.low == 0.0
    reference.position_sigma = None  # type: ignore[assignment]
    assert not list(report.after_filter(of, aided, SPAN))


def test_the_recorded_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ground speeds 5, 13, 13 and 25 m/s over 2, 4 and 4 s: 18 + 52 + 76 m."""
    velocity = np.array([[3.0, -4.0, 1.0], [5.0, 12.0, -2.0], [-12.0, 5.0, 0.0], [7.0, -24.0, -6.5]])
    angles = np.array([[350.0, 1.5, 2.0], [5.0, 10.0, -30.0], [100.0, -7.25, 45.0], [200.0, 3.0, 4.0]])
    best = NavSolution(
        TIME,
        np.radians([-33.5, -33.4, -33.3, -33.21]),
        np.radians([151.25, 151.5, 151.75, -179.125]),
        np.array([120.0, 340.0, 90.5, 260.0]),
        velocity,
        Rotation.from_euler("ZYX", angles, degrees=True).as_quat(scalar_first=True),
        np.zeros(4),
    )
    seen: list[Any] = []
    monkeypatch.setattr(report, "best_solution", lambda run, aided: ("smoothed", best))
    monkeypatch.setattr(report, "track_map", lambda *what, **more: seen.append((what, more)) or Sentence("(map)"))
    reference = SimpleNamespace(time=TIME[:2], latitude=np.array([0.5, 0.6]), longitude=np.array([0.7, 0.8]),
                                height=np.array([9.0, 8.0]))  # fmt: skip

    class Sensed:
        label = "gnss <1>"

        def __len__(self) -> int:
            return 37

    log = prepared((103.0, 105.0), reference=reference, sensed=[SimpleNamespace(measurements=Sensed())])
    run: Any = SimpleNamespace(
        truth=RecordedMotion(log, None), time=np.array([100.0, 1000.0]),
        sensed=SimpleNamespace(measured=ImuData(TIME, np.zeros((3, 3)), np.ones((3, 3)))),
        scenario=SimpleNamespace(output=SimpleNamespace(angles=None)),
    )  # fmt: skip
    items = list(report.Log(run).exhibits())
    assert cells(html(*items)) == [
        ["the smoothed solution", ""], ["duration", "15 min"],
        ["distance over ground (∫ ground speed dt)", "0.146 km"],
        ["start", "33.50000°S 151.25000°E, 120.0\u00a0m"], ["end", "33.21000°S 179.12500°W, 260.0\u00a0m"],
        ["height", "90.5 … 340.0 m"], ["ground speed", "5.0 … 25.0 m/s"], ["roll of the IMU", "−30.0 … 45.0°"],
        ["pitch of the IMU", "−7.2 … 10.0°"], ["recorded, gnss &lt;1&gt;", "37 measurements"],
    ]  # fmt: skip
    ((tracks, _), more) = seen[0]
    best_of, other = tracks
    np.testing.assert_array_equal(best_of.time, TIME)
    np.testing.assert_array_equal(best_of.longitude, best.longitude)
    np.testing.assert_array_equal(other.latitude, [0.5, 0.6])
    np.testing.assert_array_equal(other.longitude, [0.7, 0.8])
    assert [(track.name, track.color) for track in tracks] == [("smoothed", (171, 138, 156)), ("reference", "truth")]
    assert more["outages"] == ((103.0, 105.0),)
    assert [found.title for found in plots(items)] == [
        "Height above the ellipsoid", "Speed", "Roll and pitch", "Heading", "Inertial angular rate", "Specific force",
    ]  # fmt: skip


def test_errors_where_the_position_is_known() -> None:
    place = np.array([[1.0, 2.0, 3.0], [np.nan, 1.0, 1.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]])
    error = NavError(TIME, place, 2.0 * place, 3.0 * place)
    two, one = place.copy(), place.copy()
    two[3], one[2:] = np.nan, np.nan
    found = report.known_errors({"a": error, "b": NavError(TIME, np.full((4, 3), np.nan), place, place)})
    fewer = report.known_errors({"two": NavError(TIME, two, place, place), "one": NavError(TIME, one, place, place)})
    assert {name: error.time.tolist() for name, error in fewer.items()} == {"two": TIME[[0, 2]].tolist()}
    assert list(found) == ["a"]
    np.testing.assert_array_equal(found["a"].time, TIME[[0, 2, 3]])
    np.testing.assert_array_equal(found["a"].velocity_ned, 2.0 * place[[0, 2, 3]])
    np.testing.assert_array_equal(found["a"].attitude, 3.0 * place[[0, 2, 3]])
