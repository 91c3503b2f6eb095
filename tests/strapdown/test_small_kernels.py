"""The engine's building blocks one by one, where a flight of ordinary rates would hide their higher orders."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import logm
from scipy.spatial.transform import Rotation

from sinssim.rotation import cross_k
from sinssim.strapdown.attitude.euler import _seen_after_k
from sinssim.strapdown.frames.azimuth import turned_k
from sinssim.strapdown.increments.coning_sculling import logarithm_k


@pytest.mark.parametrize(("kernel", "order"), [(turned_k, 3), (_seen_after_k, 4)])
def test_a_vector_seen_from_axes_that_turn(kernel, order) -> None:
    """exp(−[r×]) x, up to the first term that is left out, |r|ⁿ/n!."""
    for r in np.random.default_rng(1).uniform(-0.02, 0.02, (20, 3)):
        x = np.array([1.0, -2.0, 3.0]) + r
        expected = Rotation.from_rotvec(r).apply(x, inverse=True)
        left_out = np.linalg.norm(r) ** order / np.prod(np.arange(1, order + 1)) * np.linalg.norm(x)
        assert np.linalg.norm(np.array(kernel(*r, *x) if order == 4 else kernel(*x, *r)) - expected) < 1.01 * left_out


def twist_matrix(twist):
    """Return the matrix of a rate and a force, (4, 4)."""
    out = np.zeros((4, 4))
    out[:3, :3] = np.array([cross_k(*twist[:3], *axis) for axis in np.eye(3)]).T
    out[:3, 3] = twist[3:]
    return out


def test_the_logarithm_is_of_the_sixth_order() -> None:
    """Y' = Y A(t) with a quadratic rate and force, against an integrator and the matrix logarithm."""
    a, b, c = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 6))
    off = []
    for h in (0.5, 0.25):

        def slope(s, y, h=h):
            return (y.reshape(4, 4) @ twist_matrix(h * a + h**2 * b * s + h**3 * c * s * s)).ravel()

        end = solve_ivp(slope, (-0.5, 0.5), np.eye(4).ravel(), method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        log = logm(end.reshape(4, 4)).real
        expected = np.array([log[2, 1], log[0, 2], log[1, 0], *log[:3, 3]])
        moments = (h * a + h**3 * c / 12.0, h**2 * b, h**3 * c)
        off.append(np.abs(np.array(logarithm_k(*(tuple(m) for m in moments))) - expected))
    assert off[0].max() < 5e-6
    assert np.all(off[0] > 2.0**6.5 * off[1])
