"""The planned path as geometry, against geodesics by Vincenty's formula, closed forms of the loxodrome and of turns."""

from __future__ import annotations

import math
from math import atan2, cos, sin, sqrt
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.leg import DeadReckoning
from sinssim.truth.flight.planned_path import Begin, PlannedTrack, great_circle, over_ground

DEG = math.pi / 180.0
A, F = 6378137.0, 1.0 / 298.257223563
E2 = F * (2.0 - F)


def geodesic(latitude: float, longitude: float, azimuth: float, way: float) -> tuple[float, float]:
    """Return where a geodesic of WGS-84 ends, by Vincenty's direct formula (Survey Review 23, 1975, 88)."""
    b = A * (1.0 - F)
    tan_u = (1.0 - F) * math.tan(latitude)
    cos_u = 1.0 / sqrt(1.0 + tan_u**2)
    sin_u = tan_u * cos_u
    sigma1 = atan2(tan_u, cos(azimuth))
    sin_alpha = cos_u * sin(azimuth)
    u2 = (1.0 - sin_alpha**2) * (A**2 - b**2) / b**2
    big_a = 1.0 + u2 / 16384.0 * (4096.0 + u2 * (-768.0 + u2 * (320.0 - 175.0 * u2)))
    big_b = u2 / 1024.0 * (256.0 + u2 * (-128.0 + u2 * (74.0 - 47.0 * u2)))
    sigma = way / (b * big_a)
    for _ in range(20):
        c = cos(2.0 * sigma1 + sigma)
        delta = big_b * sin(sigma) * (c + big_b / 4.0 * (cos(sigma) * (2.0 * c * c - 1.0)
                 - big_b / 6.0 * c * (4.0 * sin(sigma) ** 2 - 3.0) * (4.0 * c * c - 3.0)))  # fmt: skip
        sigma = way / (b * big_a) + delta
    north = sin_u * cos(sigma) + cos_u * sin(sigma) * cos(azimuth)
    down = sin_u * sin(sigma) - cos_u * cos(sigma) * cos(azimuth)
    end = atan2(north, (1.0 - F) * sqrt(sin_alpha**2 + down**2))
    turned = atan2(sin(sigma) * sin(azimuth), cos_u * cos(sigma) - sin_u * sin(sigma) * cos(azimuth))
    k = F / 16.0 * (1.0 - sin_alpha**2) * (4.0 + F * (4.0 - 3.0 * (1.0 - sin_alpha**2)))
    c = cos(2.0 * sigma1 + sigma)
    east = turned - (1.0 - k) * F * sin_alpha * (
        sigma + k * sin(sigma) * (c + k * cos(sigma) * (2.0 * c * c - 1.0)))  # fmt: skip
    return end, longitude + east


def track(points: np.ndarray, height: float = 0.0) -> PlannedTrack:
    return PlannedTrack(points[:, 0], points[:, 1], np.full(len(points), height), height)


def beside(path: PlannedTrack, latitude: float, longitude: float, height: float = 0.0) -> tuple[float, float, float]:
    along, right, above = path.beside(np.array([latitude]), np.array([longitude]), np.array([height]))
    return float(along[0]), float(right[0]), float(above[0])


