"""Planned routes: geometry of the corners, speed, smoothness, and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.geodetic_coordinates import ecef_to_geodetic
from sinssim.errors import InputError
from sinssim.logs.track import Track
from sinssim.truth.motion import NORMAL_EARTH
from sinssim.truth.planned_route import Route, Timetable, _stepped
from sinssim.truth.route_waypoint import Corner, Waypoint, integrated_step7
from sinssim.truth.track_curve import track_curve
from sinssim.truth.vehicle_attitude import VEHICLES
from tests.truth.motions import Array

FLIGHT = (
    Waypoint(name="A", latitude_deg=51.5, longitude_deg=-0.5, height_m=3000.0, speed_mps=200.0),
    Waypoint(name="B", latitude_deg=52.5, longitude_deg=1.0, height_m=9000.0, bank_deg=25.0, speed_mps=230.0),
    Waypoint(name="C", latitude_deg=51.0, longitude_deg=3.5, height_m=9000.0),
)
DRIVE = (
    Waypoint(name="A", latitude_deg=51.5, longitude_deg=-0.5, height_m=30.0, speed_mps=15.0, stop_s=30.0),
    Waypoint(name="B", latitude_deg=51.51, longitude_deg=-0.5, height_m=40.0, turn_radius_m=20.0, stop_s=20.0),
    Waypoint(name="C", latitude_deg=51.51, longitude_deg=-0.49, height_m=50.0),
    Waypoint(name="D", latitude_deg=51.50, longitude_deg=-0.48, height_m=50.0, stop_s=30.0),
)


def step7(x: np.ndarray) -> np.ndarray:
    """Return 35x⁴ − 84x⁵ + 70x⁶ − 20x⁷, from 0 to 1 with three vanishing derivatives at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x**4 * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x))))


