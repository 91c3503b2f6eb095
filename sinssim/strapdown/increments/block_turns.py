"""Computes the body's turns for a block of intervals at once, before the engine uses them one by one.

The turns depend only on the increments and not on each other, so that the processor's vector unit can compute several
intervals in one operation. For this, the loop over a block has no branches, and each quantity is in its own row.
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.jit import inline, kernel
from sinssim.rotation.kernels import SERIES, small_rotation_series_k
from sinssim.strapdown.increments.coning_sculling import Twist, logarithm_k
from sinssim.strapdown.increments.fit import WINDOW
from sinssim.strapdown.increments.interval import BodyTurn, Weights, fitted_k, turn_of_moments_k
from sinssim.strapdown.increments.interval import fitted_turn_k as turn_k

BLOCK = 120
"""Number of intervals in a block: small enough for the first-level cache, and not a power of two, to avoid
conflicts."""

_FIELDS = len(BodyTurn._fields)
_HALF = WINDOW // 2
_ROW = BLOCK + WINDOW - 1  # samples of a channel used by the fits of a block


@inline
def empty_turns_k() -> Array:
    """Return an array for the turns of a block: BLOCK numbers for each field."""
    return np.empty(_FIELDS * BLOCK)


@inline
def turn_in_block_k(turns: Array, j: int) -> BodyTurn:
    """Turn j of a block."""
    return BodyTurn(
        turns[j], turns[BLOCK + j], turns[2 * BLOCK + j], turns[3 * BLOCK + j], turns[4 * BLOCK + j],
        turns[5 * BLOCK + j], turns[6 * BLOCK + j], turns[7 * BLOCK + j], turns[8 * BLOCK + j], turns[9 * BLOCK + j],
        turns[10 * BLOCK + j], turns[11 * BLOCK + j], turns[12 * BLOCK + j], turns[13 * BLOCK + j],
        turns[14 * BLOCK + j], turns[15 * BLOCK + j], turns[16 * BLOCK + j], turns[17 * BLOCK + j],
        turns[18 * BLOCK + j], turns[19 * BLOCK + j], turns[20 * BLOCK + j], turns[21 * BLOCK + j],
        turns[22 * BLOCK + j], turns[23 * BLOCK + j],
    )  # fmt: skip


@inline
def _keep_k(turn: BodyTurn, turns: Array, j: int) -> None:
    """Store a turn as number j of a block."""
    (
        turns[j], turns[BLOCK + j], turns[2 * BLOCK + j], turns[3 * BLOCK + j], turns[4 * BLOCK + j],
        turns[5 * BLOCK + j], turns[6 * BLOCK + j], turns[7 * BLOCK + j], turns[8 * BLOCK + j], turns[9 * BLOCK + j],
        turns[10 * BLOCK + j], turns[11 * BLOCK + j], turns[12 * BLOCK + j], turns[13 * BLOCK + j],
        turns[14 * BLOCK + j], turns[15 * BLOCK + j], turns[16 * BLOCK + j], turns[17 * BLOCK + j],
        turns[18 * BLOCK + j], turns[19 * BLOCK + j], turns[20 * BLOCK + j], turns[21 * BLOCK + j],
        turns[22 * BLOCK + j], turns[23 * BLOCK + j],
    ) = turn  # fmt: skip


@inline
def _moments_k(x: Array, channel: int, j: int, p: Weights, q: Weights) -> tuple[float, float, float]:
    """Increment, a₂ and a₃ of a channel over interval j."""
    i = channel * _ROW + j
    x0, x1, x2, x3, x4 = x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4]
    return (
        x2,
        fitted_k(p, x0, x1, x2, x3, x4),
        fitted_k(q, x0, x1, x2, x3, x4),
    )


@inline
def small_turn_k(a0: Twist, a2: Twist, a3: Twist) -> tuple[BodyTurn, float]:
    """The body's turn from increments and fitted moments, and its squared angle, which must be below `SERIES`."""
    log = logarithm_k(a0, a2, a3)
    angle2 = log[0] * log[0] + log[1] * log[1] + log[2] * log[2]
    _, b, c = small_rotation_series_k(angle2)
    return turn_of_moments_k(a0, a2, a3, log, b, c), angle2


@kernel
def _centred_turns(dtheta: Array, dvel: Array, weights: Array, start: int, end: int, turns: Array) -> bool:
    """Fill a block with the turns in intervals with centred windows, all with the same weights.

    Returns whether they are valid, that is, no rotation is too large for the series.
    """
    count = end - start
    x = np.empty(6 * _ROW)
    for j in range(count + WINDOW - 1):
        for i in range(3):
            x[i * _ROW + j] = dtheta[start - _HALF + j, i]
            x[(3 + i) * _ROW + j] = dvel[start - _HALF + j, i]
    w = weights[_HALF]
    p, q = (w[0], w[1], w[2], w[3], w[4]), (w[5], w[6], w[7], w[8], w[9])
    large = 0
    for j in range(count):
        x0, x2, x3 = _moments_k(x, 0, j, p, q)
        y0, y2, y3 = _moments_k(x, 1, j, p, q)
        z0, z2, z3 = _moments_k(x, 2, j, p, q)
        u0, u2, u3 = _moments_k(x, 3, j, p, q)
        v0, v2, v3 = _moments_k(x, 4, j, p, q)
        w0, w2, w3 = _moments_k(x, 5, j, p, q)
        a0, a2, a3 = (x0, y0, z0, u0, v0, w0), (x2, y2, z2, u2, v2, w2), (x3, y3, z3, u3, v3, w3)
        turn, angle2 = small_turn_k(a0, a2, a3)
        large += angle2 >= SERIES
        _keep_k(turn, turns, j)
    return large == 0


def fill_single_turns(
    dtheta: Array, dvel: Array, weights: Array, uniform: bool, first: int, last: int, turns: Array
) -> None:
    """Fill a block with the turns in the intervals first … last − 1, one by one; a template over `turn_k`."""
    for k in range(first, last):
        _keep_k(turn_k(dtheta, dvel, weights, uniform, k), turns, k - first)


@kernel
def fill_fitted_turns(
    dtheta: Array, dvel: Array, weights: Array, uniform: bool, first: int, last: int, turns: Array
) -> None:
    """Fill a block with the turns in the intervals first … last − 1 by the fits over their neighbours."""
    start, end = max(first, _HALF), min(last, dtheta.shape[0] - _HALF)  # intervals with a centred window
    if not uniform or start >= end or not _centred_turns(dtheta, dvel, weights, start, end, turns[start - first :]):
        start, end = last, last
    for k in range(first, last):
        if k < start or k >= end:
            _keep_k(turn_k(dtheta, dvel, weights, uniform, k), turns, k - first)