@pytest.mark.parametrize("right", [-18_520.0, -300.0, 1.0, 7_408.0])
def test_across_a_great_circle_is_the_geodesic_at_right_angles(right: float) -> None:
    """From a place on the path, whose course there follows from the sphere of the latitudes by hand."""
    begin, end = (50.0 * DEG, -8.0 * DEG), (45.0 * DEG, -52.0 * DEG)
    path = track(great_circle(begin, end))
    apart = end[1] - begin[1]
    pole = np.cross(
        [cos(begin[0]), 0.0, sin(begin[0])], [cos(end[0]) * cos(apart), cos(end[0]) * sin(apart), sin(end[0])]
    )
    pole /= np.linalg.norm(pole)
    meridian = -20.0 * DEG  # of the place, from that of the beginning
    latitude = math.atan(-(pole[0] * cos(meridian) + pole[1] * sin(meridian)) / pole[2])
    slope = (pole[0] * sin(meridian) - pole[1] * cos(meridian)) / pole[2] * cos(latitude) ** 2  # dφ/dλ
    w2 = 1.0 - E2 * sin(latitude) ** 2
    course = atan2(-cos(latitude), -slope * (1.0 - E2) / w2)  # westwards, on the ellipsoid
    place = geodesic(latitude, begin[1] + meridian, course + math.copysign(math.pi / 2.0, right), abs(right))
    assert beside(path, *place)[1] == pytest.approx(right, abs=0.02, rel=1e-5)


def test_a_heading_error_of_a_tenth_of_a_degree_over_300_km() -> None:
    """The path is the equator, and the other one leaves it at the angle: 524 m."""
    path = track(great_circle((0.0, 0.1), (0.0, 0.1 + 320e3 / A)))
    place = geodesic(0.0, 0.1, 90.1 * DEG, 300e3)
    along, right, _ = beside(path, *place)
    assert right == pytest.approx(300e3 * math.tan(0.1 * DEG), rel=1e-3)
    assert right == pytest.approx(523.6, abs=1.0)
    assert along == pytest.approx(300e3, abs=1.0)


def test_a_line_of_constant_heading_is_the_loxodrome_of_the_ellipsoid() -> None:
    """tan χ = Δλ/Δψ, with the isometric latitude ψ; its length is the meridian's arc over cos χ."""
    course, way = 60.0 * DEG, 400e3
    points = over_ground((55.0 * DEG, 0.2), 0.0, [(way * cos(course), way * sin(course))])

    def isometric(latitude: float) -> float:
        e = sqrt(E2)
        return math.asinh(math.tan(latitude)) - e * math.atanh(e * sin(latitude))

    latitude, longitude = points[-1]
    assert longitude - 0.2 == pytest.approx(math.tan(course) * (isometric(latitude) - isometric(55.0 * DEG)), rel=1e-9)
    nodes = np.linspace(55.0 * DEG, latitude, 20001)
    arc = np.trapezoid(A * (1.0 - E2) / (1.0 - E2 * np.sin(nodes) ** 2) ** 1.5, nodes)
    assert arc / cos(course) == pytest.approx(way, rel=1e-9)


def flight(*legs: dict[str, Any], **keys: Any) -> FlightPlan:
    start = {"on": "air", "latitude_deg": 47.0, "longitude_deg": 11.0, "altitude_m": 4000.0, "heading_deg": 90.0}
    return FlightPlan.model_validate({"aircraft": "737", "start": start, "legs": legs, **keys})


def planned(plan: FlightPlan, number: int = 0) -> tuple[DeadReckoning, tuple[PlannedTrack, ...]]:
    """Return the state of the plan at its start, and the tracks of a leg, all of which begin there."""
    begin = Begin(0.0, 47.0 * DEG, 11.0 * DEG, 4000.0, 90.0 * DEG)
    return plan.at_start(), plan.planned_tracks([begin] * len(plan.legs))[number]


def test_a_turn_has_the_radius_of_its_bank() -> None:
    """Half a circle to the right: its ends are 2 V²/(g tan φ) apart, and its middle is half of that away."""
    start, (path,) = planned(flight({"type": "turn", "angle_deg": 180.0, "direction": "right", "bank_deg": 20.0}))
    radius = start.true_airspeed() ** 2 / (9.80665 * math.tan(20.0 * DEG))
    north = (path.latitude - 47.0 * DEG) * (6_367_000.0 + 4000.0)
    assert north[-1] == pytest.approx(-2.0 * radius, rel=2e-3)
    place = (47.0 * DEG - radius / 6_371_000.0, 11.0 * DEG)
    ways = path.beside(np.array([place[0]]), np.array([place[1]]), np.array([4000.0]))
    assert abs(float(ways.right[0])) == pytest.approx(radius, rel=0.02)
    rolling_in = 0.5 * 20.0 / math.degrees(start.roll_rate) * start.true_airspeed()
    assert path.length == pytest.approx(math.pi * radius + rolling_in, rel=2e-3)


