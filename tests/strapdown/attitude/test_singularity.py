"""What the passage of a solution through pitch ±90° is said to cost, against rotations that are known."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import rotation
from sinssim.data import NavSolution, NavState
from sinssim.strapdown.navigate import singularity_events


def solution(pitch_deg: list[float], twist_deg: float) -> NavSolution:
    """Return a solution with these pitches, one a second; its last attitude is turned about its own x axis."""
    pitch = np.radians(pitch_deg)
    zero = np.zeros_like(pitch)
    q_nb = rotation.quaternion_from_euler(zero, pitch, zero)
    twist = rotation.quaternion_from_rotation_vector(np.radians([twist_deg, 0.0, 0.0]))
    q_nb[-1] = rotation.multiply(q_nb[-1], twist)
    return NavSolution(np.arange(len(pitch)) + 10.0, zero, zero, zero, np.zeros((len(pitch), 3)), q_nb, zero, "euler")


def test_a_passage_and_its_damage() -> None:
    """Pitch rises to 89.5° and back; afterwards the attitude is 0.1° off, 360″. The passage lasts from 11 s to 15 s."""
    pitch = [70.0, 80.0, 86.0, 89.5, 86.0, 80.0]
    true = solution(pitch, 0.0)

    def without_singularity(first: int, last: int, state: NavState) -> NavSolution:
        assert (first, last) == (1, 5)
        np.testing.assert_allclose(state.q_nb, true.q_nb[1])
        return true

    (event,) = singularity_events(solution(pitch, 0.1), without_singularity)
    assert event.damage == pytest.approx(np.radians(0.1))
    assert event.text == (
        "euler: pitch came within 0.50° of ±90° between 11.00 s and 15.00 s; the resulting attitude error is 360″."
    )
