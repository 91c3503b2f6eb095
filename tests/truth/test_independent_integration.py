"""Exported increments, integrated by code that shares nothing with the package, lead back to the exported truth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import fly
from sinssim.truth import Trajectory
from sinssim.truth.curve import Curve
from tests.oracles import integrator as oracle
from tests.slow import slow
from tests.truth.motions import ecef, synthetic_flight


def closure(trajectory: Trajectory, rate_hz: float) -> tuple[float, float]:
    """Return the greatest horizontal difference, m, and attitude difference, rad."""
    imu = trajectory.increments(rate_hz)
    position, velocity, c_es = ecef(trajectory, imu.time)
    q0 = Rotation.from_matrix(c_es[0]).as_quat(scalar_first=True)
    r, _, c = oracle.integrate(imu.time, imu.dtheta, imu.dvel, position[0], velocity[0], q0)
    s = trajectory.state(imu.time)
    ned = np.einsum("nij,nj->ni", oracle.ned_axes(s.latitude, s.longitude), r - position)
    turn = Rotation.from_matrix(np.swapaxes(c_es, 1, 2) @ c)
    return float(np.hypot(ned[:, 0], ned[:, 1]).max()), float(turn.magnitude().max())


def smooth(duration: float) -> Curve:
    time = np.arange(round(duration * 30.0) + 1) / 30.0
    return Curve(time, *synthetic_flight(time), (10.5, 0.0, 0.8))


def airliner(duration: float, turbulence: bool) -> Trajectory:
    """A 737 that climbs, turns, flies a circle, and goes straight on."""
    legs = [
        {"type": "climb", "altitude_m": 7000.0},
        {"type": "turn", "heading_deg": 160.0},
        {"type": "turn", "angle_deg": 360.0, "direction": "left"},
        {"type": "hold", "until_s": duration},
    ]
    start = {
        "on": "air",
        "latitude_deg": 50.0,
        "longitude_deg": 30.0,
        "altitude_m": 6700.0,
        "heading_deg": 70.0,
        "airspeed_kt": 280.0,
    }
    air = {"turbulence": {"severity": 4}} if turbulence else {}
    flight = {"aircraft": "737", "start": start, "legs": legs, **air}
    return fly(Scenario.model_validate({"name": "test", "seed": 3, "flight": flight}))


@pytest.mark.slow
def test_smooth_flight_of_ten_minutes() -> None:
    horizontal, attitude = closure(smooth(600.0), 100.0)
    assert horizontal < 1e-6
    assert attitude < 1e-11


@pytest.mark.parametrize("turbulence", [*slow(False), True])
def test_airliner_for_ten_minutes(turbulence: bool) -> None:
    horizontal, attitude = closure(airliner(600.0, turbulence), 100.0)
    assert horizontal < 1e-4
    assert attitude < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("turbulence", [*slow(False), True])
def test_airliner_for_an_hour(turbulence: bool) -> None:
    """The bar is 0.005 m; the independent integrator comes ten times nearer."""
    horizontal, attitude = closure(airliner(3600.0, turbulence), 100.0)
    assert horizontal < 5e-4
    assert attitude < 5e-10


@pytest.mark.slow
def test_smooth_flight_of_an_hour() -> None:
    horizontal, attitude = closure(smooth(3600.0), 100.0)
    assert horizontal < 1e-4
    assert attitude < 1e-11
