"""Compiled kernel of the parity test: statistics of all windows, epoch by epoch, up to a fault that is isolated."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.jit import strict_kernel

Whole = NDArray[np.int64]

DETECTED, BY_WINDOW, ISOLATED, SENSOR, LAST = range(5)
"""Entries of an event: epochs of detection, of isolation and of the last test over its threshold, −1 for none."""


# Long: one pass over the epochs, whose scratch arrays are handed on from window to window.
@strict_kernel
def first_event(
    first: int, isolate: bool, gap: float, thresholds: Array, counts: Whole, start: Array, residual: Array,
    base: Array, coefficients: Array, noise: Array, columns: Array, scratch: Array, statistic: Array, event: Whole,
) -> int:  # fmt: skip
    """Test every window at every epoch until a fault is isolated, an alarm has ended, or the samples end.

    The parity vector p = V d of a window's summed readings d has the covariance C = V diag(s²) Vᵀ with

        s_i² = noise + Σ_k (Σ_b coefficients_kib Δbase_b)²

    where Δ is the difference between the window's end and its beginning. The statistic is D = pᵀ C⁻¹ p, and sensor i is
    credited with (v_iᵀ C⁻¹ p)²/(v_iᵀ C⁻¹ v_i), which is the part of D that a fault of this sensor explains.

    Args:
        gap: by how much the largest credit must exceed the second.
        thresholds: threshold of each window, (W,).
        counts: samples of each window, increasing, (W,).
        start: time of the edges since the start, (N+1,) s.
        residual: accumulated residuals of the readings, (N+1, m).
        base: accumulated inputs, (N+1, B).
        coefficients: 1σ of the errors per unit of input, (K, m, B).
        noise: variance of a window's noise, and its growth with the start of the window, (W, 2).
        columns: V, (n, m).
        scratch: working memory, (n + 4, max(m, n)).
        statistic: D of each window and epoch, NaN before a window is complete; filled, (W, N).
        event: what happened; filled, (5,).
    """
    freedom, sensors = columns.shape
    epochs = statistic.shape[1]
    parity, credit_row, readings, variance = scratch[freedom], scratch[freedom + 1], scratch[freedom + 2], scratch[-1]
    for i in range(5):
        event[i] = -1
    for k in range(first, epochs):
        over = False
        for w in range(len(counts)):
            since = k + 1 - counts[w]
            if since < 0:
                statistic[w, k] = np.nan
                continue
            common = noise[w, 0] + noise[w, 1] * start[since]
            for i in range(sensors):
                readings[i] = residual[k + 1, i] - residual[since, i]
                total = common
                for c in range(coefficients.shape[0]):
                    part = 0.0
                    for b in range(base.shape[1]):
                        part += coefficients[c, i, b] * (base[k + 1, b] - base[since, b])
                    total += part * part
                variance[i] = total
            # Cholesky factor of C in the first rows of the scratch, and z = L⁻¹ p
            value = 0.0
            for a in range(freedom):
                for b in range(a + 1):
                    total = 0.0
                    for i in range(sensors):
                        total += columns[a, i] * columns[b, i] * variance[i]
                    for c in range(b):
                        total -= scratch[a, c] * scratch[b, c]
                    scratch[a, b] = math.sqrt(total) if a == b else total / scratch[b, b]
                total = 0.0
                for i in range(sensors):
                    total += columns[a, i] * readings[i]
                for c in range(a):
                    total -= scratch[a, c] * parity[c]
                parity[a] = total / scratch[a, a]
                value += parity[a] * parity[a]
            statistic[w, k] = value
            if not value > thresholds[w]:
                continue
            over = True
            if event[DETECTED] < 0:
                event[DETECTED], event[BY_WINDOW] = k, w
            if not isolate:
                continue
            best, second, suspect = -1.0, -1.0, -1
            for i in range(sensors):
                above, below = 0.0, 0.0
                for a in range(freedom):
                    total = columns[a, i]
                    for c in range(a):
                        total -= scratch[a, c] * credit_row[c]
                    credit_row[a] = total / scratch[a, a]
                    above += credit_row[a] * parity[a]
                    below += credit_row[a] * credit_row[a]
                credit = above * above / below if below > 0.0 else 0.0
                if credit > best:
                    best, second, suspect = credit, best, i
                elif credit > second:
                    second = credit
            if best - second >= gap:
                event[ISOLATED], event[SENSOR], event[LAST] = k, suspect, k
                return k
        if over:
            event[LAST] = k
        elif event[DETECTED] >= 0 and k - event[LAST] > counts[-1]:
            return k
    return int(epochs)
