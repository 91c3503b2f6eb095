"""A filter in the viewer: bands, parameters, shrinking σ, innovations and means of squares, from chosen numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.charts import Charts
from sinssim.estimation.filter_result import Innovations
from sinssim.experiments.run import filter_exhibits as view
from tests.recording.made_filter import aided
from tests.recording.spies import record

AIDED, SMOOTHED, BACKWARD = (0, 114, 178), (204, 121, 167), (213, 94, 0)
BOUND, REFUSED, POSITION = (150, 150, 150), (225, 30, 110), (0, 158, 115)
X, Y, Z = (213, 94, 0), (0, 158, 115), (86, 180, 233)
ARCSEC, ARCMIN = np.pi / 648_000.0, np.pi / 10_800.0
TIME = [20.0, 30.0, 40.0, 220.0, 420.0]
SHARE, ERROR = np.array([100.0, 40.0, 10.0, 6.0, 4.0]), np.array([-50.0, 30.0, -12.0, 7.0, 5.0])


def shown(found: Any) -> Any:
    """Return what a recording shows of a filter."""
    span = (20.0, 420.0)
    rows = view.band_charts(found, span, [])
    charts = [Charts("bands", rows, (1.0, 1.0)), *view.innovation_charts(found.estimate.innovations, span)]
    return record([*charts, *view.state_charts(found, span)])


@pytest.fixture(scope="module")
def drawn() -> Any:
    return shown(aided())


COMPONENTS = {
    "position_north": ("m", 2.0), "position_east": ("m", 3.0), "height": ("m", -5.0), "velocity_north": ("m/s", 0.002),
    "velocity_east": ("m/s", 0.003), "velocity_down": ("m/s", 0.005), "tilt_north": ("arcsec", 1e-6 / ARCSEC),
    "tilt_east": ("arcsec", 2e-6 / ARCSEC), "azimuth": ("arcmin", 4e-4 / ARCMIN),
}  # fmt: skip


def test_bands_of_every_error(drawn: Any) -> None:
    """The height is positive up; the range fits what comes after 5 % of the run, backwards before the last 5 %."""
    assert {f"filter/{name}": unit for name, (unit, _) in COMPONENTS.items()}.items() <= drawn.labels.items()
    for name, (_, size) in COMPONENTS.items():
        own = abs(size)
        for end, kind, paint, time, error, sigma in (
            ("/0", "aided", [BOUND, BOUND, AIDED], TIME, ERROR, SHARE),
            ("/1", "smoothed", [(171, 138, 156)] * 2 + [SMOOTHED], [20.0, 50.0, 420.0], np.array([8.0, -3.0, 2.0]),
             np.array([9.0, 2.5, 3.5])),
            ("/2", "backward", [(175, 127, 90)] * 2 + [BACKWARD], [30.0, 400.0, 410.0], np.array([1.0, -4.0, 60.0]),
             np.array([1.5, 5.0, 80.0])),
        ):  # fmt: skip
            values = np.column_stack((3.0 * own * sigma, -3.0 * own * sigma, size * error))
            drawn.shows(f"filter/{name}{end}", [f"±3σ, {kind}", f"±3σ, {kind}", kind], time, values, paint)
        # 3 · 10 of the aided solution after 5 % of the run, with a twentieth of room
        np.testing.assert_allclose(drawn.ranges[f"filter/{name}"], np.multiply((-31.5, 31.5), own))


def test_parameters_over_their_sigma(drawn: Any) -> None:
    """Errors over σ: −50/100, 30/40, −12/10, 7/6 and 5/4; what is known exactly has none."""
    ratio = ERROR / SHARE
    names = [f"gyro bias {axis}" for axis in ("forward", "right", "down")]
    drawn.shows("filter/gyro/1", names, TIME, np.column_stack([ratio] * 3), [X, Y, Z])
    drawn.shows("filter/accelerometer/1", ["accelerometer bias right"], TIME, ratio[:, None], [Y])
    for sensor in ("gyro", "accelerometer"):
        drawn.shows(f"filter/{sensor}/0", ["±3σ", "±3σ"], [20.0, 420.0], [[3.0, -3.0]] * 2, [BOUND] * 2)


def test_unknown_parameters_over_the_sigma_at_the_start() -> None:
    found = shown(aided(others=False, known=False))
    assert found.labels["filter/gyro title"] == "Gyros: estimates, σ at the start"
    ratio = np.array([1.0, 2.0, 3.0, -4.0, 6.0]) / 100.0
    found.shows("filter/accelerometer/1", ["accelerometer bias right"], TIME, ratio[:, None], [Y])
    assert "filter/height/1" not in found.lines


def test_sigma_shrinks_in_decades(drawn: Any) -> None:
    """100, 40, 10, 6 and 4: 0 to −1.398 decades; the worst-known state of a block counts."""
    names = ["position", "velocity", "attitude", "gyro bias", "accelerometer bias"]
    drawn.shows("filter/shrinking", names, TIME, np.column_stack([np.log10(SHARE / 100.0)] * 5))
    uneven = aided(others=False)
    uneven.estimate.sigma = uneven.estimate.sigma.copy()
    uneven.estimate.sigma[-1, 1] = 3.0 * 25.0
    other = shown(uneven)
    assert other.lines["filter/shrinking"][1][-1, 0] == pytest.approx(np.log10(0.25))
    assert other.lines["filter/shrinking"][3][0] == POSITION


def test_innovations_and_decisions(drawn: Any) -> None:
    color = drawn.dots["filter/innovations/gnss/dots_0"][3]
    expected = {
        "filter/innovations/gnss/dots_0": ([21.0, 23.0], [[1.5], [0.5]], ["accepted"], color, 1.2),
        "filter/innovations/gnss/dots_1": ([21.0, 23.0], [[-2.0], [0.2]], [""], color, 1.2),
        "filter/innovations/gnss/dots_2": ([24.0], [[-6.0]], ["rejected"], REFUSED, 2.6),
        "filter/innovations/gnss/dots_3": ([24.0], [[5.0]], [""], REFUSED, 2.6),
        "filter/decisions/dots_0": ([21.0, 23.0], [[0.0], [0.0]], ["gnss"], color, 1.2),
        "filter/decisions/dots_1": ([24.0], [[0.0]], ["rejected"], REFUSED, 2.6),
    }  # fmt: skip
    assert set(drawn.dots) == set(expected)
    for entity, (time, values, names, paint, size) in expected.items():
        found = drawn.dots[entity]
        np.testing.assert_array_equal(found[0], time)
        np.testing.assert_allclose(found[1], values, err_msg=entity)
        assert found[2:] == (names, paint, "circle", size)
    drawn.shows("filter/innovations/gnss", ["±3σ", "±3σ"], [20.0, 420.0], [[3.0, -3.0]] * 2)
    limits = drawn.lines["filter/squares"]  # published points of χ² with 60 degrees of freedom
    np.testing.assert_allclose(limits[1], [[83.298 / 60.0, 40.482 / 60.0]] * 2, rtol=1e-5)
    assert (limits[0].tolist(), limits[2]) == ([20.0, 420.0], ["95 % band"] * 2)
    assert "filter/squares/1" not in drawn.lines  # too few


def test_several_sensors_have_lanes() -> None:
    from tests.recording.made_filter import FIXES

    other = Innovations("baro", "height", np.array([5.0, 90.0]), np.array([[3.0], [4.0]]), np.array([[1.0], [4.0]]),
                        np.array([9.0, 4.0]), np.array([True, True]), ["", ""], 10.0)  # fmt: skip
    found = record(view.innovation_charts([FIXES, other], (0.0, 100.0)))
    assert found.dots["filter/decisions/dots_2"][1].tolist() == [[1.0], [1.0]]
    assert found.dots["filter/decisions/dots_2"][2] == ["baro"]
    assert found.dots["filter/innovations/baro/dots_0"][1].tolist() == [[3.0], [2.0]]
    assert found.lines["filter/innovations/baro"][0].tolist() == [0.0, 100.0]


def test_means_of_squares_over_sixty_degrees_of_freedom() -> None:
    """Of two components, 30 readings a mean: 30, 90, 150, … over two; at most 5; no line across a gap."""
    count = 30 * 5 + 7
    time = np.arange(float(count))
    time[120:] += 500.0
    nis = np.repeat([3.0, 1.0, 2.5, 40.0, 1.5, 9.0], 30)[:count]
    with_gap = np.insert(nis, 3, np.nan)
    sensor: Any = Innovations("gnss", "position", np.insert(time, 3, 2.5), np.zeros((count + 1, 2)),
                              np.zeros((count + 1, 3)), with_gap, np.ones(count + 1, bool), [], 1.0)  # fmt: skip
    (line,) = view._squares(sensor, POSITION)
    np.testing.assert_allclose(line.x, [14.5, 44.5, 74.5, 104.5, 634.5])
    np.testing.assert_allclose(line.y, [1.5, 0.5, 1.25, np.nan, 0.75])
    assert (line.label, line.color) == ("gnss", POSITION)
    time[120:] -= 500.0
    sensor = Innovations("gnss", "position", time, np.zeros((count, 2)), np.zeros((count, 3)), nis,
                         np.ones(count, bool), [], 1.0)  # fmt: skip
    (line,) = view._squares(sensor, POSITION)
    assert line.y[3] == 5.0
