"""A weather balloon: times, speeds and drift by hand and by scipy, the line's pull, derivatives, closure, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from sinssim.earth import radii
from sinssim.errors import InputError
from sinssim.rotation.quaternions import euler_from_quaternion
from sinssim.scenario import load_scenario
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.balloon import BalloonMotion
from sinssim.units import G0
from tests.truth.test_independent_integration import closure

WIND = [[0.0, 4.0, 250.0], [2000.0, 15.0, 280.0], [5000.0, 30.0, 300.0]]
LOW: dict[str, Any] = {"burst_height_m": 6000.0, "fall_mps": 5.0, "ground_s": 10.0, "wind": WIND, "heading_deg": 20.0}


def balloon(**keys: Any) -> BalloonMotion:
    return BalloonMotion.model_validate({"type": "balloon", **keys})


def test_it_rises_bursts_falls_and_lands() -> None:
    """By hand: the ascent takes h/c and half of both ramps, the descent ∫dh/V and half of its ramps."""
    section = balloon(**LOW)
    launch, top, land = section.instants
    assert top == pytest.approx(10.0 + 6000.0 / 5.0 + 5.0 + 1.0)
    fall, _ = quad(lambda h: 1.0 / (5.0 * np.exp(h / 14400.0)), 0.0, 6000.0)
    opening, landing = (2.0 * 5.0 * factor / (0.4 * G0) for factor in (np.exp(6000.0 / 14400.0), 1.0))
    assert land == pytest.approx(top + fall + 0.5 * (opening + landing))
    motion = section.motion()
    time = np.array([0.0, launch, 500.0, top, top + 200.0, land, land + 10.0])
    state = section.trajectory().state(time)  # above the ellipsoid, after a drift of 16 km to the south-east
    np.testing.assert_allclose(state.height[[0, 1, 3, 5, 6]], [0.0, 0.0, 6000.0, 0.0, 0.0], atol=0.1)
    assert state.velocity_ned[2, 2] == pytest.approx(-5.0, abs=0.01)
    assert state.velocity_ned[4, 2] == pytest.approx(5.0 * np.exp(state.height[4] / 14400.0), abs=0.01)
    np.testing.assert_allclose(motion.place(time)[1][[0, 1, 5, 6]], 0.0, atol=1e-12)


def test_it_drifts_with_the_wind() -> None:
    """In the middle of a layer S is ½; above the highest one the wind is constant; the drift by scipy's quadrature."""
    section = balloon(**LOW, swing_deg=0.0)
    motion = section.motion()
    middle, high = 15.0 + 3500.0 / 5.0, 15.0 + 5500.0 / 5.0
    from_280, from_300 = ([-v * np.cos(np.radians(c)), -v * np.sin(np.radians(c))] for v, c in ((15, 280), (30, 300)))
    _, velocity, _ = motion.place(np.array([middle, high]))
    np.testing.assert_allclose(velocity[0, :2], 0.5 * (np.array(from_280) + from_300), atol=1e-9)
    np.testing.assert_allclose(velocity[1, :2], from_300, atol=1e-9)
    edges = [0.0, 400.0, 1000.0, 1250.0, 2400.0]
    place = motion.place(np.array(edges))[0][:, :2]
    corners = motion.breaks
    for axis in range(2):
        for a, b, moved in zip(edges, edges[1:], np.diff(place[:, axis]), strict=False):
            inner = corners[(corners > a) & (corners < b)]
            whole, _ = quad(lambda t, axis=axis: motion.place(np.array([t]))[1][0, axis], a, b, points=inner, limit=400)
            assert moved == pytest.approx(whole, abs=1e-6)


