"""What people look at: the right units, averages that lose nothing, a scene that lies where the flight was."""

from __future__ import annotations

import colorsys
import itertools
from typing import Any

import numpy as np
import pytest
import rerun.blueprint as rrb
from scipy.spatial.transform import Rotation

from sinssim.data import ImuData, NavState
from sinssim.experiments.run.sensor_exhibits import SensorComparison, compare_sensors, comparison_charts
from sinssim.experiments.run.vehicle_mesh import PATHS, kind_of, vehicle_mesh
from sinssim.recording import style
from sinssim.recording.rerun_scene import Scene, drifted, map_zoom
from sinssim.recording.rerun_views import RunInfo, load_view
from sinssim.recording.style import gaps
from sinssim.scenario import load_scenario
from sinssim.sensors.sensor_set_readings import Readings
from sinssim.truth.flight.jsbsim_model import AIRLINER, proportions
from sinssim.units import ANGLE_SCALE, LENGTH_SCALE, suiting
from tests.recording.rerun.test_views import views
from tests.recording.spies import record


def drawn_of(kinds: Any) -> Any:
    """Return what a recording shows of the readings of sensors."""
    return record(comparison_charts(list(kinds)))


def test_sensor_errors_come_in_the_units_that_people_know():
    time = np.arange(60_001) / 100.0
    shape = (60_000, 3)
    ideal = ImuData(time, np.full(shape, 1e-4), np.full(shape, -0.0980665))
    bias, accel = np.array([0.01, -0.02, 0.0]), np.array([50.0, 0.0, -100.0])  # deg/h, µg
    measured = ImuData(time, ideal.dtheta + np.radians(bias / 3600.0) * 0.01, ideal.dvel + accel * 9.80665e-6 * 0.01)
    drawn = drawn_of(compare_sensors(Readings(measured), Readings(ideal), ideal, None))
    labels = drawn.labels
    assert (labels["sensors/gyro/sum"], labels["sensors/accel/sum"]) == ("arcsec", "m/s")
    assert labels["sensors/gyro/error title"] == "Gyros: error, mean over 5 s"
    np.testing.assert_allclose(drawn.lines["sensors/gyro/error"][1], np.tile(bias, (120, 1)), rtol=0, atol=1e-10)
    np.testing.assert_allclose(drawn.lines["sensors/accel/error"][1], np.tile(accel, (120, 1)), rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        drawn.lines["sensors/gyro/sum"][1][-1], bias * 600.0, rtol=0, atol=1e-8
    )  # arcsec in 600 s
    np.testing.assert_allclose(drawn.lines["sensors/accel/sum"][1][-1], accel * 9.80665e-6 * 600.0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        drawn.lines["sensors/gyro/reading"][1][:, :3], np.degrees(1e-2), rtol=1e-11
    )  # edges of 600 s round
    np.testing.assert_allclose(drawn.lines["sensors/accel/reading"][1][:, :3], -9.80665, rtol=1e-11)


def test_what_a_compensation_took_away_is_seen():
    """The error as measured wide and pale, what is left of it thin above, and on a scale of its own."""
    time = np.arange(60_001) / 100.0
    shape = (60_000, 3)
    ideal = ImuData(time, np.full(shape, 1e-4), np.full(shape, -0.0980665))
    bias = np.radians(np.array([10.0, -20.0, 5.0]) / 3600.0)  # rad/s
    measured = ImuData(time, ideal.dtheta + bias * 0.01, ideal.dvel + 1e-5)
    freed = ImuData(time, ideal.dtheta + 1e-3 * bias * 0.01, ideal.dvel + 1e-8)
    drawn = drawn_of(compare_sensors(Readings(measured), Readings(ideal), ideal, freed))
    labels = drawn.labels
    assert (labels["sensors/gyro/sum"], labels["sensors/gyro/left"]) == ("deg", "arcsec")
    both, left = (drawn.lines[f"sensors/gyro/{key}"] for key in ("sum", "left"))
    assert both[2] == ["x measured", "y measured", "z measured", "x compensated", "y compensated", "z compensated"]
    np.testing.assert_allclose(both[1][-1, :3], np.degrees(bias * 600.0), rtol=1e-9)
    np.testing.assert_allclose(both[1][-1, 3:], 1e-3 * np.degrees(bias * 600.0), rtol=1e-9)
    np.testing.assert_allclose(left[1][-1], 3.6 * np.degrees(bias * 600.0), rtol=1e-9)
    _, means, _, colors, widths = drawn.lines["sensors/gyro/error"]
    np.testing.assert_allclose(means[:, 3:], np.tile([0.01, -0.02, 0.005], (120, 1)), rtol=0, atol=1e-9)
    assert min(widths[:3]) > 2.0 * max(widths[3:])
    assert colors[3:] == style.colors(["x", "y", "z"])
    assert colors[:3] == [style.tint(color) for color in colors[3:]]


