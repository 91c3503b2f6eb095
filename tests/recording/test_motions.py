"""The figures of a plan and of a run's errors from motions written by hand: maps in km, times, units, limits, words."""

from __future__ import annotations

from math import cos, nan, pi, radians, sin, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import NavState
from sinssim.errors import InputError
from sinssim.experiments.run import motion_exhibits as plan
from sinssim.experiments.run.error_exhibits import figure_charts
from sinssim.recording.figures import figure_of
from sinssim.recording.style import COLORS, colors, css
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.flight.flight_plan import PlannedPath
from tests.recording import fake_run
from tests.recording.drawn import check_line, legend, limits, texts, words

LAT, LON = radians(50.0), radians(20.0)
A, E2 = 6_378_137.0, 1.0 / 298.257223563 * (2.0 - 1.0 / 298.257223563)
N = A / sqrt(1.0 - E2 * sin(LAT) ** 2)
M = N * (1.0 - E2) / (1.0 - E2 * sin(LAT) ** 2)


def path(legs: Any = (("1 climb", 60.0, 240.0), ("2 cruise", 240.0, 900.0)), ceiling: Any = ()) -> PlannedPath:
    """Return a way of 4 km to the east and 2 km to the north about 50°, 20°, in a quarter of an hour from 60 s on."""
    east, north = np.array([-2000.0, 0.0, 2000.0]), np.array([-1000.0, 400.0, 1000.0])
    return PlannedPath(
        [60.0, 240.0, 900.0], list(LAT + north / M), list(LON + east / (N * cos(LAT))), [300.0, 900.0, 700.0],
        [50.0, 80.0, 60.0], list(legs), list(ceiling),
    )  # fmt: skip


def drawn(given: PlannedPath, places: Any = (), flight: object = None) -> Any:
    scenario = SimpleNamespace(name="way", flight=flight, log=None, one_component=None,
                               truth=SimpleNamespace(ellipsoid="wgs84"))  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plan, "plan_of", lambda one: given)
        patch.setattr(plan, "named_places", lambda one: list(places))
        return figure_of(plan.plan_charts(scenario))


def test_the_map_of_a_plan() -> None:
    """Kilometres about the middle; the legs' numbers at the middles of their times; waypoints by name."""
    place = ("lake", LAT + 300.0 / M, LON - 1500.0 / (N * cos(LAT)))
    figure = drawn(path(), [place])
    axes = figure.axes[0]
    track, lake = axes.lines[-4:-2]  # below the two scales
    np.testing.assert_allclose(track.get_xdata()[[0, -1]], [-2.0, 2.0], atol=5e-4)  # the meridians converge
    np.testing.assert_allclose(track.get_ydata()[[0, -1]], [-1.0, 1.0], atol=5e-4)
    np.testing.assert_allclose(lake.get_xydata()[0], [-1.5, 0.3], atol=1e-3)
    assert words(axes) == ("Map", "east [km]", "north [km]")
    middles = {text.get_text(): text.xy for text in axes.texts}
    np.testing.assert_allclose(middles["start"], [-2.0, -1.0], atol=1e-3)
    np.testing.assert_allclose(middles["1"], [-1.0, -0.3], atol=1e-3)  # at 150 s
    np.testing.assert_allclose(middles["2"], [1.0, 0.7], atol=1e-3)  # at 570 s
    np.testing.assert_allclose(middles["end"], [2.0, 1.0], atol=1e-3)
    np.testing.assert_allclose(middles["lake"], [-1.5, 0.3], atol=1e-3)
    # half of 1.16 times the extent, in the proportions of the map
    assert np.allclose(axes.get_xlim(), (-2.32, 2.32), atol=1e-3)
    assert figure._suptitle.get_text() == "way: planned motion"
    assert drawn(path(), flight=SimpleNamespace())._suptitle.get_text() == "way: plan by dead reckoning"