def horizontal(positions: Array) -> Array:
    """Return horizontal distances between neighbouring positions, m."""
    middle = 0.5 * (positions[1:] + positions[:-1])
    lat, lon, _ = ecef_to_geodetic(middle)
    up = np.column_stack((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    step = np.diff(positions, axis=0)
    return np.linalg.norm(step - np.einsum("ij,ij->i", step, up)[:, None] * up, axis=1)


@pytest.mark.parametrize("angle", [0.1, -1.2, 2.9])
@pytest.mark.parametrize("ramp", [0.0, 5.0, 1000.0])
def test_corner(angle: float, ramp: float) -> None:
    """It turns by its angle, ends on the outgoing tangent, and its curvature never exceeds 1/R."""
    corner = Corner(angle, 50.0, max(ramp, 1e-3))
    length = corner.length
    assert corner.heading(np.array([length]))[0] == pytest.approx(angle, rel=1e-12)
    x, y = corner.points(np.array([length]))[0]
    assert (x, y) == pytest.approx((corner.tangent * (1.0 + np.cos(angle)), corner.tangent * np.sin(angle)), abs=1e-9)
    for function, value in ((np.cos, x), (np.sin, y)):
        pieces = quad(
            lambda s, f=function: f(corner.heading(np.array([s]))[0]), 0.0, length,
            points=[corner.ramp_length, length - corner.ramp_length], limit=400,
        )  # fmt: skip
        assert value == pytest.approx(pieces[0], abs=1e-7)
    along = np.linspace(0.0, length, 4001)
    curvature = np.gradient(corner.heading(along), along)
    assert np.abs(curvature).max() < 1.0001 / 50.0


def test_smooth_step_is_three_times_flat() -> None:
    x = np.linspace(0.0, 1.0, 20_001)
    assert np.polynomial.polynomial.polyval(0.3, [0, 0, 0, 0, 35, -84, 70, -20]) == pytest.approx(step7(np.array(0.3)))
    assert np.abs(np.gradient(integrated_step7(x), x) - step7(x)).max() < 1e-4
    assert (step7(np.array([-1.0, 0.0, 1.0, 2.0])) == [0.0, 0.0, 1.0, 1.0]).all()
    assert integrated_step7(np.array(3.0)) == pytest.approx(2.5)


@pytest.mark.parametrize("height", [0.0, 9000.0])
def test_distance_is_over_ground(height: float) -> None:
    """Steps of a metre along the path are a metre over ground, on legs and in corners."""
    waypoints = tuple(w.model_copy(update={"height_m": height}) for w in FLIGHT)
    route = Route(waypoints, VEHICLES["aircraft"], WGS84)
    at = np.concatenate([np.linspace(0.0, route.length, 2001), route.passed[1] + np.linspace(-9e3, 9e3, 500)])
    at = np.clip(at, 0.5, route.length - 0.5)
    pairs = np.stack([route.positions(at - 0.5), route.positions(at + 0.5)], axis=1)
    steps = np.array([horizontal(pair)[0] for pair in pairs])
    assert np.abs(steps - 1.0).max() < 2e-8


def test_legs_are_great_circles() -> None:
    """Away from the corners, normals of the path are coplanar with those of the waypoints."""
    route = Route(FLIGHT, VEHICLES["aircraft"], WGS84)
    normals = route._normals
    lat, lon, _ = ecef_to_geodetic(route.positions(np.linspace(0.0, 130e3, 200)))
    own = np.column_stack((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    plane = np.cross(normals[0], normals[1])
    assert np.abs(own @ plane / np.linalg.norm(plane)).max() * 6.4e6 < 1e-3


def test_planned_flight_has_its_speed_bank_and_no_lateral_force() -> None:
    track = Track(vehicle="aircraft", waypoints=FLIGHT).prepared(NORMAL_EARTH)
    curve = track_curve(track.knots, track.fit, events=track.events)
    t = np.arange(5.0, curve.end - 5.0, 0.25)
    s = curve.state(t)
    speed = np.linalg.norm(s.velocity_ned[:, :2], axis=1)
    assert speed[:2000] == pytest.approx(200.0, abs=1e-3)
    assert speed[-2000:] == pytest.approx(230.0, abs=1e-3)
    _, force = curve.rates(t)
    assert np.abs(force[:, 1]).max() < 1e-5
    jerk = np.diff(force, axis=0) / 0.25
    assert np.abs(jerk).max() < 2.0  # no steps: 25° of bank is built up in five seconds
    assert [event.text for event in track.events] == ["A", "B", "C"]


def test_stops_are_at_rest_for_their_time() -> None:
    track = Track(vehicle="land", waypoints=DRIVE).prepared(NORMAL_EARTH)
    curve = track_curve(track.knots, track.fit)
    for event, seconds in zip((track.events[0], track.events[1], track.events[3]), (30.0, 20.0, 30.0), strict=True):
        assert event.text.endswith(f"at rest for {seconds:g} s")
        t = np.linspace(event.time + 3.0, event.time + seconds - 3.0, 50)
        assert np.linalg.norm(curve.state(t).velocity_ned, axis=1).max() < 1e-6
        assert np.linalg.norm(curve.rates(t)[0], axis=1) == pytest.approx(7.2921e-5, abs=1e-8)
    assert curve.end == pytest.approx(Timetable(Route(DRIVE, VEHICLES["land"], WGS84), 1.0).duration)


def test_corner_radius_is_the_given_one() -> None:
    section = Track(vehicle="land", waypoints=(
        Waypoint(latitude_deg=10.0, longitude_deg=20.0, speed_mps=10.0),
        Waypoint(latitude_deg=10.01, longitude_deg=20.0, turn_radius_m=60.0),
        Waypoint(latitude_deg=10.01, longitude_deg=20.01),
    ))  # fmt: skip
    fit = section.prepared(NORMAL_EARTH).fit
    assert fit.acceleration.largest == pytest.approx(100.0 / 60.0, rel=1e-3)  # v²/R
    assert fit.turn.largest == pytest.approx(10.0 / 60.0, rel=1e-3)


@pytest.mark.parametrize(
    "places", [((88.0, 0.0), (88.0, 180.0)), ((10.0, 179.0), (10.0, -179.0)), ((-89.0, 10.0), (-89.0, -100.0))]
)
def test_over_the_pole_and_the_date_line(places: tuple[tuple[float, float], ...]) -> None:
    waypoints = tuple(
        Waypoint(latitude_deg=lat, longitude_deg=lon, height_m=9000.0, speed_mps=230.0) for lat, lon in places
    )
    track = Track(vehicle="aircraft", waypoints=waypoints).prepared(NORMAL_EARTH)
    curve = track_curve(track.knots, track.fit)
    t = np.arange(0.0, curve.end, 1.0)
    speed = np.linalg.norm(curve.state(t).velocity_ned[:, :2], axis=1)
    assert speed == pytest.approx(230.0, abs=1e-3)
    assert track.fit.turn.largest < 1e-4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({1: {"turn_radius_m": 3000.0}}, ["from track.waypoints.1 (A) to track.waypoints.2 (B)", "smaller"]),
        (
            {2: {"latitude_deg": 51.51, "longitude_deg": -0.5}},
            ["(B) and track.waypoints.3 (C)", "same place", "stop_s"],
        ),
        ({2: {"latitude_deg": 51.499, "longitude_deg": -0.5}}, ["track.waypoints.2 (B)", "turns by 180°"]),
        ({0: {"speed_mps": 60.0}, 1: {"speed_mps": 15.0}}, ["changes of speed", "acceleration_mps2"]),
    ],
)
def test_refusals(change: dict[int, dict[str, Any]], words: list[str]) -> None:
    waypoints = tuple(w.model_copy(update=change.get(i, {})) for i, w in enumerate(DRIVE))
    with pytest.raises(InputError) as error:
        Track(vehicle="land", waypoints=waypoints).prepared(NORMAL_EARTH)
    for word in words:
        assert word in str(error.value)


def test_radii_and_ramps_of_the_corners() -> None:
    """Given; of a bank, v²/(g tan φ) at the larger of both speeds; else v²/a, at least 5 m. A ramp takes a time."""

    def corners(vehicle: str, *points: Waypoint) -> tuple[Corner | None, ...]:
        return Route(points, VEHICLES[vehicle], WGS84).corners

    def at(east: float, north: float, **keys: Any) -> Waypoint:
        return Waypoint(latitude_deg=north / 111e3, longitude_deg=east / 111e3, **keys)

    east, by_bank, by_default, straight, end = corners(
        "aircraft", at(0.0, 0.0, speed_mps=100.0), at(60e3, 0.0, bank_deg=30.0, speed_mps=150.0), at(60e3, 60e3),
        at(60e3, 120e3, turn_radius_m=5.0), at(60e3, 180e3),
    )  # fmt: skip
    assert (east, end) == (None, None)
    assert straight is None  # along the meridian
    assert by_bank is not None
    assert by_bank.radius == pytest.approx(150.0**2 / (9.80665 * np.tan(np.radians(30.0))))
    assert by_bank.angle == pytest.approx(-0.5 * np.pi, abs=0.02)  # to the left
    assert by_bank.ramp == pytest.approx(150.0 * 5.0)
    assert by_default is None
    _, land, _ = corners("land", at(0.0, 0.0, speed_mps=12.0), at(1e3, 0.0, speed_mps=8.0), at(1e3, -1e3))
    assert land is not None
    assert (land.radius, land.ramp) == (pytest.approx(72.0), pytest.approx(18.0))  # 2 m/s², 1.5 s
    assert land.angle == pytest.approx(0.5 * np.pi, abs=0.02)
    _, slow, _ = corners("land", at(0.0, 0.0, speed_mps=3.0), at(1e3, 0.0), at(1e3, -1e3))
    assert slow is not None
    assert slow.radius == 5.0
    _, ship, _ = corners("sea", at(0.0, 0.0, speed_mps=8.0), at(9e3, 0.0), at(9e3, -9e3))
    assert ship is not None
    assert (ship.radius, ship.ramp) == (pytest.approx(320.0), pytest.approx(80.0))  # 0.2 m/s², 10 s


def test_messages_of_a_route() -> None:
    def route(*points: tuple[float, float], **keys: Any) -> Route:
        given = tuple(Waypoint(latitude_deg=lat, longitude_deg=lon, speed_mps=9.0, **keys) for lat, lon in points)
        return Route(given, VEHICLES["land"], WGS84)

    with pytest.raises(InputError, match=r"track\.waypoints\.1 and track\.waypoints\.2 lie opposite each other"):
        route((10.0, 20.0), (-10.0, -160.0))
    with pytest.raises(InputError, match=r"track\.waypoints\.2: the turn has a radius of 700 km, too large"):
        route((0.0, 0.0), (0.0, 10.0), (10.0, 10.0), turn_radius_m=700e3)
    with pytest.raises(InputError) as error:
        route((0.0, 0.0), (0.0, 0.01), (0.01, 0.01), turn_radius_m=1500.0)
    # 0.01° of the equator; R and half a ramp
    assert str(error.value).startswith(
        "the leg from track.waypoints.1 to track.waypoints.2 has 1113.2 m, but the turns at its ends need 0 m and "
        "1507 m of them: give a smaller turn_radius_m"
    )


def test_heights_go_over_in_smooth_steps() -> None:
    """Of degree 9: a half in the middle, and 1 − 0.0489 at three quarters; both ends are flat."""
    found = _stepped(np.array([-5.0, 10.0, 20.0, 25.0, 30.0, 60.0, 99.0]), np.array([10.0, 30.0, 90.0]),
                     np.array([100.0, 300.0, 200.0]))  # fmt: skip
    at = 0.75**5 * (126.0 - 420.0 * 0.75 + 540.0 * 0.75**2 - 315.0 * 0.75**3 + 70.0 * 0.75**4)
    assert at == pytest.approx(1.0 - 0.04893, abs=1e-5)  # the regularised incomplete beta function I_0.75(5, 5)
    assert found == pytest.approx([100.0, 100.0, 200.0, 100.0 + 200.0 * at, 300.0, 250.0, 200.0])
