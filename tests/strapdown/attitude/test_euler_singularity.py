"""Euler angles through the vertical: found, timed, measured, and the run goes on."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import ImuData, NavState, navigate
from tests.oracles.turntable import spin, turn


def loop(bank, rate=0.5, duration=10.0):
    """A pitching motion that passes ±90° at a distance of the bank angle."""
    return turn(spin(np.array([0.0, rate, 0.0]), np.array([np.cos(bank / 2), np.sin(bank / 2), 0, 0])), duration, 100)


def run(flight, algorithm):
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    return navigate(imu, first, algorithm=algorithm, gravity="somigliana", vertical="truth", height=flight.height)


@pytest.mark.parametrize("bank", [0.0, 1e-3, 0.02])
def test_a_passage_is_reported_with_time_and_damage(bank):
    flight = loop(bank)
    solution = run(flight, "euler")
    assert len(solution.events) == 2  # up at 90°, down at 270°
    for event, middle in zip(solution.events, (np.pi, 3 * np.pi), strict=True):
        assert event.start < middle < event.end
        # within 5° of the vertical: 2·5°/0.5 rad/s = 0.35 s, and a sample on either side
        assert event.end - event.start == pytest.approx(2 * np.deg2rad(5) / 0.5, abs=0.04)
        assert f"{event.start:.2f} s" in event.text
        assert "euler" in event.text
    first = solution.events[0]
    # the damage is the attitude error that the passage added, as the truth knows it
    error = flight.attitude_error(solution.q_nb)
    before, after = (int(np.searchsorted(flight.time, t)) for t in (first.start, first.end))
    assert first.damage == pytest.approx(error[after], abs=error[before] + 1e-9)
    assert np.all(np.isfinite(solution.q_nb))
    assert np.all(np.isfinite(solution.velocity_ned))
    np.testing.assert_allclose(np.linalg.norm(solution.q_nb, axis=1), 1, atol=1e-15, rtol=0)


def test_the_nearer_the_worse():
    damages = [run(loop(bank, duration=5.0), "euler").events[0].damage for bank in (1e-3, 1e-2, 0.05)]
    assert damages[0] > 1e-3  # 3 arcmin and more at 0.06°
    assert damages[0] > 100 * damages[1] > 1e4 * damages[2]


@pytest.mark.parametrize("algorithm", ["quaternion", "poisson"])
def test_the_others_have_no_singularity(algorithm):
    flight = loop(1e-3)
    solution = run(flight, algorithm)
    assert solution.events == ()
    assert np.max(flight.attitude_error(solution.q_nb)) < 1e-10


def test_a_banked_turn_is_not_a_passage():
    assert run(loop(0.3), "euler").events == ()  # 17° off the vertical at the nearest
