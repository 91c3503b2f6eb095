"""A first-order lag, as pressure in a tube has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sinssim.data import Array

_STEPS = 32
"""Steps within a time constant; a straight line instead of the signal is off by at most (τ/32)²/8 of its curvature."""


def lagged(signal: Callable[[Array], Array], start: float, time: Array, lag: float) -> Array:
    """Return what a first-order lag, τ ẏ = x − y, makes of a signal; it is settled at the start.

    Where x is a straight line of slope s, y has a closed form, y(t) = x(t) − τ s + exp(−t/τ) (y₀ − x₀ + τ s).

    Args:
        signal: x at instants (K,) s.
        start: first instant, s.
        time: instants of the output, in order, (M,) s.
        lag: time constant τ, 0 for none, s.

    Returns:
        y, (M,).
    """
    if not lag:
        return signal(time)
    from scipy.signal import lfilter

    count = int(np.ceil((time[-1] - start) / lag * _STEPS))
    grid, step = np.linspace(start, time[-1], count + 1, retstep=True)
    x, ratio, decay = signal(grid), lag / step, np.exp(-step / lag)
    rise = ratio * (1.0 - decay)
    now, before = 1.0 - rise, rise - decay  # y₁ = now x₁ + before x₀ + decay y₀
    y = lfilter([now, before], [1.0, -decay], x, zi=[(1.0 - now) * x[0]])[0]

    k = np.minimum(np.searchsorted(grid, time, side="right") - 1, count - 1)
    passed, slope = time - grid[k], np.diff(x)[k] / step
    settled = x[k] + slope * (passed - lag)
    return np.asarray(settled + np.exp(-passed / lag) * (y[k] - x[k] + lag * slope))
