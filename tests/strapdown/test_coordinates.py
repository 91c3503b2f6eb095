"""The same motion in the coordinates of each frame: against transformations written out with scipy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim import navigate
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth import WGS84
from sinssim.errors import InputError
from sinssim.strapdown.frames import FRAME_REGISTRY
from sinssim.strapdown.frames.route_pole import route_pole
from sinssim.strapdown.motion_coordinates import conditional, earth_fixed, inertial, level_axes
from sinssim.truth.motions.parked_and_great_circle import GreatCircle

TIME = np.linspace(3.0, 7203.0, 41)


def states(seed: int = 3) -> NavState:
    """Any places, velocities and attitudes, near a pole and the date line as well."""
    rng, count = np.random.default_rng(seed), len(TIME)
    q = rng.standard_normal((count, 4))
    latitude = rng.uniform(-1.57, 1.57, count)
    latitude[:2] = 1.5707, -1.5707
    return NavState(
        latitude,
        rng.uniform(-np.pi, np.pi, count),
        rng.uniform(-100.0, 20000.0, count),
        rng.uniform(-300.0, 300.0, (count, 3)),
        q / np.linalg.norm(q, axis=1, keepdims=True),
    )


def turn_en(latitude: Array, longitude: Array) -> Rotation:
    """North, east, down in Earth-fixed axes: columns of the matrix."""
    s, c, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    north = np.stack([-s * cl, -s * sl, c], axis=1)
    east = np.stack([-sl, cl, 0.0 * sl], axis=1)
    down = np.stack([-c * cl, -c * sl, -s], axis=1)
    return Rotation.from_matrix(np.stack([north, east, down], axis=2))


def turn_of(q: Array) -> Rotation:
    return Rotation.from_quat(q[:, [1, 2, 3, 0]])


def apart(q: Array, other: Rotation) -> float:
    """Largest angle between attitudes, rad."""
    return float((turn_of(q).inv() * other).magnitude().max())


def test_earth_fixed_and_inertial() -> None:
    s = states()
    n = WGS84.a / np.sqrt(1.0 - WGS84.e2 * np.sin(s.latitude) ** 2)
    parallel = (n + s.height) * np.cos(s.latitude)
    z = (n * (1.0 - WGS84.e2) + s.height) * np.sin(s.latitude)
    position = np.stack([parallel * np.cos(s.longitude), parallel * np.sin(s.longitude), z], axis=1)
    level = turn_en(s.latitude, s.longitude)
    fixed = earth_fixed(s)
    np.testing.assert_allclose(fixed.position, position, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(fixed.velocity, level.apply(s.velocity_ned), rtol=0.0, atol=1e-9)
    assert apart(fixed.q_eb, level * turn_of(s.q_nb)) < 1e-12
    free = inertial(s, TIME)
    earth = Rotation.from_rotvec(np.outer(WGS84.omega * (TIME - TIME[0]), (0.0, 0.0, 1.0)))
    carried = np.cross((0.0, 0.0, WGS84.omega), position)
    np.testing.assert_allclose(free.position, earth.apply(position), rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(free.velocity, earth.apply(level.apply(s.velocity_ned) + carried), rtol=0.0, atol=1e-9)
    assert apart(free.q_ib, earth * level * turn_of(s.q_nb)) < 1e-12
    assert apart(free.q_ib, Rotation.from_euler("ZYX", free.angles[:, ::-1])) < 1e-12


def test_the_absolute_velocity_is_the_derivative_of_the_inertial_position() -> None:
    """Central differences of the fourth order over 0.2 s: their error is below 1e-8 m/s, their rounding 1e-7."""
    flight = GreatCircle(0.8, 0.2, 9000.0, 1.0, 230.0, 3600.0)
    step, instants = 0.2, np.linspace(10.0, 3500.0, 7)
    grid = np.concatenate([[0.0], *(t + step * np.arange(-2, 3) for t in instants)])
    found = inertial(flight.state(grid), grid)
    around = found.position[1:].reshape(-1, 5, 3)
    slope = (around[:, 0] - 8.0 * around[:, 1] + 8.0 * around[:, 3] - around[:, 4]) / (12.0 * step)
    np.testing.assert_allclose(slope, found.velocity[1:].reshape(-1, 5, 3)[:, 2], rtol=0.0, atol=1e-6)


def test_conditional_coordinates_are_geographic_ones_after_the_pole_has_been_turned() -> None:
    """Turned until the route is the equator and starts at longitude zero, all is latitude, longitude, north and east
    of a sphere."""
    s = states(5)
    pole = route_pole((0.3, 0.4, 0.9, 1.9), 0.0, 0.0, np.zeros(3))
    found = conditional(s, pole, (0.3, 0.4))
    start = np.array([np.cos(0.3) * np.cos(0.4), np.cos(0.3) * np.sin(0.4), np.sin(0.3)])
    turned = Rotation.from_matrix(np.stack([start, np.cross(pole, start), pole]))
    up = -turn_en(s.latitude, s.longitude).apply((0.0, 0.0, 1.0))
    x, y, z = turned.apply(up).T
    np.testing.assert_allclose(found.latitude, np.arcsin(z), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.longitude, np.arctan2(y, x), rtol=0.0, atol=1e-12)
    level = turn_en(found.latitude, found.longitude)
    velocity = level.inv().apply(turned.apply(turn_en(s.latitude, s.longitude).apply(s.velocity_ned)))
    np.testing.assert_allclose(found.axes.velocity, velocity, rtol=0.0, atol=1e-9)
    q_wb = level.inv() * turned * turn_en(s.latitude, s.longitude) * turn_of(s.q_nb)
    heading = q_wb.as_euler("ZYX")[:, 0]
    assert np.abs(np.angle(np.exp(1j * (found.axes.heading - heading)))).max() < 1e-10  # near pitch 90° less is known


def test_along_the_route_the_conditional_latitude_is_zero_and_the_heading_90_degrees() -> None:
    """On a sphere: the great circle through normals is the flight's own."""
    angle = np.linspace(0.0, 1.2, 25)
    start, pole = np.array([0.0, 1.0, 0.0]), np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    ahead = np.cross(pole, start)
    up = np.outer(np.cos(angle), start) + np.outer(np.sin(angle), ahead)
    tangent = np.outer(np.cos(angle), ahead) - np.outer(np.sin(angle), start)
    latitude, longitude = np.arcsin(up[:, 2]), np.arctan2(up[:, 1], up[:, 0])
    velocity = 200.0 * turn_en(latitude, longitude).inv().apply(tangent)
    course = np.arctan2(velocity[:, 1], velocity[:, 0])
    q = np.stack([np.cos(0.5 * course), 0.0 * course, 0.0 * course, np.sin(0.5 * course)], axis=1)
    found = conditional(NavState(latitude, longitude, 0.0 * angle, velocity, q), pole)
    np.testing.assert_allclose(found.latitude, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.longitude, angle, atol=1e-12)
    np.testing.assert_allclose(found.axes.velocity, np.tile((0.0, 200.0, 0.0), (25, 1)), atol=1e-9)
    np.testing.assert_allclose(found.axes.heading, 0.5 * np.pi, atol=1e-12)


