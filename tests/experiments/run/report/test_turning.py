"""The section on a rotating IMU: angles, both errors, their largest and last values."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.experiments.run.report.turning import turning_section
from sinssim.strapdown.nav_error import NavError
from tests.recording.spies import Plots, cells, read

AIDED, PINK = "#0072b2", "#e11e6e"
ARCSEC = np.pi / 648_000.0
TIME = np.array([50.0, 450.0, 1249.0, 1251.0, 1500.0])


def error(east: list[float], tilt: list[float], time: np.ndarray = TIME) -> NavError:
    """Position errors 3 : 4, the horizontal error is 5/4 of that to the east; angles 8 : 15 : 0 of 17, arcsec."""
    place = np.outer(east, (0.75, 1.0, 9.0))
    return NavError(time, place, np.zeros_like(place), np.outer(tilt, (8.0, 15.0, 0.0)) * ARCSEC)


def run(inner: float, without: NavError | None) -> Any:
    turns = SimpleNamespace(
        angles=lambda time: np.column_stack((np.radians(0.3 * time), np.radians(inner * (time + 10.0))))
    )
    own = error([4.0, 40.0, 8.0, 12.0, 16.0], [1.0, 1.5, 4.0, 2.5, 2.0])
    navigated = SimpleNamespace(time=TIME, errors={"poisson": own, "euler": error([1.0] * 5, [1.0] * 5)})
    return SimpleNamespace(run=navigated, encoders=SimpleNamespace(turns=turns), without_rotation=without)


def test_angles_and_errors_with_and_without_rotation(plots: Plots) -> None:
    """The angles of the first 1200 s; horizontal errors 5/4 of the errors to the east; angles 17″ times the factor."""
    without = error([40.0, 80.0, 160.0, 240.0, 200.0], [3.0, 6.0, 9.0, 24.0, 12.0])
    html = "".join(turning_section(run(0.2, without)))
    angles, horizontal, attitude = plots
    first = TIME[:3]
    angles.shows(
        "Rotation angles of the IMU", "°",
        ("outer axis", AIDED, first, [15.0, 135.0, 374.7]), ("inner axis", PINK, first, [12.0, 92.0, 251.8]),
    )  # fmt: skip
    assert angles.span == (50.0, 1249.0)
    horizontal.shows(
        "Horizontal error", "m",
        ("without rotation", PINK, TIME, [50.0, 100.0, 200.0, 300.0, 250.0]),
        ("with rotation", AIDED, TIME, [5.0, 50.0, 10.0, 15.0, 20.0]),
    )  # fmt: skip
    minute = 17.0 / 60.0
    attitude.shows(
        "Attitude error", "arcmin",
        ("without rotation", PINK, TIME, np.array([3.0, 6.0, 9.0, 24.0, 12.0]) * minute),
        ("with rotation", AIDED, TIME, np.array([1.0, 1.5, 4.0, 2.5, 2.0]) * minute),
    )  # fmt: skip
    assert horizontal.span == attitude.span == (50.0, 1500.0)
    assert cells(html) == [
        ["", "horizontal error, largest [m]", "horizontal error, at the end [m]",
         "attitude error, largest [arcmin]", "attitude error, at the end [arcmin]"],
        ["without rotation", "300.0", "250.0", "6.800", "3.400"],
        ["with rotation", "50.00", "20.00", "1.133", "0.5667"],
    ]  # fmt: skip
    assert "With and without rotation: poisson" in read(html)


def test_one_axis_alone_and_nothing_to_compare(plots: Plots) -> None:
    still = run(0.0, None)
    assert len(list(turning_section(still))) == 1
    (angles,) = plots
    assert [line.label for line in angles.lines] == ["outer axis"]
    still.run.errors = {}
    assert not list(turning_section(still))
