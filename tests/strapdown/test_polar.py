"""Errors in transported axes, against vectors that are carried by the smallest rotation of the normals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim import earth
from sinssim.data import NavSolution, NavState
from sinssim.errors import InputError
from sinssim.strapdown.navigation_error import axes_along, axes_of, carried, navigation_error, turn_of_north
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from tests.oracles import integrator as oracle
from tests.oracles.transported import Array, smallest_rotation, wrong_by

PLACES = [(0.8, -2.0, 7000.0), (-1.2, 3.1, 0.0), (np.radians(89.999), 0.3, 9000.0), (0.5 * np.pi, 1.0, 100.0)]


def state(place: tuple[float, float, float], velocity: Array, attitude: Rotation) -> NavState:
    """Return a state as one row."""
    lat, lon, height = (np.array([value]) for value in place)
    return NavState(lat, lon, height, velocity[None], attitude.as_quat(scalar_first=True)[None])


def solution_at(s: NavState) -> NavSolution:
    """Return a state as a solution."""
    return NavSolution(np.zeros(1), s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, np.zeros(1), "any")


def test_north_turns_by_what_the_smallest_rotation_leaves() -> None:
    rng = np.random.default_rng(1)
    for far in (1e-6, 1e-2, 1.0):
        first = rng.standard_normal(3)
        second = first + far * rng.standard_normal(3)
        first, second = first / np.linalg.norm(first), second / np.linalg.norm(second)
        (lat0, lon0), (lat1, lon1) = ((np.arcsin(n[2]), np.arctan2(n[1], n[0])) for n in (first, second))
        carry = smallest_rotation(first, second).as_matrix()
        level = oracle.ned_axes(lat1, lon1) @ carry @ oracle.ned_axes(lat0, lon0).T
        psi = turn_of_north(*(np.array([a]) for a in (lat0, lon0, lat1, lon1)))[0]
        np.testing.assert_allclose(level, Rotation.from_euler("z", psi).as_matrix(), atol=1e-9)


def test_straight_over_the_pole_north_turns_round() -> None:
    """And a vector that is carried over it keeps its direction in space."""
    before = state((np.radians(89.99), 0.4, 0.0), np.array([100.0, 20.0, -1.0]), Rotation.identity())
    place = np.radians([89.98]), np.array([0.4 - np.pi]), np.zeros(1)
    after = carried(before, *place)
    np.testing.assert_allclose(after.velocity_ned[0], [-100.0, -20.0, -1.0], atol=1e-12)


@pytest.mark.parametrize("place", PLACES)
def test_errors_are_those_that_were_put_in(place: tuple[float, float, float]) -> None:
    """To the second order: 1 m across the distance from the Earth's centre, 1e-7 of what it is multiplied with."""
    rng = np.random.default_rng(2)
    velocity, attitude = np.array([200.0, -70.0, 3.0]), Rotation.random(random_state=3)
    truth = state(place, velocity, attitude)
    for _ in range(5):
        error = rng.standard_normal(9) * np.repeat((1.0, 0.1, 1e-3), 3)
        solution = solution_at(state(*wrong_by(place, velocity, attitude, error)))
        # the axes of the errors are those of the solution, which are carried from the true ones
        found = navigation_error(truth, solution, axes="transported")
        psi = turn_of_north(*truth_and(solution, truth))[0]
        back = Rotation.from_euler("z", -psi).as_matrix()
        np.testing.assert_allclose(back @ found.position_ned[0], error[:3], atol=2e-6)
        np.testing.assert_allclose(back @ found.velocity_ned[0], error[3:6], atol=1e-6)
        np.testing.assert_allclose(back @ found.attitude[0], error[6:9], atol=1e-8)


def truth_and(solution: NavSolution, truth: NavState) -> tuple[Array, Array, Array, Array]:
    """Return the two places."""
    return truth.latitude, truth.longitude, solution.latitude, solution.longitude


def test_far_from_the_poles_the_axes_hardly_matter() -> None:
    """They differ by the turn of north, tan φ/R times the error to the east."""
    velocity, attitude = np.array([200.0, -70.0, 3.0]), Rotation.from_euler("z", 1.0)
    error = np.array([30.0, 100.0, 5.0, 0.1, 0.2, 0.3, 1e-4, 2e-4, 3e-4])
    truth = state(PLACES[0], velocity, attitude)
    solution = solution_at(state(*wrong_by(PLACES[0], velocity, attitude, error)))
    north, level = (navigation_error(truth, solution, axes=axes) for axes in ("north", "transported"))
    psi = 100.0 * np.tan(PLACES[0][0]) / (earth.radii(PLACES[0][0])[1] + PLACES[0][2])
    np.testing.assert_allclose(north.attitude[0] - level.attitude[0], [0.0, 0.0, -psi], atol=2e-8)
    np.testing.assert_allclose(
        north.velocity_ned[0] - level.velocity_ned[0], psi * np.array([70.0, 200.0, 0.0]), atol=1e-5
    )


def test_axes_follow_from_frame_and_latitude() -> None:
    over = GreatCircle(np.radians(88.9), 0.0, 0.0, 0.0, 300.0, 60.0)
    assert axes_along("inertial", over.state, over.start, over.end) == "transported"
    assert axes_along("level", over.state, over.start, over.end) == "north"
    assert axes_of("wander", np.radians([10.0, 88.9])) == "north"
    assert axes_of("wander", np.radians([10.0]), np.radians([-89.1])) == "transported"
    truth = over.state(np.zeros(1))
    with pytest.raises(InputError, match="unknown axes of errors 'east'"):
        navigation_error(truth, solution_at(truth), axes="east")


def test_displaced_across_a_pole() -> None:
    """300 m along the tangent from 100 m before it: 200 m beyond it, on the other meridian."""
    lat = np.array([0.5 * np.pi - 100.0 / 6399593.6])
    there = earth.displaced(lat, np.array([0.3]), np.zeros(1), np.array([300.0]), np.zeros(1))
    np.testing.assert_allclose(6399593.6 * (0.5 * np.pi - there[0]), 200.0, rtol=1e-6)
    np.testing.assert_allclose(there[1], 0.3 - np.pi, atol=1e-9)