def test_the_wind_carries_a_turn_and_a_heading() -> None:
    wind = {"north_mps": 20.0}
    start, (path,) = planned(flight({"type": "hold", "duration_s": 100.0}, wind=wind))
    assert (path.latitude[-1] - path.latitude[0]) * 6_371_400.0 == pytest.approx(2000.0, rel=2e-3)
    _, (turn,) = planned(flight({"type": "turn", "angle_deg": 360.0, "direction": "left"}, wind=wind))
    seconds = 2.0 * math.pi * start.true_airspeed() / (9.81 * math.tan(25.0 * DEG))
    rolling = 0.5 * 25.0 * DEG / start.roll_rate
    assert (turn.latitude[-1] - turn.latitude[0]) * 6_371_400.0 == pytest.approx(20.0 * (seconds + rolling), rel=2e-3)


def test_a_route_is_arcs_and_great_circles_with_their_heights() -> None:
    """At the capture of each place the path has the place's height; it ends in the place."""
    places = [{"latitude_deg": 47.0, "longitude_deg": 12.0, "height_m": 5000.0},
              {"latitude_deg": 47.5, "longitude_deg": 12.0}, {"latitude_deg": 47.5, "longitude_deg": 11.0,
               "height_m": 4500.0, "path_deg": 3.0}]  # fmt: skip
    _, tracks = planned(flight({"type": "waypoint", "waypoints": places, "capture_radius_m": 500.0}))
    for path, (place, height) in zip(tracks, zip(places, (5000.0, 5000.0, 4500.0), strict=True), strict=True):
        assert path.latitude[-1] == pytest.approx(place["latitude_deg"] * DEG, abs=1e-12)
        assert path.longitude[-1] == pytest.approx(place["longitude_deg"] * DEG, abs=1e-12)
        assert path.height[-1] == pytest.approx(height, abs=0.01)
    half = np.searchsorted(tracks[0].longitude, 11.5 * DEG)
    assert tracks[0].height[half] == pytest.approx(4500.0, abs=15.0)  # one slope all the way
    back = tracks[2].height
    assert back[len(back) // 2] == 5000.0  # level until the top of descent
    assert np.diff(back).min() / 50.0 == pytest.approx(-math.tan(3.0 * DEG), rel=0.02)
    assert tracks[1].longitude.max() > 12.0 * DEG  # the arc to the north goes beyond the place


def test_an_approach_is_planned_on_its_glide_path_alone() -> None:
    runway = {"type": "land", "latitude_deg": 47.0, "longitude_deg": 11.6, "altitude_m": 500.0, "heading_deg": 90.0}
    _, (path,) = planned(flight(runway))
    begin = 3500.0 / math.tan(3.0 * DEG) - 300.0
    assert path.length == pytest.approx(begin, rel=1e-3)
    before = 11.6 * DEG - 0.5 * begin / (6_389_000.0 * cos(47.0 * DEG))
    _, right, above = beside(path, 47.0 * DEG - 10.0 / 6_367_000.0, before, 2300.0)
    assert right == pytest.approx(10.0, rel=1e-3)
    assert above == pytest.approx(2300.0 - 500.0 - (0.5 * begin + 300.0) * math.tan(3.0 * DEG), abs=3.0)
    assert math.isnan(beside(path, 47.0 * DEG, 10.6 * DEG, 4000.0)[1])
    assert math.isnan(beside(path, 47.0 * DEG, 11.61 * DEG, 500.0)[2])


def test_a_climb_has_a_track_but_no_height_and_manoeuvres_have_neither() -> None:
    plan = flight({"type": "climb", "altitude_m": 6000.0}, {"type": "s_turns", "turns": 2})
    _, (climb,) = planned(plan)
    assert np.isnan(climb.height).all()
    assert planned(plan, 1)[1] == ()


@pytest.mark.parametrize(
    ("legs", "keys", "message"),
    [
        ([{"type": "s_turns", "turns": 2, "rnp": 1}], {}, r"leg 1 \(s_turns\) has rnp = 1, but no planned path"),
        ([{"type": "s_turns", "turns": 2}], {"rnp": 0.3}, "no leg of this flight has one"),
        ([{"type": "hold", "duration_s": 60.0, "rnp": 3}], {}, r"rnp is 0.3, 1, 2, 4 or 10 \(nmi\), not 3"),
    ],
)
def test_a_corridor_needs_a_path(legs: list[dict[str, Any]], keys: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, ValueError), match=message):
        flight(*legs, **keys)


