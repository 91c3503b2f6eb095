"""A filter in the viewer: bands, parameters, shrinking σ, innovations and means of squares, from chosen numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.estimation.filter_result import Innovations
from sinssim.experiments.run import filter_exhibits as view
from tests.recording.made_filter import aided
from tests.recording.spies import Drawn

AIDED, SMOOTHED, BACKWARD = (0, 114, 178), (204, 121, 167), (213, 94, 0)
BOUND, REFUSED, POSITION = (150, 150, 150), (225, 30, 110), (0, 158, 115)
X, Y, Z = (213, 94, 0), (0, 158, 115), (86, 180, 233)
ARCSEC, ARCMIN = np.pi / 648_000.0, np.pi / 10_800.0
TIME = [20.0, 30.0, 40.0, 220.0, 420.0]
SHARE, ERROR = np.array([100.0, 40.0, 10.0, 6.0, 4.0]), np.array([-50.0, 30.0, -12.0, 7.0, 5.0])


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    found: Any = Drawn()
    found.labels = view.draw_filter(found, aided())
    return found


COMPONENTS = {
    "position_north": ("m", 2.0), "position_east": ("m", 3.0), "height": ("m", -5.0), "velocity_north": ("m/s", 0.002),
    "velocity_east": ("m/s", 0.003), "velocity_down": ("m/s", 0.005), "tilt_north": ("arcsec", 1e-6 / ARCSEC),
    "tilt_east": ("arcsec", 2e-6 / ARCSEC), "azimuth": ("arcmin", 4e-4 / ARCMIN),
}  # fmt: skip


def test_bands_of_every_error(drawn: Any) -> None:
    """The height is positive up; the range fits what comes after 5 % of the run, backwards before the last 5 %."""
    units = {f"filter_{name}": unit for name, (unit, _) in COMPONENTS.items()}
    assert drawn.labels == {"filter": "yes", **units}
    for name, (_, size) in COMPONENTS.items():
        own = abs(size)
        for kind, paint, time, error, sigma, late in (
            ("aided", [BOUND, BOUND, AIDED], TIME, ERROR, SHARE, (-30.0, 30.0)),
            ("smoothed", [(171, 138, 156)] * 2 + [SMOOTHED], [20.0, 50.0, 420.0], np.array([8.0, -3.0, 2.0]),
             np.array([9.0, 2.5, 3.5]), (-10.5, 10.5)),
            # 5 % of its 380 s before its end, 391 s
            ("backward", [(175, 127, 90)] * 2 + [BACKWARD], [30.0, 400.0, 410.0], np.array([1.0, -4.0, 60.0]),
             np.array([1.5, 5.0, 80.0]), (-4.5, 4.5)),
        ):  # fmt: skip
            values = np.column_stack((3.0 * own * sigma, -3.0 * own * sigma, size * error))
            names = [f"+3σ {kind}", f"−3σ {kind}", f"{kind} error"]
            drawn.shows(f"filter/{name}/{kind}", names, time, values, paint)
            np.testing.assert_allclose(drawn.ranges[f"filter/{name}/{kind}"], np.multiply(late, own))


def test_parameters_over_their_sigma(drawn: Any) -> None:
    """Errors over σ: −50/100, 30/40, −12/10, 7/6 and 5/4; what is known exactly has none."""
    ratio = ERROR / SHARE
    names = [f"gyro bias {axis}" for axis in ("forward", "right", "down")]
    drawn.shows("filter/gyro/bias", names, TIME, np.column_stack([ratio] * 3), [X, Y, Z])
    drawn.shows("filter/accelerometer/bias", ["accelerometer bias right"], TIME, ratio[:, None], [Y])
    for sensor in ("gyro", "accelerometer"):
        drawn.shows(f"filter/{sensor}/bounds", ["±3σ"] * 2, [20.0, 420.0], [[3.0, -3.0]] * 2, [BOUND] * 2)


def test_unknown_parameters_over_the_sigma_at_the_start() -> None:
    found: Any = Drawn()
    labels = view.draw_filter(found, aided(others=False, known=False))
    assert labels["parameters"] == "estimates [σ at the start]"
    ratio = np.array([1.0, 2.0, 3.0, -4.0, 6.0]) / 100.0
    found.shows("filter/accelerometer/bias", ["accelerometer bias right"], TIME, ratio[:, None], [Y])
    assert "filter/height/smoothed" not in found.lines


def test_sigma_shrinks_in_decades(drawn: Any) -> None:
    """100, 40, 10, 6 and 4: 0 to −1.398 decades; the worst-known state of a block counts."""
    decades = np.log10(SHARE / 100.0)[:, None]
    for name in ("position", "velocity", "attitude", "gyro_bias", "accelerometer_bias"):
        drawn.shows(f"filter/shrinking/{name}", [name.replace("_", " ")], TIME, decades)
    other: Any = Drawn()
    uneven = aided(others=False)
    uneven.estimate.sigma = uneven.estimate.sigma.copy()
    uneven.estimate.sigma[-1, 1] = 3.0 * 25.0
    view._shrinking(other, uneven, np.arange(5))
    assert other.lines["filter/shrinking/position"][1][-1, 0] == pytest.approx(np.log10(0.25))
    assert other.lines["filter/shrinking/position"][3] == [POSITION]


def test_innovations_and_decisions(drawn: Any) -> None:
    color = drawn.dots["filter/innovations/taken/gnss"][3]
    expected = {
        "filter/innovations/taken/gnss": ([21.0, 23.0], [[1.5, -2.0], [0.5, 0.2]], ["gnss", ""], color, "circle", 1.2),
        "filter/innovations/refused/gnss": (
            [22.0, 24.0], [[np.nan, np.nan], [-6.0, 5.0]], ["gnss", ""], REFUSED, "cross", 4.0),
        "filter/decisions/taken/gnss": ([21.0, 23.0], [[1.0], [1.0]], ["gnss"], color, "circle", 1.92),
        "filter/decisions/refused/gnss": ([22.0, 24.0], [[1.0], [1.0]], ["rejected"], REFUSED, "cross", 6.4),
    }  # fmt: skip
    assert set(drawn.dots) == set(expected)
    for entity, (time, values, *look) in expected.items():
        found = drawn.dots[entity]
        np.testing.assert_array_equal(found[0], time)
        np.testing.assert_allclose(found[1], values, err_msg=entity)
        assert found[2:5] == tuple(look[:3])
        assert found[5] == pytest.approx(look[3])
    drawn.shows("filter/innovations/bounds", ["±3σ"] * 2, [21.0, 24.0], [[3.0, -3.0]] * 2)
    limits = drawn.lines["filter/squares/bounds"]  # published points of χ² with 60 degrees of freedom
    np.testing.assert_allclose(limits[1], [[83.298 / 60.0, 40.482 / 60.0]] * 2, rtol=1e-5)
    assert (limits[0].tolist(), limits[2]) == ([21.0, 24.0], ["95 % band"] * 2)
    assert not [name for name in drawn.lines if name == "filter/squares/gnss"]  # too few


def test_several_sensors_have_lanes() -> None:
    from tests.recording.made_filter import FIXES

    other = Innovations("baro", "height", np.array([5.0, 90.0]), np.array([[3.0], [4.0]]), np.array([[1.0], [4.0]]),
                        np.array([9.0, 4.0]), np.array([True, True]), ["", ""], 10.0)  # fmt: skip
    found: Any = Drawn()
    view._record_innovations(found, [FIXES, other])
    assert found.dots["filter/decisions/taken/baro"][1].tolist() == [[2.0], [2.0]]
    assert found.dots["filter/innovations/taken/baro"][1].tolist() == [[3.0], [2.0]]
    assert found.dots["filter/innovations/taken/baro"][2] == ["baro"]
    assert found.lines["filter/innovations/bounds"][0].tolist() == [5.0, 90.0]


def test_means_of_squares_over_sixty_degrees_of_freedom() -> None:
    """Of two components, 30 readings a mean: 30, 90, 150, … over two; at most 5; no line across a gap."""
    count = 30 * 5 + 7
    time = np.arange(float(count))
    time[120:] += 500.0
    nis = np.repeat([3.0, 1.0, 2.5, 40.0, 1.5, 9.0], 30)[:count]
    with_gap = np.insert(nis, 3, np.nan)
    sensor: Any = Innovations("gnss", "position", np.insert(time, 3, 2.5), np.zeros((count + 1, 2)),
                              np.zeros((count + 1, 3)), with_gap, np.ones(count + 1, bool), [], 1.0)  # fmt: skip
    found: Any = Drawn()
    view._squares(found, sensor, POSITION)
    middle = [14.5, 44.5, 74.5, 104.5, 634.5]
    found.shows("filter/squares/gnss", ["gnss"], middle, [[1.5], [0.5], [1.25], [np.nan], [0.75]], [POSITION])
    time[120:] -= 500.0
    sensor = Innovations("gnss", "position", time, np.zeros((count, 2)), np.zeros((count, 3)), nis,
                         np.ones(count, bool), [], 1.0)  # fmt: skip
    view._squares(found, sensor, POSITION)
    assert found.lines["filter/squares/gnss"][1][3, 0] == 5.0
