"""The navigation frames against one another and against the truth, over the poles too."""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np
import pytest

from sinssim import FRAMES, ImuData, InputError, NavState, RunError, navigate
from sinssim.strapdown.frames.wander_free_transverse import FREE_AZIMUTH, Place, transport_k
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from tests.oracles.s_turn import STurn
from tests.oracles.turntable import turn
from tests.slow import slow

ARCSEC = np.deg2rad(1 / 3600)
OVER_POLES = ("wander", "free-azimuth", "transverse", "inertial")
RADIUS = 6.38e6


def run(flight, **options):
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    height = None if options.get("vertical", "free") == "free" else flight.height
    return navigate(imu, first, **{"gravity": "somigliana", "height": height, **options})


def apart(a, b):
    """Largest distance, m, difference of velocity, m/s, and angle between attitudes, rad, of two solutions."""
    north = RADIUS * (a.latitude - b.latitude)
    east = RADIUS * np.cos(a.latitude) * (np.mod(a.longitude - b.longitude + np.pi, 2 * np.pi) - np.pi)
    p, q = a.q_nb, b.q_nb
    vector = p[:, :1] * q[:, 1:] - q[:, :1] * p[:, 1:] - np.cross(p[:, 1:], q[:, 1:])
    return (
        np.max(np.sqrt(north**2 + east**2 + (a.height - b.height) ** 2)),
        np.max(np.abs(a.velocity_ned - b.velocity_ned)),
        2 * np.max(np.linalg.norm(vector, axis=1)),
    )


@pytest.fixture(scope="module")
def s_turn():
    return STurn(duration=600).fly(100)


@pytest.mark.parametrize("vertical", ["free", "baro-loop", "truth"])
@pytest.mark.parametrize("frame", FRAMES)
def test_all_frames_meet_the_truth(s_turn, frame, vertical):
    """Asked of the frames among each other: 1e-3 m and 1e-4″. Each is nearer than that to the truth itself."""
    solution = run(s_turn, frame=frame, vertical=vertical)
    assert np.max(s_turn.horizontal_error(solution.latitude, solution.longitude)) < 1e-5
    assert np.max(np.abs(solution.height - s_turn.height)) < 5e-6
    assert np.max(np.abs(solution.velocity_ned - s_turn.velocity_ned)) < 5e-8
    assert np.max(s_turn.attitude_error(solution.q_nb)) < 1e-6 * ARCSEC


@pytest.mark.parametrize("frame", OVER_POLES)
def test_frames_agree_where_the_solution_is_wrong(s_turn, frame):
    """Wrong gravity, a wrong start and a baro loop that works: the same errors in every frame."""
    options = {
        "gravity": "order-1e-4",
        "vertical": "baro-loop",
        "height": s_turn.height + 30 * np.sin(s_turn.time / 50),
    }
    distance, _, angle = apart(run(s_turn, frame="level", **options), run(s_turn, frame=frame, **options))
    assert distance < 1e-3
    assert angle < 1e-4 * ARCSEC


@pytest.mark.slow
@pytest.mark.parametrize("frame", OVER_POLES)
def test_an_hour_in_all_frames(frame):
    flight = STurn(duration=3600).fly(100)
    distance, _, angle = apart(run(flight, frame="level"), run(flight, frame=frame))
    assert distance < 1e-3
    assert angle < 1e-4 * ARCSEC