def test_the_corridor_of_a_leg_is_its_own_or_that_of_the_flight() -> None:
    hold = {"type": "hold", "duration_s": 60.0}
    plan = flight(hold, {**hold, "rnp": 0.3}, {"type": "s_turns", "turns": 1}, rnp=2)
    assert [plan.rnp_of(number) for number in range(3)] == [2.0, 0.3, None]


M60, N60 = 6383453.857, 6394209.174
"""a(1 − e²)/W³ and a/W at 60°, where the cosine is a half."""
LATITUDE, LONGITUDE = math.pi / 3.0, 200.0 * DEG
UP = 800.0 / (M60 + 1000.0)
BEYOND = 0.5 - 0.75**0.5 * UP  # cosine of the latitude 800 m to the north


def bend(*, bounded: bool = False) -> PlannedTrack:
    """Return 800 m to the north and 600 m to the west, 1000 m high, from 60° N and 200° E."""
    latitude = LATITUDE + np.array([0.0, UP, UP])
    longitude = LONGITUDE - np.array([0.0, 0.0, 600.0]) / ((N60 + 1000.0) * BEYOND)
    return PlannedTrack(latitude, longitude, np.array([1000.0, 1080.0, 1380.0]), 1000.0, bounded)


def test_places_along_a_bend_far_north_and_beyond_the_date_line() -> None:
    """80 m before it, half of either way, and 60 m after it; the heights stay beyond the ends."""
    path = bend()
    assert path.length == pytest.approx(1400.0, abs=2e-3)
    assert path.right_at_end == pytest.approx([1.0, 0.0], abs=2e-4)
    places = path.at(np.array([-80.0, 400.0, 1100.0, 1460.0]))
    np.testing.assert_allclose((places[:, 0] - LATITUDE) * (M60 + 1000.0), [-80.0, 400.0, 800.0, 800.0], atol=3e-3)
    west = (LONGITUDE - places[:, 1]) * (N60 + 1000.0) * BEYOND
    np.testing.assert_allclose(west, [0.0, 0.0, 300.0, 660.0], atol=3e-3)
    np.testing.assert_allclose(places[:, 2], [1000.0, 1040.0, 1230.0, 1380.0], atol=3e-3)
    assert np.isnan(bend(bounded=True).at(np.array([-1.0, 700.0, 1401.0]))).any(axis=1).tolist() == [True, False, True]


