"""The swaying vehicle against scipy's rotations, differences of its own states, and an independent integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenarios.support.swaying import Sway, Swaying
from sinssim import earth
from sinssim.errors import InputError
from sinssim.truth.motions.parked_and_great_circle import Parked
from tests.oracles import integrator as oracle

SWAYS = (
    Sway("roll", np.radians(0.5), 0.31, 0.2),
    Sway("roll", np.radians(0.1), 1.0, 1.0),
    Sway("pitch", np.radians(0.4), 0.13, 2.0),
    Sway("heading", np.radians(0.3), 0.47, 3.0),
    Sway("north", 0.01, 0.7, 0.0),
    Sway("east", 0.015, 0.4, 1.0),
    Sway("down", 0.02, 0.9, 4.0),
)
PLACE = (np.radians(50.0), np.radians(30.0), 120.0)
MEAN = (0.02, -0.05, 2.3)


@pytest.fixture(scope="module")
def vehicle():
    return Swaying(*PLACE, *MEAN, 20.0, SWAYS)


def test_state_is_the_sum_of_sinusoids(vehicle):
    t = np.linspace(0.0, 20.0, 41)
    state = vehicle.state(t)
    roll, pitch, heading = np.array(MEAN)[:, None] + np.array(
        [
            np.radians(0.5) * np.sin(2 * np.pi * 0.31 * t + 0.2) + np.radians(0.1) * np.sin(2 * np.pi * t + 1.0),
            np.radians(0.4) * np.sin(2 * np.pi * 0.13 * t + 2.0),
            np.radians(0.3) * np.sin(2 * np.pi * 0.47 * t + 3.0),
        ]
    )
    expected = Rotation.from_euler("ZYX", np.stack([heading, pitch, roll], axis=1))
    found = Rotation.from_quat(state.q_nb, scalar_first=True)
    # the local level itself turns by a displacement over the Earth's radius
    assert np.max((expected.inv() * found).magnitude()) < 0.03 / 6.3e6
    np.testing.assert_allclose(state.height - 120.0, -0.02 * np.sin(2 * np.pi * 0.9 * t + 4.0), rtol=0, atol=1e-8)
    np.testing.assert_allclose(
        state.velocity_ned[:, 2], 0.02 * 2 * np.pi * 0.9 * np.cos(2 * np.pi * 0.9 * t + 4.0), rtol=0, atol=1e-8
    )


def test_rates_and_forces_are_derivatives_of_the_states(vehicle):
    t, h = np.linspace(1.0, 19.0, 37), 1e-3
    omega, force = vehicle.rates(t)

    def inertial(instants):
        s = vehicle.state(instants)
        r = earth.ecef_to_eci(earth.geodetic_to_ecef(s.latitude, s.longitude, s.height), instants)
        c_ie = Rotation.from_rotvec(np.outer(instants, [0.0, 0.0, earth.OMEGA_IE]))
        c_en = Rotation.from_quat(earth.q_en(s.latitude, s.longitude), scalar_first=True)
        return r, c_ie * c_en * Rotation.from_quat(s.q_nb, scalar_first=True)

    (before, c0), (at, c), (after, c1) = (inertial(t + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose(omega, (c0.inv() * c1).as_rotvec() / (2 * h), rtol=0, atol=2e-7)  # O(h²)
    gravitation = earth.ecef_to_eci(earth.gravitation_ecef(earth.eci_to_ecef(at, t)), t)
    acceleration = (before - 2 * at + after) / h**2  # rounding: 1e-9 m / h²
    np.testing.assert_allclose(force, c.inv().apply(acceleration - gravitation), rtol=0, atol=8e-3)


def test_increments_integrate_to_the_states(vehicle):
    """An integrator that shares no code with the package comes back to the truth."""
    imu = vehicle.increments(200.0)
    start, end = vehicle.state(0.0), vehicle.state(imu.time[-1])
    c_en = Rotation.from_matrix(oracle.ned_axes(start.latitude, start.longitude)).inv()
    attitude = c_en * Rotation.from_quat(start.q_nb, scalar_first=True)
    position, velocity, c_eb = oracle.integrate(
        imu.time,
        imu.dtheta,
        imu.dvel,
        oracle.geodetic_to_ecef(start.latitude, start.longitude, start.height),
        c_en.apply(start.velocity_ned),
        attitude.as_quat(scalar_first=True),
    )
    to_ned = oracle.ned_axes(end.latitude, end.longitude)
    there = oracle.geodetic_to_ecef(end.latitude, end.longitude, end.height)
    np.testing.assert_allclose(to_ned @ (position[-1] - there), 0.0, rtol=0, atol=2e-7)
    np.testing.assert_allclose(to_ned @ velocity[-1], end.velocity_ned, rtol=0, atol=2e-8)
    turned = Rotation.from_matrix(to_ned @ c_eb[-1]).inv() * Rotation.from_quat(end.q_nb, scalar_first=True)
    assert turned.magnitude() < 1e-10


def test_without_sways_it_is_a_parked_vehicle():
    still = Swaying(*PLACE, *MEAN, 10.0, ())
    q_nb = Rotation.from_euler("ZYX", MEAN[::-1]).as_quat(scalar_first=True)
    parked = Parked(*PLACE, q_nb, 10.0)
    for mine, theirs in zip(still.rates(5.0), parked.rates(5.0), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"latitude": 1.6}, "within ±90°"),
        ({"duration": 0.0}, "duration = 0.0 must be"),
        (
            {"sways": (Sway("yaw", 0.1, 1.0),)},
            "unknown coordinate 'yaw' of a sway; known: roll, pitch, heading, north, east, down.",
        ),
        ({"sways": (Sway("roll", 0.1, np.nan),)}, "a sway's frequency_hz = nan"),
        ({"sways": (0.1, 0.2)}, "sways = (0.1, 0.2) must be a list of Sway(coordinate, …)."),
        ({"gravity": "moon"}, "moon"),
    ],
)
def test_mistakes_are_named(changes, text):
    names = ("latitude", "longitude", "height", "roll", "pitch", "heading")
    arguments = dict(zip(names, PLACE + MEAN, strict=True)) | {"duration": 10.0, "sways": ()} | changes
    with pytest.raises(InputError) as info:
        Swaying(**arguments)
    assert text in str(info.value)