@pytest.mark.parametrize("frame", ["wander", "free-azimuth", "transverse"])
def test_simplified_curvature_is_the_same_everywhere(s_turn, frame):
    """(8.16) as in the level frame; to the first order the two curvatures differ by e² cos²B/a."""
    level = run(s_turn, frame="level", curvature="simplified", vertical="truth")
    other = run(s_turn, frame=frame, curvature="simplified", vertical="truth")
    exact = run(s_turn, frame=frame, vertical="truth")
    distance, *_ = apart(level, other)
    damage, *_ = apart(exact, other)
    assert 0.1 < damage < 4.5e-5 * 200 * 600  # 4.5e-5 at worst, of 120 km
    assert distance < 1e-3 * damage


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"frame": "inertial", "curvature": "simplified"},
            r'curvature = "simplified" .* frame = "inertial" has no radii',
        ),
        (
            {"frame": "wander", "route": (0.0, 0.0, 0.0, 1.0)},
            r'route .* for frame = "transverse"; here frame = "wander"',
        ),
        (
            {"frame": "transverse", "azimuth": 0.3},
            r'azimuth .* for the frames wander and free-azimuth; here frame = "transverse"',
        ),
        ({"height": np.zeros(60001)}, r'height .* vertical = "free" uses no height'),
        ({"baro_time_constant": 30.0}, r'baro_time_constant = 30 .* vertical = "baro-loop"; here vertical = "free"'),
        ({"slow_quantities": "extrapolate"}, r'slow_quantities = "extrapolate" .* rates_hz is not given'),
    ],
)
def test_an_option_that_would_change_nothing_is_refused(s_turn, options, message):
    with pytest.raises(InputError, match=message):
        run(s_turn, **options)


def test_unequal_intervals_in_all_frames():
    """Sums of one, two and three 200 Hz samples in turn."""
    flight = STurn(duration=60, period=10.0).fly(200)
    edges = np.concatenate([[0], np.cumsum(np.tile([1, 2, 3], 2000))])
    imu = ImuData(
        flight.time[edges],
        np.add.reduceat(flight.dtheta, edges[:-1]),
        np.add.reduceat(flight.dvel, edges[:-1]),
    )
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    for frame in FRAMES:
        solution = navigate(imu, first, frame=frame, gravity="somigliana")
        assert RADIUS * np.max(np.abs(solution.latitude - flight.latitude[edges])) < 3e-6
        assert np.max(np.abs(solution.velocity_ned - flight.velocity_ned[edges])) < 1e-7


# --- over the poles -----------------------------------------------------------------------------------------


def earth_fixed(latitude, longitude, height):
    """Position, written out here (WGS-84)."""
    a, e2 = 6378137.0, 6.69437999014e-3
    n = a / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    c = (n + height) * np.cos(latitude)
    return np.stack([c * np.cos(longitude), c * np.sin(longitude), (n * (1 - e2) + height) * np.sin(latitude)], axis=-1)


def miss(circle, solution):
    """Largest distance from the truth, m."""
    truth = circle.state(solution.time)
    there = earth_fixed(truth.latitude, truth.longitude, truth.height)
    return np.max(np.linalg.norm(earth_fixed(solution.latitude, solution.longitude, solution.height) - there, axis=1))


@lru_cache(maxsize=4)
def felt(circle, rate):
    """Ideal increments."""
    return circle.increments(rate)


@cache
def along_the_equator():
    return GreatCircle(0.0, 0.3, 9000.0, np.pi / 2, 250.0, 600.0)


@cache
def over_the_pole(minutes, course=0.0, south=False):
    """330 m/s northwards (southwards), the pole half-way."""
    half = minutes * 60 * 330 / 2 / 6.38e6
    sign = -1 if south else 1
    return GreatCircle(
        sign * (np.pi / 2 - half), 0.5, 9000.0, np.pi - course if south else course, 330.0, minutes * 60.0
    )


@pytest.mark.parametrize("frame", OVER_POLES)
@pytest.mark.parametrize(("course", "south"), [(0.0, False), (1e-3, False), (2e-3, True)])
def test_over_the_pole(frame, course, south):
    """Five minutes: through the pole, 50 m beside it, and 100 m beside the other one."""
    circle = over_the_pole(5, course, south)
    solution = navigate(felt(circle, 50.0), circle.state(0.0), frame=frame)
    assert np.max(np.abs(solution.latitude)) > np.deg2rad(89.99)
    assert miss(circle, solution) < 1e-4
    np.testing.assert_allclose(np.linalg.norm(solution.q_nb, axis=1), 1, rtol=0, atol=1e-15)