def test_places_beside_a_bend_are_measured_at_their_own_height() -> None:
    """500 m on and 10 m to the right of the way north, 500 m above its level: 300 m of its level are 500/6 384 454 more
    there. 100 m after the bend it is 20 m to the right of the way
    west."""
    high = 1500.0
    place = (LATITUDE + 500.0 / (M60 + 1000.0), LONGITUDE + 10.0 / ((N60 + high) * 0.5))
    along, right, above = beside(bend(), *place, high)
    assert along == pytest.approx(800.0 - 300.0 * (M60 + high) / (M60 + 1000.0), abs=3e-3)
    assert right == pytest.approx(10.0, abs=3e-3)
    assert above == pytest.approx(high - 1000.0 - 0.1 * along, abs=1e-3)
    west = 100.0 / ((N60 + 1000.0) * BEYOND)
    along, right, above = beside(bend(), LATITUDE + UP + 20.0 / (M60 + 1000.0), LONGITUDE - west, 1000.0)
    over = 100.0 * 500.0 * math.tan(LATITUDE) / (2.0 * N60)  # the straight way is north of the parallel
    assert (along, right, above) == pytest.approx((900.0, 20.0 - over, -130.0), abs=2e-3)


def test_a_bend_moved_to_its_right() -> None:
    """Its beginning goes east, the bend and the end north, as the way after each point."""
    latitude, longitude = bend().shifted(100.0)
    points = bend()
    north = (latitude - points.latitude) * (M60 + 1000.0)
    east = (longitude - points.longitude) * (N60 + 1000.0) * np.cos(points.latitude)
    np.testing.assert_allclose(north, [0.0, 100.0, 100.0], atol=2e-2)
    np.testing.assert_allclose(east, [100.0, 0.0, 0.0], atol=2e-2)


@pytest.mark.parametrize(
    ("begin", "end", "middle"), [(170.0, 190.0, 180.0), (190.0, 170.0, 180.0), (-170.0, -190.0, -180.0)]
)
def test_the_middle_of_a_great_circle(begin: float, end: float, middle: float) -> None:
    """Between two places 20° apart on 60° N: tan φ = tan 60°/cos 10°. Of 1108 km no two points are 1000 km apart."""
    points = great_circle((LATITUDE, begin * DEG), (LATITUDE, math.remainder(end, 360.0) * DEG), 1e6)
    np.testing.assert_allclose(
        points[:, 0], [LATITUDE, math.atan(math.sqrt(3.0) / cos(10.0 * DEG)), LATITUDE], rtol=1e-12
    )
    np.testing.assert_allclose(points[:, 1] / DEG, [begin, middle, end], rtol=1e-12)


def test_ways_over_the_ground() -> None:
    """500 m in two steps, 300 m north and 400 m west; then 900 m east in four. A way east has the radius of its own
    parallel: the cosine is 0.5 − √0.75 · 150 m/M in the middle of the first way, and that of 300 m on the second."""
    points = over_ground((LATITUDE, LONGITUDE), 1000.0, [(300.0, -400.0), (0.0, 900.0)])
    north = (points[:, 0] - LATITUDE) * (M60 + 1000.0)
    np.testing.assert_allclose(north, [0.0, 150.0, 300.0, 300.0, 300.0, 300.0, 300.0], atol=1e-3)
    first, second = (0.5 - 0.75**0.5 * way / (M60 + 1000.0) for way in (150.0, 300.0))
    ends = (points[[2, 4, 6], 1] - LONGITUDE) * (N60 + 1000.0)
    np.testing.assert_allclose(
        ends, [-400.0 / first, -400.0 / first + 450.0 / second, -400.0 / first + 900.0 / second], atol=2e-3
    )


def test_far_beside_a_path() -> None:
    """100 km north of the equator, which the path follows east, and 100 km east of a meridian: 4 m more than in the
    plane that touches there, and 8 cm by the one radius that the ellipsoid has for that."""
    along_equator = track(great_circle((0.0, 0.1), (0.0, 0.1 + 50e3 / A)))
    assert beside(along_equator, *geodesic(0.0, 0.1, 0.0, 100e3))[1] == pytest.approx(-100e3, abs=0.1)
    along_meridian = track(great_circle((0.0, 0.1), (0.01, 0.1)))
    assert beside(along_meridian, *geodesic(0.0, 0.1, 90.0 * DEG, 100e3))[1] == pytest.approx(100e3, abs=0.1)
