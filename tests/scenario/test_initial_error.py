"""The errors of a navigator's start: metres, m/s and arcminutes as geodesy and Euler angles have them."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import rotation
from sinssim.data import NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.scenario.navigation_section import InitialErrorSection, initial_state_with_errors

A, E2 = 6378137.0, 6.69437999014e-3
LATITUDE, HEIGHT = np.radians(60.0), 5000.0
ANGLES = np.radians([2.0, -3.0, 75.0])


def truth() -> NavState:
    return NavState(
        np.asarray(LATITUDE), np.asarray(0.3), np.asarray(HEIGHT), np.array([10.0, 20.0, -1.0]),
        rotation.quaternion_from_euler(*ANGLES),
    )  # fmt: skip


def test_given_errors() -> None:
    """1000 m north over R₁ + h, 2000 m east over (R₂ + h) cos φ; roll, pitch and heading differ by the given angles."""
    error = InitialErrorSection(
        north_m=1000.0, east_m=2000.0, height_m=30.0, velocity_north_mps=0.1, velocity_east_mps=-0.2,
        velocity_down_mps=0.3, roll_arcmin=6.0, pitch_arcmin=-12.0, heading_arcmin=30.0,
    )  # fmt: skip
    found = initial_state_with_errors(truth(), error, WGS84)
    root = 1.0 - E2 * np.sin(LATITUDE) ** 2
    assert found.latitude - LATITUDE == pytest.approx(1000.0 / (A * (1.0 - E2) / root**1.5 + HEIGHT), rel=1e-9)
    assert found.longitude - 0.3 == pytest.approx(2000.0 / ((A / root**0.5 + HEIGHT) * np.cos(LATITUDE)), rel=1e-9)
    assert found.height - HEIGHT == pytest.approx(30.0)
    np.testing.assert_allclose(found.velocity_ned - truth().velocity_ned, [0.1, -0.2, 0.3])
    off = np.degrees(np.array(rotation.euler_from_quaternion(found.q_nb)) - ANGLES)
    np.testing.assert_allclose(off, [0.1, -0.2, 0.5], atol=1e-9)


def test_random_errors_have_the_given_size() -> None:
    """Over 400 seeds the standard deviations are those given; their own error is 3.5 %, here five of it."""
    error = InitialErrorSection(
        position_sigma_m=50.0, height_sigma_m=20.0, velocity_sigma_mps=0.5, tilt_sigma_arcmin=2.0,
        heading_sigma_arcmin=60.0,
    )  # fmt: skip
    level = NavState(
        *(truth().latitude, truth().longitude, truth().height, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    )
    rows = []
    for seed in range(400):
        found = initial_state_with_errors(level, error, WGS84, seed)
        north, east = found.latitude - LATITUDE, (found.longitude - 0.3) * np.cos(LATITUDE)
        angles = np.degrees(rotation.rotation_vector_from_quaternion(found.q_nb)) * 60.0
        rows.append([6.4e6 * north, 6.4e6 * east, found.height - HEIGHT, *found.velocity_ned, *angles])
    sizes = np.std(rows, axis=0)
    wanted = [50.0, 50.0, 20.0, 0.5, 0.5, 0.5, 2.0, 2.0, 60.0]
    np.testing.assert_allclose(sizes, wanted, rtol=5.0 * 0.0354)
