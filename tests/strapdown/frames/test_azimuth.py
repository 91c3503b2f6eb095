"""Which azimuth each frame keeps, and where the transverse one is refused."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import ImuData, NavState, navigate
from sinssim.errors import RunError
from sinssim.strapdown.frames.wander_free_transverse import azimuth_rule, check
from sinssim.strapdown.mechanization import Mechanization


def northwards(*longitude_deg: float) -> Any:
    """Return what the check reads of a solution along the equator; that begins northwards: its route is a meridian."""
    rows = len(longitude_deg)
    return SimpleNamespace(
        time=0.5 * np.arange(rows),
        latitude=np.zeros(rows),
        longitude=np.radians(longitude_deg),
        velocity=np.tile([100.0, 0.0, 0.0], (rows, 1)),
        mechanization=Mechanization(frame="transverse"),
    )


def test_the_rule_of_each_frame_and_the_pole_of_its_route() -> None:
    problem = northwards(30.0, 40.0)
    rules = [azimuth_rule(problem, frame) for frame in ("wander", "free-azimuth", "transverse")]
    assert [rule for rule, _ in rules] == [0, 1, 2]
    assert not rules[0][1].any()
    assert not rules[1][1].any()
    # at right angles to the meridian of 30°
    np.testing.assert_allclose(np.abs(rules[2][1]), [0.5, np.sqrt(0.75), 0.0], atol=1e-15)


def test_the_transverse_frame_alone_is_refused_at_the_pole_of_its_route() -> None:
    problem = northwards(30.0, 100.0, 120.0, 130.0)
    for frame in ("wander", "free-azimuth"):
        check(problem, frame)
    check(northwards(30.0, 100.0, 119.0, 130.0), "transverse")
    with pytest.raises(RunError, match=r"transverse frame cannot be used .* t = 1\.00 s") as found:
        check(problem, "transverse")
    assert found.value.time == 1.0


def test_the_transverse_x_axis_points_to_the_pole_of_the_route_from_the_first_row_on() -> None:
    """Its direction from north, by the spherical triangle of the place, the route's pole and the north pole."""
    imu = ImuData(np.array([3.0, 3.5, 4.2]), np.tile([0.01, -0.02, 0.03], (2, 1)), np.tile([0.4, 0.2, -5.5], (2, 1)))
    first = NavState(0.6, 0.4, 900.0, np.array([200.0, 120.0, -3.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    found = navigate(imu, first, frame="transverse", route=(0.1, 0.2, 0.3, 1.1))
    a, b = (np.array([np.cos(f) * np.cos(g), np.cos(f) * np.sin(g), np.sin(f)]) for f, g in ((0.1, 0.2), (0.3, 1.1)))
    pole = np.cross(a, b)
    of_pole, along = np.arctan2(pole[2], np.hypot(pole[0], pole[1])), np.arctan2(pole[1], pole[0]) - found.longitude
    east = np.sin(along)
    north = np.cos(found.latitude) * np.tan(of_pole) - np.sin(found.latitude) * np.cos(along)
    np.testing.assert_allclose(found.azimuth, np.arctan2(east, north), rtol=0.0, atol=1e-12)
    assert np.abs(found.azimuth).min() > 0.1
