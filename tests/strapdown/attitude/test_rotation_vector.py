"""The turn of n samples term by term, from the papers' formulas written out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.spatial.transform import Rotation

from sinssim.data import Array
from sinssim.strapdown.coning_sculling import BLOCK, BodyTurn
from sinssim.strapdown.engine_assembly import parts

PAIRS = {1: {}, 2: {1: 2 / 3}, 3: {1: 27 / 40, 2: 9 / 20}, 4: {1: 214 / 315, 2: 46 / 105, 3: 54 / 105}}
"""Coefficient of a pair of samples by their distance: Ignagni 1990, Miller 1983, Ignagni 1996."""


def increments(count: int) -> tuple[Array, Array]:
    dtheta, dvel = np.random.default_rng(count).uniform(-0.05, 0.05, (2, count, 3))
    return dtheta, 10.0 * dvel


def compared(found: BodyTurn, phi: Array, nu: Array, force: tuple[Array, Array], theta: Array) -> None:
    """Compare a turn with φ, ν, forces at its ends in the axes there, and the plain increment."""
    np.testing.assert_allclose(found[0:3], phi, rtol=0, atol=1e-15)
    nodes, weights = leggauss(8)
    turned = sum(
        w / 2.0 * Rotation.from_rotvec((1.0 + x) / 2.0 * phi).apply(nu) for x, w in zip(nodes, weights, strict=True)
    )
    np.testing.assert_allclose(found[3:6], turned, rtol=0, atol=1e-15)
    np.testing.assert_allclose(found[6:9], force[0], rtol=0, atol=1e-14)
    off = np.linalg.norm(found[9:12] - Rotation.from_rotvec(phi).apply(force[1]))
    assert off < np.linalg.norm(phi) ** 3 / 6.0 * np.linalg.norm(force[1])
    np.testing.assert_allclose(found[12:15], theta, rtol=0, atol=1e-15)
    assert not any(found[15:21])  # slope and curvature of a rate that is taken for constant
    np.testing.assert_allclose(found[21:24], theta, rtol=0, atol=1e-15)


@pytest.mark.parametrize("samples", PAIRS)
def test_turn_of_an_update(samples: int) -> None:
    """φ = Σ Δθᵢ + Σ K Δθᵢ × Δθⱼ and ν = Σ Δvᵢ + Σ K (Δθᵢ × Δvⱼ + Δvᵢ × Δθⱼ)."""
    dtheta, dvel = increments(3 * samples)
    turn_k = parts(f"rotation-vector-{samples}")["turn_k"]
    # the polynomial through the samples' integrals, at its ends
    powers = np.arange(1, samples + 1)
    edges = np.arange(samples + 1.0)[:, None]
    fit = np.linalg.inv(np.diff(edges**powers / powers, axis=0))
    for k in range(3):
        own = slice(samples * k, samples * (k + 1))
        a, v = dtheta[own], dvel[own]
        phi, nu = a.sum(axis=0), v.sum(axis=0)
        for i in range(samples):
            for j in range(i + 1, samples):
                phi = phi + PAIRS[samples][j - i] * np.cross(a[i], a[j])
                nu = nu + PAIRS[samples][j - i] * (np.cross(a[i], v[j]) + np.cross(v[i], a[j]))
        start, end = (samples * (x ** (powers - 1.0) @ fit) @ v for x in (0.0, float(samples)))
        found = turn_k(dtheta, dvel, np.empty((0, 10)), True, k)
        compared(found, phi, nu, (start, end), a.sum(axis=0))


@pytest.mark.parametrize("count", [1, 2, 5])
def test_turn_with_the_sample_before(count: int) -> None:
    """φ = Δθ + Δθ₋₁ × Δθ/12; the first sample has none before it and takes the next, a single one takes none."""
    dtheta, dvel = increments(count)
    turn_k = parts("rotation-vector-1p")["turn_k"]
    for k in range(count):
        a, b = (k - 1, k) if k else (0, min(1, count - 1))
        phi = dtheta[k] + np.cross(dtheta[a], dtheta[b]) / 12.0
        nu = dvel[k] + (np.cross(dtheta[a], dvel[b]) + np.cross(dvel[a], dtheta[b])) / 12.0
        half = (dvel[b] - dvel[a]) / 2.0
        found = turn_k(dtheta, dvel, np.empty((0, 10)), True, k)
        compared(found, phi, nu, (dvel[k] - half, dvel[k] + half), dtheta[k])


@pytest.mark.parametrize("algorithm", [f"rotation-vector-{n}" for n in ("1", "1p", "2", "3", "4")])
def test_navigation_takes_these_turns(algorithm: str) -> None:
    """The blocks of turns that the engines read are those of the algorithm, not the fits of other algorithms."""
    of_algorithm = parts(algorithm)
    dtheta, dvel = increments(8)
    turns = np.empty(len(BodyTurn._fields) * BLOCK)
    of_algorithm["fill_turns"](dtheta, dvel, np.empty((0, 10)), True, 0, 2, turns)
    for k in range(2):
        expected = of_algorithm["turn_k"](dtheta, dvel, np.empty((0, 10)), True, k)
        assert tuple(turns.reshape(-1, BLOCK)[:, k]) == tuple(expected)
