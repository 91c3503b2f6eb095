"""The start of a land vehicle from its course, of motions that are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import rotation
from sinssim.alignment.alignment_in_motion import align_by_course
from sinssim.alignment.initial_conditions import velocity_of_positions
from sinssim.data import ImuData, Measurements
from sinssim.sensors.imu.imu_errors import ImuErrors

REST_S, ACCELERATION, GRAVITY = 10.0, 1.0, 9.8


def test_the_start_from_rest_has_the_angles_of_the_slope() -> None:
    """Roll 5° and pitch 3° at rest, then 1 m/s² to 40°, on an Earth that does not turn."""
    angles = np.radians([5.0, 3.0, 40.0])
    q_nb = rotation.quaternion_from_euler(*angles)
    time = np.arange(0.0, 16.0 + 1e-9, 0.01)
    ahead = np.array([np.cos(angles[2]), np.sin(angles[2]), 0.0])
    moving = (time[1:] > REST_S + 1e-9)[:, np.newaxis]
    force_n = moving * ACCELERATION * ahead - [0.0, 0.0, GRAVITY]
    force = rotation.rotate(np.broadcast_to(rotation.conjugate(q_nb), (len(force_n), 4)), force_n)
    imu = ImuData(time, np.zeros_like(force), force * 0.01)
    fixes = np.arange(1.0, 16.0)
    sigma = np.full((len(fixes), 3), 0.02)
    place = np.broadcast_to([0.9, 0.2, 100.0], (len(fixes), 3))
    speed = np.maximum(fixes - REST_S, 0.0)[:, np.newaxis] * ACCELERATION * ahead
    position = Measurements("gnss-position", fixes, fixes, place, sigma)
    velocity = Measurements("gnss-velocity", fixes, fixes, speed, sigma)
    aligned = align_by_course(imu, position, velocity, ImuErrors(), angles_sigma=0.0)
    assert aligned.edge == 0
    assert not aligned.backwards
    np.testing.assert_allclose(rotation.euler_from_quaternion(aligned.state.q_nb), angles, atol=np.radians(0.02))


def test_differences_of_positions_are_velocities_at_their_middle() -> None:
    """Under constant acceleration the mean velocity of a span is that of its middle: 2 m/s² north, −1 m/s² up."""
    time = np.arange(0.0, 20.0)
    north, up = 1.0 * time**2, -0.5 * time**2
    value = np.column_stack((north / 6335439.327, np.full_like(time, 0.3), 50.0 + up))  # on the equator, R₁
    position = Measurements("gnss-position", time, time, value, np.full((len(time), 3), 0.01))
    found = velocity_of_positions(position)
    assert found is not None
    assert found.time[0] == pytest.approx(1.0)
    np.testing.assert_allclose(found.value[:, 0], 2.0 * found.time, rtol=1e-4)
    np.testing.assert_allclose(found.value[:, 2], found.time, rtol=1e-4)
    np.testing.assert_allclose(found.value[:, 1], 0.0, atol=1e-6)
    assert found.sigma[0, 0] == pytest.approx(0.01 * np.sqrt(2.0) / 2.0)  # two positions, 2 s apart