@pytest.mark.parametrize("duration", [0.01, 10.1, 0.7, 20.3])
def test_the_last_window_of_mean_errors_ends_with_the_run(duration: float) -> None:
    """The end of the last window may lie beyond the last instant by rounding, as 10.1 s of 0.1 s do."""
    time = np.arange(round(duration * 10.0) + 1) / 10.0 if duration > 0.1 else np.array([0.0, 0.01])
    error = np.outer(time, (1.0, -2.0, 3.0))  # a constant rate
    of = SensorComparison(
        "gyro", "Gyros", ("x", "y", "z"), time, error, None, ANGLE_SCALE, ("deg/h", 1.0), error, error
    )
    at, mean = of.averaged(error)
    assert len(at) == int(time[-1] / of.window + 1e-6)
    np.testing.assert_allclose(mean, np.tile((1.0, -2.0, 3.0), (len(at), 1)))


def test_an_attitude_sensors_error_is_averaged_not_differenced():
    """Reference off by 3, drifting by 1 arcsec a second about the inertial z axis, noise of alternating sign on x."""
    time = np.arange(1001) / 10.0
    arcsec = np.radians(1.0 / 3600.0)
    off = arcsec * np.column_stack((2.0 * (-1.0) ** np.arange(1001), np.zeros(1001), 3.0 + time))
    true = Rotation.from_euler("ZYX", np.column_stack((time, 0.3 * np.sin(time), 0.2 * np.cos(time))))
    read = Rotation.from_rotvec(off) * true
    nothing = ImuData(time, np.zeros((1000, 3)), np.zeros((1000, 3)))
    quaternions = [r.as_quat(scalar_first=True) for r in (read, true)]
    readings, perfect = (Readings(nothing, q) for q in quaternions)
    drawn = drawn_of(compare_sensors(readings, perfect, nothing, None))
    labels = drawn.labels
    assert labels["sensors/attitude/sum"] == "arcmin"
    assert "sensors/gyro/error" not in drawn.lines
    np.testing.assert_allclose(drawn.lines["sensors/attitude/sum"][1], off / arcsec / 60.0, rtol=0, atol=1e-9)
    ends, means, *_ = drawn.lines["sensors/attitude/error"]
    assert labels["sensors/attitude/error title"].endswith("mean over 0.5 s")
    np.testing.assert_allclose(ends, 0.5 * np.arange(1, 201), rtol=0, atol=1e-9)
    # five readings a window, the first at its begin: 0, 0.1, … 0.4 s into it
    expected = (3.0 + ends - 0.3) / 60.0
    np.testing.assert_allclose(means[:, 2], expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.abs(means[:, 0]), 2.0 / 5.0 / 60.0, rtol=0, atol=1e-9)


def test_mean_rates_lose_no_increment():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.005, 0.02, 50_001))
    imu = ImuData(time, rng.standard_normal((50_000, 3)), rng.standard_normal((50_000, 3)))
    drawn = drawn_of(compare_sensors(Readings(imu), Readings(imu), imu, None))
    ends, rates, *_ = drawn.lines["sensors/gyro/reading"]
    total = np.degrees(imu.dtheta.sum(axis=0))
    widths = np.diff(np.concatenate(([time[0]], ends)))
    np.testing.assert_allclose((rates[:, :3] * widths[:, None]).sum(axis=0), total, rtol=1e-10)


@pytest.mark.parametrize(
    ("value", "unit"), [(0.0, "mm"), (0.5, "mm"), (0.51, "m"), (18520.0, "m"), (1e5, "m"), (1.01e5, "km"), (1e9, "km")]
)
def test_lengths_come_in_the_unit_that_suits_them(value, unit):
    assert suiting(LENGTH_SCALE, np.array([0.0, -value]))[0] == unit


def test_a_jump_of_a_whole_turn_is_a_gap_and_nothing_else_is():
    heading = np.array([350.0, 359.0, 1.0, 5.0, 90.0])
    out = gaps(heading, 360.0)
    assert np.isnan(out[1])
    np.testing.assert_array_equal(out[[0, 2, 3, 4]], heading[[0, 2, 3, 4]])


