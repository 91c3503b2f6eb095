"""The power of time with which the error of a block without gyros grows, in closed form and fitted.

An error δω̇ of the angular acceleration tilts a level block by ½ δω̇ t². By (8.14) the position error of a block at rest
is

    Δp = R δω̇ (½ t² − (1 − cos ω_s t)/ω_s²)  →  g δω̇ t⁴/24 for ω_s t → 0

With θ = ω_s t its local power of time, d log Δp/d log t, is (θ² − θ sin θ)/(½ θ² − 1 + cos θ): 4 at first, exactly 2
after every Schuler period, and around 2 beyond the first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.experiments.studies.results import ErrorGrowth

SCHULER_RATE = np.sqrt(9.81 / 6371000.0)
"""ω_s, rad/s."""
SCHULER_PERIOD = 2.0 * np.pi / SCHULER_RATE
"""s, 84.4 min."""
EARLY = 1000.0
"""End of the first band, s: there the closed form's local power is still 3.90."""
SMALL_TILT_DEG = 5.0
"""Tilt up to which the errors of a block without gyros are linear."""

_LEAST_ERROR = 1e-4  # m; a smaller one contains rounding, and gravity's gradient over the arms
_FORCE_PART = 100.0  # at this multiple of 12 ℓ/g, t², the biases' direct effect ½ δf t² is below one percent
_FEWEST = 5


def coordinate(time: ArrayLike) -> Array:
    """Return the closed form of the position error for R δω̇ = 1.

    Args:
        time: (N,) s.

    Returns:
        ½ t² − (1 − cos ω_s t)/ω_s², (N,) s²; a series where the difference would lose digits.
    """
    x = (SCHULER_RATE * np.asarray(time, dtype=np.float64)) ** 2
    series = x * x / 24.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0))
    exact = 0.5 * x - 2.0 * np.sin(0.5 * np.sqrt(x)) ** 2
    return np.asarray(np.where(x < 0.01, series, exact) / SCHULER_RATE**2)


def local_power(time: ArrayLike) -> Array:
    """Return the local power of time of the closed form.

    Args:
        time: (N,) s.

    Returns:
        d log Δp/d log t, (N,).
    """
    t = np.asarray(time, dtype=np.float64)
    theta = SCHULER_RATE * t
    x = theta * theta
    slope = np.where(x < 0.01, x * x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0)), x - theta * np.sin(theta))
    return np.asarray(slope / (SCHULER_RATE**2 * coordinate(t)))


def linear_part(growth: ErrorGrowth, arm: float) -> tuple[Array, Array]:
    """Return the part of an error's growth to which the closed form applies.

    Args:
        arm: arm of its cube, m.

    Returns:
        Time since the start, s, and horizontal error, m: from where the direct effect of the biases is below one
        percent, and the error above rounding, to a tilt of `SMALL_TILT_DEG`.
    """
    t = growth.time - growth.time[0]
    tilted = growth.attitude > SMALL_TILT_DEG * 3600.0
    end = int(np.argmax(tilted)) if tilted.any() else len(t)
    small = np.flatnonzero((growth.horizontal[:end] < _LEAST_ERROR) | (t[:end] ** 2 < _FORCE_PART * 12.0 * arm / 9.81))
    first = int(small[-1]) + 1 if len(small) else 0
    return t[first:end], growth.horizontal[first:end]


def fitted_power(time: Array, error: Array, start: float, end: float) -> tuple[float, float]:
    """Fit the power of time between two instants, with points spread evenly over the logarithm of time.

    Args:
        time: (N,) s.
        error: (N,) m.
        start, end: the band, s.

    Returns:
        The power, and that of the closed form over the same instants; NaN if the band is not covered.
    """
    low, high = max(start, time[0] if len(time) else np.inf), min(end, time[-1] if len(time) else 0.0)
    if np.count_nonzero((time >= low) & (time <= high)) < _FEWEST or high < 1.5 * low:
        return float("nan"), float("nan")
    at = np.geomspace(low, high, 64)
    x = np.log(at)
    measured = np.interp(x, np.log(time), np.log(error))
    return float(np.polyfit(x, measured, 1)[0]), float(np.polyfit(x, np.log(coordinate(at)), 1)[0])