def test_the_line_pulls_along_the_payload_and_the_swing_has_its_angle() -> None:
    section = balloon(**LOW, swing_deg=8.0)
    motion, time = section.motion(), np.linspace(0.0, section.duration_s, 3001)
    r, _, a = motion.place(time)
    attitude = Rotation.from_quat(motion.attitude(time), scalar_first=True)
    north, east = (float(of) for of in radii(np.radians(45.0)))
    vertical = np.column_stack([-r[:, 0] / north, -r[:, 1] / east, np.ones(len(r))])
    force = attitude.inv().apply(a - G0 * vertical)
    np.testing.assert_allclose(force[:, :2], 0.0, atol=1e-12)
    assert (force[:, 2] < -0.5 * G0).all()
    calm = balloon(**{**LOW, "wind": []}, swing_deg=8.0).motion()
    down = Rotation.from_quat(calm.attitude(np.array([600.0])), scalar_first=True).apply([0.0, 0.0, 1.0])[0]
    assert np.degrees(np.arccos(down[2])) == pytest.approx(8.0, abs=1e-4)
    swing = calm.place(np.array([600.0]))[0][0, :2]
    assert np.hypot(*swing) == pytest.approx(30.0 * np.tan(np.radians(8.0)))
    np.testing.assert_allclose(swing / np.hypot(*swing), down[:2] / np.hypot(*down[:2]), atol=1e-5)  # it hangs outwards


def test_places_rates_and_derivatives_agree() -> None:
    section = balloon(**LOW)
    motion, h = section.motion(), 1e-3
    launch, top, land = section.instants
    corners = [launch + 1.0, launch + 4.0, top - 1.5, top - 0.4, top + 1.0, top + 3.0, land - 1.0]
    time = np.concatenate([np.linspace(launch + 0.1, section.duration_s - 1.0, 61), corners])
    before, at, after = (motion.place(time + step) for step in (-h, 0.0, h))
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), at[1], atol=2e-6)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * h), at[2], atol=5e-6)
    first, last = (Rotation.from_quat(motion.attitude(time + step), scalar_first=True) for step in (-h, h))
    np.testing.assert_allclose((first.inv() * last).as_rotvec() / (2 * h), motion.rate(time), atol=2e-5)


def test_it_stands_level_and_closes() -> None:
    section = balloon(burst_height_m=500.0, ground_s=5.0, wind=[[0.0, 5.0, 90.0]], heading_deg=70.0)
    trajectory = section.trajectory()
    state = trajectory.state(np.array([0.0, 4.9]))
    assert np.abs(state.velocity_ned).max() == 0.0
    np.testing.assert_allclose(np.degrees(euler_from_quaternion(state.q_nb))[:, 0], [0.0, 0.0, 70.0], atol=1e-12)
    horizontal, attitude = closure(trajectory, 100.0)
    assert horizontal < 1e-5
    assert attitude < 1e-9


@pytest.mark.slow
def test_a_flight_of_two_hours_closes() -> None:
    """Its height is held by the true one, because free heights grow e-fold in 9.5 min."""
    motion = load_scenario("weather_balloon").motion
    assert motion is not None
    trajectory = motion.trajectory()
    imu = trajectory.increments(100.0)
    height = trajectory.state(imu.time).height
    solution = navigate(imu, trajectory.state(0.0), height=height, vertical="baro-loop")
    error = navigation_error(trajectory.state(solution.time), solution, trajectory.ellipsoid)
    assert error.horizontal[solution.time < 3600.0].max() < 1e-5
    assert error.horizontal.max() < 3e-5
    assert np.abs(error.attitude).max() < 1e-9


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"roll_deg": 3.0}, "roll_deg has no meaning for the payload of a balloon"),
        ({"wind": [[1000.0, 5.0, 0.0], [500.0, 5.0, 0.0]]}, "the heights of its layers must increase"),
        ({"wind": [[0.0, -5.0, 0.0]]}, "greater than or equal to 0"),
    ],
)
def test_balloons_that_make_no_sense(keys: dict[str, Any], said: str) -> None:
    with pytest.raises((InputError, ValueError), match=said):
        balloon(**keys)
