"""Gauss-Legendre integrals of the rates of a motion in closed form; flights are integrated by `truth.curve`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array

# Eight Gauss-Legendre points on a panel of two radians of the fastest oscillation have an error of 2e-18 of its
# amplitude: 2^17 (8!)^4 / (17 (16!)^3) (Abramowitz and Stegun 25.4.30).
_POINTS = 8
_PHASE = 2.0  # rad
_CHUNK = 8192  # panels evaluated at once


def integrate_samples(
    rates: Callable[[Array], Array],
    edges: Array,
    fastest: float,
    breaks: ArrayLike = (),
    columns: int = 6,
    *,
    points: int = _POINTS,
) -> Array:
    """Return the integrals of a function over consecutive intervals by Gauss-Legendre quadrature.

    Args:
        rates: function of instants (M,) s, returning (M, columns); smooth between `breaks`.
        edges: increasing edges of the intervals, (N+1,) s.
        fastest: angular frequency beyond which the function has no significant content, rad/s.
        breaks: instants at which a derivative of the function may jump, (K,) s.
        points: number of points on a panel.

    Returns:
        Integrals, (N, columns).
    """
    inside = np.asarray(breaks, dtype=np.float64)
    inside = inside[(inside > edges[0]) & (inside < edges[-1])]
    corners = np.union1d(edges, inside)
    parts = np.maximum(np.ceil(np.diff(corners) * fastest / _PHASE).astype(np.intp), 1)
    length = np.repeat(np.diff(corners) / parts, parts)
    within = np.arange(len(length)) - np.repeat(np.cumsum(parts) - parts, parts)
    left = np.repeat(corners[:-1], parts) + within * length
    sample = np.searchsorted(edges, left + 0.5 * length, side="right") - 1

    nodes, weights = np.polynomial.legendre.leggauss(points)
    totals = np.zeros((len(edges) - 1, columns))
    for first in range(0, len(left), _CHUNK):
        part = slice(first, first + _CHUNK)
        half = 0.5 * length[part, None]
        time = left[part, None] + half + half * nodes
        values = rates(time.reshape(-1)).reshape(-1, points, columns)
        panels = half * np.einsum("j,nji->ni", weights, values)
        starts = np.flatnonzero(np.diff(sample[part], prepend=-1))
        # a chunk may begin in the middle of a sample, so its sums are added
        totals[sample[part][starts]] += np.add.reduceat(panels, starts, axis=0)
    return totals
