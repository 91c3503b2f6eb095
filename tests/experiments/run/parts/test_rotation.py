"""The section on a rotating IMU: angles, both errors, their largest and last values."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.experiments.run.parts.imu_mounting import Rotation
from sinssim.strapdown.navigation_error import NavError
from tests.recording.spies import Shown, cells, read

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
    made = Rotation(navigated)  # type: ignore[arg-type]
    vars(made).update(encoders=SimpleNamespace(turns=turns), without_rotation=without)
    return made


def test_angles_and_errors_with_and_without_rotation() -> None:
    """The angles of the first 1200 s; horizontal errors 5/4 of the errors to the east; angles 17″ times the factor."""
    without = error([40.0, 80.0, 160.0, 240.0, 200.0], [3.0, 6.0, 9.0, 24.0, 12.0])
    found = Shown(run(0.2, without).exhibits())
    first = TIME[:3]
    found.curves(
        "rotation/angles", "Rotation angles of the IMU", "°",
        ("outer axis", AIDED, first, [15.0, 135.0, 374.7]), ("inner axis", PINK, first, [12.0, 92.0, 251.8]),
    )  # fmt: skip
    assert found.span("rotation/angles") == (50.0, 1249.0)
    found.curves(
        "rotation/horizontal", "Horizontal error", "m",
        ("without rotation", PINK, TIME, [50.0, 100.0, 200.0, 300.0, 250.0]),
        ("with rotation", AIDED, TIME, [5.0, 50.0, 10.0, 15.0, 20.0]),
    )  # fmt: skip
    minute = 17.0 / 60.0
    found.curves(
        "rotation/attitude", "Attitude error", "arcmin",
        ("without rotation", PINK, TIME, np.array([3.0, 6.0, 9.0, 24.0, 12.0]) * minute),
        ("with rotation", AIDED, TIME, np.array([1.0, 1.5, 4.0, 2.5, 2.0]) * minute),
    )  # fmt: skip
    assert found.span("rotation/horizontal") == found.span("rotation/attitude") == (50.0, 1500.0)
    assert cells(found.html) == [
        ["", "horizontal error, largest, m", "horizontal error, at the end, m",
         "attitude error, largest, arcmin", "attitude error, at the end, arcmin"],
        ["without rotation", "300", "250", "6.8", "3.4"],
        ["with rotation", "50", "20", "1.133", "0.5667"],
    ]  # fmt: skip
    assert "With and without rotation: poisson" in read(found.html)


def test_one_axis_alone_and_nothing_to_compare() -> None:
    still = run(0.0, None)
    found = Shown(still.exhibits())
    assert list(found.charts) == ["rotation/angles"]
    assert [getattr(mark, "label", "") for mark in found.charts["rotation/angles"].marks] == ["outer axis"]
    still.run.errors = {}
    assert not list(still.exhibits())
