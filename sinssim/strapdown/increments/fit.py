"""Fits rate and specific force within an interval to the increments of its neighbours.

A polynomial of the fourth degree is fitted to the increments of five neighbouring intervals (its integral over each is
the increment), centred on the interval as far as the ends of the data allow. The engine needs only the moments over
that interval, so the fit is a set of weights: a₂ = Σ w₂ⱼ Δⱼ and a₃ = Σ w₃ⱼ Δⱼ, where rate × T ≈ a₁ + a₂ s + a₃ s² over
s ∈ [−½, ½] in the sense of the moments of Blanes, Casas and Ros (BIT 40, 2000, sec. 3): a₂ = 12 A₁, a₃ = 180 A₂ − 15
A₀, a₁ = A₀ − a₃/12, with Aᵢ = ∫ sⁱ rate T ds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array

WINDOW = 5
"""Number of neighbouring intervals in a fit."""

UNIFORM = 1e-6
"""Intervals that differ by less than this fraction count as equal."""


def is_uniform(time: Array) -> bool:
    """Return whether all intervals are equal, to `UNIFORM`.

    Args:
        time: edges of the intervals, (N+1,) s.
    """
    step = (time[-1] - time[0]) / (len(time) - 1)
    deviation = 0.0
    for start in range(0, len(time) - 1, 65536):  # in blocks, to avoid a temporary as long as the data
        block = np.diff(time[start : start + 65537])
        deviation = max(deviation, float(np.max(np.abs(block - step))))
    return bool(deviation <= UNIFORM * step)


def moment_weights(edges: Array, position: NDArray[np.intp]) -> Array:
    """Return the weights of a₂ and a₃ for fits over given windows.

    Args:
        edges: times of the edges of each window's n intervals, (M, n+1) s.
        position: number of the fitted interval in its window, (M,) int.

    Returns:
        Weights w₂ in columns 0…4 and w₃ in columns 5…9, (M, 10); columns beyond n are zero.
    """
    count, n = len(edges), edges.shape[1] - 1
    rows = np.arange(count)
    left, right = edges[rows, position], edges[rows, position + 1]
    s = (edges - 0.5 * (left + right)[:, None]) / (right - left)[:, None]
    powers = np.arange(1, n + 1)
    raised = s[:, :, None] ** powers / powers  # ∫ s^(m−1) ds = s^m/m
    integrals = np.diff(raised, axis=1)  # (M, interval j, power m)
    # moments of s^m over [−½, ½] with s and s²: ∫ s^(m+i) ds
    moments = np.zeros((n, 2))
    for m in range(n):
        for i in (1, 2):
            if (m + i) % 2 == 0:
                moments[m, i - 1] = 2.0 * 0.5 ** (m + i + 1) / (m + i + 1)
    # increments = integrals @ c, A_i = moments_iᵀ c  ⇒  weights_i solve integralsᵀ w = moments_i
    solved = np.linalg.solve(np.swapaxes(integrals, 1, 2), np.broadcast_to(moments, (count, n, 2)))
    weights = np.zeros((count, 2 * WINDOW))
    weights[:, :n] = 12.0 * solved[:, :, 0]
    weights[:, WINDOW : WINDOW + n] = 180.0 * solved[:, :, 1]
    weights[rows, WINDOW + position] -= 15.0
    return weights


def weight_table(time: Array, uniform: bool) -> Array:
    """Return the weights for the engine.

    Args:
        time: edges of the intervals, (N+1,) s.

    Returns:
        For uniform intervals one row for each position in the window, (min(N, 5), 10); otherwise one for each interval,
            (N, 10).
    """
    count = len(time) - 1
    n = min(count, WINDOW)
    if uniform:
        return moment_weights(np.broadcast_to(np.arange(n + 1.0), (n, n + 1)), np.arange(n))
    table = np.empty((count, 2 * WINDOW))
    for start in range(0, count, 8192):
        k = np.arange(start, min(start + 8192, count))
        first = np.clip(k - n // 2, 0, count - n)
        table[k] = moment_weights(time[first[:, None] + np.arange(n + 1)], k - first)
    return table