@pytest.mark.parametrize("frame", ["wander", "free-azimuth", "transverse"])
def test_no_position_is_lost_to_the_last_digit_of_a_quaternion(frame):
    """Along the equator every step is alike, and so is what rounding takes of each: 9 µm in ten minutes, if it may."""
    circle = along_the_equator()
    assert miss(circle, navigate(felt(circle, 100.0), circle.state(0.0), frame=frame)) < 1e-7


@pytest.mark.parametrize("algorithm", ["euler", "functional-iteration"])
def test_other_algorithms_over_the_pole(algorithm):
    circle = over_the_pole(10)
    solution = navigate(circle.increments(50.0), circle.state(0.0), frame="wander", algorithm=algorithm)
    assert miss(circle, solution) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("frame", OVER_POLES)
def test_an_hour_over_the_pole(frame):
    """Asked: 0.05 m."""
    circle = over_the_pole(60)
    assert miss(circle, navigate(circle.increments(100.0), circle.state(0.0), frame=frame)) < 1e-3


@pytest.mark.parametrize("algorithm", ["quaternion", "functional-iteration"])
def test_a_north_pointing_frame_fails_there_and_says_when(algorithm):
    circle = over_the_pole(10)
    with pytest.raises(
        RunError, match=r"within 0\.1° of a pole.*latitude 89\.9\d*° at t = (\d+\.\d+) s.*wander"
    ) as error:
        navigate(circle.increments(50.0), circle.state(0.0), algorithm=algorithm)
    found = float(str(error.value).split("at t = ")[1].split(" s")[0])
    truth = circle.state(np.array([found - 0.02, found]))
    assert truth.latitude[0] <= np.deg2rad(89.9) + 1e-9
    assert truth.latitude[1] >= np.deg2rad(89.9) - 1e-9


# --- the transverse frame's route ---------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", ["quaternion", "functional-iteration"])
def test_transverse_with_a_given_route(s_turn, algorithm):
    """Any equator serves: the flight's own, one that crosses it, one 60° away."""
    lat, lon = s_turn.latitude[0], s_turn.longitude[0]
    for route in ((lat, lon, 0.9, 0.9), (lat, lon, lat + 0.5, lon - 0.1), (-0.2, 0.0, 0.1, 1.5)):
        solution = run(s_turn, frame="transverse", algorithm=algorithm, route=route, vertical="truth")
        assert np.max(s_turn.horizontal_error(solution.latitude, solution.longitude)) < 2e-5
        assert np.max(s_turn.attitude_error(solution.q_nb)) < 1e-6 * ARCSEC


@pytest.mark.parametrize(
    ("route", "message"),
    [
        ((0.5, 0.5, 0.5, 0.5), "coincide or are antipodal"),
        ((0.5, 0.5, -0.5, 0.5 + np.pi), "coincide or are antipodal"),
        ((0.5, 0.5, np.nan, 0.5), "4 finite numbers"),
        ((0.5, 0.5), "4 finite numbers"),
    ],
)
def test_routes_that_fix_no_circle(s_turn, route, message):
    with pytest.raises(InputError, match=message):
        run(s_turn, frame="transverse", route=route)


def test_transverse_frame_of_a_vehicle_at_rest_runs_along_its_parallel():
    flight = turn(lambda t: (np.tile([1.0, 0, 0, 0], (*t.shape, 1)), np.zeros((*t.shape, 3))), 5, 50)
    solution = run(flight, frame="transverse")
    assert np.max(flight.horizontal_error(solution.latitude, solution.longitude)) < 1e-6
    assert np.max(flight.attitude_error(solution.q_nb)) < 1e-12


# --- near the route's pole ----------------------------------------------------------------------------------


