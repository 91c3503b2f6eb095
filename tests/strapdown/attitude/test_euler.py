"""How the Euler angles' step takes its sines afresh, and what keeps it from dividing by zero."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sinssim.rotation import multiply, rotation_vector_from_quaternion
from sinssim.strapdown.attitude.euler import _rates_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn

STILL = FrameTurn(*[0.0] * 12)
TURNING = BodyTurn(*[0.0] * 12, 0.01, -0.02, 0.03, *[0.0] * 6, 0.01, -0.02, 0.03)


@pytest.mark.parametrize("age", [0, 7, 8])
def test_every_eighth_step_sines_come_from_the_angles(age: int) -> None:
    """Sine and cosine of half the heading do not enter the rates: what is wrong with them stays until then."""
    roll, pitch, heading = angles = np.array([0.3, -0.2, 1.1])
    sines = np.stack([np.sin(angles / 2.0), np.cos(angles / 2.0)], axis=1)
    sines[2] += 1e-6
    *found, after = step_k((roll, pitch, heading, *sines.ravel(), age), TURNING, STILL)
    angles, sines = np.array(found[:3]), np.reshape(found[3:], (3, 2))
    off = np.abs(sines - np.stack([np.sin(angles / 2.0), np.cos(angles / 2.0)], axis=1)).max(axis=1)
    assert np.all(off[:2] < 4e-16)
    assert off[2] < 4e-16 if age == 8 else off[2] > 5e-7
    assert after == (1 if age == 8 else age + 1)


@pytest.mark.parametrize(("cosine", "taken"), [(0.0, 1e-9), (1e-12, 1e-9), (-1e-12, -1e-9), (2e-9, 2e-9), (-0.5, -0.5)])
def test_the_cosine_of_pitch_never_vanishes(cosine: float, taken: float) -> None:
    """φ̇ = ω_x + tan θ (ω_y sin φ + ω_z cos φ), θ̇ = ω_y cos φ − ω_z sin φ, ψ̇ = (ω_y sin φ + ω_z cos φ)/cos θ."""
    sr, cr, sp, (x, y, z) = 0.6, 0.8, 0.9, (0.1, 0.2, 0.3)
    turn = (y * sr + z * cr) / taken
    np.testing.assert_allclose(
        _rates_k(sr, cr, sp, cosine, x, y, z), [x + sp * turn, y * cr - z * sr, turn], rtol=1e-14
    )


def test_a_body_that_speeds_up_in_a_frame_that_turns() -> None:
    """A rate a1 + a2 s + a3 s², s from −½ to ½, and a frame at 2° a step: the kinematic equation of quaternions."""
    a1, a2, a3 = (np.array(a) for a in ((0.003, -0.006, 0.009), (0.002, 0.003, -0.001), (0.002, -0.0016, 0.002)))
    frame, start = np.array([0.02, -0.014, 0.024]), np.array([0.9, 0.1, -0.3, 0.3])

    def turned(begin: np.ndarray, u: np.ndarray) -> np.ndarray:
        def rate(s: float, q: np.ndarray) -> np.ndarray:
            body = np.array([0.0, *(a1 + a2 * s + a3 * s * s)])
            return 0.5 * (multiply(q, body) - multiply(np.array([0.0, *u]), q))

        return solve_ivp(rate, (-0.5, 0.5), begin, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]

    phi = rotation_vector_from_quaternion(turned(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)))
    body = BodyTurn(*phi, *[0.0] * 9, *a1, *a2, *a3, *phi)
    turning = FrameTurn(*frame, *frame, *frame, *frame)
    computed = np.array(quaternion_k(step_k(start_k(*start), body, turning))[:4])
    assert np.abs(computed - turned(start, frame)).max() < 1e-7  # a wrong sign of a3 makes 9e-7 to 1.4e-6