@pytest.fixture(scope="module")
def solutions() -> dict[tuple[str, str], NavSolution]:
    """Five minutes by two kinds of engine in every frame, on increments without errors."""
    flight = GreatCircle(1.2, 0.2, 9000.0, 1.0, 230.0, 300.0)
    imu, start = flight.increments(50.0), flight.state(0.0)
    found = {
        (algorithm, frame): navigate(imu, start, algorithm=algorithm, frame=frame)
        for algorithm in ("quaternion", "functional-iteration")
        for frame in FRAME_REGISTRY
    }
    for frame, entry in FRAME_REGISTRY.items():
        if entry.has_three_rates:
            found["three rates", frame] = navigate(imu, start, frame=frame, rates_hz=(50.0, 50.0, 50.0))
    return found


@pytest.mark.parametrize("frame", FRAME_REGISTRY)
def test_all_frames_agree_in_inertial_coordinates(solutions: dict[tuple[str, str], NavSolution], frame: str) -> None:
    """As they do in geodetic ones: to 0.01 mm after five minutes."""
    for algorithm in ("quaternion", "functional-iteration"):
        one, other = (inertial(s, s.time) for s in (solutions[algorithm, "level"], solutions[algorithm, frame]))
        assert np.abs(one.position - other.position).max() < 1e-5
        assert np.abs(one.velocity - other.velocity).max() < 1e-7
        assert apart(one.q_ib, turn_of(other.q_ib)) < 1e-10


@pytest.mark.parametrize("algorithm", ["quaternion", "functional-iteration", "three rates"])
def test_azimuth_of_the_frames(solutions: dict[tuple[str, str], NavSolution], algorithm: str) -> None:
    """Relative to north the azimuth grows by λ̇ sin φ in the frame that stands still on the Earth, and by the Earth's
    rate more in the one that stands still in space; in the transverse frame it is that of conditional north."""
    exact = 1e-8 if algorithm == "three rates" else 1e-9  # rates held over a step are of the second order
    for frame, rate in (("wander", 0.0), ("free-azimuth", WGS84.omega)):
        s = solutions[algorithm, frame]
        middle = np.sin(0.5 * (s.latitude[1:] + s.latitude[:-1]))  # midpoint rule: 1e-10 in 45 000 steps
        steps = middle * (np.diff(s.longitude) + rate * np.diff(s.time))
        assert s.azimuth is not None
        np.testing.assert_allclose(s.azimuth, np.append(0.0, np.cumsum(steps)), rtol=0.0, atol=exact)
    s = solutions[algorithm, "transverse"]
    pole = route_pole(None, float(s.latitude[0]), float(s.longitude[0]), s.velocity_ned[0])
    axes = conditional(s, pole).axes
    exact = exact if algorithm == "three rates" else 1e-12
    np.testing.assert_allclose(level_axes(s).azimuth, axes.azimuth, rtol=0.0, atol=exact)
    np.testing.assert_allclose(level_axes(s).velocity, axes.velocity, rtol=0.0, atol=300.0 * exact)
    assert solutions[algorithm, "level"].azimuth is None


def test_a_frame_without_azimuth_is_refused() -> None:
    with pytest.raises(InputError, match=r"no azimuth of its own: .* wander, free-azimuth or transverse"):
        level_axes(states())