def test_heights_and_speeds_of_a_plan() -> None:
    """In minutes beyond 10 min; the ceiling counts for the limits; a leg that is too short shows its number alone."""
    legs = (("1 climb", 60.0, 240.0), ("2 turn to the left", 240.0, 280.0), ("3 cruise", 280.0, 900.0))
    figure = drawn(path(legs, ceiling=(1000.0, 1100.0, 1300.0)), flight=SimpleNamespace())
    top, side = figure.axes[1:]
    minutes = [1.0, 4.0, 15.0]
    for line, at in zip(top.lines[:3], (1.0, 4.0, 280.0 / 60.0), strict=True):
        assert float(line.get_xdata()[0]) == pytest.approx(at)
    check_line(top.lines[3], "height", minutes, [300.0, 900.0, 700.0], css(COLORS["truth"]))
    label = "ceiling of the aircraft at the planned airspeed"
    check_line(top.lines[4], label, minutes, [1000.0, 1100.0, 1300.0], css(COLORS["limit"]), "--")
    assert words(top) == ("Height above the ellipsoid", "time [min]", "m")
    assert legend(top) == ["height", label]
    assert top.get_ylim() == (pytest.approx(300.0 - 80.0), pytest.approx(1300.0 + 250.0))
    assert texts(top) == ["1 climb", "2", "3 cruise"]
    assert [text.xy[0] for text in top.texts] == [pytest.approx(at) for at in (1.0, 4.0, 280.0 / 60.0)]
    check_line(side.lines[0], "ground speed", minutes, [50.0, 80.0, 60.0], css(COLORS["aided"]))
    assert words(side) == ("Ground speed, mean of each leg", "time [min]", "m/s")
    assert limits(side) == ((1.0, 15.0), (0.0, pytest.approx(92.0)))
    slow = drawn(PlannedPath([0.0, 600.0], [LAT, LAT + 1e-3], [LON, LON], [5.0, 6.0], [0.1, 0.2], [], []))
    assert words(slow.axes[2]) == ("Ground speed", "time [s]", "m/s")
    assert limits(slow.axes[2]) == ((0.0, 600.0), (0.0, 1.0))
    assert slow.axes[1].get_ylim() == (pytest.approx(5.0 - 0.8), pytest.approx(6.0 + 2.5))


def test_a_vehicle_at_rest() -> None:
    figure = drawn(PlannedPath([0.0, 100.0], [LAT, LAT], [LON, LON], [5.0, 5.0], [0.0, 0.0], [], []))
    assert "at rest at 50.00000°, 20.00000°" in texts(figure.axes[0])
    (low, high), _ = limits(figure.axes[0])
    assert -low == pytest.approx(high)