def flight(lat_deg, lon_deg, course_deg, length=2e5, count=400):
    """Level flight along a great circle of a sphere, as a truth; the body flies where it points."""
    r = 6.371e6
    lat0, lon0, c = np.radians([lat_deg, lon_deg, course_deg])
    d = np.linspace(0.0, length, count) / r
    lat = np.arcsin(np.sin(lat0) * np.cos(d) + np.cos(lat0) * np.sin(d) * np.cos(c))
    y = np.sin(c) * np.sin(d) * np.cos(lat0)
    lon = lon0 + np.arctan2(y, np.cos(d) - np.sin(lat0) * np.sin(lat))
    course = np.arctan2(np.sin(c) * np.cos(lat0), np.cos(lat0) * np.cos(d) * np.cos(c) - np.sin(lat0) * np.sin(d))
    q = np.roll(Rotation.from_euler("Z", course[:, None]).as_quat(), 1, axis=1)
    zeros = np.zeros(count)
    return NavState(lat, (lon + np.pi) % (2.0 * np.pi) - np.pi, zeros + 9000.0, np.zeros((count, 3)), q)


@pytest.mark.parametrize(("lat", "lon", "course"), [(0.0, 10.0, 90.0), (60.0, 179.9, 70.0), (-45.0, -30.0, 200.0)])
def test_the_aircraft_points_along_its_drawn_path(lat, lon, course):
    truth = flight(lat, lon, course)
    scene = Scene.around(truth)
    points = scene.points(truth.latitude, truth.longitude, truth.height)
    np.testing.assert_allclose(points[0], 0.0, rtol=0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(points[-1]), 2e5, rtol=5e-3)
    q = scene.attitudes(truth.latitude, truth.longitude, truth.q_nb)
    nose = Rotation.from_quat(np.roll(q, -1, axis=1)).apply([1.0, 0.0, 0.0])
    path = np.gradient(points, axis=0)
    path /= np.linalg.norm(path, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip((nose * path).sum(axis=1), -1.0, 1.0)))
    assert angle.max() < 0.5  # the course is a sphere's, the scene an ellipsoid's


