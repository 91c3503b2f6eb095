"""A first-order lag, such as that of pressure in a tube."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate

import numpy as np

from sinssim.data import Array

_STEPS = 32
"""Steps per time constant: linear interpolation of the signal x is then in error by at most (τ/32)² x″/8."""

_SHORTEST = 1e-3
"""Shortest step, s: linear interpolation over it is in error by x″ · 1.3e-7 s², for a height at 5 g 6 µm."""

_FORGOTTEN = 40.0
"""Time constants after which the weight of the past is e⁻⁴⁰ = 4e-18, less than the rounding of a double."""

_BLOCK = 1 << 18
"""Maximum number of signal values in memory."""


def lagged(signal: Callable[[Array], Array], start: float, time: Array, lag: float) -> Array:
    """Return the response of a first-order lag, τ ẏ = x − y, to a signal, with y = x at the start.

    Over a step h on which x is linear, y has a closed form for every h/τ: y₁ = e⁻ᵃ y₀ + (1 − r) x₁ + (r − e⁻ᵃ) x₀ with
    a = h/τ and r = (1 − e⁻ᵃ)/a. The steps cover the time between two readings, or its last 40 τ if these are shorter.
    Memory does not grow with the length of the run, and the number of steps is bounded for every τ.

    Args:
        signal: x at instants (K,) s.
        start: first instant, s.
        time: instants of the output, in order, (M,) s.
        lag: time constant τ, s; 0 for no lag.

    Returns:
        y, (M,).
    """
    if not lag:
        return signal(time)
    between = np.diff(time, prepend=start)
    window = np.minimum(between, _FORGOTTEN * lag)
    count = max(int(np.ceil(window.max() / max(lag / _STEPS, _SHORTEST))), 1)
    a = window / (count * lag)
    decay = np.exp(-a)
    rise = np.divide(-np.expm1(-a), a, out=np.ones_like(a), where=a > 0.0)
    came = np.empty(len(time))
    rows = max(_BLOCK // (count + 1), 1)
    for first in range(0, len(time), rows):
        part = slice(first, first + rows)
        steps = np.linspace(-window[part], 0.0, count + 1, axis=1)
        x = signal(np.maximum(time[part, None] + steps, start).ravel()).reshape(steps.shape)
        r, d = rise[part, None], decay[part, None]
        fresh = (1.0 - r) * x[:, 1:] + (r - d) * x[:, :-1]
        came[part] = np.sum(fresh * d ** np.arange(count - 1, -1, -1), axis=1)
    kept = np.exp(-between / lag)
    first_value = float(signal(np.array([start]))[0])
    after = accumulate(zip(kept, came, strict=True), lambda y, step: step[0] * y + step[1], initial=first_value)
    return np.fromiter(after, dtype=np.float64, count=len(time) + 1)[1:]
