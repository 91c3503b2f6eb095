"""The section on a platform: both systems side by side, rates, and what each error contributes."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.experiments.run.report.platform import platform_section
from sinssim.strapdown.platform.error_equations import ErrorsByCause
from tests.recording.made_platform import RATES, TIME, run
from tests.recording.spies import Plots, cells, read

VERMILION, ORANGE, GREY = "#d55e00", "#e69f00", "#8c8c8c"
X, Y, Z = "#d55e00", "#009e73", "#56b4e9"


def test_the_errors_of_both_systems(plots: Plots) -> None:
    """Horizontal 5/4 of the error to the east; 17′ times the factor; one unit in a plot, arcmin and m in the table."""
    html = "".join(platform_section(run("level")))
    rows = cells(html)
    assert rows[:4] == [
        ["", "horizontal error, end [m]", "largest [m]", "attitude error, end [arcmin]", "largest [arcmin]"],
        ["platform", "75.00", "100.0", "5.100", "8.500"],
        ["strapdown (poisson)", "1500", "1500", "68.00", "68.00"],
        ["strapdown, gyros without scale-factor error, misalignment and non-linearity", "80.00", "110.0", "0.8500",
         "5.100"],
    ]  # fmt: skip
    free = "strapdown, no rate-dependent errors"
    plots[0].shows(
        "Horizontal error", "m", ("platform", VERMILION, TIME, [5.0, 50.0, 100.0, 75.0]),
        ("strapdown (poisson)", ORANGE, TIME, [10.0, 500.0, 1000.0, 1500.0]),
        (free, GREY, TIME, [5.0, 55.0, 110.0, 80.0]),
    )  # fmt: skip
    plots[1].shows(
        "Attitude error", "arcmin", ("platform", VERMILION, TIME, [1.7, 3.4, 8.5, 5.1]),
        ("strapdown (poisson)", ORANGE, TIME, [17.0, 34.0, 51.0, 68.0]), (free, GREY, TIME, [3.4, 5.1, 1.7, 0.85]),
    )  # fmt: skip
    assert {found.span for found in plots} == {(100.0, 110.0)}
    assert "It is level and points north." in html
    assert "The scale-factor error of their torquers acts on the commanded rates." in html


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
def test_sensed_and_commanded_rates(plots: Plots, frame: str, axes: tuple[str, ...], stands: str) -> None:
    """Increments over their intervals, deg/s; commanded deg/h at the ends of the intervals."""
    html = "".join(platform_section(run(frame)))
    assert stands in html
    assert ("of their torquers" in html) == (frame != "inertial")
    at = TIME[1:]
    body = zip(("x, forward", "y, right", "z, down"), (X, Y, Z), [at] * 3, RATES.T, strict=True)
    plots[2].shows("Strapdown: true rate of the IMU", "deg/s", *body)
    commanded = [[1.0, 3.0, 7.0], [-2.0, 5.0, 9.0], [4.0, -6.0, 11.0]]
    plots[3].shows(
        "Platform: commanded rate", "deg/h", *zip(axes, (X, Y, Z), [at] * 3, commanded, strict=True)
    )  # fmt: skip


def test_what_each_error_contributes(plots: Plots) -> None:
    """A cause below a micrometre has no row; the causes add to 5, 45, 95 and 70 m, 5 m from the simulation."""
    html = "".join(platform_section(run("level")))
    assert cells(html)[4:] == [
        ["cause", "horizontal error, end [m]", "most [m]"],
        ["drift of the gyros", "35.00", "45.00"], ["accelerometers", "5.000", "30.00"],
        ["initial state", "40.00", "40.00"], ["all together, as vectors", "70.00", "95.00"],
        ["the simulated platform", "75.00", "100.0"],
    ]  # fmt: skip
    plots[4].shows(
        "Horizontal error by cause", "m", ("all causes together", GREY, TIME, [5.0, 45.0, 95.0, 70.0]),
        ("simulated platform", VERMILION, TIME, [5.0, 50.0, 100.0, 75.0]),
        ("drift of the gyros", "#e69f00", TIME, [0.0, 20.0, 45.0, 35.0]),
        ("accelerometers", "#7864c8", TIME, [0.0, 15.0, 30.0, 5.0]),
        ("initial state", "#009e73", TIME, [5.0, 10.0, 20.0, 40.0]),
    )  # fmt: skip
    assert "The two differ by 5.00 m at most." in read(html)


def test_too_large_for_linear_equations(plots: Plots) -> None:
    """A fifth of the largest error, 20 m, is the limit."""
    far = run("level")
    causes = dict(far.errors_by_cause.position)
    causes["drift of the gyros"] = np.zeros((4, 2))
    far.errors_by_cause = ErrorsByCause(TIME, causes)
    assert "too large for the linear error equations" in "".join(platform_section(far))