def test_the_plan_of_a_motion_in_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its true path; the legs by their events; longitude without a jump at 180°."""
    said = ((5.0, "1 (straight) begins"), (25.0, "1 (straight) ends"), (25.0, "2 (turn) begins"),
            (65.0, "2 (turn) ends"), (66.0, "3 (climb) ends"))  # fmt: skip
    events = [SimpleNamespace(time=time, text=f"leg {text}") for time, text in said]

    class Motion(SimpleNamespace):
        start, end = 5.0, 65.0

        def state(self, t: np.ndarray) -> NavState:
            longitude = (3.0 + 0.01 * t + pi) % (2.0 * pi) - pi
            velocity = np.column_stack((3.0 * t, 4.0 * t, 100.0 + t))
            return NavState(0.5 + 0.001 * t, longitude, 10.0 + t, velocity, np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1)))

    monkeypatch.setattr("sinssim.scenario.true_motion.fly", lambda scenario: Motion(events=events))
    found = plan.plan_of(fake_run.scenario())
    time = np.array(found.time)
    assert (len(time), time[0], time[-1]) == (2000, 5.0, 65.0)
    np.testing.assert_allclose(found.latitude, 0.5 + 0.001 * time, rtol=1e-12)
    np.testing.assert_allclose(found.longitude, 3.0 + 0.01 * time, rtol=1e-12)
    np.testing.assert_allclose(found.height, 10.0 + time, rtol=1e-12)
    np.testing.assert_allclose(found.speed, 5.0 * time, rtol=1e-12)
    assert found.legs == [("1 straight", 5.0, 25.0), ("2 turn", 25.0, 65.0)]
    assert found.ceiling == []


@pytest.mark.parametrize(
    ("what", "said"), [("log", "has recorded sensors"), ("one_component", "has a motion in a vertical plane")]
)
def test_motions_without_a_plan(what: str, said: str) -> None:
    scenario = SimpleNamespace(name="way", flight=None, **({"log": None, "one_component": None} | {what: 1}))
    with pytest.raises(InputError, match=f"the scenario way {said}: there is no plan to draw; leave out --plot"):
        plan.plan_of(scenario)


def run_figure(run: Any) -> Any:
    return figure_of(figure_charts(run))


def error(size: float, count: int = 5, start: float = 0.0, step: float = 300.0) -> NavError:
    """Return errors that grow by 3, 4 and 12 m, 2, 3 and 6 m/s, and 2, 6 and 9 arcsec times the size in a step."""
    rows = size * np.arange(count)[:, np.newaxis]
    second = pi / 648_000.0
    return NavError(start + step * np.arange(count), rows * [3.0, 4.0, 12.0], rows * [2.0, 3.0, 6.0],
                    rows * [2.0 * second, 6.0 * second, 9.0 * second])  # fmt: skip


def test_the_errors_of_a_run() -> None:
    """Horizontal 5 m, velocity 7 m/s and attitude 11″ a step of 300 s: 20 m, 28 m/s and 44″ after 20 min."""
    run = SimpleNamespace(errors={"euler": error(1.0), "poisson": error(0.5)}, aided=None, one_component=None,
                          scenario=SimpleNamespace(name="flight"))  # fmt: skip
    figure = run_figure(run)
    minutes, shades = [0.0, 5.0, 10.0, 15.0, 20.0], [css(color) for color in colors(["euler", "poisson"])]
    rows = (("horizontal error [m]", 5.0), ("velocity error [m/s]", 7.0), ("attitude error [arcsec]", 11.0))
    for panel, (label, size) in zip(figure.axes, rows, strict=True):
        assert words(panel)[2] == label
        check_line(panel.lines[0], "euler", minutes, size * np.arange(5.0), shades[0], "-")
        check_line(panel.lines[1], "poisson", minutes, 0.5 * size * np.arange(5.0), shades[1], "--")
        assert panel.get_yscale() == "linear"
        assert panel.get_ylim()[0] == 0.0
    assert words(figure.axes[0])[0] == "flight"
    assert words(figure.axes[2])[1] == "time [min]"
    assert legend(figure.axes[0]) == ["euler", "poisson"]


def test_errors_of_a_filter_have_a_logarithmic_scale() -> None:
    """Beyond 20 times the smallest of the largest errors; from a tenth of the least median on."""
    aided = SimpleNamespace(true_parameters_known=True, error=error(0.01), backward_error=None,
                            smoothed_error=error(0.02))  # fmt: skip
    run = SimpleNamespace(errors={"euler": error(1.0)}, aided=aided, one_component=None,
                          scenario=SimpleNamespace(name="flight"))  # fmt: skip
    panel = run_figure(run).axes[0]
    assert legend(panel) == ["euler", "aided", "smoothed"]
    assert panel.get_yscale() == "log"
    assert panel.get_ylim()[0] == pytest.approx(2.0 * 5.0 * 0.01 / 10.0)
    near = SimpleNamespace(**vars(aided) | {"error": error(0.051), "smoothed_error": None})
    run.aided = near
    assert run_figure(run).axes[0].get_yscale() == "linear"
    run.aided, run.errors = None, {}
    with pytest.raises(InputError, match="the run flight has no solution in three dimensions"):
        run_figure(run)


def test_the_time_of_the_longest_solution_counts() -> None:
    run = SimpleNamespace(errors={"euler": error(1.0, 3, 1000.0), "poisson": error(1.0, 2, 1000.0)}, aided=None,
                          one_component=None, scenario=SimpleNamespace(name="log"))  # fmt: skip
    panel = run_figure(run).axes[2]
    assert words(panel)[1] == "time [s]"
    check_line(panel.lines[0], "euler", [1000.0, 1300.0, 1600.0], [0.0, 11.0, 22.0])
    run.errors["euler"] = error(1.0, 4, 1000.0)
    assert words(run_figure(run).axes[2])[1] == "time [min]"
    run.errors["euler"] = error(1.0, 4, 1000.0)
    run.errors["euler"].attitude[1] = nan
    assert np.isnan(run_figure(run).axes[2].lines[0].get_ydata()[1])
    long = run_figure(SimpleNamespace(**vars(run) | {"errors": {"euler": error(1.0, 9001)}}))
    line = long.axes[0].lines[0].get_xdata()
    assert (len(line) < 9001, line[0], line[-1]) == (True, 0.0, 750.0)  # in hours, both ends
