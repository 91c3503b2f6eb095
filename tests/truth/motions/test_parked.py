"""A parked vehicle against published gravity, Earth rate in closed form, and an independent gravity field."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.errors import InputError
from sinssim.truth.motions.parked_and_great_circle import Parked
from tests.oracles import integrator as oracle

LEVEL = (1.0, 0.0, 0.0, 0.0)
HARD = Rotation.from_euler("ZYX", [200.0, -75.0, 120.0], degrees=True)  # C_nb


def independent_gravity_ned(latitude: float, longitude: float, height: float) -> np.ndarray:
    lat, lon = np.array(latitude), np.array(longitude)
    r = oracle.geodetic_to_ecef(lat, lon, np.array(height))
    g = np.array(oracle.gravitation(*r, oracle.ZONAL)) + oracle.OMEGA**2 * r * [1.0, 1.0, 0.0]
    return np.asarray(oracle.ned_axes(lat, lon) @ g)


@pytest.mark.parametrize(
    ("latitude_deg", "gravity"),
    # NIMA TR8350.2, table 3.4: theoretical gravity at the equator and the poles; Somigliana's formula at 45°
    [(0.0, 9.7803253359), (90.0, 9.8321849378), (-90.0, 9.8321849378), (45.0, 9.806197769373)],
)
def test_level_reads_normal_gravity_and_earth_rate(latitude_deg: float, gravity: float) -> None:
    latitude = np.radians(latitude_deg)
    parked = Parked(latitude, 0.5, 0.0, LEVEL, 10.0)
    omega, force = parked.rates(5.0)
    assert np.abs(force - [0.0, 0.0, -gravity]).max() < 1e-10
    w = oracle.OMEGA
    assert np.abs(omega - [w * np.cos(latitude), 0.0, -w * np.sin(latitude)]).max() < 1e-19


@pytest.mark.parametrize("latitude_deg", [-90.0, -37.0, 0.0, 62.0, 90.0])
def test_any_attitude_at_height(latitude_deg: float) -> None:
    latitude, height = np.radians(latitude_deg), 8000.0
    parked = Parked(latitude, -2.0, height, HARD.as_quat(scalar_first=True), 10.0)
    omega, force = parked.rates([0.0, 10.0])
    expected = HARD.inv().apply(-independent_gravity_ned(latitude, -2.0, height))
    assert np.abs(force - expected).max() < 1e-13
    w = oracle.OMEGA * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    assert np.abs(omega - HARD.inv().apply(w)).max() < 1e-19


def test_increments_are_constant() -> None:
    parked = Parked(0.9, 0.1, 100.0, HARD.as_quat(scalar_first=True), 3600.0)
    imu = parked.increments(100.0)
    omega, force = parked.rates(0.0)
    assert len(imu) == 360_000
    assert np.array_equal(imu.time, np.arange(360_001) / 100.0)
    assert np.all(imu.dtheta == omega / 100.0)
    assert np.all(imu.dvel == force / 100.0)


def test_state_is_what_was_given() -> None:
    q = HARD.as_quat(scalar_first=True)
    parked = Parked(np.pi / 2, 0.3, 20.0, q, 60.0)
    s = parked.state(np.linspace(0.0, 60.0, 7))
    assert np.all(s.latitude == np.pi / 2)
    assert np.all(s.longitude == 0.3)
    assert np.all(s.height == 20.0)
    assert np.all(s.velocity_ned == 0.0)
    assert s.q_nb.shape == (7, 4)
    assert np.abs(s.q_nb - q).max() < 2e-16
    assert parked.state(1.0).latitude.shape == ()


def test_lever_arm_and_mounting() -> None:
    """The block's place by vectors, and gravity there in its own axes."""
    mounting = Rotation.from_euler("ZYX", [-20.0, 4.0, 90.0], degrees=True)
    arm = np.array([30.0, -10.0, -5.0])
    latitude, longitude, height = 0.7, 2.0, 50.0
    parked = Parked(
        latitude,
        longitude,
        height,
        HARD.as_quat(scalar_first=True),
        60.0,
        arm,
        mounting.as_quat(scalar_first=True),
    )
    s = parked.state(0.0)
    c_en = oracle.ned_axes(np.array(latitude), np.array(longitude)).T
    place = oracle.geodetic_to_ecef(np.array(latitude), np.array(longitude), np.array(height))
    there = oracle.geodetic_to_ecef(s.latitude, s.longitude, s.height)
    assert np.abs(there - (place + c_en @ HARD.apply(arm))).max() < 3e-9
    c_es = c_en @ HARD.as_matrix() @ mounting.as_matrix()
    c_ns = oracle.ned_axes(s.latitude, s.longitude) @ c_es
    assert np.abs(oracle.matrix(s.q_nb) - c_ns).max() < 1e-15
    omega, force = parked.rates(0.0)
    gravity = independent_gravity_ned(float(s.latitude), float(s.longitude), float(s.height))
    assert np.abs(force + c_ns.T @ gravity).max() < 1e-13
    assert np.abs(omega - c_es.T @ [0.0, 0.0, oracle.OMEGA]).max() < 1e-19


def test_bad_input() -> None:
    with pytest.raises(InputError, match="latitude = 100°"):
        Parked(np.radians(100.0), 0.0, 0.0, LEVEL, 10.0)
    with pytest.raises(InputError, match=r"duration = 0\.0 must be one positive number, s"):
        Parked(0.0, 0.0, 0.0, LEVEL, 0.0)
    with pytest.raises(InputError, match="gravity model"):
        Parked(0.0, 0.0, 0.0, LEVEL, 1.0, gravity="flat")
    with pytest.raises(InputError, match="outside the trajectory"):
        Parked(0.0, 0.0, 0.0, LEVEL, 1.0).state(2.0)