def past_the_pole(distance, seconds=120.0, speed=200.0):
    """Level flight past (40° N, 0°) at a distance to the south, eastwards, half-way; a route with its pole there."""
    pole = np.deg2rad(40.0)
    middle, half = pole - distance / 6371e3, 0.5 * seconds * speed / 6371e3
    up = np.array([np.cos(middle), 0.0, np.sin(middle)])
    start = up * np.cos(half) - np.array([0.0, 1.0, 0.0]) * np.sin(half)
    along = up * np.sin(half) + np.array([0.0, 1.0, 0.0]) * np.cos(half)
    latitude, longitude = np.arcsin(start[2]), np.arctan2(start[1], start[0])
    north = [-np.sin(latitude) * np.cos(longitude), -np.sin(latitude) * np.sin(longitude), np.cos(latitude)]
    course = np.arctan2(along @ [-np.sin(longitude), np.cos(longitude), 0.0], along @ north)
    circle = GreatCircle(latitude, longitude, 1000.0, course, speed, seconds)
    return circle, (0.0, np.pi / 2, pole - np.pi / 2, 0.0)


def distance_from(circle, time):
    """Distance from (40° N, 0°) and from the point opposite, on the mean sphere, written out here."""
    state = circle.state(time)
    lat, lon, pole = state.latitude, state.longitude, np.deg2rad(40.0)
    cosine = np.sin(lat) * np.sin(pole) + np.cos(lat) * np.cos(pole) * np.cos(lon)
    return 6371e3 * np.arccos(np.abs(cosine))


@pytest.mark.parametrize("algorithm", ["quaternion", "functional-iteration", "rotation-vector-2"])
@pytest.mark.parametrize(("metres", "rate"), [(0.0, 100.0), (2.0, 100.0), (97.0, 100.0), (1500.0, 10.0)])
def test_transverse_frame_fails_near_its_routes_pole_and_says_when(algorithm, metres, rate):
    """It was 451 km wrong at 2 m and said nothing."""
    circle, route = past_the_pole(metres)
    with pytest.raises(RunError, match=r"within .* m of its route's pole at 40\.0000°, 0\.0000°") as error:
        navigate(circle.increments(rate), circle.state(0.0), frame="transverse", algorithm=algorithm, route=route)
    found = error.value.time
    step = (2 if algorithm == "rotation-vector-2" else 1) / rate
    limit = 200.0 * step / 0.005
    before, there = distance_from(circle, np.array([found - step, found]))
    assert there <= limit * (1 + 1e-5) < before * (1 + 2e-5)
    assert f"at t = {found:.2f} s" in str(error.value)


@pytest.mark.parametrize("algorithm", ["quaternion", "functional-iteration"])
@pytest.mark.parametrize(("metres", "rate", "bar"), [(410.0, 100.0, 2.1e-3), (4100.0, 10.0, 2.1e-2)])
def test_transverse_frame_is_right_as_near_to_its_routes_pole_as_it_goes(algorithm, metres, rate, bar):
    """At the limit, 0.005 rad in a step, the position loses a thousandth of the way of one step, 2 m and 20 m."""
    circle, route = past_the_pole(metres)
    imu = circle.increments(rate)
    height = circle.state(imu.time).height
    options = {"algorithm": algorithm, "vertical": "truth", "height": height}
    assert miss(circle, navigate(imu, circle.state(0.0), frame="transverse", route=route, **options)) < bar


def test_transverse_frame_at_rest_on_its_routes_pole():
    """No speed, no limit, but at the pole itself the frame has no direction at all."""
    circle, route = past_the_pole(0.0, speed=0.0, seconds=1.0)
    with pytest.raises(RunError, match="route's pole"):
        navigate(circle.increments(50.0), circle.state(0.0), frame="transverse", route=route)


@pytest.mark.parametrize("frame", ["wander", "free-azimuth"])
@pytest.mark.parametrize("options", [{}, {"rates_hz": (100.0, 50.0, 50.0)}, {"algorithm": "functional-iteration"}])
def test_the_azimuth_at_the_start_turns_the_axes_and_nothing_else(s_turn, frame, options):
    """No rule for the azimuth depends on the azimuth, so the difference stays as it was; the motion is the same."""
    north, turned = run(s_turn, frame=frame, **options), run(s_turn, frame=frame, azimuth=2.5, **options)
    assert turned.azimuth[0] == 2.5
    off = np.mod(turned.azimuth - north.azimuth - 2.5 + np.pi, 2.0 * np.pi) - np.pi
    assert np.max(np.abs(off)) < 1e-9
    distance, speed, angle = apart(north, turned)
    assert distance < 1e-5
    assert speed < 1e-7
    assert angle < 1e-5 * ARCSEC


