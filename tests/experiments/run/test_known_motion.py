"""Motion, solutions and recorded sensors as the viewer draws them, from numbers that are written down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import ImuData, NavSolution, NavState
from sinssim.experiments.run import run_recording as view
from sinssim.experiments.run.error_exhibits import error_charts
from sinssim.experiments.run.motion_exhibits import motion_charts
from sinssim.experiments.run.run_result import DrawnPath
from sinssim.experiments.run.sensor_exhibits import recorded_readings
from sinssim.recording.rerun_scene import Scene
from sinssim.recording.style import COLORS
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.sampling import FlightEvent
from tests.recording.spies import Drawn, record, values_of

X, Y, Z, GREY, TRUTH = (213, 94, 0), (0, 158, 115), (86, 180, 233), (120, 120, 120), (0, 158, 115)
TIME = np.array([10.0, 20.0, 60.0, 70.0])
ROLL, PITCH, HEADING = (np.array(v) for v in ([2.0, 175.0, -178.0, -10.0], [1.5, 10.0, -7.25, 3.0],
                                              [350.0, 5.0, 100.0, 200.0]))  # fmt: skip
VELOCITY = np.array([[3.0, -4.0, 1.0], [5.0, 12.0, -2.0], [-12.0, 5.0, 0.04], [7.0, -24.0, -6.5]])
LATITUDE, LONGITUDE = np.array([-33.5, -33.4, -33.3, -33.2]), np.array([151.25, 151.5, 151.75, 152.125])
HEIGHT = np.array([120.0, 340.0, 90.5, 260.25])
SOME_Q = Rotation.from_euler("ZYX", np.column_stack((HEADING, PITCH, ROLL)), degrees=True)
TRUTH_STATE = NavState(np.radians(LATITUDE), np.radians(LONGITUDE), HEIGHT, VELOCITY, SOME_Q.as_quat(scalar_first=True))
LAT_LON = np.column_stack((LATITUDE, LONGITUDE))


def test_the_motion_over_time() -> None:
    """Speed √(v_N² + v_E²); up is positive; no line where an angle jumps by a turn."""
    drawn = record(motion_charts(TIME, TRUTH_STATE, (), None))
    leaning = np.column_stack((ROLL, PITCH))
    leaning[1, 0] = np.nan
    drawn.shows("flight/roll_pitch", ["roll", "pitch"], TIME, leaning, [X, Z])
    drawn.shows("flight/heading", ["heading"], TIME, [[np.nan], [5.0], [100.0], [200.0]], [Y])
    drawn.shows("flight/height", ["height"], TIME, HEIGHT[:, None], [Y])
    drawn.shows("flight/speed", ["ground speed"], TIME, [[5.0], [13.0], [13.0], [25.0]], [Y])
    drawn.shows("flight/vertical_speed", ["vertical speed"], TIME, [[-1.0], [2.0], [-0.04], [6.5]], [Z])
    assert drawn.ranges["flight/height"] == (90.5, 340.0)


def test_the_motion() -> None:
    drawn: Any = Drawn()
    events = [FlightEvent(19.0, "<turns>"), FlightEvent(60.0, "climbs"), FlightEvent(99.0, "ends")]
    scene = Scene.around(TRUTH_STATE)
    view.draw_flight(drawn, TIME, TRUTH_STATE, scene, events, "land")
    np.testing.assert_allclose(values_of(drawn.fixed["map/truth"].line_strings), [LAT_LON])
    time, places = drawn.moving["map/vehicle"]
    np.testing.assert_array_equal(time, TIME)
    np.testing.assert_allclose(values_of(next(iter(places))), LAT_LON[:, None])
    points = scene.points(np.radians(LATITUDE), np.radians(LONGITUDE), HEIGHT)
    np.testing.assert_allclose(values_of(drawn.fixed["world/path"].strips), [points], rtol=1e-6)
    ground = points * [1.0, 1.0, 0.0]
    np.testing.assert_allclose(values_of(drawn.fixed["world/ground"].strips), [ground], rtol=1e-6)
    posts = values_of(drawn.fixed["world/posts"].strips)
    np.testing.assert_allclose(posts, np.stack((ground, points), axis=1), rtol=1e-6)
    marks = drawn.fixed["world/events"]
    assert values_of(marks.labels) == ["<turns>", "climbs", "ends"]
    np.testing.assert_allclose(values_of(marks.positions), points[[1, 2, 3]], rtol=1e-6)
    time, motion = drawn.moving["world/vehicle"]
    translation, quaternion = (np.squeeze(values_of(part)) for part in motion)
    np.testing.assert_array_equal(time, TIME)
    np.testing.assert_allclose(translation, points, rtol=1e-6)
    expected = scene.attitudes(TRUTH_STATE.latitude, TRUTH_STATE.longitude, TRUTH_STATE.q_nb)
    np.testing.assert_allclose(quaternion, np.roll(expected, -1, axis=1), atol=1e-6)  # Rerun's are scalar last
    vertices = np.array(values_of(drawn.fixed["world/vehicle"].vertex_positions))
    assert np.ptp(vertices[:, 0]) == pytest.approx(scene.vehicle_length, rel=0.02)


def test_the_attitude_beside_horizon_and_compass() -> None:
    """East, north, up from body by another library; N at the north, E at the east."""
    drawn: Any = Drawn()
    view._draw_attitude(drawn, TIME, TRUTH_STATE.q_nb, view.vehicle_mesh(""))
    _, motion = drawn.moving["attitude/vehicle"]
    translation, quaternion = (np.squeeze(values_of(part)) for part in motion)
    enu = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    np.testing.assert_allclose(Rotation.from_quat(quaternion).as_matrix(), enu @ SOME_Q.as_matrix(), atol=1e-6)
    assert not translation.any()
    compass = drawn.fixed["attitude/compass"]
    places = dict(zip(values_of(compass.labels), values_of(compass.positions), strict=True))
    expected = {"N": [0.0, 0.82, 0.0], "E": [0.82, 0.0, 0.0], "S": [0.0, -0.82, 0.0], "W": [-0.82, 0.0, 0.0]}
    assert {name: np.round(place, 6).tolist() for name, place in places.items()} == expected
    (ring,) = values_of(drawn.fixed["attitude/horizon"].strips)
    np.testing.assert_allclose(np.hypot(*np.array(ring)[:, :2].T), 0.75, rtol=1e-6)


def test_parts_without_satellites() -> None:
    """Rows from the beginning of an outage up to before its end; a part of a single row is no line."""
    drawn: Any = Drawn()
    view.draw_outages(drawn, TIME, TRUTH_STATE, [(15.0, 65.0), (60.0, 65.0), (5.0, 60.0)])
    found = values_of(drawn.fixed["map/no_satellites"].line_strings)
    assert [np.round(part, 9).tolist() for part in found] == [LAT_LON[1:3].tolist(), LAT_LON[:2].tolist()]
    nothing: Any = Drawn()
    view.draw_outages(nothing, TIME, TRUTH_STATE, [(61.0, 65.0)])
    assert not nothing.fixed


def test_recorded_sensors_as_mean_rates() -> None:
    """Increments over their intervals of 2, 4 and 4 s, in deg/s and m/s²."""
    time = np.array([100.0, 102.0, 106.0, 110.0])
    dtheta = np.radians([[2.0, -4.0, 6.0], [4.0, 12.0, -20.0], [-8.0, 16.0, 28.0]])
    imu = ImuData(time, dtheta, np.array([[1.0, 3.0, -19.0], [2.0, 5.0, -40.0], [8.0, -4.0, -36.0]]))
    drawn = record(recorded_readings(imu))
    rates = [[1.0, -2.0, 3.0], [1.0, 3.0, -5.0], [-2.0, 4.0, 7.0]]
    forces = [[0.5, 1.5, -9.5], [0.5, 1.25, -10.0], [2.0, -1.0, -9.0]]
    drawn.shows("sensors/gyro/reading", ["x", "y", "z"], time[1:], rates)
    drawn.shows("sensors/accel/reading", ["x", "y", "z"], time[1:], forces)


def solution(size: float, rows: Any = slice(None)) -> NavSolution:
    return NavSolution(TIME[rows], np.radians(LATITUDE + size)[rows], np.radians(LONGITUDE - size)[rows],
                       (HEIGHT + size)[rows], VELOCITY[rows], TRUTH_STATE.q_nb[rows],
                       size * np.array([1.0, 2.0, 3.0, 4.0])[rows])  # fmt: skip


def test_errors_of_the_solutions() -> None:
    """Every component in the unit of its magnitude; the second solution has fewer rows; 1 nmi/h from the beginning."""
    arcsec = np.pi / 648_000.0
    place = np.array([[3.0, -4.0, 7.0], [-60.0, 80.0, -30.0], [500.0, 1200.0, 45.0], [8.0, 15.0, 1.0]])
    speed = np.array([[0.02, -0.03, 0.06], [0.2, 0.3, -0.6], [-0.4, 0.6, 1.2], [0.1, 0.2, -0.2]])
    tilt = np.array([[2.0, 3.0, 6.0], [-4.0, 8.0, 80.0], [20.0, -40.0, 160.0], [1.0, 2.0, 2.0]])
    rows = np.array([0, 2, 3])
    errors = {
        "poisson": NavError(TIME, place, speed, tilt * arcsec),
        "euler": NavError(TIME[rows], 2.0 * place[rows], 3.0 * speed[rows], 0.5 * tilt[rows] * arcsec),
    }
    run: Any = SimpleNamespace(time=TIME, axes="north", errors=errors)
    drawn = record(error_charts(run, (10.0, 70.0)))
    units = {key.removeprefix("navigation/"): unit for key, unit in drawn.labels.items() if "title" not in key}
    assert units == {
        "horizontal": "m", "position_north": "m", "position_east": "m", "height": "m", "velocity_north": "m/s",
        "velocity_east": "m/s", "velocity_down": "m/s", "speed": "m/s", "tilt_north": "arcsec", "tilt_east": "arcsec",
        "azimuth": "arcmin", "attitude": "arcmin", "apart": "m",
    }  # fmt: skip
    expected = {
        "position_north": (place[:, 0], 2.0), "position_east": (place[:, 1], 2.0), "height": (-place[:, 2], 2.0),
        "speed": ([0.07, 0.7, 1.4, 0.3], 3.0), "velocity_north": (speed[:, 0], 3.0),
        "velocity_east": (speed[:, 1], 3.0), "velocity_down": (speed[:, 2], 3.0), "tilt_north": (tilt[:, 0], 0.5),
        "tilt_east": (tilt[:, 1], 0.5), "azimuth": (tilt[:, 2] / 60.0, 0.5),
    }  # fmt: skip
    for key, (values, factor) in expected.items():
        first = np.asarray(values)[:, None]
        drawn.shows(f"navigation/{key}/0", ["poisson"], TIME, first)
        drawn.shows(f"navigation/{key}/1", ["euler"], TIME[rows], factor * first[rows])
    drawn.shows("navigation/horizontal/0", ["1 nmi/h"], [10.0, 70.0], [[0.0], [1852.0 / 60.0]], [(140, 140, 140)])
    drawn.shows("navigation/horizontal/1", ["poisson"], TIME, [[5.0], [100.0], [1300.0], [17.0]])
    apart = np.linalg.norm(place[rows], axis=1)[:, None]
    drawn.shows("navigation/apart", ["euler"], TIME[rows], apart)
    wide, thin = (drawn.lines[f"navigation/height{end}"][4][0] for end in ("/0", "/1"))
    assert wide > thin
    small: Any = SimpleNamespace(
        time=TIME, axes="north", errors={"poisson": NavError(TIME, 1e-6 * place, speed, tilt * arcsec)}
    )
    alone = record(error_charts(small, (10.0, 70.0)))
    assert alone.labels["navigation/horizontal"] == "mm"
    assert alone.lines["navigation/horizontal"][2] == ["poisson"]
    assert "navigation/apart" not in alone.lines


def test_paths_of_solutions() -> None:
    drawn: Any = Drawn()
    scene = Scene.around(TRUTH_STATE)
    solutions = {"poisson": solution(0.001), "euler": solution(0.002, np.array([0, 2, 3]))}
    for name, one in solutions.items():
        view.draw_path(drawn, scene, name, one, COLORS[name])
        path = np.degrees(np.column_stack((one.latitude, one.longitude)))
        np.testing.assert_allclose(values_of(drawn.fixed[f"map/{name}"].line_strings), [path])
        points = scene.points(one.latitude, one.longitude, one.height)
        np.testing.assert_allclose(values_of(drawn.fixed[f"world/nav/{name}"].strips), [points], rtol=1e-5, atol=1e-3)
    assert values_of(drawn.fixed["map/euler"].colors) == [0xCC79A7FF]


def test_a_planned_path_with_a_gap_and_its_waypoints() -> None:
    """Two lines, because the place between them is not known; points have words in the scene."""
    scene, state = Scene.around(TRUTH_STATE), TRUTH_STATE
    latitude = np.where(np.arange(len(state.latitude)) == 2, np.nan, state.latitude)
    path = DrawnPath("planned", latitude, state.longitude, state.height, "planned")
    drawn: Any = Drawn()
    view.draw_line(drawn, scene, path)
    parts = [slice(0, 2), slice(3, None)]
    lines = values_of(drawn.fixed["map/planned"].line_strings)
    strips = values_of(drawn.fixed["world/planned"].strips)
    for part, line, strip in zip(parts, lines, strips, strict=True):
        np.testing.assert_allclose(line, np.degrees(np.column_stack((latitude[part], state.longitude[part]))))
        points = scene.points(latitude[part], state.longitude[part], state.height[part])
        np.testing.assert_allclose(strip, points, rtol=1e-5, atol=1e-3)
    two = (state.latitude[:2], state.longitude[:2], state.height[:2])
    view.draw_line(drawn, scene, DrawnPath("waypoints", *two, "planned", ("A (3 m left)", "B (4 m right)")))
    np.testing.assert_allclose(
        values_of(drawn.fixed["map/waypoints"].positions), np.degrees(np.column_stack(two[:2])), rtol=1e-12
    )
    assert values_of(drawn.fixed["world/waypoints"].labels) == ["A (3 m left)", "B (4 m right)"]
