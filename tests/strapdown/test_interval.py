"""The turn in one interval against the rate and the specific force from which the increments were made."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.spatial.transform import Rotation

from sinssim.data import Array
from sinssim.strapdown.coning_sculling import BodyTurn, fitted_turn_k, weight_table

STEP = 0.1


def turns(rate: list[Polynomial], force: list[Polynomial], edges: Array, uniform: bool) -> list[BodyTurn]:
    """Return the turns in all intervals between edges, s, of a rate, rad/s, and a specific force, m/s²."""
    dtheta, dvel = (
        np.ascontiguousarray(np.stack([np.diff(part.integ()(edges)) for part in value], axis=1))
        for value in (rate, force)
    )
    weights = weight_table(edges, uniform)
    return [BodyTurn(*fitted_turn_k(dtheta, dvel, weights, uniform, k)) for k in range(len(dtheta))]


@pytest.mark.parametrize("uniform", [True, False])
def test_rate_and_force_at_the_ends_and_the_middle(uniform: bool) -> None:
    """Quadratics are fitted exactly. The force at the end is seen from the start: turned by φ, up to φ³/6."""
    rng = np.random.default_rng(3)
    rate = [Polynomial(c) for c in rng.uniform(-0.1, 0.1, (3, 3))]
    force = [Polynomial(c) for c in rng.uniform(-10.0, 10.0, (3, 3))]
    edges = STEP * (np.arange(9.0) if uniform else np.cumsum(rng.uniform(0.5, 1.5, 9)))
    for k, turn in enumerate(turns(rate, force, edges, uniform)):
        dt = edges[k + 1] - edges[k]
        for s in (-0.5, 0.0, 0.5):
            time = edges[k] + (s + 0.5) * dt
            found = np.array(turn[12:15]) + np.array(turn[15:18]) * s + np.array(turn[18:21]) * s * s
            np.testing.assert_allclose(found, [p(time) * dt for p in rate], rtol=0, atol=1e-14)
        first, last = (np.array([p(edge) for p in force]) * dt for edge in edges[k : k + 2])
        np.testing.assert_allclose(turn[6:9], first, rtol=0, atol=1e-12)
        phi = np.array(turn[:3])
        left_out = np.linalg.norm(phi) ** 3 / 6.0 * np.linalg.norm(last)
        assert np.linalg.norm(turn[9:12] - Rotation.from_rotvec(phi).apply(last)) < 1.01 * left_out + 1e-12
        np.testing.assert_allclose(turn[21:], [np.diff(p.integ()(edges[k : k + 2]))[0] for p in rate], atol=1e-16)