def test_scene_axes_are_east_north_up():
    truth = flight(50.0, 8.0, 0.0, length=1000.0)
    scene = Scene.around(truth)
    level_north = np.array([[1.0, 0.0, 0.0, 0.0]])
    q = scene.attitudes(truth.latitude[:1], truth.longitude[:1], level_north)[0]
    rotation = Rotation.from_quat(np.roll(q, -1))
    np.testing.assert_allclose(rotation.apply([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0], rtol=0, atol=1e-12)  # nose: north
    np.testing.assert_allclose(rotation.apply([0.0, 1.0, 0.0]), [1.0, 0.0, 0.0], rtol=0, atol=1e-12)  # right wing: east
    np.testing.assert_allclose(rotation.apply([0.0, 0.0, 1.0]), [0.0, 0.0, -1.0], rtol=0, atol=1e-12)  # belly: down


def test_heights_are_exaggerated_only_where_a_flight_is_long_and_flat():
    long = flight(50.0, 8.0, 45.0)
    climbing = NavState(long.latitude, long.longitude, np.linspace(0.0, 9000.0, 400), long.velocity_ned, long.q_nb)
    assert Scene.around(climbing).height_scale == 5
    steep = flight(50.0, 8.0, 45.0, length=5000.0)
    loop = NavState(steep.latitude, steep.longitude, np.linspace(0.0, 2000.0, 400), steep.velocity_ned, steep.q_nb)
    assert Scene.around(loop).height_scale == 1


def test_a_parked_vehicle_has_a_scene_too():
    parked = NavState(
        np.full(5, np.pi / 2), np.zeros(5), np.zeros(5), np.zeros((5, 3)), np.tile([1.0, 0, 0, 0], (5, 1))
    )
    scene = Scene.around(parked)
    assert scene.size == 30.0
    assert np.all(np.isfinite([*scene.eye, *scene.middle, map_zoom([parked])]))


@pytest.mark.parametrize("longitude", [0.0, 180.0])
def test_the_map_shows_all_tracks_across_the_antimeridian_too(longitude):
    track = flight(
        0.0, longitude - 0.5, 90.0, length=111_195.0
    )  # a degree along the equator: 256/360 points at level 0
    assert map_zoom([track]) == pytest.approx(np.log2(220.0 / (256.0 / 360.0)), abs=0.02)
    far = flight(0.0, longitude, 0.0, length=222_390.0)  # two degrees to the north
    assert map_zoom([track, far]) == pytest.approx(np.log2(110.0 / (256.0 / 360.0)), abs=0.02)


def test_the_map_leaves_out_what_drifts_away():
    """A path of 100 km along the equator; others beside it double its width, or do not."""
    track = flight(0.0, 0.0, 90.0, length=100e3)
    near, far = (flight(0.0, 0.0, 90.0, length=length) for length in (190e3, 210e3))
    assert drifted(track, {"aided": track, "quaternion": near, "poisson": far}) == ["poisson"]
    hidden = RunInfo("drive", 0.0, 1.0, ("poisson",), labels={"not_on_map": "poisson"})
    (shown,) = (view for view in views(load_view("flight", hidden).root_container) if isinstance(view, rrb.MapView))
    assert shown.contents == ["/map/**", "- /map/poisson"]
    assert str(shown.name) == "Map, without the inertial path of poisson"


@pytest.mark.parametrize(
    ("kind", "shape"), [*((kind, AIRLINER) for kind in PATHS), ("aircraft", proportions("Concorde"))]
)
def test_a_vehicle_is_closed_and_as_long_as_it_says(kind, shape):
    vertices, triangles, brightness = vehicle_mesh(kind, shape)
    assert np.ptp(vertices[:, 0]) == pytest.approx(1.0, abs=0.02)
    assert triangles.max() < len(vertices) == len(brightness)
    np.testing.assert_allclose(vertices[:, 1].min(), -vertices[:, 1].max())
    assert vertices[np.argmax(vertices[:, 0]), 0] == pytest.approx(0.5, abs=0.02)  # the nose is ahead
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert set(uses) == {2}  # every edge belongs to two triangles: no holes


def test_an_aircraft_has_the_proportions_of_its_model():
    """The metrics of 737.xml, ft: span 94.7, wing 1171 ft², tailplane 348 ft² at an arm of 48.04, whose double is 96.1;
    its wing as it is drawn has that span. A glider is wide and straight, Concorde has no tailplane."""
    airliner = proportions("737")
    assert airliner.span == pytest.approx(94.7 / 96.08, rel=1e-3)
    assert airliner.chord == pytest.approx(1171.0 / 94.7 / 96.08, rel=1e-3)
    assert airliner.tail_span == pytest.approx((4.0 * 348.0) ** 0.5 / 96.08, rel=1e-3)
    vertices, _, _ = vehicle_mesh("aircraft", airliner)
    assert np.ptp(vertices[:, 1]) == pytest.approx(airliner.span)
    glider, delta = proportions("sgs233"), proportions("Concorde")
    assert (glider.swept, airliner.swept) == (False, True)
    assert glider.span / glider.chord == pytest.approx(51.0**2 / 219.48, rel=1e-3)
    assert delta.tail_span == 0.0


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("first_flight", "aircraft"),
        ("delivery_drive", "land"),
        ("sea_voyage", "sea"),
        ("foot_walk", "foot"),
        ("survey_drone", "multirotor"),
        ("rotating_unit", ""),
    ],
)
def test_the_model_and_the_title_follow_the_vehicle(name, kind):
    assert kind_of(load_scenario(name)) == kind
    assert ("Flight" in PATHS[kind]) == (kind == "aircraft")


def test_colours_are_legible_on_dark_and_light_and_differ():
    def luminance(rgb):
        linear = [(c / 255 / 12.92) if c / 255 <= 0.04045 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in rgb]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    drawn = {name: rgb for name, rgb in style.COLORS.items() if name != "vehicle"}
    sensors = ("gnss-position", "baro", "magnetometer", "airspeed", "odometer", "star-tracker", "master-attitude")
    of_sensors = [f"{sensor} bias" for sensor in sensors] + ["airspeed wind", "magnetometer deviation", "baro scale"]
    for rgb in (*drawn.values(), *style.colors(of_sensors)):
        assert (luminance(rgb) + 0.05) / 0.05 > 3.0  # WCAG: contrast of graphics, on black
        assert 1.05 / (luminance(rgb) + 0.05) > 1.9  # and visible on white
    for group in (("quaternion", "poisson", "euler", "truth"), ("x", "y", "z"), ("ideal", "measured")):
        for a, b in itertools.combinations(style.colors(group), 2):
            hues = [colorsys.rgb_to_hsv(*(c / 255 for c in rgb))[0] for rgb in (a, b)]
            assert 0.05 < abs(hues[0] - hues[1]) < 0.95


def test_unknown_names_get_colours_of_their_own():
    assert len(set(style.colors(["quaternion", "picard", "rotation-vector", "savage"]))) == 4