# --- the azimuth's rule --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speed", "latitude_deg"),
    [
        (0.0, 60.0),
        (250.0, -75.0),
        *slow((0.0, -75.0), (0.0, -20.0), (0.0, 10.0), (250.0, -20.0), (250.0, 10.0), (250.0, 60.0)),
    ],
)
def test_a_free_azimuth_turns_against_north_by_earth_rate_and_longitude(latitude_deg, speed):
    """Counted from north, clockwise: (ω_ie + λ̇) sin φ, counter-clockwise as in the chapter −(ω_ie + λ̇) sin φ.

    A solution in north, east and down does not tell: any azimuth will do, as long as the engine knows it. So the rate
    that the engine takes is integrated here along a parallel, and the x axis is looked at from the stars.
    """
    omega, lat, height = 7.292115e-5, np.deg2rad(latitude_deg), 9000.0
    a, e2 = 6378137.0, 6.69437999014e-3
    r1, r2 = a * (1 - e2) / (1 - e2 * np.sin(lat) ** 2) ** 1.5, a / np.sqrt(1 - e2 * np.sin(lat) ** 2)
    rate = speed / ((r2 + height) * np.cos(lat))
    k2, kappa = 1 / (r2 + height), (1 / (r1 + height) - 1 / (r2 + height)) / np.cos(lat) ** 2
    azimuth, lon, dt, start = 0.7, 0.2, 10.0, None
    for k in range(361):
        c, s = np.cos(azimuth), np.sin(azimuth)
        sky = lon + omega * dt * k  # longitude among the stars
        north = np.array([-np.sin(lat) * np.cos(sky), -np.sin(lat) * np.sin(sky), np.cos(lat)])
        east, up = np.array([-np.sin(sky), np.cos(sky), 0.0]), np.cross(north, [-np.sin(sky), np.cos(sky), 0.0])
        x = c * north + s * east
        start = (x, up) if start is None else start
        k = np.cos(lat) * c, -np.cos(lat) * s, -np.sin(lat)
        place = Place(k, (1.0, 0.0, 0.0), 0.0, k2, kappa, 0.0, 9.8)
        wx, wy, wz = transport_k(FREE_AZIMUTH, omega, place, (speed * s, speed * c, 0.0))
        # of the frame against north: the north frame itself turns by −λ̇ sin φ about down
        turning = wz + rate * np.sin(lat)
        assert turning == pytest.approx((omega + rate) * np.sin(lat), rel=1e-9)
        assert np.hypot(wx, wy) == pytest.approx(speed * k2, rel=1e-9, abs=1e-15)  # and the level by v/(R + h)
        azimuth, lon = azimuth + turning * dt, lon + rate * dt
    # after an hour the azimuth has gone by the closed form, against the stars by nothing: moved along with the vertical
    assert azimuth - 0.7 == pytest.approx((omega + rate) * np.sin(lat) * 3610.0, rel=1e-9)
    swept = np.array(carried_along_a_parallel(start[0], lat, 0.2, (omega + rate) * 3600.0))
    assert np.arccos(np.clip(swept @ x, -1, 1)) < 1e-6


def carried_along_a_parallel(x, lat, sky, angle, steps=2000):
    """A horizontal vector carried from place to place among the stars without any turn about the vertical."""
    for k in range(steps):
        middle = sky + angle * (k + 0.5) / steps
        up = np.array([np.cos(lat) * np.cos(middle), np.cos(lat) * np.sin(middle), np.sin(lat)])
        axis = np.array([0.0, 0.0, 1.0])
        turn = (axis - (axis @ up) * up) * (angle / steps)  # the turn of the vertical without its vertical part
        x = x + np.cross(turn, x) + 0.5 * np.cross(turn, np.cross(turn, x))
    return x / np.linalg.norm(x)
