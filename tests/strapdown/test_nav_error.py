"""Errors against displacements in closed form, scipy's rotations, and hard places: antimeridian and pole."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import NavSolution, NavState
from sinssim.errors import InputError
from sinssim.strapdown.navigation_error import NavError, navigation_error

A, F = 6378137.0, 1.0 / 298.257223563
E2 = F * (2.0 - F)


def state(latitude, longitude, height=0.0, velocity=(0.0, 0.0, 0.0), q=(1.0, 0.0, 0.0, 0.0)):
    return NavState(
        np.array([latitude]), np.array([longitude]), np.array([height]), np.array([velocity]), np.array([q])
    )


def error_of(truth: NavState, other: NavState) -> NavError:
    solution = NavSolution(
        np.array([0.0]),
        other.latitude,
        other.longitude,
        other.height,
        other.velocity_ned,
        other.q_nb,
        np.zeros(1),
        "quaternion",
    )
    return navigation_error(truth, solution)


@pytest.mark.parametrize("latitude_deg", [-60.0, 0.0, 37.0, 80.0])
@pytest.mark.parametrize("longitude_deg", [0.0, 179.9999, -179.9999])
def test_north_and_east_are_arcs_over_the_radii_of_curvature(latitude_deg, longitude_deg):
    lat, lon, h = np.radians(latitude_deg), np.radians(longitude_deg), 8000.0
    w2 = 1.0 - E2 * np.sin(lat) ** 2
    r1, r2 = A * (1.0 - E2) / w2**1.5, A / np.sqrt(w2)
    north, east = 30.0, -40.0
    shifted = lon + east / ((r2 + h) * np.cos(lat))
    shifted = (shifted + np.pi) % (2.0 * np.pi) - np.pi
    error = error_of(state(lat, lon, h), state(lat + north / (r1 + h), shifted, h + 7.0))
    # Second order in the displacement: 50 m squared over the Earth's radius times tan(latitude), below 3 mm.
    np.testing.assert_allclose(error.position_ned[0], [north, east, -7.0], rtol=0, atol=3e-3)
    assert error.horizontal[0] == pytest.approx(50.0, abs=3e-3)
    assert error.height[0] == pytest.approx(7.0, abs=1e-9)


def test_an_error_of_a_nanoradian_keeps_its_digits():
    lat, step = np.radians(50.0), 1e-9
    r1 = A * (1.0 - E2) / (1.0 - E2 * np.sin(lat) ** 2) ** 1.5
    error = error_of(state(lat, 0.3), state(lat + step, 0.3))
    assert error.position_ned[0, 0] == pytest.approx(r1 * ((lat + step) - lat), abs=3e-9)


def test_at_the_pole_a_metre_is_a_metre():
    r1_pole = A / np.sqrt(1.0 - E2)
    error = error_of(state(np.pi / 2, 0.0), state(np.pi / 2 - 1.0 / r1_pole, 2.0))
    assert error.horizontal[0] == pytest.approx(1.0, abs=1e-6)


def test_attitude_is_the_rotation_from_the_solution_to_the_truth():
    generator = np.random.default_rng(1)
    for _ in range(20):
        true, other = (Rotation.random(random_state=int(generator.integers(1 << 30))) for _ in range(2))
        q_true, q_other = (np.roll(r.as_quat(), 1) for r in (true, other))
        error = error_of(state(0.5, 0.5, q=q_true), state(0.5, 0.5, q=q_other))
        expected = (true * other.inv()).as_rotvec()
        np.testing.assert_allclose(error.attitude[0], expected, rtol=0, atol=1e-14)
        assert error.angle[0] == pytest.approx(np.linalg.norm(expected), abs=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_level_body_with_too_large_a_heading_has_a_negative_phi_down(sign):
    heading, excess = 1.2, 1e-5
    q_true, q_other = (np.roll(Rotation.from_euler("Z", h).as_quat(), 1) for h in (heading, heading + excess))
    error = error_of(state(0.5, 0.5, q=q_true), state(0.5, 0.5, q=sign * q_other))  # q and -q are one attitude
    np.testing.assert_allclose(error.attitude[0], [0.0, 0.0, -excess], rtol=0, atol=1e-16)


def test_velocity_is_solution_minus_truth():
    error = error_of(state(0.5, 0.5, velocity=(1.0, 2.0, 3.0)), state(0.5, 0.5, velocity=(1.5, 1.0, 5.0)))
    np.testing.assert_array_equal(error.velocity_ned[0], [0.5, -1.0, 2.0])
    assert error.speed[0] == pytest.approx(np.sqrt(0.25 + 1.0 + 4.0), rel=1e-15)


def test_truth_and_solution_must_have_the_same_rows():
    two = NavState(np.zeros(2), np.zeros(2), np.zeros(2), np.zeros((2, 3)), np.zeros((2, 4)))
    with pytest.raises(InputError, match=r"truth has \(2,\) rows"):
        error_of(two, state(0.0, 0.0))


def test_arguments_that_are_swapped_or_something_else():
    """They ended in an AttributeError."""
    true = state(0.5, 0.3)
    solution = NavSolution(
        np.zeros(1), true.latitude, true.longitude, true.height, true.velocity_ned, true.q_nb, np.zeros(1), "quaternion"
    )
    with pytest.raises(InputError, match=r"solution, the second argument .* is a NavState; .* a NavState, first and"):
        navigation_error(solution, true)
    with pytest.raises(InputError, match="truth, the first argument of navigation_error, is a NavSolution"):
        navigation_error(solution, solution)
    with pytest.raises(InputError, match=r"second argument .* is a NavState"):
        navigation_error(true, true)


def test_errors_in_some_rows():
    time = np.arange(4.0)
    position, velocity, attitude = (factor * np.arange(12.0).reshape(4, 3) for factor in (1.0, 10.0, 100.0))
    error = NavError(time, position, velocity, attitude)
    for part in (error.at(slice(1, 3)), error.rows(np.array([1, 2]))):
        assert part.time.tolist() == [1.0, 2.0]
        np.testing.assert_array_equal(part.position_ned, [[3.0, 4.0, 5.0], [6.0, 7.0, 8.0]])
        np.testing.assert_array_equal(part.velocity_ned, [[30.0, 40.0, 50.0], [60.0, 70.0, 80.0]])
        np.testing.assert_array_equal(part.attitude, [[300.0, 400.0, 500.0], [600.0, 700.0, 800.0]])
        np.testing.assert_allclose(part.horizontal, [5.0, np.sqrt(85.0)])
        np.testing.assert_array_equal(part.height, [-5.0, -8.0])
        np.testing.assert_allclose(part.speed, [10.0 * np.sqrt(50.0), 10.0 * np.sqrt(149.0)])
        np.testing.assert_allclose(part.angle, [100.0 * np.sqrt(50.0), 100.0 * np.sqrt(149.0)])
