"""The linear error equations by cause: against the simulated loop in turns, and cause by cause alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim import NavState, rotation
from sinssim.data import Array
from sinssim.earth.ellipsoids import WGS84
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.sensor_set_readings import PlatformErrors
from sinssim.strapdown.gimballed_platform import Forces, inertial_forces, navigate_platform
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.strapdown.platform_theory import ACCELEROMETERS, GYROS, START, TORQUERS, errors_by_cause
from sinssim.units import ARCMIN, DEG_H, PPM, UG
from tests.oracles.s_turn import STurn

GYRO = ImuErrors(gyro=TriadErrors(bias=np.array([0.02, -0.03, 0.05]) * DEG_H))
ACCEL = ImuErrors(accel=TriadErrors(bias=np.array([50.0, -80.0, 30.0]) * UG, scale=np.full(3, 200.0 * PPM)))
TORQUER = PlatformErrors(np.array([300.0, -200.0, 400.0]) * PPM)


@pytest.fixture(scope="module")
def flight() -> tuple[Array, NavState, Forces]:
    turns = STurn(duration=1800.0, period=120.0).fly(10)
    truth = NavState(turns.latitude, turns.longitude, turns.height, turns.velocity_ned, turns.q_nb)
    return turns.time, truth, inertial_forces(turns.time, truth, "normal", WGS84)


@pytest.mark.parametrize("frame", ["level", "free-azimuth", "inertial"])
@pytest.mark.parametrize(
    ("cause", "errors", "platform", "north", "heading"),
    [
        (GYROS, GYRO, PlatformErrors(), 0.0, 0.0),
        (TORQUERS, ImuErrors(), TORQUER, 0.0, 0.0),
        (ACCELEROMETERS, ACCEL, PlatformErrors(), 0.0, 0.0),
        (START, ImuErrors(), PlatformErrors(), 500.0, 3.0 * ARCMIN),
    ],
    ids=["gyros", "torquers", "accelerometers", "start"],
)
def test_one_cause_in_s_turns(
    flight: tuple[Array, NavState, Forces],
    frame: str,
    cause: str,
    errors: ImuErrors,
    platform: PlatformErrors,
    north: float,
    heading: float,
) -> None:
    """1 % of the largest error; every other cause is zero but for the resolution of the readings at 10 Hz."""
    time, truth, forces = flight
    q0 = rotation.multiply(rotation.quaternion_from_euler(0.0, 0.0, heading), truth.q_nb[0])
    latitude = truth.latitude[0] + north / 6.37e6
    first = NavState(latitude, truth.longitude[0], truth.height[0], truth.velocity_ned[0], q0)
    options: dict[str, Any] = {"frame": frame, "vertical": "truth", "height": truth.height}
    solution = navigate_platform(time, forces, first, errors, platform, **options)
    found = errors_by_cause(truth, forces, solution, platform, WGS84)
    own = navigation_error(truth, solution).position_ned[np.searchsorted(time, found.time), :2]
    largest = np.abs(own).max()
    if frame == "inertial" and cause == TORQUERS:
        assert largest < 1e-3
        return
    assert largest > 10.0
    assert np.abs(found.total - own).max() < 0.01 * largest
    assert np.abs(found.position[cause] - own).max() < 0.01 * largest
    for other in {GYROS, TORQUERS, ACCELEROMETERS, START} - {cause}:
        assert np.abs(found.position[other]).max() < 1e-4 * largest
