"""How much faster the clock of an inertial unit runs than that of a satellite receiver, by the match of the velocities.

Offset and drift are those with the least residual. The drift turns the times about the middle of the log, so that the
two are nearly independent. The 1σ follows from the scatter of the windows' gradients (the sandwich estimator, White,
Econometrica 48, 1980, with each window as one group), because the residuals within a window are correlated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sinssim.analyses.inspection.times.offset import Offset
from sinssim.analyses.inspection.velocity_match import Match, Seen, match, pushed
from sinssim.data import Array

_RATE = 25.0  # samples a second are enough for the question
_LEAST_WINDOWS = 8
_STEPS = np.array([0.03, 0.06])
"""Steps of the differences: of the offset, and of the change of the offset over the log, s."""
_FAR = (0.0, -0.3, 0.3, -0.6, 0.6, -1.0, 1.0, -1.5, 1.5)
"""Changes of the offset over the log that are tried if the match is poor, s."""
_HOPELESS, _WORTH = 10.0, 3.0
"""Residuals, in units of a trusted one, beyond which no drift is searched, and none is improved."""
_ROUNDS = 8
_NEAR = 1e-4  # s; the end of the improvements
_CHANCE = 1e-4
"""Probability that clocks without a drift seem to have one."""
_LEAST = 0.02
"""Change of the offset over the log that matters, s: about the uncertainty of an offset."""


@dataclass(frozen=True)
class Drift:
    """The drift of the unit's clock.

    Attributes:
        value: relative to the clock of the fixes, s/s; positive if the unit's clock runs fast.
        sigma: 1σ, s/s.
    """

    value: float
    sigma: float


def even_times(time: Array, drift: float) -> Array:
    """Return times that run as fast as those of the fixes, with the same first one.

    Args:
        time: of the unit, (N,) s.
        drift: s/s.
    """
    return np.asarray(time[0] + (time - time[0]) / (1.0 + drift))


def clock_drift(readings: tuple[Array, Array, Array], fixes: Seen, offset: Offset, good: float) -> Drift | None:
    """Find the drift of the clocks.

    Args:
        readings: times (N,) s, rates (N, 3) rad/s, specific forces (N, 3) m/s².
        good: residual up to which a match is trusted, m/s.

    Returns:
        The drift; None if the data show none, or none that matters.
    """
    from scipy.stats import t as student

    time, rate, force = readings
    length = float(time[-1] - time[0])
    middle = 0.5 * float(time[0] + time[-1])

    def tried(at: Array) -> Match:
        even = middle + (time - middle) / (1.0 + at[1] / length)
        curve = pushed(even, rate, force, _RATE)
        return match(curve, fixes, float(at[0]), window=offset.match.window, bias=offset.match.bias, rounds=1)

    at = np.array([offset.value, 0.0])
    if offset.match.residual > _HOPELESS * good:  # units or axes are wrong; see the hypotheses
        return None
    if offset.match.residual > good:
        at = min((np.array([offset.value, far]) for far in _FAR), key=lambda x: tried(x).residual)
        if tried(at).residual > _WORTH * good:
            return None
    for _ in range(_ROUNDS):
        change = _step(tried, at)
        at = at + change
        if np.abs(change).max() < _NEAR:
            break
    found = tried(at)
    if found.residual > good or len(found.each) < _LEAST_WINDOWS or abs(at[1]) < _LEAST:
        return None
    sigma = _sigma(tried, at)
    if not abs(at[1]) > float(student.ppf(1.0 - 0.5 * _CHANCE, len(found.each) - 2)) * sigma:
        return None
    return Drift(float(at[1]) / length, sigma / length)


def _step(tried: Callable[[Array], Match], at: Array) -> Array:
    """Return the change of offset and drift to the least of the parabola through three residuals each, (2,) s."""
    here, change = tried(at).residual ** 2, np.zeros(2)
    for k in range(2):
        h = np.zeros(2)
        h[k] = _STEPS[k]
        low, high = tried(at - h).residual ** 2, tried(at + h).residual ** 2
        bend = low - 2.0 * here + high
        most = 10.0 * _STEPS[k]
        newton = 0.5 * _STEPS[k] * (low - high) / bend if bend > 0.0 else most * np.sign(low - high)
        change[k] = np.clip(np.nan_to_num(newton), -most, most)  # residuals are infinite where nothing overlaps
    return change


def _sigma(tried: Callable[[Array], Match], at: Array) -> float:
    """Return the 1σ of the change of the offset over the log, s."""
    here = tried(at).each ** 2
    gradients, bends = [], []
    for k in range(2):
        h = np.zeros(2)
        h[k] = _STEPS[k]
        low, high = tried(at - h).each ** 2, tried(at + h).each ** 2
        count = min(len(low), len(high), len(here))
        gradients.append((high[:count] - low[:count]) / (2.0 * _STEPS[k]))
        bends.append(float(np.sum(low[:count] - 2.0 * here[:count] + high[:count])) / _STEPS[k] ** 2)
    count = min(map(len, gradients))
    scatter = float(np.sum(gradients[1][:count] ** 2)) * count / max(count - 2, 1)
    return float(np.sqrt(scatter)) / bends[1] if bends[1] > 0.0 else float("inf")
