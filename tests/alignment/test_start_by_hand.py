"""Starts from a few fixes and samples: place, speed, attitude, their 1σ and what is said of them, by hand."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim import earth
from sinssim.alignment.alignment_in_motion import (
    _block,
    _edges,
    _Fixes,
    _moved,
    _together,
    align_by_course,
    align_in_motion,
)
from sinssim.alignment.initial_conditions import _place, _resting, _speed, recorded_start, velocity_of_positions
from sinssim.data import ImuData, Measurements, NavState
from sinssim.earth.ellipsoids import OMEGA_IE, WGS84
from sinssim.errors import InputError, RunError
from sinssim.logs.log_settings import LogStart
from sinssim.logs.reference_solution import Reference
from sinssim.sensors import ImuErrors, TriadErrors
from tests.estimation.worlds import weaving

PLACE = (np.radians(60.0), np.radians(-20.0), 500.0)
# radii of the meridian and of the prime vertical at 60° of WGS-84
W = 1.0 - 6.69437999014e-3 * 0.75
R1, R2 = 6378137.0 * (1.0 - 6.69437999014e-3) / W**1.5, 6378137.0 / np.sqrt(W)
NORTH, EAST = R1 + 500.0, (R2 + 500.0) * 0.5


def at(*metres: tuple[float, float, float]) -> np.ndarray:
    """Return places so far north, east and down of `PLACE`."""
    return np.array([(PLACE[0] + n / NORTH, PLACE[1] + e / EAST, PLACE[2] - d) for n, e, d in metres])


def fixes(kind: str, time: Any, value: Any, sigma: Any) -> Measurements:
    time, value = np.asarray(time, dtype=float), np.asarray(value, dtype=float)
    return Measurements(kind, time, time + 0.1, value, np.broadcast_to(np.asarray(sigma, dtype=float), value.shape))


def test_velocities_from_positions() -> None:
    """Over two seconds or the next longer step, at their middle, of 1σ √2 σ/T, or of 0.3 m/T if that is less."""
    time = np.array([3.0, 4.0, 5.0, 7.5, 9.0])
    value = at(*((-2.0 * t, 3.0 * t, -1.5 * t) for t in time - 3.0))
    position = Measurements(
        "gnss-position", time, time, value, np.tile([0.1, 0.2, 0.5], (5, 1)), np.array([1.0, 2, 3]), "m8"
    )
    found = velocity_of_positions(position)
    assert found is not None
    np.testing.assert_allclose(found.time, [4.0, 5.75, 6.25])
    np.testing.assert_array_equal(found.arrival, found.time)
    np.testing.assert_allclose(found.value, np.tile([-2.0, 3.0, -1.5], (3, 1)), rtol=0, atol=1e-4)
    lasts = np.array([2.0, 3.5, 2.5])[:, None]
    np.testing.assert_allclose(found.sigma, np.array([0.1 * np.sqrt(2.0), 0.2 * np.sqrt(2.0), 0.3]) / lasts)
    assert (found.kind, found.name, found.lever_arm.tolist()) == ("gnss-velocity", "m8", [1.0, 2.0, 3.0])
    two = fixes("gnss-position", time[:2], value[:2], 1.0)
    assert velocity_of_positions(None) is velocity_of_positions(two) is None
    near = fixes("gnss-position", [3.0, 3.5, 4.5], value[:3], 1.0)
    assert velocity_of_positions(near) is None


def test_the_place_is_carried_back_from_the_first_fix() -> None:
    """Half a second at (4, −6, 2) m/s, and 3 m/s² that may act meanwhile."""
    position = fixes("gnss-position", [10.8, 11.8], at((0, 0, 0), (9, 9, 9)), [[0.2, 0.4, 0.6], [9, 9, 9]])
    velocity = fixes("gnss-velocity", [9.9, 11.1], [[40, 40, 40], [4, -6, 2]], 0.1)
    place, sigma = _place(LogStart(), position, velocity, 10.3)
    np.testing.assert_allclose(place, at((-2.0, 3.0, -1.0))[0], rtol=1e-11)
    np.testing.assert_allclose(sigma, np.hypot([0.6, 1.2, 1.8], 0.375))
    place, _ = _place(LogStart(), position, None, 10.3)
    np.testing.assert_allclose(place, PLACE, rtol=1e-15)
    place, _ = _place(LogStart(height_m=70.0), position, velocity, 10.3)
    np.testing.assert_allclose(place, (*at((-2.0, 3.0, 0.0))[0][:2], 70.0), rtol=1e-11)
    place, _ = _place(LogStart(latitude_deg=10.0, longitude_deg=30.0), position, velocity, 10.3)
    np.testing.assert_allclose(place, (np.radians(10.0), np.radians(30.0), 501.0), rtol=1e-12)
    place, sigma = _place(LogStart(latitude_deg=10.0, longitude_deg=30.0, height_m=-5.0), None, None, 0.0)
    np.testing.assert_allclose([*place, *sigma], [np.radians(10.0), np.radians(30.0), -5.0, 1.0, 1.0, 1.0])
    with pytest.raises(InputError) as info:
        _place(LogStart(), position, velocity, 8.7)
    assert str(info.value) == (
        "the first position comes 2.1 s after the start at t = 8.700 s: begin the run later (log.from_s = 10.800), or "
        "give log.start.latitude_deg, longitude_deg and height_m."
    )
    _place(LogStart(), position, velocity, 8.81)


def test_the_speed_is_that_of_the_nearest_fix() -> None:
    velocity = fixes(
        "gnss-velocity", [9.0, 10.5, 12.0], [[1, 2, 3], [4, -6, 2], [7, 8, 9]], [[1, 1, 1], [0.1, 0.3, 0.2], [2, 2, 2]]
    )
    speed, sigma = _speed(LogStart(), velocity, 10.1)
    assert (speed.tolist(), sigma) == ([4.0, -6.0, 2.0], pytest.approx(np.hypot(0.9, 1.2)))
    speed, sigma = _speed(LogStart(velocity_ned_mps=(1.0, 2.0, -3.0)), velocity, 10.1)
    assert (speed.tolist(), sigma) == ([1.0, 2.0, -3.0], 0.1)
    speed, sigma = _speed(LogStart(), None, 10.1)
    assert (speed.tolist(), sigma) == ([0.0, 0.0, 0.0], 1.0)


@pytest.mark.parametrize(("begin", "moves", "rests"), [
    (5.0, 12.0, 5.0), (5.0, 9.0, 2.0), (5.0, 8.9, 0.0), (5.0, 60.0, 30.0), (5.0, np.inf, 30.0), (80.0, np.inf, 18.0),
])  # fmt: skip
def test_rest_ends_two_seconds_before_the_first_motion(begin: float, moves: float, rests: float) -> None:
    time = np.arange(1.0, 100.05, 0.1)
    value = np.where(time[:, None] > moves - 0.05, [0.2, -0.2, 0.15], [0.2, -0.2, 0.05])  # 0.32 and 0.29 m/s
    assert _resting(fixes("gnss-velocity", time, value, 0.1), begin) == pytest.approx(rests, abs=1e-6)


def log_of(imu: ImuData, *measurements: Measurements, reference: Reference | None = None) -> Any:
    return SimpleNamespace(imu=imu, sensed=[SimpleNamespace(measurements=m) for m in measurements], reference=reference)


G60 = float(earth.gravity_ned(PLACE[0], PLACE[2], "normal", WGS84)[2])


def test_from_rest_the_heading_is_carried_back_from_the_first_course() -> None:
    """Level, with biases of the gyros; 0.5 rad to the right from 12 s to 14 s; at 15 s the course is 1.2 rad."""
    time = 5.0 + 0.1 * np.arange(201)
    since = time[1:] - 5.0
    rate = np.outer((since > 12.001) & (since < 14.001), [0.0, 0.0, 0.25]) + np.array([1e-3, 2e-3, -3e-3])
    imu = ImuData(time, rate * 0.1, np.tile([0.0, 0.0, -G60 * 0.1], (200, 1)))
    seconds = np.arange(20.0)
    speed = np.where(seconds < 12.0, 0.1, np.where(seconds < 15.0, 0.5, 4.0 + seconds / 10.0))
    velocity = fixes("gnss-velocity", 5.0 + seconds, np.outer(speed, [np.cos(1.2), np.sin(1.2), 0.0]), 0.05)
    position = fixes("gnss-position", 5.0 + seconds, np.tile(PLACE, (20, 1)), 1.5)
    found = recorded_start(log_of(imu, position, velocity), LogStart())
    q = Rotation.from_quat(found.state.q_nb, scalar_first=True)
    assert (q * Rotation.from_euler("z", 0.7).inv()).magnitude() < 1e-9
    assert found.words == (
        "Navigation starts at t = 5.000 s with roll and pitch from 10.0 s at rest, and the heading 40.1° from the "
        "course at t = 20.00 s."
    )
    assert (found.tilt, found.heading) == pytest.approx(np.radians([2.0, 10.0]))
    assert found.velocity == pytest.approx(0.15)
    np.testing.assert_allclose(found.position, 4.5)
    given = recorded_start(log_of(imu, position, velocity), LogStart(heading_deg=200.0, roll_deg=5.0, pitch_deg=-3.0))
    q = Rotation.from_quat(given.state.q_nb, scalar_first=True)
    assert (q * Rotation.from_euler("ZYX", [200.0, -3.0, 5.0], degrees=True).inv()).magnitude() < 1e-9
    assert given.words == "Navigation starts at t = 5.000 s with the given roll and pitch and the given heading."


def test_in_motion_the_acceleration_of_the_satellites_is_no_tilt() -> None:
    """(1.2, −0.7, 0.4) m/s² all the time, with roll 0.1, pitch −0.2 and a given heading of 30°."""
    attitude, a = Rotation.from_euler("ZYX", [np.radians(30.0), -0.2, 0.1]), np.array([1.2, -0.7, 0.4])
    imu = ImuData(
        5.0 + 0.1 * np.arange(51), np.zeros((50, 3)), np.tile(0.1 * attitude.inv().apply(a - [0, 0, G60]), (50, 1))
    )
    time = 4.5 + np.arange(7.0)
    velocity = fixes("gnss-velocity", time, np.array([10.0, 5.0, 0.0]) + np.outer(time, a), 0.05)
    position = fixes("gnss-position", [5.0], [PLACE], 1.0)
    found = recorded_start(log_of(imu, position, velocity), LogStart(heading_deg=30.0))
    assert (Rotation.from_quat(found.state.q_nb, scalar_first=True) * attitude.inv()).magnitude() < 1e-9
    assert found.words == (
        "Navigation starts at t = 5.000 s with roll and pitch from 1.0 s in motion and the given heading."
    )


def test_a_vehicle_upside_down_is_doubted() -> None:
    imu = ImuData(5.0 + 0.1 * np.arange(51), np.zeros((50, 3)), np.tile([0.0, 0.0, 0.1 * G60], (50, 1)))
    place = {"latitude_deg": 60.0, "longitude_deg": -20.0, "height_m": 500.0, "heading_deg": 30.0}
    assert recorded_start(log_of(imu), LogStart(**place)).words.endswith(
        " With the given axes the vehicle is upside down, with a roll of 180°: check log.imu.axes."
    )


def test_the_start_from_a_reference() -> None:
    """Its 1σ is at least 1 mm, and 0.1 m where it has none."""
    time = np.arange(11.0)
    q = np.tile(Rotation.from_euler("ZYX", [0.3, 0.2, 0.1]).as_quat(scalar_first=True), (11, 1))
    reference = Reference(
        "truth.csv", time, np.full(11, 0.7), np.full(11, 0.2), 100.0 + 2.0 * time, np.tile([1.0, 2.0, -2.0], (11, 1)),
        q, np.tile([1e-5, np.nan, 0.3], (11, 1)),
    )  # fmt: skip
    imu = ImuData(5.0 + 0.1 * np.arange(51), np.zeros((50, 3)), np.zeros((50, 3)))
    found = recorded_start(log_of(imu, reference=reference), LogStart())
    assert (found.state.latitude, found.state.height) == (pytest.approx(0.7), pytest.approx(110.0, abs=0.1))
    np.testing.assert_allclose(found.state.velocity_ned, [1.0, 2.0, -2.0])
    np.testing.assert_allclose(found.position, [1e-3, 0.1, 0.3])
    np.testing.assert_allclose([found.velocity, found.tilt, found.heading], [0.05, *np.radians([0.2, 1.0])])
    assert found.words == "Navigation starts from the reference truth.csv."


SIGMA = ImuErrors(TriadErrors(random_walk=3e-3), TriadErrors(bias=np.array([0.01, 0.049, 0.02])))


def test_by_course_in_motion() -> None:
    """The first clear course is (6, −8, 1) m/s at 7.3 s, ten times its 1σ; the climb is the pitch."""
    imu = ImuData(5.0 + 0.5 * np.arange(11), np.zeros((10, 3)), np.zeros((10, 3)))
    velocity = fixes("gnss-velocity", [4.0, 6.3, 7.3, 8.3], [[9, 9, 9], [1.1, 1.6, 0], [6, -8, 1], [20, 1, 1]],
                     [[0.1, 0.2, 0.3], [0.1, 0.2, 0.3], [0.1, 0.25, 0.3], [0.1, 0.2, 0.3]])  # fmt: skip
    position = fixes("gnss-position", [6.0, 8.0], at((0, 0, 0), (9, 9, 9)), [[9, 9, 9], [1, 2, 3]])
    found = align_by_course(imu, position, velocity, SIGMA, angles=(0.05, -0.1), angles_sigma=0.02)
    assert (found.edge, found.backwards, found.course_time) == (5, False, 7.3)
    assert not found.gyro_bias.any()
    vehicle = Rotation.from_euler("ZYX", [np.arctan2(-8.0, 6.0), np.arctan2(-1.0, 10.0), 0.0])
    block = vehicle * Rotation.from_euler("ZYX", [-0.1, 0.05, 0.0]).inv()
    assert (Rotation.from_quat(found.state.q_nb, scalar_first=True) * block.inv()).magnitude() < 1e-12
    np.testing.assert_array_equal(found.state.velocity_ned, [6.0, -8.0, 1.0])
    np.testing.assert_allclose([found.state.latitude, found.state.longitude, found.state.height], at((9, 9, 9))[0])
    tilt = np.hypot(np.radians(3.0), 0.02) ** 2
    heading = np.radians(3.0) ** 2 + 0.025**2 + 0.02**2
    moved = 0.25 * 101.0  # half a second at that speed
    expected = [1.0 + moved, 4.0 + moved, 9.0 + moved, 0.01, 0.0625, 0.09, tilt, tilt, heading]
    np.testing.assert_allclose(found.covariance, np.diag(expected), rtol=1e-12)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_by_course_from_rest(way: float) -> None:
    """Roll 0.1 and pitch −0.05 at rest until 11 s; 0.4 rad to the right, then 2 m/s² ahead or back, 8 m/s at 20 s."""
    level = Rotation.from_euler("ZYX", [0.0, -0.05, 0.1])
    step, time = 0.1, 5.0 + 0.1 * np.arange(171)
    since = time[1:] - 5.0 - 0.5 * step
    bias = np.array([1e-3, -2e-3, 3e-3])
    yaw = 0.4 * np.clip((time - 18.0 + 3.0) / 1.0, 0.0, 1.0)  # from 15 s to 16 s
    attitude = [Rotation.from_euler("z", angle) * level for angle in yaw]
    turn = np.array([(a.inv() * b).as_rotvec() for a, b in pairwise(attitude)])
    ahead = np.array([np.cos(0.4), np.sin(0.4), 0.0]) * np.cos(0.05)
    force = np.outer((since > 12.0) * 2.0 * way, ahead) - [0.0, 0.0, 9.8]
    dvel = step * np.array([a.inv().apply(f) for a, f in zip(attitude[1:], force, strict=True)])
    fix = 5.0 + np.arange(17.0)
    speed = np.where(fix <= 12.0, 0.02, np.where(fix < 20.0, 0.6, 8.0))
    velocity = fixes("gnss-velocity", fix, np.outer(speed, [np.cos(2.5), np.sin(2.5), 0.0]), [0.1, 0.05, 0.2])
    position = fixes("gnss-position", fix, np.tile(PLACE, (17, 1)), [1.0, 2.0, 3.0])
    found = align_by_course(ImuData(time, turn + bias * step, dvel), position, velocity, SIGMA, angles_sigma=0.02)
    assert (found.edge, found.course_time, found.backwards) == (0, 20.0, way < 0.0)
    np.testing.assert_allclose(found.gyro_bias, bias, rtol=1e-9)
    heading = 2.5 - 0.4 + (np.pi if way < 0.0 else 0.0)
    expected = Rotation.from_euler("z", heading) * level
    assert (Rotation.from_quat(found.state.q_nb, scalar_first=True) * expected.inv()).magnitude() < 2e-3
    course = np.hypot(np.radians(3.0), 0.1 / 8.0)
    lasting = 6.9  # of the samples before the last fix at rest, at 12 s
    drift = np.hypot(3e-3 / np.sqrt(lasting), 1e-4) * (20.0 - 12.0)
    variances = [1.0, 4.0, 9.0, *[0.05**2] * 3, *[0.005**2] * 2, course**2 + 0.02**2 + drift**2]
    np.testing.assert_allclose(found.covariance, np.diag(variances), rtol=1e-9)
    assert not found.state.velocity_ned.any()


def test_no_course_is_clear() -> None:
    imu = ImuData(5.0 + 0.5 * np.arange(11), np.zeros((10, 3)), np.zeros((10, 3)))
    position = fixes("gnss-position", [6.0], [PLACE], 1.0)
    velocity = fixes("gnss-velocity", [4.0, 6.0, 7.0], [[9, 9, 0], [0.6, 0.79, 5.0], [0.3, 0.4, 0]], 0.05)
    with pytest.raises(RunError) as info:
        align_by_course(imu, position, velocity, SIGMA)
    assert str(info.value) == (
        "alignment by the course from t = 5 s to 10 s: the vehicle moves with 0.992 m/s at most, and a course needs 1 "
        "m/s and 10 times the 1σ of the velocity. A longer alignment, until it moves, is needed."
    )


def test_fixes_of_an_alignment_in_motion() -> None:
    """Nearest velocity less than half a second from each position; positions are carried on to its instant."""
    position, velocity = np.array([1.0, 2.0, 3.0, 4.6, 5.0]), np.array([0.7, 1.8, 2.7, 3.7, 5.4])
    rows = _together(position, velocity)
    assert [part.tolist() for part in rows] == [[0, 1, 2, 4], [0, 1, 2, 4]]
    often = _together(np.arange(0.0, 3.0, 0.25), np.array([0.5, 1.5, 2.5]))  # of many positions the nearest
    assert [part.tolist() for part in often] == [[2, 6, 10], [0, 1, 2]]
    assert [len(part) for part in _together(np.zeros(0), velocity)] == [0, 0]
    moved = _moved(
        at((0, 0, 0), (1, 1, 1)), np.array([[4.0, -6.0, 2.0], [5.0, 5.0, 5.0]]), np.array([-0.5, 0.0]), WGS84
    )
    np.testing.assert_allclose(moved, at((-2.0, 3.0, -1.0), (1, 1, 1)), rtol=0, atol=1e-12)
    imu = ImuData(np.array([1.0, 2.0, 3.0]), np.tile([0.1, -0.2, 0.3], (2, 1)), np.zeros((2, 3)))
    arm, q_nb = np.array([2.0, -1.0, 3.0]), Rotation.from_euler("ZYX", [0.7, 0.2, -0.1])
    speed = np.array([[30.0, 20.0, -5.0]])
    made = _Fixes(np.array([1.4]), np.array([PLACE]), speed, speed, arm, np.array([1.0, 0, 0, 0]))
    assert _edges(imu, made).tolist() == [0]
    found = _block(imu, made, q_nb.as_quat(scalar_first=True), 1.25, WGS84)
    off = -q_nb.apply(arm) - 0.15 * speed[0]
    np.testing.assert_allclose([found.latitude, found.longitude, found.height], at(tuple(off))[0], rtol=0, atol=1e-5)
    np.testing.assert_allclose((found.latitude - PLACE[0]) * NORTH, off[0], rtol=0, atol=1e-4)
    np.testing.assert_allclose((found.longitude - PLACE[1]) * EAST, off[1], rtol=0, atol=1e-4)
    spin = OMEGA_IE * q_nb.inv().apply([np.cos(PLACE[0]), 0.0, -np.sin(PLACE[0])])
    expected = speed[0] - q_nb.apply(np.cross([0.1, -0.2, 0.3] - spin, arm))
    np.testing.assert_allclose(found.velocity_ned, expected, rtol=1e-9)
    assert isinstance(found, NavState)


def test_what_an_alignment_in_motion_needs() -> None:
    time = np.arange(1.0, 61.0)
    position = fixes("gnss-position", time, np.tile(PLACE, (60, 1)), [1.0, 2.0, 3.0])
    velocity = fixes("gnss-velocity", time, np.tile([50.0, 10.0, 0.0], (60, 1)), 0.1)
    imu = ImuData(0.5 * np.arange(125), np.zeros((124, 3)), np.tile([0.0, 0.0, -0.5 * G60], (124, 1)))
    with pytest.raises(InputError) as info:
        align_in_motion(imu, velocity, velocity, SIGMA)
    assert str(info.value) == "alignment in motion needs measurements of kind 'gnss-position', not 'gnss-velocity'."
    short = ImuData(imu.time[:80], imu.dtheta[:79], imu.dvel[:79])  # to 39.5 s
    with pytest.raises(InputError) as info:
        align_in_motion(short, position, velocity, SIGMA)
    assert str(info.value) == (
        "alignment in motion has 39 times with position and velocity over 38 s within the inertial data; at least 40 s "
        "of them are needed."
    )


def test_the_start_in_motion_is_three_times_as_wide_as_the_alignment() -> None:
    flight, ideal = weaving(100.0, 20.0)
    time = np.arange(0.5, 60.1, 0.5)
    state = flight.state(time)
    value = np.column_stack([state.latitude, state.longitude, state.height])
    position = fixes("gnss-position", time, value, [1.0, 2.0, 3.0])
    velocity = fixes("gnss-velocity", time, state.velocity_ned, [0.1, 0.2, 0.3])
    sigma = ImuErrors(TriadErrors(random_walk=1e-6), TriadErrors(random_walk=1e-4))
    imu = ImuData(ideal.time[:1401], ideal.dtheta[:1400], ideal.dvel[:1400])
    found = align_in_motion(imu, position, velocity, sigma)
    assert found.edge == 10
    np.testing.assert_allclose(np.diag(found.covariance)[:6], 9.0 * np.array([1.0, 4.0, 9.0, 0.01, 0.04, 0.09]))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)[6:]), 3.0 * found.sigma)
    assert not found.covariance[:6, 6:].any()
    turned = (
        Rotation.from_quat(found.state.q_nb, scalar_first=True)
        * Rotation.from_quat(state.q_nb[0], scalar_first=True).inv()
    )
    assert turned.magnitude() < 1e-3
    assert found.residual < 0.02
    np.testing.assert_allclose(found.state.velocity_ned, state.velocity_ned[0], rtol=0, atol=1e-9)
    np.testing.assert_allclose([found.state.latitude, found.state.longitude], value[0, :2], rtol=0, atol=1e-12)
