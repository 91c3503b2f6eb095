"""The 3D scene from a start on the equator, where east and north of the tangent plane are a few products."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import NavState
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.recording.rerun_scene import Scene, map_zoom, some_rows

LATITUDE = np.array([0.0, 0.01, 0.02, 0.03])
LONGITUDE = 2.5 + np.array([0.0, 0.002, 0.005, 0.003])
HEIGHT = np.array([300.0, 100.0, 1200.0, 700.0])


def state(q: Any = None) -> NavState:
    return NavState(LATITUDE, LONGITUDE, HEIGHT, np.zeros((4, 3)), np.tile((1.0, 0.0, 0.0, 0.0), (4, 1)) if q is None
                    else q)  # fmt: skip


def east_north(a: float, f: float) -> tuple[np.ndarray, np.ndarray]:
    """Return east and north from the start on the equator: y and z of the Earth-fixed axes turned by its longitude."""
    e2 = f * (2.0 - f)
    n = a / np.sqrt(1.0 - e2 * np.sin(LATITUDE) ** 2)
    return (n + HEIGHT) * np.cos(LATITUDE) * np.sin(LONGITUDE - 2.5), (n * (1.0 - e2) + HEIGHT) * np.sin(LATITUDE)


@pytest.mark.parametrize(("name", "a", "f"), [("wgs84", 6378137.0, 1.0 / 298.257223563),
                                             ("krasovsky-1940", 6378245.0, 1.0 / 298.3)])  # fmt: skip
def test_a_scene_around_a_flight(name: str, a: float, f: float) -> None:
    """193 km long and 1.1 km high: heights times 20 are at most a quarter of the length, times 50 are not."""
    scene = Scene.around(state(), ellipsoid_by_name(name))
    east, north = east_north(a, f)
    up = 20.0 * (HEIGHT - 100.0)
    np.testing.assert_allclose(
        scene.points(LATITUDE, LONGITUDE, HEIGHT), np.column_stack((east, north, up)), rtol=1e-9, atol=1e-6
    )
    assert (scene.latitude, scene.longitude, scene.height, scene.floor) == (0.0, 2.5, 300.0, 100.0)
    assert scene.height_scale == 20
    extent = np.array([np.ptp(east), np.ptp(north), 22_000.0])
    assert scene.size == pytest.approx(np.sqrt((extent**2).sum()))
    assert scene.vehicle_length == pytest.approx(0.09 * scene.size)
    middle = np.array([0.5 * east.max(), 0.5 * north.max(), 11_000.0])
    np.testing.assert_allclose(scene.middle, middle)
    # the flight lies along the north, slightly to the east: it is seen from the side, from the south
    assert abs(scene.side[0]) > 0.9
    assert scene.side[1] <= 0.0
    assert np.hypot(*scene.side) == pytest.approx(1.0)
    principal = np.linalg.svd(np.column_stack((east - east.mean(), north - north.mean())))[2][0]
    assert abs(principal @ scene.side) < 1e-9
    np.testing.assert_allclose(scene.eye, middle + scene.size * np.array([*(0.8 * scene.side), 0.5]))


def test_attitudes_in_the_scene() -> None:
    """At the start, east is x and north is y: heading 30°, pitch 10°, roll 20° by another library."""
    q = Rotation.from_euler("ZYX", np.tile((30.0, 10.0, 20.0), (4, 1)), degrees=True)
    scene = Scene.around(state())
    found = scene.attitudes(LATITUDE, LONGITUDE, q.as_quat(scalar_first=True))
    enu = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    turned = Rotation.from_quat(found, scalar_first=True).as_matrix()
    np.testing.assert_allclose(turned[0], enu @ q[0].as_matrix(), atol=1e-12)
    # meridians converge: north there is turned by about Δλ sin φ towards the west of the start's north
    for k in (1, 2, 3):
        angle = np.sin(LATITUDE[k]) * np.sin(LONGITUDE[k] - 2.5)  # east of the local north, over its north, cos φ
        back = np.arctan2(-angle, np.cos(LATITUDE[k]))
        turn = Rotation.from_euler("Z", -back).as_matrix()
        np.testing.assert_allclose(turned[k], turn @ enu @ q[k].as_matrix(), atol=1e-12)


def test_zoom_of_a_map() -> None:
    """A degree fills 220 of 256/360 points at level 0; limits 1 and 18; north counts in the Mercator projection."""

    def track(*places: tuple[float, float]) -> NavState:
        lat, lon = np.radians(places).T
        return NavState(lat, lon, np.zeros(len(lat)), np.zeros((len(lat), 3)), np.zeros((len(lat), 4)))

    assert map_zoom([track((0.0, 10.0), (0.0, 11.0))]) == pytest.approx(np.log2(220.0 * 360.0 / 256.0))
    at_60 = track((60.0, 10.0), (60.5, 10.1))
    height = np.degrees(np.log(np.tan(np.radians(45.0 + 30.25)) / np.tan(np.radians(45.0 + 30.0))))
    assert map_zoom([at_60]) == pytest.approx(np.log2(220.0 * 360.0 / 256.0 / height))
    to_85 = np.degrees(np.log(np.tan(np.radians(87.5)) / np.tan(np.radians(87.0))))  # such maps end there
    assert map_zoom([track((84.0, 10.0), (89.0, 10.1))]) == pytest.approx(np.log2(220.0 * 360.0 / 256.0 / to_85))
    assert map_zoom([track((0.0, 10.0), (0.0, 10.0))]) == 18.0
    assert map_zoom([track((0.0, -100.0), (0.0, 99.0))]) == 1.0
    wide = map_zoom([at_60, track((60.0, 10.0), (60.0, 14.0))])
    assert wide == pytest.approx(np.log2(220.0 * 360.0 / 256.0 / 4.0))


def test_a_few_thousand_rows_of_a_track() -> None:
    count = 10_000
    long = NavState(*(np.arange(float(count)) + k for k in range(3)), np.arange(3.0 * count).reshape(-1, 3),
                    np.arange(4.0 * count).reshape(-1, 4))  # fmt: skip
    some = some_rows(long)
    assert len(some.latitude) == 4096
    assert (some.latitude[0], some.latitude[-1]) == (0.0, 9999.0)
    assert (some.height[0], some.velocity_ned[-1, 2], some.q_nb[-1, 3]) == (2.0, 29999.0, 39999.0)
