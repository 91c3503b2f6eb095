"""The section on a platform: both systems side by side, rates, and what each error contributes."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.strapdown.navigation_error import NavError
from sinssim.strapdown.platform_theory import ErrorsByCause
from tests.recording.made_platform import COMMANDED, GIMBALS, RATES, STRAPDOWN, TIME, part
from tests.recording.spies import Shown, cells, read

VERMILION, ORANGE, GREY = "#d55e00", "#e69f00", "#8c8c8c"
X, Y, Z = "#d55e00", "#009e73", "#56b4e9"


def test_the_errors_of_both_systems() -> None:
    """Horizontal 5/4 of the error to the east; 17′ times the factor."""
    found = Shown(part("level").exhibits())
    assert cells(found.html)[:4] == [
        ["", "horizontal error, end, m", "largest, m", "attitude error, end, arcmin", "largest, arcmin"],
        ["platform", "75", "100", "5.1", "8.5"], ["strapdown (poisson)", "1500", "1500", "68", "68"],
        ["strapdown, gyros without scale-factor error, misalignment and non-linearity", "80", "110", "0.85", "5.1"],
    ]  # fmt: skip
    free = "strapdown, no rate-dependent errors"
    horizontal = [5.0, 50.0, 100.0, 75.0], [10.0, 500.0, 1000.0, 1500.0], [5.0, 55.0, 110.0, 80.0]
    attitude = [1.7, 3.4, 8.5, 5.1], [17.0, 34.0, 51.0, 68.0], [3.4, 5.1, 1.7, 0.85]
    for key, title, unit, rows in (("horizontal", "Horizontal error", "m", horizontal),
                                   ("attitude", "Attitude error", "arcmin", attitude)):  # fmt: skip
        found.curves(f"platform/{key}", title, unit, ("platform", VERMILION, TIME, rows[0]),
                     ("strapdown (poisson)", ORANGE, TIME, rows[1]), (free, GREY, TIME, rows[2]))  # fmt: skip
        assert found.span(f"platform/{key}") == (100.0, 110.0)
        names = ["platform", "strapdown (poisson)", free]
        colors = [(213, 94, 0), (230, 159, 0), (140, 140, 140)]
        found.drawn.shows(f"platform/{key}", names, TIME, np.array(rows).T, colors)
    assert (found.labels["platform/horizontal"], found.labels["platform/attitude"]) == ("m", "arcmin")
    assert "It is level and points north." in found.html
    assert "The scale-factor error of their torquers acts on the commanded rates." in found.html
    alone = Shown(part("level", None, None).exhibits()).charts["platform/horizontal"]
    assert [getattr(mark, "label", "") for mark in alone.marks] == ["platform"]


def test_fewer_rows_of_an_algorithm_of_several_samples() -> None:
    """A line at other instants is recorded below the entity of the others, which has the range of all."""
    rows = np.array([0, 2])
    few = NavError(TIME[rows], STRAPDOWN.position_ned[rows], STRAPDOWN.velocity_ned[rows], STRAPDOWN.attitude[rows])
    drawn = Shown(part("level", few, None).exhibits()).drawn
    drawn.shows("platform/horizontal/1", ["strapdown (poisson)"], TIME[rows], [[10.0], [1000.0]])
    assert drawn.ranges["platform/horizontal"] == pytest.approx((5.0, 1000.0))


@pytest.mark.parametrize(
    ("frame", "axes", "stands"),
    [
        ("level", ("north", "east", "down"), "points north"),
        ("inertial", ("north at the start", "east at the start", "down at the start"), "is not torqued"),
        ("wander", ("x", "y", "z, down"), "relative to the Earth (wander azimuth)"),
        ("free-azimuth", ("x", "y", "z, down"), "in inertial space (free azimuth)"),
        ("transverse", ("x", "y", "z, down"), "along the great circle of the route"),
    ],
)
def test_rates_and_gimbal_angles(frame: str, axes: tuple[str, ...], stands: str) -> None:
    """Increments over their intervals, deg/s; commanded deg/h at the ends of the intervals; no line across a jump."""
    found = Shown(part(frame).exhibits())
    assert stands in found.html
    assert ("of their torquers" in found.html) == (frame != "inertial")
    at = TIME[1:]
    body = zip(("x, forward", "y, right", "z, down"), (X, Y, Z), [at] * 3, RATES.T, strict=True)
    found.curves("platform/sensed", "Strapdown: true rate of the IMU", "deg/s", *body)
    commanded = zip(axes, (X, Y, Z), [at] * 3, COMMANDED.T, strict=True)
    found.curves("platform/commanded", "Platform: commanded rate", "deg/h", *commanded)
    angles = GIMBALS.copy()
    angles[1, 0] = angles[1, 2] = np.nan
    colors = [(230, 159, 0), (204, 121, 167), (0, 114, 178)]
    found.drawn.shows("platform/gimbals", ["roll", "pitch", "azimuth"], TIME, angles, colors)
    assert "Gimbal angles" not in found.html


def test_what_each_error_contributes() -> None:
    """A cause below a micrometre has no row; the causes add to 5, 45, 95 and 70 m, 5 m from the simulation."""
    found = Shown(part("level").exhibits())
    assert cells(found.html)[4:] == [
        ["cause", "horizontal error, end, m", "most, m"],
        ["drift of the gyros", "35", "45"], ["accelerometers", "5", "30"], ["initial state", "40", "40"],
        ["all together, as vectors", "70", "95"], ["the simulated platform", "75", "100"],
    ]  # fmt: skip
    found.curves(
        "platform/by_cause", "Horizontal error by cause", "m",
        ("all causes together", GREY, TIME, [5.0, 45.0, 95.0, 70.0]),
        ("simulated platform", VERMILION, TIME, [5.0, 50.0, 100.0, 75.0]),
        ("drift of the gyros", "#e69f00", TIME, [0.0, 20.0, 45.0, 35.0]),
        ("accelerometers", "#7864c8", TIME, [0.0, 15.0, 30.0, 5.0]),
        ("initial state", "#009e73", TIME, [5.0, 10.0, 20.0, 40.0]),
    )  # fmt: skip
    assert "The two differ by 5.00 m at most." in read(found.html)


def test_too_large_for_linear_equations() -> None:
    """A fifth of the largest error, 20 m, is the limit."""
    far = part("level")
    causes = dict(far.errors_by_cause.position)
    causes["drift of the gyros"] = np.zeros((4, 2))
    vars(far)["errors_by_cause"] = ErrorsByCause(TIME, causes)
    assert "too large for the linear error equations" in Shown(far.exhibits()).html


def test_streams() -> None:
    """What the platform did, and the errors of the other gyros if there are any."""
    made = part("level")
    vars(made.solution).update(dict.fromkeys(("drift", "readings"), COMMANDED), q_ip=np.ones((4, 4)))
    assert [one.name for one in made.streams()] == ["platform", "error_without_errors_of_turns"]
    assert [one.name for one in part("level", free=None).streams()] == ["platform"]
