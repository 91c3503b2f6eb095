"""Readings of the constraint, and the first course."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors.aiding.gnss import first_course
from sinssim.sensors.aiding.land_vehicle import land_velocity


def test_no_reading_where_tyres_slide() -> None:
    """A lateral specific force of 5 m/s² between 10 and 20 s; of the mean over half a second before each reading."""
    time = np.arange(3001) / 100.0
    force = np.tile((0.0, 0.0, -9.8), (3000, 1))
    force[1000:2000, 1] = -5.0
    imu = ImuData(time, np.zeros((3000, 3)), force / 100.0)
    found = land_velocity(imu, rate_hz=2.0, sigma=(0.1, 0.2), angles=(0.05, -0.1), lever_arm=(-1.0, 0.0, 0.3))
    slides = (found.time > 10.45) & (found.time < 20.05)
    assert not slides.any()
    np.testing.assert_allclose(found.time[:4], [0.5, 1.0, 1.5, 2.0])
    np.testing.assert_array_equal(found.value[0], [0.0, 0.0, 0.05, -0.1])
    np.testing.assert_array_equal(found.sigma[0], [0.1, 0.2])
    # a block that is turned by 90° measures it along its forward axis
    turned = land_velocity(imu, angles=(0.0, np.pi / 2.0))
    assert len(turned) == 60
    # 5 m/s² along (−sin ψ, cos ψ), the direction to the right of a vehicle whose block is turned by ψ = 0.5
    force[1000:2000, :2] = 5.0 * np.array([-np.sin(0.5), np.cos(0.5)])
    slid = land_velocity(ImuData(time, np.zeros((3000, 3)), force / 100.0), limit=4.9, angles=(0.0, 0.5))
    assert not ((slid.time > 11.0) & (slid.time < 19.0)).any()
    with pytest.raises(InputError, match=r"sigma has the shape \(3,\)"):
        land_velocity(imu, sigma=(0.1, 0.1, 0.1))


def test_the_first_course_and_its_uncertainty() -> None:
    """Three velocities of 3 m/s in a row from the fourth on, north-west, of which the first has 1σ of 0.4 m/s; without
    such ones, from 1σ over tan 10° on, or from a given speed on."""
    time, sigma = np.arange(8.0), 0.1 * np.arange(1.0, 9.0)
    north = np.array([0.0, 5.0, 0.0, 2.4, 3.0, 1.8, 1.8, 0.0])
    velocity = np.column_stack([north, -np.array([0.0, 5.0, 0.0, 1.8, 0.0, 2.4, 0.0, 0.0]), np.full(8, 9.0)])
    assert first_course(time, velocity, sigma) == (3, np.arctan2(0.4, 3.0))
    slow = velocity.copy()
    slow[4, 0] = 2.9  # 0.5 m/s over tan 10° is 2.84 m/s, 0.6 m/s over it 3.40 m/s
    assert first_course(time, slow, sigma) is None
    assert first_course(time, slow, np.full(8, 0.3)) == (3, np.arctan2(0.3, 3.0))
    assert first_course(time, slow, sigma, least=3.1) is None
    assert first_course(time, slow, sigma, least=1.5) == (3, np.arctan2(0.4, 3.0))
    assert first_course(time[:2], velocity[:2], sigma[:2]) is None
